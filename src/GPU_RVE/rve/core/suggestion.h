// SPDX-License-Identifier: GPL-2.0-only
// What a person may have meant by a word that is none of those known. For the parsers of scripts and files.

#pragma once

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace rve {

using Words = std::vector<std::string_view>;

/// Letters to insert, delete, replace or swap with their neighbor to make one word of the other: the optimal string alignment of
/// Damerau, Commun. ACM 7, 171 (1964). Upper and lower case are the same.
inline std::size_t edit_distance(std::string_view a, std::string_view b)
{
  const auto same = [](char x, char y) {
    return std::tolower(static_cast<unsigned char>(x)) ==
        std::tolower(static_cast<unsigned char>(y));
  };
  // rows i - 2, i - 1 and i of the table of distances between beginnings
  std::vector<std::size_t> before(b.size() + 1), above(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    before.swap(above);
    above.swap(row);
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = above[j - 1] + (same(a[i - 1], b[j - 1]) ? 0 : 1);
      row[j] = std::min({replaced, above[j] + 1, row[j - 1] + 1});
      if (i > 1 && j > 1 && same(a[i - 1], b[j - 2]) && same(a[i - 2], b[j - 1]))
        row[j] = std::min(row[j], before[j - 2] + 1);
    }
  }
  return row[b.size()];
}

/// The known words that look like this one, the most alike first: a third of the letters may differ, or one of the two begins with the
/// other. At most three.
inline Words nearest_words(std::string_view word, const Words &known)
{
  constexpr std::size_t MOST = 3, SHORTEST_BEGINNING = 3;
  const auto begins = [](std::string_view whole, std::string_view part) {
    return part.size() >= SHORTEST_BEGINNING && whole.substr(0, part.size()) == part;
  };
  std::vector<std::pair<std::size_t, std::string_view>> near;
  for (const std::string_view other : known) {
    const std::size_t distance = edit_distance(word, other);
    const std::size_t letters = std::max(word.size(), other.size());
    if (distance <= (letters + 1) / 3 || begins(other, word) || begins(word, other))
      near.emplace_back(distance, other);
  }
  std::stable_sort(near.begin(), near.end(),
                   [](const auto &a, const auto &b) { return a.first < b.first; });
  if (near.size() > MOST) near.resize(MOST);
  Words words;
  for (const auto &[distance, other] : near) words.push_back(other);
  return words;
}

/// "; did you mean servo or servo_gain?", or, where no known word is near, "; <these_are> a, b, c".
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

/// "unknown keyword 'frition'; did you mean friction?"; or of a number, that the keyword before it, `before` with its values, takes fewer.
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
