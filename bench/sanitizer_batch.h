// SPDX-License-Identifier: GPL-2.0-only
// A small batch that takes every path of the engine: rebuilds, lists that overflow, a force scale that is too fine, lattice reduction,
// the servo, and RVEs that fail. For compute-sanitizer, which wants little work and much variety.

#pragma once

#include "rve/engine/engine.h"

#include <string>

namespace bench {

/// The calls that the batch is part of.
struct Company {
  bool few = true;    ///< one call of few RVEs
  /// RVEs of a call that is large; more than multiprocessors, so that the kernel for many RVEs is used, and more than are resident, so that
  /// blocks take a second one; 0: there is none.
  int many = 0;
  bool is_light = false;    ///< the others in a call are pairs of grains
};

/// Runs the batch on an engine of these options. Throws std::runtime_error when a path was not taken or an answer is not the expected.
/// Of a packing with rolling resistance the program for that runs; else with `track_energy` the general one, of a packing without
/// friction the frictionless one, and otherwise the plain one, or that of a servo: `program` is its name, to print, and "steered" asks for
/// an RVE with a servo.
template <int D>
void visit_all_paths(const rve::Options &options, const rve::RveStateOf<D> &packing,
                     double time_step, const Company &company, const std::string &program);

}    // namespace bench
