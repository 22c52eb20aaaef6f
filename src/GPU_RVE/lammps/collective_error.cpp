// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/collective_error.h"

#include "lammps/on_rank_zero.h"

#include "comm.h"

#include <new>

std::string LAMMPS_NS::first_message(LAMMPS *lmp, std::string message)
{
  const int me = lmp->comm->me, none = lmp->comm->nprocs;
  int lowest, candidate = message.empty() ? none : me;
  MPI_Allreduce(&candidate, &lowest, 1, MPI_INT, MPI_MIN, lmp->world);
  if (lowest == none) return "";
  broadcast(lmp->world, lowest, message);
  return message;
}

// error->all needs the same text on all ranks.
void LAMMPS_NS::error_if_any(LAMMPS *lmp, std::string message)
{
  const std::string first = first_message(lmp, std::move(message));
  if (!first.empty()) lmp->error->all(FLERR, first);
}

std::string LAMMPS_NS::problem_of(const std::exception &exception)
{
  if (dynamic_cast<const std::bad_alloc *>(&exception)) return "this rank is out of memory";
  const std::string text = exception.what();
  return text.empty() ? "an exception without a message" : text;
}
