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
  int cores;    ///< number of cores for this rank; ranks with common cores share these cores
  /// Number of ranks of this machine that are bound to a single core. It is 0 if the machine has
  /// fewer than two cores per rank, or if OMP_NUM_THREADS is set.
  int bound_ranks;

  /// Collective.
  explicit RankResources(MPI_Comm world);

  /// Returns the number of threads that OMP_NUM_THREADS gives, or else `cores`. (LAMMPS takes one
  /// thread if OMP_NUM_THREADS is not set.)
  int threads() const;
  /// Returns the number of threads for work on the host while a GPU advances RVEs: the number in
  /// OMP_NUM_THREADS, or else half of `cores`.
  int threads_beside_gpu() const;
};

/// Returns memory of `bytes` zeros that all ranks of `ranks` share. Returns null on all ranks if
/// they are on several machines or if the memory cannot be allocated. The allocation and the
/// release of the memory are collective.
std::shared_ptr<void> memory_in_common(MPI_Comm ranks, std::size_t bytes);

}    // namespace LAMMPS_NS
