# SPDX-License-Identifier: GPL-2.0-only
# Where `cmake --install` puts things, below its prefix. All of ours is in folders gpu_rve, and the program has a name of its own, so that
# a LAMMPS of the system, with its lmp, liblammps and Python module, stays what it is.
include(GNUInstallDirs)
set(GPU_RVE_INSTALL_INCLUDEDIR "${CMAKE_INSTALL_INCLUDEDIR}/gpu_rve")
set(GPU_RVE_INSTALL_LIBDIR "${CMAKE_INSTALL_LIBDIR}/gpu_rve")
set(GPU_RVE_INSTALL_CMAKEDIR "${CMAKE_INSTALL_LIBDIR}/cmake/gpu_rve")
set(GPU_RVE_INSTALL_DATADIR "${CMAKE_INSTALL_DATADIR}/gpu_rve")
set(GPU_RVE_INSTALL_DOCDIR "${CMAKE_INSTALL_DATADIR}/doc/gpu_rve")

# Programs and libraries of ours do not need each other. Libraries that lie outside the system's folders, an MPI of a module say, are
# found again where they were linked.
set(CMAKE_INSTALL_RPATH_USE_LINK_PATH ON)
