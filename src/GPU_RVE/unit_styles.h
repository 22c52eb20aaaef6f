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

// Which unit styles of LAMMPS suit styles of mechanics.

#pragma once

#include <string>

namespace LAMMPS_NS {

class LAMMPS;

/// Ends with error->all unless forces are masses times accelerations, without factors; `command` begins the message.
void require_mechanical_units(LAMMPS *lmp, const std::string &command);

}    // namespace LAMMPS_NS
