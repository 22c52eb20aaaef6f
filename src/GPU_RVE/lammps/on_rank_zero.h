// SPDX-License-Identifier: GPL-2.0-only
// Work that one rank does while the others sleep, so that its result is the same on any number of ranks and costs its memory once.

#pragma once

#include <functional>
#include <mpi.h>
#include <string>

namespace LAMMPS_NS {

/// Rank 0 does `work`; all ranks return what its exception said, or "" if there was none.
std::string on_rank_zero(MPI_Comm world, const std::function<void()> &work);

/// Gives all ranks the text of the rank `root`. Collective.
void broadcast(MPI_Comm world, int root, std::string &text);

}    // namespace LAMMPS_NS
