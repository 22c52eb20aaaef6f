// SPDX-License-Identifier: GPL-2.0-only

// The columns that a command is asked for by name, and the fix rve that they are of.

#pragma once

#include "error.h"
#include "fix_rve.h"
#include "lammps.h"
#include "lammps/script_words.h"
#include "rve/core/suggestion.h"

#include "fmt/format.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace LAMMPS_NS {

/// An entry of a table of columns.
template <class Table>
using EntryOf = std::remove_reference_t<decltype(*std::begin(std::declval<const Table &>()))>;

/// The entry of that name, or none.
template <class Table> EntryOf<Table> *find_column(const std::string &name, const Table &table)
{
  for (const auto &entry : table)
    if (name == entry.name) return &entry;
  return nullptr;
}

/// Entries of `table`, which have a `name`, as the words from arg[first] on name them; *fix ID* among them sets `fix_id`, which stays empty
/// without. An error, which begins with `style` and `id`, for other words, a fix given twice, and no column. `kind`: what one is called.
template <class Table>
std::vector<EntryOf<Table> *> read_columns(LAMMPS *lmp, const std::string &style, const char *id,
                                           const char *kind, const Table &table, int first,
                                           int narg, char **arg, std::string &fix_id)
{
  ScriptWords words(lmp, style + " " + id, narg, arg, first);
  rve::Words names = names_of(table);
  names.emplace_back("fix");
  std::vector<EntryOf<Table> *> columns;
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
    EntryOf<Table> *found = find_column(word, table);
    if (!found)
      words.refuse(fmt::format("there is no {} '{}'{}", kind, word,
                               rve::did_you_mean(word, names, "there are")));
    columns.push_back(found);
  }
  if (columns.empty()) words.refuse(fmt::format("it needs at least one {}", kind));
  return columns;
}

/// Ends with an error, which begins with `style` and `id`, unless RVEs of the fix have all these; entries say it of a dimension by is_of().
template <class Entry>
void require_columns_of(const FixRve &fix, LAMMPS *lmp, const std::string &style, const char *id,
                        const std::vector<const Entry *> &columns)
{
  for (const Entry *column : columns)
    if (!column->is_of(fix.dimension()))
      lmp->error->all(FLERR, "{} {}: {} is of {}, and the RVEs of fix {} are of {}", style, id,
                      column->name, fix.dimension() == 2 ? "spheres" : "disks", fix.id,
                      fix.dimension() == 2 ? "disks" : "spheres");
}

}    // namespace LAMMPS_NS
