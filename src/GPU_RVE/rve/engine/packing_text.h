// SPDX-License-Identifier: GPL-2.0-only
// Common functions of the reader and the writers of packing files: statements, numbers, and the
// lines of the material. <charconv> converts the numbers, so the conversion is exact and does not
// depend on the locale.

#pragma once

#include "rve/core/checksum.h"
#include "rve/core/error.h"
#include "rve/engine/state.h"

#include <algorithm>
#include <charconv>
#include <string>
#include <string_view>
#include <vector>

namespace rve {

/// Versions of packing files. Files of VERSION_WITH_DIMENSION contain the dimension.
constexpr int VERSION_OF_DISKS = 1, VERSION_WITH_DIMENSION = 2;
constexpr int LIBRARY_VERSION = 1;
constexpr const char *LAW_STATEMENT = "contact_law";

/// Line of a packing file with a parameter of the material.
struct MaterialLine {
  const char *name, *unit;
  bool optional;
  double otherwise;    ///< value if the line is missing
  const MaterialParameter *parameter;
  double &of(Material &material) const { return material.*parameter->member; }
  double of(const Material &material) const { return material.*parameter->member; }
};

/// Returns the lines of a material. For spheres there is no line of the thickness. Instead of
/// mass_depth they have mass_scaling, a factor of the mass.
template <int D> std::vector<MaterialLine> material_lines()
{
  std::vector<MaterialLine> lines;
  for (const MaterialParameter &parameter : MATERIAL_PARAMETERS) {
    if (parameter.dimension != 0 && parameter.dimension != D) continue;
    if (D == 3 && parameter.member == &MaterialNumbers::thickness) continue;
    if (D == 3 && parameter.member == &MaterialNumbers::mass_depth)
      lines.push_back({"mass_scaling", "[-]", true, 1.0, &parameter});
    else
      lines.push_back({parameter.name, parameter.unit, parameter.optional, 0.0, &parameter});
  }
  return lines;
}

/// Splits a line into words; there are none if it is blank or a comment.
inline void split(const std::string &line, std::vector<std::string_view> &words)
{
  words.clear();
  const std::string_view statement = std::string_view(line).substr(0, line.find('#'));
  constexpr const char *BLANK = " \t\r";
  std::size_t begin = statement.find_first_not_of(BLANK);
  while (begin != std::string_view::npos) {
    const std::size_t end = std::min(statement.find_first_of(BLANK, begin), statement.size());
    words.push_back(statement.substr(begin, end - begin));
    begin = statement.find_first_not_of(BLANK, end);
  }
}

/// Adds a statement to a checksum, with single blanks between the words. So comments and layout do
/// not change the checksum.
inline void add_statement(const std::vector<std::string_view> &words, Checksum &checksum)
{
  for (std::size_t k = 0; k < words.size(); ++k) {
    if (k > 0) checksum.add(" ", 1);
    checksum.add(words[k].data(), words[k].size());
  }
  if (!words.empty()) checksum.add("\n", 1);
}

/// Returns 16 hexadecimal digits, as in files.
inline std::string hexadecimal(std::uint64_t value)
{
  std::string digits(16, '0');
  for (int k = 15; k >= 0; --k, value >>= 4) digits[k] = "0123456789abcdef"[value & 15];
  return digits;
}

/// Returns a text with one word for each axis, such as "s_x*2^64 s_y*2^64".
template <int D>
std::string for_axes(const std::string &before, const std::string &after,
                     const std::string &between)
{
  std::string words = before + "x" + after;
  for (int a = 1; a < D; ++a) words += between + before + "xyz"[a] + after;
  return words;
}

/// Returns the smallest number of history values of a pair in files: the number of components of
/// the tangential force.
template <int D> constexpr int least_remembered()
{
  return D == 2 ? 1 : D;
}

/// Returns the shortest decimal that reads back to the same double.
inline std::string exact(double value)
{
  char text[32];
  const auto result = std::to_chars(text, text + sizeof(text), value);
  return std::string(text, result.ptr);
}

template <class Checked> void check_for(const std::string &path, const Checked &checked)
{
  try {
    checked.check();
  } catch (const InputError &error) {
    throw InputError(path + ": " + error.what());
  }
}

}    // namespace rve
