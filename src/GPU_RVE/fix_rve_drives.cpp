// SPDX-License-Identifier: GPL-2.0-only
#include "fix_rve_jobs.h"

#include "atom.h"
#include "error.h"
#include "lammps/rve_columns.h"
#include "modify.h"
#include "rve/core/error.h"
#include "update.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;

template <int D> void RveDrives<D>::advance_by_script()
{
  if (const auto &paths = rves.settings.path.template of<D>()) return advance_on_paths(*paths);
  modify->clearstep_compute();
  const std::vector<int> atoms = rves.atoms_with_rve();
  const std::vector<rve::DriveOf<D>> wanted = drives(atoms);
  modify->addstep_compute(update->ntimestep + 1);
  rves.advance(atoms, wanted);
}

template <int D>
macro::PathStep RveDrives<D>::path_step(int atom, const macro::RveClock &clock) const
{
  return {clock.dt, clock.substeps,
          rves.settings.servo_gain.value_or(rves.points->servo_gain(rves.slot[atom])),
          rves.settings.servo_max_rate.value_or(macro::SERVO_STRAIN_PER_STEP / clock.dt)};
}

template <int D> void RveDrives<D>::begin_paths(const macro::LoadPathsOf<D> &paths)
{
  std::vector<double> numbers;
  for (const int i : rves.atoms_with_rve()) {
    macro::PathState<D> &state = rves.points->path(rves.slot[i]);
    if (state.path >= 0) continue;
    double number = 1.0;
    if (rves.settings.path.number_given) {
      if (numbers.empty()) rves.settings.path.number.evaluate(lmp, rves.fix->igroup, numbers);
      number = numbers[i];
    }
    if (!(number >= 1.0 && number <= paths.size()) || number != std::floor(number))
      error->one(FLERR,
                 "fix rve {}: path_variable is {} for atom {}; it must be a whole number from "
                 "1 to {}, the number of paths",
                 rves.fix->id, number, atom->tag[i], paths.size());
    paths.begin(state, static_cast<int>(number) - 1, rves.point(i).result.deformation);
  }
}

template <int D> void RveDrives<D>::advance_on_paths(const macro::LoadPathsOf<D> &paths)
{
  modify->clearstep_compute();
  begin_paths(paths);
  std::vector<int> atoms = rves.atoms_with_rve();
  atoms.erase(std::remove_if(atoms.begin(), atoms.end(),
                             [this](int i) { return rves.points->path(rves.slot[i]).ended != 0; }),
              atoms.end());
  const int num_values = static_cast<int>(rves.settings.path.values.size());
  std::vector<std::vector<double>> values(num_values);
  for (int n = 0; n < num_values; ++n)
    rves.settings.path.values[n].evaluate(lmp, rves.fix->igroup, values[n]);
  modify->addstep_compute(update->ntimestep + 1);

  const macro::RveClock clock = rves.clock(update->dt);
  std::vector<rve::DriveOf<D>> wanted;
  std::vector<double> own(num_values);
  const auto of_atom = [&](int i) {
    for (int n = 0; n < num_values; ++n) own[n] = values[n][i];
    return own.data();
  };
  for (const int i : atoms) {
    const auto drive = [&] {
      return rves.points->path_drive(rves.slot[i], paths, path_step(i, clock), of_atom(i));
    };
    wanted.push_back(rves.guarded(drive, i));
  }
  rves.advance(atoms, wanted);
  for (const int i : atoms)
    rves.points->follow_path(rves.slot[i], paths, path_step(i, clock), of_atom(i));
}

template <int D> typename RveDrives<D>::PathReport RveDrives<D>::path_report(int atom) const
{
  const macro::PathState<D> &state = rves.points->path(rves.slot[atom]);
  if (!rves.settings.path.any() || state.path < 0) return {};
  return {state.stage + 1.0, state.time, state.cycles(), static_cast<double>(state.ended)};
}

template <int D> bool RveDrives<D>::all_paths_ended() const
{
  int going = 0, any;
  for (const int i : rves.advancing_atoms())
    going = going || rves.points->path(rves.slot[i]).ended == 0;
  MPI_Allreduce(&going, &any, 1, MPI_INT, MPI_MAX, world);
  return any == 0;
}

template <int D> void RveDrives<D>::resume_paths(const macro::LoadPathsOf<D> &paths)
{
  rves.points->complete();
  for (const int i : rves.atoms_with_rve())
    if (rves.points->path(rves.slot[i]).path >= 0)
      rves.guarded([&] { paths.resume(rves.points->path(rves.slot[i]), rves.point(i).result); }, i);
}

template <int D> std::vector<rve::DriveOf<D>> RveDrives<D>::drives(const std::vector<int> &atoms)
{
  const macro::RveClock clock = rves.clock(update->dt);
  std::vector<rve::DriveOf<D>> drives(atoms.size());
  std::vector<double> values;
  for (const auto &rate : rves.settings.velocity_gradient) {
    rate.value.evaluate(lmp, rves.fix->igroup, values);
    for (std::size_t k = 0; k < atoms.size(); ++k)
      drives[k].velocity_gradient(rate.row, rate.column) = values[atoms[k]];
  }
  for (std::size_t k = 0; k < atoms.size(); ++k)
    rves.check(drives[k].velocity_gradient, "velocity gradient", "[1/time]", atoms[k]);
  if (rves.settings.stress_goal.empty()) {
    // With adaptive substeps, the DEM steps of an RVE can take less time than the LAMMPS step, but
    // they apply the strain of the whole LAMMPS step.
    const double dt_of_path = rves.settings.macro_step.adaptive ? update->dt / clock.substeps
                                                                : clock.dt;
    for (std::size_t k = 0; k < drives.size(); ++k) {
      const auto drive = [&] {
        return rve::DriveOf<D>::constant_velocity_gradient(drives[k].velocity_gradient, dt_of_path,
                                                           clock.substeps);
      };
      drives[k] = rves.guarded(drive, atoms[k]);
      drives[k].dt = clock.dt;
    }
    return drives;
  }
  for (const auto &goal : rves.settings.stress_goal) {
    goal.value.evaluate(lmp, rves.fix->igroup, values);
    for (std::size_t k = 0; k < atoms.size(); ++k) {
      const double stress = values[atoms[k]];
      drives[k].controlled[goal.row][goal.column] = true;
      drives[k].stress_goal(goal.row, goal.column) = stress;
      if (!(goal.row == goal.column && stress > 0.0) || warned_tension) continue;
      warned_tension = true;
      rves.notes.push_back(
          {atom->tag[atoms[k]], FixRve::Impl::NoteKind::Tension,
           fmt::format(
               "the goal of servo {} is {} [stress] for atom {} at step {}, which is a tension; "
               "grains without cohesion carry no tension, and the cell expands without limit. It "
               "should be at most 0, because stresses are negative in compression",
               rve_component_name(goal.row, goal.column), rve::number(stress), atom->tag[atoms[k]],
               update->ntimestep)});
    }
  }
  for (std::size_t k = 0; k < atoms.size(); ++k) {
    const macro::PathStep step = path_step(atoms[k], clock);
    drives[k].dt = step.dt;
    drives[k].substeps = step.substeps;
    drives[k].servo_gain = step.servo_gain;
    drives[k].servo_max_rate = step.servo_max_rate;
  }
  return drives;
}

template class LAMMPS_NS::RveDrives<2>;
template class LAMMPS_NS::RveDrives<3>;
