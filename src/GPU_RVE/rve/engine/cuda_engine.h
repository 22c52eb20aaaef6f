// SPDX-License-Identifier: GPL-2.0-only
// The engine on a CUDA device: one thread block per RVE. Only builds with CUDA contain this code.

#pragma once

#include "rve/engine/engine.h"

namespace rve {

/// Returns an engine on a CUDA device, or null and the reason in `obstacle` if no device can be
/// used. Throws std::runtime_error when the device fails.
template <int D>
std::unique_ptr<EngineOf<D>> make_cuda_engine(const Options &options, std::string &obstacle);

}    // namespace rve
