// SPDX-License-Identifier: GPL-2.0-only
// Scenes that test the engine at the limits of its input. A scene is an RVE with a drive and with a
// property that its results must have. All scenes with disks run as one batch, and so do all scenes
// with spheres.
//
// A scene ends with one of four verdicts:
//   holds    the property is met within its limit
//   status   the engine refused a call with a fatal status and left the RVE unchanged, and the
//            scene allows a refusal
//   warned   the property is not met, but the engine's advice names the reason
//   silent   none of the above, which is a failure

#pragma once

#include "rve/engine/advice.h"

#include <functional>
#include <string>
#include <vector>

namespace rve_test {

/// Recorded states and results of a scene.
template <int D> struct Trace {
  rve::Format format;
  rve::RveStateOf<D> start, middle, end;    ///< at start, after middle_call calls, at end
  std::vector<rve::ResultOf<D>> results;    ///< of a call without steps, then of all calls
  const rve::ResultOf<D> &first() const { return results.front(); }
  const rve::ResultOf<D> &last() const { return results.back(); }
};

template <int D> struct Config {
  std::string item;        ///< group of scenes, for example "overlap"
  std::string quantity;    ///< quantity that varies in the group
  double value;            ///< value of the quantity in this scene
  std::string property;    ///< description of the property that must hold
  double limit[3];         ///< limit of the deviation in fast, mixed and double [-]
  rve::RveStateOf<D> state;
  int calls;
  std::function<rve::DriveOf<D>(int call)> drive;
  /// Returns the relative deviation from the property [-].
  std::function<double(const Trace<D> &)> deviation;
  std::vector<rve::AdviceKind> explained_by = {};    ///< advice that explains a deviation
  bool may_refuse = false;                           ///< a fatal status is acceptable
  bool must_refuse = false;                          ///< only a fatal status is acceptable
  int middle_call = 0;
};

enum class Verdict { Holds, Status, Warned, Silent };
const char *to_string(Verdict verdict);

template <int D> struct Finding {
  const Config<D> *scene;
  rve::Format format;
  Verdict verdict;
  double deviation;     ///< not a number if the engine refused
  std::string words;    ///< text of the status or of the advice
  long long steps = 0;
};

/// Returns the scenes. `length` in (0, 1] shortens long scenes: 1 gives their full length, for
/// example ten million steps or a thousand turns, and 0.1 gives a tenth of it.
template <int D> std::vector<Config<D>> extreme_scenes(double length);

/// Runs the scenes on one engine as one batch, call by call. `engine_name` receives the description
/// of the engine.
template <int D>
std::vector<Finding<D>> run_extremes(const std::vector<Config<D>> &scenes, rve::Format format,
                                     rve::Device device, std::string *engine_name = nullptr);

}    // namespace rve_test
