// SPDX-License-Identifier: GPL-2.0-only
// Work of rank 0 alone. Its result does not depend on the number of ranks, and its memory is
// allocated once.

#pragma once

#include <functional>
#include <mpi.h>
#include <string>

namespace LAMMPS_NS {

/// Runs `work` on rank 0. All ranks return the text of the exception that it threw, or "" without
/// an exception. The other ranks sleep meanwhile. Collective.
std::string on_rank_zero(MPI_Comm world, const std::function<void()> &work);

/// Copies `text` of the rank `root` to all ranks. Collective.
void broadcast(MPI_Comm world, int root, std::string &text);

}    // namespace LAMMPS_NS
