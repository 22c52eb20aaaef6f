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

// Command random_field parses its arguments, samples a stationary random field with the code in
// field/, and stores its values in a custom per-atom property.

#ifdef COMMAND_CLASS
// clang-format off
CommandStyle(random_field,RandomField);
// clang-format on
#else

#ifndef LMP_RANDOM_FIELD_H
#define LMP_RANDOM_FIELD_H

#include "command.h"

namespace LAMMPS_NS {

class RandomField : public Command {
 public:
  RandomField(class LAMMPS *lmp) : Command(lmp) {}
  void command(int, char **) override;
};

}    // namespace LAMMPS_NS

#endif
#endif
