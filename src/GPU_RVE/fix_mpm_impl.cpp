// SPDX-License-Identifier: GPL-2.0-only
// A time step is one call of the solver in final_integrate(), where atom->f is complete and nothing
// else moves a point. setup_pre_force() only initialises new points, and setup() only evaluates
// forces, so that `run 0` and the beginning of a second `run` advance nothing.

#include "fix_mpm_impl.h"

#include "fix_mpm_restart.h"
#include "lammps/mpm_communication.h"
#include "lammps/state_readers.h"
#include "mpm/measures.h"
#include "rve/core/error.h"
#include "rve/core/first_error.h"
#include "rve/core/suggestion.h"
#include "rve/core/threads.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "memory.h"
#include "neighbor.h"
#include "update.h"

#include <algorithm>
#include <cmath>
#include <cstring>

using namespace LAMMPS_NS;

namespace {

constexpr int COURANT_EVERY = 20;    // steps between two checks of the Courant number
// Steps between two checks of the Courant number in a model with RVEs. A check needs complete
// results of all RVEs. fix rve completes them at its interval dt_check (by default 100 steps); this
// check comes one step later and uses the same results.
constexpr int COURANT_OF_GRAINS_EVERY = 100;

}    // namespace

template <int D>
FixMpm::ImplOf<D>::ImplOf(FixMpm *_fix, int narg, char **arg) :
    Impl(_fix->lmp), Setup(_fix->lmp, _fix, MpmSettings<D>::parse(_fix->lmp, narg, arg)),
    progress(lmp, fmt::format("fix mpm {}", fix->id), settings.progress_interval)
{
  const Tensor &initial = settings.initial_stress;
  std::string doubt;
  for (const MpmModel<D> &model : settings.models)
    if (model.law && doubt.empty()) doubt = model.law->doubt_about(initial);
  if (!doubt.empty() && comm->me == 0)
    error->warning(FLERR, "fix mpm {}: the initial stress {:g} {:g} {}", fix->id, initial(0, 0),
                   initial(1, 1), doubt);
  lay_out_memory();

  fix->size_peratom_cols = num_columns();
  fix->size_vector = HEAD + PER_BODY * (int) settings.bodies.size() + TIMES + D +
      PER_TURNING * (int) turning.size();
  fix->maxexchange = DOUBLES + water.width() + layout.width() + num_columns();

  // the solver makes collective calls only after all ranks agree that none has failed
  // (raise_on_all)
  std::string notice;
  collectively(lmp, settings.name(), [&] {
    solver = std::make_unique<mpm::MpmSolver<D>>(settings.options,
                                                 mpm_communication(lmp, settings.name()), &notice);
  });
  if (comm->me == 0) {
    utils::logmesg(lmp, "fix mpm {}: {}\n", fix->id, solver->description());
    if (!notice.empty()) utils::logmesg(lmp, "fix mpm {}: {}\n", fix->id, notice);
  }
}

template <int D> FixMpm::ImplOf<D>::~ImplOf()
{
  memory->destroy(output);
}

template <int D> void FixMpm::ImplOf<D>::lay_out_memory()
{
  if (D == 2) state_columns.emplace_back("out_of_plane_stress");
  state_columns.emplace_back("plastic_strain");
  for (const MpmModel<D> &model : settings.models)
    law_of_model.push_back(
        layout.add(model.word, model.law ? model.law->state_variables() : mpm::StateVariables()));
  for (const std::string &name : settings.columns) {
    if (name == "hoop_stress" && !settings.options.axisymmetric)
      error->all(FLERR, "fix mpm {}: column hoop_stress needs axisymmetric yes", fix->id);
    rve::Words known;
    auto [field, unit] = Fields::number_field(name);
    const int of_water = MpmWater<D>::column(name);
    if (of_water >= 0 && !water.exists())
      error->all(FLERR, "fix mpm {}: column {} needs the keyword water", fix->id, name);
    if (of_water >= 0) unit = MpmWater<D>::unit(of_water);
    for (int law = 0; law < layout.num_laws(); law++)
      for (const mpm::StateVariable &variable : layout.variables(law)) {
        if (std::find(known.begin(), known.end(), variable.name) == known.end())
          known.emplace_back(variable.name);
        if (variable.name == name) unit = variable.unit;
      }
    if (!field && of_water < 0 && std::find(known.begin(), known.end(), name) == known.end())
      error->all(FLERR, "fix mpm {}: column: no model has the state variable '{}'{}", fix->id, name,
                 known.empty() ? std::string("; the models have no state variables")
                               : rve::did_you_mean(name, known, "there are"));
    state_columns.push_back(name);
    if (comm->me == 0)
      utils::logmesg(lmp, "fix mpm {}: column {} is {}{}\n", fix->id, num_columns(), name,
                     unit.empty() ? unit : " [" + unit + "]");
  }
  for (const std::string &name : state_columns) {
    const bool is_hoop = settings.options.axisymmetric && name == "out_of_plane_stress";
    field_columns.push_back(Fields::number_field(is_hoop ? "hoop_stress" : name).first);
    water_columns.push_back(MpmWater<D>::column(name));
  }
  for (int law = 0; law < layout.num_laws(); law++) {
    index_of_law.emplace_back();
    for (const std::string &name : state_columns)
      index_of_law.back().push_back(layout.place(law, name));
  }
}

template <int D> void FixMpm::ImplOf<D>::begin_memory(int i)
{
  remembering[i] = law_of_model[model[i]];
  std::fill_n(memory_of(i), layout.width(), 0.0);
  if (const auto &law = settings.models[model[i]].law) law->begin_memory(stress[i], memory_of(i));
}

template <int D> void FixMpm::ImplOf<D>::find_members()
{
  const int nlocal = atom->nlocal;
  const tagint *const tag = atom->tag;
  const int *const mask = atom->mask;
  bool are_as_before = members_are_known && (int) ids.size() == nlocal;
  ids.resize(nlocal);
  model.resize(nlocal);
  body.resize(nlocal);
  // this runs in each step; for speed it works on blocks of atoms without branches
  constexpr int SOME = 256;
  const auto number = [mask](const auto &groups, int first, int count, int *found) {
    int last[SOME];
    std::fill_n(last, count, -1);
    for (int k = 0; k < (int) groups.size(); k++) {
      const int bit = groups[k].groupbit;
      for (int i = 0; i < count; i++) last[i] = mask[first + i] & bit ? k : last[i];
    }
    const bool same = std::equal(last, last + count, found + first);
    std::copy_n(last, count, found + first);
    return same;
  };
  {
    const rve::LightWork work(nlocal, settings.options.threads);
#pragma omp parallel num_threads(work.team) reduction(&& : are_as_before)
    {
      const rve::ThreadShare mine(nlocal);
      for (int first = mine.begin; first < mine.end; first += SOME) {
        const int count = std::min(SOME, mine.end - first);
        bool same = number(settings.models, first, count, model.data());
        same &= number(settings.bodies, first, count, body.data());
        for (int i = first; i < first + count; i++) {
          same &= ids[i] == tag[i];
          ids[i] = tag[i];
        }
        are_as_before = are_as_before && same;
      }
    }
  }
  if (are_as_before) return;
  rve::FirstError failed;
  // points whose group has changed get the state variables of their new law
#pragma omp parallel for num_threads(rve::team_for(nlocal, settings.options.threads))
  for (int i = 0; i < nlocal; i++)
    failed.guard(i, [&] {
      if (body[i] < 0 && model[i] >= 0 && initial_volume[i] > 0.0 &&
          remembering[i] != law_of_model[model[i]]) {
        const FixRve *const source = grains[model[i]];
        if (source && source->rves().slot[i] >= 0 && update->ntimestep > update->firststep)
          throw rve::InputError(fmt::format(
              "atom {} has joined group {} of the model rve {} during the run, but its RVE does "
              "not have its earlier deformation; change the group between runs only",
              atom->tag[i], settings.models[model[i]].group, source->id));
        begin_memory(i);
      }
    });
  this->guarded([&] { failed.rethrow(); });
  members_are_known = true;
  members_are_sound = false;
}

/// A dynamic group can lose points in a run, or get points without RVEs.
template <int D> void FixMpm::ImplOf<D>::find_members_of_run()
{
  find_members();
  if (members_are_sound) return;
  this->guarded([&] {
    for (int i = 0; i < atom->nlocal; i++) {
      if (body[i] >= 0) continue;
      if (model[i] < 0)
        throw rve::InputError(fmt::format(
            "atom {} has left the groups of all models during the run; every point needs a model: "
            "use groups that keep their atoms, or add a model for the rest",
            atom->tag[i]));
      FixRve *const source = grains[model[i]];
      if (source && source->rves().slot[i] < 0)
        throw rve::InputError(fmt::format(
            "atom {} has joined group {} of the model rve {} during the run and has no RVE; RVEs "
            "are created only at the start of a run: change the group between runs only",
            atom->tag[i], settings.models[model[i]].group, source->id));
    }
  });
  members_are_sound = true;
}

template <int D> mpm::PointView<D> FixMpm::ImplOf<D>::points()
{
  mpm::PointView<D> view;
  view.count = atom->nlocal;
  view.memory_width = layout.width();
  view.id = ids.data();
  if (view.count) {
    view.position = {&atom->x[0][0]};
    view.velocity = {&atom->v[0][0]};
    view.body_force = {water.body_forces(mass.data())};
  }
  Fields::show(view);
  water.show(view);
  view.memory = rows.data();
  view.model = model.data();
  view.rigid_body = body.data();
  return view;
}

/// Applies fix_modify. Points keep their state variables, and their stress until the next step.
template <int D> void FixMpm::ImplOf<D>::modify_models(int narg, char **arg)
{
  fetch_points();
  this->change_models(MpmModel<D>::modified(lmp, settings.models, fix->id, narg, arg),
                      fmt::format("from step {} on", update->ntimestep));
}

/// Initialises the points of new atoms, after all other fixes were initialised and before fix
/// gravity reads masses.
template <int D> void FixMpm::ImplOf<D>::setup_pre_force()
{
  checks.check_positions();
  checks.check_overlap();
  find_members();
  claim_points();
  const std::vector<int> made = make_points(false);
  begin_state(made);
  if (!settings.in_situ.given && rve::norm(settings.initial_stress) > 0.0)
    ground.check_strength(points(), made);
  copy_masses();
  checks.check_volume(points(), made, false);
  // other fixes and the variables of this fix can read the columns before setup() ends
  fill_output();
}

/// Initialises the points of atoms that a fix has created in this step. Does nothing in steps
/// without a rebuild of neighbor lists, because LAMMPS rebuilds them when atoms are created.
template <int D> void FixMpm::ImplOf<D>::pre_force()
{
  if (neighbor->ago > 0) return;
  int any = has_new;
  MPI_Allreduce(MPI_IN_PLACE, &any, 1, MPI_INT, MPI_MAX, world);
  if (!any) return;
  find_members();
  claim_points();
  const std::vector<int> made = make_points(true);
  begin_state(made);
  ground.forget();    // no report, because in motion the unbalanced forces are not 0
  copy_masses();
  checks.check_volume(points(), made, true);
}

template <int D> void FixMpm::ImplOf<D>::begin_state(const std::vector<int> &made)
{
  if (settings.in_situ.given) {
    begin_in_situ(made);
  } else {
    water.find_porosities(points(), made);
    for (const int i : made) mass[i] += water.density_at_start(i) * settings.initial_volume;
  }
  water.begin(points(), made);
}

template <int D> void FixMpm::ImplOf<D>::begin_in_situ(const std::vector<int> &made)
{
  const auto starts = ground.find(points(), made);
  for (std::size_t n = 0; n < starts.size(); n++) {
    const int i = made[n];
    stress[i] = starts[n].stress;
    begin_memory(i);
    begin_hoop_stress(i, starts[n].across_plane);
    mass[i] = starts[n].density * initial_volume[i];
    if (!starts[n].across_plane) continue;
    const int place = layout.place((int) remembering[i], "out_of_plane_stress");
    if (place >= 0) memory_of(i)[place] = *starts[n].across_plane;
  }
  ground.check_strength(points(), made);
}

template <int D>
void FixMpm::ImplOf<D>::begin_hoop_stress(int i, const std::optional<double> &across_plane)
{
  if constexpr (D == 2) {
    if (!settings.options.axisymmetric) return;
    const FixRve *source = grains[model[i]];
    this->hoop_stress[i] = source ? hoop_stress_of(*source, i)
                                  : across_plane.value_or(stress[i](0, 0));
  }
}

template <int D> bool FixMpm::ImplOf<D>::make_point(int i, bool in_run)
{
  const bool rigid = body[i] >= 0;
  if (!rigid && model[i] < 0)
    error->one(FLERR,
               "fix mpm {}: atom {} has no constitutive model; give a model for its group with the "
               "keyword model",
               fix->id, atom->tag[i]);
  const FixRve *source = rigid ? nullptr : grains[model[i]];
  const bool is_new = initial_volume[i] == 0.0;
  if (is_new && in_run && (rigid || source))
    error->one(
        FLERR,
        "fix mpm {}: step {}: atom {} was created during the run as a point of {}; such points can "
        "be created between runs only, points with an analytic law also during a run",
        fix->id, update->ntimestep, atom->tag[i],
        rigid ? "rigid body " + settings.bodies[body[i]].group
              : fmt::format("the RVEs of fix {}", source->id));
  if (source && source->rves().slot[i] < 0)
    error->one(
        FLERR,
        "fix mpm {}: atom {} has no RVE of fix {}; the group of that fix must contain the atom",
        fix->id, atom->tag[i], source->id);
  if (!is_new) return false;
  Fields::set_point(i, {});
  water.clear(i);
  const double half = 0.5 * settings.width_of_point();
  for (int a = 0; a < D; a++) {
    reference[i][a] = atom->x[i][a];
    half_size[i][a] = half;
  }
  if (settings.options.axisymmetric && !(atom->x[i][0] > 0.0))
    error->one(FLERR,
               "fix mpm {}: atom {} has the radius x = {} [length]; it must be above 0, because an "
               "axisymmetric point is a ring about the axis x = 0",
               fix->id, atom->tag[i], atom->x[i][0]);
  initial_volume[i] = volume[i] = settings.initial_volume_at(atom->x[i]);
  if (!rigid) stress[i] = source ? stress_of<D>(*source, i) : settings.initial_stress;
  if (!rigid) begin_memory(i);
  if (!rigid) begin_hoop_stress(i, {});
  const double density = this->density_of(points(), i);
  if (density > 0.0)
    mass[i] = density * initial_volume[i];
  else if (rigid)
    mass[i] = atom->rmass ? atom->rmass[i] : atom->mass[atom->type[i]];
  else
    error->one(FLERR,
               "fix mpm {}: atom {} has no RVE that gives a density; give the model of group {} a "
               "density > 0 with the keyword density",
               fix->id, atom->tag[i], settings.models[model[i]].group);
  return true;
}

template <int D> std::vector<int> FixMpm::ImplOf<D>::make_points(bool in_run)
{
  std::vector<int> made;
  for (int i = 0; i < atom->nlocal; i++)
    if (make_point(i, in_run) && body[i] < 0) made.push_back(i);
  has_new = false;
  return made;
}

template <int D> void FixMpm::ImplOf<D>::copy_masses()
{
  for (int i = 0; i < atom->nlocal; i++) {
    const bool rigid = body[i] >= 0;
    if (atom->rmass)
      atom->rmass[i] = mass[i];
    else if (!rigid && std::fabs(atom->mass[atom->type[i]] / mass[i] - 1.0) > 1e-6)
      error->one(FLERR,
                 "fix mpm {}: atom {} has the mass {} (density * volume), but atom type {} has the "
                 "mass {}, which fix gravity would use; use atom_style sphere, or set this mass "
                 "with the mass command",
                 fix->id, atom->tag[i], mass[i], atom->type[i], atom->mass[atom->type[i]]);
  }
}

template <int D> void FixMpm::ImplOf<D>::setup()
{
  find_members_of_run();
  waves.measure(points());
  waves.check_courant(points(), loads.body_speed());
  waves.check_time_step();
  waves.check_absorbing_sides(points());
  solve(false);
  checks.check_enclosed(points());
  ground.report(points());
  water.report(points());
  checks.report_parts();
  waves.check_rounding(points(), loads.body_speed());
  if (!this->has_grains()) progress.begin();
}

template <int D> void FixMpm::ImplOf<D>::final_integrate()
{
  if (update->ntimestep == update->firststep + 1) {
    this->check_sources();
    times.begin_run();
    checks.begin_damping();
  }
  times.begin_step();
  const bool must_measure = settings.wave_every > 0 && update->ntimestep % settings.wave_every == 0;
  const bool is_due = this->has_grains() ? (update->ntimestep - 1) % COURANT_OF_GRAINS_EVERY == 0 &&
          update->ntimestep > update->firststep + 1
                                         : update->ntimestep % COURANT_EVERY == 0;
  if (must_measure || is_due) {
    find_members_of_run();
    if (must_measure) waves.measure(points());
    waves.check_courant(points(), loads.body_speed());
  }
  solve(true);
  output_is_old = true;
  checks.add_damping();
  times.end_solution();
  if (state_may_be_read(lmp)) fill_output();
  times.end_step();
  if (!this->has_grains()) progress.step_done();
}

/// The per-atom output can be outdated here, because a run can end before its last step.
template <int D> void FixMpm::ImplOf<D>::post_run()
{
  if (output_is_old) fill_output();
  water.report_cavitation(points());
  checks.report_damping(fix->size_vector - PER_TURNING * (int) turning.size());
  checks.keep_positions();
  times.report();
  if (!this->has_grains()) progress.end();
}

template <int D> void FixMpm::ImplOf<D>::solve(bool advance)
{
  settings.check_groups(lmp);
  find_members_of_run();
  checks.check_bodies(points(), advance);
  loads.solve(points(), advance);
}

template <int D> double FixMpm::ImplOf<D>::vector_component(int n)
{
  if (n == UNBALANCED) return solver->max_unbalanced_force();
  if (n == COURANT) return waves.courant();
  if (n == KINETIC || n == MASS) {
    find_members();
    const mpm::Totals<D> totals = solver->totals(points());
    return n == MASS ? totals.mass : totals.kinetic_energy;
  }
  const int after_bodies = n - HEAD - PER_BODY * (int) settings.bodies.size();
  const int after_damping = after_bodies - TIMES - D;
  if (after_damping >= 0) {
    const int body = turning[after_damping / PER_TURNING];
    const int what = after_damping % PER_TURNING;
    if (what < ANGLE) return solver->rigid_bodies().rates(body)[what];
    if (what < TORQUE) return solver->rigid_bodies().turned(body)[what - ANGLE];
    return solver->body_torque(body)[what - TORQUE];
  }
  if (after_bodies >= TIMES) return solver->damping_force()[after_bodies - TIMES];
  if (after_bodies >= 0) return times.longest(after_bodies);
  const int body = (n - HEAD) / PER_BODY;
  const int what = (n - HEAD) % PER_BODY;
  if (what < BODY_UX) return solver->body_reaction(body)[what - REACTION_X];
  return loads.displacement[body][what - BODY_UX];
}

template <int D> double FixMpm::ImplOf<D>::bytes() const
{
  // doubles per node in NodeFields: sums (1 + 2 D), mass, six vectors, an impulse vector for each
  // axis and each body, and about one for small integers; fields of special options are left out
  const double of_node = 3.0 + 8.0 * D + D * D + D * (double) settings.bodies.size();
  return sizeof(double) * ((double) atom->nmax * fix->maxexchange + of_node * solver->held_nodes());
}

template <int D> void FixMpm::ImplOf<D>::grow_arrays(int nmax)
{
  if (solver) solver->synchronise();    // pending stresses would be written to the old arrays
  Fields::resize_fields(nmax);
  water.resize(nmax);
  rows.resize((std::size_t) nmax * layout.width());
  memory->grow(output, nmax, fix->size_peratom_cols, "fix mpm:output");
  fix->array_atom = output;
}

template <int D> void FixMpm::ImplOf<D>::copy_arrays(int i, int j)
{
  claim_points();
  Fields::set_point(j, Fields::point(i));
  water.copy(i, j);
  std::copy_n(memory_of(i), layout.width(), memory_of(j));
  std::copy_n(fix->array_atom[i], fix->size_peratom_cols, fix->array_atom[j]);
}

template <int D> void FixMpm::ImplOf<D>::set_arrays(int i)
{
  claim_points();
  Fields::set_point(i, {});
  water.clear(i);
  has_new = true;
  std::fill_n(fix->array_atom[i], fix->size_peratom_cols, 0.0);
}

template <int D> int FixMpm::ImplOf<D>::pack_exchange(int i, double *buf)
{
  claim_points();
  Fields::pack_point(i, buf);
  double *const memory = water.pack(i, buf + DOUBLES);
  double *const columns = std::copy_n(memory_of(i), layout.width(), memory);
  // the columns are sent with the point, because variables can read them before the step ends
  std::copy_n(fix->array_atom[i], fix->size_peratom_cols, columns);
  return fix->maxexchange;
}

template <int D> int FixMpm::ImplOf<D>::unpack_exchange(int i, const double *buf)
{
  claim_points();
  Fields::unpack_point(i, buf);
  const double *const memory = water.unpack(i, buf + DOUBLES);
  std::copy_n(memory, layout.width(), memory_of(i));
  std::copy_n(memory + layout.width(), fix->size_peratom_cols, fix->array_atom[i]);
  return fix->maxexchange;
}

template <int D> int FixMpm::ImplOf<D>::pack_restart(int i, double *buf)
{
  fetch_points();
  const int size = size_restart(i);
  RestartRecords::write_header(lmp, i, size, buf);
  Fields::pack_point(i, buf + RestartRecords::HEADER);
  double *const memory = water.pack(i, buf + RestartRecords::HEADER + DOUBLES);
  std::copy_n(memory_of(i), num_remembered(i), memory);
  buf[size - 1] = mpm_checksum(buf, size - 1);
  return size;
}

template <int D> void FixMpm::ImplOf<D>::unpack_restart(int i, int nth)
{
  claim_points();
  const auto [extra, size] = records.of(lmp, settings.name(), i, nth, restart_step);
  const auto damaged = [&](const std::string &how) {
    error->one(
        FLERR,
        "fix mpm {}: the record of atom {} in the restart file is damaged: {}; use an earlier file",
        fix->id, atom->tag[i], how);
  };
  if (!is_same_checksum(extra[size - 1], mpm_checksum(extra, size - 1)))
    damaged("its checksum does not match its values");
  const int shortest = RECORD + water.width();
  if (size < shortest) damaged(fmt::format("it has {} values instead of {}", size, shortest));
  Fields::unpack_point(i, extra + RestartRecords::HEADER);
  double &law = remembering[i];
  int num_memory = 0;
  if (law != NO_LAW) {
    if (!(law >= 0.0 && law < (double) law_of_file.size()))
      damaged(fmt::format("the file has no law number {}", law));
    const auto in_file = (std::size_t) law;
    num_memory = size_in_file[in_file];
    law = law_of_file[in_file];
  }
  if (size != shortest + num_memory)
    damaged(fmt::format("it has {} values instead of {}", size, shortest + num_memory));
  const double *const memory = water.unpack(i, extra + RestartRecords::HEADER + DOUBLES);
  // state variables of a law that no model has are dropped
  if (law != NO_LAW) std::copy_n(memory, num_memory, memory_of(i));
}

template <int D> void FixMpm::ImplOf<D>::write_restart(FILE *fp) const
{
  if (comm->me != 0) return;
  MpmRestartHead<D> head;
  head.step = (double) update->ntimestep;
  for (int b = 0; b < (int) settings.bodies.size(); b++) {
    head.bodies.push_back({loads.displacement[b], solver->body_velocity_before(b), {}});
    if (solver->rigid_bodies().can_turn(b))
      head.bodies.back().turning = solver->rigid_bodies().record(b);
  }
  head.words = settings.words;
  head.water = water.names();
  for (int k = 0; k < layout.num_laws(); k++)
    head.laws.emplace_back(layout.word(k), layout.names(k));
  for (const MpmModel<D> &model : settings.models)
    if (model.is_modified) head.modifications.push_back(model.modification());
  head.write(fp);
}

template <int D> void FixMpm::ImplOf<D>::find_law(const std::string &word, const std::string &names)
{
  const int law = layout.find(word);
  if (law >= 0 && names != layout.names(law))
    error->all(FLERR,
               "fix mpm {}: law {} has the state variables '{}' in the restart file, but '{}' in "
               "this program",
               fix->id, word, names, layout.names(law));
  law_of_file.push_back(law);
  size_in_file.push_back((int) utils::split_words(names).size());
}

template <int D> void FixMpm::ImplOf<D>::restart(const char *buf)
{
  const auto then = MpmRestartHead<D>::read(lmp, settings.name(), buf);
  restart_step = then.step;
  const auto is_axisymmetric = [](const MpmArguments &words) {
    return std::any_of(words.begin(), words.end(), [](const auto &one) {
      return one.first == "axisymmetric" &&
          (one.second == "yes" || one.second == "on" || one.second == "true");
    });
  };
  if (is_axisymmetric(then.words) != settings.options.axisymmetric)
    error->all(FLERR,
               "fix mpm {}: axisymmetric is {}, but the run that wrote the restart file had {}; "
               "volumes and masses of its points do not suit",
               fix->id, settings.options.axisymmetric ? "yes" : "no",
               settings.options.axisymmetric ? "no" : "yes");
  if (then.water != water.names())
    error->all(FLERR,
               "fix mpm {}: the points of the restart file have {}, but those of the script "
               "have {}; {}",
               fix->id, then.water.empty() ? "no water" : "the numbers " + then.water,
               water.exists() ? "the numbers " + water.names() : "no water",
               water.exists() ? "continue the run without the keyword water, or start it again"
                              : "give the keyword water");
  law_of_file.clear();
  size_in_file.clear();
  for (const auto &[law, names] : then.laws) find_law(law, names);
  if (!then.modifications.empty()) fetch_points();
  for (const std::string &words : then.modifications)
    this->continue_modification(then.words, words);

  // bodies are identified by their groups
  std::vector<std::string> groups;
  for (const auto &[about, values] : then.words)
    if (utils::strmatch(about, "^rigid \\S+$")) groups.push_back(about.substr(strlen("rigid ")));
  std::vector<std::string> new_bodies;
  for (int b = 0; b < (int) settings.bodies.size(); b++) {
    const std::string &group = settings.bodies[b].group;
    const std::size_t k = std::find(groups.begin(), groups.end(), group) - groups.begin();
    const bool turns = solver->rigid_bodies().can_turn(b);
    // a body counts as new if it can turn now but could not in the run before, or vice versa
    if (k >= then.bodies.size() || then.bodies[k].turning.empty() == turns) {
      new_bodies.push_back(group);
      continue;
    }
    const auto &body = then.bodies[k];
    loads.displacement[b] = body.displacement;
    solver->set_body_velocity_before(b, body.velocity);
    if (turns) solver->rigid_bodies().set_record(b, body.turning.data());
  }
  if (comm->me != 0) return;
  const std::string other = mpm_differences(then.words, settings.words, false);
  const std::string kept = mpm_differences(then.words, settings.words, true);
  if (!other.empty())
    error->warning(FLERR,
                   "fix mpm {}: continues the run that wrote the restart file with changes: {}",
                   fix->id, other);
  if (!kept.empty())
    error->warning(FLERR,
                   "fix mpm {}: points of the restart file keep their values; these changes apply "
                   "to new points only: {}",
                   fix->id, kept);
  if (!new_bodies.empty())
    error->warning(
        FLERR,
        "fix mpm {}: rigid bodies that are not in the restart file start with displacement 0: {}",
        fix->id, utils::join_words(new_bodies, ", "));
}

template struct FixMpm::ImplOf<2>;
template struct FixMpm::ImplOf<3>;
