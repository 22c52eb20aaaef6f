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

// Work that one rank does while the others sleep, so that its result is the same on any number of ranks and costs its memory once; and
// what all ranks say when one of them has failed.

#ifndef LMP_ONE_RANK_H
#define LMP_ONE_RANK_H

#include <functional>
#include <mpi.h>
#include <string>

namespace LAMMPS_NS {

class LAMMPS;

/// Rank 0 does `work`; all ranks return what its exception said, or "" if there was none.
std::string on_rank_zero(MPI_Comm world, const std::function<void()> &work);

/// Ends with error->all if a rank has a message, with that of the first one; collective.
void error_if_any(LAMMPS *lmp, std::string message);

}    // namespace LAMMPS_NS

#endif
