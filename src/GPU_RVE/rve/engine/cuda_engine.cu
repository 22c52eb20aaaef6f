// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/cuda_engine.h"

#include "cuda/cuda_device.h"
#include "cuda/device_buffer.cuh"
#include "rve/core/error.h"
#include "rve/core/wall_time.h"
#include "rve/engine/batch_engine.h"
#include "rve/engine/cuda_device_states.cuh"
#include "rve/engine/cuda_increments.cuh"
#include "rve/engine/cuda_launch_plan.cuh"
#include "rve/engine/cuda_turn.cuh"
#include "rve/engine/cuda_variants.h"
#include "rve/engine/device_calls.h"
#include "rve/engine/host_calls.h"
#include "rve/engine/runtime_kernels.h"

#include <algorithm>
#include <memory>
#include <utility>

namespace rve {

namespace {

  constexpr int LARGEST_BLOCK = 1024;
  constexpr int kMostPreparedTogether = 16;           ///< calls that one block prepares
  constexpr std::size_t kPrepareMemory = 32 << 10;    ///< shared memory of that block [bytes]
  /// Device memory that is needed in addition to the buffers [bytes]: a slab of 64 MB from which
  /// RVEs are cut can be partly unused, and the first launch allocates memory for code and stacks.
  constexpr std::size_t kSlack = std::size_t(256) << 20;

  /// Returns the smallest number of blocks of `threads` threads that have a thread for each of
  /// `count` items.
  int blocks_for(int count, int threads)
  {
    return (count + threads - 1) / threads;
  }

  template <int D> class CudaEngine final : public BatchEngine<D>, public DeviceCallsOf<D> {
    using Base = BatchEngine<D>;
    using Base::memory_layout;
    using Base::options;
    using typename Base::Answers;
    using typename Base::Call;

   public:
    CudaEngine(const Options &options_in, bool compiles_in) :
        Base(options_in), compiles(compiles_in), device(properties_of(options_in)),
        variants(options_in, 10 * device.major + device.minor)
    {
      require(options.block_size >= 0 && options.block_size <= LARGEST_BLOCK,
              "block size must be 0 (automatic) or in [1, 1024] threads, got " +
                  std::to_string(options.block_size));
      use_device();
    }

    std::string description() const override
    {
      return std::string(device.name) + ", " + to_string(options.format) +
          (options.arithmetic == Arithmetic::Relaxed ? ", relaxed" : ", strict") +
          (compiles ? "; the NVIDIA driver compiles the kernels at their first use, which takes "
                      "about 20 s once"
                    : "");
    }

    int cuda_device() const override { return options.device_number; }

    DeviceCallsOf<D> *device_calls() override { return this; }

    // ---- calls whose increments and stresses are on the device ----

    void plan(const DeviceCallOf<D> &call) override
    {
      this->require_nothing_under_way();
      use_device();
      device_call = &call;
      const int count = static_cast<int>(call.rves.size());
      IncrementLaunch<D> &launch = increments_of_call;
      if (call.is_new) {
        handled_call = false;
        steps_before = 0;
        plans_not_held = 0;
      }
      launch.rves = handles_of(call.rves);
      handled_call = true;
      if (call.is_new) {
        launch.point_of = point_buffer.upload(call.point_of);
        launch.planned = planned_buffer.upload(call.planned);
        launch.count = count;
        int smallest = 0;
        for (int k = 0; k < count; ++k) {
          const int grains = this->grains(call.rves[k]);
          smallest = k == 0 ? grains : std::min(smallest, grains);
          largest_of_call = k == 0 ? grains : std::max(largest_of_call, grains);
        }
        are_alike = smallest == largest_of_call;
        upload_resting(call.resting, count);
      }
      may_be_quiescent = call.options.quiescent_strain > 0.0 || has_resting;
      const bool has_order = may_be_quiescent || call.options.is_adaptive || !are_alike;
      launch.points = call.points;
      launch.options = call.options;
      launch.most_cost = static_cast<double>(call.options.is_adaptive ? call.options.adaptive.most
                                                                      : call.options.substeps) *
          largest_of_call;
      // Two buffers alternate, since the records of the previous call can still be unread, and
      // quiescent RVEs keep these records.
      launch.drives = planned_drives[1 - drives_in_use].reserve(count);
      launch.drives_before = planned_drives[drives_in_use].reserve(count);
      launch.rest = may_be_quiescent ? rest_buffer.reserve(count) : nullptr;
      launch.quiescent_states = may_be_quiescent ? quiescent_buffer.reserve_clean(count) : nullptr;
      launch.detail_of = may_be_quiescent ? detail_of_buffer.reserve(count) : nullptr;
      launch.classes = has_order ? class_buffer.reserve(count) : nullptr;
      launch.order = has_order ? planned_order_buffer.reserve(count) : nullptr;
      launch.findings = findings_buffer.reserve_zeros(1);
      launch.turns = planned_turns.reserve(count);
      plan_increments<D><<<blocks_for(count, kIncrementBlock), kIncrementBlock>>>(launch);
      if (has_order) order_increments<D><<<blocks_for(count, kCostClasses), kCostClasses>>>(launch);
      check_cuda(cudaGetLastError(), "launch of the kernel that plans increments");
      is_launched_early = false;
      this->note_plan();
      bring_findings(plan_findings);
    }

    bool launch_early() override
    {
      const PlanOptions &asked = increments_of_call.options;
      const bool knows_steps = !asked.is_adaptive || steps_before > 0;
      // An early launch requires that CallFindings::held was zero in several successive plans. A
      // single plan does not suffice: an RVE that was evaluated and found moving is never evaluated
      // in the next step.
      constexpr int AS_EXPECTED = 8;
      if (!knows_steps || (may_be_quiescent && plans_not_held < AS_EXPECTED)) return false;
      CallFindings expected = {};
      expected.longest = asked.is_adaptive ? asked.adaptive.most : asked.substeps;
      expected.steps = asked.is_adaptive
          ? steps_before
          : static_cast<unsigned long long>(increments_of_call.count) * asked.substeps;
      launch_planned(expected, &increments_of_call.findings->held);
      is_launched_early = true;
      return true;
    }

    bool launch() override
    {
      const CallFindings &found = *plan_findings.host_array(1);
      if (found.held && std::exchange(is_launched_early, false)) {
        wait_for_answers();
        drives_in_use = 1 - drives_in_use;    // as before the early launch
      }
      steps_before = found.steps;
      plans_not_held = found.held ? 0 : plans_not_held + 1;
      if (found.refused > 0) return false;
      if (!std::exchange(is_launched_early, false)) launch_planned(found, nullptr);
      this->note_launch();
      return true;
    }

    StressesAre wait() override
    {
      wait_for_answers();
      const CallFindings &found = *answer_findings.host_array(1);
      int unfinished = found.unfinished;
      const bool host_helps = unfinished > 0;
      if (host_helps && unfinished <= kMostUnfinished) unfinished = repeat_some(unfinished);
      const int *indices = increments_of_call.stiffened;
      stiffened_indices.assign(indices, indices + std::min(found.stiffened, this->MOST_STIFFENED));
      if (unfinished > 0) return StressesAre::OnHost;
      return host_helps ? StressesAre::OnDeviceByHost : StressesAre::OnDevice;
    }

    const std::vector<int> &stiffened() const override { return stiffened_indices; }

    const std::int32_t *needs_host() const override
    {
      return this->is_running() ? &increments_of_call.findings->unfinished : nullptr;
    }

    void deliver(IncrementCallOf<D> &caller) override
    {
      use_device();
      const std::size_t count = device_call->rves.size();
      const DriveRecord<D> *records = planned_drives[drives_in_use].receive(count);
      const int *detail_of = may_be_quiescent ? detail_of_buffer.receive(count) : nullptr;
      this->increments.resize(count);
      for (std::size_t k = 0; k < count; ++k) {
        this->increments[k] = increment_of(records[k]);
        this->increments[k].is_evaluated = detail_of && detail_of[k] >= 0;
      }
      this->answer(device_call->rves, caller,
                   {planned_answers[drives_in_use].receive(count), nullptr});
      if (!may_be_quiescent) return;
      this->report_rest(static_cast<int>(count), rest_buffer.receive(count),
                        quiescent_buffer.receive(count), caller);
    }

    void deliver_one(int index, IncrementCallOf<D> &caller) override
    {
      use_device();
      const IncrementOf<D> increment = increment_of(bring(increments_of_call.drives + index));
      const ResponseOf<D> response = this->to_response(bring(increments_of_call.answers + index));
      caller.take(index, index + 1, &increment, &response);
    }

    void set_limits(const std::vector<NewLimit> &limits) override
    {
      use_device();
      const int count = static_cast<int>(limits.size());
      if (count == 0) return;
      // upload() reuses the host buffer, so the previous upload from it must have ended. Only this
      // call synchronises with it.
      check_cuda(cudaStreamSynchronize(nullptr), "upload of contact counts");
      rve::set_limits<<<blocks_for(count, kIncrementBlock), kIncrementBlock>>>(
          limits_buffer.upload(limits), count, increments_of_call.planned);
      check_cuda(cudaGetLastError(), "launch of the kernel that sets limits");
    }

    /// Returns the reason why the engine cannot advance its RVEs, with a remedy; empty if it can.
    std::string obstacle() const
    {
      return variants.obstacle(memory_layout, runtime_kernels_obstacle());
    }

    std::size_t bytes_of_call(int num_rves, int num_grains) override
    {
      if (num_rves == 0) return 0;
      use_device();
      CallShape call;
      call.num_rves = num_rves;
      call.largest = num_grains;
      call.longest = kStepsAhead;
      call.mean = kStepsAhead;
      call.pair_capacity = this->pair_capacity(num_grains);
      call.variant = this->usual_variant();
      return plans.bytes_of(call) + kSlack +
          static_cast<std::size_t>(num_rves) *
          (sizeof(RveHandle) + sizeof(SteeringRecord<D>) + sizeof(int) + sizeof(DetailRecord<D>) +
           BYTES_PLANNED + 256 /* an RVE begins at a multiple of that */);
    }

   protected:
    std::unique_ptr<Base> make_alike(const Options &other) const override
    {
      auto engine = std::make_unique<CudaEngine>(other, compiles);
      const std::string obstacle = engine->obstacle();
      require(obstacle.empty(), obstacle);
      return engine;
    }

    Memory backend_memory() const override
    {
      use_device();
      std::size_t free = 0, total = 0;
      check_cuda(cudaMemGetInfo(&free, &total), "free memory of the device");
      // The UUID names the GPU equally for all ranks, although ranks can number their devices
      // differently.
      std::string name = "the memory of GPU ";
      for (const char byte : device.uuid.bytes) {
        const unsigned value = static_cast<unsigned char>(byte);
        name += {"0123456789abcdef"[value / 16], "0123456789abcdef"[value % 16]};
      }
      return {name, free, true, false};
    }

    void put_device_state(int rve, const DeviceState &device_state) override
    {
      use_device();
      device_states.put(rve, device_state);
    }

    DeviceState get_device_state(int rve) const override
    {
      use_device();
      return device_states.get(rve);
    }

    void drop_device_state(int rve) override { device_states.drop(rve); }

    void put_header(int rve, const StateHeader<D> &header) override
    {
      use_device();
      device_states.put_header(rve, header);
    }

    StateHeader<D> get_header(int rve) const override
    {
      use_device();
      return device_states.template get_header<D>(rve);
    }

    void turn_device_states(const std::vector<int> &rves,
                            const std::vector<Tensor<double, D>> &rotations) override
    {
      use_device();
      const std::size_t count = rves.size();
      // The host buffer is reused, so its previous upload must have ended. The next launch follows
      // the new upload in the stream.
      check_cuda(cudaStreamSynchronize(nullptr), "rotation of RVEs");
      TurnRecord<D> *turns = turn_buffer.host_array(count);
      for (std::size_t k = 0; k < count; ++k) {
        turns[k].rve = device_states.handle(rves[k]);
        store_tensor(rotations[k], turns[k].rotation);
      }
      launch_turns({turn_buffer.send(count), static_cast<int>(count), nullptr, nullptr});
    }

    DriveRecord<D> *drive_buffer(std::size_t count) override
    {
      use_device();
      return drives.host_array(count);
    }

    Answers begin_launch(const Call &call) override
    {
      if (is_for_host(call)) return evaluate_on_host(call);
      use_device();
      LaunchRecord<D> record;
      record.drives = call.drives;
      record.order = call.order ? order_buffer.upload(*call.order) : nullptr;
      record.answers = answers.host_array(call.num_rves);
      record.detail_of = call.detail_of ? asked_buffer.upload(*call.detail_of) : nullptr;
      record.launched = call.num_rves;
      record.hold = nullptr;
      run(call, record);
      details_to_receive = call.with_details ? num_details(call) : 0;
      return {record.answers,
              call.with_details ? detail_buffer.host_array(details_to_receive) : nullptr};
    }

    void end_launch() override
    {
      use_device();
      check_cuda(cudaStreamSynchronize(nullptr), "RVE kernel");
      if (const int count = std::exchange(details_to_receive, 0)) detail_buffer.receive(count);
    }

   private:
    /// Returns true if the host makes a call, which gives the same bits. The host evaluates RVEs
    /// whose kernel has not been compiled yet: most runs need it for a few evaluations only, such
    /// as those of the stable time step, and its compilation takes up to half a minute. If
    /// evaluations on the host have taken as long as a compilation, the kernel is compiled.
    bool is_for_host(const Call &call) const
    {
      constexpr double compilation = 10.0;    // [seconds]
      return call.longest == 0 && options.arithmetic == Arithmetic::Strict &&
          host_seconds < compilation && !plans.has_kernel(call);
    }

    /// Evaluates the RVEs of a call on the host. An evaluation can renew the list of an RVE, so the
    /// device states are copied to the host and back.
    Answers evaluate_on_host(const Call &call)
    {
      const auto begin = WallClock::now();
      if (!host) host = std::make_unique<HostCalls<D>>(options.format, options.threads);
      const Answers answers = host->template run<Answers>(call, [&](int k, const auto &advance) {
        const int rve = (*call.rves)[k];
        DeviceState device_state = get_device_state(rve);
        advance(device_state.bytes.data());
        device_states.replace(rve, device_state);
      });
      host_seconds += seconds_since(begin);
      return answers;
    }

    static int num_details(const Call &call)
    {
      return call.num_details > 0 ? call.num_details : call.num_rves;
    }

    /// Sets the state of rest (Rest) of the RVEs of a new call: uploads the known states and sets
    /// all others to Rest::Unknown.
    void upload_resting(const std::vector<RestingRve<D>> &resting, int count)
    {
      const int number = static_cast<int>(resting.size());
      has_resting = number > 0;
      rest_buffer.reserve_zeros(count);
      if (!has_resting) return;
      const RestingRve<D> *records = resting_buffer.upload(resting);
      place_resting<D><<<blocks_for(number, kIncrementBlock), kIncrementBlock>>>(
          records, number, rest_buffer.reserve(count), quiescent_buffer.reserve_clean(count),
          planned_drives[drives_in_use].reserve(count),
          planned_answers[drives_in_use].reserve(count));
      check_cuda(cudaGetLastError(), "launch of the kernel that marks resting RVEs");
    }

    /// Launches a planned call and the kernel that distributes its results. `found` contains the
    /// findings of the plan; in an early launch it contains the expected findings. If `hold` is not
    /// null and `*hold` is positive when the kernels run, they change no RVE and no stress.
    void launch_planned(const CallFindings &found, const int *hold)
    {
      use_device();
      IncrementLaunch<D> &launch = increments_of_call;
      launch.hold = hold;
      drives_in_use = 1 - drives_in_use;
      launch.answers = planned_answers[drives_in_use].reserve(launch.count);
      launch.answers_before = planned_answers[1 - drives_in_use].reserve(launch.count);
      launch.details = found.evaluations > 0 ? detail_buffer.reserve(launch.count) : nullptr;
      if (may_be_quiescent || launch.options.is_adaptive)
        launch_turns({launch.turns, launch.count, &launch.findings->turned, hold});
      const int launched = launch.count - found.num_quiescent;
      if (launched > 0) {
        Call call =
            this->call_of_increments(device_call->rves, largest_of_call, found.longest,
                                     static_cast<std::int64_t>(found.steps), found.evaluations);
        call.mean *= static_cast<double>(launch.count) / launched;
        LaunchRecord<D> record;
        record.drives = launch.drives;
        record.order = launch.order;
        record.answers = launch.answers;
        record.detail_of = launch.detail_of;
        record.launched = launched;
        record.hold = hold;
        run(call, record);
      }
      launch.stiffened = stiffened_buffer.host_array(this->MOST_STIFFENED);
      launch.unfinished = unfinished_buffer.host_array(kMostUnfinished);
      take_answers<D><<<blocks_for(launch.count, kIncrementBlock), kIncrementBlock>>>(launch);
      check_cuda(cudaGetLastError(), "launch of the kernel that collects results");
      bring_findings(answer_findings);
      answers_ready.set();
    }

    void launch_turns(const TurnList<D> &list)
    {
      constexpr int threads = 128;
      const int blocks = list.count_there ? std::min(list.count, 4 * device.multiProcessorCount)
                                          : list.count;
      turn_function<D>(options.format, memory_layout)<<<blocks, threads>>>(list);
      check_cuda(cudaGetLastError(), "launch of the rotation of RVEs");
    }

    void wait_for_answers()
    {
      use_device();
      answers_ready.wait("RVE kernel");
    }

    /// Launches the kernels of a call. The caller must have set drives, order, answers, detail_of,
    /// launched and hold in `record`.
    void run(const Call &call, LaunchRecord<D> &record)
    {
      const int count = call.num_rves;
      const LaunchPlan plan = plans.plan_for(call);

      record.rves = handles_of(*call.rves);
      record.steering = call.steering.empty() ? nullptr : upload_steering(call);
      // The details are zeroed, since an RVE that fails writes none.
      record.details = call.with_details ? detail_buffer.reserve_zeros(num_details(call)) : nullptr;
      record.count = count;
      record.queue = queue_buffer.reserve(1);
      record.prepared_size = plan.sizes.prepared;
      record.prepared = prepared_buffer.reserve_clean(record.prepared_size * count);
      record.steps_ahead = plan.steps_ahead;
      record.chip_size = plan.dynamic;
      record.overflow = aligned(plan.sizes.workspace);
      record.memory_stride = record.overflow + plan.overflow_size;
      const int resident = std::min(record.launched, plan.blocks);
      record.memory = workspace_buffer.reserve(record.memory_stride * resident);
      record.pair_capacity = call.pair_capacity;
      record.prepared_together = std::max(
          1,
          std::min(kMostPreparedTogether, static_cast<int>(kPrepareMemory / record.prepared_size)));
      const int preparing = blocks_for(count, record.prepared_together);
      record.ready = ready_buffer.reserve_clean(preparing);
      record.turn = ++turn_of_launch;
      // The block has one thread for each planned step of a call, but at most 16 per call. It has
      // at least one thread for each 16 bytes of a DriveRecord.
      const int threads = rounded_up(
          record.prepared_together * std::min(16, std::max(kThreadsPerCall<D>, plan.steps_ahead)),
          32);
      BatchConstants constants = call.constants;
      void *arguments[] = {&record, &constants};
      cudaLaunchConfig_t prepared = {};
      prepared.gridDim = preparing;
      prepared.blockDim = threads;
      prepared.dynamicSmemBytes = record.prepared_together * record.prepared_size;
      check_cuda(cudaLaunchKernelExC(&prepared, plan.prepare, arguments),
                 "launch of the kernel that prepares calls");
      // The blocks are placed on the device while the last calls are still being prepared. A block
      // begins when the call of its RVE is ready.
      cudaLaunchAttribute early = in_place_early(plan.waits);
      cudaLaunchConfig_t launched = {};
      launched.gridDim = resident;
      launched.blockDim = plan.block;
      launched.dynamicSmemBytes = plan.dynamic;
      launched.attrs = &early;
      launched.numAttrs = 1;
      check_cuda(cudaLaunchKernelExC(&launched, plan.kernel, arguments),
                 "launch of the RVE kernel");
      check_cuda(cudaGetLastError(), "launch of the RVE kernel");
    }

    template <class Record> static Record bring(const Record *from)
    {
      Record record;
      check_cuda(cudaMemcpy(&record, from, sizeof(record), cudaMemcpyDeviceToHost),
                 "download of a result");
      return record;
    }

    /// Repeats the calls of those of the `count` unfinished RVEs for which a repetition can
    /// succeed. Returns the number of RVEs that are still unfinished.
    int repeat_some(int count)
    {
      const IncrementLaunch<D> &launch = increments_of_call;
      std::vector<int> indices(launch.unfinished, launch.unfinished + count), rves;
      std::sort(indices.begin(), indices.end());
      std::vector<AnswerRecord<D>> first;
      std::vector<DriveOf<D>> drives;
      std::vector<char> is_evaluated;
      for (const int index : indices) {
        const AnswerRecord<D> answer = bring(launch.answers + index);
        if (!must_repeat(answer)) continue;
        first.push_back(answer);
        drives.push_back(increment_of(bring(launch.drives + index)).drive());
        is_evaluated.push_back(launch.rest && bring(launch.detail_of + index) >= 0);
        indices[rves.size()] = index;
        rves.push_back(device_call->rves[index]);
      }
      const int repeats = static_cast<int>(rves.size());
      if (repeats == 0) return count;
      const bool evaluations =
          std::find(is_evaluated.begin(), is_evaluated.end(), 1) != is_evaluated.end();
      const Answers last = this->repeat(
          rves, [&drives](std::size_t m) { return drives[m]; }, {first.data(), nullptr},
          evaluations ? Base::Answer::Longest : Base::Answer::Short);
      RepeatedRecord<D> *records = repeated_buffer.host_array(repeats);
      int finished = 0;
      for (int m = 0; m < repeats; ++m) {
        if (!is_sound(last.answers[m])) continue;
        RepeatedRecord<D> record = {indices[m], is_evaluated[m], last.answers[m], {}};
        if (is_evaluated[m]) record.details = last.details[m];
        records[finished++] = record;
      }
      if (finished > 0) {
        take_repeated<D><<<blocks_for(finished, kIncrementBlock), kIncrementBlock>>>(
            launch, repeated_buffer.send(finished), finished);
        check_cuda(cudaGetLastError(), "launch of the kernel that collects repeated results");
        bring_findings(answer_findings);
        check_cuda(cudaStreamSynchronize(nullptr), "repeated calls");
      }
      return count - finished;
    }

    static IncrementOf<D> increment_of(const DriveRecord<D> &record)
    {
      IncrementOf<D> increment;
      increment.dt = record.dt;
      increment.substeps = record.substeps;
      increment.deformation = load_tensor<D>(record.deformation);
      return increment;
    }

    /// Launches a copy of the present findings to the host. The copy is valid after a
    /// synchronisation.
    void bring_findings(HostBuffer<CallFindings> &to)
    {
      constexpr int words = kHostFindings / sizeof(int);
      copy_few<<<1, words>>>(reinterpret_cast<const int *>(increments_of_call.findings),
                             reinterpret_cast<int *>(to.host_array(1)), words);
      check_cuda(cudaGetLastError(), "download of the outcome of a call");
    }

    /// Uploads the records of a call with a servo. In the uploaded records pointers to modes are
    /// device pointers.
    const SteeringRecord<D> *upload_steering(const Call &call)
    {
      const std::size_t count = call.steering.size();
      SteeringRecord<D> *records = steering_buffer.host_array(count);
      std::copy(call.steering.begin(), call.steering.end(), records);
      if (!call.modes.empty()) {
        const SteeredModes<D> *modes = modes_buffer.upload(call.modes);
        for (std::size_t k = 0; k < count; ++k)
          if (records[k].modes) records[k].modes = modes + k;
      }
      return steering_buffer.send(count);
    }

    void use_device() const
    {
      check_cuda(cudaSetDevice(options.device_number), "choice of the device");
    }

    /// Returns the device handles of the RVEs of a call. The handles of the last call are reused if
    /// the RVEs are the same and no device state has moved.
    const RveHandle *handles_of(const std::vector<int> &rves)
    {
      const bool is_call = device_call && &rves == &device_call->rves;
      if (!device_states.have_moved && ((is_call && handled_call) || rves == handled))
        return handle_buffer.reserve(rves.size());
      handled_call = false;
      RveHandle *handles = handle_buffer.host_array(rves.size());
      for (std::size_t k = 0; k < rves.size(); ++k) handles[k] = device_states.handle(rves[k]);
      handled = rves;
      device_states.have_moved = false;
      return handle_buffer.send(rves.size());
    }

    static cudaDeviceProp properties_of(const Options &options)
    {
      cudaDeviceProp properties;
      check_cuda(cudaGetDeviceProperties(&properties, options.device_number), "device properties");
      return properties;
    }

    const bool compiles;    ///< CudaDevice::compiles
    const cudaDeviceProp device;
    const CudaVariants variants;
    CudaDeviceStates device_states;
    LaunchPlans plans{device, variants, options.block_size};
    std::unique_ptr<HostCalls<D>> host;    ///< evaluations on the host, see is_for_host()
    double host_seconds = 0.0;             ///< wall time of these evaluations [seconds]
    std::vector<int> handled;              ///< RVEs whose handles are on the device
    DeviceBuffer<RveHandle> handle_buffer;
    DeviceBuffer<SteeringRecord<D>> steering_buffer;
    DeviceBuffer<SteeredModes<D>> modes_buffer;
    DeviceBuffer<TurnRecord<D>> turn_buffer;
    DeviceBuffer<int> order_buffer, queue_buffer;
    // Kernels access these small host buffers over the bus, and access each element once.
    HostBuffer<DriveRecord<D>> drives{cudaHostAllocWriteCombined};    // the host only writes them
    HostBuffer<AnswerRecord<D>> answers;
    DeviceBuffer<DetailRecord<D>> detail_buffer;
    DeviceBuffer<int>
        asked_buffer;    ///< indices of details, if only some RVEs of a call have details
    DeviceBuffer<char> prepared_buffer, workspace_buffer;
    DeviceBuffer<unsigned> ready_buffer;
    unsigned turn_of_launch = 0;

    // Buffers of calls whose increments are on the device.
    static constexpr std::size_t BYTES_PLANNED = 2 * sizeof(DriveRecord<D>) +
        2 * sizeof(AnswerRecord<D>) + sizeof(PlannedRve) + sizeof(QuiescentStateOf<D>) +
        sizeof(Rest) + sizeof(TurnRecord<D>) + 3 * sizeof(int) + 1;    ///< bytes per RVE
    const DeviceCallOf<D> *device_call = nullptr;
    IncrementLaunch<D> increments_of_call = {};
    int largest_of_call = 0;
    bool are_alike = false;           ///< true if all RVEs have the same number of grains
    bool has_resting = false;         ///< true if some RestingRve was passed to the new call
    bool may_be_quiescent = false;    ///< true if some RVEs are or can become quiescent
    int details_to_receive = 0;
    bool handled_call = false;    ///< true if the handles on the device are those of device_call
    int drives_in_use = 0;        ///< index of the buffers of the last launched call
    DeviceBuffer<DriveRecord<D>> planned_drives[2];
    DeviceBuffer<int> point_buffer, planned_order_buffer;
    DeviceBuffer<PlannedRve> planned_buffer;
    DeviceBuffer<unsigned char> class_buffer;
    DeviceBuffer<CallFindings> findings_buffer;
    HostBuffer<CallFindings> plan_findings, answer_findings;    ///< host copies of findings
    Milestone answers_ready;
    bool is_launched_early = false;    ///< true if launched before the host read the plan
    /// Sum of DEM steps over RVEs in the previous plan of this call; 0 if the call is new.
    unsigned long long steps_before = 0;
    int plans_not_held = 0;    ///< number of successive plans up to now with CallFindings::held = 0
    std::vector<int> stiffened_indices;    ///< RVEs that exceeded their limits in the last call
    DeviceBuffer<TurnRecord<D>> planned_turns;
    DeviceBuffer<AnswerRecord<D>> planned_answers[2];
    DeviceBuffer<Rest> rest_buffer;
    DeviceBuffer<QuiescentStateOf<D>> quiescent_buffer;
    DeviceBuffer<int> detail_of_buffer;
    DeviceBuffer<RestingRve<D>> resting_buffer;
    DeviceBuffer<NewLimit> limits_buffer;
    HostBuffer<int> stiffened_buffer, unfinished_buffer;
    DeviceBuffer<RepeatedRecord<D>> repeated_buffer;
  };

}    // namespace

template <int D>
std::unique_ptr<EngineOf<D>> make_cuda_engine(const Options &options, std::string &obstacle)
{
  const CudaDevice device = find_cuda_device(
      options.device_number,
      reinterpret_cast<const void *>(turn_function<D>(
          Format::Fast, D == 2 ? KernelVariant::General : KernelVariant::Spheres)));
  obstacle = device.obstacle;
  if (!obstacle.empty()) return nullptr;
  Options own = options;
  own.device_number = device.number;
  auto engine = std::make_unique<CudaEngine<D>>(own, device.compiles);
  obstacle = engine->obstacle();
  if (!obstacle.empty()) return nullptr;
  return engine;
}

template std::unique_ptr<EngineOf<2>> make_cuda_engine(const Options &options,
                                                       std::string &obstacle);
template std::unique_ptr<EngineOf<3>> make_cuda_engine(const Options &options,
                                                       std::string &obstacle);

}    // namespace rve
