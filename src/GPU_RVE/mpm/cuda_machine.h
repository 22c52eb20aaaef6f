// SPDX-License-Identifier: GPL-2.0-only
// Steps on a CUDA device. Exists only in builds with CUDA.

#pragma once

#include "mpm/step_runner.h"

#include <memory>

namespace mpm {

/// Nothing, and an `obstacle` in words, where there is no device. Throws std::runtime_error when the device fails.
template <int D>
std::unique_ptr<StepRunner<D>> make_cuda_machine(const SolverOptions<D> &options,
                                                 const Communication &communication,
                                                 const Grid<D> &grid, std::string &obstacle);

}    // namespace mpm
