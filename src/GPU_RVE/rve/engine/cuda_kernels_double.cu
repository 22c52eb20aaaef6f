#include "rve/engine/cuda_kernels.cuh"

namespace rve {

CudaKernels cuda_kernels_double()
{
  return make_cuda_kernels<DoubleFormat>(cuda_kernels_frictionless_double(),
                                         cuda_kernels_rolling_double());
}

}    // namespace rve
