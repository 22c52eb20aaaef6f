#include "rve/engine/cuda_kernels.cuh"

namespace rve {

CudaKernels cuda_kernels_double()
{
  return make_cuda_kernels<DoubleFormat>();
}

}    // namespace rve
