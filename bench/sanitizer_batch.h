// SPDX-License-Identifier: GPL-2.0-only
// A small batch that takes every path of the engine, for compute-sanitizer: rebuilds, lists that
// overflow, a force scale that is too fine, lattice reduction, the servo, and RVEs that fail.

#pragma once

#include "rve/engine/engine.h"

#include <string>

namespace bench {

/// The calls that contain the batch.
struct Company {
  bool few = true;    ///< one call of few RVEs
  /// Number of RVEs of a large call; 0: no such call. It must exceed the number of multiprocessors,
  /// so that the kernel for many RVEs runs, and the number of resident RVEs, so that blocks take a
  /// second one.
  int many = 0;
  bool is_light = false;    ///< the other RVEs of a call are pairs of grains
};

/// Runs the batch on an engine with these options. Throws std::runtime_error if a path was not
/// taken or a result is not the expected one. A packing with rolling resistance uses the kernel
/// variant for it. Otherwise `track_energy` selects the general variant, a packing without friction
/// the frictionless one, and all others the plain one or that of a servo. `variant` is the name
/// that is printed; "steered" adds an RVE with a servo.
template <int D>
void visit_all_paths(const rve::Options &options, const rve::RveStateOf<D> &packing,
                     double time_step, const Company &company, const std::string &variant);

}    // namespace bench
