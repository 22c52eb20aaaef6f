// SPDX-License-Identifier: GPL-2.0-only
// The material of grains as scripts give it to fix rve and create_rve.

#pragma once

#include "lammps/script_words.h"
#include "rve/engine/state.h"

#include <iterator>
#include <optional>

namespace LAMMPS_NS {

/// The keywords of rve::MATERIAL_PARAMETERS, and *contact*, which gives the contact law in the words of LAMMPS.
rve::Words material_keywords();

/// Properties of the material that the script gives.
class MaterialWords {
 public:
  /// Reads the value of the keyword that the words are at, and says whether it is one of the material.
  bool read(ScriptWords &words);

  std::optional<double> &operator[](rve::MaterialMember member);
  const std::optional<double> &operator[](rve::MaterialMember member) const;

  /// A rolling friction without a rolling stiffness, here or in the material, gets the tangential one; throws InputError where the
  /// contact law has none.
  void apply(rve::Material &material) const;

  bool any() const;
  /// What is said later counts.
  void add(const MaterialWords &later);

  /// That of *contact*, which gives all parameters of it.
  std::optional<rve::ContactLaw> law;

 private:
  std::optional<double> values[std::size(rve::MATERIAL_PARAMETERS)];
};

/// Changes a material as the words say, and its inertia from one mass scaling to another.
void change_material(rve::Material &material, const MaterialWords &words, double mass_scaling,
                     double mass_scaling_before);

}    // namespace LAMMPS_NS
