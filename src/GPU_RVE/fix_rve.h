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

#include <array>
#include <memory>
#include <string>
#include <vector>

namespace macro {
struct InSituReport;
struct StressGoal;
}    // namespace macro
namespace mpm {
template <int D> class Constitutive;
}
namespace rve {
template <int D> class EngineOf;
template <int D> struct ResultOf;
template <int D> struct RveStateOf;
enum class Format;
}    // namespace rve

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

  // For other styles that read RVEs: the fix of this ID, or the only one if the ID is empty. `who` asks, in messages.
  static FixRve *find(class LAMMPS *, const std::string &id, const std::string &who);

  // For fix mpm, and for who reads RVEs. Atoms are local indices.

  // gives an RVE to every atom of the group that has none; collective; init() calls it
  void attach();
  // number of the RVE in the engine, -1 if the atom has none
  int slot(int) const;
  // of the RVEs: 2 for disks, 3 for spheres
  int dimension() const;
  // answer of the last advance, or of the packing as attached; the atom must have an RVE, and D is its dimension
  template <int D> const rve::ResultOf<D> &result(int) const;
  // brings the RVEs of these atoms to stresses and forgets what has happened to them; an error names the atom for which it cannot be done
  macro::InSituReport bring_to_stress(const std::vector<int> &atoms,
                                      const std::vector<macro::StressGoal> &goals,
                                      double tolerance);
  // grain density / (1 + void ratio) [mass/length^3]
  double bulk_density(int) const;
  // whether variables of drive or servo, evaluated in each step, may read fixes or computes
  bool reads_results() const;
  // wall time in calls of the engine so far [seconds]
  double engine_time() const;
  // wall time in bounds of stable DEM time steps so far [seconds]
  double bounding_time() const;
  // of its last DEM steps; 0 before the first one [-]
  double inertial_number(int) const;
  // largest difference between a steered stress and its goal [stress]
  double servo_error(int) const;
  // where it is on its path: stage from 1, time and cycles in it, 1 if it has ended; 0 without a path
  double path_stage(int) const;
  double path_time(int) const;
  double path_cycles(int) const;
  double path_ended(int) const;
  // how often the grains of its packing stand side by side
  double copies(int) const;
  // how often a fresh RVE took its place
  double renewals(int) const;
  // complete state, exact; D is the dimension of the RVEs
  template <int D> rve::RveStateOf<D> state(int) const;
  // symmetric part of the velocity gradient of its last DEM steps, row by row; zeros before the first one [1/time]
  template <int D> std::array<double, D * D> rate_of_deformation(int) const;
  // an engine without RVEs that takes these, on the same device, in a number format of its own; throws what rve::make_engine does
  template <int D> std::unique_ptr<rve::EngineOf<D>> empty_engine(rve::Format) const;
  // the RVEs as a material for fix mpm, in a continuum of D dimensions; owned by this fix; error unless `drive mpm`
  template <int D> mpm::Constitutive<D> *constitutive();
  /// Whether fix mpm has asked for it.
  bool is_material() const;
  // of that material: largest modulus of waves by elastic tangents of these atoms, over the bound of their contacts, 0 if none could be measured [-];
  // the results must be known (expect_questions() of the material). And what the bound is multiplied by
  double measured_wave_share(const std::vector<int> &) const;
  void scale_waves(double);

 private:
  struct Impl;
  template <int D> struct ImplOf;
  std::unique_ptr<Impl> impl;

  // whether LAMMPS counts this fix among those that integrate
  void claim_integration();
  void check_dump_files() const;
  void report_shadows() const;
};

}    // namespace LAMMPS_NS

#endif
#endif
