# SPDX-License-Identifier: GPL-2.0-only
# LAMMPS as a static, position-independent library (core + GRANULAR + PLUGIN, MPI, PNG), built once with LAMMPS' own build system and
# kept in a cache outside the build tree, so that every preset and every clean checkout uses the same one.
#
# Sets LAMMPS_SRC (LAMMPS' src directory), LAMMPS_PYTHON (its Python module, empty if it is not there), LAMMPS_STYLES (its generated style
# headers), LAMMPS_VERSION_NUMBER (yyyymmdd) and defines
#   lammps_headers   what compiling against LAMMPS needs (include directories, definitions, MPI)
#   lammps_library   that, and liblammps.a with what it links
#
# With LAMMPS_HEADERS, LAMMPS is a program or library of which only the headers are known: LAMMPS is not built, and there are only LAMMPS_SRC,
# LAMMPS_VERSION_NUMBER and lammps_headers, which suffice for the plugin.

set(LAMMPS_SOURCE_DIR "" CACHE PATH "LAMMPS source tree, 4Feb2025 or newer (empty: tools/get_lammps.sh obtains 4Feb2025)")
set(LAMMPS_HEADERS "" CACHE PATH "Folder with the headers of a compiled LAMMPS: only the plugin for that LAMMPS is built")

set(LAMMPS_SIZES "" CACHE STRING "Sizes of LAMMPS' integers: smallbig, bigbig; empty: LAMMPS' default, smallbig")

find_package(MPI REQUIRED COMPONENTS CXX)

# Sets LAMMPS_VERSION_NUMBER: "4 Feb 2025" in version.h becomes 20250204, the form in which versions can be compared.
function(read_lammps_version)
  file(STRINGS "${LAMMPS_SRC}/version.h" line REGEX "define LAMMPS_VERSION ")
  if(NOT line MATCHES "\"([0-9]+) ([A-Z][a-z][a-z])[a-z]* ([0-9][0-9][0-9][0-9])\"")
    message(FATAL_ERROR "no LAMMPS version in ${LAMMPS_SRC}/version.h")
  endif()
  set(day "0${CMAKE_MATCH_1}")
  set(year "${CMAKE_MATCH_3}")
  string(FIND "JanFebMarAprMayJunJulAugSepOctNovDec" "${CMAKE_MATCH_2}" month)
  math(EXPR month "101 + ${month} / 3")    # 101..112: the leading 1 keeps the zero, and is cut off below
  string(REGEX MATCH "..$" day "${day}")
  string(REGEX MATCH "..$" month "${month}")
  if("${year}${month}${day}" LESS 20250204)
    message(FATAL_ERROR "LAMMPS ${year}${month}${day} is too old: 4Feb2025 (20250204) or newer is needed")
  endif()
  set(LAMMPS_VERSION_NUMBER "${year}${month}${day}" PARENT_SCOPE)
endfunction()

# Defines lammps_headers from folders and preprocessor definitions.
function(add_lammps_headers folders definitions)
  add_library(lammps_headers INTERFACE)
  target_compile_features(lammps_headers INTERFACE cxx_std_17)
  target_compile_definitions(lammps_headers INTERFACE ${definitions} LAMMPS_VERSION_NUMBER=${LAMMPS_VERSION_NUMBER})
  # SYSTEM: warnings are errors in our code, not in LAMMPS' headers
  target_include_directories(lammps_headers SYSTEM INTERFACE ${folders})
  target_link_libraries(lammps_headers INTERFACE MPI::MPI_CXX)
  # LAMMPS' errors name their place in the source, FLERR: it starts at src/, so that no binary has the paths of its build
  target_compile_options(lammps_headers INTERFACE -fmacro-prefix-map=${PROJECT_SOURCE_DIR}/=)
endfunction()

if(LAMMPS_HEADERS)
  if(GPU_RVE_TESTS)
    message(FATAL_ERROR "LAMMPS_HEADERS needs GPU_RVE_TESTS=OFF, since there is no LAMMPS to test with")
  endif()
  set(LAMMPS_SRC "${LAMMPS_HEADERS}")
  if(NOT EXISTS "${LAMMPS_SRC}/version.h")
    message(FATAL_ERROR "LAMMPS_HEADERS is not a folder with LAMMPS' headers (it needs version.h): ${LAMMPS_SRC}")
  endif()
  read_lammps_version()
  set(sizes smallbig)
  if(LAMMPS_SIZES)
    set(sizes "${LAMMPS_SIZES}")
  endif()
  string(TOUPPER "LAMMPS_${sizes}" sizes)    # the only definition on which LAMMPS' headers depend
  add_lammps_headers("${LAMMPS_SRC}" ${sizes})
  return()
endif()

find_package(PNG REQUIRED)

if(DEFINED ENV{GPU_RVE_CACHE})
  set(lammps_cache "$ENV{GPU_RVE_CACHE}")
elseif(DEFINED ENV{XDG_CACHE_HOME})
  set(lammps_cache "$ENV{XDG_CACHE_HOME}/gpu_rve")
else()
  set(lammps_cache "$ENV{HOME}/.cache/gpu_rve")
endif()

# One process at a time gets the source, and one builds a library; a second one waits and finds the result.
file(MAKE_DIRECTORY "${lammps_cache}")
file(LOCK "${lammps_cache}/lock" GUARD FILE TIMEOUT 3600)

set(lammps_tree "${LAMMPS_SOURCE_DIR}")
if(NOT lammps_tree)
  execute_process(COMMAND sh "${PROJECT_SOURCE_DIR}/tools/get_lammps.sh" OUTPUT_VARIABLE lammps_tree
    OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
endif()
file(LOCK "${lammps_cache}/lock" RELEASE)
set(LAMMPS_SRC "${lammps_tree}/src")
if(NOT EXISTS "${LAMMPS_SRC}/version.h" OR NOT EXISTS "${lammps_tree}/cmake/CMakeLists.txt")
  message(FATAL_ERROR "LAMMPS_SOURCE_DIR is not a LAMMPS source tree (it needs src/version.h and cmake/): ${lammps_tree}")
endif()

set(LAMMPS_PYTHON "${lammps_tree}/python/lammps")
if(NOT EXISTS "${LAMMPS_PYTHON}/__init__.py")
  message(STATUS "No Python module in the LAMMPS tree (python/lammps): liblammps.so is built without it")
  set(LAMMPS_PYTHON "")
endif()

read_lammps_version()

set(lammps_options
  -D CMAKE_BUILD_TYPE=Release "-D CMAKE_CXX_FLAGS_RELEASE=-O2 -DNDEBUG" -D CMAKE_POSITION_INDEPENDENT_CODE=ON -D BUILD_SHARED_LIBS=OFF
  -D CMAKE_CXX_STANDARD=17 "-D CMAKE_CXX_COMPILER=${CMAKE_CXX_COMPILER}" -D CMAKE_EXPORT_COMPILE_COMMANDS=ON
  -D BUILD_MPI=ON -D BUILD_OMP=OFF -D PKG_GRANULAR=ON -D PKG_PLUGIN=ON
  -D WITH_PNG=ON -D WITH_JPEG=OFF -D WITH_GZIP=ON -D WITH_FFMPEG=OFF -D WITH_CURL=OFF)
set(lammps_folders "${LAMMPS_SRC}" "${LAMMPS_SRC}/GRANULAR" "${LAMMPS_SRC}/PLUGIN")
if(EXISTS "${LAMMPS_SRC}/GRAPHICS")    # has dump image in releases of 2026
  list(APPEND lammps_options -D PKG_GRAPHICS=ON)
  list(APPEND lammps_folders "${LAMMPS_SRC}/GRAPHICS")
endif()
if(LAMMPS_SIZES)
  list(APPEND lammps_options -D "LAMMPS_SIZES=${LAMMPS_SIZES}")
endif()
# no part of the key: the library is the same
set(lammps_faster "-D CMAKE_PROJECT_lammps_INCLUDE=${CMAKE_CURRENT_LIST_DIR}/LammpsPrecompiled.cmake")

# The key: whatever changes the library. A tree of the user's is known by its place and its commit.
set(lammps_commit "")
if(LAMMPS_SOURCE_DIR)
  execute_process(COMMAND git -C "${lammps_tree}" describe --always --dirty OUTPUT_VARIABLE lammps_commit ERROR_QUIET)
endif()
string(SHA1 lammps_key "${lammps_tree};${lammps_commit};${LAMMPS_VERSION_NUMBER};${CMAKE_CXX_COMPILER_VERSION};$ENV{CXXFLAGS};${MPI_CXX_LIBRARIES};${lammps_options}")
string(SUBSTRING "${lammps_key}" 0 8 lammps_key)
set(lammps_built "${lammps_cache}/liblammps-${LAMMPS_VERSION_NUMBER}-${lammps_key}")

# its own lock: who builds with another release does not wait for this one
file(LOCK "${lammps_built}.lock" GUARD FILE TIMEOUT 3600)
if(NOT EXISTS "${lammps_built}/compile_commands.json")
  message(STATUS "Building LAMMPS ${LAMMPS_VERSION_NUMBER} once, for all later builds (some 240 s of one core; Ninja counts below)")
  # Built in a work directory, where an interrupted build goes on later, and moved to its name only when whole.
  set(lammps_work "${lammps_built}.work")
  set(lammps_whole "${lammps_built}.whole")
  execute_process(COMMAND "${CMAKE_COMMAND}" -S "${lammps_tree}/cmake" -B "${lammps_work}" -G "${CMAKE_GENERATOR}"
    "-DCMAKE_MAKE_PROGRAM=${CMAKE_MAKE_PROGRAM}" "-DMPI_CXX_COMPILER=${MPI_CXX_COMPILER}" ${lammps_options} ${lammps_faster} OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
  execute_process(COMMAND "${CMAKE_COMMAND}" --build "${lammps_work}" --target lammps --parallel COMMAND_ERROR_IS_FATAL ANY)
  file(REMOVE_RECURSE "${lammps_whole}")
  file(COPY "${lammps_work}/liblammps.a" "${lammps_work}/styles" "${lammps_work}/compile_commands.json" DESTINATION "${lammps_whole}")
  file(RENAME "${lammps_whole}" "${lammps_built}")
  file(REMOVE_RECURSE "${lammps_work}")
endif()
file(LOCK "${lammps_built}.lock" RELEASE)
set(LAMMPS_STYLES "${lammps_built}/styles")
message(STATUS "LAMMPS ${LAMMPS_VERSION_NUMBER}: ${lammps_built}/liblammps.a")

# Our sources see LAMMPS exactly as its own do: the definitions come from the command that compiled modify.cpp. A path with blanks is
# in quotes, \" in the file.
file(READ "${lammps_built}/compile_commands.json" lammps_commands)
string(REGEX MATCH "\"command\": \"([^\n]*)/src/modify.cpp[\\]?\"" lammps_command "${lammps_commands}")
if(NOT lammps_command)
  message(FATAL_ERROR "${lammps_built}/compile_commands.json does not say how modify.cpp was compiled: remove ${lammps_built}")
endif()
string(REGEX MATCHALL " -D[^ ]+" lammps_definitions "${lammps_command}")
list(TRANSFORM lammps_definitions REPLACE "^ -D" "")

add_lammps_headers("${lammps_folders}" "${lammps_definitions}")

add_library(lammps_archive STATIC IMPORTED)
set_target_properties(lammps_archive PROPERTIES IMPORTED_LOCATION "${lammps_built}/liblammps.a")
target_link_libraries(lammps_archive INTERFACE PNG::PNG MPI::MPI_CXX ${CMAKE_DL_LIBS})

add_library(lammps_library INTERFACE)
target_link_libraries(lammps_library INTERFACE lammps_headers lammps_archive)
