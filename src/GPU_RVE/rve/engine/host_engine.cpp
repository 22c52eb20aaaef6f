// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/host_engine.h"

#include "rve/core/error.h"
#include "rve/core/first_error.h"
#include "rve/core/threads.h"
#include "rve/engine/batch_engine.h"
#include "rve/engine/host_kernels.h"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <omp.h>
#include <sstream>

namespace rve {

namespace {

  bool has_x86_64_v3()
  {
#if defined(RVE_WITH_X86_64_V3)
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
        __builtin_cpu_supports("bmi2");
#else
    return false;
#endif
  }

  template <int D> HostKernel<D> choose_kernel(Format format)
  {
#if defined(RVE_WITH_X86_64_V3)
    if (has_x86_64_v3()) return host_kernel<InstructionSet::v3, D>(format);
#endif
#if defined(RVE_WITHOUT_BASELINE)
    throw InputError(
        "this build requires a CPU with AVX2, FMA and BMI2: it has no kernels for older CPUs "
        "(GPU_RVE_BASELINE_KERNELS=OFF)");
#else
    return host_kernel<InstructionSet::baseline, D>(format);
#endif
  }

  /// Returns the memory that programs can allocate without swapping [bytes], estimated by the Linux
  /// kernel; 0 if it is unknown.
  std::size_t available_memory()
  {
    std::ifstream file("/proc/meminfo");
    for (std::string line; std::getline(file, line);) {
      std::istringstream words(line);
      std::string name;
      std::size_t kibibytes;
      if (words >> name >> kibibytes && name == "MemAvailable:") return kibibytes * 1024;
    }
    return 0;
  }

  /// Memory of one thread, reused for all its RVEs.
  struct ThreadMemory {
    std::vector<char> shared, workspace;

    HostWorkspace prepare(const HostWorkspaceSizes &sizes, int pair_capacity)
    {
      if (shared.size() < sizes.shared) shared.resize(sizes.shared);
      if (workspace.size() < sizes.workspace) workspace.resize(sizes.workspace);
      return {shared.data(), workspace.data(), pair_capacity};
    }
  };

  template <int D> class HostEngine final : public BatchEngine<D> {
    using Base = BatchEngine<D>;
    using Base::memory_layout;
    using Base::options;
    using typename Base::Answers;
    using typename Base::Call;

   public:
    explicit HostEngine(const Options &options_in) :
        Base(options_in), kernel(choose_kernel<D>(options_in.format)),
        num_threads(options_in.threads > 0 ? options_in.threads : omp_get_max_threads()),
        memory(num_threads)
    {
    }

    std::string description() const override
    {
      return std::to_string(num_threads) + " CPU thread" + (num_threads == 1 ? "" : "s") + " (" +
          (has_x86_64_v3() ? "x86-64-v3" : "baseline") + "), " + to_string(options.format) +
          ", strict";
    }

    std::size_t bytes_of_call(int num_rves, int num_grains) override
    {
      if (num_rves == 0) return 0;
      const HostWorkspaceSizes sizes =
          kernel.workspace_sizes(num_grains, this->pair_capacity(num_grains), memory_layout);
      return static_cast<std::size_t>(std::min(num_threads, num_rves)) *
          (sizes.shared + sizes.workspace) +
          static_cast<std::size_t>(num_rves) *
          (Base::BYTES_PER_ANSWER + sizeof(DeviceState) + sizeof(DriveRecord<D>) +
           sizeof(SteeringRecord<D>));
    }

   protected:
    std::unique_ptr<Base> make_alike(const Options &other) const override
    {
      return std::make_unique<HostEngine>(other);
    }

    Memory backend_memory() const override
    {
      const std::size_t bytes = available_memory();
      return {"the memory of the host", bytes, bytes > 0, true};
    }

    void put_device_state(int rve, const DeviceState &device_state) override
    {
      if (rve >= static_cast<int>(device_states.size())) device_states.resize(rve + 1);
      device_states[rve] = device_state;
    }

    DeviceState get_device_state(int rve) const override { return device_states[rve]; }

    void drop_device_state(int rve) override { device_states[rve] = DeviceState(); }

    void put_header(int rve, const StateHeader<D> &header) override
    {
      std::memcpy(device_states[rve].bytes.data(), &header, sizeof(header));
    }

    StateHeader<D> get_header(int rve) const override
    {
      StateHeader<D> header;
      std::memcpy(&header, device_states[rve].bytes.data(), sizeof(header));
      return header;
    }

    void turn_device_states(const std::vector<int> &rves,
                            const std::vector<Tensor<double, D>> &rotations) override
    {
      const int count = static_cast<int>(rves.size());
#pragma omp parallel for num_threads(team_for(count, num_threads))
      for (int k = 0; k < count; ++k)
        turn_device_state(options.format, device_states[rves[k]], rotations[k], memory_layout);
    }

    DriveRecord<D> *drive_buffer(std::size_t count) override
    {
      drives.resize(count);
      return drives.data();
    }

    Answers begin_launch(const Call &call) override
    {
      const int count = call.num_rves;
      answers.assign(count, AnswerRecord<D>());
      if (call.with_details)
        details.assign(call.detail_of ? call.num_details : count, DetailRecord<D>());
      const auto detail_of = [&](int k) -> DetailRecord<D> * {
        if (!call.with_details) return nullptr;
        if (!call.detail_of) return &details[k];
        const int mine = (*call.detail_of)[k];
        return mine < 0 ? nullptr : &details[mine];
      };
      const HostWorkspaceSizes sizes =
          kernel.workspace_sizes(call.largest, call.pair_capacity, call.variant);
      FirstError failed;    // the allocation of a workspace can fail
#pragma omp parallel for schedule(dynamic, 1) num_threads(std::min(num_threads, std::max(count, 1)))
      for (int m = 0; m < count; ++m) {
        const int k = call.order ? (*call.order)[m] : m;
        failed.guard(k, [&] {
          const HostWorkspace workspace =
              memory[omp_get_thread_num()].prepare(sizes, call.pair_capacity);
          kernel.advance(device_states[(*call.rves)[k]].bytes.data(), call.drives[k],
                         call.steering.empty() ? nullptr : &call.steering[k], call.constants,
                         workspace, call.variant, answers[k], detail_of(k));
        });
      }
      failed.rethrow();
      return {answers.data(), call.with_details ? details.data() : nullptr};
    }

   private:
    const HostKernel<D> kernel;
    const int num_threads;
    std::vector<ThreadMemory> memory;
    std::vector<DeviceState> device_states;
    std::vector<DriveRecord<D>> drives;
    std::vector<AnswerRecord<D>> answers;
    std::vector<DetailRecord<D>> details;
  };

}    // namespace

template <int D> std::unique_ptr<EngineOf<D>> make_host_engine(const Options &options)
{
  return std::make_unique<HostEngine<D>>(options);
}

template std::unique_ptr<EngineOf<2>> make_host_engine(const Options &options);
template std::unique_ptr<EngineOf<3>> make_host_engine(const Options &options);

}    // namespace rve
