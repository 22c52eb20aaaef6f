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

// Dump rve/grain writes the grains of one RVE as atoms in the periodic cell of the RVE.

#ifdef DUMP_CLASS
// clang-format off
DumpStyle(rve/grain,DumpRveGrain);
// clang-format on
#else

#ifndef LMP_DUMP_RVE_GRAIN_H
#define LMP_DUMP_RVE_GRAIN_H

#include "dump_custom.h"

#include <memory>

namespace LAMMPS_NS {

class DumpRveGrain : public DumpCustom {
 public:
  DumpRveGrain(class LAMMPS *, int, char **);
  ~DumpRveGrain() override;

 protected:
  void init_style() override;
  int modify_param(int, char **) override;
  int count() override;
  void pack(tagint *) override;
  void write_header(bigint) override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl;

  DumpRveGrain(class LAMMPS *, std::unique_ptr<Impl>);
};

}    // namespace LAMMPS_NS

#endif
#endif
