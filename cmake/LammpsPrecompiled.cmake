# SPDX-License-Identifier: GPL-2.0-only
# Read by LAMMPS' own build (CMAKE_PROJECT_lammps_INCLUDE): nearly half the time that its files compile goes into headers that all of them
# include, so those are compiled once. The code of all objects is the same, byte for byte; one would be optimised differently.
set(lammps_src "${CMAKE_CURRENT_SOURCE_DIR}/../src")
set(common_headers "")
foreach(header pointers error atom comm domain force memory modify update)
  list(APPEND common_headers "${lammps_src}/${header}.h")
endforeach()
cmake_language(DEFER CALL target_precompile_headers lammps PRIVATE <cmath> <cstring> <map> <mpi.h> <string> <vector> ${common_headers})
get_filename_component(lammps_src "${lammps_src}" ABSOLUTE)
set_source_files_properties("${lammps_src}/fmtlib_format.cpp" PROPERTIES SKIP_PRECOMPILE_HEADERS ON)
