// The engine on CPU threads: one RVE per thread at a time.

#ifndef RVE_ENGINE_HOST_ENGINE_H
#define RVE_ENGINE_HOST_ENGINE_H

#include "rve/engine/engine.h"

namespace rve {

std::unique_ptr<Engine> make_host_engine(const Options &options);

}    // namespace rve

#endif
