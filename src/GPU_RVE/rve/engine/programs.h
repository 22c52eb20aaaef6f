// SPDX-License-Identifier: GPL-2.0-only
// The one table of programs: for which laws the block program is compiled. CMake makes a CUDA translation unit of each line in each
// number format, the engines choose a line for a call, bench/kernel_resources.py and the manual name kernels by it.

#pragma once

namespace rve {

/// program(name, law, books, prepared)
///
/// law:      of physics/laws, in a number format: it says for which contact law it is, and whether it has friction, dashpots and rolling
///           resistance;
/// books:    None, Servo, or All (algorithm/scene.h);
/// prepared: the program of the same contact law whose calls begin alike, with the same memory of an RVE: its kernel prepares them. It has
///           all that one of these programs has.
///
/// The leanest one first: of those with the memory of an RVE the first one serves a call that has what the call needs
/// (engine/program_choice.h). They give the same bits where a scene needs no more than the lesser one has. Frictionless: of RVEs without
/// friction and without tangential forces. The last one of a contact law has rolling resistance, that of
/// spheres resistance to twisting, too.
///
/// Number format, arithmetic and residency are no columns but loops elsewhere. CMakeLists.txt makes the CUDA units of a line: fast, mixed
/// and double, strict, and fast, relaxed. It also makes the CPU units: one of host_kernels.cpp for each dimension, format (single for disks
/// only) and instruction set, strict. CudaPrograms has the CUDA kernels of an engine's format and arithmetic. runtime_kernels.cpp compiles
/// those that the build left to the run. make_program_kernels (cuda_kernels.cuh) makes a kernel for each residency that a line has: grains in
/// registers, for the block sizes that block_shape (cuda_kernels.h) gives to a scene, or in memory, for any number.
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

// of spheres
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
