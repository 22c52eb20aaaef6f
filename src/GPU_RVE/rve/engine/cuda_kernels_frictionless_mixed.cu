#include "rve/engine/cuda_kernels.cuh"

namespace rve {

SceneKernels cuda_kernels_frictionless_mixed()
{
  return make_plain_kernels<Frictionless<MixedFormat>>();
}

}    // namespace rve
