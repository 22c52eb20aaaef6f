// SPDX-License-Identifier: GPL-2.0-only
// Time steps on a CUDA device. Only builds with CUDA compile this.

#pragma once

#include "mpm/step_runner.h"

#include <memory>

namespace mpm {

/// Makes a runner of steps on a CUDA device. Returns null and an explanation in `obstacle` if there
/// is no usable device. Throws std::runtime_error if the device fails.
template <int D>
std::unique_ptr<StepRunner<D>> make_cuda_machine(const SolverOptions<D> &options,
                                                 const Communication &communication,
                                                 const Grid<D> &grid, std::string &obstacle);

}    // namespace mpm
