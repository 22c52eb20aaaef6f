// `fast` with the hardware's approximate root and quotient, and with contraction (compiled without -fmad=false): not the same bits
// as on a CPU. In a namespace of its own, so that no strict code is mixed up with it.
#define RVE_RELAXED
#define RVE_ISA relaxed

#include "rve/engine/cuda_kernels.cuh"

namespace rve {

CudaKernels cuda_kernels_fast_relaxed()
{
  return make_cuda_kernels<FastFormat>(cuda_kernels_frictionless_fast_relaxed(),
                                       cuda_kernels_rolling_fast_relaxed());
}

}    // namespace rve
