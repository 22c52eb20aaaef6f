// SPDX-License-Identifier: GPL-2.0-only
// The engine at the limits of its input: scenes of disks and of spheres, each with a property that
// must hold. All scenes of a dimension are one batch.
//
// A scene ends in one of four ways. `holds`: the property is met within its limit. `status`: the
// engine refused the call and left the RVE unchanged. `warned`: the property is not met, and the
// advice that a run prints names the reason. `silent`: a wrong number without a message, which is a
// failure.

#pragma once

#include "rve/engine/advice.h"

#include <functional>
#include <string>
#include <vector>

namespace rve_test {

/// Recorded states and results of a scene.
template <int D> struct Trace {
  rve::Format format;
  rve::RveStateOf<D> start, middle, end;    ///< before, after Scene::middle_call, at the end
  std::vector<rve::ResultOf<D>> results;    ///< of a call without steps, then of each call
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
  /// deviation from the property, relative [-]
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

/// Returns the scenes; `length` in (0, 1] is the share of the ten million steps, thousand turns and
/// so on.
template <int D> std::vector<Config<D>> extreme_scenes(double length);

/// Runs the scenes on one engine as one batch, call by call. `engine_name` receives the description
/// of the engine.
template <int D>
std::vector<Finding<D>> run_extremes(const std::vector<Config<D>> &scenes, rve::Format format,
                                     rve::Device device, std::string *engine_name = nullptr);

}    // namespace rve_test
