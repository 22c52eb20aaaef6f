// SPDX-License-Identifier: GPL-2.0-only
// Table of kernel variants: the contact laws and features for which the code that advances an RVE
// is compiled. CMake makes CUDA translation units from the lines of the table, and an engine
// chooses a line for each call. bench/kernel_resources.py and the manual use the names of the
// lines.

#pragma once

namespace rve {

/// A line of the table is variant(name, law, kept, prepared):
///
/// law:      class template of physics/laws with the number format as its parameter. It determines
///           the contact law and whether there are friction, dashpots and rolling resistance;
/// kept:     work of a step in addition to forces and motion (Bookkept,
///           algorithm/kernel_config.h): None, Servo, or All (servo and energy bookkeeping);
/// prepared: variant whose kernel prepare_calls fills the PreparedCall records
///           (algorithm/call_state.h) of this variant. That variant has the same contact law and
///           memory layout of RVEs, and all features of every variant that names it.
///
/// Lean variants come first. A call uses the first variant that has the memory layout of its RVEs
/// and all features that the call needs (engine/variant_choice.h). Two variants with the same
/// memory layout give the same bits for calls that both support. Frictionless is for RVEs without
/// friction and without tangential forces. The last variant of a contact law has rolling
/// resistance; for spheres it also has twisting resistance.
///
/// Number format, arithmetic and residency (where the data of grains are stored) are not columns.
/// For CUDA, CMakeLists.txt makes five units of a line: fast, mixed and double in strict
/// arithmetic, fast and mixed in relaxed arithmetic. The option GPU_RVE_PROGRAMS_AT_RUN_TIME
/// selects lines that the build leaves out. If it selects any, the build also leaves out mixed in
/// relaxed arithmetic for all lines. runtime_kernels.cpp compiles the omitted kernels at run time.
/// CudaVariants contains the CUDA kernels in the format and arithmetic of an engine. For the CPU,
/// CMakeLists.txt compiles host_kernels.cpp once for each dimension, format (single for disks only)
/// and instruction set, always in strict arithmetic. make_variant_kernels (cuda_kernels.cuh)
/// collects the kernels of a line: one for each residency with grains in registers, with the block
/// sizes of block_shape (cuda_kernels.h), and one with grains in memory, for any number of grains.
// clang-format off
#define RVE_DISK_VARIANTS(variant)                             \
  variant(Frictionless, NormalSprings,     None,  General)      \
  variant(Plain,        FrictionalSprings, None,  General)      \
  variant(Steered,      FrictionalSprings, Servo, General)      \
  variant(General,      DampedSprings,     All,   General)      \
  variant(Rolling,      RollingSprings,    All,   Rolling)      \
  variant(PlainHertz,   UndampedHertz,     None,  Hertz)        \
  variant(Hertz,        HertzMindlin,      All,   Hertz)        \
  variant(HertzRolling, RollingHertz,      All,   HertzRolling) \
  variant(Dmt,          DmtAdhesion,       All,   Dmt)          \
  variant(DmtRolling,   RollingDmt,        All,   DmtRolling)

// Kernel variants of spheres.
#define RVE_SPHERE_VARIANTS(variant)                                             \
  variant(PlainSpheres,       FrictionalSphereSprings, None,  Spheres)            \
  variant(SteeredSpheres,     FrictionalSphereSprings, Servo, Spheres)            \
  variant(Spheres,            SphereSprings,           All,   Spheres)            \
  variant(SpheresRolling,     SphereRollingSprings,    All,   SpheresRolling)     \
  variant(SphereMindlinForce, SphereMindlinForce,      None,  SphereHertz)        \
  variant(PlainSphereHertz,   SphereUndampedHertz,     None,  SphereHertz)        \
  variant(SteeredSphereHertz, SphereUndampedHertz,     Servo, SphereHertz)        \
  variant(SphereHertz,        SphereHertzMindlin,      All,   SphereHertz)        \
  variant(SphereHertzRolling, SphereRollingHertz,      All,   SphereHertzRolling) \
  variant(SphereDmt,          SphereDmtAdhesion,       All,   SphereDmt)          \
  variant(SphereDmtRolling,   SphereRollingDmt,        All,   SphereDmtRolling)
// clang-format on

#define RVE_KERNEL_VARIANTS(variant) RVE_DISK_VARIANTS(variant) RVE_SPHERE_VARIANTS(variant)

#define RVE_VARIANT_NAME(name, law, kept, prepared) name,
enum class KernelVariant { RVE_KERNEL_VARIANTS(RVE_VARIANT_NAME) };
#undef RVE_VARIANT_NAME

#define RVE_VARIANT_COUNT(name, law, kept, prepared) +1
constexpr int kNumVariants = 0 RVE_KERNEL_VARIANTS(RVE_VARIANT_COUNT);
#undef RVE_VARIANT_COUNT

}    // namespace rve
