#include "rve/engine/cuda_kernels.cuh"

namespace rve {

SceneKernels cuda_kernels_rolling_double()
{
  return make_general_kernels<Rolling<DoubleFormat>>();
}

}    // namespace rve
