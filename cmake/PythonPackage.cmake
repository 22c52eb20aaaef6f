# SPDX-License-Identifier: GPL-2.0-only
# Defaults of `pip install .` (pyproject.toml): what takes minutes and cannot run on this machine is left out. An option that is given,
# as in `pip install . --config-settings=cmake.define.GPU_RVE_CUDA=ON`, is kept. tools/wheel.sh gives all of them.

# Sets <result> to ON if this machine has an NVIDIA GPU that the kernels support.
function(find_supported_gpu result)
  execute_process(COMMAND sh "${PROJECT_SOURCE_DIR}/tools/cuda_cards.sh" OUTPUT_VARIABLE cards)
  string(REGEX MATCHALL "[0-9]+" cards "${cards}")
  set(found OFF)
  if(NOT cards AND EXISTS /dev/nvidia0)    # a container without nvidia-smi
    set(found ON)
  endif()
  foreach(card IN LISTS cards)
    if(card GREATER_EQUAL oldest_cuda_architecture)
      set(found ON)
    endif()
  endforeach()
  set(${result} ${found} PARENT_SCOPE)
endfunction()

# Sets <result> to ON if this processor needs the baseline kernels (has_x86_64_v3 in rve/engine/host_calls.cpp).
function(find_old_processor result)
  set(flags "")
  if(EXISTS /proc/cpuinfo)
    file(STRINGS /proc/cpuinfo flags REGEX "^flags" LIMIT_COUNT 1)
  endif()
  set(old OFF)
  foreach(flag avx2 fma bmi2)
    if(NOT "${flags} " MATCHES " ${flag} ")
      set(old ON)
    endif()
  endforeach()
  set(${result} ${old} PARENT_SCOPE)
endfunction()

if(GPU_RVE_CUDA STREQUAL "AUTO")
  find_supported_gpu(has_gpu)
  if(NOT has_gpu)
    set(GPU_RVE_CUDA OFF)
    message(STATUS "Python package: no GPU engine, since there is no supported GPU here; "
      "--config-settings=cmake.define.GPU_RVE_CUDA=ON compiles it")
  endif()
endif()
if(NOT DEFINED GPU_RVE_BASELINE_KERNELS)
  find_old_processor(GPU_RVE_BASELINE_KERNELS)
  if(NOT GPU_RVE_BASELINE_KERNELS)
    message(STATUS "Python package: CPU kernels for processors with AVX2, FMA and BMI2, as this one; "
      "--config-settings=cmake.define.GPU_RVE_BASELINE_KERNELS=ON compiles those for older ones, too")
  endif()
endif()
if(NOT DEFINED GPU_RVE_QUICK_KERNELS)
  set(GPU_RVE_QUICK_KERNELS Double)
  message(STATUS "Python package: CPU kernels of the format double are compiled quickly; "
    "--config-settings=cmake.define.GPU_RVE_QUICK_KERNELS= takes two more minutes of one core and makes them 1.4 times as fast")
endif()
