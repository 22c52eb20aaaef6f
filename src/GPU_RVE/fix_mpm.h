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

// The material point method as a time integrator: the atoms of a group are material points. This style parses, keeps the
// state of the points in per-atom arrays and calls the solver in mpm/; it knows no formula of the method. Its dimension is that of
// LAMMPS: fix_mpm_impl.h.

#ifdef FIX_CLASS
// clang-format off
FixStyle(mpm,FixMpm);
// clang-format on
#else

#ifndef LMP_FIX_MPM_H
#define LMP_FIX_MPM_H

#include "fix.h"

#include <memory>

namespace LAMMPS_NS {

class FixMpm : public Fix {
 public:
  FixMpm(class LAMMPS *, int, char **);
  ~FixMpm() override;

  int setmask() override;
  void init() override;
  void setup_pre_force(int) override;
  void pre_force(int) override;
  void setup(int) override;
  void final_integrate() override;
  void post_run() override;

  int modify_param(int, char **) override;
  double compute_scalar() override;
  double compute_vector(int) override;
  double memory_usage() override;

  void grow_arrays(int) override;
  void copy_arrays(int, int, int) override;
  void set_arrays(int) override;
  int pack_exchange(int, double *) override;
  int unpack_exchange(int, double *) override;
  int pack_restart(int, double *) override;
  void unpack_restart(int, int) override;
  int size_restart(int) override;
  int maxsize_restart() override;
  void write_restart(FILE *) override;
  void restart(char *) override;

  // whether variables or regions that are evaluated in each step may read fixes or computes
  bool reads_results() const;

 private:
  struct Impl;
  template <int D> struct ImplOf;
  std::unique_ptr<Impl> impl;
};

}    // namespace LAMMPS_NS

#endif
#endif
