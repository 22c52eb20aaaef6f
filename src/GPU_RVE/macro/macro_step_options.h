// SPDX-License-Identifier: GPL-2.0-only
// Options of macro steps of RVEs.

#pragma once

#include "rve/engine/substeps.h"

#include <optional>

namespace macro {

/// Definition of the stress of a macro step: the stress at its end, or an average or a regression
/// over samples.
enum class StressFrom { End, Average, Regression };

/// Options of macro steps. With the defaults, a macro step makes the DEM steps of its drive, and
/// its stress is the stress after the last of these steps.
struct MacroStepOptions {
  /// Adaptive number of DEM steps, which depends on the strain. Drives with a servo ignore this
  /// option.
  std::optional<rve::AdaptiveSubsteps> adaptive;
  /// An RVE can be skipped if its strain since its last DEM step is below this value [-]. With the
  /// value 0 no RVE is skipped.
  double quiescent_strain = 0.0;
  StressFrom stress_from = StressFrom::End;
  /// Samples of an average or a regression. The last one is taken at the end of the macro step.
  int stress_samples = 1;
  int stress_spacing = 1;       ///< DEM steps between samples
  int shadow_refinement = 4;    ///< DEM steps of a shadow per step of its RVE
  /// An RVE whose cell becomes too narrow is replaced by copies of itself, side by side. This is
  /// the largest number of copies, a power of two.
  int most_copies = 1;
};

}    // namespace macro
