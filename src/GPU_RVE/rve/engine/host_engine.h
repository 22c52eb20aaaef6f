// The engine on CPU threads: one RVE per thread at a time.

#ifndef RVE_ENGINE_HOST_ENGINE_H
#define RVE_ENGINE_HOST_ENGINE_H

#include "rve/engine/engine.h"

namespace rve {

template <int D> std::unique_ptr<EngineOf<D>> make_host_engine(const Options &options);

}    // namespace rve

#endif
