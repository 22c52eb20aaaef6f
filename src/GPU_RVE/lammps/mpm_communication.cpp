// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/mpm_communication.h"

#include "lammps/collective_error.h"
#include "lammps/rank_resources.h"

#include "comm.h"
#include "lammps.h"
#include "universe.h"

#include <mpi.h>
#include <string>
#include <vector>

using namespace LAMMPS_NS;

static void exchange(MPI_Comm ranks, const std::vector<mpm::Message> &messages)
{
  std::vector<MPI_Request> requests;
  requests.reserve(2 * messages.size());
  const auto next = [&requests] { return &requests.emplace_back(MPI_REQUEST_NULL); };
  for (const mpm::Message &message : messages)
    if (message.received_count > 0)
      MPI_Irecv(message.received, (int) message.received_count, MPI_INT64_T, message.rank, 0, ranks,
                next());
  for (const mpm::Message &message : messages)
    if (message.sent_count > 0)
      MPI_Isend(message.sent, (int) message.sent_count, MPI_INT64_T, message.rank, 0, ranks,
                next());
  MPI_Waitall((int) requests.size(), requests.data(), MPI_STATUSES_IGNORE);
}

mpm::Communication LAMMPS_NS::mpm_communication(LAMMPS *lmp, const std::string &who)
{
  const MPI_Comm ranks = lmp->world;
  mpm::Communication communication;
  communication.ranks = lmp->comm->nprocs;
  communication.rank = lmp->comm->me;
  communication.sum_over_ranks = [ranks](std::int64_t *data, std::size_t count) {
    MPI_Allreduce(MPI_IN_PLACE, data, (int) count, MPI_INT64_T, MPI_SUM, ranks);
  };
  communication.max_over_ranks = [ranks](double *data, std::size_t count) {
    MPI_Allreduce(MPI_IN_PLACE, data, (int) count, MPI_DOUBLE, MPI_MAX, ranks);
  };
  communication.exchange = [ranks](const std::vector<mpm::Message> &messages) {
    exchange(ranks, messages);
  };
  communication.raise_on_all = [lmp, who](const std::string &problem) {
    error_if_any(lmp, problem.empty() ? "" : who + ": " + problem);
  };
  // There is no shared memory with several partitions: ranks of different partitions can share a
  // device, and kernels of ranks on one device cannot wait for each other.
  if (lmp->universe->nworlds == 1)
    communication.shared_memory = [ranks](std::size_t bytes) {
      return memory_in_common(ranks, bytes);
    };
  return communication;
}
