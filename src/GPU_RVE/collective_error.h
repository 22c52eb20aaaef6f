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

// Errors that are the same on all ranks, whichever of them found something wrong.

#ifndef LMP_COLLECTIVE_ERROR_H
#define LMP_COLLECTIVE_ERROR_H

#include "error.h"
#include "lammps.h"
#include "lmptype.h"

#include <array>
#include <mpi.h>
#include <string>

namespace LAMMPS_NS {

/// What is wrong with atoms of any rank. The error names the atom with the lowest ID.
class CollectiveError {
 public:
  using Values = std::array<double, 3>;

  void add(tagint id, const Values &values)
  {
    count_++;
    if (count_ > 1 && id > lowest_) return;
    lowest_ = id;
    values_ = values;
  }

  /// Ends with error->all if something is wrong on any rank: message(number of atoms, lowest ID, its values) is the text. Collective.
  template <class Message> void raise_if_any(LAMMPS *lmp, const Message &message)
  {
    bigint count, mine = count_;
    MPI_Allreduce(&mine, &count, 1, MPI_LMP_BIGINT, MPI_SUM, lmp->world);
    if (!count) return;
    const tagint own = count_ ? lowest_ : MAXTAGINT;
    tagint lowest;
    MPI_Allreduce(&own, &lowest, 1, MPI_LMP_TAGINT, MPI_MIN, lmp->world);
    if (own != lowest) values_ = {0.0, 0.0, 0.0};
    Values values;
    MPI_Allreduce(values_.data(), values.data(), 3, MPI_DOUBLE, MPI_SUM, lmp->world);
    lmp->error->all(FLERR, message(count, lowest, values));
  }

 private:
  bigint count_ = 0;
  tagint lowest_ = 0;
  Values values_{0.0, 0.0, 0.0};
};

/// Ends with error->all if a rank has a message, with that of the first one; collective.
void error_if_any(LAMMPS *lmp, std::string message);

}    // namespace LAMMPS_NS

#endif
