// SPDX-License-Identifier: GPL-2.0-only
// The packings of fix rve, and which of them, and which image of it, an atom gets.

#pragma once

#include "lammps/rve_settings.h"
#include "rve/engine/contact_model.h"
#include "rve/engine/packing_library.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace LAMMPS_NS {

/// Of disks or of spheres, one of them for all.
template <int D> class RvePackingsOf {
 public:
  using State = rve::RveStateOf<D>;

  /// Reads packing files and libraries by one rank and spreads the packings as byte images; collective. Errors end in error->all.
  void read(LAMMPS *lmp, const FixRveSettings &settings);

  int size() const { return static_cast<int>(packings.size()); }
  const std::vector<State> &all() const { return packings; }
  /// Of the smallest packing, and of the largest.
  int fewest_grains() const;
  int most_grains() const;
  /// What contacts of RVEs need that are made of them. Throws InputError if their contact laws differ.
  rve::ContactModel contacts() const;
  /// "packing 3 (library.rve)"
  std::string name(int packing) const;
  /// Stable time step of each packing [time].
  const std::vector<double> &bounds() const { return stable; }
  double least_bound() const { return *std::min_element(stable.begin(), stable.end()); }

  /// What has been read, before the script changed its material, in a number.
  std::uint64_t identity() const { return checksum; }
  /// Changes the material of RVEs that will be made, as the script says. Throws InputError if a value is out of range.
  void change(const MaterialWords &words, double mass_scaling, double mass_scaling_before);

  /// The states that these local atoms of the group begin with; collective. They depend on the IDs of the atoms and on the
  /// settings, not on ranks. The pointers are good until the next call.
  std::vector<const State *> choose(LAMMPS *lmp, int igroup, PackingChoice &choice,
                                    const std::vector<int> &atoms);

 private:
  std::vector<State> packings;
  std::vector<std::string> files;
  std::uint64_t checksum = 0;
  // per packing
  std::vector<int> file_of;
  std::vector<double> stable;
  std::vector<double> void_ratios;

  /// Packings among which void ratios and random draws choose: those of a stress, or all.
  struct Pool {
    std::vector<int> packings;
    rve::VoidRatioIndex by_void_ratio;
  };
  std::vector<Pool> pools;
  std::optional<rve::StressLevels> levels;        // of the pools, if there is a choice by stress
  std::map<std::pair<int, int>, State> images;    // of packing, number of the image

  struct Atoms;

  void make_pools(LAMMPS *lmp, bool by_stress);
  std::vector<int> choose_pools(const Atoms &atoms, PackingChoice &choice) const;
  std::vector<int> choose_packings(const Atoms &atoms, PackingChoice &choice) const;
  std::vector<int> choose_images(const Atoms &atoms, PackingChoice &choice) const;
  void report(LAMMPS *lmp, const std::vector<int> &chosen) const;
  void warn_of_images(LAMMPS *lmp, const std::vector<int> &chosen,
                      const std::vector<int> &image) const;
};

}    // namespace LAMMPS_NS
