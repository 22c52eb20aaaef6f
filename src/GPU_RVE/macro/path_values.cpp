// SPDX-License-Identifier: GPL-2.0-only
#include "macro/path_values.h"

#include "rve/core/error.h"
#include "rve/core/pi.h"
#include "rve/engine/files.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <sstream>

namespace macro {

namespace {

  /// Splits a row of a table at commas, or at blanks if it has no commas.
  std::vector<std::string> fields_of(const std::string &row)
  {
    std::vector<std::string> fields;
    std::string field;
    if (row.find(',') == std::string::npos) {
      std::istringstream words(row);
      while (words >> field) fields.push_back(field);
      return fields;
    }
    constexpr const char *BLANK = " \t\v\f";
    std::istringstream parts(row + ',');    // getline() then returns an empty last field, too
    while (std::getline(parts, field, ',')) {
      const std::size_t first = field.find_first_not_of(BLANK);
      rve::require(first != std::string::npos, "a field before or after a comma is empty");
      fields.push_back(field.substr(first, field.find_last_not_of(BLANK) - first + 1));
    }
    return fields;
  }

  /// True if the first field of a table looks like a number, even if it is not a valid one: "0s",
  /// "1d-3", "\"0\"", "nan".
  bool begins_like_a_number(const std::string &word)
  {
    std::string lower;
    for (const char letter : word)
      lower += static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
    for (const char *sign : {"\"", "'", "+", "-", "\xE2\x88\x92", "\xE2\x80\x93"})    // dashes
      if (lower.rfind(sign, 0) == 0) lower.erase(0, std::string(sign).size());
    return lower == "nan" || lower == "inf" || lower == "infinity" ||
        (!lower.empty() && (lower[0] == '.' || std::isdigit(static_cast<unsigned char>(lower[0]))));
  }

}    // namespace

bool read_number(const std::string &word, double &value)
{
  const char *begin = word.data(), *last = begin + word.size();
  if (begin != last && *begin == '+') ++begin;
  const auto [end, error] = std::from_chars(begin, last, value);
  return error == std::errc() && end == last && std::isfinite(value);
}

std::vector<PathWord> path_words(const std::string &text, const std::string &file)
{
  std::vector<PathWord> words;
  std::istringstream lines(rve::plain_text(text, file));
  std::string line, word;
  for (int number = 1; std::getline(lines, line); ++number) {
    std::istringstream rest(line.substr(0, line.find('#')));
    while (rest >> word) words.push_back({word, file + ":" + std::to_string(number)});
  }
  return words;
}

PathTable::PathTable(const std::string &text, const std::string &name) : file(name)
{
  std::istringstream lines(rve::plain_text(text, file));
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    try {
      const std::vector<std::string> row = fields_of(line.substr(0, line.find('#')));
      if (row.empty()) continue;
      rve::require(row.size() >= 2,
                   "the row has one column; it must have a time and at least one value");
      if (columns.empty() && names.empty() && !begins_like_a_number(row.front()))
        read_names(row);
      else
        read_numbers(row);
    } catch (const rve::InputError &e) {
      throw rve::InputError(rve::concat(file, ":", number, ": ", e.what()));
    }
  }
  rve::require(!columns.empty(), file, " has no rows of numbers");
}

void PathTable::read_names(const std::vector<std::string> &row)
{
  for (std::size_t c = 0; c < row.size(); ++c) {
    double value;
    rve::require(!read_number(row[c], value), "'", row[c],
                 "' is a number among names; the first row must have only names or only numbers");
    rve::require(std::find(row.begin(), row.begin() + c, row[c]) == row.begin() + c,
                 "two columns have the name '", row[c], "'");
  }
  names = row;
}

void PathTable::read_numbers(const std::vector<std::string> &row)
{
  if (columns.empty()) {
    rve::require(names.empty() || row.size() == names.size(), "the row has ", row.size(),
                 " numbers, but the first row has ", names.size(),
                 " names; names with blanks or units need commas between them");
    columns.resize(row.size());
  }
  rve::require(row.size() == columns.size(), "the row has ", row.size(),
               " numbers, but the rows before have ", columns.size());
  for (std::size_t c = 0; c < row.size(); ++c) {
    double value;
    rve::require(
        read_number(row[c], value), "'", row[c], "' is not a finite number",
        row[c].find(' ') == std::string::npos
            ? ""
            : "; numbers of a row must be separated by commas or blanks, and have a decimal point");
    rve::require(c > 0 || columns[0].empty() || value > columns[0].back(), "the time ", row[c],
                 " must be greater than that of the row before");
    columns[c].push_back(value);
  }
}

int PathTable::column(const std::string &word) const
{
  const auto named = std::find(names.begin(), names.end(), word);
  if (named != names.end() && named != names.begin())
    return static_cast<int>(named - names.begin());
  double value;
  const double most = static_cast<double>(columns.size());
  rve::require(
      read_number(word, value) && value >= 2.0 && value <= most && value == std::floor(value), [&] {
        std::string known;
        for (std::size_t c = 1; c < names.size(); ++c) known += " " + names[c];
        return "table " + file + " has no column '" + word + "'; it must be a number from 2 to " +
            rve::number(most) + (known.empty() ? "" : ", or one of" + known);
      });
  return static_cast<int>(value) - 1;
}

std::pair<double, double> PathTable::range(int column) const
{
  const auto [least, most] = std::minmax_element(columns[column].begin(), columns[column].end());
  return {*least, *most};
}

double PathTable::at(int column, double time) const
{
  const std::vector<double> &times = columns[0], &values = columns[column];
  const auto above = std::upper_bound(times.begin(), times.end(), time) - times.begin();
  if (above == 0) return values.front();
  if (above == static_cast<std::ptrdiff_t>(times.size())) return values.back();
  const double share = (time - times[above - 1]) / (times[above] - times[above - 1]);
  return values[above - 1] + share * (values[above] - values[above - 1]);
}

std::pair<double, double> PathValue::range() const
{
  switch (kind) {
    case Kind::Script:
      return {0.0, 0.0};
    case Kind::Ramp:
      return std::minmax(number[0], number[1]);
    case Kind::Wave:
      return {number[0] - std::fabs(number[1]), number[0] + std::fabs(number[1])};
    case Kind::Table:
      return table->range(index);
    default:
      return {number[0], number[0]};
  }
}

double PathValue::at(double time, const double *script) const
{
  switch (kind) {
    case Kind::Script:
      return script[index];
    case Kind::Ramp:
      return time < number[2] ? number[0] + (time / number[2]) * (number[1] - number[0])
                              : number[1];
    case Kind::Wave:
      return number[0] + number[1] * std::sin(2.0 * rve::kPi * (time / number[2]) + number[3]);
    case Kind::Table:
      return table->at(index, time);
    default:
      return number[0];
  }
}

}    // namespace macro
