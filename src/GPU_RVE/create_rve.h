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

// Command create_rve parses its arguments, generates packings with the engine, and writes them to a
// file.

#ifdef COMMAND_CLASS
// clang-format off
CommandStyle(create_rve,CreateRve);
// clang-format on
#else

#ifndef LMP_CREATE_RVE_H
#define LMP_CREATE_RVE_H

#include "command.h"

namespace LAMMPS_NS {

class CreateRve : public Command {
 public:
  CreateRve(class LAMMPS *lmp) : Command(lmp) {}
  void command(int, char **) override;
};

}    // namespace LAMMPS_NS

#endif
#endif
