// SPDX-License-Identifier: GPL-2.0-only
// The block program (the code that advances one RVE) on a CPU thread, for RVEs of
// RVE_KERNEL_DIMENSION dimensions in the number format RVE_KERNEL_FORMAT. It is compiled for each
// instruction set, with RVE_ISA = baseline or v3. All instruction sets give the same bits, since
// std::fma has a single rounding everywhere. Without hardware support it is slow.

#include "rve/engine/host_kernels.h"

#include "rve/algorithm/step_loop.h"
#include "rve/block/block_serial.h"
#include "rve/engine/variant_configs.h"

#include <type_traits>
#if defined(__AVX2__) && defined(__FMA__)
#include "rve/algorithm/packed_grains.h"
#include "rve/block/block_simd.h"
#endif

#define RVE_JOIN_(a, b) a##b
#define RVE_JOIN(a, b) RVE_JOIN_(a, b)
#define RVE_KERNEL_NUMBERS RVE_JOIN(RVE_KERNEL_FORMAT, Numbers)

namespace rve {

inline namespace RVE_ISA {

  /// Block type and traversal of a kernel configuration whose steps visit one grain after the
  /// other.
  template <class Config> struct OneByOne {
    using Block = BlockSerial;
    using Grains = GrainItems<Block, Config>;
  };
#if defined(__AVX2__) && defined(__FMA__)
  template <class Config> struct InPacks {
    using Block = BlockSimd<kPackedGrains>;
    using Grains = PackedGrains<Block, Config>;
  };
  // The format single and kernels with energy bookkeeping visit one grain after the other.
  template <class Config>
  using Traversal = std::conditional_t<!Config::has_bookkeeping &&
                                           !std::is_same_v<typename Config::Numbers, SingleNumbers>,
                                       InPacks<Config>, OneByOne<Config>>;
#else
  template <class Config> using Traversal = OneByOne<Config>;
#endif

  template <class Config, class Traversal>
  void run_kernel(char *device_state, const DriveRecord<Config::D> &drive,
                  const SteeringRecord<Config::D> *steering, const BatchConstants &batch,
                  const HostWorkspace &memory, AnswerRecord<Config::D> &answer,
                  DetailRecord<Config::D> *detail)
  {
    using Block = typename Traversal::Block;
    const auto &header = *reinterpret_cast<const StateHeader<Config::D> *>(device_state);
    Block block;
    const auto shared = carve_shared<Config>(memory.shared, header.num_grains, Block::kInRegisters);
    using Begin = CallBegin<Block, Config>;
    using Planning = StepPlanning<Block, Config>;
    CallState<Config> call;
    call.header = header;
    call.drive = drive;
    call.steering = steering ? *steering : SteeringRecord<Config::D>();
    call.batch = batch;
    Begin::prepare(call, device_state, memory.pair_capacity);
    for (int t = 0; t < call.plan_last; ++t) Planning::plan_step(call, t, 1);
    Begin::set_views(call, header.num_grains, shared, memory.workspace, memory.pair_capacity);
    RveKernel<Block, Config, typename Traversal::Grains> kernel(block, call, shared);
    kernel.run(answer, detail);
  }

  /// Kernel variant that runs the calls of `variant`. Normally it is `variant` itself. With
  /// RVE_RICH_VARIANTS_ONLY it is VariantTraits::prepared_like, a more general variant that gives
  /// the same bits. This shortens compile times, but runs are slower.
#if defined(RVE_RICH_VARIANTS_ONLY)
  template <KernelVariant variant>
  constexpr KernelVariant kWorker = VariantTraits<variant>::prepared_like;
#else
  template <KernelVariant variant> constexpr KernelVariant kWorker = variant;
#endif

  template <int D, class Numbers>
  void advance(char *device_state, const DriveRecord<D> &drive, const SteeringRecord<D> *steering,
               const BatchConstants &batch, const HostWorkspace &memory, KernelVariant variant,
               AnswerRecord<D> &answer, DetailRecord<D> *detail)
  {
    with_variant<D>(variant, [&](auto chosen) {
      using Config = VariantConfig<kWorker<chosen.value>, Numbers>;
      run_kernel<Config, Traversal<Config>>(device_state, drive, steering, batch, memory, answer,
                                            detail);
    });
  }

  template <int D, class Numbers>
  HostWorkspaceSizes workspace_sizes(int num_grains, int pair_capacity, KernelVariant variant)
  {
    return with_variant<D>(variant, [&](auto chosen) -> HostWorkspaceSizes {
      using Config = VariantConfig<kWorker<chosen.value>, Numbers>;
      return {shared_size<Config>(num_grains, false),
              workspace_size<Config>(num_grains, pair_capacity)};
    });
  }

}    // namespace RVE_ISA

template <>
HostKernel<RVE_KERNEL_DIMENSION>
host_kernel<InstructionSet::RVE_ISA, RVE_KERNEL_DIMENSION, Format::RVE_KERNEL_FORMAT>()
{
  return {advance<RVE_KERNEL_DIMENSION, RVE_KERNEL_NUMBERS>,
          workspace_sizes<RVE_KERNEL_DIMENSION, RVE_KERNEL_NUMBERS>};
}

}    // namespace rve
