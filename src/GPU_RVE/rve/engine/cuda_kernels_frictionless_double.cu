#include "rve/engine/cuda_kernels.cuh"

namespace rve {

SceneKernels cuda_kernels_frictionless_double()
{
  return make_plain_kernels<Frictionless<DoubleFormat>>();
}

}    // namespace rve
