// SPDX-License-Identifier: GPL-2.0-only
// The engine at the ends of what it may be asked: scenes of disks and of spheres, each with a property that must hold, all of a dimension
// one batch.
//
// A scene ends in one of four ways. `holds`: the property is met within its limit. `status`: the engine refused, and left the RVE as it
// was. `warned`: the property is missed, and the advice that a run prints names why. `silent`: a wrong number that nothing tells of,
// which must not be.

#pragma once

#include "rve/engine/advice.h"

#include <functional>
#include <string>
#include <vector>

namespace rve_test {

/// What was seen of a scene.
template <int D> struct Trace {
  rve::Format format;
  rve::RveStateOf<D> start, middle, end;    ///< before, after Scene::middle_call, at the end
  std::vector<rve::ResultOf<D>> results;    ///< of a call without steps, then of each call
  const rve::ResultOf<D> &first() const { return results.front(); }
  const rve::ResultOf<D> &last() const { return results.back(); }
};

template <int D> struct Scene {
  std::string item;        ///< of the list of extremes
  std::string quantity;    ///< what is varied
  double value;            ///< of it
  std::string property;    ///< what must hold, in words
  double limit[3];         ///< of the deviation, in fast, mixed and double [-]
  rve::RveStateOf<D> state;
  int calls;
  std::function<rve::DriveOf<D>(int call)> drive;
  std::function<double(const Trace<D> &)> deviation;    ///< from the property, relative [-]
  std::vector<rve::AdviceKind> explained_by = {};    ///< advice that makes a deviation no surprise
  bool may_refuse = false;                           ///< a fatal status is a sound answer
  bool must_refuse = false;                          ///< and nothing else is
  int middle_call = 0;
};

enum class Verdict { Holds, Status, Warned, Silent };
const char *to_string(Verdict verdict);

template <int D> struct Finding {
  const Scene<D> *scene;
  rve::Format format;
  Verdict verdict;
  double deviation;     ///< not a number where the engine refused
  std::string words;    ///< of the status, or of the advice
  long long steps = 0;
};

/// `length` in (0, 1]: share of the ten million steps, thousand turns and so on.
template <int D> std::vector<Scene<D>> extreme_scenes(double length);

/// Runs them on one engine, call by call as one batch. `engine_name` receives the description of the engine.
template <int D>
std::vector<Finding<D>> run_extremes(const std::vector<Scene<D>> &scenes, rve::Format format,
                                     rve::Device device, std::string *engine_name = nullptr);

}    // namespace rve_test
