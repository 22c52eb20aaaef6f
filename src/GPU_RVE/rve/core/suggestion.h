// SPDX-License-Identifier: GPL-2.0-only
// Suggestions for misspelt words, for the parsers of scripts and files.

#pragma once

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace rve {

using Words = std::vector<std::string_view>;

/// Returns how many letters must be inserted, deleted, replaced or swapped with their neighbour to
/// change one word into the other (Damerau, Commun. ACM 7, 171 (1964)). It ignores case.
inline std::size_t edit_distance(std::string_view a, std::string_view b)
{
  const auto same = [&](std::size_t i, std::size_t j) {
    return std::tolower(static_cast<unsigned char>(a[i - 1])) ==
        std::tolower(static_cast<unsigned char>(b[j - 1]));
  };
  // distance[i][j] is the distance between the first i letters of a and the first j letters of b.
  std::vector<std::vector<std::size_t>> distance(a.size() + 1,
                                                 std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i)
    for (std::size_t j = 0; j <= b.size(); ++j) {
      std::size_t &here = distance[i][j] = i + j;
      if (i == 0 || j == 0) continue;
      here = std::min({distance[i - 1][j - 1] + (same(i, j) ? 0 : 1), distance[i - 1][j] + 1,
                       distance[i][j - 1] + 1});
      if (i > 1 && j > 1 && same(i, j - 1) && same(i - 1, j))
        here = std::min(here, distance[i - 2][j - 2] + 1);
    }
  return distance.back().back();
}

/// Returns the known words that are similar to `word`, at most three, the most similar first. A
/// known word is similar if about a third of the letters or fewer differ. It is also similar if one
/// of the two words has at least three letters and the other one begins with it.
inline Words nearest_words(std::string_view word, const Words &known)
{
  const auto begins = [](std::string_view whole, std::string_view part) {
    return part.size() >= 3 && whole.substr(0, part.size()) == part;
  };
  std::multimap<std::size_t, std::string_view> near;
  for (const std::string_view other : known) {
    const std::size_t distance = edit_distance(word, other);
    if (distance <= (std::max(word.size(), other.size()) + 1) / 3 || begins(other, word) ||
        begins(word, other))
      near.emplace(distance, other);
  }
  Words words;
  for (const auto &[distance, other] : near)
    if (words.size() < 3) words.push_back(other);
  return words;
}

/// Returns "; did you mean servo or servo_gain?", or "; <these_are> a, b, c" if no known word is
/// similar.
inline std::string did_you_mean(std::string_view word, const Words &known,
                                const std::string &these_are)
{
  const Words near = nearest_words(word, known);
  const Words &named = near.empty() ? known : near;
  std::string text = near.empty() ? "; " + these_are + " " : "; did you mean ";
  for (std::size_t k = 0; k < named.size(); ++k)
    text += std::string(k == 0 ? "" : near.empty() ? ", " : " or ") + std::string(named[k]);
  return text + (near.empty() ? "" : "?");
}

/// Returns "unknown keyword 'frition'; did you mean friction?". If the word is a number and
/// `before` is not empty, the message says instead that a keyword was expected after `before`.
/// `before` is the previous keyword with its values.
inline std::string unknown_keyword(std::string_view word, const Words &known,
                                   const std::string &before = "")
{
  const bool is_number = word.find_first_of("0123456789") <= 1 &&
      word.find_first_not_of("+-.0123456789eE") == std::string_view::npos;
  if (is_number && !before.empty())
    return "found '" + std::string(word) + "' after '" + before +
        "', where a keyword or the end was expected";
  return "unknown keyword '" + std::string(word) + "'" +
      did_you_mean(word, known, "the keywords are");
}

}    // namespace rve
