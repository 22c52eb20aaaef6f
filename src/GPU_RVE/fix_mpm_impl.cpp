// SPDX-License-Identifier: GPL-2.0-only
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

#include "fix_mpm_impl.h"

#include "lammps/formulas.h"
#include "lammps/rank_resources.h"
#include "lammps/restart_record.h"
#include "lammps/state_readers.h"
#include "mpm/measures.h"
#include "rve/core/checksum.h"
#include "rve/core/error.h"
#include "rve/core/first_error.h"
#include "rve/core/suggestion.h"
#include "rve/core/threads.h"
#include "rve/engine/engine.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "group.h"
#include "memory.h"
#include "modify.h"
#include "neighbor.h"
#include "region.h"
#include "timer.h"
#include "universe.h"
#include "update.h"
#include "variable.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <sstream>
#include <unordered_map>
#include <utility>

using namespace LAMMPS_NS;
using mpm::Face;

namespace {

// Of what restart files hold of points and bodies: raise it with every change of that. Files before version 3 had no number.
constexpr int RESTART_VERSION = 8;

// What a line of the head of a restart file begins with that names the state variables of a law.
const std::string STATE_OF = "state of ";
// What comes before the words of a fix_modify of a model that is not as its fix has defined it. Files have it if there is one.
const std::string MODIFIED = "fix_modify";

// Coordinates beyond this multiple of the extent of the grid have bits that a shift of the origin gives
// back; those of a grid near zero do not.
constexpr double FAR_FROM_ORIGIN = 10.0;
constexpr double ROUNDING_WARN = 0.01;    // largest error of a motion in a step, over the motion

constexpr int COURANT_EVERY = 20;    // steps between two checks of the Courant number
// RVEs have to be looked at for it: behind the steps after which they have been looked at for checks of their own, by default
constexpr int COURANT_OF_GRAINS_EVERY = 100;
// steps between two looks at what local damping takes from reactions
constexpr int DAMPING_EVERY = 50;
constexpr double DAMPING_WARN = 0.01;    // of the largest reaction
// of a side that absorbs waves, over that of its points, or the reverse
constexpr double WRONG_SPEED = 2.0;
// the least speed of waves in RVEs over the bound of their contacts: disks prepared with a friction of 0.5 have 0.54 of the modulus
constexpr double BOUND_OF_GRAINS = 0.73;

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

// below it, in a million steps a wave passes a hundred cells at most
constexpr double COURANT_SMALL = 1e-4;
// area of the points in a cell over that of the cell, above which it is too much
constexpr double FULL = 1.3;

// wall time of a run that is worth a line about its parts [seconds]
constexpr double LONG_RUN = 1.0;

/// In the plane area.
template <int D> constexpr const char *volume_word()
{
  return D == 2 ? "area" : "volume";
}

}    // namespace

std::unique_ptr<FixMpm::Impl> FixMpm::Impl::make(FixMpm *fix, int narg, char **arg)
{
  if (fix->lmp->domain->dimension == 3) return std::make_unique<ImplOf<3>>(fix, narg, arg);
  return std::make_unique<ImplOf<2>>(fix, narg, arg);
}

/* ---------------------------------------------------------------------- */

template <int D> FixMpm::ImplOf<D>::ImplOf(FixMpm *_fix, int narg, char **arg) : Impl(_fix)
{
  static_assert(RESTART_VERSION == 8 && DOUBLES == (D == 2 ? 20 : 37),
                "restart files change: raise their version");
  settings = MpmSettings<D>::parse(lmp, narg, arg);
  const Tensor &initial = settings.initial_stress;
  std::string doubt;
  for (const MpmModel<D> &model : settings.models)
    if (model.law && doubt.empty()) doubt = model.law->doubt_about(initial);
  if (!doubt.empty() && comm->me == 0)
    error->warning(FLERR, "Fix mpm {}: the initial stress {:g} {:g} {}", fix->id, initial(0, 0),
                   initial(1, 1), doubt);
  lay_out_memory();

  fix->size_peratom_cols = num_columns();
  for (int b = 0; b < (int) settings.bodies.size(); b++)
    if (settings.options.rigid_bodies[b].form != mpm::BodyForm::Face) turning.push_back(b);
  fix->size_vector = HEAD + PER_BODY * (int) settings.bodies.size() + TIMES + D +
      PER_TURNING * (int) turning.size();
  fix->maxexchange = DOUBLES + layout.width() + num_columns();

  // its collective calls come after all ranks have agreed that none has failed (raise_on_all)
  std::string notice;
  collectively(lmp, "Fix mpm", [&] {
    solver = std::make_unique<mpm::MpmSolver<D>>(settings.options, communication(), &notice);
  });
  if (comm->me == 0) {
    utils::logmesg(lmp, "fix mpm {}: {}\n", fix->id, solver->description());
    if (!notice.empty()) utils::logmesg(lmp, "fix mpm {}: {}\n", fix->id, notice);
  }
  progress = std::make_unique<Progress>(lmp, fmt::format("fix mpm {}", fix->id),
                                        settings.progress_interval);
  body_displacement.assign(settings.bodies.size(), Vec::zero());
}

template <int D> mpm::Communication FixMpm::ImplOf<D>::communication() const
{
  mpm::Communication communication;
  const MPI_Comm ranks = world;
  communication.sum_over_ranks = [ranks](std::int64_t *data, std::size_t count) {
    MPI_Allreduce(MPI_IN_PLACE, data, (int) count, MPI_INT64_T, MPI_SUM, ranks);
  };
  communication.ranks = comm->nprocs;
  communication.rank = comm->me;
  communication.raise_on_all = [lmp = lmp](const std::string &problem) {
    error_if_any(lmp, problem.empty() ? "" : "Fix mpm: " + problem);
  };
  communication.max_over_ranks = [ranks](double *data, std::size_t count) {
    MPI_Allreduce(MPI_IN_PLACE, data, (int) count, MPI_DOUBLE, MPI_MAX, ranks);
  };
  communication.exchange = [ranks](const std::vector<mpm::Message> &messages) {
    std::vector<MPI_Request> requests;
    requests.reserve(2 * messages.size());
    const auto next = [&requests]() -> MPI_Request * {
      return &requests.emplace_back(MPI_REQUEST_NULL);
    };
    for (const mpm::Message &message : messages)
      if (message.received_count > 0)
        MPI_Irecv(message.received, (int) message.received_count, MPI_INT64_T, message.rank, 0,
                  ranks, next());
    for (const mpm::Message &message : messages)
      if (message.sent_count > 0)
        MPI_Isend(message.sent, (int) message.sent_count, MPI_INT64_T, message.rank, 0, ranks,
                  next());
    MPI_Waitall((int) requests.size(), requests.data(), MPI_STATUSES_IGNORE);
  };
  // ranks of several partitions may use the same devices, which then cannot wait for each other
  if (universe->nworlds == 1)
    communication.shared_memory = [ranks](std::size_t bytes) {
      return memory_in_common(ranks, bytes);
    };
  return communication;
}

template <int D> FixMpm::ImplOf<D>::~ImplOf()
{
  memory->destroy(output);
}

/* ---------------------------------------------------------------------- */

template <int D> void FixMpm::ImplOf<D>::lay_out_memory()
{
  for (const MpmModel<D> &model : settings.models)
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
      error->all(FLERR, "Fix mpm column: no model has the state variable '{}'{}", name,
                 known.empty() ? std::string("; the models have none")
                               : rve::did_you_mean(name, known, "there are"));
    state_columns.push_back(name);
    if (comm->me == 0)
      utils::logmesg(lmp, "fix mpm {}: column {} is {}{}\n", fix->id, num_columns(), name,
                     unit.empty() ? unit : " [" + unit + "]");
  }
  for (int law = 0; law < layout.num_laws(); law++) {
    place_of_law.emplace_back();
    for (const std::string &name : state_columns)
      place_of_law.back().push_back(layout.place(law, name));
  }
}

template <int D> void FixMpm::ImplOf<D>::begin_memory(int i)
{
  remembering[i] = law_of_model[model[i]];
  std::fill_n(memory_of(i), layout.width(), 0.0);
  if (const auto &law = settings.models[model[i]].law) law->begin_memory(stress[i], memory_of(i));
}

template <int D> int FixMpm::ImplOf<D>::pack(int i, double *buf, int num_memory)
{
  int m = 0;
  for_each_array([&](auto &array) {
    memcpy(buf + m, &array[i], sizeof(array[i]));
    m += sizeof(array[i]) / sizeof(double);
  });
  std::copy_n(memory_of(i), num_memory, buf + m);
  return m + num_memory;
}

template <int D> int FixMpm::ImplOf<D>::unpack(int i, const double *buf, int num_memory)
{
  int m = 0;
  for_each_array([&](auto &array) {
    memcpy(&array[i], buf + m, sizeof(array[i]));
    m += sizeof(array[i]) / sizeof(double);
  });
  std::copy_n(buf + m, num_memory, memory_of(i));
  return m + num_memory;
}

template <int D> typename FixMpm::ImplOf<D>::ModelTimes FixMpm::ImplOf<D>::model_times() const
{
  ModelTimes times;
  for (std::size_t k = 0; k < grains.size(); k++) {
    if (!grains[k]) continue;
    times.models += solver->model_time((int) k);
    // groups may share a fix
    if (std::find(grains.begin(), grains.begin() + k, grains[k]) != grains.begin() + k) continue;
    times.engine += grains[k]->rves().engine_time();
    times.bounds += grains[k]->rves().bounding_time();
  }
  return times;
}

template <int D> bool FixMpm::ImplOf<D>::has_grains() const
{
  return std::any_of(grains.begin(), grains.end(),
                     [](const FixRve *some) { return some != nullptr; });
}

template <int D> std::uint64_t FixMpm::ImplOf<D>::sum_of_positions() const
{
  std::uint64_t sum = 0;
  for (int i = 0; i < atom->nlocal; i++) {
    rve::Checksum one;
    one.add(&atom->tag[i], sizeof(tagint));
    one.add(atom->x[i], D * sizeof(double));
    sum += one.value();
  }
  MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_UINT64_T, MPI_SUM, world);
  return sum;
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
  // in each step: without branches, some at a time
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
  // groups change between runs, and dynamic ones in a run
#pragma omp parallel for num_threads(rve::team_for(nlocal, settings.options.threads))
  for (int i = 0; i < nlocal; i++)
    failed.guard(i, [&] {
      if (body[i] < 0 && model[i] >= 0 && volume0[i] > 0.0 &&
          remembering[i] != law_of_model[model[i]]) {
        const FixRve *const source = grains[model[i]];
        if (source && source->rves().slot[i] >= 0 && update->ntimestep > update->firststep)
          throw rve::InputError(fmt::format(
              "atom {} has joined group {} of the model rve {} in the run, and its RVE has not "
              "followed its deformation before; let the group change between runs",
              atom->tag[i], settings.models[model[i]].group, source->id));
        begin_memory(i);
      }
    });
  guarded([&] { failed.rethrow(); });
  members_are_known = true;
  members_are_sound = false;
}

/* ----------------------------------------------------------------------
   in a run: a dynamic group may have lost a point, or have taken in one that has no RVE
------------------------------------------------------------------------- */

template <int D> void FixMpm::ImplOf<D>::find_members_of_run()
{
  find_members();
  if (members_are_sound) return;
  guarded([&] {
    for (int i = 0; i < atom->nlocal; i++) {
      if (body[i] >= 0) continue;
      if (model[i] < 0)
        throw rve::InputError(
            fmt::format("atom {} has left the groups of all models in the run; a point needs a "
                        "model as long as "
                        "it exists: use groups that keep their atoms, or add a model for the rest",
                        atom->tag[i]));
      FixRve *const source = grains[model[i]];
      if (source && source->rves().slot[i] < 0)
        throw rve::InputError(fmt::format(
            "atom {} has joined group {} of the model rve {} in the run and has no RVE; RVEs are "
            "made where a run begins: let the group change between runs",
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
    view.body_force = {&atom->f[0][0]};
  }
  view.mass = mass.data();
  view.volume = volume.data();
  view.initial_volume = volume0.data();
  view.half_size = half_size.data();
  view.deformation_gradient = deformation_gradient.data();
  view.stress = stress.data();
  view.memory = rows.data();
  view.velocity_gradient = velocity_gradient.data();
  view.model = model.data();
  view.rigid_body = body.data();
  return view;
}

/* ---------------------------------------------------------------------- */

template <int D> void FixMpm::ImplOf<D>::find_models()
{
  settings.find(lmp);
  laws.clear();
  grains.clear();
  for (const MpmModel<D> &model : settings.models) {
    grains.push_back(nullptr);
    if (!model.law) {
      auto *found = modify->get_fix_by_id(model.fix_rve);
      if (!found) error->all(FLERR, "Fix mpm model: fix '{}' does not exist", model.fix_rve);
      grains.back() = dynamic_cast<FixRve *>(found);
      if (!grains.back())
        error->all(FLERR, "Fix mpm model: fix '{}' must be of style rve, got {}", model.fix_rve,
                   found->style);
    }
    laws.push_back(model.law ? model.law.get() : grains.back()->constitutive<D>());
  }
  solver->set_models(laws);
  warned = false;
  warned_rounding = false;
}

/* ----------------------------------------------------------------------
   a run with "pre no" has no init, which would find other fixes
------------------------------------------------------------------------- */

template <int D> void FixMpm::ImplOf<D>::check_sources() const
{
  for (std::size_t k = 0; k < grains.size(); k++) {
    if (!grains[k]) continue;
    const std::string &name = settings.models[k].fix_rve;
    const Fix *const found = modify->get_fix_by_id(name);
    if (found != grains[k] || !grains[k]->rves().is_material)
      error->all(FLERR,
                 "Fix mpm model: fix '{}' has been deleted or defined anew since the last run; run "
                 "without pre no",
                 name);
  }
}

/* ----------------------------------------------------------------------
   fix_modify: points keep what their law remembers, and their stress until the next step
------------------------------------------------------------------------- */

template <int D> void FixMpm::ImplOf<D>::modify_models(int narg, char **arg)
{
  change_models(settings.modified_models(lmp, narg, arg),
                fmt::format("from step {} on", update->ntimestep));
}

template <int D>
void FixMpm::ImplOf<D>::change_models(const std::vector<MpmModel<D>> &wanted,
                                      const std::string &when)
{
  bring_back();
  const std::vector<MpmModel<D>> before = std::exchange(settings.models, wanted);
  for (std::size_t k = 0; k < wanted.size(); k++) {
    if (k < laws.size() && wanted[k].law) laws[k] = wanted[k].law.get();
    const std::string changes = parameter_changes(before[k], wanted[k]);
    if (comm->me == 0 && !changes.empty())
      utils::logmesg(lmp, "fix mpm {}: {} model {} {} has {}\n", fix->id, when, wanted[k].group,
                     wanted[k].word, changes);
  }
  if (!laws.empty()) solver->set_models(laws);
}

/* ----------------------------------------------------------------------
   of the run that has written the restart file, if the fix defines the model as that run did; if not, it is the new definition that counts
------------------------------------------------------------------------- */

template <int D>
void FixMpm::ImplOf<D>::continue_modification(const MpmWords &then, const std::string &words)
{
  std::vector<std::string> list = utils::split_words(words);
  const std::string about = "model " + list.at(1);
  const auto of_model = [&](const MpmWords &all) {
    MpmWords one;
    for (const auto &entry : all)
      if (entry.first == about) one.push_back(entry);
    return one;
  };
  const MpmWords now = of_model(settings.words);
  if (now.empty() || !mpm_differences(of_model(then), now, false).empty()) {
    if (comm->me == 0)
      error->warning(FLERR,
                     "Fix mpm {}: {} is not defined as in the run before, and begins without what "
                     "fix_modify has changed of it, {}",
                     fix->id, about, words);
    return;
  }
  std::vector<char *> arg;
  for (std::string &word : list) arg.push_back(word.data());
  change_models(settings.modified_models(lmp, (int) arg.size(), arg.data()),
                "as fix_modify had it,");
}

/// Low and high sides of LAMMPS' box, axis by axis.
template <int D> void FixMpm::ImplOf<D>::find_box(double *box) const
{
  for (int a = 0; a < D; a++) {
    box[2 * a] = domain->boxlo[a];
    box[2 * a + 1] = domain->boxhi[a];
  }
}

/* ----------------------------------------------------------------------
   between runs: what others did to the points, and what the script says of them
------------------------------------------------------------------------- */

template <int D> void FixMpm::ImplOf<D>::check_positions()
{
  if (points_then != atom->natoms || positions_then == sum_of_positions()) return;
  double box[2 * D];
  find_box(box);
  if (!std::equal(box, box + 2 * D, box_then))
    error->all(
        FLERR,
        "Fix mpm: points and box have been changed since the last run, by change_box with remap "
        "perhaps; strains and stresses of the points do not know of that. Change the box without "
        "remap, or before the fix is defined");
  if (comm->me == 0)
    error->warning(FLERR,
                   "Fix mpm {}: points have been moved since the last run; their displacements "
                   "include that, their strains and stresses do not",
                   fix->id);
}

template <int D> void FixMpm::ImplOf<D>::check_overlap()
{
  if (said_overlap) return;
  bigint several[2] = {0, 0};    // points of more than one model, or body
  for (int i = 0; i < atom->nlocal; i++) {
    int models = 0, bodies = 0;
    for (const MpmModel<D> &model : settings.models)
      if (atom->mask[i] & model.groupbit) models++;
    for (const MpmRigidBody<D> &body : settings.bodies)
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
          fix->id, several[k], k == 0 ? "model" : "rigid body");
  said_overlap = several[0] + several[1] > 0;
}

/* ----------------------------------------------------------------------
   what the boxes of points take of a cell
------------------------------------------------------------------------- */

namespace {

struct CellShare {
  std::int64_t id = 0;    // of the cell in the whole grid
  double by_new = 0.0, by_all = 0.0;
};

/// Sums over all ranks, each on one rank, which the cell's number says.
std::vector<CellShare> summed_over_ranks(MPI_Comm world,
                                         const std::unordered_map<std::int64_t, CellShare> &own)
{
  int num_ranks;
  MPI_Comm_size(world, &num_ranks);
  std::vector<std::vector<CellShare>> to(num_ranks);
  for (const auto &[id, cell] : own) to[id % num_ranks].push_back(cell);
  std::vector<CellShare> sent, received;
  std::vector<int> counts, starts, from_counts(num_ranks), from_starts;
  for (const std::vector<CellShare> &cells : to) {
    starts.push_back((int) (sent.size() * sizeof(CellShare)));
    counts.push_back((int) (cells.size() * sizeof(CellShare)));
    sent.insert(sent.end(), cells.begin(), cells.end());
  }
  MPI_Alltoall(counts.data(), 1, MPI_INT, from_counts.data(), 1, MPI_INT, world);
  int bytes = 0;
  for (const int count : from_counts) {
    from_starts.push_back(bytes);
    bytes += count;
  }
  received.resize(bytes / sizeof(CellShare));
  MPI_Alltoallv(sent.data(), counts.data(), starts.data(), MPI_BYTE, received.data(),
                from_counts.data(), from_starts.data(), MPI_BYTE, world);
  // ranks in their order, so that sums are the same from run to run
  std::stable_sort(received.begin(), received.end(),
                   [](const CellShare &a, const CellShare &b) { return a.id < b.id; });
  std::vector<CellShare> sums;
  for (const CellShare &cell : received) {
    if (sums.empty() || sums.back().id != cell.id) {
      sums.push_back(cell);
      continue;
    }
    sums.back().by_new += cell.by_new;
    sums.back().by_all += cell.by_all;
  }
  return sums;
}

}    // namespace

/* ----------------------------------------------------------------------
   boxes of points that do not overlap fill no cell more than once: looked at where new points are, beside each other or on top of those
   that were there
------------------------------------------------------------------------- */

template <int D> void FixMpm::ImplOf<D>::check_volume(const std::vector<int> &made)
{
  bigint total = made.size();
  MPI_Allreduce(MPI_IN_PLACE, &total, 1, MPI_LMP_BIGINT, MPI_SUM, world);
  if (total == 0) return;
  const mpm::Grid<D> &grid = solver->grid();
  const double h = grid.cell_size();
  std::unordered_map<std::int64_t, CellShare> filled;    // cells that points of this rank reach
  const auto fill = [&](int i, double CellShare::*by) {
    // a deformed box has the volume of its point, and its sides the ratio of the stretches along the axes
    const Tensor &f = deformation_gradient[i];
    double boxed = 1.0;
    for (int a = 0; a < D; a++) boxed *= 2.0 * half_size[i][a] * std::fabs(f(a, a));
    const double ratio = boxed > 0.0 ? volume[i] / boxed : 0.0;
    const double scale = D == 2 ? std::sqrt(ratio) : std::cbrt(ratio);
    mpm::NodeBox<D> cells;
    double low[D], high[D];
    for (int a = 0; a < D; a++) {
      const double extent = scale * half_size[i][a] * std::fabs(f(a, a));
      low[a] = grid.scaled(atom->x[i][a] - extent, a);
      high[a] = grid.scaled(atom->x[i][a] + extent, a);
      if (!(std::fabs(low[a]) < 1e7 && std::fabs(high[a]) < 1e7)) low[a] = high[a] = -2.0;
      cells.first[a] = std::max(0, (int) std::floor(low[a]));
      cells.end[a] = std::min(grid.cells(a), (int) std::floor(high[a]) + 1);
    }
    cells.for_each([&](const mpm::Place<D> &cell) {
      double share = 1.0;
      for (int a = D - 1; a >= 0; a--)
        share *= std::max(0.0, std::min(high[a], cell[a] + 1.0) - std::max(low[a], 1.0 * cell[a]));
      CellShare &of_cell = filled[grid.id(cell)];
      of_cell.id = grid.id(cell);
      of_cell.*by += share;
    });
  };
  for (const int i : made) fill(i, &CellShare::by_new);
  bigint deformable = 0;
  for (int i = 0; i < atom->nlocal; i++) {
    if (body[i] >= 0) continue;
    fill(i, &CellShare::by_all);
    deformable++;
  }
  MPI_Allreduce(MPI_IN_PLACE, &deformable, 1, MPI_LMP_BIGINT, MPI_SUM, world);
  bigint found[2] = {0, 0}, &cells = found[0], &over = found[1];
  double fullest = 0.0;
  for (const CellShare &cell : summed_over_ranks(world, filled)) {
    if (!(cell.by_new > 1e-6)) continue;
    cells++;
    // what old points alone have too much of is not the new ones' doing
    if (!(cell.by_all > FULL && cell.by_new > FULL - 1.0)) continue;
    over++;
    fullest = std::max(fullest, cell.by_all);
  }
  MPI_Allreduce(MPI_IN_PLACE, found, 2, MPI_LMP_BIGINT, MPI_SUM, world);
  MPI_Allreduce(MPI_IN_PLACE, &fullest, 1, MPI_DOUBLE, MPI_MAX, world);
  if (over == 0) return;
  const bool are_all_new = total == deformable;
  const std::string text =
      fmt::format("{} of {} cells that {}points fill, {} [distance] each, have more than {} "
                  "times their {} in points, the fullest {:.3g} times. They are too heavy and "
                  "too stiff by that factor. Each new point has the {} {} [distance^{}]: give the "
                  "right one with points_per_cell or volume, and look for points that were made "
                  "twice{}",
                  over, cells, are_all_new ? "" : "new ",
                  D == 2 ? fmt::format("{} by {}", h, h) : fmt::format("{} by {} by {}", h, h, h),
                  FULL, volume_word<D>(), fullest, volume_word<D>(), settings.initial_volume, D,
                  are_all_new ? "" : " or on top of those that were there");
  if (are_all_new && 2 * over > cells) error->all(FLERR, "Fix mpm: {}", text);
  warned_full = true;
  if (comm->me == 0) error->warning(FLERR, "Fix mpm {}: {}", fix->id, text);
}

/* ----------------------------------------------------------------------
   makes material points of new atoms: all other fixes are initialized, and fix gravity has not yet asked for the masses
------------------------------------------------------------------------- */

template <int D> void FixMpm::ImplOf<D>::setup_pre_force()
{
  check_positions();
  check_overlap();
  find_members();
  take_over();
  const std::vector<int> made = make_points(false);
  if (settings.in_situ.given)
    begin_in_situ(made);
  else if (rve::norm(settings.initial_stress) > 0.0)
    check_strength(made);
  give_masses();
  check_volume(made);
  warned_full = false;
  // other fixes and the variables of this one may read the columns before setup() is through
  fill_output();
}

/* ----------------------------------------------------------------------
   the same in a run, for atoms that a fix has created in this step. They come with new neighbor lists
------------------------------------------------------------------------- */

template <int D> void FixMpm::ImplOf<D>::pre_force()
{
  if (neighbor->ago > 0) return;
  int any = has_new;
  MPI_Allreduce(MPI_IN_PLACE, &any, 1, MPI_INT, MPI_MAX, world);
  if (!any) return;
  find_members();
  take_over();
  const std::vector<int> made = make_points(true);
  if (settings.in_situ.given) begin_in_situ(made);
  is_in_situ = false;    // what is out of balance is that of a run
  give_masses();
  if (!warned_full) check_volume(made);
}

/// Returns false if the atom is a point already.
template <int D> bool FixMpm::ImplOf<D>::make_point(int i, bool in_run)
{
  const bool rigid = body[i] >= 0;
  if (!rigid && model[i] < 0)
    error->one(FLERR, "Fix mpm: atom {} has no constitutive model; see the keyword model",
               atom->tag[i]);
  const FixRve *source = rigid ? nullptr : grains[model[i]];
  const bool is_new = volume0[i] == 0.0;
  if (is_new && in_run && (rigid || source))
    error->one(FLERR,
               "Fix mpm, step {}: atom {} was created in this run, as a point of {}; this is "
               "possible between two runs only. Points of a law in closed form can be created in "
               "a run",
               update->ntimestep, atom->tag[i],
               rigid ? "rigid body " + settings.bodies[body[i]].group
                     : fmt::format("the RVEs of fix {}", source->id));
  if (source && source->rves().slot[i] < 0)
    error->one(FLERR, "Fix mpm: atom {} has no RVE of fix {}; is it in its group?", atom->tag[i],
               source->id);
  if (!is_new) return false;
  const double half = 0.5 * settings.width_of_point();
  for (int a = 0; a < D; a++) {
    reference[i][a] = atom->x[i][a];
    half_size[i][a] = half;
  }
  volume0[i] = volume[i] = settings.initial_volume;
  deformation_gradient[i] = Tensor::identity();
  velocity_gradient[i] = Tensor::zero();
  stress[i] = rigid ? Tensor::zero() : source ? stress_of<D>(*source, i) : settings.initial_stress;
  if (!rigid) begin_memory(i);
  if (given_density(i) > 0.0)
    mass[i] = given_density(i) * settings.initial_volume;
  else if (source)
    mass[i] = source->rves().bulk_density(i) * settings.initial_volume;
  else if (rigid)
    mass[i] = atom->rmass ? atom->rmass[i] : atom->mass[atom->type[i]];
  else
    error->one(FLERR,
               "Fix mpm: atom {} has no RVE, so the keyword density must give its model, {}, a "
               "value > 0",
               atom->tag[i], settings.models[model[i]].group);
  return true;
}

/// Returns the deformable ones that were no points before.
template <int D> std::vector<int> FixMpm::ImplOf<D>::make_points(bool in_run)
{
  std::vector<int> made;
  for (int i = 0; i < atom->nlocal; i++)
    if (make_point(i, in_run) && body[i] < 0) made.push_back(i);
  has_new = false;
  return made;
}

/// To the atoms, for fix gravity; an error where types have another mass.
template <int D> void FixMpm::ImplOf<D>::give_masses()
{
  for (int i = 0; i < atom->nlocal; i++) {
    const bool rigid = body[i] >= 0;
    if (atom->rmass)
      atom->rmass[i] = mass[i];
    else if (!rigid && std::fabs(atom->mass[atom->type[i]] / mass[i] - 1.0) > 1e-6)
      error->one(FLERR,
                 "Fix mpm: atom {} has mass {} = density * volume, but type {} has {} and fix "
                 "gravity would use that; "
                 "use atom_style sphere, or set it with the mass command",
                 atom->tag[i], mass[i], atom->type[i], atom->mass[atom->type[i]]);
  }
}

template <int D> void FixMpm::ImplOf<D>::setup()
{
  test_waves();
  check_courant();
  check_time_step();
  check_absorbing_sides();
  solve(false);
  check_enclosed();
  if (is_in_situ) report_in_situ();
  tell_parts();
  check_rounding();
  if (!has_grains()) progress->begin();
}

/* ----------------------------------------------------------------------
   what the ranks hold of the grid; once, since it changes little
------------------------------------------------------------------------- */

template <int D> void FixMpm::ImplOf<D>::tell_parts()
{
  if (said_parts) return;
  said_parts = true;
  int extremes[2] = {solver->held_nodes(), -solver->held_nodes()};
  MPI_Allreduce(MPI_IN_PLACE, extremes, 2, MPI_INT, MPI_MAX, world);
  const int most = extremes[0], least = -extremes[1];
  if (comm->me != 0) return;
  const std::string each = least == most ? fmt::format("{}", most)
                                         : fmt::format("{} to {}", least, most);
  utils::logmesg(lmp, "fix mpm {}: {} {} of {:.0f} nodes of the grid\n", fix->id,
                 comm->nprocs == 1 ? "this rank holds" : "each rank holds", each,
                 solver->grid().all().count());
}

template <int D> void FixMpm::ImplOf<D>::final_integrate()
{
  const double start = platform::walltime();
  if (update->ntimestep == update->firststep + 1) {
    check_sources();
    std::fill_n(times, (int) TIMES, 0.0);
    damping_sum = reaction_sum = 0.0;
  }
  const ModelTimes before = model_times();
  const double copied = solver->transfer_time();
  const bool must_test = settings.wave_every > 0 && update->ntimestep % settings.wave_every == 0;
  if (must_test) test_waves();
  const bool is_due = has_grains() ? (update->ntimestep - 1) % COURANT_OF_GRAINS_EVERY == 0 &&
          update->ntimestep > update->firststep + 1
                                   : update->ntimestep % COURANT_EVERY == 0;
  if (must_test || is_due) check_courant();
  solve(true);
  output_is_old = true;
  if (update->ntimestep % DAMPING_EVERY == 0) look_at_damping();
  const double solved = platform::walltime();
  const double copied_in_step = solver->transfer_time() - copied;
  const ModelTimes when_solved = model_times();
  if (state_may_be_read(lmp)) fill_output();
  const double filled = platform::walltime();
  const ModelTimes after = model_times();
  const double engine = after.engine - before.engine;
  const double models = after.models - before.models;
  const double in_rves = engine + after.bounds - before.bounds;
  const double whole = filled - start;
  // of columns, without the RVEs that they wait for
  const double columns = filled - solved - (after.models - when_solved.models);
  // and copies from and to a device, and what stands between points and RVEs
  const double transfers = columns + copied_in_step + models - engine;
  times[TIME_RVE] += in_rves;
  times[TIME_TRANSFERS] += transfers;
  times[TIME_MPM] += whole - transfers - in_rves;
  if (!has_grains()) progress->step_done();
}

/* ----------------------------------------------------------------------
   the run may have ended before its last step
------------------------------------------------------------------------- */

template <int D> void FixMpm::ImplOf<D>::post_run()
{
  if (output_is_old) fill_output();
  tell_damping();
  points_then = atom->natoms;
  positions_then = sum_of_positions();
  find_box(box_then);
  report_times();
  if (!has_grains()) progress->end();
}

/* ---------------------------------------------------------------------- */

template <int D> void FixMpm::ImplOf<D>::report_times() const
{
  double all[] = {times[TIME_RVE], times[TIME_MPM], times[TIME_TRANSFERS],
                  timer->get_wall(Timer::OUTPUT), timer->get_wall(Timer::TOTAL)};
  MPI_Allreduce(MPI_IN_PLACE, all, 5, MPI_DOUBLE, MPI_SUM, world);
  for (double &time : all) time /= comm->nprocs;
  const double total = all[4];
  if (comm->me != 0 || total < LONG_RUN || update->nsteps == 0) return;
  const double per_step = 1e3 / update->nsteps;
  utils::logmesg(lmp,
                 "fix mpm {}: wall time {:.2f} s; per step [ms]: RVE {:.3f}, MPM {:.3f}, transfers "
                 "{:.3f}, LAMMPS {:.3f}, output {:.3f}\n",
                 fix->id, total, per_step * all[TIME_RVE], per_step * all[TIME_MPM],
                 per_step * all[TIME_TRANSFERS],
                 per_step * (total - all[0] - all[1] - all[2] - all[3]), per_step * all[3]);
}

template <int D> void FixMpm::ImplOf<D>::check_time_step()
{
  if (comm->me != 0 || update->nsteps == 0 || courant >= COURANT_SMALL) return;
  error->warning(
      FLERR,
      "Fix mpm {}: the Courant number is {:.2g}, so that the {} steps of this run take the "
      "fastest wave through {:.2g} cells. The time step is {} [time]{}; {:.2g} has a Courant "
      "number of 0.5",
      fix->id, courant, update->nsteps, courant * update->nsteps, update->dt,
      update->dt_default ? ", the default of LAMMPS: set it with the command timestep" : "",
      courant > 0.0 ? 0.5 * update->dt / courant : 0.0);
}

/* ----------------------------------------------------------------------
   dashpots of n times the impedance send back (n - 1)/(n + 1) of the stress of a wave: a third with n = 2 or 1/2. Less is a matter of
   judgement, since a side may stand for another material than that beside it
------------------------------------------------------------------------- */

template <int D> void FixMpm::ImplOf<D>::check_absorbing_sides()
{
  constexpr int KINDS = 2, SPEEDS = KINDS * mpm::FACES<D>;    // of each side compression and shear
  if (warned_sides ||
      std::none_of(settings.options.dashpots.begin(), settings.options.dashpots.end(),
                   [](const mpm::Dashpots &some) { return some.exist(); }))
    return;
  find_members();
  bring_back();
  for (mpm::Constitutive<D> *law : laws) law->expect_questions();
  // of the points within a cell of the side: the largest speed and, with its sign changed, the least
  double most[SPEEDS], least[SPEEDS];
  std::fill_n(most, SPEEDS, 0.0);
  std::fill_n(least, SPEEDS, -std::numeric_limits<double>::infinity());
  const double h = settings.options.cell_size;
  for (int i = 0; i < atom->nlocal; i++) {
    if (body[i] >= 0) continue;
    for (int side = 0; side < mpm::FACES<D>; side++) {
      if (!settings.options.dashpots[side].exist()) continue;
      const int axis = side / 2;
      const double away = side % 2 ? settings.options.hi[axis] - atom->x[i][axis]
                                   : atom->x[i][axis] - settings.options.lo[axis];
      if (away > h) continue;
      const double moduli[KINDS] = {laws[model[i]]->p_wave_modulus(i),
                                    laws[model[i]]->shear_modulus(i)};
      for (int kind = 0; kind < KINDS; kind++) {
        if (!(moduli[kind] > 0.0)) continue;    // a gas, or not known
        const double speed = std::sqrt(moduli[kind] * volume[i] / mass[i]);
        double &largest = most[KINDS * side + kind], &smallest = least[KINDS * side + kind];
        largest = std::max(largest, speed);
        smallest = std::max(smallest, -(grains[model[i]] ? BOUND_OF_GRAINS * speed : speed));
      }
    }
  }
  double all[2 * SPEEDS], mine[2 * SPEEDS];
  std::copy_n(most, SPEEDS, mine);
  std::copy_n(least, SPEEDS, mine + SPEEDS);
  MPI_Allreduce(mine, all, 2 * SPEEDS, MPI_DOUBLE, MPI_MAX, world);
  for (int k = 0; k < SPEEDS; k++) {
    const mpm::Dashpots &dashpots = settings.options.dashpots[k / KINDS];
    const double given = k % KINDS == 0 ? dashpots.normal : dashpots.tangential;
    if (given == 0.0 || all[k] == 0.0) continue;
    const double low = -all[SPEEDS + k] / WRONG_SPEED, high = WRONG_SPEED * all[k];
    if (given >= low && given <= high) continue;
    warned_sides = true;
    if (comm->me == 0)
      error->warning(
          FLERR,
          "Fix mpm {}: boundary {} absorbing {} is {} [length/time]; expected is a speed between "
          "{:.4g} and {:.4g}, since {} waves of the points within a cell of that side have {:.4g} "
          "to {:.4g}: it sends back more than a third of their stress",
          fix->id, MpmSettings<D>::name_of_side(k / KINDS), k % KINDS == 0 ? "cp" : "cs",
          rve::number(given), low, high, k % KINDS == 0 ? "compression" : "shear",
          WRONG_SPEED * low, all[k]);
  }
}

/* ----------------------------------------------------------------------
   local damping is a force on the nodes whose sum no reaction holds: how large it is beside them
------------------------------------------------------------------------- */

template <int D> void FixMpm::ImplOf<D>::look_at_damping()
{
  if (!(settings.options.damping > 0.0)) return;
  const auto magnitude = [](const Vec &force) {
    return D == 2 ? std::hypot(force[0], force[1]) : std::sqrt(dot(force, force));
  };
  double largest = 0.0;
  for (int b = 0; b < (int) settings.bodies.size(); b++)
    largest = std::max(largest, magnitude(solver->body_reaction(b)));
  for (int side = 0; side < mpm::FACES<D>; side++)
    if (settings.options.sides[side] != mpm::SideKind::Free ||
        settings.options.dashpots[side].exist())
      largest = std::max(largest, magnitude(solver->side_reaction(static_cast<Face>(side))));
  damping_sum += magnitude(solver->damping_force());
  reaction_sum += largest;
}

template <int D> void FixMpm::ImplOf<D>::tell_damping()
{
  if (comm->me != 0 || !(reaction_sum > 0.0)) return;
  const double share = damping_sum / reaction_sum;
  const std::string text = fmt::format(
      "local damping {} amounts to {:.2g} % of the largest reaction, in the mean of this "
      "run: reactions on two sides of the material differ by as much",
      settings.options.damping, 100.0 * share);
  // once; later runs say their own number
  const int last_of_damping = fix->size_vector - PER_TURNING * (int) turning.size();
  if (share > DAMPING_WARN && !warned_damping) {
    warned_damping = true;
    error->warning(FLERR,
                   "Fix mpm {}: {}. f_{}[{}] and f_{}[{}] are its force; use less damping, or none",
                   fix->id, text, fix->id, last_of_damping - 1, fix->id, last_of_damping);
  } else
    utils::logmesg(lmp, "fix mpm {}: {}\n", fix->id, text);
}

/* ----------------------------------------------------------------------
   points of rigid bodies that left the simulation box; LAMMPS deletes atoms when it exchanges them. Groups may lose points
   that still exist: these are no error
------------------------------------------------------------------------- */

template <int D> void FixMpm::ImplOf<D>::check_bodies(bool advance)
{
  const std::size_t bodies = settings.bodies.size();
  if (bodies == 0 || (advance && neighbor->ago != 0)) return;
  std::vector<bigint> count(bodies + 1, 0);
  count[bodies] = atom->nlocal;
  for (int i = 0; i < atom->nlocal; i++)
    if (body[i] >= 0) count[body[i]]++;
  MPI_Allreduce(MPI_IN_PLACE, count.data(), (int) count.size(), MPI_LMP_BIGINT, MPI_SUM, world);
  for (std::size_t b = 0; b < bodies && count[bodies] < atom->natoms; b++) {
    if (!advance || body_points.size() <= b || count[b] >= body_points[b]) continue;
    const double *lo = domain->boxlo, *hi = domain->boxhi;
    std::string box;
    for (int a = 0; a < D; a++)
      box += fmt::format("{}{} from {} to {}", a == 0 ? "" : ", ", "xyz"[a], lo[a], hi[a]);
    error->all(FLERR,
               "Fix mpm, step {}: rigid body {} has lost {} of its {} points, which left the "
               "simulation box, {} [length]; make the box large enough for the whole way of the "
               "body",
               update->ntimestep, settings.bodies[b].group, body_points[b] - count[b],
               body_points[b], box);
  }
  body_points.assign(count.begin(), count.end() - 1);
}

/* ----------------------------------------------------------------------
   points inside of bodies that can turn, before these move
------------------------------------------------------------------------- */

template <int D> void FixMpm::ImplOf<D>::check_enclosed()
{
  for (const int b : turning) {
    bigint enclosed = solver->rigid_bodies().num_enclosed(b, points());
    MPI_Allreduce(MPI_IN_PLACE, &enclosed, 1, MPI_LMP_BIGINT, MPI_SUM, world);
    if (enclosed > 0 && comm->me == 0)
      error->warning(FLERR,
                     "Fix mpm {}: {} points that are not of the rigid body {} are inside of its "
                     "form; place the body beside the material and beside other bodies",
                     fix->id, enclosed, settings.bodies[b].group);
  }
}

/* ----------------------------------------------------------------------
   one call of the solver: a step, or an evaluation that advances nothing
------------------------------------------------------------------------- */

template <int D> void FixMpm::ImplOf<D>::solve(bool advance)
{
  settings.check_groups(lmp);
  find_members_of_run();
  check_bodies(advance);
  modify->clearstep_compute();
  loads.resize(settings.tractions.size());
  body_speed = 0.0;
  for (std::size_t k = 0; k < loads.size(); k++) {
    const MpmTraction<D> &traction = settings.tractions[k];
    mpm::TractionLoad<D> &load = loads[k];
    load.point_index.clear();
    load.of_point.clear();
    load.face = traction.face;
    load.follows = traction.is_pressure;
    const auto as_vector = [&load](const Vec &given) {
      if (!load.follows) return given;
      Vec of_pressure = Vec::zero();
      of_pressure[mpm::axis_of(load.face)] = -mpm::outward(load.face) * given[0];
      return of_pressure;
    };
    const bool varies = std::any_of(traction.traction, traction.traction + D,
                                    [](const ScriptValue &value) { return value.per_atom; });
    std::vector<double> of_atoms[D];
    Vec given = Vec::zero();
    // a formula is evaluated atom by atom: where it is asked for only
    const int igroup = traction.groupbit ? lmp->group->find(traction.id) : fix->igroup;
    for (int a = 0; a < D; a++)
      if (varies)
        traction.traction[a].evaluate(lmp, igroup, of_atoms[a]);
      else
        given[a] = traction.traction[a].evaluate(lmp);
    load.traction = as_vector(given);
    Region *region = traction.groupbit ? nullptr : domain->get_region_by_id(traction.id);
    if (region) region->prematch();
    for (int i = 0; i < atom->nlocal; i++) {
      const double *x = atom->x[i];
      if (region ? body[i] < 0 && region->match(x[0], x[1], x[2])
                 : atom->mask[i] & traction.groupbit)
        load.point_index.push_back(i);
    }
    for (const int i : load.point_index) {
      if (!varies) break;
      for (int a = 0; a < D; a++) given[a] = of_atoms[a][i];
      load.of_point.push_back(as_vector(given));
    }
    if (advance || traction.groupbit) continue;
    bigint loaded = load.point_index.size();
    MPI_Allreduce(MPI_IN_PLACE, &loaded, 1, MPI_LMP_BIGINT, MPI_SUM, world);
    if (loaded == 0 && comm->me == 0)
      error->warning(
          FLERR,
          "Fix mpm {}: the region '{}' of a {} has no deformable points at step {}: the {} acts on "
          "nothing",
          fix->id, traction.id, traction.keyword(), update->ntimestep, traction.keyword());
  }

  guarded([&] {
    for (std::size_t b = 0; b < settings.bodies.size(); b++) {
      double rates[mpm::FREEDOMS<D>];
      for (int k = 0; k < mpm::FREEDOMS<D>; k++)
        rates[k] = settings.bodies[b].rates[k].evaluate(lmp);
      for (int a = 0; a < D; a++) body_speed = std::max(body_speed, std::fabs(rates[a]));
      const ScriptValue &friction = settings.bodies[b].friction;
      if (!friction.variable.empty()) solver->set_body_friction((int) b, friction.evaluate(lmp));
      if (solver->rigid_bodies().can_turn((int) b)) {
        solver->rigid_bodies().set_rates((int) b, rates);
        continue;
      }
      Vec velocity;
      std::copy_n(rates, D, velocity.component);
      solver->set_body_velocity((int) b, velocity);
      if (advance) body_displacement[b] = body_displacement[b] + update->dt * velocity;
    }
    modify->addstep_compute(update->ntimestep + 1);
    if (advance)
      solver->step(points(), loads, update->dt);
    else
      solver->evaluate(points(), loads, update->dt);
    if (advance)
      for (const int b : turning)
        for (int a = 0; a < D; a++)
          body_displacement[b][a] += update->dt * solver->rigid_bodies().rates(b)[a];
  });
}

/* ---------------------------------------------------------------------- */

template <int D> void FixMpm::ImplOf<D>::fill_output()
{
  bring_back();
  const rve::LightWork work(atom->nlocal, settings.options.threads);
#pragma omp parallel for num_threads(work.team)
  for (int i = 0; i < atom->nlocal; i++) {
    double *row = fix->array_atom[i];
    const Tensor &sigma = stress[i];
    const Tensor &F = deformation_gradient[i];
    Vec moved;
    for (int a = 0; a < D; a++) row[UX + a] = moved[a] = atom->x[i][a] - reference[i][a];
    row[U] = D == 2 ? std::hypot(moved[0], moved[1]) : std::sqrt(dot(moved, moved));
    double *shear = row + SXX + D;
    for (int a = 0; a < D; a++) {
      row[SXX + a] = sigma(a, a);
      for (int b = a + 1; b < D; b++) *shear++ = 0.5 * (sigma(a, b) + sigma(b, a));
    }
    row[P] = -trace(sigma) / D;
    row[Q] = mpm::deviatoric_stress(sigma);
    row[EPS_V] = trace(F) - D;
    row[EPS_Q] = mpm::deviatoric_strain(F);
    row[RHO] = mass[i] / volume[i];
    std::copy_n(F.component, D * D, row + FXX);
    const bool remembers = body[i] < 0 && remembering[i] != NO_LAW;
    for (std::size_t k = 0; k < state_columns.size(); k++) {
      const int place = remembers ? place_of_law[(int) remembering[i]][k] : -1;
      row[STATE + k] = place < 0 ? 0.0 : memory_of(i)[place];
    }
  }
  output_is_old = false;
}

/* ---------------------------------------------------------------------- */

/* ----------------------------------------------------------------------
   wave speed of RVEs by the tangents of those whose bounds are the fastest: they decide the Courant number
------------------------------------------------------------------------- */

template <int D> void FixMpm::ImplOf<D>::test_waves()
{
  for (FixRve *some : grains)
    if (some) some->rves().scale_waves(1.0);
  if (settings.wave_tests == 0) return;
  find_members_of_run();
  std::vector<FixRve *> tested;
  for (FixRve *source : grains) {
    // another group may have RVEs of the same fix
    if (!source || std::find(tested.begin(), tested.end(), source) != tested.end()) continue;
    tested.push_back(source);
    mpm::Constitutive<D> *law = source->template constitutive<D>();
    law->expect_questions();
    // the fastest of this rank, then of all ranks, equal ones by their IDs
    struct Candidate {
      double slowness, id;
      bool operator<(const Candidate &other) const
      {
        return slowness != other.slowness ? slowness < other.slowness : id < other.id;
      }
    };
    std::vector<Candidate> mine;
    for (int i = 0; i < atom->nlocal; i++)
      if (body[i] < 0 && grains[model[i]] == source)
        mine.push_back({mass[i] / (law->p_wave_modulus(i) * volume[i]), (double) atom->tag[i]});
    std::sort(mine.begin(), mine.end());
    mine.resize(settings.wave_tests, {std::numeric_limits<double>::infinity(), 0.0});
    std::vector<Candidate> all((std::size_t) comm->nprocs * mine.size());
    MPI_Allgather(mine.data(), 2 * settings.wave_tests, MPI_DOUBLE, all.data(),
                  2 * settings.wave_tests, MPI_DOUBLE, world);
    std::sort(all.begin(), all.end());
    std::vector<int> chosen;
    for (int k = 0; k < settings.wave_tests; k++) {
      if (std::isinf(all[k].slowness)) break;
      for (int i = 0; i < atom->nlocal; i++)
        if (atom->tag[i] == (tagint) all[k].id) chosen.push_back(i);
    }
    double share = source->rves().measured_wave_share(chosen), largest;
    MPI_Allreduce(&share, &largest, 1, MPI_DOUBLE, MPI_MAX, world);
    if (largest > 0.0) source->rves().scale_waves(largest);
    if (comm->me != 0) continue;
    if (largest > 0.0)
      utils::logmesg(lmp,
                     "fix mpm {}, step {}: waves in the RVEs of fix {} have {:.3g} times the "
                     "modulus that their contacts allow, by the tangents of the fastest ones\n",
                     fix->id, update->ntimestep, source->id, largest);
    else
      error->warning(FLERR,
                     "Fix mpm {}, step {}: no tangent of the RVEs of fix {} could be measured; "
                     "wave speeds are the bound of their contacts",
                     fix->id, update->ntimestep, source->id);
  }
}

/* ---------------------------------------------------------------------- */

template <int D> void FixMpm::ImplOf<D>::check_courant()
{
  find_members_of_run();
  guarded([&] { courant = solver->cfl_number(points(), update->dt); });
  const double limit = settings.courant_error;
  if (courant > limit)
    error->all(FLERR,
               "Fix mpm, step {}: Courant number {:.4g} from the present stiffness exceeds {}; the "
               "time step {} must be "
               "below {:.4g} [time]",
               update->ntimestep, courant, limit, update->dt, update->dt * limit / courant);
  if (courant > settings.courant_warn && !warned) {
    if (comm->me == 0)
      error->warning(FLERR,
                     "Fix mpm, step {}: Courant number {:.4g} from the present stiffness, above "
                     "{}; error above {}",
                     update->ntimestep, courant, settings.courant_warn, limit);
    warned = true;
  }
  check_rounding();
}

/* ----------------------------------------------------------------------
   LAMMPS stores coordinates as doubles, which far from the origin are multiples of a large quantum
------------------------------------------------------------------------- */

template <int D> void FixMpm::ImplOf<D>::check_rounding()
{
  if (warned_rounding) return;
  double quantum = 0.0, coordinate = 0.0;
  for (int a = 0; a < D; a++) {
    const double lo = settings.options.lo[a], hi = settings.options.hi[a];
    const double largest = std::max(std::fabs(lo), std::fabs(hi));
    if (largest <= FAR_FROM_ORIGIN * (hi - lo) || largest <= coordinate) continue;
    coordinate = largest;
    quantum = std::nextafter(largest, HUGE_VAL) - largest;
  }
  if (quantum == 0.0) return;
  bring_back();
  double speed = body_speed;
  for (int i = 0; i < atom->nlocal; i++)
    for (int a = 0; a < D; a++) speed = std::max(speed, std::fabs(atom->v[i][a]));
  MPI_Allreduce(MPI_IN_PLACE, &speed, 1, MPI_DOUBLE, MPI_MAX, world);
  const double motion = speed * update->dt;
  if (motion == 0.0 || 0.5 * quantum <= ROUNDING_WARN * motion) return;
  warned_rounding = true;
  if (comm->me != 0) return;
  error->warning(FLERR,
                 "Fix mpm {}, step {}: near the coordinate {} [distance] positions are multiples "
                 "of {:.3g}, and the largest motion in a step is {:.3g}: rounding changes it by up "
                 "to {:.0f} %, and motions below {:.3g} are lost. Subtract a constant from the "
                 "coordinates, so that they are near zero, or use a time step or a velocity with "
                 "motions of at least {:.3g}",
                 fix->id, update->ntimestep, rve::number(coordinate), quantum, motion,
                 std::min(100.0, 50.0 * quantum / motion), 0.5 * quantum,
                 0.5 * quantum / ROUNDING_WARN);
}

/* ---------------------------------------------------------------------- */

template <int D> double FixMpm::ImplOf<D>::vector_component(int n)
{
  if (n == UNBALANCED) return solver->max_unbalanced_force();
  if (n == COURANT) return courant;
  if (n == KINETIC || n == MASS) {
    find_members();
    const mpm::Totals<D> totals = solver->totals(points());
    return n == MASS ? totals.mass : totals.kinetic_energy;
  }
  const int behind_bodies = n - HEAD - PER_BODY * (int) settings.bodies.size();
  const int behind_damping = behind_bodies - TIMES - D;
  if (behind_damping >= 0) {
    const int body = turning[behind_damping / PER_TURNING];
    const int what = behind_damping % PER_TURNING;
    if (what < ANGLE) return solver->rigid_bodies().rates(body)[what];
    if (what < TORQUE) return solver->rigid_bodies().turned(body)[what - ANGLE];
    return solver->body_torque(body)[what - TORQUE];
  }
  if (behind_bodies >= TIMES) return solver->damping_force()[behind_bodies - TIMES];
  if (behind_bodies >= 0) {
    double longest;
    MPI_Allreduce(&times[behind_bodies], &longest, 1, MPI_DOUBLE, MPI_MAX, world);
    return longest;
  }
  const int body = (n - HEAD) / PER_BODY;
  const int what = (n - HEAD) % PER_BODY;
  if (what < BODY_UX) return solver->body_reaction(body)[what - REACTION_X];
  return body_displacement[body][what - BODY_UX];
}

template <int D> bool FixMpm::ImplOf<D>::reads_results() const
{
  const auto reads = [&](const ScriptValue &value) {
    return !value.variable.empty() && may_read_results(lmp, value.variable);
  };
  for (const MpmRigidBody<D> &body : settings.bodies)
    if (reads(body.friction) || std::any_of(std::begin(body.rates), std::end(body.rates), reads))
      return true;
  for (const MpmTraction<D> &load : settings.tractions) {
    if (std::any_of(load.traction, load.traction + D, reads)) return true;
    // one that moves or changes its shape does so by variables
    const Region *region = load.groupbit ? nullptr : domain->get_region_by_id(load.id);
    if (region && (region->dynamic || region->varshape)) return true;
  }
  return false;
}

template <int D> double FixMpm::ImplOf<D>::bytes() const
{
  // arrays of GridArrays: sums, mass, six vectors, impulses per axis and per body, and bytes
  const double of_node = 3.0 + 8.0 * D + D * D + D * (double) settings.bodies.size();
  return sizeof(double) * ((double) atom->nmax * fix->maxexchange + of_node * solver->held_nodes());
}

/* ----------------------------------------------------------------------
   per-atom state: memory, reordering, exchange, restart
------------------------------------------------------------------------- */

template <int D> void FixMpm::ImplOf<D>::grow_arrays(int nmax)
{
  if (solver) solver->settle();    // stresses that come go to where the arrays were
  for_each_array([=](auto &array) { array.resize(nmax); });
  rows.resize((std::size_t) nmax * layout.width());
  memory->grow(output, nmax, fix->size_peratom_cols, "fix mpm:output");
  fix->array_atom = output;
}

template <int D> void FixMpm::ImplOf<D>::copy_arrays(int i, int j)
{
  take_over();
  for_each_array([=](auto &array) { array[j] = array[i]; });
  std::copy_n(memory_of(i), layout.width(), memory_of(j));
  std::copy_n(fix->array_atom[i], fix->size_peratom_cols, fix->array_atom[j]);
}

template <int D> void FixMpm::ImplOf<D>::set_arrays(int i)
{
  take_over();
  volume0[i] = volume[i] = 0.0;
  has_new = true;
  remembering[i] = NO_LAW;
  std::fill_n(fix->array_atom[i], fix->size_peratom_cols, 0.0);
}

template <int D> int FixMpm::ImplOf<D>::pack_exchange(int i, double *buf)
{
  take_over();
  // with its columns: variables may read them before the step ends
  const int m = pack(i, buf, layout.width());
  std::copy_n(fix->array_atom[i], fix->size_peratom_cols, buf + m);
  return m + fix->size_peratom_cols;
}

template <int D> int FixMpm::ImplOf<D>::unpack_exchange(int i, const double *buf)
{
  take_over();
  const int m = unpack(i, buf, layout.width());
  std::copy_n(buf + m, fix->size_peratom_cols, fix->array_atom[i]);
  return m + fix->size_peratom_cols;
}

template <int D> int FixMpm::ImplOf<D>::pack_restart(int i, double *buf)
{
  bring_back();
  const int size = size_restart(i);
  RestartRecords::write_header(lmp, i, size, buf);
  pack(i, buf + RestartRecords::HEADER, num_remembered(i));
  buf[size - 1] = sum_of(buf, size - 1);
  return size;
}

template <int D> void FixMpm::ImplOf<D>::unpack_restart(int i, int nth)
{
  take_over();
  const auto [extra, size] = records.of(lmp, "Fix mpm", i, nth, restart_step);
  const auto damaged = [&](const std::string &how) {
    error->one(
        FLERR,
        "Fix mpm: the record of atom {} in the restart file is damaged: {}. Use an earlier file",
        atom->tag[i], how);
  };
  if (!is_same_sum(extra[size - 1], sum_of(extra, size - 1)))
    damaged("its checksum is not that of its numbers");
  if (size < RECORD) damaged(fmt::format("it has {} numbers, not {}", size, RECORD));
  unpack(i, extra + RestartRecords::HEADER, 0);
  double &law = remembering[i];
  int num_memory = 0;
  if (law != NO_LAW) {
    if (!(law >= 0.0 && law < (double) law_of_file.size()))
      damaged(fmt::format("it is of law number {}", law));
    const auto in_file = (std::size_t) law;
    num_memory = size_in_file[in_file];
    law = law_of_file[in_file];
  }
  if (size != RECORD + num_memory)
    damaged(fmt::format("it has {} numbers, not {}", size, RECORD + num_memory));
  // what another law remembered is of no use
  if (law != NO_LAW)
    std::copy_n(extra + RestartRecords::HEADER + DOUBLES, num_memory, memory_of(i));
}

template <int D> int FixMpm::ImplOf<D>::size_restart(int i) const
{
  return RECORD + num_remembered(i);
}

template <int D> int FixMpm::ImplOf<D>::maxsize_restart() const
{
  return RECORD + layout.width();
}

/* ----------------------------------------------------------------------
   the head: version, numbers in it, their checksum, step, bodies, displacement and velocity of each and the record of one that can
   turn behind the numbers in it, what the script says and the state variables of each law as lines of text, checksum of all before
------------------------------------------------------------------------- */

template <int D> void FixMpm::ImplOf<D>::write_restart(FILE *fp) const
{
  if (comm->me != 0) return;
  std::string text;
  for (const auto &[about, values] : settings.words) text += about + "\n" + values + "\n";
  for (int k = 0; k < layout.num_laws(); k++)
    text += STATE_OF + layout.word(k) + "\n" + layout.names(k) + "\n";
  for (const MpmModel<D> &model : settings.models)
    if (model.is_modified) text += MODIFIED + "\n" + modification(model) + "\n";
  std::vector<double> head(HEAD_FIRST);
  const std::size_t bodies = settings.bodies.size();
  head.insert(head.end(), {(double) update->ntimestep, (double) bodies});
  for (std::size_t b = 0; b < bodies; b++) {
    const Vec &u = body_displacement[b];
    const Vec &v = solver->body_velocity_before((int) b);
    head.insert(head.end(), u.component, u.component + D);
    head.insert(head.end(), v.component, v.component + D);
    std::vector<double> record;
    if (solver->rigid_bodies().can_turn((int) b)) record = solver->rigid_bodies().record((int) b);
    head.push_back((double) record.size());
    head.insert(head.end(), record.begin(), record.end());
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

template <int D> void FixMpm::ImplOf<D>::find_law(const std::string &word, const std::string &names)
{
  const int law = layout.find(word);
  if (law >= 0 && names != layout.names(law))
    error->all(FLERR,
               "Fix mpm: the points of law {} in the restart file have the state variables '{}', "
               "and the law has '{}'",
               word, names, layout.names(law));
  law_of_file.push_back(law);
  size_in_file.push_back((int) utils::split_words(names).size());
}

template <int D> void FixMpm::ImplOf<D>::restart(const char *buf)
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
  std::vector<double> head;
  if (is_same_sum(number(2), sum_of(first, 2))) head.resize((std::size_t) number(1));
  if (!head.empty()) memcpy(head.data(), buf, head.size() * sizeof(double));
  if (head.empty() || !is_same_sum(head.back(), sum_of(head.data(), head.size() - 1)))
    error->all(FLERR,
               "Fix mpm: the head of the restart file is damaged: its checksum is not that of its "
               "numbers. Use an earlier file");

  const double *state = head.data() + HEAD_FIRST;
  restart_step = *state++;
  const auto bodies = (std::size_t) *state++;
  std::vector<const double *> of_body;
  for (std::size_t b = 0; b < bodies; b++) {
    of_body.push_back(state);
    state += 2 * D;
    const auto record = (std::size_t) *state++;
    state += record;
  }
  const auto length = (std::size_t) *state++;
  std::istringstream text(std::string(reinterpret_cast<const char *>(state), length));
  MpmWords then;
  std::vector<std::string> groups;           // of the bodies
  std::vector<std::string> modifications;    // of models
  law_of_file.clear();
  size_in_file.clear();
  for (std::string about, values; std::getline(text, about) && std::getline(text, values);) {
    if (about.rfind(STATE_OF, 0) == 0) {
      find_law(about.substr(STATE_OF.size()), values);
      continue;
    }
    if (about == MODIFIED) {
      modifications.push_back(values);
      continue;
    }
    then.emplace_back(about, values);
    if (utils::strmatch(about, "^rigid \\S+$")) groups.push_back(about.substr(strlen("rigid ")));
  }

  for (const std::string &words : modifications) continue_modification(then, words);

  // a body is that with the same group
  std::string new_bodies;
  for (std::size_t b = 0; b < settings.bodies.size(); b++) {
    const std::string &group = settings.bodies[b].group;
    const std::size_t k = std::find(groups.begin(), groups.end(), group) - groups.begin();
    const bool turns = solver->rigid_bodies().can_turn((int) b);
    // one that could not turn knows nothing of it, and the other way round
    if (k >= bodies || (of_body[k][2 * D] != 0.0) != turns) {
      new_bodies += (new_bodies.empty() ? "" : ", ") + group;
      continue;
    }
    const double *motion = of_body[k];
    Vec velocity;
    std::copy_n(motion, D, body_displacement[b].component);
    std::copy_n(motion + D, D, velocity.component);
    solver->set_body_velocity_before((int) b, velocity);
    if (turns) solver->rigid_bodies().set_record((int) b, motion + 2 * D + 1);
  }
  if (comm->me != 0) return;
  const std::string other = mpm_differences(then, settings.words, false);
  const std::string kept = mpm_differences(then, settings.words, true);
  if (!other.empty()) error->warning(FLERR, "Fix mpm {} continued with: {}", fix->id, other);
  if (!kept.empty())
    error->warning(FLERR,
                   "Fix mpm {}: the points in the restart file keep what they have; for new points "
                   "only: {}",
                   fix->id, kept);
  if (!new_bodies.empty())
    error->warning(FLERR,
                   "Fix mpm {}: rigid bodies that are not in the restart file begin with the "
                   "displacement 0: {}",
                   fix->id, new_bodies);
}

template struct FixMpm::ImplOf<2>;
template struct FixMpm::ImplOf<3>;
