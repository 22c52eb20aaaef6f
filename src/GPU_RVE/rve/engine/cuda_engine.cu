#include "rve/engine/cuda_engine.h"

#include "rve/core/error.h"
#include "rve/engine/batch_engine.h"
#include "rve/engine/cuda_kernels.cuh"
#include "rve/engine/device_buffer.cuh"

#include <algorithm>
#include <numeric>

namespace rve {

namespace {

  constexpr int LARGEST_BLOCK = 1024;

  CudaKernels kernels_for(Format format)
  {
    switch (format) {
      case Format::Fast:
        return cuda_kernels_fast();
      case Format::Mixed:
        return cuda_kernels_mixed();
      default:
        return cuda_kernels_double();
    }
  }

  std::size_t aligned(std::size_t size)
  {
    return (size + 255) / 256 * 256;
  }

  class CudaEngine final : public BatchEngine {
   public:
    explicit CudaEngine(const Options &options_in) :
        BatchEngine(options_in), kernels(kernels_for(options_in.format))
    {
      require(options.block_size >= 0 && options.block_size <= LARGEST_BLOCK,
              "block size must be 0 (automatic) or in [1, 1024] threads, got " +
                  std::to_string(options.block_size));
      use_device();
      check_cuda(cudaGetDeviceProperties(&device, options.device_number), "device properties");
    }

    std::string description() const override
    {
      return std::string(device.name) + ", " + to_string(options.format) + ", strict";
    }

   protected:
    void put_image(int rve, const StateImage &image) override
    {
      use_device();
      if (rve >= static_cast<int>(images.size())) images.resize(rve + 1);
      Placed &placed = images[rve];
      placed.num_grains = image.num_grains;
      placed.extra_capacity = image.extra_capacity;
      placed.size = image.bytes.size();
      placed.memory = arena.allocate(placed.size);
      check_cuda(cudaMemcpy(placed.memory, image.bytes.data(), placed.size, cudaMemcpyHostToDevice),
                 "upload of an RVE");
    }

    StateImage get_image(int rve) const override
    {
      use_device();
      const Placed &placed = images[rve];
      StateImage image;
      image.num_grains = placed.num_grains;
      image.extra_capacity = placed.extra_capacity;
      image.bytes.resize(placed.size);
      check_cuda(cudaMemcpy(image.bytes.data(), placed.memory, placed.size, cudaMemcpyDeviceToHost),
                 "download of an RVE");
      return image;
    }

    void drop_image(int rve) override
    {
      arena.release(images[rve].memory, images[rve].size);
      images[rve] = Placed();
    }

    void put_header(int rve, const ImageHeader &header) override
    {
      use_device();
      check_cuda(cudaMemcpy(images[rve].memory, &header, sizeof(header), cudaMemcpyHostToDevice),
                 "upload of a header");
    }

    ImageHeader get_header(int rve) const override
    {
      use_device();
      ImageHeader header;
      check_cuda(cudaMemcpy(&header, images[rve].memory, sizeof(header), cudaMemcpyDeviceToHost),
                 "download of a header");
      return header;
    }

    void launch(const std::vector<int> &rves, const std::vector<DriveRecord> &drives, int largest,
                int pair_capacity, std::vector<ResultRecord> &results) override
    {
      use_device();
      const int count = static_cast<int>(rves.size());
      std::vector<char *> pointers(count);
      for (int k = 0; k < count; ++k) pointers[k] = images[rves[k]].memory;
      std::vector<int> order(count);
      std::iota(order.begin(), order.end(), 0);
      const auto cost = [&](int k) {
        return static_cast<double>(drives[k].substeps) * images[rves[k]].num_grains;
      };
      std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
        return cost(a) > cost(b);
      });

      const int block = block_size(largest);
      const bool one_item = largest <= block;
      const KernelSizes sizes = kernels.sizes(largest, pair_capacity);
      const bool on_chip =
          sizes.shared + sizeof(CudaScratch) + 1024 <= device.sharedMemPerBlockOptin;
      const KernelFunction kernel = kernels.kernel[one_item][static_cast<int>(scene())];
      const std::size_t dynamic = on_chip ? sizes.shared : 0;
      check_cuda(cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize,
                                      static_cast<int>(dynamic)),
                 "shared memory of the kernel");
      int blocks_per_sm = 0;
      check_cuda(
          cudaOccupancyMaxActiveBlocksPerMultiprocessor(&blocks_per_sm, kernel, block, dynamic),
          "occupancy");
      require(blocks_per_sm > 0,
              "no thread block of " + std::to_string(block) + " threads fits on this device");
      const int resident = std::min(count, blocks_per_sm * device.multiProcessorCount);

      LaunchRecord record;
      record.images = pointer_buffer.upload(pointers);
      record.drives = drive_buffer.upload(drives);
      record.order = order_buffer.upload(order);
      record.results = result_buffer.reserve(count);
      record.count = count;
      record.queue = queue_buffer.upload(std::vector<int>{0});
      record.shared_offset = aligned(sizes.workspace);
      record.items_offset = record.shared_offset + (on_chip ? 0 : aligned(sizes.shared));
      record.memory_stride = record.items_offset + (one_item ? 0 : aligned(sizes.items));
      record.memory = workspace_buffer.reserve(record.memory_stride * resident);
      record.pair_capacity = pair_capacity;
      record.shared_on_chip = on_chip;
      kernel<<<resident, block, dynamic>>>(record, constants);
      check_cuda(cudaGetLastError(), "launch of the RVE kernel");
      result_buffer.download(results);
    }

   private:
    struct Placed {
      char *memory = nullptr;
      std::size_t size = 0;
      int num_grains = 0, extra_capacity = 0;
    };

    void use_device() const
    {
      check_cuda(cudaSetDevice(options.device_number), "choice of the device");
    }

    /// One thread per grain while that is possible: scheme D.
    int block_size(int num_grains) const
    {
      if (options.block_size > 0) return options.block_size;
      return std::min(LARGEST_BLOCK, (num_grains + 31) / 32 * 32);
    }

    const CudaKernels kernels;
    cudaDeviceProp device;
    DeviceArena arena;
    std::vector<Placed> images;
    DeviceBuffer<char *> pointer_buffer;
    DeviceBuffer<DriveRecord> drive_buffer;
    DeviceBuffer<int> order_buffer, queue_buffer;
    DeviceBuffer<ResultRecord> result_buffer;
    DeviceBuffer<char> workspace_buffer;
  };

}    // namespace

std::string find_cuda_obstacle(int device_number)
{
  int count = 0;
  const cudaError_t error = cudaGetDeviceCount(&count);
  if (error != cudaSuccess)
    return std::string("no CUDA device can be used (") + cudaGetErrorString(error) + ")";
  if (count == 0) return "there is no CUDA device";
  if (device_number >= count)
    return "there is no CUDA device number " + std::to_string(device_number) + ", only " +
        std::to_string(count);
  return "";
}

std::unique_ptr<Engine> make_cuda_engine(const Options &options)
{
  return std::make_unique<CudaEngine>(options);
}

}    // namespace rve
