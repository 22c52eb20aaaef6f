# SPDX-License-Identifier: GPL-2.0-only
# How our code is compiled: two interface libraries, rve_arithmetic (what the results depend on) and rve_warnings.

set(host_code "$<COMPILE_LANGUAGE:CXX>")
set(cuda_code "$<COMPILE_LANGUAGE:CUDA>")

# Strict arithmetic: what is written is what is computed, on the CPU as on the GPU, so that their states can be compared bit for bit.
# No contraction into fused operations behind our back (fma is written where it is meant), IEEE division and root, denormals kept.
# errno and floating point traps are not used; without them the compiler may vectorise, and no result changes.
add_library(rve_arithmetic INTERFACE)
set(strict_host -ffp-contract=off -fno-math-errno -fno-trapping-math)
# A target with the property RVE_RELAXED may contract; its code says what else it relaxes (rve/core/arithmetic.h).
# The rest is what kernels that are compiled at run time have too (rve/engine/runtime_kernels.cpp).
set(RVE_CUDA_ARITHMETIC -prec-div=true -prec-sqrt=true -ftz=false)
set(strict_cuda "-fmad=$<IF:$<BOOL:$<TARGET_PROPERTY:RVE_RELAXED>>,true,false>" ${RVE_CUDA_ARITHMETIC})
list(JOIN strict_host "," strict_host_of_nvcc)
target_compile_options(rve_arithmetic INTERFACE
  "$<${host_code}:${strict_host}>"
  "$<${cuda_code}:${strict_cuda};-Xcompiler=${strict_host_of_nvcc}>")

# Warning flags of g++ and clang; through nvcc only those that its own generated code does not trip over (no -Wpedantic).
add_library(rve_warnings INTERFACE)
target_compile_options(rve_warnings INTERFACE "$<${host_code}:-Wall;-Wextra>" "$<${cuda_code}:-Xcompiler=-Wall,-Wextra>")
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # g++ 12 sees overflows where it has unrolled std::swap and std::copy on vectors whose length it lost
  target_compile_options(rve_warnings INTERFACE "$<${host_code}:-Wno-stringop-overflow>")
endif()
if(GPU_RVE_WERROR)
  # the sanitizers make g++ warn of what is in order
  set(is_warned 1)
  if(GPU_RVE_SANITIZE)
    set(is_warned $<BOOL:$<TARGET_PROPERTY:RVE_NOT_SANITIZED>>)
  endif()
  target_compile_options(rve_warnings INTERFACE "$<$<AND:${host_code},${is_warned}>:-Werror>" "$<${cuda_code}:--Werror=all-warnings;-Xcompiler=-Werror>")
endif()

# Options, not definitions: a target that is not sanitized leaves them out (src/GPU_RVE/CMakeLists.txt). RVE_SANITIZED is for rve/core/config.h:
# the compiler may leave functions as they are. They follow the flags of the build type, of which they leave nothing: -Og is compiled in half the
# time of -O3, and asserts hold.
if(GPU_RVE_SANITIZE)
  add_compile_options("$<${host_code}:-fsanitize=${GPU_RVE_SANITIZE};-fno-sanitize-recover=all;-fno-omit-frame-pointer;-Og;-g1;-UNDEBUG;-DRVE_SANITIZED>")
  add_link_options("-fsanitize=${GPU_RVE_SANITIZE}")
endif()
