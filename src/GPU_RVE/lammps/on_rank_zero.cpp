// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/on_rank_zero.h"

#include <chrono>
#include <exception>
#include <thread>

// The other ranks poll and sleep, because a blocking collective call would keep their cores busy.
std::string LAMMPS_NS::on_rank_zero(MPI_Comm world, const std::function<void()> &work)
{
  int me, length = 0;
  MPI_Comm_rank(world, &me);
  std::string failure;
  if (me == 0) {
    try {
      work();
    } catch (const std::exception &e) {
      failure = e.what();
    }
    length = static_cast<int>(failure.size());
  }
  MPI_Request done;
  MPI_Ibcast(&length, 1, MPI_INT, 0, world, &done);
  for (int ready = 0; !ready;) {
    MPI_Test(&done, &ready, MPI_STATUS_IGNORE);
    if (!ready) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  failure.resize(length);
  MPI_Bcast(failure.data(), length, MPI_CHAR, 0, world);
  return failure;
}

void LAMMPS_NS::broadcast(MPI_Comm world, int root, std::string &text)
{
  int length = static_cast<int>(text.size());
  MPI_Bcast(&length, 1, MPI_INT, root, world);
  text.resize(length);
  MPI_Bcast(text.data(), length, MPI_CHAR, root, world);
}
