// SPDX-License-Identifier: GPL-2.0-only
// Loading paths of RVEs. A path consists of stages. A stage has conditions on rates, strains and
// stresses, and events that end or reverse the stage. Paths are read from the words of a file or of
// a script.
//
//   path NAME                            a file may have several; one path needs no name
//   stage                                the following clauses hold until one of its events
//     rate QUANTITY VALUE                of the velocity gradient [1/time]
//     strain QUANTITY VALUE              since the stage began, as a function of time [-]
//     stress QUANTITY VALUE              [stress]
//     stress b MAJOR INTERMEDIATE MINOR VALUE
//     circle P RADIUS PERIOD             normal stresses in the deviatoric plane
//     reverse strain|stress QUANTITY LOW HIGH
//     until strain|stress QUANTITY <|> LIMIT, or until ratio|void_ratio|time|cycles <|> LIMIT
//     repeat TIMES STAGE                 goes back to STAGE at the end of the stage, TIMES times
//
// A quantity is a weighted sum of components and of volume, p, qx, qy, qz, for example "xx-0.5*yy".
// A value is a number, v_NAME, ramp FROM TO TIME, wave MEAN AMPLITUDE PERIOD [PHASE], or table FILE
// COLUMN. A component that no condition of a stage names has rate zero. Normal strains are
// logarithms of stretches, shear strains are F_ab / F_bb. The velocity gradient L is upper
// triangular: its shear components are xy, and xz and yz for spheres.

#pragma once

#include "macro/path_values.h"
#include "rve/engine/servo_modes.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace macro {

/// Returns the text of a file that a path names. Throws InputError.
using ReadPathFile = std::function<std::string(const std::string &file)>;

/// Position of an RVE on its path. It is part of the record of the RVE.
template <int D> struct PathState {
  std::int32_t path = -1;    ///< number of the path; -1: the path has not begun
  std::int32_t stage = 0;
  std::int32_t direction = 1;    ///< factor of the rates of the stage: 1 or -1
  std::int32_t limit = 0;        ///< limit that reversed the stage last: -1 low, 1 high, 0 none yet
  std::int32_t reversals = 0;    ///< number of reversals in the stage
  std::int32_t rounds = 0;       ///< rounds of a repeat that are done
  std::int32_t ended = 0;        ///< 1 after the last stage: no further advances
  std::int32_t steered = 0;      ///< 1 if a servo of the path made the last step
  double time = 0.0;             ///< time in the stage [time]
  rve::Tensor<double, D> begin = rve::Tensor<double, D>::identity();    ///< F when the stage began

  double cycles() const { return 0.5 * reversals; }
};

/// Largest strain of a steered component in a DEM step, if the user gives no largest rate [-].
constexpr double SERVO_STRAIN_PER_STEP = 5.0e-5;

/// Time step and number of DEM steps of a macro step, and parameters of its servo.
struct PathStep {
  double dt = 0.0;
  int substeps = 0;
  double servo_gain = 0.0, servo_max_rate = 0.0;
};

template <int D> class LoadPathsOf {
 public:
  using Matrix = rve::Tensor<double, D>;

  /// Throws InputError with the position of the wrong word. If `used` is not null, the path ends
  /// before the first word that cannot belong to it, and *used becomes the number of words of the
  /// path.
  LoadPathsOf(const std::vector<PathWord> &words, const ReadPathFile &read_file,
              std::size_t *used = nullptr);

  int size() const { return static_cast<int>(paths.size()); }
  const std::string &name(int path) const { return paths[path].name; }
  int num_stages(int path) const { return static_cast<int>(paths[path].stages.size()); }
  /// Names of the variables whose values drive() needs, in this order.
  const std::vector<std::string> &script_names() const { return scripts; }
  /// True if a path steers a stress.
  bool has_servo() const { return any_servo; }
  /// True if a path depends on strains or void ratios. follow() then needs a complete result.
  bool needs_details() const { return any_strain; }

  /// Throws InputError unless the path and the stage of `state` exist.
  void check(const PathState<D> &state) const;
  void begin(PathState<D> &state, int path, const Matrix &deformation) const;
  /// Returns the drive of the next step. `script` has the values of script_names(). `deformation`
  /// is used if needs_details(). The servo modes to which the drive points belong to this object.
  /// Throws InputError if a value is not a finite number.
  rve::DriveOf<D> drive(const PathState<D> &state, const PathStep &step, const double *script,
                        const Matrix &deformation) const;
  /// Updates the state after the step of drive(). `result` must be complete if needs_details();
  /// otherwise the stress suffices. `script` has the values that drive() got.
  void follow(PathState<D> &state, const PathStep &step, const rve::ResultOf<D> &result,
              const double *script = nullptr) const;
  /// Continues a state that was on a path of another object. The state continues on the path of
  /// this object with the same number, in the same stage. A state that had ended continues in its
  /// last stage, or in the stage after it if an event of this last stage has happened. `result` is
  /// as in follow(). Throws InputError if this object has no such path or stage.
  void resume(PathState<D> &state, const rve::ResultOf<D> &result) const;

 private:
  using Sum = rve::ComponentSum<D>;
  enum class Of { Rate, Strain, Stress, Ratio, VoidRatio, Time, Cycles };
  struct Condition {
    Of of;
    Sum sum;
    PathValue value;
    std::string text;
  };
  struct Measure {
    Of of;
    Sum sum;
  };
  struct Event {
    Measure measure;
    bool below;
    double limit;
  };
  struct Stage {
    std::vector<Condition> motion;    // rates and strains, in the order of ServoModesOf::unit_rates
    std::vector<Condition> stresses;    // one for each of ServoModesOf::modes
    std::vector<Event> events;
    std::vector<Measure> reversed;    // measure that reverses the stage, or none
    PathValue low, high;              // limits that reverse the stage
    int times = 1, back_to = 0;
    std::shared_ptr<const rve::ServoModesOf<D>> control;
    std::string where;
  };
  struct Path {
    std::string name;
    std::vector<Stage> stages;
  };
  class Reader;

  std::vector<Path> paths;
  std::vector<std::string> scripts;
  bool any_servo = false, any_strain = false;

  static double measured(const Measure &measure, const PathState<D> &state,
                         const rve::ResultOf<D> &result);
  bool has_event(const PathState<D> &state, const rve::ResultOf<D> &result) const;
  void next_stage(PathState<D> &state, const Matrix &deformation) const;
};

}    // namespace macro
