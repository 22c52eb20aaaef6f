// SPDX-License-Identifier: GPL-2.0-only
// Keywords of fix rve and create_rve for the material of grains.

#pragma once

#include "lammps/script_arguments.h"
#include "rve/engine/given_material.h"

namespace LAMMPS_NS {

/// Returns the keywords of rve::MATERIAL_PARAMETERS and *contact*, which gives the contact law in
/// the syntax of LAMMPS' pair_style granular.
rve::Words material_keywords();

/// Parameters of the material that a script gives. The others have no value.
class MaterialArguments : public rve::GivenMaterial {
 public:
  /// Reads the values of the current keyword. Returns false if it is no keyword of the material.
  /// An error ends in error->all.
  bool read(ScriptArguments &words);
};

/// Applies `words` to a material and changes its mass scaling from `mass_scaling_before` to
/// `mass_scaling` [-]. The mass scaling is a factor in the mass depth of the material.
void change_material(rve::Material &material, const MaterialArguments &words, double mass_scaling,
                     double mass_scaling_before);

}    // namespace LAMMPS_NS
