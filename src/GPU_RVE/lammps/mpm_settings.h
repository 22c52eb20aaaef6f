// SPDX-License-Identifier: GPL-2.0-only
// What a script says to fix mpm, as plain structs: the words are read here and nowhere else.

#pragma once

#include "lammps/mpm_models.h"
#include "mpm/mpm_solver.h"

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace LAMMPS_NS {

class LAMMPS;

template <int D> struct MpmRigidBody {
  std::string group;
  int groupbit;
  /// Velocity, then spin; those that forces drive are in the options.
  ScriptValue friction;    ///< used where it is a variable [-]
  ScriptValue rates[mpm::FREEDOMS<D>];
  std::optional<double> density;    ///< [mass/length^3]; 0 or none: of the atoms
};

template <int D> struct MpmTraction {
  int groupbit;      // 0: a region
  std::string id;    // of group or region
  ScriptValue traction[D];
  bool is_pressure;    // in traction[0], along the inward normal of the face
  mpm::Face face = D == 2 ? mpm::Face::YHi : mpm::Face::ZHi;

  const char *keyword() const { return is_pressure ? "pressure" : "traction"; }
};

/// The stress in which ground is found: what its weight and a surcharge demand at rest, or the components of the stress at each point.
template <int D> struct MpmInSitu {
  bool given = false;
  double gravity = 0.0;       ///< [length/time^2]
  ScriptValue k0;             ///< lateral over vertical stress [-]
  bool is_at_rest = false;    ///< in place of k0: RVEs find it without lateral strain
  ScriptValue surcharge;      ///< on the surface, compression positive [stress]
  /// Its height above a point [length]; the top of the points.
  std::optional<ScriptValue> surface;
  std::vector<ScriptValue> components;    ///< in the order of *stress*, or none
  std::optional<double> tolerance;        ///< of the stress of RVEs [stress]

  bool is_by_components() const { return !components.empty(); }
};

/// What a script says: keywords, with what they are about where they may occur again ("boundary xlo"), and their values.
using MpmWords = std::vector<std::pair<std::string, std::string>>;

/// In D dimensions.
template <int D> struct MpmSettings {
  mpm::SolverOptions<D> options;
  std::vector<MpmRigidBody<D>> bodies;    ///< their contact is in options.rigid_bodies
  std::vector<MpmTraction<D>> tractions;
  std::vector<MpmModel<D>> models;
  std::vector<std::string> columns;    ///< state variables in the output
  /// Density of models and bodies that have none of their own [mass/length^3]; 0: of the RVEs.
  double density = 0.0;
  double initial_volume = 0.0;    ///< of a point, in the plane its area [length^D]
  mpm::Tensor<D> initial_stress = mpm::Tensor<D>::zero();    ///< of points without RVEs
  MpmInSitu<D> in_situ;
  double courant_warn = 0.9, courant_error = 1.0;
  /// RVEs whose tangents give the wave speed at the beginning of a run; 0: the bound.
  int wave_tests = 0;
  int wave_every = 0;    ///< steps after which they are measured again; 0: not in this run
  /// Wall time between lines about the progress [seconds]; 0: none.
  double progress_interval = 60.0;
  MpmWords words;

  /// Reads `fix ID group mpm ...`; errors end in error->all.
  static MpmSettings parse(LAMMPS *lmp, int narg, char **arg);

  /// As the keyword *boundary* has it, in the order of mpm::Face.
  static const char *name_of_side(int side);

  /// Of a new point, which is a square or a cube [length].
  double width_of_point() const;

  /// Density that the script gives the points of a model or body [mass/length^3]; 0: none.
  double density_of(const MpmModel<D> &model) const { return model.density.value_or(density); }
  double density_of(const MpmRigidBody<D> &body) const { return body.density.value_or(density); }

  /// Looks up the variables, groups and regions, which may change between runs.
  void find(LAMMPS *lmp);
  /// Ends with an error if a group or a region of the fix has been deleted. Runs with pre no do not
  /// initialize the fix.
  void check_groups(LAMMPS *lmp) const;
};

}    // namespace LAMMPS_NS
