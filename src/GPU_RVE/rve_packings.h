// SPDX-License-Identifier: GPL-2.0-only
// The packings of fix rve, and the choice of a packing and of its image for each atom.

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

/// Packings of disks (D = 2) or of spheres (D = 3).
template <int D> class RvePackingsOf {
 public:
  using State = rve::RveStateOf<D>;

  /// Reads packing files and libraries on rank 0 and broadcasts the packings; collective. Errors
  /// end in error->all.
  void read(LAMMPS *lmp, const FixRveSettings &settings);

  int size() const { return static_cast<int>(packings.size()); }
  const std::vector<State> &all() const { return packings; }
  int fewest_grains() const;
  int most_grains() const;
  /// Returns the contact model for RVEs of these packings. Throws InputError if their contact laws
  /// differ.
  rve::ContactModel contacts() const;
  /// Returns a name for messages, as "packing 3 (library.rve)".
  std::string name(int packing) const;
  /// Returns the stable time step of each packing [time].
  const std::vector<double> &bounds() const { return stable; }
  /// Returns the least stable time step of the packings [time].
  double least_bound() const { return *std::min_element(stable.begin(), stable.end()); }

  /// Returns a checksum of the packings as read, before the script changed their material.
  std::uint64_t identity() const { return checksum; }
  /// Changes the material of RVEs that will be made. Throws InputError if a value is out of range.
  void change(const MaterialArguments &words, double mass_scaling, double mass_scaling_before);

  /// Returns the initial states of the RVEs of these local atoms of the group; collective. They
  /// depend on atom IDs and settings, not on the number of ranks. The pointers are valid until the
  /// next call.
  std::vector<const State *> choose(LAMMPS *lmp, int igroup, PackingChoice &choice,
                                    const std::vector<int> &atoms);

 private:
  std::string fix;    // name of the fix, with which messages begin
  std::vector<State> packings;
  std::vector<std::string> files;
  std::uint64_t checksum = 0;
  // one value for each packing
  std::vector<int> file_of;           // index in `files`
  std::vector<double> stable;         // stable time step [time]
  std::vector<double> void_ratios;    // [-]

  /// Packings of one stress level, or all packings. The packing of an atom is chosen from a pool by
  /// its void ratio or at random.
  struct Pool {
    std::vector<int> packings;
    rve::VoidRatioIndex by_void_ratio;
  };
  std::vector<Pool> pools;
  // stresses of the pools, if the pool of an atom is chosen by stress
  std::optional<rve::StressLevels> levels;
  std::map<std::pair<int, int>, State> images;    // key: number of the packing, number of the image

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
