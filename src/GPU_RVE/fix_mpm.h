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

// Fix mpm integrates the atoms of a group as material points by the material point method. The
// style parses the script, keeps the state of the points in per-atom arrays and calls the solver in
// mpm/. It contains no formulas of the material point method. ImplOf<D> (fix_mpm_impl.h) implements
// the fix; D is the dimension of the LAMMPS domain.

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
  void setup_pre_force(int) override { impl->setup_pre_force(); }
  void pre_force(int) override { impl->pre_force(); }
  void setup(int) override { impl->setup(); }
  void final_integrate() override { impl->final_integrate(); }
  void post_run() override { impl->post_run(); }

  int modify_param(int narg, char **arg) override
  {
    impl->modify_models(narg, arg);
    return narg;
  }
  double compute_scalar() override { return impl->scalar(); }
  double compute_vector(int n) override { return impl->vector_component(n); }
  double memory_usage() override { return impl->bytes(); }

  void grow_arrays(int nmax) override { impl->grow_arrays(nmax); }
  void copy_arrays(int i, int j, int) override { impl->copy_arrays(i, j); }
  void set_arrays(int i) override { impl->set_arrays(i); }
  int pack_exchange(int i, double *buf) override { return impl->pack_exchange(i, buf); }
  int unpack_exchange(int i, double *buf) override { return impl->unpack_exchange(i, buf); }
  int pack_restart(int i, double *buf) override { return impl->pack_restart(i, buf); }
  void unpack_restart(int i, int nth) override { impl->unpack_restart(i, nth); }
  int size_restart(int i) override { return impl->size_restart(i); }
  int maxsize_restart() override { return impl->maxsize_restart(); }
  void write_restart(FILE *fp) override { impl->write_restart(fp); }
  void restart(char *buf) override { impl->restart(buf); }

  /// Returns true if the variables or regions that the fix evaluates in each step can depend on
  /// results of fixes or computes.
  bool reads_results() const { return impl->reads_results(); }

 private:
  /// Interface of the LAMMPS hooks. ImplOf<D> implements it for D dimensions.
  struct Impl : protected Pointers {
    using Pointers::Pointers;
    virtual void find_models() = 0;
    virtual void setup_pre_force() = 0;
    virtual void pre_force() = 0;
    virtual void setup() = 0;
    virtual void final_integrate() = 0;
    virtual void post_run() = 0;
    virtual void modify_models(int narg, char **arg) = 0;
    virtual double scalar() const = 0;
    virtual double vector_component(int n) = 0;
    virtual bool reads_results() const = 0;
    virtual double bytes() const = 0;
    virtual void grow_arrays(int nmax) = 0;
    virtual void copy_arrays(int i, int j) = 0;
    virtual void set_arrays(int i) = 0;
    virtual int pack_exchange(int i, double *buf) = 0;
    virtual int unpack_exchange(int i, const double *buf) = 0;
    virtual int pack_restart(int i, double *buf) = 0;
    virtual void unpack_restart(int i, int nth) = 0;
    virtual int size_restart(int i) const = 0;
    virtual int maxsize_restart() const = 0;
    virtual void write_restart(FILE *fp) const = 0;
    virtual void restart(const char *buf) = 0;
  };
  template <int D> struct ImplOf;
  std::unique_ptr<Impl> impl;
};

}    // namespace LAMMPS_NS

#endif
#endif
