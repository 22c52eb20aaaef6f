// SPDX-License-Identifier: GPL-2.0-only
// Implementation of fix rve for RVEs of dimension D. It sets up the engine. Its LAMMPS hooks call
// the classes of fix_rve_jobs.h.

#pragma once

#include "fix_rve_jobs.h"

#include <cstdio>
#include <memory>
#include <utility>
#include <vector>

namespace LAMMPS_NS {

template <int D> struct FixRve::ImplOf final : AttachedRves<D> {
  using Rves = AttachedRves<D>;
  using Rves::atom, Rves::comm, Rves::error, Rves::lmp, Rves::timer, Rves::update, Rves::world;
  using Rves::checks_postponed, Rves::dt, Rves::fix, Rves::packings, Rves::points, Rves::progress;
  using Rves::settings, Rves::slot;
  using typename Rves::State;

  ImplOf(FixRve *_fix, FixRveSettings _settings) : Rves(_fix, std::move(_settings)), of_plane(*this)
  {
    if constexpr (D == 3) of_space = std::make_unique<macro::RveConstitutive<3>>(*this);
  }

  ~ImplOf() noexcept override = default;

  void make_engine() override;
  void init() override;
  void setup() override;
  void final_integrate() override;
  void end_of_step() override;
  void post_run() override;
  void attach() override;
  macro::InSituReport bring_to_stress(const std::vector<int> &atoms,
                                      const std::vector<macro::StressGoal> &goals,
                                      double tolerance) override;
  void synchronise_ranks() override;

  void write_restart_head(FILE *fp) const override { changes.write_restart_head(fp); }
  void read_restart_head(const char *buf) override { changes.read_restart_head(buf); }
  void modify(int narg, char **arg) override { changes.modify(narg, arg); }
  void warn_of_loss() const override { changes.warn_of_loss(); }

  double engine_time() const override { return points.as_they_are().engine_time(); }
  double bounding_time() const override { return points.as_they_are().bounding_time(); }
  double vector_component(int n) const override;
  double bytes() const override;
  double bulk_density(int atom) const override;
  double void_ratio(int atom) const override { return this->point(atom).result.void_ratio; }
  auto path_report(int atom) const { return drives.path_report(atom); }
  double inertial_number(int atom) const;
  double servo_error(int atom) const { return points->servo_error(slot[atom]); }
  mpm::Constitutive<2> *material_of_plane() override { return &of_plane; }
  mpm::Constitutive<3> *material_of_space() override { return of_space.get(); }
  double measured_wave_share(const std::vector<int> &atoms) const override;
  void scale_waves(double share) override
  {
    of_plane.scale_waves(share);
    if constexpr (D == 3) of_space->scale_waves(share);
  }

 private:
  using Check = typename RveTimeStep<D>::Check;

  // the RVEs as materials in two and three dimensions; of_space is null for disks
  macro::RveConstitutive<2, D> of_plane;
  std::unique_ptr<macro::RveConstitutive<3>> of_space;

  RveTimeStep<D> time_step{*this};
  RveShadows<D> shadows{*this};
  RveAdvice<D> advice{*this};
  RveDrives<D> drives{*this};
  RveMemory<D> rve_memory{*this};
  RveChanges<D> changes{*this, time_step, drives, rve_memory};

  bool is_halted = false;    // the run ends because all loading paths have ended

  /// Reads the packings and chooses or checks the DEM time step; collective.
  void read_packings();
  /// Raises maxexchange to an upper bound of the sizes of RVE records in a run; collective.
  void set_exchange_size();
  /// Logs the notes of the last advance and checks its time step, if these were postponed;
  /// collective.
  void run_postponed_checks();
  /// Logs how far cells can be compressed before they are too narrow for their grains; collective.
  void log_cell_limits(const std::vector<const State *> &states) const;
};

}    // namespace LAMMPS_NS
