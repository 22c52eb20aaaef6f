// SPDX-License-Identifier: GPL-2.0-only
/* -*- c++ -*- ----------------------------------------------------------
   LAMMPS - Large-scale Atomic/Molecular Massively Parallel Simulator
   https://www.lammps.org/, Sandia National Laboratories
   LAMMPS development team: developers@lammps.org

   Copyright (2003) Sandia Corporation.  Under the terms of Contract
   DE-AC04-94AL85000 with Sandia Corporation, the U.S. Government retains
   certain rights in this software.  This software is distributed under
   the GNU General Public License.

   See the README file in the top-level LAMMPS directory.
------------------------------------------------------------------------- */

// Work that one rank does while the others sleep, so that its result is the same on any number of ranks and costs its memory once.

#pragma once

#include <functional>
#include <mpi.h>
#include <string>

namespace LAMMPS_NS {

/// Rank 0 does `work`; all ranks return what its exception said, or "" if there was none.
std::string on_rank_zero(MPI_Comm world, const std::function<void()> &work);

}    // namespace LAMMPS_NS
