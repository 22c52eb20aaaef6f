// SPDX-License-Identifier: GPL-2.0-only
// The columns that a command is asked for by name, and the fix rve that they are of.

#pragma once

#include "error.h"
#include "fix_rve_impl.h"
#include "lammps.h"
#include "lammps/script_words.h"
#include "macro/quantities.h"
#include "rve/core/suggestion.h"

#include "fmt/format.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <string>
#include <vector>

namespace LAMMPS_NS {

/// Returns the entry of that name, or null.
template <class Table> auto find_column(const std::string &name, const Table &table)
{
  const auto found = std::find_if(std::begin(table), std::end(table),
                                  [&](const auto &entry) { return name == entry.name; });
  return found == std::end(table) ? nullptr : &*found;
}

/// Entries of `table`, which have a `name`, as the words from arg[first] on name them; *fix ID* among them sets `fix_id`, which stays empty
/// without. An error, which begins with `style` and `id`, for other words, a fix given twice, and no column. `kind`: what one is called.
template <class Table>
auto read_columns(LAMMPS *lmp, const std::string &style, const char *id, const char *kind,
                  const Table &table, int first, int narg, char **arg, std::string &fix_id)
{
  ScriptWords words(lmp, style + " " + id, narg, arg, first);
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
  if (columns.empty()) words.refuse(fmt::format("it needs at least one {}", kind));
  return columns;
}

/// A column of a table, by what is known of its row in each dimension; null where there is none.
template <template <int> class Row> using ColumnOf = macro::QuantityOf<Row>;

/// work(rves) with the RVEs of a fix, which are of 2 or 3 dimensions.
template <class Work> auto with_rves(const FixRve &fix, const Work &work)
{
  return fix.rves().dimension == 3 ? work(fix.rves_of<3>()) : work(fix.rves_of<2>());
}

/// The fix of the RVEs that `columns` are of: that of `fix_id`, or the only one if that is empty. Ends with an error, which begins with
/// `style` and `id`, if there is none or its RVEs do not have all these; entries say it of a dimension by is_of().
template <class Entry>
FixRve *fix_of_columns(LAMMPS *lmp, const std::string &style, const char *id,
                       const std::string &fix_id, const std::vector<const Entry *> &columns)
{
  FixRve *const fix = FixRve::find(lmp, fix_id, style + " " + id);
  const bool of_disks = fix->rves().dimension == 2;
  for (const Entry *column : columns)
    if (!column->is_of(fix->rves().dimension))
      lmp->error->all(FLERR, "{} {}: {} is of {}, and the RVEs of fix {} are of {}", style, id,
                      column->name, of_disks ? "spheres" : "disks", fix->id,
                      of_disks ? "disks" : "spheres");
  return fix;
}

/// Values of a compute, row by row. LAMMPS reads them as a vector if there is one column, else as an array.
class ColumnValues {
 public:
  explicit ColumnValues(std::size_t columns = 1) : columns_(columns) {}

  /// Number of columns as LAMMPS counts: 0 for a vector.
  int num_columns() const { return columns_ == 1 ? 0 : static_cast<int>(columns_); }
  double *row(std::size_t i) { return values_.data() + i * columns_; }
  double bytes() const { return static_cast<double>(values_.size() * sizeof(double)); }

  /// Makes room for `rows` rows, where LAMMPS finds them by `vector` or `array`.
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
