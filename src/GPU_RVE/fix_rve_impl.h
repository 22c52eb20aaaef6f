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

// Behind fix rve: the RVEs of this rank and the time that passes for them. LAMMPS' hooks are in fix_rve.cpp.

#ifndef LMP_FIX_RVE_IMPL_H
#define LMP_FIX_RVE_IMPL_H

#include "fix_rve.h"

#include "progress.h"
#include "rve_constitutive.h"
#include "rve_packings.h"
#include "rve_points.h"
#include "rve_settings.h"

#include <memory>
#include <string>
#include <vector>

namespace LAMMPS_NS {

struct FixRve::Impl : RveOwner {
  // values that an atom without an RVE has in the buffers of LAMMPS: their number, and the step
  static constexpr int PER_ATOM = 2;

  FixRve *fix;
  FixRveSettings settings;
  RvePackings packings;
  double dt;    // DEM time step, or its upper limit where substeps are matched
  std::unique_ptr<RvePoints> points;
  RveConstitutive constitutive;
  std::vector<int> slot;            // per atom: RVE in the engine, or -1
  std::vector<int> slots;           // of the RVEs that advance, kept between calls
  bool look_is_expected = false;    // somebody said that the results of this step shall be complete
  double restart_step = 0.0;        // of the head of a restart file
  bool warned_dt = false, warned_sharing = false;
  bool advised[rve::NUM_ADVICE_KINDS] = {};
  Progress progress;
  double wall_time = 0.0;
  bigint num_advances = 0;

  Impl(FixRve *_fix, FixRveSettings _settings) :
      fix(_fix), settings(std::move(_settings)), dt(settings.dt), constitutive(*this),
      progress(fix->lmp, fmt::format("fix rve {}", fix->id), settings.progress_interval)
  {
  }

  /// Reads the packings and chooses or checks the DEM time step; collective.
  void read_packings();
  /// One engine per rank, on the device of its local rank; collective.
  void make_engine();
  /// Ends with error->all if a rank has a message, with that of the first one; collective.
  void error_if_any(std::string message) const;
  /// Ends with error->all if so many further RVEs, of these numbers of grains, do not fit into the memory that is free; collective.
  void check_memory(const std::vector<int> &grains);
  /// Gives an RVE to every atom of the group that has none; collective.
  void attach();

  std::vector<int> atoms_with_rve() const;
  /// DEM steps of the RVEs of this rank since their packings were read.
  double dem_steps() const;
  /// What the script asks for in this LAMMPS step.
  std::vector<rve::Drive> drives(const std::vector<int> &atoms);
  void advance(const std::vector<int> &atoms, const std::vector<rve::Drive> &drives) override;
  /// Fills the number of shadows up, with atoms that depend on their IDs only; collective.
  void choose_shadows();
  /// Says once of each kind what goes beyond a limit, of the RVE that is farthest beyond; collective.
  void advise(bool at_start);
  /// Deviation from shadows: mean, largest, and the ID of its atom (0: no shadow); collective.
  struct ShadowReport {
    double mean, largest;
    tagint atom;
  };
  ShadowReport shadow_report() const;

  /// The network stiffens with its contacts: warns, fails, or lowers an automatic step; collective.
  void recheck_time_step();

  Clock clock(double lammps_dt) const override;
  const rve::Tensor2 &stress(int atom) const override { return points->stress(slot[atom]); }
  const RvePoints::Point &point(int atom) const override { return points->point(slot[atom]); }
  void complete() override { points->complete(); }
  int threads() const override { return settings.options.threads; }

  /// Of the dump of an atom in a step.
  std::string dump_file(tagint id, bigint step) const
  {
    return fmt::format("{}.{}.{}.data", settings.dump_prefix, id, step);
  }

  /// Room for the largest RVE in LAMMPS' buffers.
  void set_exchange_size();

 private:
  void check_time_step(double used, double bound, const std::string &whose);
  void check(const rve::Tensor2 &tensor, const char *what, const char *unit, int atom) const;
  void report(const std::vector<int> &failed, const std::vector<int> &atoms) const;
  bool wants_details() const;
};

}    // namespace LAMMPS_NS

#endif
