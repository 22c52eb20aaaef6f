// SPDX-License-Identifier: GPL-2.0-only
// The table of programs as types.

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

  /// What a program computes, in a number format.
  template <Program program, class Numbers>
  using ProgramScene = typename ProgramTraits<program>::template Scene<Numbers>;

}    // namespace RVE_ISA
}    // namespace rve
