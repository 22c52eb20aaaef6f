// SPDX-License-Identifier: GPL-2.0-only
// What a script says to fix rve and create_rve, as plain structs: the words are read here and nowhere else.

#pragma once

#include "lammps/material_words.h"
#include "lammps/script_words.h"
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

/// The keywords of fix rve.
rve::Words fix_rve_keywords();

/// What to say of a packing file that could not be read: with its name, and where packings come from if there is none.
std::string packing_failure(const std::string &file, const rve::InputError &e);

/// A script value for one component of a tensor.
struct TensorComponent {
  int row, column;
  ScriptValue value;
};

enum class RveDriver { None, VelocityGradient, Mpm };

/// What happens when an RVE fails: the run ends, or the RVE is frozen and flagged, or a fresh one takes its place.
enum class RvePolicy { Stop, Freeze, Fresh };

/// Which packing an atom gets: by number, or, by one or several of these, by stress, by void ratio and by a random draw; and which image of it.
struct PackingChoice {
  ScriptValue number;
  /// Of a random draw, among those of the stress and of the void ratio if they are given.
  std::optional<int> seed;
  std::optional<ScriptValue> stress;    ///< vertical, compression positive [stress]
  std::optional<ScriptValue> void_ratio;
  double tolerance = 0.0;    ///< of the void ratio [-]
  ScriptValue image;
  std::optional<int> image_seed;    ///< of a random draw

  bool is_by_property() const { return seed || stress || void_ratio; }
};

/// Loading paths, in place of drive and servo.
struct PathSettings {
  std::shared_ptr<const macro::LoadPathsOf<2>> of_disks;
  std::shared_ptr<const macro::LoadPathsOf<3>> of_spheres;    ///< one of them, or none
  std::vector<ScriptValue> values;                            ///< of the variables that they name
  std::string text = "none";                                  ///< what the script says
  ScriptValue number;                                         ///< of an atom's path, from 1
  bool number_given = false;
  bool halts = false;    ///< the run ends when all paths have

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

struct FixRveSettings {
  int dimension = 2;    ///< of the RVEs, as the packings say: 2 for disks, 3 for spheres
  std::vector<std::string> packings;
  PackingChoice choice;
  MaterialWords material;

  RveDriver driver = RveDriver::None;
  std::vector<TensorComponent> velocity_gradient;
  std::vector<TensorComponent> stress_goal;
  std::optional<double> servo_gain, servo_max_rate;
  PathSettings path;

  double dt = 0.0;    ///< DEM time step; used unless dt_auto
  bool dt_auto = true;
  double dt_fraction = 0.9;       ///< of the stability bound, for dt auto
  bool dt_given = false;          ///< by dt or by a preset
  int dt_check_interval = 100;    ///< LAMMPS steps between checks of the bound
  int substeps = 0;    ///< DEM steps per LAMMPS step; 0: as many as cover the LAMMPS time step
  std::optional<double> mass_scaling;    ///< factor of the mass of all grains [-]; 1 unless given
  macro::MacroStepOptions macro_step;
  int num_shadows = 0;

  rve::Options options;
  bool threads_given = false;
  RvePolicy policy = RvePolicy::Stop;

  /// Wall time between lines about the progress [seconds]; 0: none.
  double progress_interval = 60.0;

  int dump_interval = 0;
  std::string dump_prefix;
  std::vector<long long> dump_atoms;

  /// Reads `fix ID group rve ...`; errors end in error->all.
  static FixRveSettings parse(LAMMPS *lmp, int narg, char **arg);

  /// These settings with what `fix_modify ID ...` says; its material and mass scaling are what it says alone.
  FixRveSettings modified(LAMMPS *lmp, int narg, char **arg) const;

  /// DEM steps that a shadow does for one of its RVE; 1 without shadows.
  int steps_per_step() const { return num_shadows > 0 ? macro_step.shadow_refinement : 1; }

  /// What a continued run may have otherwise than the one before it, in words, by keyword. Not the material: RVEs have theirs.
  std::map<std::string, std::string> account() const;

 private:
  void read(ScriptWords &words, bool modifies);
  void require_one_dimension(LAMMPS *lmp) const;
  void check(LAMMPS *lmp, const std::string &command) const;
};

/// "xx", "xy", ..., "zz"
const char *rve_component_name(int row, int column);

}    // namespace LAMMPS_NS
