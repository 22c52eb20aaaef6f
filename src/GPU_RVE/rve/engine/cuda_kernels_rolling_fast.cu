#include "rve/engine/cuda_kernels.cuh"

namespace rve {

SceneKernels cuda_kernels_rolling_fast()
{
  return make_general_kernels<Rolling<FastFormat>>();
}

}    // namespace rve
