// SPDX-License-Identifier: GPL-2.0-only
// Number formats: the types of the numbers in a kernel.

#pragma once

#include "rve/core/config.h"

#include <cstdint>

namespace rve {
inline namespace RVE_ISA {

  /// Format `fast`: 32-bit fractions of the cell as coordinates, fp32 for all other numbers, forces
  /// summed in 32 bits.
  struct FastNumbers {
    using Scalar = FastNumbers;    ///< format of one lane; here the format itself
    /// Format with 32-bit coordinates. The leading 32 bits of a coordinate suffice to measure how
    /// far a grain has moved.
    using Leading = FastNumbers;
    using Coordinate = std::uint32_t;
    using SignedCoordinate = std::int32_t;
    using Wide = float;          ///< branch vector and gap
    using Spring = float;        ///< force of the spring of a contact
    using Real = float;          ///< all other numbers
    using Sum = std::int32_t;    ///< force on a grain
    static constexpr double fraction_unit = 1.0 / 4294967296.0;    // 2^-32
    static constexpr int sum_bits = 31;    ///< bits of a Sum without its sign
  };

  /// Format `mixed`: 64-bit fractions; branch vector, gap and tangential history in fp64; other
  /// numbers in fp32; forces summed in 32 bits.
  struct MixedNumbers {
    using Scalar = MixedNumbers;
    using Leading = FastNumbers;
    using Coordinate = std::uint64_t;
    using SignedCoordinate = std::int64_t;
    using Wide = double;
    using Spring = double;
    using Real = float;
    using Sum = std::int32_t;
    static constexpr double fraction_unit = 1.0 / 18446744073709551616.0;    // 2^-64
    static constexpr int sum_bits = 31;
  };

  /// Format `double`: 64-bit fractions, fp64 for all other numbers, forces summed in 64 bits.
  struct DoubleNumbers {
    using Scalar = DoubleNumbers;
    using Leading = FastNumbers;
    using Coordinate = std::uint64_t;
    using SignedCoordinate = std::int64_t;
    using Wide = double;
    using Spring = double;
    using Real = double;
    using Sum = std::int64_t;
    static constexpr double fraction_unit = 1.0 / 18446744073709551616.0;
    /// A CUDA block stores a Sum in two 32-bit numbers: its low 24 bits and its other bits
    /// (block/block_cuda.cuh). These are enough for 55 bits and a sign.
    static constexpr int sum_bits = 55;
  };

  /// Fraction of the cell in fp32, in [0, 1).
  struct FloatFraction {
    float value;
  };

  /// Format of the paper (Zhao, Zhao & Liang 2021): fp32 for all numbers, also for positions.
  /// Positions are fractions of the cell, whereas the paper has Cartesian coordinates; the
  /// resolution is the same, 2^-24 of the cell. The format is for studies of the loss of accuracy
  /// and is available only for disks on a CPU.
  struct SingleNumbers {
    using Scalar = SingleNumbers;
    using Leading = FastNumbers;
    using Coordinate = FloatFraction;
    using Wide = float;
    using Spring = float;
    using Real = float;
    using Sum = std::int32_t;
    static constexpr double fraction_unit = 1.0;
    static constexpr int sum_bits = 31;
  };

}    // namespace RVE_ISA
}    // namespace rve
