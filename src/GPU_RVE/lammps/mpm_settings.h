// SPDX-License-Identifier: GPL-2.0-only
// Parsed arguments of fix mpm as plain structs. Only mpm_settings.cpp reads the words of the
// script.

#pragma once

#include "lammps/mpm_models.h"
#include "mpm/mpm_solver.h"

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace LAMMPS_NS {

class LAMMPS;

/// A rigid body: the keyword *rigid* and its *density*. Its other properties are in the options of
/// the solver.
template <int D> struct MpmRigidBody {
  std::string group;
  int groupbit;
  ScriptValue friction;    ///< coefficient of friction if it is a variable [-]
  /// Prescribed velocity [length/time], then spin [1/time]. Free components are not used.
  ScriptValue rates[mpm::FREEDOMS<D>];
  std::optional<double> density;    ///< [mass/length^3]; 0: atom mass; none: MpmSettings::density
};

/// A load: the keyword *traction* or *pressure* and its *face*.
template <int D> struct MpmTraction {
  int groupbit;               ///< bit of the group; 0: the load acts on a region
  std::string id;             ///< ID of the group or region
  ScriptValue traction[D];    ///< [stress]
  bool is_pressure;           ///< traction[0] is a pressure along the inward normal of the face
  mpm::Face face = D == 2 ? mpm::Face::YHi : mpm::Face::ZHi;

  const char *keyword() const { return is_pressure ? "pressure" : "traction"; }
};

/// Pore water of the keyword *water*. Its modulus and its limit of cavitation are in the options of
/// the solver.
struct MpmWaterSettings {
  /// Undrained: does not flow. Flows: flows by Darcy's law. Submerged: still water that drains
  /// without resistance.
  enum class Kind { Undrained, Flows, Submerged };

  bool given = false;
  Kind kind = Kind::Undrained;
  std::string group;
  int groupbit = 0;
  double density = 0.0;                   ///< of the water [mass/length^3]
  bool takes_porosity_of_rves = false;    ///< porosity rve
  ScriptValue porosity;                   ///< of new points [-]; not used with porosity rve

  /// Bit f: water passes the side f though it holds or absorbs the ground. Only of the kind Flows.
  int drained_sides = 0;

  bool flows() const { return given && kind == Kind::Flows; }
  bool is_submerged() const { return given && kind == Kind::Submerged; }
};

/// In-situ stress of the keyword *insitu*: equilibrium with the weight and a surcharge, or the
/// components of the stress at each point.
template <int D> struct MpmInSitu {
  bool given = false;
  double gravity = 0.0;       ///< [length/time^2]
  ScriptValue k0;             ///< ratio of lateral to vertical stress [-]
  bool is_at_rest = false;    ///< k0 rest: the RVEs find k0 without lateral strain
  ScriptValue surcharge;      ///< pressure on the surface, compression positive [stress]
  /// Vertical coordinate of the ground surface above each point [length]. No value: the upper edge
  /// of the highest new point.
  std::optional<ScriptValue> surface;
  /// Vertical coordinate of the water table at each point [length]. No value: all points of the
  /// keyword *water* begin with water without pressure.
  std::optional<ScriptValue> water_table;
  /// Components of the stress in the order of the keyword *stress* [stress], or none.
  std::vector<ScriptValue> components;
  std::optional<double> tolerance;    ///< tolerance of the stress of RVEs [stress]

  bool is_by_components() const { return !components.empty(); }
};

/// Subjects and values of the keywords of a script. The subject is the keyword, with an ID if the
/// keyword may be given several times ("boundary xlo").
using MpmArguments = std::vector<std::pair<std::string, std::string>>;

/// Parsed arguments of a fix mpm in D dimensions.
template <int D> struct MpmSettings {
  std::string id;    ///< ID of the fix
  mpm::SolverOptions<D> options;
  std::vector<MpmRigidBody<D>> bodies;    ///< contact properties are in options.rigid_bodies
  std::vector<MpmTraction<D>> tractions;
  std::vector<MpmModel<D>> models;
  std::vector<std::string> columns;    ///< names of state variables in the output
  /// Density of models and bodies without a density of their own [mass/length^3]. 0: deformable
  /// points have the density of their RVEs, and bodies have the mass of their atoms.
  double density = 0.0;
  double initial_volume = 0.0;    ///< volume of a new point, in the plane its area [length^D]
  /// Initial stress of points without RVEs [stress].
  mpm::Tensor<D> initial_stress = mpm::Tensor<D>::zero();
  MpmInSitu<D> in_situ;
  MpmWaterSettings water;
  double courant_warn = 0.9, courant_error = 1.0;    ///< Courant numbers of the keyword *cfl* [-]
  /// Number of RVEs whose tangents give the wave speed at the start of a run. 0: no tangents are
  /// measured, and the upper bound of the wave speed is used.
  int wave_tests = 0;
  int wave_every = 0;    ///< steps between measurements of the wave speed; 0: only at the start
  /// Wall time between progress lines [seconds]. 0: no lines.
  double progress_interval = 60.0;
  MpmArguments words;

  /// Parses `fix ID group mpm ...`. An error ends in error->all. Collective.
  static MpmSettings parse(LAMMPS *lmp, int narg, char **arg);

  /// Returns the name of the fix, with which messages begin.
  std::string name() const { return "fix mpm " + id; }

  /// Returns the name of a side in the keyword *boundary*, in the order of mpm::Face.
  static const char *name_of_side(int side);

  /// Returns the width of a new point, which is a square or a cube [length].
  double width_of_point() const;

  /// Returns the volume of a new point at x: in axisymmetry that of a ring, otherwise
  /// initial_volume [length^D].
  double initial_volume_at(const double *x) const;

  /// Returns the density that the script gives the points of a model or body [mass/length^3]; 0 if
  /// it gives none.
  double density_of(const MpmModel<D> &model) const { return model.density.value_or(density); }
  double density_of(const MpmRigidBody<D> &body) const { return body.density.value_or(density); }

  /// Looks up the variables, groups and regions, which can change between runs. Ends with
  /// error->all if one does not exist.
  void find(LAMMPS *lmp);
  /// Ends with error->all if a group or a region of the fix has been deleted. This check is
  /// separate because runs with *pre no* do not initialize the fix.
  void check_groups(LAMMPS *lmp) const;
};

}    // namespace LAMMPS_NS
