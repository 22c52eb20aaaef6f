// SPDX-License-Identifier: GPL-2.0-only
// A small batch of RVEs for compute-sanitizer. Together they take every path of the engine: list
// rebuilds, lists that overflow, a force scale that is too fine, lattice reduction, the servo, and
// failures of RVEs.

#pragma once

#include "rve/engine/engine.h"

#include <string>

namespace bench {

/// Sizes of the calls that contain the batch, and the other RVEs that fill these calls.
struct Company {
  bool few = true;    ///< makes calls of few RVEs
  /// Number of RVEs of large calls; 0: no such calls. It must exceed the number of multiprocessors,
  /// so that the kernel for many RVEs runs. It must also exceed the number of RVEs that are on the
  /// multiprocessors at the same time, so that some blocks advance a second RVE.
  int many = 0;
  bool is_light = false;    ///< the other RVEs are pairs of grains, not packings
};

/// Runs the batch on an engine with these options. Throws std::runtime_error if a path was not
/// taken or a result is not the expected one. The packing and the options determine the kernel
/// variant: a packing with rolling resistance selects the variant for it. For other packings,
/// `track_energy` selects the general variant. Without it, a packing without friction selects the
/// frictionless variant, and all other packings the plain or the steered one. `variant` is the name
/// that is printed; "steered" adds an RVE with a servo.
template <int D>
void visit_all_paths(const rve::Options &options, const rve::RveStateOf<D> &packing,
                     double time_step, const Company &company, const std::string &variant);

}    // namespace bench
