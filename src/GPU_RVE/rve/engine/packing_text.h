// SPDX-License-Identifier: GPL-2.0-only
// What the reader and the writers of packing files have in common: statements, numbers, and the lines of the material. Number
// conversion is by <charconv>: exact, and the same in every locale.

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

/// Versions of packing files; from the second one on a packing says its dimension.
constexpr int VERSION_OF_DISKS = 1, VERSION_WITH_DIMENSION = 2;
constexpr int LIBRARY_VERSION = 1;
constexpr const char *LAW_STATEMENT = "contact_law";

/// A line of the material.
struct MaterialLine {
  const char *name, *unit;
  bool optional;
  double otherwise;    ///< where the line is missing
  const MaterialParameter *parameter;
  double &of(Material &material) const { return material.*parameter->member; }
  double of(const Material &material) const { return material.*parameter->member; }
};

/// Spheres have no thickness, and no depth that their mass is counted for: what scales the mass is a number.
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

/// The words of a line; none if it is blank or a comment.
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

/// Of a statement as if it were written with one blank between two words: a file may get comments and another layout.
inline void add_statement(const std::vector<std::string_view> &words, Checksum &checksum)
{
  for (std::size_t k = 0; k < words.size(); ++k) {
    if (k > 0) checksum.add(" ", 1);
    checksum.add(words[k].data(), words[k].size());
  }
  if (!words.empty()) checksum.add("\n", 1);
}

/// As files have it: 16 hexadecimal digits.
inline std::string hexadecimal(std::uint64_t value)
{
  std::string digits(16, '0');
  for (int k = 15; k >= 0; --k, value >>= 4) digits[k] = "0123456789abcdef"[value & 15];
  return digits;
}

/// A word for each axis: "s_x*2^64 s_y*2^64".
template <int D>
std::string for_axes(const std::string &before, const std::string &after,
                     const std::string &between)
{
  std::string words = before + "x" + after;
  for (int a = 1; a < D; ++a) words += between + before + "xyz"[a] + after;
  return words;
}

/// Numbers that pairs remember at least, in files: a tangential force.
template <int D> constexpr int least_remembered()
{
  return D == 2 ? 1 : D;
}

/// The shortest decimal that reads back to the same double.
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
