// SPDX-License-Identifier: GPL-2.0-only
#include "fix_rve_jobs.h"

#include "comm.h"
#include "error.h"

#include <cmath>
#include <functional>

using namespace LAMMPS_NS;

/// The check comes before the first RVE is made, because set-up takes time. Ranks of a node that
/// use the same device, or the memory of the host, are checked together.
template <int D> void RveMemory<D>::check(const std::vector<int> &grains)
{
  constexpr double MB = 1048576.0;
  const int mine = static_cast<int>(grains.size());
  rve::Memory memory;
  collectively(lmp, rves.settings.name(), [&] { memory = rves.points->memory(); });
  MPI_Comm node, sharers;
  MPI_Comm_split_type(world, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &node);
  const std::size_t color = std::hash<std::string>()(memory.name) % MAXSMALLINT;
  MPI_Comm_split(node, static_cast<int>(color), 0, &sharers);
  MPI_Comm_free(&node);
  int rank, ranks;
  MPI_Comm_rank(sharers, &rank);
  MPI_Comm_size(sharers, &ranks);

  int sharing = !memory.is_host && ranks > 1 ? 1 : 0;
  MPI_Allreduce(MPI_IN_PLACE, &sharing, 1, MPI_INT, MPI_SUM, world);
  if (sharing && !warned_sharing && comm->me == 0)
    error->warning(FLERR,
                   "fix rve {}: {} of {} MPI ranks share a CUDA device with another rank and wait "
                   "for each other; use as many ranks per node as there are devices",
                   rves.fix->id, sharing, comm->nprocs);
  warned_sharing = true;

  const auto sum = [sharers](auto value, MPI_Datatype type) {
    MPI_Allreduce(MPI_IN_PLACE, &value, 1, type, MPI_SUM, sharers);
    return value;
  };
  const bigint total = sum(bigint(mine), MPI_LMP_BIGINT);
  double free = memory.is_known ? static_cast<double>(memory.free) : HUGE_VAL;
  MPI_Allreduce(MPI_IN_PLACE, &free, 1, MPI_DOUBLE, MPI_MIN, sharers);
  // Returns the memory for about `number` of the RVEs [bytes]. Each rank that shares the memory
  // counts its first RVEs, in proportion to its number of RVEs.
  const auto bytes_for = [&](bigint number) {
    const int some = total ? static_cast<int>((number * mine + total - 1) / total) : 0;
    return sum(rves.points->bytes_for(grains, some, rves.settings.num_shadows), MPI_DOUBLE);
  };

  std::string message;
  const double needed = bytes_for(total);
  if (needed > free) {
    bigint fit = 0, too_many = total;
    while (too_many - fit > 1) {
      const bigint middle = (fit + too_many) / 2;
      (bytes_for(middle) <= free ? fit : too_many) = middle;
    }
    message = fmt::format(
        "fix rve {}: {} RVEs{} need {:.1f} MB of {}, where {:.1f} MB are free; {} RVEs would fit. "
        "Use smaller packings, another number format, or more nodes or devices",
        rves.fix->id, total, ranks > 1 ? fmt::format(" of {} MPI ranks", ranks) : "", needed / MB,
        memory.name, free / MB, fit);
  }
  MPI_Comm_free(&sharers);

  error_if_any(lmp, message);
}

template class LAMMPS_NS::RveMemory<2>;
template class LAMMPS_NS::RveMemory<3>;
