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

// One RVE, a periodic packing of grains, behind each atom of a group. This style parses, tells the engine what to advance and by
// how much, and moves the RVEs with their atoms; it knows no formula of the physics.

#ifdef FIX_CLASS
// clang-format off
FixStyle(rve,FixRve);
// clang-format on
#else

#ifndef LMP_FIX_RVE_H
#define LMP_FIX_RVE_H

#include "fix.h"

#include <memory>
#include <string>

namespace mpm {
template <int D> class Constitutive;
}

namespace LAMMPS_NS {

class FixRve : public Fix {
 public:
  FixRve(class LAMMPS *, int, char **);
  ~FixRve() override;

  int setmask() override;
  void init() override;
  void setup(int) override;
  void final_integrate() override;
  void end_of_step() override;
  void post_run() override;

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
  int modify_param(int, char **) override;

  // For other styles.

  // the fix of this ID, or the only one if the ID is empty; `who` asks, in messages
  static FixRve *find(class LAMMPS *, const std::string &id, const std::string &who);
  // the RVEs of this rank, whatever their dimension is, and those of dimension D; fix_rve_impl.h defines the types
  struct Impl;
  template <int D> struct ImplOf;
  Impl &rves() const { return *impl; }
  template <int D> ImplOf<D> &rves_of() const { return static_cast<ImplOf<D> &>(*impl); }
  // whether variables of drive or servo, evaluated in each step, may read fixes or computes
  bool reads_results() const;
  // the RVEs as a material for fix mpm, in a continuum of D dimensions; owned by this fix; error unless `drive mpm`
  template <int D> mpm::Constitutive<D> *constitutive();

 private:
  std::unique_ptr<Impl> impl;

  // whether LAMMPS counts this fix among those that integrate
  void claim_integration();
};

}    // namespace LAMMPS_NS

#endif
#endif
