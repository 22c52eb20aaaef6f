// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/restart_record.h"

#include "rve/core/checksum.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "lammps.h"
#include "neighbor.h"
#include "update.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;

namespace {

// Tolerance of a position, relative to the box and the coordinates. Rounding changes the position
// when read_restart wraps an atom.
constexpr double ROUNDING = 1e-9;

/// Returns the checksum of a header as an integer that a double holds exactly.
double header_sum(const double *header)
{
  const std::size_t bytes = (RestartRecords::HEADER - 1) * sizeof(double);
  return static_cast<double>(rve::checksum_of(header, bytes) >> 12);
}

bool is_damaged(const double *header)
{
  return header[RestartRecords::HEADER - 1] != header_sum(header);
}

/// Result of the search for a record in a row: the record, or the first part of the row that has a
/// wrong size.
struct Part {
  RestartRecord record;
  int bad = -1;    ///< number of the part with a wrong size, from 0; -1: none
  double size;     ///< size that the last part has according to its first value
  double left;     ///< number of values from the start of the last part to the end of the row
};

/// Returns record number nth of a row.
Part part_of_row(const Atom *atom, int row, int nth)
{
  Part part;
  part.record = {atom->extra[row], 0};
  for (int k = 0; k <= nth; k++) {
    part.record.values += part.record.size;
    part.left = static_cast<double>(atom->extra[row] + atom->nextra_store - part.record.values);
    part.size = part.left > 0.0 ? part.record.values[0] : 0.0;
    const double least = k == nth ? RestartRecords::HEADER : 1;
    if (!(part.size >= least && part.size <= part.left && part.size == std::floor(part.size))) {
      part.bad = k;
      break;
    }
    part.record.size = static_cast<int>(part.size);
  }
  return part;
}

}    // namespace

void RestartRecords::write_header(LAMMPS *lmp, int i, int size, double *buf)
{
  buf[0] = size;    // other fixes skip this number of values
  buf[1] = static_cast<double>(lmp->update->ntimestep);
  buf[2] = static_cast<double>(lmp->atom->tag[i]);
  lmp->domain->unmap(lmp->atom->x[i], lmp->atom->image[i], buf + 3);
  buf[HEADER - 1] = header_sum(buf);
}

RestartRecord RestartRecords::of(LAMMPS *lmp, const std::string &whose, int i, int nth, double step)
{
  const Atom *atom = lmp->atom;
  const tagint id = atom->tag[i];
  const auto fail = [&](const std::string &problem) {
    lmp->error->one(FLERR, "{}: the record of atom {} {}", whose, id, problem);
  };
  const auto require_sound = [&](const double *values) {
    if (is_damaged(values))
      fail("in the restart file is damaged: the checksum of its header does not match; use an "
           "earlier file");
  };
  if (num_rows < 0) count_rows(lmp);
  Part part;
  if (i < num_rows) part = part_of_row(atom, i, nth);
  // After a damaged row no other rows are searched, because memory after the rows can have records
  // of an earlier file.
  if (part.bad >= 0)
    fail(fmt::format(
        "in the restart file is damaged: its part {} has {} values by its header, but {} are left; "
        "use an earlier file. If atoms were created since read_restart, create them after this fix",
        part.bad + 1, part.size, part.left));
  if (i >= num_rows || part.record.values[2] != static_cast<double>(id)) {
    if (i < num_rows) require_sound(part.record.values);
    if (row_of_id.empty()) find_rows(lmp, nth, step);
    const auto found = row_of_id.find(id);
    if (found == row_of_id.end())
      fail("is not in the restart file, or on another MPI rank: the atom was created or moved or "
           "its ID was changed since read_restart, or the file is damaged; define the fix directly "
           "after read_restart, and change atoms after it");
    part = part_of_row(atom, found->second, nth);
  }
  const double *values = part.record.values;
  require_sound(values);
  if (values[1] != step)
    fail(
        fmt::format("is of step {}, but the header of the restart files is of step {}: these files "
                    "were written at different steps, or they are damaged; use earlier files",
                    values[1], step));
  double now[3];
  lmp->domain->unmap(atom->x[i], atom->image[i], now);
  for (int a = 0; a < 3; a++)
    if (!(std::fabs(now[a] - values[3 + a]) <=
          ROUNDING * (lmp->domain->prd[a] + std::fabs(now[a]))))
      fail(fmt::format(
          "in the restart file is of a point at {:g} {:g} {:g} [length], but the atom is at {:g} "
          "{:g} {:g}: atoms were moved or their IDs were changed since read_restart (delete_atoms "
          "renumbers unless it has compress no), or the file is damaged; define the fix directly "
          "after read_restart, and change atoms after it",
          values[3], values[4], values[5], now[0], now[1], now[2]));
  return part.record;
}

// LAMMPS does not store the number of rows, and arrays of atoms can have grown since read_restart.
// The rows of read_restart are contiguous in memory, so contiguous rows are counted.
void RestartRecords::count_rows(LAMMPS *lmp)
{
  const Atom *atom = lmp->atom;
  num_rows = 0;
  while (num_rows < atom->nmax &&
         atom->extra[num_rows] == atom->extra[0] + (bigint) num_rows * atom->nextra_store)
    num_rows++;
}

// Only the first rows belong to atoms that were read. The memory of the other rows is not
// initialised.
void RestartRecords::find_rows(LAMMPS *lmp, int nth, double step)
{
  for (int row = 0; row < num_rows; row++) {
    const Part part = part_of_row(lmp->atom, row, nth);
    if (part.bad >= 0 || is_damaged(part.record.values)) continue;
    const double id = part.record.values[2];
    if (part.record.values[1] != step || !(id >= 1.0 && id <= static_cast<double>(MAXTAGINT)))
      continue;
    row_of_id.emplace(static_cast<tagint>(id), row);
  }
}

// The initialization of LAMMPS drops records that no fix has taken, and the names of their fixes.
void LAMMPS_NS::warn_of_dropped_records(LAMMPS *lmp, const std::string &whose)
{
  const bool is_initialized = lmp->neighbor->cutneighsq != nullptr;
  if (lmp->restart_ver < 0 || !is_initialized || lmp->comm->me) return;
  lmp->error->warning(
      FLERR,
      "{}: records of the restart file are lost: a run or another command that initializes LAMMPS "
      "(balance, velocity, reset_atoms, delete_atoms overlap, write_data) came between "
      "read_restart and this fix, and LAMMPS then drops the records of fixes that are not defined "
      "yet. If the file has records of this fix, define the fix directly after read_restart",
      whose);
}
