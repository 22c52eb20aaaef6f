// SPDX-License-Identifier: GPL-2.0-only
// The status word of an RVE.

#pragma once

#include <cstdint>

namespace rve {

/// Bits of the status word. `Ok` is zero. After a fatal status the RVE has the same state as before
/// the call.
namespace status {
  constexpr std::uint32_t Ok = 0;
  /// A list is full. The engine enlarges the list and repeats the call, up to eight times. After
  /// that the status is fatal.
  constexpr std::uint32_t ListFull = 1u << 0;
  /// A force is beyond the range of the integer sums. The engine repeats the call with a larger
  /// unit of forces. If the force is still beyond the range, the status is fatal.
  constexpr std::uint32_t ForceSaturated = 1u << 1;
  /// An overlap is above Options::overlap_limit; fatal.
  constexpr std::uint32_t OverlapTooLarge = 1u << 2;
  constexpr std::uint32_t NonFinite = 1u << 3;    ///< NaN or infinite motion or force; fatal
  /// A grain moved by more than a quarter of the cell in one step; fatal.
  constexpr std::uint32_t Unstable = 1u << 4;
  /// Half of the smallest perpendicular width of the cell is not above the cutoff of the Verlet
  /// list; fatal.
  constexpr std::uint32_t CellTooNarrow = 1u << 5;
  /// The packing has no contacts, and the stress is zero; a notice.
  constexpr std::uint32_t NoContacts = 1u << 6;
  constexpr std::uint32_t Fatal =
      ListFull | ForceSaturated | OverlapTooLarge | NonFinite | Unstable | CellTooNarrow;
}    // namespace status

}    // namespace rve
