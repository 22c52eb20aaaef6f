#include "rve/engine/cuda_kernels.cuh"

namespace rve {

SceneKernels cuda_kernels_rolling_mixed()
{
  return make_general_kernels<Rolling<MixedFormat>>();
}

}    // namespace rve
