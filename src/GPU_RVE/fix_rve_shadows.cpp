// SPDX-License-Identifier: GPL-2.0-only

#include "fix_rve_jobs.h"

#include "atom.h"
#include "comm.h"
#include "rve/core/exact_sum.h"
#include "rve/core/splitmix64.h"

#include <algorithm>
#include <cstdint>

using namespace LAMMPS_NS;

/// Returns the `number` lowest values of all ranks, in ascending order; collective. For hashes of
/// atom IDs this is a random choice that does not depend on the number of ranks.
static std::vector<std::uint64_t> lowest_of_all(std::vector<std::uint64_t> mine, int number,
                                                MPI_Comm world)
{
  const auto shorten = [number](std::vector<std::uint64_t> &list) {
    std::sort(list.begin(), list.end());
    list.resize(std::min(list.size(), static_cast<std::size_t>(number)));
  };
  shorten(mine);
  int ranks;
  MPI_Comm_size(world, &ranks);
  const int count = static_cast<int>(mine.size());
  std::vector<int> counts(ranks), begins(ranks, 0);
  MPI_Allgather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, world);
  for (int rank = 1; rank < ranks; ++rank) begins[rank] = begins[rank - 1] + counts[rank - 1];
  std::vector<std::uint64_t> all(begins.back() + counts.back());
  MPI_Allgatherv(mine.data(), count, MPI_UINT64_T, all.data(), counts.data(), begins.data(),
                 MPI_UINT64_T, world);
  shorten(all);
  return all;
}

template <int D> void RveShadows<D>::remove(int number)
{
  std::vector<std::uint64_t> mine;
  const auto hash = [this](int i) { return rve::splitmix64(atom->tag[i]); };
  for (const int i : rves.atoms_with_rve())
    if (rves.point(i).shadow >= 0) mine.push_back(hash(i));
  const std::vector<std::uint64_t> kept = lowest_of_all(mine, number, world);
  for (const int i : rves.atoms_with_rve())
    if (rves.point(i).shadow >= 0 && !std::binary_search(kept.begin(), kept.end(), hash(i)))
      rves.points->remove_shadow(rves.slot[i]);
}

template <int D> void RveShadows<D>::choose()
{
  if (rves.settings.num_shadows == 0) return;
  std::vector<std::uint64_t> mine;
  int shadows[2] = {0, 0}, all_shadows[2];
  for (const int i : rves.atoms_with_rve()) {
    ++shadows[1];
    if (rves.point(i).shadow >= 0)
      ++shadows[0];
    else if (!rves.point(i).frozen())
      mine.push_back(rve::splitmix64(atom->tag[i]));
  }
  MPI_Allreduce(shadows, all_shadows, 2, MPI_INT, MPI_SUM, world);
  const int wanted = rves.settings.num_shadows - all_shadows[0];
  if (wanted == 0) return;
  if (wanted < 0) remove(rves.settings.num_shadows);    // the restart file has more shadows

  const std::vector<std::uint64_t> candidates = lowest_of_all(mine, std::max(wanted, 0), world);
  for (const int i : rves.atoms_with_rve())
    if (rves.point(i).shadow < 0 &&
        std::binary_search(candidates.begin(), candidates.end(), rve::splitmix64(atom->tag[i])))
      rves.guarded([&] { rves.points->add_shadow(rves.slot[i]); }, i);

  const int total =
      std::min(all_shadows[0], rves.settings.num_shadows) + static_cast<int>(candidates.size());
  if (comm->me == 0)
    utils::logmesg(
        lmp,
        "fix rve {}: {} of {} RVEs have shadows in format double with {} DEM steps for each DEM "
        "step of the RVE; on average an RVE has {:.3g} DEM steps of shadows for each of its own\n",
        rves.fix->id, total, all_shadows[1], rves.settings.macro_step.shadow_refinement,
        static_cast<double>(total) * rves.settings.macro_step.shadow_refinement /
            std::max(all_shadows[1], 1));
}

template <int D> typename RveShadows<D>::Report RveShadows<D>::report() const
{
  double most = -1.0, most_of_all;
  std::int64_t sums[2] = {0, 0}, all_sums[2];    // number of shadows, sum of deviations
  for (const int i : rves.atoms_with_rve()) {
    if (rves.point(i).shadow < 0) continue;
    ++sums[0];
    most = std::max(most, rves.point(i).shadow_deviation());
  }
  MPI_Allreduce(&most, &most_of_all, 1, MPI_DOUBLE, MPI_MAX, world);
  MPI_Allreduce(sums, all_sums, 1, MPI_INT64_T, MPI_SUM, world);
  if (all_sums[0] == 0) return {0.0, 0.0, 0};
  // an integer sum does not depend on the order of its terms, and so not on the number of ranks
  const rve::FixedScale scale(std::max(most_of_all, 1e-300), all_sums[0]);
  for (const int i : rves.atoms_with_rve())
    if (rves.point(i).shadow >= 0) sums[1] += scale.integer(rves.point(i).shadow_deviation());
  MPI_Allreduce(&sums[1], &all_sums[1], 1, MPI_INT64_T, MPI_SUM, world);
  tagint id = MAXTAGINT, lowest;
  for (const int i : rves.atoms_with_rve())
    if (rves.point(i).shadow >= 0 && rves.point(i).shadow_deviation() == most_of_all)
      id = std::min(id, atom->tag[i]);
  MPI_Allreduce(&id, &lowest, 1, MPI_LMP_TAGINT, MPI_MIN, world);
  return {scale.real(all_sums[1]) / static_cast<double>(all_sums[0]), most_of_all, lowest};
}

template <int D> void RveShadows<D>::log_report() const
{
  if (rves.settings.num_shadows == 0) return;
  double times[2] = {rves.points->shadow_time(), rves.points->total_time()};
  MPI_Allreduce(MPI_IN_PLACE, times, 2, MPI_DOUBLE, MPI_SUM, world);
  const auto [mean, largest, id] = report();
  if (comm->me == 0)
    utils::logmesg(
        lmp,
        "fix rve {}: shadows took {:.1f} % of the wall time of RVEs; the stress of RVEs deviates "
        "from that of their shadows by {:.3g} on average and {:.3g} at most (atom {})\n",
        rves.fix->id, times[1] > 0.0 ? 100.0 * times[0] / times[1] : 0.0, mean, largest, id);
}

template class LAMMPS_NS::RveShadows<2>;
template class LAMMPS_NS::RveShadows<3>;
