// SPDX-License-Identifier: GPL-2.0-only
// Columns of the computes and the dump of RVEs. A script requests the columns by name, and can give
// the ID of the fix rve that has the RVEs.

#pragma once

#include "error.h"
#include "fix_rve_impl.h"
#include "lammps.h"
#include "lammps/script_arguments.h"
#include "macro/quantities.h"
#include "rve/core/suggestion.h"

#include "fmt/format.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <string>
#include <vector>

namespace LAMMPS_NS {

/// Returns the entry of `table` with this name, or null.
template <class Table> auto find_column(const std::string &name, const Table &table)
{
  const auto found = std::find_if(std::begin(table), std::end(table),
                                  [&](const auto &entry) { return name == entry.name; });
  return found == std::end(table) ? nullptr : &*found;
}

/// Reads the words arg[first] to arg[narg - 1]. Each word names an entry of `table`, except that
/// *fix ID* sets `fix_id`. Returns pointers to the named entries. An unknown word, a second *fix*
/// and no column at all are errors. Messages begin with `style` and `id`, and use the word `kind`
/// for a column.
template <class Table>
auto read_columns(LAMMPS *lmp, const std::string &style, const char *id, const char *kind,
                  const Table &table, int first, int narg, char **arg, std::string &fix_id)
{
  ScriptArguments words(lmp, style + " " + id, narg, arg, first);
  rve::Words names = names_of(table);
  names.emplace_back("fix");
  std::vector<decltype(find_column("", table))> columns;
  while (!words.empty()) {
    if (words.take("fix")) {
      const std::string given = words.next("fix");
      if (!fix_id.empty())
        words.refuse(
            fmt::format("fix is given twice, as {} and as {}; give it once", fix_id, given));
      fix_id = given;
      continue;
    }
    const std::string word = words.next();
    const auto *found = find_column(word, table);
    if (!found)
      words.refuse(fmt::format("there is no {} '{}'{}", kind, word,
                               rve::did_you_mean(word, names, "there are")));
    columns.push_back(found);
  }
  if (columns.empty()) words.refuse(fmt::format("at least one {} must be given", kind));
  return columns;
}

/// A column of a table: its name and the functions that compute it from a `Row<D>`, one for each
/// dimension D. The function is null if the column does not exist in that dimension.
template <template <int> class Row> using ColumnOf = macro::QuantityOf<Row>;

/// Returns work(rves), where `rves` are the RVEs of a fix in 2 or 3 dimensions.
template <class Work> auto with_rves(const FixRve &fix, const Work &work)
{
  return fix.rves().dimension == 3 ? work(fix.rves_of<3>()) : work(fix.rves_of<2>());
}

/// Returns the fix rve with the ID `fix_id`, or the only fix rve if `fix_id` is empty. Ends with
/// error->all if there is no such fix, or if a column does not exist in the dimension of its RVEs.
/// The message begins with `style` and `id`.
template <class Entry>
FixRve *fix_of_columns(LAMMPS *lmp, const std::string &style, const char *id,
                       const std::string &fix_id, const std::vector<const Entry *> &columns)
{
  FixRve *const fix = FixRve::find(lmp, fix_id, style + " " + id);
  const bool of_disks = fix->rves().dimension == 2;
  for (const Entry *column : columns)
    if (!column->is_of(fix->rves().dimension))
      lmp->error->all(FLERR, "{} {}: {} is for {} only, but the RVEs of fix {} consist of {}",
                      style, id, column->name, of_disks ? "spheres" : "disks", fix->id,
                      of_disks ? "disks" : "spheres");
  return fix;
}

/// Values of a compute, row by row. LAMMPS reads one column as a vector and several as an array.
class ColumnValues {
 public:
  explicit ColumnValues(std::size_t columns = 1) : columns_(columns) {}

  /// Returns the number of columns in the convention of LAMMPS: 0 for a vector.
  int num_columns() const { return columns_ == 1 ? 0 : static_cast<int>(columns_); }
  double *row(std::size_t i) { return values_.data() + i * columns_; }
  double bytes() const { return static_cast<double>(values_.size() * sizeof(double)); }

  /// Allocates `rows` rows and sets `vector` or `array` of a compute to them.
  void resize(std::size_t rows, double *&vector, double **&array)
  {
    values_.resize(rows * columns_);
    rows_.resize(rows);
    for (std::size_t i = 0; i < rows; i++) rows_[i] = row(i);
    if (columns_ == 1)
      vector = values_.data();
    else
      array = rows_.data();
  }

 private:
  std::size_t columns_;
  std::vector<double> values_;
  std::vector<double *> rows_;
};

}    // namespace LAMMPS_NS
