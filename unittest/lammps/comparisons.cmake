# SPDX-License-Identifier: GPL-2.0-only
# The comparisons of examples/crosscheck and examples/validation. rve_add_comparison(name script
# arguments...): exit status 0 if all of its checks hold. They need Python with numpy.
include("${PROJECT_SOURCE_DIR}/unittest/python.cmake")
if(NOT python)
  message(WARNING
    "no python3 with numpy: the comparisons of examples/crosscheck and examples/validation are not among the tests")
endif()

function(rve_add_comparison name script)
  if(NOT python)
    return()
  endif()
  add_test(NAME ${name} COMMAND ${python} ${PROJECT_SOURCE_DIR}/examples/${script} --lmp
    $<TARGET_FILE:lmp>
    --dir ${CMAKE_CURRENT_BINARY_DIR}/${name} ${ARGN})
  set_tests_properties(${name} PROPERTIES LABELS lammps TIMEOUT ${RVE_TEST_LIMIT} ENVIRONMENT
    "${RVE_MPI_ENVIRONMENT};PYTHONDONTWRITEBYTECODE=1")
  if(GPU_RVE_WITH_CUDA)
    set_tests_properties(${name} PROPERTIES RESOURCE_LOCK cuda_device)
  endif()
endfunction()
rve_add_comparison(validation_crosscheck crosscheck/crosscheck.py --short --plain
  $<TARGET_FILE:lmp_plain>)
# without an executable: a message and exit status 2
if(python)
  add_test(NAME validation_crosscheck_without_lmp COMMAND sh -c
    "message=$(${python} '${PROJECT_SOURCE_DIR}/examples/crosscheck/crosscheck.py' --lmp no/lmp); [ $? = 2 ] && [ \"\${message#no executable no/lmp}\" != \"$message\" ]")
  set_tests_properties(validation_crosscheck_without_lmp PROPERTIES LABELS lammps TIMEOUT
    ${RVE_TEST_LIMIT} ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
endif()
rve_add_comparison(validation_compare_states validation/compare_states.py)
rve_add_comparison(validation_compare_codes validation/compare_codes.py --short)
rve_add_comparison(validation_ensemble validation/ensemble.py --short)
rve_add_comparison(validation_rolling validation/rolling.py --short --threads 1)
rve_add_comparison(validation_thread_count validation/thread_count.py --short)
rve_add_comparison(validation_objectivity validation/objectivity/objectivity.py --short)
rve_add_comparison(validation_packing validation/packing/packing.py --short)
rve_add_comparison(validation_deviations validation/deviations/deviations.py --short)
