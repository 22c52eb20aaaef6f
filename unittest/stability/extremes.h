// SPDX-License-Identifier: GPL-2.0-only
// Tests of the engine at the limits of its input. A scene is an RVE of disks or spheres with a
// drive and a property that must hold. All scenes of a dimension run as one batch.
//
// A scene ends with one of four verdicts:
//   holds    the property is met within its limit
//   status   the engine refused the call, as the scene allows, and left the RVE unchanged
//   warned   the property is not met, and the printed advice names the reason
//   silent   the property is not met and nothing is reported, which is a failure

#pragma once

#include "rve/engine/advice.h"

#include <functional>
#include <string>
#include <vector>

namespace rve_test {

/// Recorded states and results of a scene.
template <int D> struct Trace {
  rve::Format format;
  rve::RveStateOf<D> start, middle, end;    ///< before, after Config::middle_call calls, at end
  std::vector<rve::ResultOf<D>> results;    ///< results of a call without steps, then of each call
  const rve::ResultOf<D> &first() const { return results.front(); }
  const rve::ResultOf<D> &last() const { return results.back(); }
};

template <int D> struct Config {
  std::string item;        ///< item in the list of extremes
  std::string quantity;    ///< varied quantity
  double value;            ///< value of the quantity
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

/// Returns the scenes. Long scenes make the share `length` in (0, 1] of their full length, for
/// example of ten million steps or a thousand turns.
template <int D> std::vector<Config<D>> extreme_scenes(double length);

/// Runs the scenes on one engine as one batch, call by call. `engine_name` receives the description
/// of the engine.
template <int D>
std::vector<Finding<D>> run_extremes(const std::vector<Config<D>> &scenes, rve::Format format,
                                     rve::Device device, std::string *engine_name = nullptr);

}    // namespace rve_test
