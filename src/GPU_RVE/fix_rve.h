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

// Fix rve gives each atom of a group an RVE, a periodic packing of grains. The style parses the
// script, advances the RVEs by the engine and moves them between ranks with their atoms. It
// contains no formula of the physics.

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

  // functions for other styles

  /// Returns the fix with this ID, or the only fix rve if the ID is empty. Error messages begin
  /// with `who`. Errors end in error->all.
  static FixRve *find(class LAMMPS *, const std::string &id, const std::string &who);
  struct Impl;
  template <int D> struct ImplOf;
  /// Returns the RVEs of this rank through an interface that does not depend on their dimension;
  /// see fix_rve_attached.h.
  Impl &rves() const { return *impl; }
  /// Returns the RVEs of this rank, which must be of dimension D; see fix_rve_impl.h.
  template <int D> ImplOf<D> &rves_of() const { return static_cast<ImplOf<D> &>(*impl); }
  /// Returns true if variables that the fix evaluates in each step can depend on results of fixes
  /// or computes.
  bool reads_results() const;
  /// Returns the RVEs as a material of fix mpm in a continuum of D dimensions. This fix rve owns
  /// the material. Ends with an error unless the script says `drive mpm`.
  template <int D> mpm::Constitutive<D> *constitutive();

 private:
  std::unique_ptr<Impl> impl;

  void claim_integration();
};

}    // namespace LAMMPS_NS

#endif
#endif
