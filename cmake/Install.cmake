# SPDX-License-Identifier: GPL-2.0-only
# `cmake --install <build tree> --prefix <prefix>` installs what was built; with --component one part of it:
#
#   lmp           lmp_gpu_rve, the examples with their packings, scripts that draw results, licence and citation
#   plugin        gpurveplugin.so
#   python        liblammps.so, LAMMPS' Python module
#   librve        librve.so with its header and the pkg-config file librve.pc
#   development   headers, static libraries, the CMake package gpu_rve
#   manual        the manual, if the target `manual` was built
include(CMakePackageConfigHelpers)

# ---- programs, libraries ----------------------------------------------------------------------------------------------------------
if(GPU_RVE_LAMMPS)
  install(TARGETS gpurveplugin LIBRARY DESTINATION "${GPU_RVE_INSTALL_LIBDIR}" COMPONENT plugin)
endif()
if(TARGET lmp)
  # a target keeps its name when it is installed, a file need not; lmp has nothing in it that only holds in the build tree
  install(PROGRAMS "$<TARGET_FILE:lmp>" DESTINATION "${CMAKE_INSTALL_BINDIR}" RENAME lmp_gpu_rve COMPONENT lmp)
  install(TARGETS liblammps EXPORT gpu_rve_lammps LIBRARY DESTINATION "${GPU_RVE_INSTALL_LIBDIR}" COMPONENT python)
  if(LAMMPS_PYTHON)
    set(module "${GPU_RVE_INSTALL_LIBDIR}/python/lammps")
    install(DIRECTORY "${LAMMPS_PYTHON}/" DESTINATION "${module}" COMPONENT python FILES_MATCHING PATTERN "*.py")
    # the module loads the liblammps.so that lies beside it
    install(CODE "file(CREATE_LINK ../../liblammps.so \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${module}/liblammps.so\" SYMBOLIC)"
      COMPONENT python)
  endif()
endif()

# ---- the C interface, where compilers look -----------------------------------------------------------------------------------------
install(TARGETS librve EXPORT gpu_rve_librve LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT librve)
install(FILES "${PROJECT_SOURCE_DIR}/src/GPU_RVE/capi/librve.h" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}" COMPONENT librve)
configure_file("${CMAKE_CURRENT_LIST_DIR}/librve.pc.in" "${PROJECT_BINARY_DIR}/cmake/librve.pc" @ONLY)
install(FILES "${PROJECT_BINARY_DIR}/cmake/librve.pc" DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig" COMPONENT librve)
install(EXPORT gpu_rve_librve NAMESPACE gpu_rve:: DESTINATION "${GPU_RVE_INSTALL_CMAKEDIR}" COMPONENT librve)

# ---- headers, static libraries, the CMake package ---------------------------------------------------------------------------------
set(sources "${PROJECT_SOURCE_DIR}/src/GPU_RVE")
install(DIRECTORY "${sources}/cuda" "${sources}/rve" "${sources}/mpm" "${sources}/macro" "${sources}/field"
  DESTINATION "${GPU_RVE_INSTALL_INCLUDEDIR}" COMPONENT development
  FILES_MATCHING PATTERN "*.h")
set(libraries rve_arithmetic rve_headers cuda_device rve_engine mpm macro)
if(GPU_RVE_FIELD)
  list(APPEND libraries field)
endif()
if(GPU_RVE_WITH_CUDA)
  list(APPEND libraries rve_cuda rve_runtime_kernels)
endif()
install(TARGETS ${libraries} EXPORT gpu_rve_engine ARCHIVE DESTINATION "${GPU_RVE_INSTALL_LIBDIR}" COMPONENT development)
install(EXPORT gpu_rve_engine NAMESPACE gpu_rve:: DESTINATION "${GPU_RVE_INSTALL_CMAKEDIR}" COMPONENT development)
if(TARGET lmp)
  install(FILES "${LAMMPS_SRC}/library.h" DESTINATION "${GPU_RVE_INSTALL_INCLUDEDIR}/lammps" COMPONENT development)
  install(EXPORT gpu_rve_lammps NAMESPACE gpu_rve:: DESTINATION "${GPU_RVE_INSTALL_CMAKEDIR}" COMPONENT development)
endif()

set(config "${PROJECT_BINARY_DIR}/cmake")
configure_package_config_file("${CMAKE_CURRENT_LIST_DIR}/gpu_rve-config.cmake.in" "${config}/gpu_rve-config.cmake"
  INSTALL_DESTINATION "${GPU_RVE_INSTALL_CMAKEDIR}" PATH_VARS GPU_RVE_INSTALL_LIBDIR GPU_RVE_INSTALL_DATADIR)
write_basic_package_version_file("${config}/gpu_rve-config-version.cmake" COMPATIBILITY SameMinorVersion)
foreach(component librve development)
  install(FILES "${config}/gpu_rve-config.cmake" "${config}/gpu_rve-config-version.cmake" DESTINATION "${GPU_RVE_INSTALL_CMAKEDIR}" COMPONENT ${component})
endforeach()
install(FILES "${CMAKE_CURRENT_LIST_DIR}/FindFFTW3.cmake" DESTINATION "${GPU_RVE_INSTALL_CMAKEDIR}" COMPONENT development)

# ---- examples, documents ----------------------------------------------------------------------------------------------------------
# Scripts name their packings relative to the folder `examples`, which is installed, and can be copied, as a whole; without what runs
# have left in it.
install(DIRECTORY "${PROJECT_SOURCE_DIR}/examples" DESTINATION "${GPU_RVE_INSTALL_DATADIR}" COMPONENT lmp FILES_MATCHING
  REGEX "/(__pycache__|out|study|small|ensemble|controls|[^/]*\\.out)$" EXCLUDE
  REGEX "/((in|study)\\.[^/]*|log\\.[0-9][^/]*|[^/]*\\.(md|py|sh|paths|ipynb|json|xml))$"
  REGEX "/umat/[^/]*\\.cpp$"
  REGEX "/restart/(fixes|ground|results)$"
  REGEX "/packings/[^/]*\\.rve$"
  REGEX "/(reference|element_tests|[^/]*\\.baseline)/[^/]*\\.csv$")
install(CODE "file(CREATE_LINK examples/packings \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${GPU_RVE_INSTALL_DATADIR}/packings\" SYMBOLIC)"
  COMPONENT lmp)
# scripts that draw, convert and record the results; the examples find them by the same relative path as in the repository
set(tools "${PROJECT_SOURCE_DIR}/tools")
install(FILES "${tools}/bench_records.py" "${tools}/dumps.py" "${tools}/import_packing.py" "${tools}/plot_fields.py" "${tools}/plot_instability.py" "${tools}/to_paraview.py" DESTINATION "${GPU_RVE_INSTALL_DATADIR}/tools" COMPONENT lmp)
install(FILES "${PROJECT_SOURCE_DIR}/README.md" "${PROJECT_SOURCE_DIR}/LICENSE" "${PROJECT_SOURCE_DIR}/CITATION.cff"
  DESTINATION "${GPU_RVE_INSTALL_DOCDIR}" COMPONENT lmp)

# The manual is built on demand: cmake --build <build tree> --target manual
find_program(GPU_RVE_SPHINX sphinx-build PATHS /usr/bin)
mark_as_advanced(GPU_RVE_SPHINX)
if(GPU_RVE_SPHINX)
  add_custom_target(manual COMMAND "${GPU_RVE_SPHINX}" -q -b html -d "${PROJECT_BINARY_DIR}/manual-doctrees"
    "${PROJECT_SOURCE_DIR}/doc/src" "${PROJECT_BINARY_DIR}/manual" COMMENT "Building the manual: ${PROJECT_BINARY_DIR}/manual" VERBATIM)
endif()
install(DIRECTORY "${PROJECT_BINARY_DIR}/manual/" DESTINATION "${GPU_RVE_INSTALL_DOCDIR}/html" COMPONENT manual OPTIONAL
  PATTERN ".buildinfo" EXCLUDE)

# The Python package gpu_rve, by pip (pyproject.toml): the library lies beside its modules, with the header that they read.
install(FILES "$<TARGET_FILE:librve>" DESTINATION gpu_rve RENAME librve.so COMPONENT python_package EXCLUDE_FROM_ALL)
install(FILES "${PROJECT_SOURCE_DIR}/src/GPU_RVE/capi/librve.h" DESTINATION gpu_rve COMPONENT python_package EXCLUDE_FROM_ALL)

# The Python package gpu_rve_lammps (tools/plugin_wheel.sh)
if(LAMMPS_HEADERS)
  install(FILES "$<TARGET_FILE:gpurveplugin>" DESTINATION gpu_rve_lammps COMPONENT python_plugin EXCLUDE_FROM_ALL)
endif()
