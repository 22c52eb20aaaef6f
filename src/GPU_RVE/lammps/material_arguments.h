// SPDX-License-Identifier: GPL-2.0-only
// Keywords of fix rve and create_rve for the material of grains.

#pragma once

#include "lammps/script_arguments.h"
#include "rve/engine/state.h"

#include <iterator>
#include <optional>

namespace LAMMPS_NS {

/// Returns the keywords of rve::MATERIAL_PARAMETERS and *contact*, which gives the contact law in
/// the syntax of LAMMPS' pair_style granular.
rve::Words material_keywords();

/// Parameters of the material that a script gives. The others have no value.
class MaterialArguments {
 public:
  /// Reads the values of the current keyword. Returns false if it is no keyword of the material.
  /// An error ends in error->all.
  bool read(ScriptArguments &words);

  std::optional<double> &operator[](rve::MaterialMember member);
  const std::optional<double> &operator[](rve::MaterialMember member) const;

  /// Overwrites the parameters of `material` that have values here. If there is a rolling friction
  /// but no rolling stiffness, the rolling stiffness becomes the tangential stiffness; this throws
  /// InputError if the contact law has no tangential stiffness.
  void apply(rve::Material &material) const;

  /// Returns true if any parameter or the contact law has a value.
  bool any() const;
  /// Replaces the values of this object by the values that `later` has.
  void add(const MaterialArguments &later);

  /// Contact law of the keyword *contact*, which also gives all parameters of the contact.
  std::optional<rve::ContactLaw> law;

 private:
  std::optional<double> values[std::size(rve::MATERIAL_PARAMETERS)];
};

/// Applies `words` to a material and changes its mass scaling from `mass_scaling_before` to
/// `mass_scaling` [-]. The mass scaling is a factor in the mass depth of the material.
void change_material(rve::Material &material, const MaterialArguments &words, double mass_scaling,
                     double mass_scaling_before);

}    // namespace LAMMPS_NS
