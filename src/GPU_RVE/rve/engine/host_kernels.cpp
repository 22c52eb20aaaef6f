// The block program on a CPU thread. Compiled for each instruction set with RVE_ISA = baseline or v3; the same bits from both
// (std::fma is exact everywhere, and slow where the hardware has none).

#include "rve/engine/host_kernels.h"

#include "rve/algorithm/step_loop.h"
#include "rve/block/block_serial.h"

#define RVE_JOIN_(a, b) a##b
#define RVE_JOIN(a, b) RVE_JOIN_(a, b)
#define RVE_HOST_NAMESPACE RVE_JOIN(host_, RVE_ISA)

namespace rve {

inline namespace RVE_ISA {

  template <class Format, class Features>
  void run_program(char *image, const DriveRecord &drive, const BatchConstants &batch,
                   const HostWorkspace &memory, ResultRecord &result)
  {
    const auto &header = *reinterpret_cast<const ImageHeader *>(image);
    BlockSerial block(memory.items);
    RveProgram<BlockSerial, Format, Features> program(
        block, carve_image<Format>(image, header.num_grains, header.extra_capacity),
        carve_shared<Format>(memory.shared, header.num_grains),
        carve_workspace<Format>(memory.workspace, header.num_grains, memory.pair_capacity), drive,
        batch);
    program.run(result);
  }

  template <class Format>
  void advance(char *image, const DriveRecord &drive, const BatchConstants &batch,
               const HostWorkspace &memory, SceneKind scene, ResultRecord &result)
  {
    switch (scene) {
      case SceneKind::Plain:
        return run_program<Format, SceneFeatures<false, false>>(image, drive, batch, memory,
                                                                result);
      case SceneKind::Viscous:
        return run_program<Format, SceneFeatures<true, false>>(image, drive, batch, memory, result);
      case SceneKind::Energy:
        return run_program<Format, SceneFeatures<true, true>>(image, drive, batch, memory, result);
    }
  }

  template <class Format> HostWorkspaceSizes workspace_sizes(int num_grains, int pair_capacity)
  {
    HostWorkspaceSizes sizes;
    carve_shared<Format>(nullptr, num_grains, &sizes.shared);
    carve_workspace<Format>(nullptr, num_grains, pair_capacity, &sizes.workspace);
    sizes.items = sizeof(GrainState<Format>) * static_cast<std::size_t>(num_grains);
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
      default:
        return {advance<DoubleFormat>, workspace_sizes<DoubleFormat>};
    }
  }
}    // namespace RVE_HOST_NAMESPACE

}    // namespace rve
