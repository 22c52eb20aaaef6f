// SPDX-License-Identifier: GPL-2.0-only
// Cores and threads of a rank on its machine, and memory that all ranks of a machine share.

#pragma once

#include <cstddef>
#include <memory>
#include <mpi.h>

namespace LAMMPS_NS {

struct RankResources {
  int rank;     ///< number of this rank on its machine
  int ranks;    ///< number of ranks on this machine
  int cores;    ///< number of cores for this rank; ranks that may use the same cores share them
  /// Number of ranks of this machine that are bound to a single core. 0 if the machine has fewer
  /// than two cores for each rank, or if OMP_NUM_THREADS is set.
  int bound_ranks;

  /// Collective.
  explicit RankResources(MPI_Comm world);

  /// Returns the number of threads that OMP_NUM_THREADS gives, or else `cores`. (LAMMPS takes one
  /// thread if OMP_NUM_THREADS is not set.)
  int threads() const;
  /// Returns the number of threads for work of the host while a GPU advances RVEs: that of
  /// OMP_NUM_THREADS, or else half of `cores`.
  int threads_beside_gpu() const;
};

/// Returns memory of `bytes` zeros that all ranks of `ranks` share. Returns null on all ranks if
/// they are on several machines or if the memory cannot be allocated. Collective, as is its
/// release.
std::shared_ptr<void> memory_in_common(MPI_Comm ranks, std::size_t bytes);

}    // namespace LAMMPS_NS
