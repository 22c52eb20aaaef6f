// SPDX-License-Identifier: GPL-2.0-only
// How a macro step of an RVE becomes DEM steps.

#pragma once

#include "rve/engine/substeps.h"

#include <optional>

namespace macro {

/// Where the stress of a macro step is taken.
enum class StressFrom { End, Average, Regression };

/// What may stand between a macro step and the DEM steps of an RVE; as given here, nothing does.
struct MacroStepOptions {
  /// Number of DEM steps by strain; not with a servo.
  std::optional<rve::AdaptiveSubsteps> adaptive;
  /// An RVE that strains less since its last DEM step is skipped; 0: none is.
  double quiescent_strain = 0.0;
  StressFrom stress_from = StressFrom::End;
  /// Of an average or a regression, the last one at the end of the macro step.
  int stress_samples = 1;
  int stress_spacing = 1;       ///< DEM steps between samples
  int shadow_refinement = 4;    ///< DEM steps of a shadow per step of its RVE
  /// Of an RVE side by side, where its cell becomes too narrow; a power of two.
  int most_copies = 1;
};

}    // namespace macro
