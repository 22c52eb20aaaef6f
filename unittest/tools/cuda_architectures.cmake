# SPDX-License-Identifier: GPL-2.0-only
# What the kernels are compiled for, decided by cmake/CudaArchitectures.cmake: cmake -P
# cuda_architectures.cmake <source>
cmake_policy(VERSION 3.25)
get_filename_component(source "${CMAKE_CURRENT_LIST_DIR}/../.." ABSOLUTE)
include("${source}/cmake/CudaArchitectures.cmake")
set(cuda_13 75 80 86 87 88 89 90 100 110 103 120 121)
set(cuda_11 35 50 52 70 75 80 86 87 89 90)

function(expect expected)    # expect <list> <arguments of choose_cuda_architectures>
  choose_cuda_architectures(list why ${ARGN})
  if(NOT "${list}" STREQUAL "${expected}")
    message(SEND_ERROR "${ARGN}: '${list}' (${why}) instead of '${expected}'")
  endif()
endfunction()

# the cards that are there, text of the newest for those to come
expect("90" KNOWN ${cuda_13} CARDS 90)
expect("86-real;90" KNOWN ${cuda_13} CARDS 90 86 90)
expect("89" ASKED native KNOWN ${cuda_13} CARDS 89)
# a display card beside it that cannot run them
expect("80" KNOWN ${cuda_13} CARDS 61 80)
# newer than the compiler: its newest text
expect("90" KNOWN ${cuda_11} CARDS 120)
expect("100-real;120" KNOWN ${cuda_13} CARDS 100 120)
# no card, or none that can run them
expect("80-virtual;90" KNOWN ${cuda_13})
expect("80-virtual;90" KNOWN ${cuda_13} CARDS 75)
expect("80" KNOWN 70 75 80 86)
# the user's word
expect("86;90-virtual" ASKED 86 90-virtual KNOWN ${cuda_13} CARDS 90)
expect("90a" ASKED 90a KNOWN ${cuda_13})
expect("80-real;86-real;87-real;88-real;89-real;90-real;100-real;103-real;110-real;120-real;121"
  ASKED all KNOWN ${cuda_13})
expect("80-real;90-real;100-real;110-real;120" ASKED all-major KNOWN ${cuda_13})
