/* ----------------------------------------------------------------------
   LAMMPS - Large-scale Atomic/Molecular Massively Parallel Simulator
   https://www.lammps.org/, Sandia National Laboratories
   LAMMPS development team: developers@lammps.org

   Copyright (2003) Sandia Corporation.  Under the terms of Contract
   DE-AC04-94AL85000 with Sandia Corporation, the U.S. Government retains
   certain rights in this software.  This software is distributed under
   the GNU General Public License.

   See the README file in the top-level LAMMPS directory.
------------------------------------------------------------------------- */

// One time step is one call of the solver, in final_integrate(): there atom->f is complete, and nothing else moves a point.
// setup only makes new points and evaluates, so that `run 0` and a second `run` advance nothing.

#include "fix_mpm.h"

#include "fix_rve.h"
#include "formulas.h"
#include "mpm/memory_layout.h"
#include "mpm/mpm_solver.h"
#include "mpm_settings.h"
#include "no_pairs.h"
#include "progress.h"
#include "restart_record.h"
#include "rve/core/checksum.h"
#include "rve/core/suggestion.h"
#include "rve/core/threads.h"
#include "rve/engine/engine.h"
#include "state_readers.h"
#include "unit_styles.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "exceptions.h"
#include "group.h"
#include "input.h"
#include "memory.h"
#include "modify.h"
#include "region.h"
#include "timer.h"
#include "update.h"
#include "variable.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

using namespace LAMMPS_NS;
using namespace FixConst;
using mpm::Face;
using mpm::Vec2;
using rve::Tensor2;

namespace {

// columns of the per-atom output, the last of which are state variables from SZZ on, and of the head of the global vector; doc/src/fix_mpm.rst has the list
enum { UX, UY, U, SXX, SYY, SXY, P, Q, EPS_V, EPS_Q, RHO, FXX, FXY, FYX, FYY, SZZ };
enum { UNBALANCED, COURANT, KINETIC, MASS, HEAD };
enum { REACTION_X, REACTION_Y, BODY_UX, BODY_UY, PER_BODY };
enum { TIME_RVE, TIME_MPM, TIME_TRANSFERS, TIMES };    // behind the bodies
constexpr int DAMPING = 2;    // force of local damping in x and y, at the end of the global vector

// Of what restart files hold of points and bodies: raise it with every change of that. Files before version 3 had no number.
constexpr int RESTART_VERSION = 6;

// What a line of the head of a restart file begins with that names the state variables of a law.
const std::string STATE_OF = "state of ";

constexpr double NO_LAW = -1.0;

constexpr int COURANT_EVERY = 20;    // steps between two checks of the Courant number
constexpr int DAMPING_EVERY =
    50;    // steps between two looks at what local damping takes from reactions
constexpr double DAMPING_WARN = 0.01;    // of the largest reaction

constexpr std::size_t HEAD_FIRST = 3;    // numbers before the state in the head of a restart file

/// A checksum of numbers, as the bits of another one.
double sum_of(const double *numbers, std::size_t count)
{
  const std::uint64_t sum = rve::checksum_of(numbers, count * sizeof(double));
  double bits;
  static_assert(sizeof(bits) == sizeof(sum));
  memcpy(&bits, &sum, sizeof(bits));
  return bits;
}

/// Bits may be those of no number, which equals nothing.
bool is_same_sum(double a, double b)
{
  return memcmp(&a, &b, sizeof(a)) == 0;
}

constexpr double COURANT_SMALL =
    1e-4;    // below, in a million steps a wave passes a hundred cells at most
constexpr double FULL =
    1.3;    // area of the points in a cell over that of the cell, above which it is too much

constexpr double LONG_RUN =
    1.0;    // wall time of a run that is worth a line about its parts [seconds]

/// The stress of an RVE in the plane. That of spheres has components across it.
Tensor2 stress_of(const FixRve &grains, int atom)
{
  if (grains.dimension() == 2) return grains.result<2>(atom).stress;
  return rve::leading_components<2>(grains.result<3>(atom).stress);
}

}    // namespace

struct FixMpm::Impl {
  MpmSettings settings;
  std::unique_ptr<mpm::MpmSolver<2>> solver;
  std::unique_ptr<Progress> progress;
  std::vector<FixRve *> grains;    // per model; nullptr: an analytic law
  double courant = 0.0;
  double restart_step = 0.0;    // of the head of a restart file
  bool warned = false, warned_damping = false;
  std::vector<Vec2> body_displacement;
  std::vector<mpm::TractionLoad<2>> loads;    // of this step
  double **output = nullptr;
  // as the last run left them, to see whether others have moved points: their number and a sum over positions; box sides
  bigint points_then = -1;
  std::uint64_t positions_then = 0;
  double box_then[4] = {};
  bool said_overlap = false;
  double times[TIMES] = {};                        // wall time of this run [seconds]
  double damping_sum = 0.0, reaction_sum = 0.0;    // of looks in this run [force]
  bool output_is_old = false;    // rows of the per-atom output are those of an earlier step

  // what a point carries, besides position and velocity in atom->x and atom->v; initial volume 0: not yet made
  std::vector<Vec2> reference, half_size;
  std::vector<double> mass, volume0, volume;
  std::vector<Tensor2> deformation_gradient, stress, velocity_gradient;
  std::vector<double> remembering;    // whose state variables: a law in `layout`, or NO_LAW

  template <class F> void for_each_array(F &&f)
  {
    f(reference), f(half_size), f(mass), f(volume0), f(volume);
    f(deformation_gradient), f(stress), f(velocity_gradient), f(remembering);
  }

  // and the state variables, in rows of the same width
  mpm::MemoryLayout layout;
  std::vector<double> memory;
  std::vector<int> law_of_model;    // in `layout`
  std::vector<int> law_of_file;     // in `layout`, of each law in the restart file, or -1
  std::vector<int> size_in_file;    // state variables of each law in the restart file
  // of the per-atom output from SZZ on: the state variable of each column, and its place in a row, -1 where a law has none
  std::vector<std::string> state_columns = {"out_of_plane_stress", "plastic_strain"};
  std::vector<std::vector<int>> place_of_law;

  double *memory_of(int i) { return memory.data() + (std::size_t) i * layout.width(); }
  int num_columns() const { return SZZ + (int) state_columns.size(); }

  /// Which state variables the laws have, and which of them are columns of the output.
  void lay_out_memory(LAMMPS *lmp, const std::string &id)
  {
    for (const MpmModel &model : settings.models)
      law_of_model.push_back(
          layout.add(model.word, model.law ? model.law->state_variables() : mpm::StateVariables()));
    for (const std::string &name : settings.columns) {
      rve::Words known;
      std::string unit;
      for (int law = 0; law < layout.num_laws(); law++)
        for (const mpm::StateVariable &variable : layout.variables(law)) {
          if (std::find(known.begin(), known.end(), variable.name) == known.end())
            known.emplace_back(variable.name);
          if (variable.name == name) unit = variable.unit;
        }
      if (std::find(known.begin(), known.end(), name) == known.end())
        lmp->error->all(FLERR, "Fix mpm column: no model has the state variable '{}'{}", name,
                        known.empty() ? std::string("; the models have none")
                                      : rve::did_you_mean(name, known, "there are"));
      state_columns.push_back(name);
      if (lmp->comm->me == 0)
        utils::logmesg(lmp, "fix mpm {}: column {} is {}{}\n", id, num_columns(), name,
                       unit.empty() ? unit : " [" + unit + "]");
    }
    for (int law = 0; law < layout.num_laws(); law++) {
      place_of_law.emplace_back();
      for (const std::string &name : state_columns)
        place_of_law.back().push_back(layout.place(law, name));
    }
  }

  /// What a law remembers of a point that had another one, or none.
  void begin_memory(int i)
  {
    remembering[i] = law_of_model[model[i]];
    std::fill_n(memory_of(i), layout.width(), 0.0);
    if (const auto &law = settings.models[model[i]].law) law->begin_memory(stress[i], memory_of(i));
  }

  // made anew whenever they are needed: they follow from groups
  std::vector<std::int64_t> id;
  std::vector<int> model, body;

  /// The arrays that only a device has changed are those of the last step again.
  void bring_back(const Atom *atom) { solver->fetch(points(atom)); }

  /// Somebody will change points, their number or their order.
  void take_over(const Atom *atom)
  {
    bring_back(atom);
    solver->points_changed();
  }

  /// With the first `num_memory` doubles of its row of memory.
  int pack(int i, double *buf, int num_memory)
  {
    int m = 0;
    for_each_array([&](auto &array) {
      memcpy(buf + m, &array[i], sizeof(array[i]));
      m += sizeof(array[i]) / sizeof(double);
    });
    std::copy_n(memory_of(i), num_memory, buf + m);
    return m + num_memory;
  }

  int unpack(int i, const double *buf, int num_memory)
  {
    int m = 0;
    for_each_array([&](auto &array) {
      memcpy(&array[i], buf + m, sizeof(array[i]));
      m += sizeof(array[i]) / sizeof(double);
    });
    std::copy_n(buf + m, num_memory, memory_of(i));
    return m + num_memory;
  }

  // without its row of memory
  static constexpr int DOUBLES = (2 * sizeof(Vec2) + 3 * sizeof(Tensor2)) / sizeof(double) + 4;
  static_assert(RESTART_VERSION == 6 && DOUBLES == 20, "restart files change: raise their version");

  /// State variables that a point has now.
  int num_remembered(int i) const
  {
    return remembering[i] == NO_LAW ? 0 : (int) layout.variables((int) remembering[i]).size();
  }

  /// Wall time so far in calls of the engine of RVEs, and in models that are RVEs [seconds].
  struct ModelTimes {
    double engine = 0.0, models = 0.0;
  };
  ModelTimes model_times() const
  {
    ModelTimes times;
    for (std::size_t k = 0; k < grains.size(); k++) {
      if (!grains[k]) continue;
      times.models += solver->model_time((int) k);
      // groups may share a fix
      if (std::find(grains.begin(), grains.begin() + k, grains[k]) == grains.begin() + k)
        times.engine += grains[k]->engine_time();
    }
    return times;
  }

  // fix rve speaks of the progress of scenes with grains, and of its RVEs
  bool has_grains() const
  {
    return std::any_of(grains.begin(), grains.end(), [](const FixRve *some) {
      return some != nullptr;
    });
  }

  /// Of the positions of all points, in no order.
  static std::uint64_t sum_of_positions(const Atom *atom, MPI_Comm world)
  {
    std::uint64_t sum = 0;
    for (int i = 0; i < atom->nlocal; i++) {
      rve::Checksum one;
      one.add(&atom->tag[i], sizeof(tagint));
      one.add(atom->x[i], 2 * sizeof(double));
      sum += one.value();
    }
    MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_UINT64_T, MPI_SUM, world);
    return sum;
  }

  void find_members(const Atom *atom)
  {
    const int nlocal = atom->nlocal;
    id.resize(nlocal);
    model.resize(nlocal);
    body.resize(nlocal);
    const rve::LightWork work(nlocal, settings.options.threads);
#pragma omp parallel for num_threads(work.team)
    for (int i = 0; i < nlocal; i++) {
      id[i] = atom->tag[i];
      model[i] = body[i] = -1;
      for (int k = 0; k < (int) settings.models.size(); k++)
        if (atom->mask[i] & settings.models[k].groupbit) model[i] = k;
      for (int k = 0; k < (int) settings.bodies.size(); k++)
        if (atom->mask[i] & settings.bodies[k].groupbit) body[i] = k;
      // groups change between runs, and dynamic ones in a run
      if (body[i] < 0 && model[i] >= 0 && volume0[i] > 0.0 &&
          remembering[i] != law_of_model[model[i]])
        begin_memory(i);
    }
  }

  mpm::PointView<2> points(const Atom *atom)
  {
    mpm::PointView<2> view;
    view.count = atom->nlocal;
    view.memory_width = layout.width();
    view.id = id.data();
    if (view.count) {
      view.position = {&atom->x[0][0]};
      view.velocity = {&atom->v[0][0]};
      view.body_force = {&atom->f[0][0]};
    }
    view.mass = mass.data();
    view.volume = volume.data();
    view.initial_volume = volume0.data();
    view.half_size = half_size.data();
    view.deformation_gradient = deformation_gradient.data();
    view.stress = stress.data();
    view.memory = memory.data();
    view.velocity_gradient = velocity_gradient.data();
    view.model = model.data();
    view.rigid_body = body.data();
    return view;
  }
};

/* ---------------------------------------------------------------------- */

FixMpm::FixMpm(LAMMPS *lmp, int narg, char **arg) : Fix(lmp, narg, arg), impl(nullptr)
{
  if (domain->dimension != 2) error->all(FLERR, "Fix mpm requires dimension 2");
  require_mechanical_units(lmp, "Fix mpm");
  if (domain->xperiodic || domain->yperiodic)
    error->all(FLERR, "Fix mpm requires boundary f, s or m in x and y: its grid is not periodic");
  if (atom->tag_enable == 0) error->all(FLERR, "Fix mpm requires atom IDs");

  // an error in here ends the constructor, and then nobody calls the destructor
  auto made = std::make_unique<Impl>();
  made->settings = MpmSettings::parse(lmp, narg, arg);
  const Tensor2 &stress = made->settings.initial_stress;
  const auto &models = made->settings.models;
  std::string doubt;
  for (const MpmModel &model : models)
    if (model.law && doubt.empty()) doubt = model.law->doubt_about(stress);
  if (!doubt.empty() && comm->me == 0)
    error->warning(FLERR, "Fix mpm {}: the initial stress {:g} {:g} {}", id, stress(0, 0),
                   stress(1, 1), doubt);
  made->lay_out_memory(lmp, id);

  time_integrate = 1;
  scalar_flag = vector_flag = peratom_flag = 1;
  global_freq = peratom_freq = 1;
  extscalar = extvector = 0;
  size_peratom_cols = made->num_columns();
  restart_peratom = restart_global = 1;
  create_attribute = 1;
  maxexchange = Impl::DOUBLES + made->layout.width() + made->num_columns();

  try {
    mpm::Communication communication;
    const MPI_Comm ranks = world;
    communication.sum_over_ranks = [ranks](std::int64_t *data, std::size_t count) {
      MPI_Allreduce(MPI_IN_PLACE, data, (int) count, MPI_INT64_T, MPI_SUM, ranks);
    };
    communication.ranks = comm->nprocs;
    communication.rank = comm->me;
    communication.max_over_ranks = [ranks](double *data, std::size_t count) {
      MPI_Allreduce(MPI_IN_PLACE, data, (int) count, MPI_DOUBLE, MPI_MAX, ranks);
    };
    std::string notice;
    made->solver =
        std::make_unique<mpm::MpmSolver<2>>(made->settings.options, communication, &notice);
    if (comm->me == 0) {
      utils::logmesg(lmp, "fix mpm {}: {}\n", id, made->solver->description());
      if (!notice.empty()) utils::logmesg(lmp, "fix mpm {}: {}\n", id, notice);
    }
  } catch (const std::exception &problem) {
    error->all(FLERR, "Fix mpm: {}", problem.what());
  }
  made->progress = std::make_unique<Progress>(lmp, fmt::format("fix mpm {}", id),
                                              made->settings.progress_interval);
  impl = made.release();
  impl->body_displacement.assign(impl->settings.bodies.size(), Vec2::zero());
  size_vector = HEAD + PER_BODY * (int) impl->settings.bodies.size() + TIMES + DAMPING;

  FixMpm::grow_arrays(atom->nmax);
  for (int i = 0; i < atom->nlocal; i++) FixMpm::set_arrays(i);
  atom->add_callback(Atom::GROW);
  atom->add_callback(Atom::RESTART);
}

/* ---------------------------------------------------------------------- */

FixMpm::~FixMpm()
{
  atom->delete_callback(id, Atom::GROW);
  atom->delete_callback(id, Atom::RESTART);
  memory->destroy(impl->output);
  delete impl;
}

/* ---------------------------------------------------------------------- */

int FixMpm::setmask()
{
  return PRE_FORCE | FINAL_INTEGRATE | POST_RUN;    // PRE_FORCE for setup_pre_force() only
}

/* ----------------------------------------------------------------------
   whatever the script may have defined after this fix
------------------------------------------------------------------------- */

void FixMpm::init()
{
  if (update->whichflag == 2)
    error->all(FLERR, "Fix mpm cannot be used with minimize: its points have no energy");
  if (utils::strmatch(update->integrate_style, "^respa"))
    error->all(FLERR, "Fix mpm does not support run_style respa");
  if (input->command && strcmp(input->command, "rerun") == 0)
    error->all(
        FLERR,
        "Fix mpm cannot be used with rerun: strains and stresses of points follow from their "
        "whole history, which positions in a dump do not have");

  settle_without_pairs(lmp);
  const bigint members = group->count(igroup);
  if (members == 0) error->all(FLERR, "Fix mpm: group '{}' has no atoms", group->names[igroup]);
  if (members != atom->natoms)
    error->all(FLERR, "Fix mpm needs all atoms in its group; {} of {} are not in '{}'",
               atom->natoms - members, atom->natoms, group->names[igroup]);

  for (const auto &other : modify->get_fix_list()) {
    if (other == this || group->count(other->igroup) == 0) continue;
    // a fix rve moves no atoms
    if (other->time_integrate && !dynamic_cast<FixRve *>(other))
      error->all(FLERR, "Fix mpm: fix {} (style {}) integrates the same atoms", other->id,
                 other->style);
    if (other->box_change & ~BOX_CHANGE_DOMAIN)
      error->all(
          FLERR,
          "Fix mpm: fix {} (style {}) changes the box and moves atoms with it, which the strains "
          "of material points would not know of; deform the material by boundary, rigid or "
          "traction",
          other->id, other->style);
    if (utils::strmatch(other->style, "^setforce") || utils::strmatch(other->style, "^freeze"))
      error->all(
          FLERR,
          "Fix mpm: fix {} (style {}) acts on material points, but forces do not hold a continuum; "
          "prescribe its velocity with the keyword rigid or boundary of fix mpm",
          other->id, other->style);
  }

  impl->settings.find(lmp);
  std::vector<mpm::Constitutive<2> *> laws;
  impl->grains.clear();
  for (const MpmModel &model : impl->settings.models) {
    impl->grains.push_back(nullptr);
    if (!model.law) {
      auto *found = modify->get_fix_by_id(model.fix_rve);
      if (!found) error->all(FLERR, "Fix mpm model: fix '{}' does not exist", model.fix_rve);
      impl->grains.back() = dynamic_cast<FixRve *>(found);
      if (!impl->grains.back())
        error->all(FLERR, "Fix mpm model: fix '{}' must be of style rve, got {}", model.fix_rve,
                   found->style);
    }
    laws.push_back(model.law ? model.law.get() : impl->grains.back()->constitutive());
  }
  impl->solver->set_models(laws);
  impl->warned = false;
}

/* ----------------------------------------------------------------------
   between runs: what others did to the points, and what the script says of them
------------------------------------------------------------------------- */

void FixMpm::check_positions()
{
  if (impl->points_then != atom->natoms ||
      impl->positions_then == Impl::sum_of_positions(atom, world))
    return;
  const double box[] = {domain->boxlo[0], domain->boxhi[0], domain->boxlo[1], domain->boxhi[1]};
  if (!std::equal(box, box + 4, impl->box_then))
    error->all(
        FLERR,
        "Fix mpm: points and box have been changed since the last run, by change_box with remap "
        "perhaps; strains and stresses of the points do not know of that. Change the box without "
        "remap, or before the fix is defined");
  if (comm->me == 0)
    error->warning(FLERR,
                   "Fix mpm {}: points have been moved since the last run; their displacements "
                   "include that, their strains and stresses do not",
                   id);
}

void FixMpm::check_overlap()
{
  if (impl->said_overlap) return;
  bigint several[2] = {0, 0};    // points of more than one model, or body
  for (int i = 0; i < atom->nlocal; i++) {
    int models = 0, bodies = 0;
    for (const MpmModel &model : impl->settings.models)
      if (atom->mask[i] & model.groupbit) models++;
    for (const MpmRigidBody &body : impl->settings.bodies)
      if (atom->mask[i] & body.groupbit) bodies++;
    if (bodies > 1) several[1]++;
    if (bodies == 0 && models > 1) several[0]++;
  }
  MPI_Allreduce(MPI_IN_PLACE, several, 2, MPI_LMP_BIGINT, MPI_SUM, world);
  for (int k = 0; k < 2; k++)
    if (several[k] > 0 && comm->me == 0)
      error->warning(
          FLERR,
          "Fix mpm {}: {} points are in the groups of more than one {}; the last one in the "
          "fix counts",
          id, several[k], k == 0 ? "model" : "rigid body");
  impl->said_overlap = several[0] + several[1] > 0;
}

/* ----------------------------------------------------------------------
   boxes of points that do not overlap fill no cell more than once: looked at where new points are, beside each other or on top of those
   that were there
------------------------------------------------------------------------- */

void FixMpm::check_area(const std::vector<int> &made)
{
  bigint total = made.size();
  MPI_Allreduce(MPI_IN_PLACE, &total, 1, MPI_LMP_BIGINT, MPI_SUM, world);
  if (total == 0) return;
  const mpm::Grid<2> &grid = impl->solver->grid();
  const double h = grid.cell_size();
  const std::size_t num_cells = (std::size_t) grid.cells(0) * grid.cells(1);
  std::vector<double> filled(2 * num_cells, 0.0);    // shares of cells: by new points, and by all
  const auto fill = [&](int i, std::size_t from) {
    // a deformed box has the area of its point, and its sides the ratio of the stretches along the axes
    const Tensor2 &f = impl->deformation_gradient[i];
    const Vec2 &half = impl->half_size[i];
    const double boxed = 4.0 * half[0] * half[1] * std::fabs(f(0, 0) * f(1, 1));
    const double scale = boxed > 0.0 ? std::sqrt(impl->volume[i] / boxed) : 0.0;
    int first[2], last[2];
    double low[2], high[2];
    for (int a = 0; a < 2; a++) {
      const double extent = scale * half[a] * std::fabs(f(a, a));
      low[a] = grid.scaled(atom->x[i][a] - extent, a);
      high[a] = grid.scaled(atom->x[i][a] + extent, a);
      if (!(std::fabs(low[a]) < 1e7 && std::fabs(high[a]) < 1e7)) low[a] = high[a] = -2.0;
      first[a] = std::max(0, (int) std::floor(low[a]));
      last[a] = std::min(grid.cells(a) - 1, (int) std::floor(high[a]));
    }
    for (int row = first[1]; row <= last[1]; row++)
      for (int column = first[0]; column <= last[0]; column++)
        filled[from + (std::size_t) row * grid.cells(0) + column] +=
            std::max(0.0, std::min(high[0], column + 1.0) - std::max(low[0], (double) column)) *
            std::max(0.0, std::min(high[1], row + 1.0) - std::max(low[1], (double) row));
  };
  for (const int i : made) fill(i, 0);
  bigint deformable = 0;
  for (int i = 0; i < atom->nlocal; i++) {
    if (impl->body[i] >= 0) continue;
    fill(i, num_cells);
    deformable++;
  }
  MPI_Allreduce(MPI_IN_PLACE, filled.data(), (int) filled.size(), MPI_DOUBLE, MPI_SUM, world);
  MPI_Allreduce(MPI_IN_PLACE, &deformable, 1, MPI_LMP_BIGINT, MPI_SUM, world);
  bigint cells = 0, over = 0;
  double fullest = 0.0;
  for (std::size_t k = 0; k < num_cells; k++) {
    const double by_new = filled[k], by_all = filled[num_cells + k];
    if (!(by_new > 1e-6)) continue;
    cells++;
    // what old points alone have too much of is not the new ones' doing
    if (!(by_all > FULL && by_new > FULL - 1.0)) continue;
    over++;
    fullest = std::max(fullest, by_all);
  }
  if (over == 0) return;
  const bool are_all_new = total == deformable;
  const std::string text = fmt::format(
      "{} of {} cells that {}points fill, {} by {} [distance] each, have more than {} "
      "times their area in points, the fullest {:.3g} times. They are too heavy and "
      "too stiff by that factor. Each new point has the area {} [distance^2]: give the "
      "right one with points_per_cell or volume, and look for points that were made "
      "twice{}",
      over, cells, are_all_new ? "" : "new ", h, h, FULL, fullest, impl->settings.initial_volume,
      are_all_new ? "" : " or on top of those that were there");
  if (are_all_new && 2 * over > cells) error->all(FLERR, "Fix mpm: {}", text);
  if (comm->me == 0) error->warning(FLERR, "Fix mpm {}: {}", id, text);
}

/* ----------------------------------------------------------------------
   makes material points of new atoms: all other fixes are initialized, and fix gravity has not yet asked for the masses
------------------------------------------------------------------------- */

void FixMpm::setup_pre_force(int)
{
  check_positions();
  check_overlap();
  impl->find_members(atom);
  impl->take_over(atom);
  std::vector<int> made;
  for (int i = 0; i < atom->nlocal; i++) {
    const bool rigid = impl->body[i] >= 0;
    if (!rigid && impl->model[i] < 0)
      error->one(FLERR, "Fix mpm: atom {} has no constitutive model; see the keyword model",
                 atom->tag[i]);
    const FixRve *grains = rigid ? nullptr : impl->grains[impl->model[i]];
    if (grains && grains->slot(i) < 0)
      error->one(FLERR, "Fix mpm: atom {} has no RVE of fix {}; is it in its group?", atom->tag[i],
                 grains->id);
    if (impl->volume0[i] == 0.0) {
      const double half = 0.5 * std::sqrt(impl->settings.initial_volume);
      if (!rigid) made.push_back(i);
      impl->reference[i] = {{atom->x[i][0], atom->x[i][1]}};
      impl->half_size[i] = {{half, half}};
      impl->volume0[i] = impl->volume[i] = impl->settings.initial_volume;
      impl->deformation_gradient[i] = Tensor2::identity();
      impl->velocity_gradient[i] = Tensor2::zero();
      impl->stress[i] = rigid ? Tensor2::zero()
          : grains            ? stress_of(*grains, i)
                              : impl->settings.initial_stress;
      if (!rigid) impl->begin_memory(i);
      if (impl->settings.density > 0.0)
        impl->mass[i] = impl->settings.density * impl->settings.initial_volume;
      else if (grains)
        impl->mass[i] = grains->bulk_density(i) * impl->settings.initial_volume;
      else if (rigid)
        impl->mass[i] = atom->rmass ? atom->rmass[i] : atom->mass[atom->type[i]];
      else
        error->one(FLERR,
                   "Fix mpm: atom {} has no RVE, so the keyword density must give a value > 0",
                   atom->tag[i]);
    }
    if (atom->rmass)
      atom->rmass[i] = impl->mass[i];
    else if (!rigid && std::fabs(atom->mass[atom->type[i]] / impl->mass[i] - 1.0) > 1e-6)
      error->one(FLERR,
                 "Fix mpm: atom {} has mass {} = density * volume, but type {} has {} and fix "
                 "gravity would use that; "
                 "use atom_style sphere, or set it with the mass command",
                 atom->tag[i], impl->mass[i], atom->type[i], atom->mass[atom->type[i]]);
  }
  check_area(made);
  // other fixes and the variables of this one may read the columns before setup() is through
  fill_output();
}

void FixMpm::setup(int)
{
  check_courant();
  check_time_step();
  solve(false);
  if (!impl->has_grains()) impl->progress->begin();
}

void FixMpm::final_integrate()
{
  const double start = platform::walltime();
  if (update->ntimestep == update->firststep + 1) {
    std::fill_n(impl->times, (int) TIMES, 0.0);
    impl->damping_sum = impl->reaction_sum = 0.0;
  }
  const Impl::ModelTimes before = impl->model_times();
  const double copied = impl->solver->transfer_time();
  if (update->ntimestep % COURANT_EVERY == 0) check_courant();
  // the next check will see the RVEs as this step leaves them
  if ((update->ntimestep + 1) % COURANT_EVERY == 0)
    for (FixRve *grains : impl->grains)
      if (grains) grains->expect_look();
  solve(true);
  impl->output_is_old = true;
  if (update->ntimestep % DAMPING_EVERY == 0) look_at_damping();
  const double solved = platform::walltime();
  const double copied_in_step = impl->solver->transfer_time() - copied;
  if (state_may_be_read(lmp)) fill_output();
  const double filled = platform::walltime();
  const Impl::ModelTimes after = impl->model_times();
  const double engine = after.engine - before.engine;
  const double models = after.models - before.models;
  const double whole = filled - start;
  // columns, copies from and to a device, and what stands between points and RVEs
  const double transfers = filled - solved + copied_in_step + models - engine;
  impl->times[TIME_RVE] += engine;
  impl->times[TIME_TRANSFERS] += transfers;
  impl->times[TIME_MPM] += whole - transfers - engine;
  if (!impl->has_grains()) impl->progress->step_done();
}

/* ----------------------------------------------------------------------
   the run may have ended before its last step
------------------------------------------------------------------------- */

void FixMpm::post_run()
{
  if (impl->output_is_old) fill_output();
  tell_damping();
  impl->points_then = atom->natoms;
  impl->positions_then = Impl::sum_of_positions(atom, world);
  const double box[] = {domain->boxlo[0], domain->boxhi[0], domain->boxlo[1], domain->boxhi[1]};
  std::copy_n(box, 4, impl->box_then);
  report_times();
  if (!impl->has_grains()) impl->progress->end();
}

/* ---------------------------------------------------------------------- */

void FixMpm::report_times() const
{
  double all[] = {impl->times[TIME_RVE], impl->times[TIME_MPM], impl->times[TIME_TRANSFERS],
                  timer->get_wall(Timer::OUTPUT), timer->get_wall(Timer::TOTAL)};
  MPI_Allreduce(MPI_IN_PLACE, all, 5, MPI_DOUBLE, MPI_SUM, world);
  for (double &time : all) time /= comm->nprocs;
  const double total = all[4];
  if (comm->me != 0 || total < LONG_RUN || update->nsteps == 0) return;
  const double per_step = 1e3 / update->nsteps;
  utils::logmesg(lmp,
                 "fix mpm {}: wall time {:.2f} s; per step [ms]: RVE {:.3f}, MPM {:.3f}, transfers "
                 "{:.3f}, LAMMPS {:.3f}, output {:.3f}\n",
                 id, total, per_step * all[TIME_RVE], per_step * all[TIME_MPM],
                 per_step * all[TIME_TRANSFERS],
                 per_step * (total - all[0] - all[1] - all[2] - all[3]), per_step * all[3]);
}

void FixMpm::check_time_step()
{
  if (comm->me != 0 || update->nsteps == 0 || impl->courant >= COURANT_SMALL) return;
  error->warning(
      FLERR,
      "Fix mpm {}: the Courant number is {:.2g}, so that the {} steps of this run take the "
      "fastest wave through {:.2g} cells. The time step is {} [time]{}; {:.2g} has a Courant "
      "number of 0.5",
      id, impl->courant, update->nsteps, impl->courant * update->nsteps, update->dt,
      update->dt_default ? ", the default of LAMMPS: set it with the command timestep" : "",
      impl->courant > 0.0 ? 0.5 * update->dt / impl->courant : 0.0);
}

/* ----------------------------------------------------------------------
   local damping is a force on the nodes whose sum no reaction holds: how large it is beside them
------------------------------------------------------------------------- */

void FixMpm::look_at_damping()
{
  if (!(impl->settings.options.damping > 0.0)) return;
  const auto magnitude = [](const Vec2 &force) {
    return std::hypot(force[0], force[1]);
  };
  double largest = 0.0;
  for (int b = 0; b < (int) impl->settings.bodies.size(); b++)
    largest = std::max(largest, magnitude(impl->solver->body_reaction(b)));
  for (const Face side : {Face::XLo, Face::XHi, Face::YLo, Face::YHi})
    if (impl->settings.options.sides[(int) side] != mpm::SideKind::Free)
      largest = std::max(largest, magnitude(impl->solver->side_reaction(side)));
  impl->damping_sum += magnitude(impl->solver->damping_force());
  impl->reaction_sum += largest;
}

void FixMpm::tell_damping()
{
  if (comm->me != 0 || !(impl->reaction_sum > 0.0)) return;
  const double share = impl->damping_sum / impl->reaction_sum;
  const std::string text = fmt::format(
      "local damping {} amounts to {:.2g} % of the largest reaction, in the mean of this "
      "run: reactions on two sides of the material differ by as much",
      impl->settings.options.damping, 100.0 * share);
  // once; later runs say their own number
  if (share > DAMPING_WARN && !impl->warned_damping) {
    impl->warned_damping = true;
    error->warning(FLERR,
                   "Fix mpm {}: {}. f_{}[{}] and f_{}[{}] are its force; use less damping, or none",
                   id, text, id, size_vector - 1, id, size_vector);
  } else
    utils::logmesg(lmp, "fix mpm {}: {}\n", id, text);
}

/* ----------------------------------------------------------------------
   one call of the solver: a step, or an evaluation that advances nothing
------------------------------------------------------------------------- */

void FixMpm::solve(bool advance)
{
  impl->find_members(atom);
  modify->clearstep_compute();
  impl->loads.resize(impl->settings.tractions.size());
  for (std::size_t k = 0; k < impl->loads.size(); k++) {
    const MpmTraction &traction = impl->settings.tractions[k];
    mpm::TractionLoad<2> &load = impl->loads[k];
    load.point_index.clear();
    load.traction = {{traction.traction[0].evaluate(lmp), traction.traction[1].evaluate(lmp)}};
    load.face = traction.face;
    Region *region = traction.groupbit ? nullptr : domain->get_region_by_id(traction.id);
    if (region) region->prematch();
    for (int i = 0; i < atom->nlocal; i++) {
      const double *x = atom->x[i];
      if (region ? impl->body[i] < 0 && region->match(x[0], x[1], x[2])
                 : atom->mask[i] & traction.groupbit)
        load.point_index.push_back(i);
    }
    if (advance || traction.groupbit) continue;
    bigint loaded = load.point_index.size();
    MPI_Allreduce(MPI_IN_PLACE, &loaded, 1, MPI_LMP_BIGINT, MPI_SUM, world);
    if (loaded == 0 && comm->me == 0)
      error->warning(
          FLERR,
          "Fix mpm {}: the region '{}' of a traction has no deformable points at step {}: the "
          "traction acts on nothing",
          id, traction.id, update->ntimestep);
  }

  try {
    for (std::size_t b = 0; b < impl->settings.bodies.size(); b++) {
      const Vec2 velocity = {{impl->settings.bodies[b].velocity[0].evaluate(lmp),
                              impl->settings.bodies[b].velocity[1].evaluate(lmp)}};
      impl->solver->set_body_velocity((int) b, velocity);
      if (advance) impl->body_displacement[b] = impl->body_displacement[b] + update->dt * velocity;
    }
    modify->addstep_compute(update->ntimestep + 1);
    if (advance)
      impl->solver->step(impl->points(atom), impl->loads, update->dt);
    else
      impl->solver->evaluate(impl->points(atom), impl->loads, update->dt);
  } catch (const LAMMPSException &) {
    throw;    // an error of fix rve says all there is to say
  } catch (const std::exception &problem) {
    error->one(FLERR, "Fix mpm, step {}: {}", update->ntimestep,
               problem.what());    // perhaps on one rank only
  }
}

/* ---------------------------------------------------------------------- */

void FixMpm::fill_output()
{
  impl->bring_back(atom);
  const rve::LightWork work(atom->nlocal, impl->settings.options.threads);
#pragma omp parallel for num_threads(work.team)
  for (int i = 0; i < atom->nlocal; i++) {
    double *row = array_atom[i];
    const Tensor2 &sigma = impl->stress[i];
    const Tensor2 &F = impl->deformation_gradient[i];
    row[UX] = atom->x[i][0] - impl->reference[i][0];
    row[UY] = atom->x[i][1] - impl->reference[i][1];
    row[U] = std::hypot(row[UX], row[UY]);
    row[SXX] = sigma(0, 0);
    row[SYY] = sigma(1, 1);
    row[SXY] = 0.5 * (sigma(0, 1) + sigma(1, 0));
    row[P] = -0.5 * (sigma(0, 0) + sigma(1, 1));
    row[Q] = std::hypot(0.5 * (sigma(0, 0) - sigma(1, 1)), row[SXY]);
    // equations (26), (27) of Zhao, Zhao & Liang 2021 in the plane: engineering strain from F
    row[EPS_V] = F(0, 0) + F(1, 1) - 2.0;
    row[EPS_Q] = std::hypot(F(0, 0) - F(1, 1), F(0, 1) + F(1, 0));
    row[RHO] = impl->mass[i] / impl->volume[i];
    for (int k = 0; k < 4; k++) row[FXX + k] = F(k / 2, k % 2);
    const bool remembers = impl->body[i] < 0 && impl->remembering[i] != NO_LAW;
    for (std::size_t k = 0; k < impl->state_columns.size(); k++) {
      const int place = remembers ? impl->place_of_law[(int) impl->remembering[i]][k] : -1;
      row[SZZ + k] = place < 0 ? 0.0 : impl->memory_of(i)[place];
    }
  }
  impl->output_is_old = false;
}

/* ---------------------------------------------------------------------- */

void FixMpm::check_courant()
{
  impl->find_members(atom);
  try {
    impl->courant = impl->solver->cfl_number(impl->points(atom), update->dt);
  } catch (const LAMMPSException &) {
    throw;
  } catch (const std::exception &problem) {
    error->one(FLERR, "Fix mpm, step {}: {}", update->ntimestep, problem.what());
  }
  const double limit = impl->settings.courant_error;
  if (impl->courant > limit)
    error->all(FLERR,
               "Fix mpm, step {}: Courant number {:.4g} from the present stiffness exceeds {}; the "
               "time step {} must be "
               "below {:.4g} [time]",
               update->ntimestep, impl->courant, limit, update->dt,
               update->dt * limit / impl->courant);
  if (impl->courant > impl->settings.courant_warn && !impl->warned) {
    if (comm->me == 0)
      error->warning(FLERR,
                     "Fix mpm, step {}: Courant number {:.4g} from the present stiffness, above "
                     "{}; error above {}",
                     update->ntimestep, impl->courant, impl->settings.courant_warn, limit);
    impl->warned = true;
  }
}

/* ---------------------------------------------------------------------- */

double FixMpm::compute_scalar()
{
  return impl->courant;
}

double FixMpm::compute_vector(int n)
{
  if (n == UNBALANCED) return impl->solver->max_unbalanced_force();
  if (n == COURANT) return impl->courant;
  if (n == KINETIC || n == MASS) {
    impl->find_members(atom);
    const mpm::Totals<2> totals = impl->solver->totals(impl->points(atom));
    return n == MASS ? totals.mass : totals.kinetic_energy;
  }
  const int behind_bodies = n - HEAD - PER_BODY * (int) impl->settings.bodies.size();
  if (behind_bodies >= TIMES) return impl->solver->damping_force()[behind_bodies - TIMES];
  if (behind_bodies >= 0) {
    double longest;
    MPI_Allreduce(&impl->times[behind_bodies], &longest, 1, MPI_DOUBLE, MPI_MAX, world);
    return longest;
  }
  const int body = (n - HEAD) / PER_BODY;
  const int what = (n - HEAD) % PER_BODY;
  if (what <= REACTION_Y) return impl->solver->body_reaction(body)[what - REACTION_X];
  return impl->body_displacement[body][what - BODY_UX];
}

bool FixMpm::reads_results() const
{
  const auto reads = [&](const ScriptValue &value) {
    return !value.variable.empty() && may_read_results(lmp, value.variable);
  };
  for (const MpmRigidBody &body : impl->settings.bodies)
    if (reads(body.velocity[0]) || reads(body.velocity[1])) return true;
  for (const MpmTraction &load : impl->settings.tractions) {
    if (reads(load.traction[0]) || reads(load.traction[1])) return true;
    // one that moves or changes its shape does so by variables
    const Region *region = load.groupbit ? nullptr : domain->get_region_by_id(load.id);
    if (region && (region->dynamic || region->varshape)) return true;
  }
  return false;
}

double FixMpm::memory_usage()
{
  const auto nodes = (double) impl->solver->grid().node_count();
  return sizeof(double) * ((double) atom->nmax * maxexchange + 20.0 * nodes);
}

/* ----------------------------------------------------------------------
   per-atom state: memory, reordering, exchange, restart
------------------------------------------------------------------------- */

void FixMpm::grow_arrays(int nmax)
{
  impl->for_each_array([=](auto &array) {
    array.resize(nmax);
  });
  impl->memory.resize((std::size_t) nmax * impl->layout.width());
  memory->grow(impl->output, nmax, size_peratom_cols, "fix mpm:output");
  array_atom = impl->output;
}

void FixMpm::copy_arrays(int i, int j, int /*delflag*/)
{
  impl->take_over(atom);
  impl->for_each_array([=](auto &array) {
    array[j] = array[i];
  });
  std::copy_n(impl->memory_of(i), impl->layout.width(), impl->memory_of(j));
  std::copy_n(array_atom[i], size_peratom_cols, array_atom[j]);
}

void FixMpm::set_arrays(int i)
{
  impl->take_over(atom);
  impl->volume0[i] = impl->volume[i] = 0.0;
  impl->remembering[i] = NO_LAW;
  std::fill_n(array_atom[i], size_peratom_cols, 0.0);
}

int FixMpm::pack_exchange(int i, double *buf)
{
  impl->take_over(atom);
  // with its columns: variables may read them before the step ends
  const int m = impl->pack(i, buf, impl->layout.width());
  std::copy_n(array_atom[i], size_peratom_cols, buf + m);
  return m + size_peratom_cols;
}

int FixMpm::unpack_exchange(int i, double *buf)
{
  impl->take_over(atom);
  const int m = impl->unpack(i, buf, impl->layout.width());
  std::copy_n(buf + m, size_peratom_cols, array_atom[i]);
  return m + size_peratom_cols;
}

int FixMpm::pack_restart(int i, double *buf)
{
  impl->bring_back(atom);
  const int size = size_restart(i);
  buf[0] = size;    // how far other fixes skip
  buf[1] = (double) update->ntimestep;
  impl->pack(i, buf + 2, impl->num_remembered(i));
  buf[size - 1] = sum_of(buf, size - 1);
  return size;
}

void FixMpm::unpack_restart(int i, int nth)
{
  impl->take_over(atom);
  const auto [extra, size] = restart_record(lmp, "Fix mpm", i, nth, 1);
  const auto damaged = [&](const std::string &how) {
    error->one(
        FLERR,
        "Fix mpm: the record of atom {} in the restart file is damaged: {}. Use an earlier file",
        atom->tag[i], how);
  };
  if (!is_same_sum(extra[size - 1], sum_of(extra, size - 1)))
    damaged("its checksum is not that of its numbers");
  if (size < 3 + Impl::DOUBLES)
    damaged(fmt::format("it has {} numbers, not {}", size, 3 + Impl::DOUBLES));
  if (extra[1] != impl->restart_step)
    error->one(FLERR,
               "Fix mpm: atom {} is of step {}, the head of the restart files of step {}: they "
               "were not written at once. Use those before",
               atom->tag[i], extra[1], impl->restart_step);
  impl->unpack(i, extra + 2, 0);
  double &law = impl->remembering[i];
  int num_memory = 0;
  if (law != NO_LAW) {
    if (!(law >= 0.0 && law < (double) impl->law_of_file.size()))
      damaged(fmt::format("it is of law number {}", law));
    const auto in_file = (std::size_t) law;
    num_memory = impl->size_in_file[in_file];
    law = impl->law_of_file[in_file];
  }
  if (size != 3 + Impl::DOUBLES + num_memory)
    damaged(fmt::format("it has {} numbers, not {}", size, 3 + Impl::DOUBLES + num_memory));
  // what another law remembered is of no use
  if (law != NO_LAW) std::copy_n(extra + 2 + Impl::DOUBLES, num_memory, impl->memory_of(i));
}

int FixMpm::size_restart(int i)
{
  return 3 + Impl::DOUBLES + impl->num_remembered(i);    // size, step, the point, checksum
}

int FixMpm::maxsize_restart()
{
  return 3 + Impl::DOUBLES + impl->layout.width();
}

/* ----------------------------------------------------------------------
   the head: version, numbers in it, their checksum, step, bodies, displacement and velocity of each, what the script
   says and the state variables of each law as lines of text, checksum of all before
------------------------------------------------------------------------- */

void FixMpm::write_restart(FILE *fp)
{
  if (comm->me != 0) return;
  std::string text;
  for (const auto &[about, values] : impl->settings.words) text += about + "\n" + values + "\n";
  for (int k = 0; k < impl->layout.num_laws(); k++)
    text += STATE_OF + impl->layout.word(k) + "\n" + impl->layout.names(k) + "\n";
  std::vector<double> head(HEAD_FIRST);
  const std::size_t bodies = impl->settings.bodies.size();
  head.insert(head.end(), {(double) update->ntimestep, (double) bodies});
  for (std::size_t b = 0; b < bodies; b++) {
    const Vec2 &u = impl->body_displacement[b];
    const Vec2 &v = impl->solver->body_velocity_before((int) b);
    head.insert(head.end(), {u[0], u[1], v[0], v[1]});
  }
  const std::size_t begin = head.size() + 1;
  head.push_back((double) text.size());
  head.resize(begin + (text.size() + sizeof(double) - 1) / sizeof(double), 0.0);
  memcpy(head.data() + begin, text.data(), text.size());
  head.push_back(0.0);    // the checksum
  // negative, because files without a version begin with the number of bodies
  head[0] = -RESTART_VERSION;
  head[1] = (double) head.size();
  head[2] = sum_of(head.data(), 2);
  head.back() = sum_of(head.data(), head.size() - 1);
  const int size = (int) (head.size() * sizeof(double));
  fwrite(&size, sizeof(int), 1, fp);
  fwrite(head.data(), sizeof(double), head.size(), fp);
}

/* ----------------------------------------------------------------------
   the next law in the restart file, by its word, and whether its state variables are those that it has now
------------------------------------------------------------------------- */

void FixMpm::find_law(const std::string &word, const std::string &names)
{
  const int law = impl->layout.find(word);
  if (law >= 0 && names != impl->layout.names(law))
    error->all(FLERR,
               "Fix mpm: the points of law {} in the restart file have the state variables '{}', "
               "and the law has '{}'",
               word, names, impl->layout.names(law));
  impl->law_of_file.push_back(law);
  impl->size_in_file.push_back((int) utils::split_words(names).size());
}

void FixMpm::restart(char *buf)
{
  const auto number = [buf](std::size_t k) {
    double value;    // LAMMPS promises no alignment
    memcpy(&value, buf + k * sizeof(double), sizeof(double));
    return value;
  };
  const double version = number(0);
  if (version != -RESTART_VERSION) {
    // versions before 3 begin with the number of bodies
    if (version == std::floor(version) && std::fabs(version) < 1000.0)
      error->all(
          FLERR,
          "Fix mpm: the points in the restart file have version {}; this fix reads version {}",
          version < 0.0 ? std::to_string((int) -version) : "1 or 2, without a number",
          RESTART_VERSION);
    error->all(FLERR,
               "Fix mpm: the head of the restart file is damaged: it begins with {} instead of the "
               "version {}. Use an earlier file",
               version, -RESTART_VERSION);
  }
  const double first[] = {number(0), number(1)};
  const bool has_length = is_same_sum(number(2), sum_of(first, 2));
  std::vector<double> head(has_length ? (std::size_t) number(1) : 0);
  memcpy(head.data(), buf, head.size() * sizeof(double));
  if (!has_length || !is_same_sum(head.back(), sum_of(head.data(), head.size() - 1)))
    error->all(FLERR,
               "Fix mpm: the head of the restart file is damaged: its checksum is not that of its "
               "numbers. Use an earlier file");

  const double *state = head.data() + HEAD_FIRST;
  impl->restart_step = *state++;
  const auto bodies = (std::size_t) *state++;
  const double *of_body = state;
  state += 4 * bodies;
  const auto length = (std::size_t) *state++;
  std::istringstream text(std::string(reinterpret_cast<const char *>(state), length));
  MpmWords then;
  std::vector<std::string> groups;    // of the bodies
  impl->law_of_file.clear();
  impl->size_in_file.clear();
  for (std::string about, values; std::getline(text, about) && std::getline(text, values);) {
    if (about.rfind(STATE_OF, 0) == 0) {
      find_law(about.substr(STATE_OF.size()), values);
      continue;
    }
    then.emplace_back(about, values);
    if (utils::strmatch(about, "^rigid \\S+$")) groups.push_back(about.substr(strlen("rigid ")));
  }

  // a body is that with the same group
  std::string new_bodies;
  for (std::size_t b = 0; b < impl->settings.bodies.size(); b++) {
    const std::string &group = impl->settings.bodies[b].group;
    const std::size_t k = std::find(groups.begin(), groups.end(), group) - groups.begin();
    if (k >= bodies) {
      new_bodies += (new_bodies.empty() ? "" : ", ") + group;
      continue;
    }
    const double *motion = of_body + 4 * k;
    impl->body_displacement[b] = {{motion[0], motion[1]}};
    impl->solver->set_body_velocity_before((int) b, {{motion[2], motion[3]}});
  }
  if (comm->me != 0) return;
  const std::string other = mpm_differences(then, impl->settings.words, false);
  const std::string kept = mpm_differences(then, impl->settings.words, true);
  if (!other.empty()) error->warning(FLERR, "Fix mpm {} continued with: {}", id, other);
  if (!kept.empty())
    error->warning(FLERR,
                   "Fix mpm {}: the points in the restart file keep what they have; for new points "
                   "only: {}",
                   id, kept);
  if (!new_bodies.empty())
    error->warning(FLERR,
                   "Fix mpm {}: rigid bodies that are not in the restart file begin with the "
                   "displacement 0: {}",
                   id, new_bodies);
}
