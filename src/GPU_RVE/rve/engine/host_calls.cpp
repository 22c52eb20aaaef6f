// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/host_calls.h"

#include "rve/core/error.h"
#include "rve/core/first_error.h"

#include <algorithm>
#include <omp.h>

namespace rve {

bool has_x86_64_v3()
{
#if defined(RVE_WITH_X86_64_V3)
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
      __builtin_cpu_supports("bmi2");
#else
  return false;
#endif
}

template <int D> HostKernel<D> best_host_kernel(Format format)
{
#if defined(RVE_WITH_X86_64_V3)
  if (has_x86_64_v3()) return host_kernel<InstructionSet::v3, D>(format);
#endif
#if defined(RVE_WITHOUT_BASELINE)
  throw InputError("this build requires a CPU with AVX2, FMA and BMI2: it has no kernels for older "
                   "CPUs (GPU_RVE_BASELINE_KERNELS=OFF)");
#else
  return host_kernel<InstructionSet::baseline, D>(format);
#endif
}

int chosen_threads(int threads)
{
  return threads > 0 ? threads : omp_get_max_threads();
}

void for_each_on_threads(int count, int threads, const std::function<void(int m, int thread)> &work)
{
  FirstError failed;
#pragma omp parallel for schedule(dynamic, 1) num_threads(std::max(1, std::min(threads, count)))
  for (int m = 0; m < count; ++m) failed.guard(m, [&] { work(m, omp_get_thread_num()); });
  failed.rethrow();
}

template HostKernel<2> best_host_kernel(Format format);
template HostKernel<3> best_host_kernel(Format format);

}    // namespace rve
