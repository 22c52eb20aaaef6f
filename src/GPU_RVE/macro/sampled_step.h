// SPDX-License-Identifier: GPL-2.0-only
// The stress of a macro step as a mean or a regression over samples.

#pragma once

#include "macro/macro_step_options.h"
#include "rve/engine/engine.h"
#include "rve/engine/finite_strain.h"

#include <algorithm>
#include <vector>

namespace macro {

/// A macro step of one RVE in parts. The stress is sampled at the end of each part.
template <int D> struct SampledStep {
  using Matrix = rve::Tensor<double, D>;

  int slot;
  rve::DriveOf<D> drive;
  int parts = 1;
  int first_steps = 0;            ///< DEM steps of the first part
  int spacing = 0;                ///< DEM steps of every other part
  std::vector<Matrix> samples;    ///< stress at the end of each part [stress]
  bool failed = false;

  SampledStep(int _slot, const rve::DriveOf<D> &_drive, const MacroStepOptions &options) :
      slot(_slot), drive(_drive)
  {
    const int substeps = drive.substeps;
    if (substeps < 2) return;
    parts = std::min(options.stress_samples, substeps);
    spacing = std::min(options.stress_spacing, (substeps - 1) / (parts - 1));
    first_steps = substeps - (parts - 1) * spacing;
  }

  /// Drive of a part. The product of the deformations of all parts is the deformation of the macro
  /// step.
  rve::DriveOf<D> of_part(int part) const
  {
    if (parts == 1) return drive;
    rve::DriveOf<D> some = drive;
    some.substeps = part == 0 ? first_steps : spacing;
    const auto end = [&](int p) {
      return static_cast<double>(first_steps + p * spacing) / drive.substeps;
    };
    // the last part ends at the deformation of the macro step, except for rounding
    const Matrix after = part + 1 == parts ? drive.deformation
                                           : rve::part_of_increment(drive.deformation, end(part));
    some.deformation = part == 0
        ? after
        : after * rve::inverse(rve::part_of_increment(drive.deformation, end(part - 1)));
    return some;
  }

  /// Mean of the samples, or the value at the end of their regression line [stress].
  Matrix stress(StressFrom from) const
  {
    const int n = static_cast<int>(samples.size());
    Matrix mean = Matrix::zero(), slope = Matrix::zero();
    double spread = 0.0;
    for (int k = 0; k < n; ++k) {
      const double distance = k - 0.5 * (n - 1);
      mean = mean + (1.0 / n) * samples[k];
      slope = slope + distance * samples[k];
      spread += distance * distance;
    }
    return from == StressFrom::Average ? mean : mean + (0.5 * (n - 1) / spread) * slope;
  }
};

}    // namespace macro
