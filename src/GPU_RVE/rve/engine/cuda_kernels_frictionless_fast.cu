#include "rve/engine/cuda_kernels.cuh"

namespace rve {

SceneKernels cuda_kernels_frictionless_fast()
{
  return make_plain_kernels<Frictionless<FastFormat>>();
}

}    // namespace rve
