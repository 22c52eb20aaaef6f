// SPDX-License-Identifier: GPL-2.0-only
// Table of kernel variants: the contact laws and features for which the block program is compiled.
// CMake makes a CUDA translation unit of each line in each number format, the engines choose a line
// for a call, and bench/kernel_resources.py and the manual name kernels by it.

#pragma once

namespace rve {

/// Lines are program(name, law, books, prepared):
///
/// law:      class of physics/laws, in a number format, with its contact law, friction,
///           dashpots and rolling resistance;
/// books:    None, Servo, or All (algorithm/scene.h);
/// prepared: variant of the same contact law that prepares the calls. It has the same memory layout
///           of RVEs and all features of the variants that refer to it.
///
/// The leanest variant comes first: a call uses the first one with its memory layout and features
/// (engine/program_choice.h). Variants give the same bits for calls that need no more than the
/// lesser one has. Frictionless is for RVEs without friction and without tangential forces. The
/// last variant of a contact law has rolling resistance, for spheres also resistance to twisting.
///
/// Number format, arithmetic and residency are not columns. CMakeLists.txt makes the CUDA units of
/// a line: fast, mixed and double in strict arithmetic, and fast in relaxed arithmetic. It also
/// makes the CPU units: one of host_kernels.cpp for each dimension, format (single for disks only)
/// and instruction set, strict. CudaPrograms has the CUDA kernels of an engine's format and
/// arithmetic, and runtime_kernels.cpp compiles those that the build left out. make_program_kernels
/// (cuda_kernels.cuh) makes a kernel for each residency of a line: for grains in registers, with
/// the block sizes of block_shape (cuda_kernels.h), or in memory, for any number.
// clang-format off
#define RVE_PLANE_PROGRAMS(program)                             \
  program(Frictionless, NormalSprings,     None,  General)      \
  program(Plain,        FrictionalSprings, None,  General)      \
  program(Steered,      FrictionalSprings, Servo, General)      \
  program(General,      DampedSprings,     All,   General)      \
  program(Rolling,      RollingSprings,    All,   Rolling)      \
  program(PlainHertz,   UndampedHertz,     None,  Hertz)        \
  program(Hertz,        HertzMindlin,      All,   Hertz)        \
  program(HertzRolling, RollingHertz,      All,   HertzRolling) \
  program(Dmt,          DmtAdhesion,       All,   Dmt)          \
  program(DmtRolling,   RollingDmt,        All,   DmtRolling)

// Kernel variants of spheres.
#define RVE_SPATIAL_PROGRAMS(program)                                             \
  program(PlainSpheres,       FrictionalSphereSprings, None,  Spheres)            \
  program(SteeredSpheres,     FrictionalSphereSprings, Servo, Spheres)            \
  program(Spheres,            SphereSprings,           All,   Spheres)            \
  program(SpheresRolling,     SphereRollingSprings,    All,   SpheresRolling)     \
  program(SphereMindlinForce, SphereMindlinForce,      None,  SphereHertz)        \
  program(PlainSphereHertz,   SphereUndampedHertz,     None,  SphereHertz)        \
  program(SteeredSphereHertz, SphereUndampedHertz,     Servo, SphereHertz)        \
  program(SphereHertz,        SphereHertzMindlin,      All,   SphereHertz)        \
  program(SphereHertzRolling, SphereRollingHertz,      All,   SphereHertzRolling) \
  program(SphereDmt,          SphereDmtAdhesion,       All,   SphereDmt)          \
  program(SphereDmtRolling,   SphereRollingDmt,        All,   SphereDmtRolling)
// clang-format on

#define RVE_PROGRAMS(program) RVE_PLANE_PROGRAMS(program) RVE_SPATIAL_PROGRAMS(program)

#define RVE_PROGRAM_NAME(name, law, books, prepared) name,
enum class Program { RVE_PROGRAMS(RVE_PROGRAM_NAME) };
#undef RVE_PROGRAM_NAME

#define RVE_PROGRAM_COUNT(name, law, books, prepared) +1
constexpr int kNumPrograms = 0 RVE_PROGRAMS(RVE_PROGRAM_COUNT);
#undef RVE_PROGRAM_COUNT

}    // namespace rve
