// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/host_engine.h"

#include "rve/core/threads.h"
#include "rve/engine/batch_engine.h"
#include "rve/engine/host_calls.h"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <sstream>

namespace rve {

namespace {

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

  template <int D> class HostEngine final : public BatchEngine<D> {
    using Base = BatchEngine<D>;
    using Base::memory_layout;
    using Base::options;
    using typename Base::Answers;
    using typename Base::Call;

   public:
    explicit HostEngine(const Options &options_in) :
        Base(options_in), calls(options_in.format, options_in.threads)
    {
    }

    std::string description() const override
    {
      const int threads = calls.num_threads();
      return std::to_string(threads) + " CPU thread" + (threads == 1 ? "" : "s") + " (" +
          (has_x86_64_v3() ? "x86-64-v3" : "baseline") + "), " + to_string(options.format) +
          ", strict";
    }

    std::size_t bytes_of_call(int num_rves, int num_grains) override
    {
      if (num_rves == 0) return 0;
      const HostWorkspaceSizes sizes =
          calls.workspace_sizes(num_grains, this->pair_capacity(num_grains), memory_layout);
      return static_cast<std::size_t>(std::min(calls.num_threads(), num_rves)) *
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
#pragma omp parallel for num_threads(team_for(count, calls.num_threads()))
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
      return calls.template run<Answers>(call, [&](int k, const auto &advance) {
        advance(device_states[(*call.rves)[k]].bytes.data());
      });
    }

   private:
    HostCalls<D> calls;
    std::vector<DeviceState> device_states;
    std::vector<DriveRecord<D>> drives;
  };

}    // namespace

template <int D> std::unique_ptr<EngineOf<D>> make_host_engine(const Options &options)
{
  return std::make_unique<HostEngine<D>>(options);
}

template std::unique_ptr<EngineOf<2>> make_host_engine(const Options &options);
template std::unique_ptr<EngineOf<3>> make_host_engine(const Options &options);

}    // namespace rve
