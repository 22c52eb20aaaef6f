# SPDX-License-Identifier: GPL-2.0-only
# cmake -D SOURCES=<src/GPU_RVE> -D OUTPUT=<file.cpp> -P EmbedKernelText.cmake
#
# Writes the text that kernels are compiled from at run time (rve/engine/kernel_text.h): cuda_kernels.cuh and all that it includes. Each
# standard header among them is cuda/nvrtc_std.h under another name. In the program, the text is always that of the program, wherever its
# file goes; headers of an install tree may be others.

cmake_policy(VERSION 3.24)
file(READ "${SOURCES}/cuda/nvrtc_std.h" standard)
set(waiting rve/engine/cuda_kernels.cuh)
set(seen "")
set(rows "")
set(all "")
while(waiting)
  list(POP_FRONT waiting name)
  if(name IN_LIST seen)
    continue()
  endif()
  list(APPEND seen "${name}")
  if(name MATCHES "^<(.*)>$")
    set(name "${CMAKE_MATCH_1}")
    set(text "${standard}")
  else()
    file(READ "${SOURCES}/${name}" text)
    string(REGEX MATCHALL "\n *# *include +(\"[^\"\n]+\"|<[^>\n]+>)" includes "${text}")
    foreach(include IN LISTS includes)
      string(REGEX REPLACE "\n *# *include +" "" include "${include}")
      string(REPLACE "\"" "" include "${include}")
      list(APPEND waiting "${include}")
    endforeach()
  endif()
  string(FIND "${text}" ")rve_text\"" end)
  if(NOT end EQUAL -1)
    message(FATAL_ERROR "${name} has the mark of the end of a text")
  endif()
  string(APPEND rows "    {\"${name}\", R\"rve_text(${text})rve_text\"},\n")
  string(APPEND all "${name}\n${text}")
endwhile()
string(SHA256 digest "${all}")
file(WRITE "${OUTPUT}" "// Made by cmake/EmbedKernelText.cmake.\n#include \"rve/engine/kernel_text.h\"\n\nnamespace rve {\n
const std::vector<DeviceHeader> &kernel_headers()\n{\n  static const std::vector<DeviceHeader> headers = {\n${rows}  };\n  return headers;\n}\n
const char *kernel_text_digest()\n{\n  return \"${digest}\";\n}\n\n}    // namespace rve\n")
