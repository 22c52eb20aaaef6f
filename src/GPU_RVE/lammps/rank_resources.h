// SPDX-License-Identifier: GPL-2.0-only
// This rank among those that share its machine, the threads that are its own, and memory that all have in common.

#pragma once

#include <cstddef>
#include <memory>
#include <mpi.h>

namespace LAMMPS_NS {

struct RankResources {
  int rank, ranks;    ///< on this machine
  int cores;          ///< that this rank may use, shared with no other rank
  /// Of this machine that may use one core only, where there are several for each rank; 0 with OMP_NUM_THREADS.
  int bound_ranks;

  /// Collective.
  explicit RankResources(MPI_Comm world);

  /// What OMP_NUM_THREADS says, or the own cores. (LAMMPS itself takes one thread where the environment says nothing.)
  int threads() const;
  /// For what is left to the host where a GPU advances RVEs: what OMP_NUM_THREADS says, or half of the own cores.
  int threads_beside_gpu() const;
};

/// Of all these ranks, so many bytes, zeros at first; null on all of them if they are on several machines, or there is no room. Collective, and they
/// free it together.
std::shared_ptr<void> memory_in_common(MPI_Comm ranks, std::size_t bytes);

}    // namespace LAMMPS_NS
