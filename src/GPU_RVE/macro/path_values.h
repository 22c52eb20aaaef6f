// SPDX-License-Identifier: GPL-2.0-only
// Words and values of loading paths (macro/load_path.h): numbers, functions of time and tables.

#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace macro {

/// A word, and where it stands, for messages.
struct PathWord {
  std::string text, where;
};
/// The words of a file, without comments.
std::vector<PathWord> path_words(const std::string &text, const std::string &file);

/// Reads a finite number, in the same way in every locale; false if the word is none.
bool read_number(const std::string &word, double &value);

/// Columns of numbers over the first one, time, with straight lines between rows and the last value beyond the ends. Commas or blanks
/// separate the numbers of a row; a byte-order mark and the line ends of other systems do not matter.
class PathTable {
 public:
  /// Throws InputError unless these are rows of numbers with growing times; a first row of words gives the columns names.
  PathTable(const std::string &text, const std::string &file);
  /// Column by its name, or its number from 2 on.
  int column(const std::string &word) const;
  double at(int column, double time) const;
  /// Least and largest value of a column.
  std::pair<double, double> range(int column) const;

 private:
  std::string file;
  std::vector<std::string> names;
  std::vector<std::vector<double>> columns;    // the first one is time

  void read_names(const std::vector<std::string> &row);
  void read_numbers(const std::vector<std::string> &row);
};

/// A number of a path, as a function of the time since its stage began.
struct PathValue {
  enum class Kind { Constant, Script, Ramp, Wave, Table };
  Kind kind = Kind::Constant;
  /// By kind: value; from, to, time; mean, amplitude, period, phase [rad].
  double number[4] = {};
  int index = 0;    ///< of a script value, or the column of a table
  std::shared_ptr<const PathTable> table;

  bool is_constant() const { return kind == Kind::Constant; }
  double at(double time, const double *script) const;
  /// Least and largest value at any time; zeros for a script value.
  std::pair<double, double> range() const;
};

}    // namespace macro
