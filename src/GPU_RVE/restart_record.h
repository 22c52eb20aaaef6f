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

// What restart files hold of an atom for a fix.

#ifndef LMP_RESTART_RECORD_H
#define LMP_RESTART_RECORD_H

#include <string>

namespace LAMMPS_NS {

class LAMMPS;

struct RestartRecord {
  const double *values;    ///< the first one is their number
  int size;
};

/// The record of a local atom that unpack_restart(i, nth) of a fix is asked to read. LAMMPS keeps those of all fixes one behind the other, and
/// each says how long it is; an error, which begins with `whose`, if that cannot be, or if this one has less than `least` numbers.
RestartRecord restart_record(LAMMPS *lmp, const std::string &whose, int i, int nth, int least);

}    // namespace LAMMPS_NS

#endif
