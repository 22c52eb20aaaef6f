// SPDX-License-Identifier: GPL-2.0-only
// Changes inputs as a careless or hostile writer would. The same seed gives the same changes on
// every machine.

#pragma once

#include "support/random.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace fuzz {

/// Returns numbers that are difficult for programs: zeros, ones, limits of integers and doubles,
/// and words that are not numbers. Large integers that fit in an int are omitted: as numbers of
/// steps or grains they would only take time.
inline const std::vector<std::string> &awkward_words()
{
  static const std::vector<std::string> words = {"0",
                                                 "1",
                                                 "-1",
                                                 "2",
                                                 "0.5",
                                                 "-0.0",
                                                 "7",
                                                 "1e-9",
                                                 "1e-14",
                                                 "1e-300",
                                                 "1e300",
                                                 "1e-3",
                                                 "-1e300",
                                                 "4.9e-324",
                                                 "1e308",
                                                 "2147483648",
                                                 "1e99",
                                                 "nan",
                                                 "inf",
                                                 "-inf",
                                                 "4294967296",
                                                 "-2147483648",
                                                 "9223372036854775808",
                                                 "18446744073709551615",
                                                 "1e400",
                                                 "0x10",
                                                 "1.0.0",
                                                 "+1",
                                                 ".",
                                                 "-",
                                                 "x",
                                                 "NULL",
                                                 "*",
                                                 "18446744073709551616",
                                                 "1,5",
                                                 "\xc3\xa9",
                                                 "yes",
                                                 "no",
                                                 "none",
                                                 "''"};
  return words;
}

class Mutator {
 public:
  explicit Mutator(std::uint64_t seed) : random(seed) {}

  template <class T> const T &one_of(const std::vector<T> &values)
  {
    return values[random.integer(0, static_cast<int>(values.size()) - 1)];
  }
  int integer(int low, int high) { return random.integer(low, high); }
  bool once_in(int times) { return random.integer(1, times) == 1; }
  std::string awkward_word() { return one_of(awkward_words()); }

  /// Changes bytes: flips bits, replaces bytes and 8-byte words, removes and repeats pieces, and
  /// truncates.
  std::string bytes(std::string data)
  {
    for (int k = few(); k > 0; --k) {
      if (data.empty()) return std::string(1, static_cast<char>(random.bits()));
      const std::size_t place = random.bits() % data.size();
      const std::size_t length = std::min<std::size_t>(data.size() - place, 1 + random.bits() % 64);
      switch (random.integer(0, 6)) {
        case 0:
          data[place] = static_cast<char>(data[place] ^ (1 << random.integer(0, 7)));
          break;
        case 1:
          data[place] = static_cast<char>(random.bits());
          break;
        case 2:
          put_word(data, place / 8 * 8);
          break;
        case 3:
          data.erase(place, length);
          break;
        case 4:
          data.insert(place, data.substr(place, length));
          break;
        case 5:
          if (once_in(4)) data.resize(place);
          break;
        default:
          put_word(data, place);
      }
    }
    return data;
  }

  /// Changes lines: replaces words, and removes, repeats and exchanges words and lines.
  std::string lines(const std::string &text)
  {
    std::vector<std::string> list = split(text, '\n');
    for (int k = few(); k > 0 && !list.empty(); --k) {
      const std::size_t line = random.bits() % list.size();
      switch (random.integer(0, 9)) {
        case 0:
          list.erase(list.begin() + static_cast<std::ptrdiff_t>(line));
          break;
        case 1:
          list.insert(list.begin() + static_cast<std::ptrdiff_t>(line), one_of(list));
          break;
        case 2:
          std::swap(list[line], list[random.bits() % list.size()]);
          break;
        default:
          list[line] = words(list[line]);
      }
    }
    return joined(list, "\n") + (once_in(20) ? "" : "\n");
  }

  /// Makes one change to a line: replaces, inserts, removes or exchanges words. A new word is an
  /// awkward word, a word of the line, or a word of `more`.
  std::string words(const std::string &line, const std::vector<std::string> &more = {})
  {
    std::vector<std::string> list = split(line, ' ');
    list.erase(std::remove(list.begin(), list.end(), std::string()), list.end());
    if (list.empty()) list.push_back("x");
    const std::size_t place = random.bits() % list.size();
    const auto at = list.begin() + static_cast<std::ptrdiff_t>(place);
    // Half of the changes replace a number by another number, which most rules accept.
    if (once_in(2)) {
      for (std::size_t k = 0; k < list.size(); ++k) {
        std::string &word = list[(place + k) % list.size()];
        char *end = nullptr;
        const double value = std::strtod(word.c_str(), &end);
        if (end == word.c_str() || *end != '\0') continue;
        const double factors[] = {-1.0, 0.0, 0.01, 0.1, 0.5, 1.5, 2.0, 10.0, 1e12, 1e-12};
        std::ostringstream text;
        text << factors[random.integer(0, 9)] * value;
        word = text.str();
        return joined(list, " ");
      }
    }
    switch (random.integer(0, 7)) {
      case 0:
        list.erase(at);
        break;
      case 1:
        list.insert(at, one_of(list));
        break;
      case 2:
        std::swap(list[place], list[random.bits() % list.size()]);
        break;
      case 3:
        list.insert(at, awkward_word());
        break;
      case 4:
        if (!more.empty()) {
          list.insert(at, one_of(more));
          break;
        }
        [[fallthrough]];
      default:
        list[place] = awkward_word();
    }
    return joined(list, " ");
  }

  static std::vector<std::string> split(const std::string &text, char separator)
  {
    std::vector<std::string> parts;
    std::istringstream stream(text);
    for (std::string part; std::getline(stream, part, separator);) parts.push_back(part);
    return parts;
  }

  static std::string joined(const std::vector<std::string> &parts, const char *separator)
  {
    std::string text;
    for (std::size_t k = 0; k < parts.size(); ++k) text += (k ? separator : "") + parts[k];
    return text;
  }

 private:
  rve_test::Random random;

  int few() { return once_in(4) ? random.integer(2, 6) : 1; }

  /// Writes an awkward double or integer of eight bytes.
  void put_word(std::string &data, std::size_t place)
  {
    if (place + 8 > data.size()) return;
    using Limits = std::numeric_limits<double>;
    const double doubles[] = {0.0,
                              -0.0,
                              1.0,
                              -1.0,
                              1e300,
                              Limits::max(),
                              Limits::min(),
                              Limits::denorm_min(),
                              1e-9,
                              1e9,
                              Limits::infinity(),
                              Limits::quiet_NaN()};
    const std::uint64_t integers[] = {0,
                                      1,
                                      2,
                                      0x7fffffffu,
                                      0x80000000u,
                                      0xffffffffu,
                                      0x7fffffffffffffffu,
                                      0x8000000000000000u,
                                      0xffffffffffffffffu,
                                      1u << 20};
    if (once_in(2))
      std::memcpy(&data[place], &doubles[random.integer(0, 11)], 8);
    else
      std::memcpy(&data[place], &integers[random.integer(0, 9)], 8);
  }
};

}    // namespace fuzz
