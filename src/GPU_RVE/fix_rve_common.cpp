// SPDX-License-Identifier: GPL-2.0-only
// Functions of fix rve that do not depend on the dimension of its RVEs: DEM steps per LAMMPS step,
// and the log of notes of all ranks.

#include "fix_rve_attached.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "group.h"
#include "rve/core/error.h"
#include "update.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

using namespace LAMMPS_NS;

// Largest number of notes that are printed in one step. A last line has the number of the notes
// that were not printed.
static constexpr std::size_t MOST_NOTES = 8;

/// Prints the notes of all ranks in the order of atom IDs. A step without notes costs one sum over
/// ranks.
void FixRve::Impl::log_notes()
{
  const int me = comm->me, ranks = comm->nprocs;
  std::string text;
  for (const Note &note : notes)
    text += fmt::format("{} {} {}\n", note.atom, static_cast<int>(note.kind), note.text);
  notes.clear();
  int length = static_cast<int>(text.size()), total = length;
  if (ranks > 1) MPI_Allreduce(&length, &total, 1, MPI_INT, MPI_SUM, world);
  if (total == 0) return;
  std::vector<int> lengths(ranks), begins(ranks, 0);
  MPI_Gather(&length, 1, MPI_INT, lengths.data(), 1, MPI_INT, 0, world);
  for (int rank = 1; rank < ranks; ++rank) begins[rank] = begins[rank - 1] + lengths[rank - 1];
  std::string all(total, '\0');
  MPI_Gatherv(text.data(), length, MPI_CHAR, all.data(), lengths.data(), begins.data(), MPI_CHAR, 0,
              world);
  std::string error;
  if (me == 0) error = print_all(all);
  error_if_any(lmp, error);
}

std::string FixRve::Impl::print_all(const std::string &all)
{
  std::vector<Note> of_all;
  std::istringstream lines(all);
  std::string line;
  while (std::getline(lines, line)) {
    const std::size_t first = line.find(' '), second = line.find(' ', first + 1);
    const int kind = std::stoi(line.substr(first + 1, second - first - 1));
    of_all.push_back({static_cast<tagint>(std::stoll(line.substr(0, first))),
                      static_cast<NoteKind>(kind), line.substr(second + 1)});
  }
  std::stable_sort(of_all.begin(), of_all.end(),
                   [](const Note &a, const Note &b) { return a.atom < b.atom; });
  for (std::size_t k = 0; k < std::min(of_all.size(), MOST_NOTES); ++k) {
    const Note &note = of_all[k];
    // the first frozen RVE of a run is reported by a warning
    const bool is_first_frozen = note.kind == NoteKind::Frozen && num_frozen++ == 0;
    if (is_first_frozen ||
        (note.kind == NoteKind::Tension && !std::exchange(printed_tension, true)))
      error->warning(FLERR, fmt::format("{}: {}", settings.name(), note.text));
    else if (note.kind == NoteKind::Line || note.kind == NoteKind::Frozen)
      utils::logmesg(lmp, fmt::format("{}: {}\n", settings.name(), note.text));
  }
  for (std::size_t k = MOST_NOTES; k < of_all.size(); ++k)
    if (of_all[k].kind == NoteKind::Frozen) ++num_frozen;
  if (of_all.size() > MOST_NOTES)
    utils::logmesg(lmp,
                   fmt::format("{}: similar messages of {} more RVEs in this step are omitted\n",
                               settings.name(), of_all.size() - MOST_NOTES));
  for (const Note &note : of_all)
    if (note.kind == NoteKind::Error) return settings.name() + ": " + note.text;
  return "";
}

std::string FixRve::Impl::failure_context(int atom) const
{
  return fmt::format("fix rve {}: {}step {}", fix->id,
                     atom >= 0 ? fmt::format("RVE of atom {}, ", this->atom->tag[atom]) : "",
                     reported_step());
}

void FixRve::Impl::find_variables()
{
  for (auto *list : {&settings.velocity_gradient, &settings.stress_goal})
    for (auto &component : *list) component.value.find(lmp, settings.name());
  for (ScriptValue &value : settings.path.values) value.find(lmp, settings.name() + ": path");
  settings.path.number.find(lmp, settings.name() + ": path_variable");
}

/// The default timestep of LAMMPS with units si is 1e-8 seconds.
void FixRve::Impl::check_clock() const
{
  clock(update->dt);
  const bool own_time = settings.substeps > 0 && settings.driver != RveDriver::Mpm;
  const bool no_step = update->nsteps == 0;
  if (own_time || no_step || !update->dt_default || update->dt > dt || comm->me) return;
  error->warning(FLERR,
                 "fix rve {}: the timestep {} [time] is the default of units {} and not longer "
                 "than one DEM step of {} [time]; set it with the timestep command",
                 fix->id, rve::number(update->dt), update->unit_style, rve::number(dt));
}

void FixRve::Impl::check_dump() const
{
  if (settings.dump_interval == 0) return;
  std::vector<int> found(settings.dump_atoms.size(), 0);
  for (const int i : atoms_with_rve())
    for (std::size_t k = 0; k < found.size(); ++k)
      if (atom->tag[i] == settings.dump_atoms[k]) found[k] = 1;
  MPI_Allreduce(MPI_IN_PLACE, found.data(), static_cast<int>(found.size()), MPI_INT, MPI_MAX,
                world);
  for (std::size_t k = 0; k < found.size(); ++k)
    if (!found[k])
      error->all(FLERR,
                 "fix rve {}: dump: atom {} has no RVE of this fix; choose atoms of group {}",
                 fix->id, settings.dump_atoms[k], group->names[fix->igroup]);
}

std::vector<int> FixRve::Impl::dumped_atoms() const
{
  std::vector<int> atoms;
  for (const int i : atoms_with_rve())
    if (std::count(settings.dump_atoms.begin(), settings.dump_atoms.end(), atom->tag[i]))
      atoms.push_back(i);
  return atoms;
}

std::string FixRve::Impl::dump_file(int atom) const
{
  return fmt::format("{}.{}.{}.data", settings.dump_prefix, this->atom->tag[atom],
                     update->ntimestep);
}

std::vector<int> FixRve::Impl::atoms_with_rve() const
{
  std::vector<int> atoms;
  for (int i = 0; i < atom->nlocal; i++)
    if (slot[i] >= 0) atoms.push_back(i);
  return atoms;
}

macro::RveClock FixRve::Impl::clock(double lammps_dt) const
{
  if (settings.substeps > 0) return {dt, settings.substeps};
  // a ratio that differs from a whole number by rounding only must not cost another step
  const double steps = std::max(1.0, std::ceil(lammps_dt / dt * (1.0 - 1e-12)));
  const int of_shadows = settings.steps_per_step();
  if (!(steps * of_shadows <= MAXSMALLINT))
    error->all(FLERR,
               "fix rve {}: a timestep of {} [time] needs {} DEM steps of dt {} [time]{}; the "
               "limit is {}: use a longer dt or a shorter timestep",
               fix->id, rve::number(lammps_dt), rve::number(steps), rve::number(dt),
               of_shadows > 1 ? fmt::format(", and {} times as many for a shadow", of_shadows) : "",
               MAXSMALLINT);
  const int substeps = static_cast<int>(steps);
  if (settings.macro_step.adaptive)
    return {dt, substeps};    // each RVE has its own number of steps
  return {lammps_dt / substeps, substeps};
}
