// SPDX-License-Identifier: GPL-2.0-only
#include "fix_rve_attached.h"

#include "atom.h"
#include "error.h"
#include "lammps/rve_columns.h"
#include "rve/core/error.h"
#include "rve/core/threads.h"
#include "rve/engine/contact_network.h"
#include "rve/engine/finite_strain.h"
#include "update.h"

#include <algorithm>
#include <cmath>
#include <utility>

using namespace LAMMPS_NS;

/// Returns the largest ratio of an overlap to the sum of the two radii [-].
template <int D> static double largest_overlap(const rve::RveStateOf<D> &state)
{
  double largest = 0.0;
  for (const rve::TouchingPairOf<D> &pair : rve::find_contacts(state))
    largest =
        std::max(largest, pair.overlap / (state.radius[pair.first] + state.radius[pair.second]));
  return largest;
}

template <int D> std::vector<int> AttachedRves<D>::slots_of(const std::vector<int> &atoms) const
{
  std::vector<int> some(atoms.size());
  for (std::size_t k = 0; k < atoms.size(); ++k) some[k] = slot[atoms[k]];
  return some;
}

template <int D>
std::unique_ptr<rve::EngineOf<D>> AttachedRves<D>::empty_engine(rve::Format format) const
{
  rve::Options options = settings.options;
  options.contacts = points->contacts();
  options.format = format;
  options.arithmetic = rve::Arithmetic::Strict;
  return rve::make_engine<D>(options);
}

template <int D> void AttachedRves<D>::add_record(int atom, const double *record, int size)
{
  slot[atom] = -1;
  if (size == 0) return;
  guarded([&] { slot[atom] = points->add_record(record, size); }, atom);
}

template <int D> std::vector<int> AttachedRves<D>::advancing_atoms() const
{
  std::vector<int> atoms = atoms_with_rve();
  atoms.erase(
      std::remove_if(atoms.begin(), atoms.end(), [this](int i) { return points->frozen(slot[i]); }),
      atoms.end());
  return atoms;
}

template <int D> double AttachedRves<D>::dem_steps() const
{
  double steps = 0.0;
  for (const int i : atoms_with_rve()) steps += static_cast<double>(point(i).result.counters.steps);
  return steps;
}

template <int D>
void AttachedRves<D>::check(const Matrix &tensor, const char *what, const char *unit,
                            int atom) const
{
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b)
      if (!std::isfinite(tensor(a, b)))
        error->one(FLERR,
                   "fix rve {}: {} component {} of atom {} is {} {} at step {}; it must be a "
                   "finite number",
                   fix->id, what, rve_component_name(a, b), this->atom->tag[atom], tensor(a, b),
                   unit, update->ntimestep);
}

template <int D> bool AttachedRves<D>::wants_details() const
{
  const int interval = settings.dt_check_interval;
  const auto &paths = settings.path.of<D>();
  return (paths && paths->needs_details()) || (interval && update->ntimestep % interval == 0);
}

template <int D>
void AttachedRves<D>::advance(const std::vector<int> &atoms, const std::vector<Drive> &drives)
{
  finish();
  const int count = static_cast<int>(atoms.size());
  int first_bad = count;
  slots = slots_of(atoms);
  {
    const rve::LightWork work(count, threads());
#pragma omp parallel for num_threads(work.team) reduction(min : first_bad)
    for (int k = 0; k < count; ++k) {
      const Drive &drive = drives[k];
      if (!rve::finite(drive.velocity_gradient) || !rve::finite(drive.stress_goal) ||
          !rve::finite(drive.deformation))
        first_bad = std::min(first_bad, k);
    }
  }
  if (first_bad < count) {
    check(drives[first_bad].velocity_gradient, "velocity gradient", "[1/time]", atoms[first_bad]);
    check(drives[first_bad].stress_goal, "stress goal", "[stress]", atoms[first_bad]);
    check(drives[first_bad].deformation, "deformation increment", "[-]", atoms[first_bad]);
  }
  const bool with_details = wants_details();
  guarded([&] {
    std::vector<int> failed = points->advance(slots, drives, with_details);
    ++num_advances;
    note_copies(atoms);
    if (settings.policy == RvePolicy::Fresh) failed = renew(failed, atoms);
    report(failed, atoms, drives.empty() ? 0.0 : drives.front().dt, false);
  });
}

template <int D> void AttachedRves<D>::note_begin()
{
  checks_postponed = all_on_devices && !wants_details();
  step_of_advance = update->ntimestep;
}

template <int D>
rve::Request *AttachedRves<D>::begin(const std::vector<int> &atoms,
                                     macro::MacroIncrementsOf<D> &increments)
{
  finish();
  note_begin();
  slots = slots_of(atoms);
  rve::Request *const request =
      guarded([&] { return points.as_they_are().begin(slots, increments); });
  if (!request) {
    advance_by_drives(atoms, increments);
    return nullptr;
  }
  under_way = {&atoms, &increments};
  if (checks_postponed) return request;
  finish();
  if (wants_details()) complete();
  return nullptr;
}

template <int D>
void AttachedRves<D>::advance_by_drives(const std::vector<int> &atoms,
                                        macro::MacroIncrementsOf<D> &increments)
{
  const int count = static_cast<int>(atoms.size());
  std::vector<Drive> wanted(count);
  for (int k = 0; k < count; ++k) {
    wanted[k].dt = increments.dt;
    wanted[k].substeps = increments.substeps;
    wanted[k].deformation = increments.increment(k);
  }
  advance(atoms, wanted);
  for (int k = 0; k < count; ++k) increments.take_stress(k, stress(atoms[k]));
}

template <int D>
rve::Request *AttachedRves<D>::plan(const std::vector<int> &atoms, bool is_as_before,
                                    const rve::PointsOnDevice &there,
                                    macro::MacroIncrementsOf<D> &increments)
{
  finish();
  note_begin();
  if (!is_as_before) slots = slots_of(atoms);
  under_way = {&atoms, &increments};
  return guarded(
      [&] { return points.as_they_are().plan(slots, atoms, is_as_before, there, increments); });
}

template <int D> bool AttachedRves<D>::is_as_before(const std::vector<int> &atoms)
{
  const auto has_slot = [this](int number, int atom) { return number == slot[atom]; };
  return std::equal(slots.begin(), slots.end(), atoms.begin(), atoms.end(), has_slot) &&
      points.as_they_are().is_as_before(slots, atoms);
}

template <int D> void AttachedRves<D>::finish()
{
  if (!under_way.increments || !points.as_they_are().is_under_way()) return;
  const UnderWay advance = std::exchange(under_way, {});
  const bool reported_last_advance = std::exchange(reports_last_advance, true);
  guarded([&] {
    const std::vector<int> indices = points.as_they_are().finish();
    ++num_advances;
    note_copies(*advance.atoms);
    std::vector<int> failed;
    for (const int k : indices) failed.push_back(slots[k]);
    if (settings.policy == RvePolicy::Fresh) failed = renew(failed, *advance.atoms);
    report(failed, *advance.atoms, advance.increments->dt, false);
    for (const int k : indices) advance.increments->take_stress(k, stress((*advance.atoms)[k]));
  });
  reports_last_advance = reported_last_advance;
}

template <int D>
void AttachedRves<D>::report(const std::vector<int> &failed, const std::vector<int> &atoms,
                             double dt_dem, bool is_new)
{
  if (failed.empty()) return;
  for (std::size_t k = 0; k < atoms.size(); ++k) {
    const int i = atoms[k];
    if (std::find(failed.begin(), failed.end(), slot[i]) == failed.end()) continue;
    const rve::ResultOf<D> &result = point(i).result;
    // After a failed advance the RVE has its state before the step, and the values are in its
    // result. A new RVE has failed in its present state.
    const double overlap = is_new ? largest_overlap(state(i)) : result.largest_overlap;
    const double void_ratio = is_new ? state(i).void_ratio() : result.void_ratio;
    const std::string message = fmt::format(
        "RVE of atom {} failed at step {}: {} ({}: largest overlap {} of the sum of radii, "
        "overlap_limit {} [radius], void ratio {}, DEM time step {} [time]{})",
        atom->tag[i], reported_step(), rve::describe_status(result.status),
        is_new ? "state of its packing" : "state before this step", rve::number(overlap),
        rve::number(settings.options.overlap_limit), rve::number(void_ratio), rve::number(dt_dem),
        point(i).copies > 1 ? fmt::format(", {} copies side by side", point(i).copies) : "");
    // the policy fresh has no replacement for a packing that fails before its first step
    const bool is_fresh = settings.policy == RvePolicy::Fresh;
    const bool ends_run = settings.policy == RvePolicy::Stop || (is_fresh && is_new);
    const std::string outcome = ends_run ? rve::remedy_of_status(result.status) +
            "; with policy freeze the run continues without this RVE"
        : is_fresh ? "; no packing can replace it, and it is frozen"
                   : "; it is frozen";
    notes.push_back(
        {atom->tag[i], ends_run ? NoteKind::Error : NoteKind::Frozen, message + outcome});
  }
}

template <int D> void AttachedRves<D>::note_copies(const std::vector<int> &atoms)
{
  const std::vector<int> widened = points.as_they_are().take_widened();
  if (widened.empty()) return;
  for (const int i : atoms) {
    if (std::find(widened.begin(), widened.end(), slot[i]) == widened.end()) continue;
    const auto &result = points->point(slot[i]).result;
    notes.push_back(
        {atom->tag[i], NoteKind::Line,
         fmt::format("the cell of the RVE of atom {} became too narrow at step {}; the RVE "
                     "continues as {} copies side by side with {} grains in total",
                     atom->tag[i], reported_step(), points->copies(slot[i]), result.num_grains)});
  }
}

template <int D>
std::vector<int> AttachedRves<D>::renew(const std::vector<int> &failed,
                                        const std::vector<int> &atoms)
{
  if (failed.empty()) return failed;
  std::vector<std::uint32_t> reasons;
  for (const int one : failed) reasons.push_back(points->point(one).result.status);
  const auto renewals = points->renew(failed, packings.all(), clock(update->dt).dt);
  std::vector<int> left;
  for (std::size_t k = 0; k < renewals.size(); ++k) {
    const macro::RenewalOf<D> &renewal = renewals[k];
    if (renewal.packing < 0) {
      left.push_back(renewal.slot);
      continue;
    }
    const auto atom =
        std::find_if(atoms.begin(), atoms.end(), [&](int i) { return slot[i] == renewal.slot; });
    std::string stresses;
    for (int a = 0; a < D; ++a)
      for (int b = a; b < D; ++b)
        stresses += fmt::format("{}{} {} (was {})", stresses.empty() ? "" : ", ",
                                rve_component_name(a, b), rve::number(renewal.stress(a, b)),
                                rve::number(renewal.stress_before(a, b)));
    const tagint id = this->atom->tag[*atom];
    notes.push_back(
        {id, NoteKind::Line,
         fmt::format("the RVE of atom {} failed at step {}: {}; a fresh RVE of {} replaces it "
                     "after {} DEM steps: stress {}, void ratio {} (was {})",
                     id, reported_step(), rve::describe_status(reasons[k]),
                     packings.name(renewal.packing), renewal.steps, stresses,
                     rve::number(renewal.void_ratio), rve::number(renewal.void_ratio_before))});
  }
  return left;
}

template struct LAMMPS_NS::AttachedRves<2>;
template struct LAMMPS_NS::AttachedRves<3>;
