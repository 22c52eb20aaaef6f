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

#include "exceptions.h"
#include "macro/rve_constitutive.h"
#include "macro/rve_points.h"
#include "progress.h"
#include "rve_packings.h"
#include "rve_settings.h"

#include <cstdio>
#include <exception>
#include <memory>
#include <string>
#include <vector>

namespace LAMMPS_NS {

struct FixRve::Impl : macro::RveOwner<2> {
  // values that an atom without an RVE has in the buffers of LAMMPS: their number, and the step
  static constexpr int PER_ATOM = 2;

  FixRve *fix;
  FixRveSettings settings;
  RvePackings packings;
  double dt;    // DEM time step, or its upper limit where substeps are matched
  std::unique_ptr<macro::RvePoints> points;
  macro::RveConstitutive<2> constitutive;
  std::vector<int> slot;            // per atom: RVE in the engine, or -1
  std::vector<int> slots;           // of the RVEs that advance, kept between calls
  bool look_is_expected = false;    // somebody said that the results of this step shall be complete
  double restart_step = 0.0;        // of the head of a restart file
  bool warned_dt = false, warned_sharing = false, warned_tension = false;
  bool is_material = false;    // fix mpm has asked for it
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

  // What changes of RVEs that are there; all collective. A restart file has a head of this fix: what its RVEs were made with.
  void write_restart_head(FILE *fp) const;
  /// Obeys what the fix says otherwise, as far as it can be obeyed without the RVEs, and refuses other packings.
  void read_restart_head(const char *buf);
  /// `fix_modify ID ...`
  void modify(int narg, char **arg);
  /// Says what is lost with the RVEs that have advanced, when the fix is deleted.
  void warn_of_loss() const;
  /// Looks up the variables of drive and servo.
  void find_variables();

  /// An RVE comes with a local atom, as so many numbers; or none, as none.
  void take_in(int atom, const double *record, int size);

  std::vector<int> atoms_with_rve() const;
  /// Those whose RVEs are not frozen.
  std::vector<int> advancing_atoms() const;
  std::vector<int> slots_of(const std::vector<int> &atoms) const;
  /// DEM steps of the RVEs of this rank since their packings were read.
  double dem_steps() const;
  /// What the script asks for in this LAMMPS step.
  std::vector<rve::Drive> drives(const std::vector<int> &atoms);
  void advance(const std::vector<int> &atoms, const std::vector<rve::Drive> &drives) override;
  /// Leaves so many shadows, of those that choose_shadows() would choose first; collective.
  void remove_shadows(int number);
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

  /// When the DEM time step is looked at again.
  enum class Check {
    EveryStep,    ///< of RVEs with many more contacts than at their last check
    Interval,     ///< of all
    Run    ///< of all, before and after a run: only what is not stable counts, so that a divided run is the whole one
  };
  /// The network stiffens with its contacts: warns, fails, or lowers an automatic step; collective.
  void recheck_time_step(Check check);

  Clock clock(double lammps_dt) const override;
  const rve::Tensor2 &stress(int atom) const override { return points->stress(slot[atom]); }
  const macro::RvePoints::Point &point(int atom) const override
  {
    return guarded(
        [&]() -> const macro::RvePoints::Point & {
          return points->point(slot[atom]);
        },
        atom);
  }
  void complete() override
  {
    guarded([&] {
      points->complete();
    });
  }

  /// work(), whose problems end in an error that names the fix, the step and, unless it is -1, the atom.
  template <class Work> auto guarded(const Work &work, int atom = -1) const -> decltype(work())
  {
    try {
      return work();
    } catch (const LAMMPSException &) {
      throw;
    } catch (const std::exception &problem) {
      fail(problem.what(), atom);
    }
  }
  int threads() const override { return settings.options.threads; }

  /// Ends with an error unless the clock has as many DEM steps as can be; warns of a timestep that nobody has set.
  void check_clock() const;
  /// Ends with an error unless all atoms of `dump` have RVEs; collective.
  void check_dump() const;
  /// Of the dump of an atom in a step.
  std::string dump_file(tagint id, bigint step) const
  {
    return fmt::format("{}.{}.{}.data", settings.dump_prefix, id, step);
  }

  /// Room for the largest RVE in LAMMPS' buffers.
  void set_exchange_size();

 private:
  struct RestartHead;
  // of a restart file, until the RVEs have been adopted
  bool continues = false;
  double mass_scaling_of_rves = 1.0;
  std::vector<std::string> changes;    // "friction 0.5 -> 0.3"
  bool time_step_is_old = false;       // chosen or checked for other RVEs

  void adopt_restart();
  std::vector<std::string> change_materials(const MaterialWords &words, double mass_scaling_before);
  /// Of the RVEs as they are.
  void choose_time_step();
  void say_how_far_cells_go(const std::vector<const rve::RveState *> &states) const;
  [[noreturn]] void fail(const std::string &problem, int atom) const;
  struct LeastBound {
    double dt;      ///< infinite: none is below what was asked for
    tagint atom;    ///< of the RVE that has it; the lowest ID of several
  };
  /// The least stable time step of RVEs, if it is below `enough`; collective.
  LeastBound least_time_step(const std::vector<int> &atoms, double enough);
  void check_time_step(double used, double bound, const std::string &whose);
  void check(const rve::Tensor2 &tensor, const char *what, const char *unit, int atom) const;
  /// `drives` as atoms; none: nothing has been advanced.
  void report(const std::vector<int> &failed, const std::vector<int> &atoms,
              const std::vector<rve::Drive> &drives) const;
  bool wants_details() const;
};

}    // namespace LAMMPS_NS

#endif
