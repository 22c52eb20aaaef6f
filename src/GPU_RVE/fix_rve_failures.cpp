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

// RVEs that cannot go on as they are, and what is said of them.

#include "fix_rve_impl.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "rve/core/error.h"
#include "rve/engine/contact_network.h"
#include "update.h"

#include <algorithm>
#include <sstream>
#include <utility>

using namespace LAMMPS_NS;

// Lines about RVEs in one step, beyond which their number is said
static constexpr std::size_t MOST_NOTES = 8;

/// Of the sum of radii.
template <int D> static double largest_overlap(const rve::RveStateOf<D> &state)
{
  double largest = 0.0;
  for (const rve::TouchingPairOf<D> &pair : rve::find_contacts(state))
    largest =
        std::max(largest, pair.overlap / (state.radius[pair.first] + state.radius[pair.second]));
  return largest;
}

/* ---------------------------------------------------------------------- */

template <int D>
void FixRve::ImplOf<D>::report(const std::vector<int> &failed, const std::vector<int> &atoms,
                               double dt_dem, bool is_new)
{
  if (failed.empty()) return;
  for (std::size_t k = 0; k < atoms.size(); ++k) {
    const int i = atoms[k];
    if (std::find(failed.begin(), failed.end(), slot[i]) == failed.end()) continue;
    const rve::ResultOf<D> &result = point(i).result;
    // a call that fails leaves the state before it; of a packing this is the state that failed
    const double overlap = is_new ? largest_overlap(state(i)) : result.largest_overlap;
    const double void_ratio = is_new ? state(i).void_ratio() : result.void_ratio;
    const std::string message = fmt::format(
        "RVE of atom {} failed at step {}: {} ({}: largest overlap {} of the sum of "
        "radii, overlap_limit {} [radius], void ratio {}, DEM time step {}{})",
        fix->atom->tag[i], reported_step(), rve::describe_status(result.status),
        is_new ? "its packing" : "before", rve::number(overlap),
        rve::number(settings.options.overlap_limit), rve::number(void_ratio), rve::number(dt_dem),
        point(i).copies > 1 ? fmt::format(", {} copies side by side", point(i).copies) : "");
    // a packing that fails before its first step has no better one
    if (settings.policy == RvePolicy::Stop || (settings.policy == RvePolicy::Fresh && is_new))
      notes.push_back({fix->atom->tag[i], NoteKind::Error,
                       message + rve::remedy_of_status(result.status) +
                           "; with policy freeze the run goes on without this RVE"});
    else
      notes.push_back({fix->atom->tag[i], NoteKind::Warning,
                       message +
                           (settings.policy == RvePolicy::Fresh
                                ? "; none of the packings can take its place, and it is frozen"
                                : "; it is frozen")});
  }
}

/* ---------------------------------------------------------------------- */

template <int D> void FixRve::ImplOf<D>::note_copies(const std::vector<int> &atoms)
{
  const std::vector<int> widened = points.as_they_are().take_widened();
  if (widened.empty()) return;
  for (const int i : atoms) {
    if (std::find(widened.begin(), widened.end(), slot[i]) == widened.end()) continue;
    const auto &result = points->point(slot[i]).result;
    notes.push_back({fix->atom->tag[i], NoteKind::Line,
                     fmt::format("the cell of the RVE of atom {} has become too narrow at step {}; "
                                 "it goes on as {} copies side by side, of {} grains",
                                 fix->atom->tag[i], reported_step(), points->copies(slot[i]),
                                 result.num_grains)});
  }
}

/* ----------------------------------------------------------------------
   what the run loses and keeps is on record: the reason, the stress and the void ratio before and after
------------------------------------------------------------------------- */

template <int D>
std::vector<int> FixRve::ImplOf<D>::renew(const std::vector<int> &failed,
                                          const std::vector<int> &atoms)
{
  if (failed.empty()) return failed;
  std::vector<std::uint32_t> reasons;
  for (const int one : failed) reasons.push_back(points->point(one).result.status);
  const auto renewals = points->renew(failed, packings.all(), clock(fix->update->dt).dt);
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
    const tagint id = fix->atom->tag[*atom];
    notes.push_back(
        {id, NoteKind::Line,
         fmt::format("the RVE of atom {} failed at step {}: {}; a fresh one of {} takes its place "
                     "after {} DEM steps: stress {}, void ratio {} (was {})",
                     id, reported_step(), rve::describe_status(reasons[k]),
                     packings.name(renewal.packing), renewal.steps, stresses,
                     rve::number(renewal.void_ratio), rve::number(renewal.void_ratio_before))});
  }
  return left;
}

/* ----------------------------------------------------------------------
   in the order of the atoms' IDs, whatever rank has them. Most steps have none, which costs a sum over ranks
------------------------------------------------------------------------- */

void FixRve::Impl::say_notes()
{
  const int me = fix->comm->me, ranks = fix->comm->nprocs;
  const MPI_Comm world = fix->world;
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
  error_if_any(fix->lmp, error);
}

/* ----------------------------------------------------------------------
   the message of the first note that is an error; empty if there is none
------------------------------------------------------------------------- */

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
  for (std::size_t k = 0; k < std::min(of_all.size(), MOST_NOTES); ++k) print(of_all[k]);
  if (of_all.size() > MOST_NOTES)
    utils::logmesg(fix->lmp,
                   fmt::format("fix rve {}: and similar notes for {} more RVEs in this step\n",
                               fix->id, of_all.size() - MOST_NOTES));
  for (const Note &note : of_all)
    if (note.kind == NoteKind::Error) return "fix rve: " + note.text;
  return "";
}

/* ---------------------------------------------------------------------- */

void FixRve::Impl::print(const Note &note)
{
  if (note.kind == NoteKind::Error) return;    // say_notes() ends the run with it
  if (note.kind == NoteKind::Line)
    utils::logmesg(fix->lmp, fmt::format("fix rve {}: {}\n", fix->id, note.text));
  else if (note.kind == NoteKind::Warning || !std::exchange(printed_tension, true))
    fix->error->warning(FLERR, fmt::format("fix rve {}: {}", fix->id, note.text));
}

template void FixRve::ImplOf<2>::report(const std::vector<int> &, const std::vector<int> &, double,
                                        bool);
template std::vector<int> FixRve::ImplOf<2>::renew(const std::vector<int> &,
                                                   const std::vector<int> &);
template std::vector<int> FixRve::ImplOf<3>::renew(const std::vector<int> &,
                                                   const std::vector<int> &);
template void FixRve::ImplOf<2>::note_copies(const std::vector<int> &);
template void FixRve::ImplOf<3>::report(const std::vector<int> &, const std::vector<int> &, double,
                                        bool);
template void FixRve::ImplOf<3>::note_copies(const std::vector<int> &);
