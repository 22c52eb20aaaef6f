// SPDX-License-Identifier: GPL-2.0-only
// Options of macro steps of RVEs.

#pragma once

#include "rve/engine/substeps.h"

#include <optional>

namespace macro {

/// The stress of a macro step: the last one, or an average or a regression over samples.
enum class StressFrom { End, Average, Regression };

/// With the defaults, a macro step makes the DEM steps of its drive and takes the stress at their
/// end.
struct MacroStepOptions {
  /// Adaptive number of DEM steps, which depends on the strain. Servos ignore it.
  std::optional<rve::AdaptiveSubsteps> adaptive;
  /// An RVE whose strain since its last DEM step is below this may be skipped [-]; 0: none is
  /// skipped.
  double quiescent_strain = 0.0;
  StressFrom stress_from = StressFrom::End;
  /// Samples of an average or a regression. The last one is taken at the end of the macro step.
  int stress_samples = 1;
  int stress_spacing = 1;       ///< DEM steps between samples
  int shadow_refinement = 4;    ///< DEM steps of a shadow per step of its RVE
  /// Largest number of copies of itself, side by side, that replace an RVE whose cell becomes too
  /// narrow; a power of two.
  int most_copies = 1;
};

}    // namespace macro
