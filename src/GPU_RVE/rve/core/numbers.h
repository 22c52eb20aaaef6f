// SPDX-License-Identifier: GPL-2.0-only
// Number formats: the types that a program computes with, and nothing of physics.

#pragma once

#include "rve/core/config.h"

#include <cstdint>

namespace rve {
inline namespace RVE_ISA {

  /// 32-bit fractions, fp32 everywhere.
  struct FastNumbers {
    using Scalar = FastNumbers;    ///< the format of one number, of packs too
    /// For the leading 32 bits of coordinates, which show how far a grain has gone.
    using Leading = FastNumbers;
    using Coordinate = std::uint32_t;
    using SignedCoordinate = std::int32_t;
    using Wide = float;                                            ///< branch vector and gap
    using Spring = float;                                          ///< force of a contact's spring
    using Real = float;                                            ///< the rest
    using Sum = std::int32_t;                                      ///< force on a grain
    static constexpr double fraction_unit = 1.0 / 4294967296.0;    // 2^-32
    static constexpr int sum_bits = 31;    ///< that a force on a grain may fill
  };

  /// 64-bit fractions, branch, gap and tangential history in fp64, the rest in fp32.
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

  /// 64-bit fractions, fp64 everywhere, forces summed in 64 bits.
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
    /// The accumulators of a block are two limbs of 32 bits (block/block_cuda.cuh): 24 bits and the rest.
    static constexpr int sum_bits = 55;
  };

  /// Fraction of the cell in fp32, in [0, 1).
  struct FloatFraction {
    float value;
  };

  /// As the paper: fp32 everywhere, positions too. Those of the paper are Cartesian; fractions have the same resolution, 2^-24 of the
  /// cell. For the study of what this loses, of disks on a CPU.
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
