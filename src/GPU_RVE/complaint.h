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

// Collects what is wrong with atoms of all ranks, so that an error is the same on all of them and names the atom with the lowest ID.

#ifndef LMP_COMPLAINT_H
#define LMP_COMPLAINT_H

#include "error.h"
#include "lammps.h"
#include "lmptype.h"

#include <array>
#include <mpi.h>

namespace LAMMPS_NS {

class Complaint {
 public:
  using Values = std::array<double, 3>;

  void about(tagint id, const Values &values)
  {
    count_++;
    if (count_ > 1 && id > lowest_) return;
    lowest_ = id;
    values_ = values;
  }

  /// Ends with error->all if there is a complaint on any rank: message(number of atoms, lowest ID, its values) is the text. Collective.
  template <class Message> void raise(LAMMPS *lmp, const Message &message)
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

}    // namespace LAMMPS_NS

#endif
