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
#include "update.h"

#include <algorithm>

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
  require_mechanical_units(lmp, fmt::format("fix rve {}", id));
  if (!atom->tag_enable) error->all(FLERR, "fix rve {}: atoms must have IDs", id);
  if (group->count(igroup) == 0)
    error->all(FLERR, "fix rve {}: group {} has no atoms; every atom of the group gets an RVE", id,
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
    error->all(FLERR, "fix rve {}: the dimension is {}; it must be 2 for packings of disks", id,
               domain->dimension);
  impl = Impl::make(this, std::move(settings));
  warn_of_dropped_records(lmp, fmt::format("fix rve {}", id));
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
    error->all(FLERR,
               "fix rve {}: minimize cannot be used, because RVEs advance in time only; use run",
               id);
  if (utils::strmatch(update->integrate_style, "^respa"))
    error->all(FLERR, "fix rve {}: run_style is {}; it must be verlet", id,
               update->integrate_style);
  if (impl->settings.driver == RveDriver::Mpm && modify->get_fix_by_style("^mpm$").empty())
    error->all(FLERR, "fix rve {}: drive mpm requires a fix mpm, which is not defined", id);

  if (utils::strmatch(lmp->input->command, "^rerun"))
    error->all(FLERR,
               "fix rve {}: rerun cannot be used, because a dump file does not contain the history "
               "of RVEs; delete the fix before, or continue from a restart file",
               id);
  claim_integration();
  set_up_without_pairs(lmp);
  impl->init();
}

/// Sets time_integrate so that LAMMPS counts one fix that integrates. LAMMPS warns if there is no
/// such fix, and if several fixes integrate the same atoms. RVEs can advance while no fix moves
/// their atoms, or while another fix moves them.
void FixRve::claim_integration()
{
  time_integrate = 1;
  bool is_before = true;    // of several fixes rve, only the first is counted
  for (const Fix *other : modify->get_fix_list()) {
    if (other == this)
      is_before = false;
    else if (other->time_integrate && (is_before || !dynamic_cast<const FixRve *>(other)))
      time_integrate = 0;
  }
}

void FixRve::setup(int)
{
  // all fixes are initialized here, and each fix mpm has called constitutive() for its models
  if (impl->settings.driver == RveDriver::Mpm && !impl->is_material)
    error->all(
        FLERR,
        "fix rve {}: the drive is mpm, but no model of a fix mpm uses this fix, and its RVEs would "
        "never advance; give fix mpm the keyword model {} rve {}, or choose another drive",
        id, group->names[igroup], id);
  impl->setup();
}

void FixRve::final_integrate()
{
  impl->final_integrate();
}

void FixRve::end_of_step()
{
  impl->end_of_step();
}

void FixRve::post_run()
{
  impl->post_run();
  time_integrate = 1;    // init() of the next run changes it
}

FixRve *FixRve::find(LAMMPS *lmp, const std::string &id, const std::string &who)
{
  Error *error = lmp->error;
  if (id.empty()) {
    const auto fixes = lmp->modify->get_fix_by_style("^rve$");
    if (fixes.empty()) error->all(FLERR, "{}: no fix of style rve is defined", who);
    if (fixes.size() > 1)
      error->all(FLERR, "{}: there are {} fixes of style rve; choose one with fix ID", who,
                 fixes.size());
    return dynamic_cast<FixRve *>(fixes[0]);
  }
  Fix *fix = lmp->modify->get_fix_by_id(id);
  if (!fix) error->all(FLERR, "{}: fix {} does not exist", who, id);
  auto *found = dynamic_cast<FixRve *>(fix);
  if (!found) error->all(FLERR, "{}: fix {} has style {}; it must be rve", who, id, fix->style);
  return found;
}

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
    error->all(FLERR, "fix rve {}: the drive must be mpm, because a model of fix mpm uses this fix",
               id);
  impl->is_material = true;
  if constexpr (D == 2) {
    return impl->material_of_plane();
  } else {
    if (!impl->material_of_space())
      error->all(FLERR,
                 "fix rve {}: RVEs of disks cannot be a model of fix mpm in three dimensions; use "
                 "packings of spheres",
                 id);
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

/// The per-atom array holds the slot of the RVE of the atom in the engine, or -1 without an RVE.
void FixRve::grow_arrays(int nmax)
{
  impl->slot.resize(nmax, -1);
}

void FixRve::copy_arrays(int i, int j, int delflag)
{
  impl->finish();    // an advance that is under way uses the slots of its atoms
  if (delflag && impl->slot[j] >= 0) impl->remove(j);
  impl->slot[j] = impl->slot[i];
}

void FixRve::set_arrays(int i)
{
  impl->finish();
  impl->slot[i] = -1;
}

/// Packs the header of restart records, then the record of the RVE if there is one.
int FixRve::pack_exchange(int i, double *buf)
{
  const int size = size_restart(i);
  if (size > maxexchange)
    error->one(FLERR,
               "fix rve {}: the RVE of atom {} takes {} values, more than the {} that were "
               "reserved at the start of the run, because its neighbor list has more than doubled; "
               "divide the run in two",
               id, atom->tag[i], size, maxexchange);
  return pack_restart(i, buf);
}

int FixRve::unpack_exchange(int nlocal, double *buf)
{
  const int size = static_cast<int>(buf[0]);
  impl->add_record(nlocal, buf + RestartRecords::HEADER, size - RestartRecords::HEADER);
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
  impl->add_record(nlocal, record.values + RestartRecords::HEADER,
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

int FixRve::modify_param(int narg, char **arg)
{
  impl->modify(narg, arg);
  return narg;
}
