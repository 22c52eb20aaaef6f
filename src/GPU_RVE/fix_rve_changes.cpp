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

// What changes of RVEs that are there: in a run that is continued from a restart file, and by fix_modify.

#include "fix_rve_impl.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "rve/core/checksum.h"
#include "rve/core/error.h"
#include "rve/engine/no_padding.h"
#include "update.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>

using namespace LAMMPS_NS;

// Of what restart files hold: raise it with every change of that. Files before version 3 had no number.
static constexpr int RESTART_VERSION = 6;

namespace {

// In front of the account of settings. All members have eight bytes: nothing lies between them.
struct RestartHead {
  double version;    // negative, because files without a version begin with the time step
  double step, dt, dt_auto, dt_fraction, mass_scaling;
  std::uint64_t num_packings, packings;    // their number, and their identity
  std::uint64_t length, checksum_of_account;
  std::uint64_t checksum;    // of all above

  std::uint64_t own_checksum() const
  {
    return rve::checksum_of(this, sizeof(RestartHead) - sizeof(checksum));
  }
};
static_assert(rve::has_no_padding(&RestartHead::version, &RestartHead::step, &RestartHead::dt,
                                  &RestartHead::dt_auto, &RestartHead::dt_fraction,
                                  &RestartHead::mass_scaling, &RestartHead::num_packings,
                                  &RestartHead::packings, &RestartHead::length,
                                  &RestartHead::checksum_of_account, &RestartHead::checksum));

}    // namespace

/* ---------------------------------------------------------------------- */

static std::string text_of_dt(bool is_auto, double fraction, double dt)
{
  return is_auto ? "auto " + rve::number(fraction) : rve::number(dt);
}

static std::string joined(const std::vector<std::string> &parts)
{
  std::string text;
  for (const std::string &part : parts) text += (text.empty() ? "" : ", ") + part;
  return text;
}

/// "skin automatic -> 0.001" for each entry that differs.
static std::vector<std::string> differences(const std::map<std::string, std::string> &before,
                                            const std::map<std::string, std::string> &now)
{
  std::vector<std::string> list;
  for (const auto &[keyword, value] : now) {
    const auto old = before.find(keyword);
    if (old != before.end() && old->second != value)
      list.push_back(fmt::format("{} {} -> {}", keyword, old->second, value));
  }
  return list;
}

/* ----------------------------------------------------------------------
   with several files for one write, atoms and this head may be of different steps, if a run ended while it wrote them
------------------------------------------------------------------------- */

template <int D> void FixRve::ImplOf<D>::write_restart_head(FILE *fp) const
{
  std::string account;
  for (const auto &[keyword, value] : settings.account()) account += keyword + " " + value + "\n";
  if (settings.material.law)
    account += std::string("contact ") + rve::word_of(*settings.material.law) + "\n";
  for (const auto &parameter : rve::MATERIAL_PARAMETERS)
    if (settings.material[parameter.member])    // all digits
      account += fmt::format("{} {}\n", parameter.keyword, *settings.material[parameter.member]);
  RestartHead head;
  head.version = -RESTART_VERSION;
  head.step = static_cast<double>(fix->update->ntimestep);
  head.dt = dt;
  head.dt_auto = settings.dt_auto ? 1.0 : 0.0;
  head.dt_fraction = settings.dt_fraction;
  head.mass_scaling = settings.mass_scaling.value_or(1.0);
  head.num_packings = packings.size();
  head.packings = packings.identity();
  head.length = account.size();
  head.checksum_of_account = rve::checksum_of(account.data(), account.size());
  head.checksum = head.own_checksum();
  const int size = static_cast<int>(sizeof(head) + account.size());
  fwrite(&size, sizeof(int), 1, fp);
  fwrite(&head, sizeof(head), 1, fp);
  fwrite(account.data(), 1, account.size(), fp);
}

template <int D> void FixRve::ImplOf<D>::read_restart_head(const char *buf)
{
  double version;
  memcpy(&version, buf, sizeof(version));
  if (version != -RESTART_VERSION) {
    const bool is_number = version <= -3.0 && version > -1000.0 && version == std::floor(version);
    if (!is_number && !(version > 0.0 && std::isfinite(version)))
      fix->error->all(FLERR,
                      "fix rve {}: its head in the restart file is damaged: the version reads {}; "
                      "use the restart file before",
                      fix->id, version);
    fix->error->all(FLERR,
                    "fix rve: the RVEs in the restart file have version {}; this fix reads version "
                    "{}",
                    is_number ? std::to_string(static_cast<int>(-version))
                              : "1 or 2, without a number",
                    RESTART_VERSION);
  }
  RestartHead head;
  memcpy(&head, buf, sizeof(head));
  if (head.checksum != head.own_checksum() ||
      head.checksum_of_account != rve::checksum_of(buf + sizeof(head), head.length))
    fix->error->all(FLERR,
                    "fix rve {}: its head in the restart file is damaged: the checksum does not "
                    "match; use the restart file before",
                    fix->id);

  restart_step = head.step;
  std::map<std::string, std::string> account;
  std::size_t begin = 0;
  const std::string text(buf + sizeof(head), head.length);
  while (begin < text.size()) {
    const std::size_t blank = text.find(' ', begin), end = text.find('\n', begin);
    account[text.substr(begin, blank - begin)] = text.substr(blank + 1, end - blank - 1);
    begin = end + 1;
  }
  changes = differences(account, settings.account());
  path_has_changed = account["path"] != settings.path.text;

  if (head.num_packings != static_cast<std::uint64_t>(packings.size()) ||
      head.packings != packings.identity()) {
    changes.insert(changes.begin(),
                   fmt::format("packings: {} with checksum {:016x} -> {} with checksum {:016x}",
                               head.num_packings, head.packings, packings.size(),
                               packings.identity()));
    fix->error->all(FLERR,
                    "fix rve {}: the RVEs of the restart file keep their grains and were made of "
                    "other packings than those of this fix ({}); give the packing files of the "
                    "run before, unchanged, or give the fix another ID for RVEs of these packings",
                    fix->id, joined(changes));
  }

  // what the script does not say stays
  const bool is_auto = head.dt_auto != 0.0;
  const std::string dt_before = text_of_dt(is_auto, head.dt_fraction, head.dt);
  if (!settings.dt_given) {
    settings.dt_auto = is_auto;
    settings.dt_fraction = head.dt_fraction;
    settings.dt = head.dt;
  }
  const std::string dt_now = text_of_dt(settings.dt_auto, settings.dt_fraction, settings.dt);
  if (dt_before != dt_now) changes.push_back(fmt::format("dt {} -> {}", dt_before, dt_now));
  time_step_is_old = settings.dt_auto != is_auto ||
      (is_auto ? settings.dt_fraction != head.dt_fraction : settings.dt != head.dt);
  dt = time_step_is_old ? settings.dt : head.dt;

  MaterialWords unsaid;
  const auto contact = account.find("contact");
  if (contact != account.end() && !settings.material.law)
    settings.material.law = unsaid.law = rve::contact_law_of(contact->second);
  for (const auto &parameter : rve::MATERIAL_PARAMETERS) {
    const auto word = account.find(parameter.keyword);
    if (word == account.end() || settings.material[parameter.member]) continue;
    settings.material[parameter.member] = unsaid[parameter.member] = std::stod(word->second);
  }
  mass_scaling_of_rves = head.mass_scaling;
  const double scaling_before = settings.mass_scaling.value_or(1.0);
  const double scaling = settings.mass_scaling.value_or(head.mass_scaling);
  settings.mass_scaling = scaling;
  if (unsaid.any() || scaling != scaling_before) {
    // of RVEs that are made later
    collectively(fix->lmp, fmt::format("fix rve {}", fix->id),
                 [&] { packings.change(unsaid, scaling, scaling_before); });
  }
  continues = true;

  // the RVEs come next. How many grains they have is not known yet: no run is refused that has the memory.
  const Atom *atom = fix->atom;
  const auto in_group =
      std::count_if(atom->mask, atom->mask + atom->nlocal,
                    [groupbit = fix->groupbit](int mask) { return (mask & groupbit) != 0; });
  check_memory(std::vector<int>(in_group, packings.fewest_grains()));
}

/* ----------------------------------------------------------------------
   a continued run begins: all RVEs of the restart file are there
------------------------------------------------------------------------- */

template <int D> void FixRve::ImplOf<D>::adopt_restart()
{
  if (!continues) return;
  continues = false;
  has_run = true;
  for (const std::string &change : change_materials(settings.material, mass_scaling_of_rves))
    changes.push_back(change);
  if (time_step_is_old) choose_time_step();
  if (path_has_changed && settings.path.any()) resume_paths(*settings.path.of<D>());
  if (fix->comm->me == 0 && !changes.empty())
    utils::logmesg(fix->lmp,
                   "fix rve {}: continues the run that wrote the restart file with changes: {}\n",
                   fix->id, joined(changes));
  changes.clear();
}

/* ---------------------------------------------------------------------- */

template <int D> void FixRve::ImplOf<D>::resume_paths(const macro::LoadPathsOf<D> &paths)
{
  points->complete();
  for (const int i : atoms_with_rve())
    if (points->path(slot[i]).path >= 0)
      guarded([&] { paths.resume(points->path(slot[i]), point(i).result); }, i);
}

/* ----------------------------------------------------------------------
   of all RVEs there are, whatever they were made of; collective
------------------------------------------------------------------------- */

template <int D>
std::vector<std::string> FixRve::ImplOf<D>::change_materials(const MaterialWords &words,
                                                             double mass_scaling_before)
{
  const double mass_scaling = settings.mass_scaling.value_or(1.0);
  constexpr int NUM_PARAMETERS = std::size(rve::MATERIAL_PARAMETERS);
  std::vector<int> changed;
  std::vector<rve::Material> materials;
  // least and largest value before and after, of the RVEs where it changes; as largest values: -least
  double range[NUM_PARAMETERS][4];
  int count[NUM_PARAMETERS] = {};
  std::fill_n(&range[0][0], 4 * NUM_PARAMETERS, -HUGE_VAL);
  const rve::ContactLaw law_before = points->contacts().law;
  int with_other_law = 0;
  const std::string who = fmt::format("fix rve {}", fix->id);
  std::vector<rve::Material> wanted;
  collectively(fix->lmp, who, [&] {
    for (const int i : atoms_with_rve()) {
      wanted.push_back(points->material(slot[i]));
      change_material(wanted.back(), words, mass_scaling, mass_scaling_before);
    }
  });
  std::size_t next = 0;
  for (const int i : atoms_with_rve()) {
    const rve::Material before = points->material(slot[i]), after = wanted[next++];
    bool differs = after.law != before.law;
    if (differs) ++with_other_law;
    for (int k = 0; k < NUM_PARAMETERS; ++k) {
      const double a = before.*rve::MATERIAL_PARAMETERS[k].member,
                   b = after.*rve::MATERIAL_PARAMETERS[k].member;
      if (a == b) continue;
      differs = true;
      ++count[k];
      const double values[] = {-a, a, -b, b};
      for (int m = 0; m < 4; ++m) range[k][m] = std::max(range[k][m], values[m]);
    }
    if (!differs) continue;
    changed.push_back(slot[i]);
    materials.push_back(after);
  }
  collectively(fix->lmp, who, [&] {
    if (!changed.empty()) points->set_materials(changed, materials);
    points->expect(packings.contacts());    // of RVEs that are made later
  });

  MPI_Allreduce(MPI_IN_PLACE, range, 4 * NUM_PARAMETERS, MPI_DOUBLE, MPI_MAX, fix->world);
  MPI_Allreduce(MPI_IN_PLACE, count, NUM_PARAMETERS, MPI_INT, MPI_SUM, fix->world);
  MPI_Allreduce(MPI_IN_PLACE, &with_other_law, 1, MPI_INT, MPI_SUM, fix->world);
  std::vector<std::string> list;
  if (mass_scaling != mass_scaling_before)
    list.push_back(fmt::format("mass_scaling {} -> {}", rve::number(mass_scaling_before),
                               rve::number(mass_scaling)));
  const auto text = [](double least, double most) {
    return least == most ? rve::number(least) : rve::number(least) + " to " + rve::number(most);
  };
  if (with_other_law > 0)
    list.push_back(fmt::format("contact {} -> {} ({} RVEs)", rve::word_of(law_before),
                               rve::word_of(points->contacts().law), with_other_law));
  for (int k = 0; k < NUM_PARAMETERS; ++k) {
    if (count[k] == 0) continue;
    list.push_back(fmt::format("{} {} -> {} ({} RVEs)", rve::MATERIAL_PARAMETERS[k].keyword,
                               text(-range[k][0], range[k][1]), text(-range[k][2], range[k][3]),
                               count[k]));
  }
  if (!list.empty()) time_step_is_old = true;
  return list;
}

/* ----------------------------------------------------------------------
   another material or another wish: of packings and RVEs alike, since atoms may get RVEs later
------------------------------------------------------------------------- */

template <int D> void FixRve::ImplOf<D>::choose_time_step()
{
  time_step_is_old = false;
  const std::vector<double> &bounds = packings.bounds();
  const double of_packings = *std::min_element(bounds.begin(), bounds.end());
  const std::vector<int> advancing = advancing_atoms();
  // with every contact lost an RVE bears a step some times longer than that of its packing
  const LeastBound rves = least_time_step(advancing, 100.0 * of_packings);
  if (settings.dt_auto) {
    const double bound = rves.atom == MAXTAGINT ? of_packings : rves.dt;
    dt = settings.dt_fraction * bound;
    if (fix->comm->me == 0)
      utils::logmesg(fix->lmp,
                     "fix rve {}: DEM time step is now {} (step {}, stability bound {})\n", fix->id,
                     rve::number(dt), fix->update->ntimestep, rve::number(bound));
    points->note_check(slots_of(advancing));
    return;
  }
  dt = settings.dt;
  const double used = clock(fix->update->dt).dt;
  if (rves.atom == MAXTAGINT)
    check_time_step(used, of_packings, "its packings");
  else
    check_time_step(
        used, rves.dt,
        fmt::format("the RVE of atom {} at step {}", rves.atom, fix->update->ntimestep));
  // not of a step that was refused
  points->note_check(slots_of(advancing));
}

/* ---------------------------------------------------------------------- */

template <int D> void FixRve::ImplOf<D>::modify(int narg, char **arg)
{
  adopt_restart();
  const FixRveSettings wanted = settings.modified(fix->lmp, narg, arg);
  const std::vector<int> atoms = atoms_with_rve(), slots = slots_of(atoms);
  const FixRveSettings settings_before = settings;
  const RvePackingsOf<D> packings_before = packings;
  const double dt_before = dt;
  const bool was_warned = warned_dt;
  const bool changes_materials = wanted.material.any() || wanted.mass_scaling.has_value();
  const auto points_before = points->keep(slots, changes_materials);
  try {
    apply(wanted);
  } catch (const LAMMPSException &) {
    // a caller that goes on has what it had before
    settings = settings_before;
    packings = packings_before;
    dt = dt_before;
    warned_dt = was_warned;
    points->set_options(settings.macro_step);
    points->restore(points_before);
    time_step_is_old = false;
    find_variables();
    throw;
  }
}

/* ---------------------------------------------------------------------- */

template <int D> void FixRve::ImplOf<D>::apply(FixRveSettings wanted)
{
  const MaterialWords words = wanted.material;
  const double scaling_before = settings.mass_scaling.value_or(1.0);
  const double scaling = wanted.mass_scaling.value_or(scaling_before);
  const bool dt_given = wanted.dt_given;
  const std::string dt_before = text_of_dt(settings.dt_auto, settings.dt_fraction, settings.dt);
  std::vector<std::string> list = differences(settings.account(), wanted.account());

  // RVEs that are made later begin like those that are there
  wanted.material = settings.material;
  wanted.material.add(words);
  wanted.mass_scaling = scaling;
  wanted.dt_given = settings.dt_given || dt_given;
  if (wanted.path.of<D>() != settings.path.of<D>())    // another path begins anew
    for (const int i : atoms_with_rve()) points->path(slot[i]) = macro::PathState<D>();
  settings = wanted;
  find_variables();
  if (words.any() || scaling != scaling_before) {
    collectively(fix->lmp, fmt::format("fix_modify of fix rve {}", fix->id),
                 [&] { packings.change(words, scaling, scaling_before); });
    for (const std::string &change : change_materials(words, scaling_before))
      list.push_back(change);
    time_step_is_old = true;
  }
  const std::string dt_now = text_of_dt(settings.dt_auto, settings.dt_fraction, settings.dt);
  if (dt_now != dt_before) list.push_back(fmt::format("dt {} -> {}", dt_before, dt_now));
  points->set_options(settings.macro_step);
  progress.set_interval(settings.progress_interval);
  warned_dt = false;
  if (dt_given || time_step_is_old) choose_time_step();
  if (fix->comm->me == 0 && !list.empty())
    utils::logmesg(fix->lmp, "fix rve {}: from step {} on {}\n", fix->id, fix->update->ntimestep,
                   joined(list));
}

/* ----------------------------------------------------------------------
   the fix goes, not LAMMPS, which takes its clock away before its fixes
------------------------------------------------------------------------- */

template <int D> void FixRve::ImplOf<D>::warn_of_loss() const
{
  // no communication: a rank may be alone here, after an error
  if (!fix->update || fix->comm->me != 0 || !has_run) return;
  fix->error->warning(
      FLERR,
      "fix rve {} is deleted, and with it its RVEs, which have advanced: a new fix rve "
      "begins with packings. To change drive, servo, time step or material of "
      "RVEs and keep them, use fix_modify {}",
      fix->id, fix->id);
}

template void FixRve::ImplOf<2>::write_restart_head(FILE *) const;
template void FixRve::ImplOf<2>::read_restart_head(const char *);
template void FixRve::ImplOf<2>::adopt_restart();
template void FixRve::ImplOf<2>::resume_paths(const macro::LoadPaths &);
template std::vector<std::string> FixRve::ImplOf<2>::change_materials(const MaterialWords &,
                                                                      double);
template void FixRve::ImplOf<2>::choose_time_step();
template void FixRve::ImplOf<2>::modify(int, char **);
template void FixRve::ImplOf<2>::apply(FixRveSettings);
template void FixRve::ImplOf<2>::warn_of_loss() const;
template void FixRve::ImplOf<3>::write_restart_head(FILE *) const;
template void FixRve::ImplOf<3>::read_restart_head(const char *);
template void FixRve::ImplOf<3>::adopt_restart();
template void FixRve::ImplOf<3>::resume_paths(const macro::LoadPathsOf<3> &);
template std::vector<std::string> FixRve::ImplOf<3>::change_materials(const MaterialWords &,
                                                                      double);
template void FixRve::ImplOf<3>::choose_time_step();
template void FixRve::ImplOf<3>::modify(int, char **);
template void FixRve::ImplOf<3>::apply(FixRveSettings);
template void FixRve::ImplOf<3>::warn_of_loss() const;
