// SPDX-License-Identifier: GPL-2.0-only
// Parsed arguments of fix rve as plain structs. Only rve_settings.cpp reads the words of the
// script.

#pragma once

#include "lammps/material_arguments.h"
#include "lammps/script_arguments.h"
#include "macro/load_path.h"
#include "macro/rve_points.h"
#include "rve/core/error.h"

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace LAMMPS_NS {

class LAMMPS;

/// Returns the keywords of fix rve, beginning with the keywords of the material.
rve::Words fix_rve_keywords();

/// Returns the error message for a packing file that cannot be read. It contains the name of the
/// file and, if there is no such file, how to make one.
std::string packing_failure(const std::string &file, const rve::InputError &e);

/// A script value for one component of a tensor.
struct TensorComponent {
  int row, column;
  ScriptValue value;
};

enum class RveDriver { None, VelocityGradient, Mpm };

/// Action when an RVE fails: end the run, freeze and flag the RVE, or replace it by a fresh one.
enum class RvePolicy { Stop, Freeze, Fresh };

/// Choice of the packing of an atom and of its image, which is a mirror image or a rotation. The
/// packing is chosen by its number, or by one or several of stress, void ratio and a random draw.
struct PackingChoice {
  ScriptValue number;
  /// Seed of a random draw among the packings with the given stress and void ratio.
  std::optional<int> seed;
  std::optional<ScriptValue> stress;        ///< vertical, compression positive [stress]
  std::optional<ScriptValue> void_ratio;    ///< [-]
  double tolerance = 0.0;                   ///< tolerance of the void ratio [-]
  ScriptValue image;                        ///< number of the image
  std::optional<int> image_seed;            ///< seed of a random draw of the image

  bool is_by_property() const { return seed || stress || void_ratio; }
};

/// Loading paths. A script with paths has no keyword drive or servo.
struct PathSettings {
  // at most one of the two is not null
  std::shared_ptr<const macro::LoadPathsOf<2>> of_disks;
  std::shared_ptr<const macro::LoadPathsOf<3>> of_spheres;
  /// variables of the script in the paths, in the order of script_names()
  std::vector<ScriptValue> values;
  std::string text = "none";    ///< words of the script, or names and checksums of path files
  ScriptValue number;           ///< number of the path of an atom, from 1
  bool number_given = false;
  bool halts = false;    ///< the run ends when all paths have ended

  bool any() const { return of_disks || of_spheres; }
  bool has_servo() const
  {
    return of_disks ? of_disks->has_servo() : of_spheres && of_spheres->has_servo();
  }
  template <int D> const auto &of() const
  {
    if constexpr (D == 2)
      return of_disks;
    else
      return of_spheres;
  }
};

/// Parsed arguments of a fix rve.
struct FixRveSettings {
  std::string id;       ///< ID of the fix
  int dimension = 2;    ///< dimension of the packings: 2 for disks, 3 for spheres
  std::vector<std::string> packings;
  PackingChoice choice;
  MaterialArguments material;

  RveDriver driver = RveDriver::None;
  std::vector<TensorComponent> velocity_gradient;
  std::vector<TensorComponent> stress_goal;
  std::optional<double> servo_gain, servo_max_rate;
  PathSettings path;

  double dt = 0.0;    ///< DEM time step, used unless dt_auto [time]
  bool dt_auto = true;
  /// with dt_auto, ratio of the DEM time step to its stability bound [-]
  double dt_fraction = 0.9;
  bool dt_given = false;          ///< true if dt or a preset sets the time step
  int dt_check_interval = 100;    ///< LAMMPS steps between checks of the stability bound; 0: none
  int substeps = 0;    ///< DEM steps per LAMMPS step; 0: as many as cover the LAMMPS time step
  std::optional<double> mass_scaling;    ///< factor of the mass of all grains [-]; no value: 1
  macro::MacroStepOptions macro_step;
  int num_shadows = 0;

  rve::Options options;
  bool threads_given = false;
  RvePolicy policy = RvePolicy::Stop;

  /// Wall time between progress lines [seconds]. 0: no lines.
  double progress_interval = 60.0;

  int dump_interval = 0;
  std::string dump_prefix;
  std::vector<long long> dump_atoms;

  /// Parses `fix ID group rve ...`. An error ends in error->all. Collective.
  static FixRveSettings parse(LAMMPS *lmp, int narg, char **arg);

  /// Returns these settings with the changes of `fix_modify ID ...`. In the result, the material
  /// and the mass scaling contain only the values that fix_modify gives. An error ends in
  /// error->all.
  FixRveSettings modified(LAMMPS *lmp, int narg, char **arg) const;

  /// Returns the name of the fix, with which messages begin.
  std::string name() const { return "fix rve " + id; }

  /// Returns the number of DEM steps of a shadow for each step of its RVE; 1 without shadows.
  int steps_per_step() const { return num_shadows > 0 ? macro_step.shadow_refinement : 1; }

  /// Returns the value of each keyword that is allowed to change when a run continues from a
  /// restart file. The material is left out, because a restart file has the material of each RVE.
  std::map<std::string, std::string> account() const;

 private:
  void read(ScriptArguments &words, bool modifies);
  void require_one_dimension(LAMMPS *lmp) const;
  void check(LAMMPS *lmp, const std::string &command) const;
};

/// Returns the name of a component of a tensor: "xx", "xy", ..., "zz".
const char *rve_component_name(int row, int column);

}    // namespace LAMMPS_NS
