// SPDX-License-Identifier: GPL-2.0-only

#include "fix_rve_jobs.h"

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
#include <sstream>

using namespace LAMMPS_NS;

// Version of the contents of restart files; it increases with every change of the contents. Files
// of versions 1 and 2 have no version number.
static constexpr int RESTART_VERSION = 6;

namespace {

// Head of the fix in a restart file, before the text of its settings. All members have eight bytes,
// so that there is no padding.
struct RestartHead {
  double version;    // negative, because files without a version begin with the time step
  double step, dt, dt_auto, dt_fraction, mass_scaling;
  std::uint64_t num_packings, packings;    // number and checksum of the packings
  std::uint64_t length, checksum_of_account;
  std::uint64_t checksum;    // checksum of the members above

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

static std::string text_of_dt(bool is_auto, double fraction, double dt)
{
  return is_auto ? "auto " + rve::number(fraction) : rve::number(dt);
}

static std::string text_of_dt(const FixRveSettings &settings)
{
  return text_of_dt(settings.dt_auto, settings.dt_fraction, settings.dt);
}

/// Returns a text as "skin automatic -> 0.001" for each entry of `now` that differs from `before`.
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

template <int D> void RveChanges<D>::write_restart_head(FILE *fp) const
{
  std::string account;
  for (const auto &[keyword, value] : rves.settings.account())
    account += keyword + " " + value + "\n";
  if (rves.settings.material.law)
    account += std::string("contact ") + rve::word_of(*rves.settings.material.law) + "\n";
  for (const auto &parameter : rve::MATERIAL_PARAMETERS)
    if (rves.settings.material[parameter.member])    // the format {} writes all digits
      account +=
          fmt::format("{} {}\n", parameter.keyword, *rves.settings.material[parameter.member]);
  RestartHead head;
  head.version = -RESTART_VERSION;
  head.step = static_cast<double>(update->ntimestep);
  head.dt = rves.dt;
  head.dt_auto = rves.settings.dt_auto ? 1.0 : 0.0;
  head.dt_fraction = rves.settings.dt_fraction;
  head.mass_scaling = rves.settings.mass_scaling.value_or(1.0);
  head.num_packings = rves.packings.size();
  head.packings = rves.packings.identity();
  head.length = account.size();
  head.checksum_of_account = rve::checksum_of(account.data(), account.size());
  head.checksum = head.own_checksum();
  const int size = static_cast<int>(sizeof(head) + account.size());
  fwrite(&size, sizeof(int), 1, fp);
  fwrite(&head, sizeof(head), 1, fp);
  fwrite(account.data(), 1, account.size(), fp);
}

template <int D> void RveChanges<D>::read_restart_head(const char *buf)
{
  double version;
  memcpy(&version, buf, sizeof(version));
  if (version != -RESTART_VERSION) {
    const bool is_number = version <= -3.0 && version > -1000.0 && version == std::floor(version);
    if (!is_number && !(version > 0.0 && std::isfinite(version)))
      error->all(FLERR,
                 "fix rve {}: the header of this fix in the restart file is damaged: its version "
                 "is {}; use an earlier file",
                 rves.fix->id, version);
    error->all(FLERR,
               "fix rve {}: the restart file has version {} of the data of this fix; this program "
               "reads version {}",
               rves.fix->id, is_number ? std::to_string(static_cast<int>(-version)) : "1 or 2",
               RESTART_VERSION);
  }
  RestartHead head;
  memcpy(&head, buf, sizeof(head));
  if (head.checksum != head.own_checksum() ||
      head.checksum_of_account != rve::checksum_of(buf + sizeof(head), head.length))
    error->all(FLERR,
               "fix rve {}: the header of this fix in the restart file is damaged: its checksum "
               "does not match; use an earlier file",
               rves.fix->id);

  rves.restart_step = head.step;
  std::map<std::string, std::string> account;
  std::istringstream text(std::string(buf + sizeof(head), head.length));
  for (std::string keyword, value; std::getline(text, keyword, ' ') && std::getline(text, value);)
    account[keyword] = value;
  changes = differences(account, rves.settings.account());
  path_has_changed = account["path"] != rves.settings.path.text;

  if (head.num_packings != static_cast<std::uint64_t>(rves.packings.size()) ||
      head.packings != rves.packings.identity()) {
    changes.insert(changes.begin(),
                   fmt::format("packings: {} with checksum {:016x} -> {} with checksum {:016x}",
                               head.num_packings, head.packings, rves.packings.size(),
                               rves.packings.identity()));
    error->all(FLERR,
               "fix rve {}: the RVEs of the restart file were made of other packings than those of "
               "this fix ({}); give the packing files of the run before, unchanged, or give the "
               "fix another ID for RVEs of these packings",
               rves.fix->id, utils::join_words(changes, ", "));
  }

  // settings that the script does not give keep the values of the restart file
  const bool is_auto = head.dt_auto != 0.0;
  const std::string dt_before = text_of_dt(is_auto, head.dt_fraction, head.dt);
  if (!rves.settings.dt_given) {
    rves.settings.dt_auto = is_auto;
    rves.settings.dt_fraction = head.dt_fraction;
    rves.settings.dt = head.dt;
  }
  const std::string dt_now = text_of_dt(rves.settings);
  if (dt_before != dt_now) changes.push_back(fmt::format("dt {} -> {}", dt_before, dt_now));
  time_step.is_old = rves.settings.dt_auto != is_auto ||
      (is_auto ? rves.settings.dt_fraction != head.dt_fraction : rves.settings.dt != head.dt);
  rves.dt = time_step.is_old ? rves.settings.dt : head.dt;

  MaterialArguments kept;
  const auto contact = account.find("contact");
  if (contact != account.end() && !rves.settings.material.law)
    rves.settings.material.law = kept.law = rve::contact_law_of(contact->second);
  for (const auto &parameter : rve::MATERIAL_PARAMETERS) {
    const auto word = account.find(parameter.keyword);
    if (word == account.end() || rves.settings.material[parameter.member]) continue;
    rves.settings.material[parameter.member] = kept[parameter.member] = std::stod(word->second);
  }
  mass_scaling_of_rves = head.mass_scaling;
  const double scaling_before = rves.settings.mass_scaling.value_or(1.0);
  const double scaling = rves.settings.mass_scaling.value_or(head.mass_scaling);
  rves.settings.mass_scaling = scaling;
  if (kept.any() || scaling != scaling_before)    // this changes RVEs that are made later
    collectively(lmp, fmt::format("fix rve {}", rves.fix->id),
                 [&] { rves.packings.change(kept, scaling, scaling_before); });
  is_continued = true;

  // The RVEs are read after this head, so their numbers of grains are not known yet. The check
  // assumes the smallest packing for all of them, so that it stops no run that has enough memory.
  const auto in_group =
      std::count_if(atom->mask, atom->mask + atom->nlocal,
                    [groupbit = rves.fix->groupbit](int mask) { return (mask & groupbit) != 0; });
  rve_memory.check(std::vector<int>(in_group, rves.packings.fewest_grains()));
}

template <int D> void RveChanges<D>::adopt_restart()
{
  if (!is_continued) return;
  is_continued = false;
  rves.has_run = true;
  const auto of_materials = change_materials(rves.settings.material, mass_scaling_of_rves);
  changes.insert(changes.end(), of_materials.begin(), of_materials.end());
  if (time_step.is_old) time_step.choose();
  if (path_has_changed && rves.settings.path.any())
    drives.resume_paths(*rves.settings.path.template of<D>());
  if (comm->me == 0 && !changes.empty())
    utils::logmesg(lmp,
                   "fix rve {}: continues the run that wrote the restart file with changes: {}\n",
                   rves.fix->id, utils::join_words(changes, ", "));
  changes.clear();
}

template <int D>
std::vector<std::string> RveChanges<D>::change_materials(const MaterialArguments &words,
                                                         double mass_scaling_before)
{
  const double mass_scaling = rves.settings.mass_scaling.value_or(1.0);
  constexpr int NUM_PARAMETERS = std::size(rve::MATERIAL_PARAMETERS);
  std::vector<int> changed;
  std::vector<rve::Material> materials;
  // Extremes of each parameter over the RVEs in which the parameter changes. Numbers 0 and 1 are
  // the negative of the least value and the largest value before the change; numbers 2 and 3 are
  // these values after the change.
  double range[NUM_PARAMETERS][4];
  int count[NUM_PARAMETERS] = {};
  std::fill_n(&range[0][0], 4 * NUM_PARAMETERS, -HUGE_VAL);
  const rve::ContactLaw law_before = rves.points->contacts().law;
  int with_other_law = 0;
  const std::string who = fmt::format("fix rve {}", rves.fix->id);
  const std::vector<int> slots = rves.slots_of(rves.atoms_with_rve());
  std::vector<rve::Material> wanted;
  collectively(lmp, who, [&] {
    for (const int slot : slots) {
      wanted.push_back(rves.points->material(slot));
      change_material(wanted.back(), words, mass_scaling, mass_scaling_before);
    }
  });
  for (std::size_t n = 0; n < slots.size(); ++n) {
    const rve::Material before = rves.points->material(slots[n]), after = wanted[n];
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
    changed.push_back(slots[n]);
    materials.push_back(after);
  }
  collectively(lmp, who, [&] {
    if (!changed.empty()) rves.points->set_materials(changed, materials);
    rves.points->expect(rves.packings.contacts());    // contact model of RVEs that are made later
  });

  MPI_Allreduce(MPI_IN_PLACE, range, 4 * NUM_PARAMETERS, MPI_DOUBLE, MPI_MAX, world);
  MPI_Allreduce(MPI_IN_PLACE, count, NUM_PARAMETERS, MPI_INT, MPI_SUM, world);
  MPI_Allreduce(MPI_IN_PLACE, &with_other_law, 1, MPI_INT, MPI_SUM, world);
  std::vector<std::string> list;
  if (mass_scaling != mass_scaling_before)
    list.push_back(fmt::format("mass_scaling {} -> {}", rve::number(mass_scaling_before),
                               rve::number(mass_scaling)));
  const auto text = [](double least, double most) {
    return least == most ? rve::number(least) : rve::number(least) + " to " + rve::number(most);
  };
  if (with_other_law > 0)
    list.push_back(fmt::format("contact {} -> {} ({} RVEs)", rve::word_of(law_before),
                               rve::word_of(rves.points->contacts().law), with_other_law));
  for (int k = 0; k < NUM_PARAMETERS; ++k) {
    if (count[k] == 0) continue;
    list.push_back(fmt::format("{} {} -> {} ({} RVEs)", rve::MATERIAL_PARAMETERS[k].keyword,
                               text(-range[k][0], range[k][1]), text(-range[k][2], range[k][3]),
                               count[k]));
  }
  if (!list.empty()) time_step.is_old = true;
  return list;
}

template <int D> void RveChanges<D>::modify(int narg, char **arg)
{
  adopt_restart();
  const FixRveSettings wanted = rves.settings.modified(lmp, narg, arg);
  const std::vector<int> slots = rves.slots_of(rves.atoms_with_rve());
  const FixRveSettings settings_before = rves.settings;
  const RvePackingsOf<D> packings_before = rves.packings;
  const double dt_before = rves.dt;
  const bool was_warned = time_step.has_warned;
  const bool changes_materials = wanted.material.any() || wanted.mass_scaling.has_value();
  const auto points_before = rves.points->keep(slots, changes_materials);
  try {
    apply(wanted);
  } catch (const LAMMPSException &) {
    // restores everything for callers that catch the error and continue
    rves.settings = settings_before;
    rves.packings = packings_before;
    rves.dt = dt_before;
    time_step.has_warned = was_warned;
    rves.points->set_options(rves.settings.macro_step);
    rves.points->restore(points_before);
    time_step.is_old = false;
    rves.find_variables();
    throw;
  }
}

template <int D> void RveChanges<D>::apply(FixRveSettings wanted)
{
  const MaterialArguments words = wanted.material;
  const double scaling_before = rves.settings.mass_scaling.value_or(1.0);
  const double scaling = wanted.mass_scaling.value_or(scaling_before);
  const bool dt_given = wanted.dt_given;
  const std::string dt_before = text_of_dt(rves.settings);
  std::vector<std::string> list = differences(rves.settings.account(), wanted.account());

  // RVEs that are made later get the same changes of the material as existing ones
  wanted.material = rves.settings.material;
  wanted.material.add(words);
  wanted.mass_scaling = scaling;
  wanted.dt_given = rves.settings.dt_given || dt_given;
  if (wanted.path.of<D>() !=
      rves.settings.path.template of<D>())    // RVEs begin a new path at its start
    for (const int i : rves.atoms_with_rve())
      rves.points->path(rves.slot[i]) = macro::PathState<D>();
  rves.settings = wanted;
  rves.find_variables();
  if (words.any() || scaling != scaling_before) {
    collectively(lmp, fmt::format("fix_modify {}", rves.fix->id),
                 [&] { rves.packings.change(words, scaling, scaling_before); });
    const auto of_materials = change_materials(words, scaling_before);
    list.insert(list.end(), of_materials.begin(), of_materials.end());
    time_step.is_old = true;
  }
  const std::string dt_now = text_of_dt(rves.settings);
  if (dt_now != dt_before) list.push_back(fmt::format("dt {} -> {}", dt_before, dt_now));
  rves.points->set_options(rves.settings.macro_step);
  rves.progress.set_interval(rves.settings.progress_interval);
  time_step.has_warned = false;
  if (dt_given || time_step.is_old) time_step.choose();
  if (comm->me == 0 && !list.empty())
    utils::logmesg(lmp, "fix rve {}: from step {} on, {}\n", rves.fix->id, update->ntimestep,
                   utils::join_words(list, ", "));
}

template <int D> void RveChanges<D>::warn_of_loss() const
{
  // no communication, because after an error the other ranks need not call this function
  if (!update || comm->me != 0 || !rves.has_run) return;
  error->warning(FLERR,
                 "fix rve {}: the fix is deleted with its RVEs, which have advanced; a new fix rve "
                 "starts from packings. Use fix_modify {} to change drive, servo, time step or "
                 "material of the RVEs and keep them",
                 rves.fix->id, rves.fix->id);
}

template class LAMMPS_NS::RveChanges<2>;
template class LAMMPS_NS::RveChanges<3>;
