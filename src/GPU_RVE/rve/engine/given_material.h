// SPDX-License-Identifier: GPL-2.0-only
// Parameters of a material that an input gives, and those that it leaves open.

#pragma once

#include "rve/engine/state.h"

#include <iterator>
#include <optional>

namespace rve {

/// Parameters of the material that an input gives. The others have no value.
class GivenMaterial {
 public:
  std::optional<double> &operator[](MaterialMember member);
  const std::optional<double> &operator[](MaterialMember member) const;

  /// Overwrites the parameters of `material` that have values here. If there is a rolling friction
  /// but no rolling stiffness, the rolling stiffness becomes the tangential stiffness; this throws
  /// InputError if the contact law has no tangential stiffness.
  void apply(Material &material) const;

  /// Returns true if any parameter or the contact law has a value.
  bool any() const;
  /// Replaces the values of this object by the values that `later` has.
  void add(const GivenMaterial &later);

  /// Contact law of the keyword *contact*, which also gives all parameters of the contact.
  std::optional<ContactLaw> law;

 private:
  std::optional<double> values[std::size(MATERIAL_PARAMETERS)];
};

}    // namespace rve
