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

#include "collective_error.h"

#include "comm.h"

/* ----------------------------------------------------------------------
   error->all wants the same words on all ranks: those of the first one that has any
------------------------------------------------------------------------- */

void LAMMPS_NS::error_if_any(LAMMPS *lmp, std::string message)
{
  const int me = lmp->comm->me, nobody = lmp->comm->nprocs;
  int speaker, candidate = message.empty() ? nobody : me;
  MPI_Allreduce(&candidate, &speaker, 1, MPI_INT, MPI_MIN, lmp->world);
  if (speaker == nobody) return;
  int length = static_cast<int>(message.size());
  MPI_Bcast(&length, 1, MPI_INT, speaker, lmp->world);
  message.resize(length);
  MPI_Bcast(message.data(), length, MPI_CHAR, speaker, lmp->world);
  lmp->error->all(FLERR, message);
}
