// SPDX-License-Identifier: GPL-2.0-only
// Words of messages and files for a space of D dimensions.

#pragma once

namespace rve {

template <int D> struct DimensionWords;

template <> struct DimensionWords<2> {
  static constexpr const char *number = "two", *grains = "plane disks", *spin = "spin";
  /// Volume of a cell, and of a grain.
  static constexpr const char *volume = "area", *unit_of_volume = "[length^2]";
  static constexpr const char *volume_of_grain = "pi r^2";
};

template <> struct DimensionWords<3> {
  static constexpr const char *number = "three", *grains = "spheres", *spin = "w_x w_y w_z";
  static constexpr const char *volume = "volume", *unit_of_volume = "[length^3]";
  static constexpr const char *volume_of_grain = "4/3 pi r^3";
};

}    // namespace rve
