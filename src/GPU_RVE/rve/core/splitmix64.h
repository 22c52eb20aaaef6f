// SPDX-License-Identifier: GPL-2.0-only
// The mixing function of SplitMix64. It makes choices that look random and depend only on numbers
// such as the ID of an atom, not on ranks, order or time.

#pragma once

#include <cstdint>

namespace rve {

/// Returns the first output of the generator SplitMix64 with seed `x` (Steele, Lea & Flood, OOPSLA
/// 2014, fig. 17). It is a bijection of 64 bits, so that different arguments have different
/// results.
constexpr std::uint64_t splitmix64(std::uint64_t x)
{
  x += 0x9e3779b97f4a7c15u;    // odd number nearest to 2^64 divided by the golden ratio
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

}    // namespace rve
