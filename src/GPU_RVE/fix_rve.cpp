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

#include "fix_rve.h"

#include "atom.h"
#include "citeme.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "fix_rve_impl.h"
#include "group.h"
#include "input.h"
#include "lammps/collective_error.h"
#include "lammps/no_pairs.h"
#include "lammps/restart_record.h"
#include "lammps/state_readers.h"
#include "lammps/unit_styles.h"
#include "modify.h"
#include "rve/core/error.h"
#include "rve/engine/files.h"
#include "timer.h"
#include "update.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;
using namespace FixConst;

static const char cite_fix_rve[] =
    "fix rve: https://doi.org/10.1002/nme.6549\n\n"
    "@Article{Zhao2021,\n"
    " author = {S. Zhao and J. Zhao and W. Liang},\n"
    " title = {A thread-block-wise computational framework for large-scale hierarchical\n"
    "          continuum-discrete modeling of granular media},\n"
    " journal = {International Journal for Numerical Methods in Engineering},\n"
    " year = 2021,\n"
    " volume = 122,\n"
    " number = 2,\n"
    " pages = {579--608}\n"
    "}\n\n";

FixRve::FixRve(LAMMPS *lmp, int narg, char **arg) : Fix(lmp, narg, arg)
{
  require_mechanical_units(lmp, "fix rve");
  if (!atom->tag_enable) error->all(FLERR, "fix rve needs atoms with IDs");
  if (group->count(igroup) == 0)
    error->all(FLERR, "fix rve: group {} has no atoms; every atom of the group gets an RVE",
               group->names[igroup]);

  if (lmp->citeme) lmp->citeme->add(cite_fix_rve);

  vector_flag = 1;
  size_vector = 18;
  global_freq = 1;
  extvector = 0;
  nevery = 1;
  restart_global = 1;
  restart_peratom = 1;
  create_attribute = 1;
  time_integrate = 1;    // see claim_integration()

  FixRveSettings settings = FixRveSettings::parse(lmp, narg, arg);
  if (domain->dimension != 2 && settings.dimension == 2)
    error->all(FLERR, "fix rve needs a 2d system (its grains are disks), but the dimension is {}",
               domain->dimension);
  impl = Impl::make(this, std::move(settings));
  warn_of_dropped_records(lmp, fmt::format("fix rve {}", id));
  impl->read_packings();
  impl->make_engine();

  FixRve::grow_arrays(atom->nmax);
  atom->add_callback(Atom::GROW);
  atom->add_callback(Atom::RESTART);
}

FixRve::~FixRve()
{
  impl->warn_of_loss();
  if (modify->get_fix_by_id(id)) {
    atom->delete_callback(id, Atom::GROW);
    atom->delete_callback(id, Atom::RESTART);
  }
}

int FixRve::setmask()
{
  return FINAL_INTEGRATE | END_OF_STEP | POST_RUN;
}

void FixRve::init()
{
  if (update->whichflag == 2)
    error->all(FLERR, "fix rve cannot be used with minimize: RVEs advance in time only");
  if (utils::strmatch(update->integrate_style, "^respa"))
    error->all(FLERR, "fix rve needs run_style verlet, not {}", update->integrate_style);
  if (impl->settings.driver == RveDriver::Mpm && modify->get_fix_by_style("^mpm$").empty())
    error->all(FLERR, "fix rve: drive mpm needs a fix mpm, and there is none");

  if (utils::strmatch(lmp->input->command, "^rerun"))
    error->all(FLERR,
               "fix rve {} cannot be used with rerun: dumped positions do not say what RVEs went "
               "through. Delete it before, or continue from a restart file",
               id);
  claim_integration();
  settle_without_pairs(lmp);
  impl->find_variables();
  impl->attach();
  impl->check_clock();
  impl->check_dump();
  impl->choose_shadows();
  impl->set_exchange_size();
  impl->advise(true);
}

/// Makes LAMMPS count one fix that integrates: it warns if there is none, and of atoms that several
/// fixes integrate. RVEs may advance alone, or while another fix moves their points.
void FixRve::claim_integration()
{
  time_integrate = 1;
  bool is_before = true;    // of fixes rve the first one
  for (const Fix *other : modify->get_fix_list()) {
    if (other == this)
      is_before = false;
    else if (other->time_integrate && (is_before || !dynamic_cast<const FixRve *>(other)))
      time_integrate = 0;
  }
}

void FixRve::setup(int)
{
  // all fixes are initialized: who needs these RVEs has asked for them
  if (impl->settings.driver == RveDriver::Mpm && !impl->is_material)
    error->all(FLERR,
               "fix rve {}: drive mpm, but no model of a fix mpm uses it, and its RVEs would never "
               "advance; name it in fix mpm, as in model {} rve {}, or choose another drive",
               id, group->names[igroup], id);
  // a material may have changed since the last run
  if (impl->settings.dt_check_interval) impl->recheck_time_step(Impl::Check::Run);
  check_dump_files();
  impl->progress.begin([this] { return impl->dem_steps(); });
}

/// Files that cannot be written end a run before it begins, not at the first dump.
void FixRve::check_dump_files() const
{
  const auto &settings = impl->settings;
  if (!settings.dump_interval) return;
  collectively(lmp, fmt::format("fix rve {}: dump", id), [&] {
    for (const int i : impl->atoms_with_rve())
      if (std::find(settings.dump_atoms.begin(), settings.dump_atoms.end(), atom->tag[i]) !=
          settings.dump_atoms.end())
        rve::require_writable(impl->dump_file(atom->tag[i], update->ntimestep));
  });
}

/// This is the one place where time passes for RVEs that fix mpm does not drive.
void FixRve::final_integrate()
{
  if (impl->settings.driver == RveDriver::Mpm) return;
  impl->advance_by_script();
}

void FixRve::end_of_step()
{
  const auto &settings = impl->settings;
  const bigint step = update->ntimestep;
  if (!impl->checks_postponed) {
    impl->finish();
    impl->say_notes();
  }
  if (settings.path.halts && impl->all_paths_ended()) {
    impl->is_halted = true;
    timer->force_timeout();
  }
  impl->progress.step_done([this] { return impl->dem_steps(); });
  if (settings.dt_check_interval) {
    const bool due = step % settings.dt_check_interval == 0;
    if (due || !impl->checks_postponed)
      impl->recheck_time_step(due ? Impl::Check::Interval : Impl::Check::EveryStep);
    if (due) impl->advise(false);
  }
  if (!settings.dump_interval || step % settings.dump_interval) return;
  for (const int i : impl->atoms_with_rve()) {
    if (std::find(settings.dump_atoms.begin(), settings.dump_atoms.end(), atom->tag[i]) ==
        settings.dump_atoms.end())
      continue;
    impl->write_dump(i, impl->dump_file(atom->tag[i], step));
  }
}

void FixRve::post_run()
{
  impl->has_run = impl->has_run || update->nsteps > 0;
  impl->run_postponed_checks();
  // a run may be shorter than the interval of checks
  const int interval = impl->settings.dt_check_interval;
  if (interval && update->ntimestep % interval) {
    impl->recheck_time_step(Impl::Check::Run);
    impl->advise(false);
  }
  impl->report_fast_strain();
  if (impl->is_halted) {
    impl->is_halted = false;
    timer->reset_timeout();
    if (comm->me == 0)
      utils::logmesg(lmp, "fix rve {}: all paths have ended at step {}\n", id, update->ntimestep);
  }
  report_shadows();
  impl->progress.end();
  time_integrate = 1;    // until the next run is initialized
}

void FixRve::report_shadows() const
{
  if (impl->settings.num_shadows == 0) return;
  const auto [of_shadows, total] = impl->shadow_times();
  double mine[2] = {of_shadows, total}, all[2];
  MPI_Allreduce(mine, all, 2, MPI_DOUBLE, MPI_SUM, world);
  const auto report = impl->shadow_report();
  if (comm->me == 0)
    utils::logmesg(lmp,
                   "fix rve {}: shadows took {:.1f} % of the wall time of RVEs; their stress "
                   "deviates by {:.3g} on average, {:.3g} at most (atom {})\n",
                   id, all[1] > 0.0 ? 100.0 * all[0] / all[1] : 0.0, report.mean, report.largest,
                   report.atom);
}

FixRve *FixRve::find(LAMMPS *lmp, const std::string &id, const std::string &who)
{
  Error *error = lmp->error;
  if (id.empty()) {
    const auto fixes = lmp->modify->get_fix_by_style("^rve$");
    if (fixes.empty()) error->all(FLERR, "{}: there is no fix rve", who);
    if (fixes.size() > 1)
      error->all(FLERR, "{}: there are {} fixes of style rve; choose one with fix ID", who,
                 fixes.size());
    return dynamic_cast<FixRve *>(fixes[0]);
  }
  Fix *fix = lmp->modify->get_fix_by_id(id);
  if (!fix) error->all(FLERR, "{}: fix {} does not exist", who, id);
  auto *found = dynamic_cast<FixRve *>(fix);
  if (!found) error->all(FLERR, "{}: fix {} is of style {}, not rve", who, id, fix->style);
  return found;
}

template <int D> std::unique_ptr<rve::EngineOf<D>> FixRve::empty_engine(rve::Format format) const
{
  rve::Options options = impl->settings.options;
  options.contacts = static_cast<const ImplOf<D> &>(*impl).points->contacts();
  options.format = format;
  options.arithmetic = rve::Arithmetic::Strict;
  return rve::make_engine<D>(options);
}

template std::unique_ptr<rve::EngineOf<2>> FixRve::empty_engine<2>(rve::Format) const;
template std::unique_ptr<rve::EngineOf<3>> FixRve::empty_engine<3>(rve::Format) const;

bool FixRve::reads_results() const
{
  for (const auto *components : {&impl->settings.velocity_gradient, &impl->settings.stress_goal})
    for (const TensorComponent &component : *components)
      if (!component.value.variable.empty() && may_read_results(lmp, component.value.variable))
        return true;
  for (const ScriptValue &value : impl->settings.path.values)
    if (may_read_results(lmp, value.variable)) return true;
  return false;
}

template <int D> mpm::Constitutive<D> *FixRve::constitutive()
{
  if (impl->settings.driver != RveDriver::Mpm)
    error->all(FLERR, "fix rve {} must have drive mpm to serve as a material of fix mpm", id);
  impl->is_material = true;
  if constexpr (D == 2) {
    return impl->material_of_plane();
  } else {
    if (!impl->material_of_space())
      error->all(FLERR, "fix rve {} has RVEs of disks, which cannot be a material in space", id);
    return impl->material_of_space();
  }
}

template mpm::Constitutive<2> *FixRve::constitutive<2>();
template mpm::Constitutive<3> *FixRve::constitutive<3>();

double FixRve::compute_vector(int n)
{
  return impl->vector_component(n);
}

double FixRve::memory_usage()
{
  return static_cast<double>(atom->nmax) * sizeof(int) + impl->bytes();
}

/// The per-atom array has slots. An RVE leaves the engine with its atom.
void FixRve::grow_arrays(int nmax)
{
  impl->slot.resize(nmax, -1);
}

void FixRve::copy_arrays(int i, int j, int delflag)
{
  impl->finish();    // RVEs under way answer to the slots of their atoms
  if (delflag && impl->slot[j] >= 0) impl->remove(j);
  impl->slot[j] = impl->slot[i];
}

void FixRve::set_arrays(int i)
{
  impl->finish();
  impl->slot[i] = -1;
}

/// Packs the header of records, then the record of the RVE if there is one.
int FixRve::pack_exchange(int i, double *buf)
{
  const int size = size_restart(i);
  if (size > maxexchange)
    error->one(FLERR,
               "fix rve: RVE of atom {} takes {} values, more than the {} that were announced when "
               "the run began: its list of neighbors has more than doubled. Divide the run in two",
               atom->tag[i], size, maxexchange);
  return pack_restart(i, buf);
}

int FixRve::unpack_exchange(int nlocal, double *buf)
{
  const int size = static_cast<int>(buf[0]);
  impl->take_in(nlocal, buf + RestartRecords::HEADER, size - RestartRecords::HEADER);
  return size;
}

int FixRve::pack_restart(int i, double *buf)
{
  std::vector<double> record;
  if (impl->slot[i] >= 0) record = impl->guarded([&] { return impl->record(i); }, i);
  const int size = RestartRecords::HEADER + static_cast<int>(record.size());
  RestartRecords::write_header(lmp, i, size, buf);
  std::copy(record.begin(), record.end(), buf + RestartRecords::HEADER);
  return size;
}

void FixRve::unpack_restart(int nlocal, int nth)
{
  const RestartRecord record =
      impl->records.of(lmp, fmt::format("fix rve {}", id), nlocal, nth, impl->restart_step);
  impl->take_in(nlocal, record.values + RestartRecords::HEADER,
                record.size - RestartRecords::HEADER);
}

int FixRve::size_restart(int i)
{
  if (impl->slot[i] < 0) return RestartRecords::HEADER;
  return RestartRecords::HEADER + impl->guarded([&] { return impl->record_size(i); }, i);
}

int FixRve::maxsize_restart()
{
  int mine = RestartRecords::HEADER, most;
  for (int i = 0; i < atom->nlocal; i++) mine = MAX(mine, size_restart(i));
  MPI_Allreduce(&mine, &most, 1, MPI_INT, MPI_MAX, world);
  return most;
}

void FixRve::write_restart(FILE *fp)
{
  if (comm->me == 0) impl->write_restart_head(fp);
}

void FixRve::restart(char *buf)
{
  impl->read_restart_head(buf);
}

/// Reads all words at once.
int FixRve::modify_param(int narg, char **arg)
{
  impl->modify(narg, arg);
  return narg;
}
