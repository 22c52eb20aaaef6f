// The block program on a CPU thread. Compiled for each instruction set with RVE_ISA = baseline or v3; the same bits from both
// (std::fma is exact everywhere, and slow where the hardware has none).

#include "rve/engine/host_kernels.h"

#include "rve/algorithm/step_loop.h"
#include "rve/block/block_serial.h"

#include <type_traits>
#if defined(__AVX2__) && defined(__FMA__)
#include "rve/algorithm/packed_grains.h"
#include "rve/block/block_simd.h"
#endif

#define RVE_JOIN_(a, b) a##b
#define RVE_JOIN(a, b) RVE_JOIN_(a, b)
#define RVE_HOST_NAMESPACE RVE_JOIN(host_, RVE_ISA)

namespace rve {

inline namespace RVE_ISA {

#if defined(__AVX2__) && defined(__FMA__)
  // a format for studies is not made fast
  template <class Format>
  using PlainBlock = std::conditional_t<std::is_same_v<Format, SingleFormat>, BlockSerial,
                                        BlockSimd<kPackedGrains>>;
#else
  template <class Format> using PlainBlock = BlockSerial;
#endif

  template <class Block, class Format, bool General>
  void run_program(char *image, const DriveRecord &drive, const SteeringRecord *steering,
                   const BatchConstants &batch, const HostWorkspace &memory, AnswerRecord &answer,
                   DetailRecord *detail)
  {
    const auto &header = *reinterpret_cast<const ImageHeader *>(image);
    Block block;
    const auto shared = carve_shared<Format>(memory.shared, header.num_grains, Block::kInRegisters);
    using Rare = RareWork<Block, Format>;
    CallState<Format> call;
    call.header = header;
    call.drive = drive;
    call.steering = steering ? *steering : SteeringRecord();
    call.batch = batch;
    Rare::prepare(call, image, memory.pair_capacity);
    for (int t = 0; t < call.plan_last; ++t) Rare::plan_step(call, t, 1);
    Rare::set_views(call, header.num_grains, shared, memory.workspace, memory.pair_capacity);
    RveProgram<Block, Format, General> program(block, call, shared);
    program.run(answer, detail);
  }

  template <class Format>
  void advance(char *image, const DriveRecord &drive, const SteeringRecord *steering,
               const BatchConstants &batch, const HostWorkspace &memory, SceneKind scene,
               AnswerRecord &answer, DetailRecord *detail)
  {
    if constexpr (!std::is_same_v<Format, SingleFormat>) {
      if (scene == SceneKind::Frictionless) {
        run_program<PlainBlock<Format>, Frictionless<Format>, false>(image, drive, steering, batch,
                                                                     memory, answer, detail);
        return;
      }
    }
    if (scene == SceneKind::Rolling)
      run_program<BlockSerial, Rolling<Format>, true>(image, drive, steering, batch, memory, answer,
                                                      detail);
    else if (scene != SceneKind::General)
      run_program<PlainBlock<Format>, Format, false>(image, drive, steering, batch, memory, answer,
                                                     detail);
    else
      run_program<BlockSerial, Format, true>(image, drive, steering, batch, memory, answer, detail);
  }

  template <class Format>
  HostWorkspaceSizes workspace_sizes(int num_grains, int pair_capacity, SceneKind scene)
  {
    if constexpr (!Format::has_rolling)
      if (scene == SceneKind::Rolling)
        return workspace_sizes<Rolling<Format>>(num_grains, pair_capacity, scene);
    HostWorkspaceSizes sizes;
    sizes.shared = shared_size<Format>(num_grains, false);
    sizes.workspace = workspace_size<Format>(num_grains, pair_capacity);
    return sizes;
  }

}    // namespace RVE_ISA

namespace RVE_HOST_NAMESPACE {
  HostKernel kernel(KernelFormat format)
  {
    switch (format) {
      case KernelFormat::Fast:
        return {advance<FastFormat>, workspace_sizes<FastFormat>};
      case KernelFormat::Mixed:
        return {advance<MixedFormat>, workspace_sizes<MixedFormat>};
      case KernelFormat::Single:
        return {advance<SingleFormat>, workspace_sizes<SingleFormat>};
      default:
        return {advance<DoubleFormat>, workspace_sizes<DoubleFormat>};
    }
  }
}    // namespace RVE_HOST_NAMESPACE

}    // namespace rve
