/* -*- c++ -*- ----------------------------------------------------------
   LAMMPS - Large-scale Atomic/Molecular Massively Parallel Simulator
   https://www.lammps.org/, Sandia National Laboratories
   LAMMPS development team: developers@lammps.org

   Copyright (2003) Sandia Corporation.  Under the terms of Contract
   DE-AC04-94AL85000 with Sandia Corporation, the U.S. Government retains
   certain rights in this software.  This software is distributed under
   the GNU General Public License.

   See the README file in the top-level LAMMPS directory.
------------------------------------------------------------------------- */

// The material of grains as scripts give it to fix rve and create_rve.

#ifndef LMP_MATERIAL_WORDS_H
#define LMP_MATERIAL_WORDS_H

#include "rve/engine/state.h"
#include "script_words.h"

#include <iterator>
#include <optional>

namespace LAMMPS_NS {

/// A property of the material, as scripts call it. fix rve and create_rve know these and no others.
struct MaterialKeyword {
  const char *name;
  double rve::Material::*member;
  bool of_contact = false;    ///< *contact* gives it, too
};
constexpr MaterialKeyword MATERIAL_KEYWORDS[] = {
    {"kn", &rve::Material::normal_stiffness, true},
    {"kt", &rve::Material::tangential_stiffness, true},
    {"friction", &rve::Material::friction, true},
    {"kr", &rve::Material::rolling_stiffness, true},
    {"rolling_friction", &rve::Material::rolling_friction, true},
    {"density", &rve::Material::density},
    {"damping", &rve::Material::local_damping},
    {"gamma_n", &rve::Material::normal_viscosity, true},
    {"gamma_t", &rve::Material::tangential_viscosity, true},
    {"thickness", &rve::Material::thickness},
    {"mass_depth", &rve::Material::mass_depth}};

/// Their names, and *contact*, which gives the contact law in the words of LAMMPS.
rve::Words material_keywords();

/// Properties of the material that the script gives.
class MaterialWords {
 public:
  /// Reads the value of the keyword that the words are at, and says whether it is one of the material.
  bool read(ScriptWords &words);

  std::optional<double> &operator[](double rve::Material::*member);
  const std::optional<double> &operator[](double rve::Material::*member) const;

  /// A rolling friction without a rolling stiffness, here or in the material, gets the tangential one.
  void apply(rve::Material &material) const;

  bool any() const;

 private:
  std::optional<double> values[std::size(MATERIAL_KEYWORDS)];
};

/// Changes a material as the words say, and its inertia from one mass scaling to another.
void change_material(rve::Material &material, const MaterialWords &words, double mass_scaling,
                     double mass_scaling_before);

}    // namespace LAMMPS_NS

#endif
