// SPDX-License-Identifier: GPL-2.0-only
// The table of kernel variants as types.

#pragma once

#include "rve/algorithm/scene.h"
#include "rve/engine/programs.h"
#include "rve/physics/laws/dmt_adhesion.h"
#include "rve/physics/laws/hertz_mindlin.h"
#include "rve/physics/laws/linear_friction.h"

namespace rve {
inline namespace RVE_ISA {

  template <Program> struct ProgramTraits;

#define RVE_PROGRAM_TRAITS(name, law, kept, prepared)                          \
  template <> struct ProgramTraits<Program::name> {                            \
    template <class Numbers> using Scene = SceneOf<law<Numbers>, Books::kept>; \
    static constexpr Program prepared_like = Program::prepared;                \
  };
  RVE_PROGRAMS(RVE_PROGRAM_TRAITS)
#undef RVE_PROGRAM_TRAITS

  /// Kernel configuration of a variant in a number format.
  template <Program program, class Numbers>
  using ProgramScene = typename ProgramTraits<program>::template Scene<Numbers>;

  /// Kernel variant as an argument of a generic function.
  template <Program program> struct ProgramConstant {
    static constexpr Program value = program;
    static constexpr Program prepared_like = ProgramTraits<program>::prepared_like;
  };

  /// Returns work(ProgramConstant) for a kernel variant of RVEs of D dimensions.
  template <int D, class Work> auto with_program(Program program, const Work &work)
  {
#define RVE_WITH_PROGRAM(name, law, books, prepared) \
  case Program::name:                                \
    return work(ProgramConstant<Program::name>());
    if constexpr (D == 2) {
      switch (program) {
        RVE_PLANE_PROGRAMS(RVE_WITH_PROGRAM)
        default:
          return work(ProgramConstant<Program::General>());
      }
    } else {
      switch (program) {
        RVE_SPATIAL_PROGRAMS(RVE_WITH_PROGRAM)
        default:
          return work(ProgramConstant<Program::Spheres>());
      }
    }
#undef RVE_WITH_PROGRAM
  }

}    // namespace RVE_ISA
}    // namespace rve
