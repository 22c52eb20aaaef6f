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

// Who may read the state that a fix keeps up to date for others only. LAMMPS reads arrays of fixes without asking first.

#pragma once

namespace LAMMPS_NS {

class LAMMPS;

/// Whether anything may read the state of points or RVEs after this step and before the next one: an output that is due, the end
/// of the run, or a fix that works then or reads variables in each step. A fix that works at the ends of some steps reads in those only.
bool state_may_be_read(LAMMPS *lmp);

}    // namespace LAMMPS_NS
