// SPDX-License-Identifier: GPL-2.0-only
// The status word of an RVE.

#pragma once

#include <cstdint>

namespace rve {

/// Bits of the status word. `Ok` is zero. A fatal status leaves the RVE at the state before the call.
namespace status {
  constexpr std::uint32_t Ok = 0;
  /// Handled inside the engine: lists grow, the call is repeated.
  constexpr std::uint32_t ListFull = 1u << 0;
  /// A force beyond the integer range even after repeats; fatal.
  constexpr std::uint32_t ForceSaturated = 1u << 1;
  /// Overlap above Options::overlap_limit; fatal.
  constexpr std::uint32_t OverlapTooLarge = 1u << 2;
  constexpr std::uint32_t NonFinite = 1u << 3;    ///< a NaN or infinite drive or force; fatal
  /// A grain crossed a quarter of the cell in one step; fatal.
  constexpr std::uint32_t Unstable = 1u << 4;
  /// Half a perpendicular cell width below the cutoff; fatal.
  constexpr std::uint32_t CellTooNarrow = 1u << 5;
  /// The packing is a gas: stress is zero; a notice.
  constexpr std::uint32_t NoContacts = 1u << 6;
  constexpr std::uint32_t Fatal =
      ListFull | ForceSaturated | OverlapTooLarge | NonFinite | Unstable | CellTooNarrow;
}    // namespace status

}    // namespace rve
