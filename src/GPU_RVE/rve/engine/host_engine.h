// SPDX-License-Identifier: GPL-2.0-only
// The engine on CPU threads: one RVE per thread at a time.

#pragma once

#include "rve/engine/engine.h"

namespace rve {

template <int D> std::unique_ptr<EngineOf<D>> make_host_engine(const Options &options);

}    // namespace rve
