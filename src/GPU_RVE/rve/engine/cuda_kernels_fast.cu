#include "rve/engine/cuda_kernels.cuh"

namespace rve {

CudaKernels cuda_kernels_fast()
{
  return make_cuda_kernels<FastFormat>(cuda_kernels_frictionless_fast(),
                                       cuda_kernels_rolling_fast());
}

}    // namespace rve
