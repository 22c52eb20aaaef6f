#include "rve/engine/cuda_kernels.cuh"

namespace rve {

CudaKernels cuda_kernels_mixed()
{
  return make_cuda_kernels<MixedFormat>(cuda_kernels_frictionless_mixed(),
                                        cuda_kernels_rolling_mixed());
}

}    // namespace rve
