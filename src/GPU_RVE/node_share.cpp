/* ----------------------------------------------------------------------
   LAMMPS - Large-scale Atomic/Molecular Massively Parallel Simulator
   https://www.lammps.org/, Sandia National Laboratories
   LAMMPS development team: developers@lammps.org

   Copyright (2003) Sandia Corporation.  Under the terms of Contract
   DE-AC04-94AL85000 with Sandia Corporation, the U.S. Government retains
   certain rights in this software.  This software is distributed under
   the GNU General Public License.

   See the README file in the top-level LAMMPS directory.
------------------------------------------------------------------------- */

#include "node_share.h"

#include <algorithm>
#include <cstdlib>
#include <omp.h>
#include <thread>

using namespace LAMMPS_NS;

NodeShare::NodeShare(MPI_Comm world)
{
  MPI_Comm node;
  MPI_Comm_split_type(world, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &node);
  MPI_Comm_rank(node, &rank);
  MPI_Comm_size(node, &ranks);
  MPI_Comm_free(&node);
}

int NodeShare::threads() const
{
  if (getenv("OMP_NUM_THREADS")) return omp_get_max_threads();
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()) / ranks);
}
