// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/rank_resources.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <omp.h>
#include <sched.h>
#include <unistd.h>
#include <vector>

using namespace LAMMPS_NS;

static bool threads_are_given()
{
  return getenv("OMP_NUM_THREADS") != nullptr;
}

RankResources::RankResources(MPI_Comm world)
{
  MPI_Comm node;
  MPI_Comm_split_type(world, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &node);
  MPI_Comm_rank(node, &rank);
  MPI_Comm_size(node, &ranks);

  // If mpirun has bound this rank to cores, only the ranks that are bound to some of these cores
  // share them.
  cpu_set_t mine;
  CPU_ZERO(&mine);
  const long machine = sysconf(_SC_NPROCESSORS_ONLN);
  if (sched_getaffinity(0, sizeof(mine), &mine) != 0 || CPU_COUNT(&mine) == 0)
    for (long k = 0; k < machine; ++k) CPU_SET(k, &mine);
  std::vector<cpu_set_t> all(ranks);
  MPI_Allgather(&mine, sizeof(mine), MPI_BYTE, all.data(), sizeof(mine), MPI_BYTE, node);
  MPI_Comm_free(&node);
  const auto sharers = std::count_if(all.begin(), all.end(), [&](const cpu_set_t &other) {
    cpu_set_t both;
    CPU_AND(&both, &mine, &other);
    return CPU_COUNT(&both) > 0;
  });
  cores = std::max(1, CPU_COUNT(&mine) / static_cast<int>(sharers));

  bound_ranks = 0;
  if (machine >= 2 * ranks && !threads_are_given())
    bound_ranks = static_cast<int>(std::count_if(
        all.begin(), all.end(), [](const cpu_set_t &other) { return CPU_COUNT(&other) == 1; }));
}

int RankResources::threads() const
{
  return threads_are_given() ? omp_get_max_threads() : cores;
}

int RankResources::threads_beside_gpu() const
{
  return threads_are_given() ? threads() : std::max(1, cores / 2);
}

std::shared_ptr<void> LAMMPS_NS::memory_in_common(MPI_Comm ranks, std::size_t bytes)
{
  MPI_Comm neighbours;
  MPI_Comm_split_type(ranks, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &neighbours);
  int all = 0, here = 0, me = 0;
  MPI_Comm_size(ranks, &all);
  MPI_Comm_size(neighbours, &here);
  MPI_Comm_rank(neighbours, &me);
  if (here < all) {
    MPI_Comm_free(&neighbours);
    return {};
  }
  // the allocation is allowed to fail, because a container can have little shared memory
  MPI_Comm_set_errhandler(neighbours, MPI_ERRORS_RETURN);
  MPI_Win window;
  void *memory = nullptr;
  int failed = MPI_Win_allocate_shared(me == 0 ? (MPI_Aint) bytes : 0, 1, MPI_INFO_NULL, neighbours,
                                       &memory, &window) != MPI_SUCCESS;
  MPI_Allreduce(MPI_IN_PLACE, &failed, 1, MPI_INT, MPI_MAX, ranks);
  MPI_Comm_set_errhandler(neighbours, MPI_ERRORS_ARE_FATAL);
  if (failed) {
    MPI_Comm_free(&neighbours);
    return {};
  }
  MPI_Aint size = 0;
  int unit = 0;
  MPI_Win_shared_query(window, 0, &size, &unit, &memory);
  if (me == 0) memset(memory, 0, bytes);
  MPI_Barrier(neighbours);
  return std::shared_ptr<void>(memory, [window, neighbours](void *) mutable {
    MPI_Win_free(&window);
    MPI_Comm_free(&neighbours);
  });
}
