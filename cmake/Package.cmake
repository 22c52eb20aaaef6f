# SPDX-License-Identifier: GPL-2.0-only
# `cpack --config <build tree>/CPackConfig.cmake` makes a Debian package of librve, as it was built, for machines that have no build tree: with CUDA or without.
# The folder debian/ has the packages of all of GPU_RVE.
set(CPACK_GENERATOR DEB)
set(CPACK_COMPONENTS_ALL librve)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PACKAGE_CONTACT "the GPU_RVE authors <gpu_rve@localhost>")
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_LIBRVE_PACKAGE_NAME librve)
set(CPACK_DEBIAN_LIBRVE_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_LIBRVE_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_LIBRVE_PACKAGE_CONTROL_STRICT_PERMISSION ON)
# library and header in one, in place of those of debian/
set(CPACK_DEBIAN_LIBRVE_PACKAGE_PROVIDES "librve1, librve-dev")
set(CPACK_DEBIAN_LIBRVE_PACKAGE_CONFLICTS "librve1, librve-dev")
set(CPACK_DEBIAN_LIBRVE_PACKAGE_REPLACES "librve1, librve-dev")
set(CPACK_COMPONENT_LIBRVE_DESCRIPTION "granular packings for continuum codes
A representative volume element is a periodic packing of a few hundred grains
that is simulated by the discrete element method; deformed, it answers with its
stress. This library advances many of them, behind the points of any continuum
code. It has an interface in C, and comes with its header.")
include(CPack)
