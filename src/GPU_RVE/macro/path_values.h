// SPDX-License-Identifier: GPL-2.0-only
// Words and values of loading paths (macro/load_path.h). Values are numbers, functions of time and
// tables.

#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace macro {

/// A word and its position (file and line) for messages.
struct PathWord {
  std::string text, where;
};
/// Splits the text of a file into words. Comments from # to the end of a line are left out.
std::vector<PathWord> path_words(const std::string &text, const std::string &file);

/// Reads a finite number, independent of the locale. Returns false if the word is no finite number.
bool read_number(const std::string &word, double &value);

/// Table of columns over time. The first column is the time. Values are interpolated linearly
/// between rows and constant beyond the ends. Commas or blanks separate the numbers of a row. A
/// byte-order mark and the line ends of other systems are accepted.
class PathTable {
 public:
  /// Throws InputError unless the text has rows of numbers with increasing times. The first row may
  /// have the names of the columns instead.
  PathTable(const std::string &text, const std::string &file);
  /// Returns the index of a column of values; column 0 is the time. `word` is the name of the
  /// column, or its number counted from 1, so that the first column of values has the number 2.
  /// Throws InputError if there is no such column.
  int column(const std::string &word) const;
  double at(int column, double time) const;
  /// Least and largest value of a column.
  std::pair<double, double> range(int column) const;

 private:
  std::string file;
  std::vector<std::string> names;
  std::vector<std::vector<double>> columns;    // time is the first one

  void read_names(const std::vector<std::string> &row);
  void read_numbers(const std::vector<std::string> &row);
};

/// A value of a path as a function of the time since the start of its stage.
struct PathValue {
  enum class Kind { Constant, Script, Ramp, Wave, Table };
  Kind kind = Kind::Constant;
  /// Constant: value. Ramp: from, to, time. Wave: mean, amplitude, period, phase [rad].
  double number[4] = {};
  int index = 0;    ///< index of a script value, or column of a table
  std::shared_ptr<const PathTable> table;

  bool is_constant() const { return kind == Kind::Constant; }
  double at(double time, const double *script) const;
  /// Least and largest value at any time; zeros for a script value.
  std::pair<double, double> range() const;
};

}    // namespace macro
