// SPDX-License-Identifier: GPL-2.0-only

#include "rve_packings.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "lammps.h"
#include "lammps/collective_error.h"
#include "lammps/on_rank_zero.h"
#include "rve/core/checksum.h"
#include "rve/core/error.h"
#include "rve/engine/contact_network.h"
#include "rve/engine/drift.h"
#include "rve/engine/packing_image.h"
#include "rve/engine/packing_io.h"
#include "rve/engine/stability.h"

#include <algorithm>
#include <cmath>
#include <numeric>

using namespace LAMMPS_NS;

namespace {

// streams of random draws of an atom, which are independent of each other
constexpr std::uint64_t DRAW_PACKING = 0, DRAW_IMAGE = 1;

// Limits of the stress change that an image (mirrored or rotated copy) of a packing causes, divided
// by the pressure [-]. A larger change causes a warning. The limit of normal stresses allows for
// the tolerance of the preparation of an isotropic packing. The limit of shear stresses depends on
// the number of grains: the shear stress is a sum over finitely many contacts and not exactly 0.
constexpr double NORMAL_CHANGE = 0.02;
template <int D> double shear_change(const rve::RveStateOf<D> &packing)
{
  return 6.0 / std::sqrt(packing.num_grains());
}

}    // namespace

/// Local atoms of a group that get RVEs.
template <int D> struct RvePackingsOf<D>::Atoms {
  LAMMPS *lmp;
  const std::string &fix;    // beginning of messages
  int igroup;
  const std::vector<int> &indices;

  tagint id(std::size_t k) const { return lmp->atom->tag[indices[k]]; }

  /// Returns a script value for each of the atoms; collective.
  std::vector<double> evaluate(ScriptValue &value) const
  {
    std::vector<double> of_all, values;
    value.find(lmp, fix);
    value.evaluate(lmp, igroup, of_all);
    for (const int i : indices) values.push_back(of_all[i]);
    return values;
  }

  /// Returns a script value for each of the atoms as a number from 0 to count-1. Ends with an error
  /// for other values; collective.
  std::vector<int> numbers(ScriptValue &value, const char *keyword, int count) const
  {
    std::vector<int> result;
    CollectiveError wrong;
    for (const double number : evaluate(value)) {
      const bool is_valid = number >= 0.0 && number < count && number == std::floor(number);
      if (!is_valid) wrong.add(id(result.size()), {number, 0.0, 0.0});
      result.push_back(is_valid ? static_cast<int>(number) : 0);
    }
    wrong.raise_if_any(lmp, [&](bigint all, tagint id, const CollectiveError::Values &at) {
      return fmt::format("{}: {} of atom {} is {}; it must be a whole number from 0 to {} (atoms "
                         "with an invalid value: {})",
                         fix, keyword, id, at[0], count - 1, all);
    });
    return result;
  }
};

template <int D> void RvePackingsOf<D>::read(LAMMPS *lmp, const FixRveSettings &settings)
{
  fix = settings.name();
  files = settings.packings;
  std::vector<std::vector<char>> packed_states;
  std::vector<std::string> drifts;
  rve::Checksum as_read;
  const std::string failure = on_rank_zero(lmp->world, [&]() {
    for (std::size_t n = 0; n < settings.packings.size(); ++n) {
      const std::string &file = settings.packings[n];
      try {
        rve::PackingLibraryOf<D> library = rve::read_library<D>(file);
        for (auto &state : library.packings) {
          const std::vector<char> record = rve::serialize(state);
          as_read.add(record.data(), record.size());
          change_material(state.material, settings.material, settings.mass_scaling.value_or(1.0),
                          1.0);
          state.check();
          rve::forget_absurd_force(state);
          const auto drift = rve::drift_of(state);
          rve::remove_drift(state, drift);
          if (const std::string text = rve::describe_drift(drift); !text.empty())
            drifts.push_back(fmt::format("{} of packing {} in {}", text, file_of.size(), file));
          file_of.push_back(static_cast<int>(n));
          stable.push_back(rve::stable_time_step(state));
          packed_states.push_back(rve::serialize(state));
        }
      } catch (const rve::InputError &e) {
        throw rve::InputError(packing_failure(file, e));
      }
    }
  });
  if (!failure.empty()) lmp->error->all(FLERR, "{}: {}", fix, failure);
  if (!drifts.empty())    // only rank 0 fills `drifts`
    lmp->error->warning(FLERR,
                        "{}: the {} was subtracted from all of its grains{}, because local damping "
                        "would act on it",
                        fix, drifts[0],
                        drifts.size() > 1
                            ? fmt::format(" (and that of {} other packings)", drifts.size() - 1)
                            : "");

  checksum = as_read.value();
  MPI_Bcast(&checksum, 1, MPI_UINT64_T, 0, lmp->world);
  const auto broadcast = [lmp](auto &list) {
    int bytes = static_cast<int>(list.size() * sizeof(list[0]));
    MPI_Bcast(&bytes, 1, MPI_INT, 0, lmp->world);
    list.resize(bytes / sizeof(list[0]));
    MPI_Bcast(list.data(), bytes, MPI_BYTE, 0, lmp->world);
  };
  broadcast(file_of);
  broadcast(stable);
  packed_states.resize(stable.size());
  for (auto &image : packed_states) broadcast(image);
  collectively(lmp, fix, [&] {
    for (const auto &image : packed_states) {
      packings.push_back(rve::deserialize<D>(image.data(), image.size()));
      void_ratios.push_back(packings.back().void_ratio());
    }
  });
  const auto &choice = settings.choice;
  make_pools(lmp, choice.stress.has_value());
  if (size() > 1 && choice.number.variable.empty() && !choice.is_by_property())
    lmp->error->all(FLERR,
                    "{}: {} packings are given; choose among them with packing_variable, "
                    "packing_random, packing_stress or packing_void_ratio",
                    fix, size());
}

/// Takes the stress levels from the present vertical stresses (last axis) of the packings, because
/// a file with one packing does not contain the stress of its preparation.
template <int D> void RvePackingsOf<D>::make_pools(LAMMPS *lmp, bool by_stress)
{
  const auto add_pool = [this](const std::vector<int> &members) {
    std::vector<double> of_members;
    for (const int k : members) of_members.push_back(void_ratios[k]);
    pools.push_back({members, rve::VoidRatioIndex(of_members)});
  };
  pools.clear();
  if (!by_stress) {
    std::vector<int> all(size());
    std::iota(all.begin(), all.end(), 0);
    add_pool(all);
    return;
  }
  std::vector<double> stresses;
  for (const State &packing : packings)
    stresses.push_back(-rve::spring_stress(packing)(D - 1, D - 1));
  collectively(lmp, fix + ": packing_stress cannot be used", [&] { levels.emplace(stresses); });
  for (int level = 0; level < levels->count(); ++level) add_pool(levels->packings(level));
}

template <int D>
void RvePackingsOf<D>::change(const MaterialArguments &words, double mass_scaling,
                              double mass_scaling_before)
{
  images.clear();
  for (int k = 0; k < size(); ++k) {
    State changed = packings[k];
    change_material(changed.material, words, mass_scaling, mass_scaling_before);
    changed.check();
    stable[k] = rve::stable_time_step(changed);
    packings[k] = std::move(changed);
  }
}

template <int D> int RvePackingsOf<D>::fewest_grains() const
{
  int fewest = MAXSMALLINT;
  for (const State &packing : packings) fewest = std::min(fewest, packing.num_grains());
  return fewest;
}

template <int D> int RvePackingsOf<D>::most_grains() const
{
  int most = 0;
  for (const State &packing : packings) most = std::max(most, packing.num_grains());
  return most;
}

template <int D> rve::ContactModel RvePackingsOf<D>::contacts() const
{
  return rve::contacts_of<D>(packings, [this](int packing) { return name(packing); });
}

template <int D> std::string RvePackingsOf<D>::name(int packing) const
{
  const std::string &file = files[file_of[packing]];
  return size() == 1 ? "packing " + file : fmt::format("packing {} ({})", packing, file);
}

template <int D>
std::vector<const rve::RveStateOf<D> *> RvePackingsOf<D>::choose(LAMMPS *lmp, int igroup,
                                                                 PackingChoice &choice,
                                                                 const std::vector<int> &atoms)
{
  const Atoms made{lmp, fix, igroup, atoms};
  const std::vector<int> chosen = choose_packings(made, choice);
  const std::vector<int> image = choose_images(made, choice);
  images.clear();
  std::vector<const State *> states;
  for (std::size_t k = 0; k < atoms.size(); ++k) {
    const State &packing = packings[chosen[k]];
    if (image[k] == 0) {
      states.push_back(&packing);
      continue;
    }
    const auto key = std::make_pair(chosen[k], image[k]);
    auto found = images.find(key);
    if (found == images.end()) found = images.emplace(key, rve::image_of(packing, image[k])).first;
    states.push_back(&found->second);
  }
  report(lmp, chosen);
  warn_of_images(lmp, chosen, image);
  return states;
}

template <int D>
std::vector<int> RvePackingsOf<D>::choose_pools(const Atoms &atoms, PackingChoice &choice) const
{
  std::vector<int> chosen(atoms.indices.size(), 0);
  if (!choice.stress) return chosen;
  const std::vector<double> stresses = atoms.evaluate(*choice.stress);
  CollectiveError wrong;
  double most[2] = {-HUGE_VAL, -HUGE_VAL};    // largest stress, and negative of the least one
  for (std::size_t k = 0; k < stresses.size(); ++k) {
    if (const auto level = levels->nearest(stresses[k]))
      chosen[k] = *level;
    else
      wrong.add(atoms.id(k), {stresses[k], 0.0, 0.0});
    most[0] = std::max(most[0], stresses[k]);
    most[1] = std::max(most[1], -stresses[k]);
  }
  wrong.raise_if_any(atoms.lmp, [&](bigint all, tagint id, const CollectiveError::Values &at) {
    return fmt::format("{}: packing_stress of atom {} is {} [stress]; it is positive in "
                       "compression and must be greater than 0 (atoms with an invalid value: {})",
                       fix, id, rve::number(at[0]), all);
  });
  MPI_Allreduce(MPI_IN_PLACE, most, 2, MPI_DOUBLE, MPI_MAX, atoms.lmp->world);
  if (atoms.lmp->comm->me == 0)
    utils::logmesg(atoms.lmp,
                   "{}: packing_stress is {:.5g} to {:.5g} [stress]; the packings have {} levels "
                   "of vertical stress from {:.5g} to {:.5g} [stress]\n",
                   fix, -most[1], most[0], levels->count(), levels->stress(0),
                   levels->stress(levels->count() - 1));
  return chosen;
}

template <int D>
std::vector<int> RvePackingsOf<D>::choose_packings(const Atoms &atoms, PackingChoice &choice) const
{
  if (!choice.is_by_property()) return atoms.numbers(choice.number, "packing_variable", size());

  const std::vector<int> pool_of = choose_pools(atoms, choice);
  std::vector<int> chosen(atoms.indices.size(), 0);
  CollectiveError wrong;
  if (!choice.void_ratio) {
    for (std::size_t k = 0; k < chosen.size(); ++k) {
      const std::vector<int> &members = pools[pool_of[k]].packings;
      const int count = static_cast<int>(members.size());
      if (choice.seed)
        chosen[k] = members[rve::draw(*choice.seed, atoms.id(k), count, DRAW_PACKING)];
      else if (count == 1)
        chosen[k] = members[0];
      else
        wrong.add(atoms.id(k), {levels->stress(pool_of[k]), 1.0 * count, 0.0});
    }
    wrong.raise_if_any(atoms.lmp, [&](bigint, tagint id, const CollectiveError::Values &at) {
      return fmt::format("{}: packing_stress selects {} packings of {} [stress] for atom {}; "
                         "choose among them with packing_random or packing_void_ratio",
                         fix, at[1], rve::number(at[0]), id);
    });
    return chosen;
  }

  const std::vector<double> wanted = atoms.evaluate(*choice.void_ratio);
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    const auto &[members, index] = pools[pool_of[k]];
    const auto found = choice.seed
        ? index.draw_within(wanted[k], choice.tolerance, *choice.seed, atoms.id(k))
        : index.nearest(wanted[k], choice.tolerance);
    if (found)
      chosen[k] = members[*found];
    else
      wrong.add(atoms.id(k), {wanted[k], index.least(), index.most()});
  }
  wrong.raise_if_any(atoms.lmp, [&](bigint all, tagint id, const CollectiveError::Values &at) {
    return fmt::format(
        "{}: packing_void_ratio of atom {} is {} [-], and no packing has a void ratio within {} of "
        "it; void ratios of the packings{} are from {} to {} (atoms without a packing: {})",
        fix, id, rve::number(at[0]), rve::number(choice.tolerance),
        choice.stress ? " with its packing_stress" : "", rve::number(at[1]), rve::number(at[2]),
        all);
  });
  return chosen;
}

template <int D>
std::vector<int> RvePackingsOf<D>::choose_images(const Atoms &atoms, PackingChoice &choice) const
{
  constexpr int COUNT = rve::NUM_IMAGES_OF<D>;
  if (!choice.image_seed) return atoms.numbers(choice.image, "packing_image", COUNT);
  std::vector<int> chosen;
  for (std::size_t k = 0; k < atoms.indices.size(); ++k)
    chosen.push_back(rve::draw(*choice.image_seed, atoms.id(k), COUNT, DRAW_IMAGE));
  return chosen;
}

template <int D> void RvePackingsOf<D>::report(LAMMPS *lmp, const std::vector<int> &chosen) const
{
  if (size() == 1) return;
  std::vector<int> used(size(), 0), used_anywhere(size());
  double sums[3] = {0.0, 0.0, 0.0}, all[3];
  for (const int k : chosen) {
    used[k] = 1;
    sums[0] += 1.0;
    sums[1] += void_ratios[k];
    sums[2] += void_ratios[k] * void_ratios[k];
  }
  MPI_Allreduce(used.data(), used_anywhere.data(), size(), MPI_INT, MPI_MAX, lmp->world);
  MPI_Allreduce(sums, all, 3, MPI_DOUBLE, MPI_SUM, lmp->world);
  if (lmp->comm->me > 0) return;
  const double mean = all[1] / all[0];
  utils::logmesg(lmp,
                 "{}: {} of {} packings are used; void ratios of the RVEs: mean {:.5f}, standard "
                 "deviation {:.5f}; void ratios of all packings: from {:.5f} to {:.5f}\n",
                 fix, std::count(used_anywhere.begin(), used_anywhere.end(), 1), size(), mean,
                 std::sqrt(std::fmax(all[2] / all[0] - mean * mean, 0.0)),
                 *std::min_element(void_ratios.begin(), void_ratios.end()),
                 *std::max_element(void_ratios.begin(), void_ratios.end()));
}

/// Warns if images change the stress: a mirrored or rotated packing is a sample of the same ground
/// only if the stress of the ground is isotropic.
template <int D>
void RvePackingsOf<D>::warn_of_images(LAMMPS *lmp, const std::vector<int> &chosen,
                                      const std::vector<int> &image) const
{
  using Stress = rve::Tensor<double, D>;
  // used[packing] has a bit for each image
  std::vector<std::uint64_t> used(size(), 0);
  for (std::size_t k = 0; k < chosen.size(); ++k) used[chosen[k]] |= std::uint64_t{1} << image[k];
  MPI_Allreduce(MPI_IN_PLACE, used.data(), size(), MPI_UINT64_T, MPI_BOR, lmp->world);
  if (lmp->comm->me > 0) return;

  int changed = 0, worst = 0, worst_image = 0;
  double largest = 0.0;
  Stress stress_of_worst;
  for (int n = 0; n < size(); ++n) {
    if ((used[n] & ~std::uint64_t{1}) == 0) continue;
    const Stress stress = rve::spring_stress(packings[n]);
    const double pressure = -rve::trace(stress) / D;
    if (!(pressure > 0.0)) continue;
    double largest_of_packing = 0.0;
    for (int k = 1; k < rve::NUM_IMAGES_OF<D>; ++k) {
      if (!(used[n] >> k & 1)) continue;
      const Stress seen = rve::image_of(stress, k);
      double normal = 0.0, shear = 0.0;
      for (int a = 0; a < D; ++a)
        for (int b = a; b < D; ++b) {
          double &change = a == b ? normal : shear;
          change = std::fmax(change, std::fabs(seen(a, b) - stress(a, b)) / pressure);
        }
      const double excess = std::fmax(normal / NORMAL_CHANGE, shear / shear_change(packings[n]));
      largest_of_packing = std::fmax(largest_of_packing, excess);
      if (excess > largest) {
        largest = excess;
        worst = n;
        worst_image = k;
        stress_of_worst = stress;
      }
    }
    if (largest_of_packing > 1.0) ++changed;
  }
  if (largest <= 1.0) return;
  const auto text = [](const Stress &stress) {
    std::string words;
    for (int apart = 0; apart < D; ++apart)    // normal stresses come first
      for (int a = 0; a + apart < D; ++a)
        words += (words.empty() ? "" : ", ") +
            rve::number(apart == 0 ? stress(a, a)
                                   : 0.5 * (stress(a, a + apart) + stress(a + apart, a)));
    return words;
  };
  lmp->error->warning(FLERR,
                      "{}: packing_image changes the stress of the ground: {} has {} = {} "
                      "[stress], its image {} has {}; this applies to {} of {} packings. {}; use "
                      "random images for packings with isotropic stress only",
                      fix, name(worst), D == 2 ? "sxx, syy, sxy" : "sxx, syy, szz, sxy, syz, sxz",
                      text(stress_of_worst), worst_image,
                      text(rve::image_of(stress_of_worst, worst_image)), changed, size(),
                      D == 2 ? "Images 0 and 2 keep the stress, 4 and 6 sxx and syy"
                             : "Images 0 to 15 keep szz");
}

template class LAMMPS_NS::RvePackingsOf<2>;
template class LAMMPS_NS::RvePackingsOf<3>;
