// SPDX-License-Identifier: GPL-2.0-only
// Runs the passes of a time step on a CUDA device, which holds the arrays of points and grid.
//
// Host and device synchronise the points as follows. Positions and velocities are downloaded in
// every step while the laws run. Positions and velocities are uploaded if the caller's values
// differ from the downloaded values. Body forces are uploaded if they differ from the last upload.
// Laws on the host read ΔF and write stresses in every step. Stresses of laws on the device, and
// all other fields that a step changes, stay on the device until fetch().

#include "mpm/cuda_machine.h"

#include "cuda/cuda_device.h"
#include "cuda/device_buffer.cuh"
#include "cuda/launch_list.cuh"
#include "mpm/cuda_passes.cuh"
#include "mpm/grid_arrays.h"
#include "mpm/shared_nodes.h"
#include "mpm/step_sequence.h"
#include "rve/core/threads.h"
#include "rve/core/wall_time.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <stdexcept>
#include <type_traits>
#include <utility>

namespace mpm {

using rve::check_cuda;
using rve::copy_few;
using rve::DeviceBuffer;
using rve::HostBuffer;
using rve::LaunchList;
using rve::SideStream;

namespace {

  template <int D> class CudaMachine {
   public:
    CudaMachine(const SolverOptions<D> &options, const Grid<D> &grid,
                const Communication &communication) :
        device_number_(options.device_number),
        threads_(rve::usable_threads(options.threads)),
        view_(grid.part({}), options, communication.ranks > 1)
    {
      use_device();
      cudaDeviceProp device;
      check_cuda(cudaGetDeviceProperties(&device, device_number_), "device properties");
      name_ = device.name;
      cudaFuncAttributes attributes;
      check_cuda(cudaFuncGetAttributes(&attributes, set_to_zero), "attributes of a pass");
      passes_.set_early(rve::waits_itself(device.major, attributes));
      uuid_ = device.uuid;
    }

    /// Opens the exchange between the GPUs of the ranks. Collective; called after all ranks have
    /// made their machines.
    void join_ranks(const Communication &communication)
    {
      exchange_of_gpus_.open(communication, uuid_);
    }

    void begin(const StepInput<D> &input)
    {
      use_device();
      const Watch watch(transfer_seconds_);
      passes_.forget();    // a failed step may have left passes in the list
      host_points_ = input.points;
      view_.dt = input.dt;
      view_.num_models = input.num_models;
      const bool other_words = view_.num_loads != input.num_loads;
      view_.num_loads = input.num_loads;
      send_points(input.points, other_words);
      send_loads(input.loads);

      // maxima, error keys and data of bodies precede positions and velocities in one buffer, so
      // that one copy uploads all of them
      double *words = motion_.host_array(motion_size());
      std::fill_n(words, view_.body_maximum(0), 0.0);
      std::fill(words + view_.body_maximum(0), words + view_.num_maxima(),
                -std::numeric_limits<double>::infinity());
      const std::uint64_t no_error = PointErrorKey::NO_ERROR;
      for (int stage = 0; stage < NUM_STAGES; ++stage)
        std::memcpy(words + view_.num_maxima() + stage, &no_error, sizeof(no_error));
      double *velocities = words + view_.num_maxima() + NUM_STAGES;
      for (int b = 0; b < view_.num_bodies; ++b)
        for (int a = 0; a < D; ++a) {
          velocities[D * b + a] = input.body_velocity[b][a];
          velocities[D * (view_.num_bodies + b) + a] = input.body_velocity_before[b][a];
        }
      host_rigid_ = input.rigid.data();
      if (view_.num_rigid > 0)
        std::memcpy(words + rigid_offset(), host_rigid_, view_.num_rigid * sizeof(*host_rigid_));
      double *first = motion_.reserve(motion_size());
      if (std::exchange(motion_is_old_, false))
        motion_.send(motion_size());
      else
        launch(copy_few<double>, num_words(), words, first, num_words());

      findings_ = {first, reinterpret_cast<std::uint64_t *>(first + view_.num_maxima()), nullptr};
      view_.maximum = first;
      view_.body_velocity =
          reinterpret_cast<const Vec<D> *>(first + view_.num_maxima() + NUM_STAGES);
      view_.body_velocity_before = view_.body_velocity + view_.num_bodies;
      view_.rigid = reinterpret_cast<RigidBodyStep<D> *>(first + rigid_offset());
      view_.points.position = {first + num_words()};
      view_.points.velocity = {first + num_words() + rows(count_)};
    }

    const StepView<D> &view() const { return view_; }
    /// Points on the host with all fields downloaded; called for error messages.
    const PointView<D> &host_points()
    {
      download_motion();
      fetch(host_points_);
      return host_points_;
    }

    void set_part(const SharedNodes<D> &shared, const Boundary<D> &boundary)
    {
      if (shared.part_edition() != part_edition_) {
        part_edition_ = shared.part_edition();
        grid_arrays_.wire(view_, shared.part(), boundary);
        num_nodes_ = view_.grid.node_count();
      }
      view_.point_total = shared.point_total();
      view_.touched = shared.touched();
      // devices_exchange_ gets the same value on all ranks
      devices_exchange_ = exchange_of_gpus_.is_open() &&
          view_.num_maxima() <= ExchangeBuffers::MOST_MAXIMA &&
          shared.most_given() * SUMS_OF_NODE<D> <=
              ExchangeBuffers::buffer_length(exchange_of_gpus_.places().ranks);
      if (view_.num_rigid > 0 && view_.shares_grid) {
        view_.num_lower = shared.num_lower();
        view_.lower_touched = send(lower_touched_, shared.lower_touched(), shared.num_lower());
      }
      if (shared.edition() == shared_edition_) return;
      shared_edition_ = shared.edition();
      given_on_device_ = given_nodes_.upload(shared.given());
      taken_on_device_ = taken_nodes_.upload(shared.taken());
    }

    void divide_nodes(bool divides) { view_.divides_nodes = divides; }

    template <class P> void over(const P &pass)
    {
      const int count = pass.items();
      if (count == 0) return;
      with_options<P>([&](auto options, auto has_water) {
        launch(over_items<options.value, has_water.value, P>, count, pass, count, findings_);
      });
    }

    static constexpr bool is_synchronous() { return false; }

    /// Launches the passes in the list. Call this before any other access to the arrays of the
    /// passes.
    void submit() { passes_.hand_over("passes of the material point method"); }
    void wait()
    {
      submit();
      check_cuda(cudaStreamSynchronize(nullptr), "a step of the material point method");
    }
    void halt_if(const std::int32_t *flag) { findings_.halt = flag; }
    void request_findings()
    {
      launch(copy_few<double>, num_words(), findings_.maxima, motion_.host_array(motion_size()),
             num_words());
      submit();
      asked_.set();
    }
    void wait_for_findings()
    {
      asked_.wait("a step of the material point method");
      if (exchange_of_gpus_.is_left())
        throw std::runtime_error("another rank has failed in this step");
      is_ahead_ = motion_is_ahead_ = true;
      if (view_.num_rigid > 0) {
        static_assert(std::is_trivially_copyable_v<RigidBodyStep<D>>);
        std::memcpy(static_cast<void *>(host_rigid_),
                    motion_.host_array(motion_size()) + rigid_offset(),
                    view_.num_rigid * sizeof(*host_rigid_));
      }
    }
    void download_motion()
    {
      if (!motion_is_ahead_) return;
      motion_is_ahead_ = false;
      use_device();
      const Watch watch(transfer_seconds_);
      const double *motion = motion_.receive_beside(beside_, num_words(), 2 * rows(count_));
      const double *velocities = motion + rows(count_);
      share_out(3 * static_cast<std::size_t>(count_), 2 * sizeof(double), [&](int begin, int end) {
        std::copy(motion + begin, motion + end, host_points_.position.first + begin);
        std::copy(velocities + begin, velocities + end, host_points_.velocity.first + begin);
      });
    }
    std::uint64_t first_error()
    {
      for (int stage = 0; stage < NUM_STAGES; ++stage) {
        std::uint64_t first;
        std::memcpy(&first, maxima() + view_.num_maxima() + stage, sizeof(first));
        if (first != PointErrorKey::NO_ERROR) return first;
      }
      return PointErrorKey::NO_ERROR;
    }
    const double *maxima() { return motion_.host_array(motion_size()); }

    void share_maxima(const Communication &communication, int first, int count)
    {
      if (communication.ranks == 1 || count == 0) return;
      double *on_device = findings_.maxima + first;
      if (devices_exchange_) {
        passes_.add(exchange_maxima<double>, 1, EXCHANGE_BLOCK, exchange_of_gpus_.places(),
                    findings_.halt, on_device, count);
        return;
      }
      submit();
      double *shared = shared_maxima_.host_array(count);
      launch(copy_few<double>, count, on_device, shared, count);
      wait();
      communication.max_over_ranks(shared, count);
      launch(copy_few<double>, count, shared, on_device, count);
    }

    bool devices_exchange() const { return devices_exchange_; }
    void exchange_sums(MoveSums<D> given, const SharedNodes<D> &shared)
    {
      MoveSums<D> taken = given;
      taken.nodes = taken_on_device_;
      taken.packs = false;
      ExchangePartners partners = {};
      int given_end = 0, taken_end = 0;
      for (const Neighbour &other : shared.neighbours())
        partners.partner[partners.count++] = {other.rank,
                                              given_end += static_cast<int>(other.given),
                                              taken_end += static_cast<int>(other.taken)};
      passes_.add(exchange_node_sums<D>, 1, EXCHANGE_BLOCK, exchange_of_gpus_.places(), partners,
                  given, taken, findings_);
    }
    void leave_ranks() { exchange_of_gpus_.leave(); }

    const int *given_nodes() const { return given_on_device_; }
    const int *taken_nodes() const { return taken_on_device_; }
    /// Returns a buffer in page-locked memory, which passes can access. For a few kilobytes such
    /// access is faster than a copy.
    std::int64_t *exchange_buffer(std::size_t count)
    {
      submit();
      return exchange_.host_array(count);
    }

    template <class P> void scatter(const P &pass)
    {
      if (num_nodes_ == 0 || count_ == 0) return;
      // the sums of all kinds are contiguous
      const std::size_t middle = width_of<D>(InertiaSums) * num_nodes_;
      const std::size_t first = P::adds_to(InertiaSums) ? 0 : middle;
      const std::size_t end = P::adds_to(VectorSums) ? SUMS_OF_NODE<D> * num_nodes_ : middle;
      launch(set_to_zero, end - first, view_.all_sums + first, end - first);
      add_items(pass);
    }
    template <class P> void scatter_loads(const P &pass)
    {
      if (pass.items() > 0) add_items(pass);
    }
    const Tensor<D> *increments()
    {
      const Watch watch(transfer_seconds_);
      submit();
      use_device();
      return increment_.receive(count_);
    }
    const double *hoop_increments()
    {
      if (!view_.is_axisymmetric()) return nullptr;
      const Watch watch(transfer_seconds_);
      submit();
      use_device();
      return hoop_increment_.receive(count_);
    }
    DeviceArrays<D> device_arrays()
    {
      submit();
      DeviceArrays<D> arrays = {device_number_, view_.increment, view_.points.stress};
      if constexpr (D == 2)
        if (view_.is_axisymmetric()) arrays.hoop = {view_.hoop_increment, view_.points.hoop_stress};
      return arrays;
    }
    void expect_device_stresses() { stresses_are_ahead_ = true; }

    void stresses_changed()
    {
      use_device();    // the laws may have chosen another device
      const Watch watch(transfer_seconds_);
      stresses_are_ahead_ = false;
      view_.points.stress = send(fields_.stress, host_points_.stress, count_);
      if constexpr (D == 2)
        if (view_.is_axisymmetric())
          view_.points.hoop_stress = send(fields_.hoop_stress, host_points_.hoop_stress, count_);
    }

    void fetch(const PointView<D> &points)
    {
      if (!is_ahead_) return;
      use_device();
      const Watch watch(transfer_seconds_);
      PointFields<D, Buffer>::each(
          [&](const auto &, auto *to, auto &buffer) {
            if constexpr (!std::is_const_v<std::remove_pointer_t<decltype(to)>>)
              if (stresses_are_ahead_ || !is_stress(points, to))
                copy(to, buffer.receive(count_), count_);
          },
          points, fields_);
      WaterFields<D, Buffer>::each(
          [&](auto *to, auto &buffer) {
            if constexpr (!std::is_const_v<std::remove_pointer_t<decltype(to)>>)
              if (to && view_.water.flows()) copy(to, buffer.receive(count_), count_);
          },
          points.water, water_);
      stresses_are_ahead_ = false;
      is_ahead_ = false;
    }
    void points_changed() { points_are_old_ = true; }

    template <class T> const T *of_nodes(const T *field, int row = 0)
    {
      submit();
      use_device();
      const std::size_t bytes = num_nodes_ * sizeof(T);
      char *values = of_nodes_.host_array(bytes);
      if (bytes > 0)
        check_cuda(cudaMemcpy(values, field + view_.in_row(row, 0), bytes, cudaMemcpyDeviceToHost),
                   "download of a field of nodes");
      return reinterpret_cast<const T *>(values);
    }
    double unbalanced() { return motion_size() > 0 ? maxima()[Unbalanced] : 0.0; }

    double transfer_time() const { return transfer_seconds_; }
    std::string description() const
    {
      return name_ + (exchange_of_gpus_.is_open() ? ", ranks exchange sums on their GPUs" : "");
    }

   private:
    template <class T> using Buffer = DeviceBuffer<std::remove_const_t<T>>;

    // arrays in one buffer begin at multiples of this number of doubles
    static constexpr std::size_t ALIGNMENT = 4;

    /// True if a field of points has stresses, which laws can write on the host or on the device.
    static bool is_stress(const PointView<D> &points, const void *field)
    {
      if constexpr (D == 2)
        if (field == points.hoop_stress) return true;
      return field == points.stress;
    }

    /// Adds the wall time of a scope to a number [seconds].
    class Watch {
     public:
      explicit Watch(double &seconds) : seconds_(seconds), start_(rve::WallClock::now()) {}
      ~Watch() { seconds_ += rve::seconds_since(start_); }
      Watch(const Watch &) = delete;
      Watch &operator=(const Watch &) = delete;

     private:
      double &seconds_;
      rve::WallClock::time_point start_;
    };

    void use_device() const { check_cuda(cudaSetDevice(device_number_), "choice of the device"); }

    /// Appends a kernel to the list, with a thread for each of `count` items. The kernel must call
    /// rve::follow().
    template <class... Parameters>
    void launch(void (*kernel)(Parameters...), std::size_t count,
                const std::common_type_t<Parameters> &...arguments)
    {
      passes_.add(kernel, static_cast<unsigned>((count + BLOCK - 1) / BLOCK), BLOCK, arguments...);
    }

    /// Calls visit(options, has_water) with the compile-time arguments of the kernels of a pass
    /// that have no more than the options of this solver. Passes over nodes have all options.
    template <class P, class Visit> void with_options(const Visit &visit)
    {
      const auto with_water = [&](auto options) {
        if constexpr (P::USES_WATER)
          if (view_.has_water()) return visit(options, std::true_type());
        visit(options, std::false_type());
      };
      if constexpr (P::OVER_POINTS) {
        if (!view_.has_boxes())
          return with_water(std::integral_constant<KernelOptions, KernelOptions::Default>());
        if (D == 3 || !view_.is_axisymmetric())
          return with_water(std::integral_constant<KernelOptions, KernelOptions::Boxes>());
      }
      if constexpr (D == 2 || !P::OVER_POINTS)
        with_water(std::integral_constant<KernelOptions, KernelOptions::All>());
    }

    /// Appends a pass to the list. The pass adds its items to sums, which must have been set to
    /// zero before.
    template <class P> void add_items(const P &pass)
    {
      const SumsByKind<SharedSums> sums = {{{view_.sums[InertiaSums]}, {view_.sums[VectorSums]}}};
      with_options<P>([&](auto options, auto has_water) {
        launch(scatter_items<options.value, has_water.value, P>, pass.items(), pass, pass.items(),
               findings_, sums);
      });
    }

    /// Number of doubles in `count` rows of three, rounded up to a multiple of ALIGNMENT.
    static std::size_t rows(int count)
    {
      return (3 * static_cast<std::size_t>(count) + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
    }
    /// Offset of the rigid bodies in motion_ [doubles].
    std::size_t rigid_offset() const
    {
      return view_.num_maxima() + NUM_STAGES + 2 * D * view_.num_bodies;
    }
    /// Number of doubles before the positions in motion_.
    std::size_t num_words() const
    {
      static_assert(sizeof(RigidBodyStep<D>) % sizeof(double) == 0 &&
                    alignof(RigidBodyStep<D>) == alignof(double));
      const std::size_t words =
          rigid_offset() + view_.num_rigid * sizeof(RigidBodyStep<D>) / sizeof(double);
      return (words + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
    }
    std::size_t motion_size() const { return count_ < 0 ? 0 : num_words() + 2 * rows(count_); }

    /// Number of work items (rve::LightWork) in a copy or comparison of `bytes` bytes. An item of
    /// 256 bytes takes about as long as one point in other loops.
    static int pieces(std::size_t bytes) { return static_cast<int>(bytes / 256); }
    /// Splits `count` elements of `bytes` bytes each among threads. Each thread calls share(begin,
    /// end) for its part.
    template <class Share> void share_out(std::size_t count, std::size_t bytes, Share share) const
    {
      const rve::LightWork work(pieces(count * bytes), threads_);
#pragma omp parallel num_threads(work.team)
      {
        const rve::ThreadShare mine(static_cast<int>(count));
        if (mine.begin < mine.end) share(mine.begin, mine.end);
      }
    }
    template <class T> void copy(T *to, const T *from, std::size_t count) const
    {
      share_out(count, sizeof(T),
                [=](int begin, int end) { std::copy(from + begin, from + end, to + begin); });
    }
    /// True if the bytes of two arrays are equal from element `begin` to before `end`.
    template <class T> static bool is_same(const T *one, const T *other, int begin, int end)
    {
      return std::memcmp(one + begin, other + begin, (end - begin) * sizeof(T)) == 0;
    }

    template <class T> T *send(DeviceBuffer<T> &buffer, const T *from, std::size_t count) const
    {
      copy(buffer.host_array(count), from, count);
      return buffer.send(count);
    }

    void send_points(const PointView<D> &points, bool other_words)
    {
      const int count = points.count;
      const bool all = points_are_old_ || count != count_;
      count_ = count;
      view_.points.count = count;
      if (all) {
        PointFields<D, Buffer>::each([&](const auto &, auto &there, auto &buffer,
                                         auto *here) { there = send(buffer, here, count); },
                                     view_.points, fields_, points);
        WaterFields<D, Buffer>::each(
            [&](auto &there, auto &buffer, auto *here) {
              there = here ? send(buffer, here, count) : nullptr;
            },
            view_.points.water, water_, points.water);
        view_.support = support_.reserve(count);
        if (view_.has_boxes()) view_.box = box_.reserve(count);
        view_.increment = increment_.reserve(count);
        if (view_.is_axisymmetric()) {
          view_.hoop_increment = hoop_increment_.reserve(count);
          view_.hoop_weights = hoop_weights_.reserve(count);
        }
        is_ahead_ = false;
        points_are_old_ = false;
      }
      // the host seldom changes these arrays; one team of threads compares all of them
      const std::size_t size = 3 * static_cast<std::size_t>(count);
      double *motion = motion_.host_array(motion_size()) + num_words();
      double *velocities = motion + rows(count), *force = body_force_.host_array(size);
      bool other_kinds = all, other_force = all;
      motion_is_old_ = all || other_words;
      if (!all) {
        const int *model = model_copy_.data(), *body = body_copy_.data();
        std::atomic<bool> kinds_differ = false, force_differs = false, motion_differs = false;
        share_out(count, 2 * sizeof(int) + 9 * sizeof(double), [&](int begin, int end) {
          if (!is_same(points.model, model, begin, end) ||
              !is_same(points.rigid_body, body, begin, end))
            kinds_differ = true;
          if (!is_same<double>(points.body_force.first, force, 3 * begin, 3 * end))
            force_differs = true;
          if (!is_same<double>(points.position.first, motion, 3 * begin, 3 * end) ||
              !is_same<double>(points.velocity.first, velocities, 3 * begin, 3 * end))
            motion_differs = true;
        });
        other_kinds = kinds_differ;
        other_force = force_differs;
        motion_is_old_ = motion_is_old_ || motion_differs;
      }
      if (other_kinds) {
        model_copy_.assign(points.model, points.model + count);
        view_.points.model = send(model_, model_copy_.data(), count);
        body_copy_.assign(points.rigid_body, points.rigid_body + count);
        view_.points.rigid_body = send(body_, body_copy_.data(), count);
      }
      if (other_force) view_.points.body_force = {send(body_force_, points.body_force.first, size)};
      if (!motion_is_old_) return;
      copy(motion, points.position.first, size);
      copy(velocities, points.velocity.first, size);
    }

    void send_loads(const std::vector<PointLoad<D>> &loads)
    {
      view_.num_point_loads = static_cast<int>(loads.size());
      const bool same = loads.size() == load_copy_.size() &&
          std::equal(loads.begin(), loads.end(), load_copy_.begin(),
                     [](const PointLoad<D> &a, const PointLoad<D> &b) {
                       return a.point == b.point && a.load == b.load && a.face == b.face &&
                           a.follows == b.follows &&
                           std::equal(a.traction.component, a.traction.component + D,
                                      b.traction.component);
                     });
      if (same) return;
      load_copy_ = loads;
      view_.loads = send(loads_, load_copy_.data(), load_copy_.size());
    }

    int device_number_, threads_;
    StepView<D> view_;
    std::size_t num_nodes_ = 0;    ///< nodes of the part
    std::string name_;
    LaunchList passes_;
    double transfer_seconds_ = 0.0;

    GridArrays<D, DeviceBuffer> grid_arrays_;
    HostBuffer<char> of_nodes_;    ///< values that of_nodes() returned last

    // exchange with other ranks
    DeviceBuffer<int> given_nodes_, taken_nodes_;
    DeviceBuffer<NodeBox<D>> lower_touched_;
    const int *given_on_device_ = nullptr, *taken_on_device_ = nullptr;
    int shared_edition_ = 0, part_edition_ = 0;
    HostBuffer<std::int64_t> exchange_;
    HostBuffer<double> shared_maxima_;
    cudaUUID_t uuid_ = {};
    RankExchange exchange_of_gpus_;
    bool devices_exchange_ = false;

    // points
    int count_ = -1;    ///< number of points on the device; -1 before the first step
    PointView<D> host_points_;
    bool points_are_old_ = true;         ///< all points must be uploaded
    bool motion_is_old_ = true;          ///< positions and velocities must be uploaded
    bool is_ahead_ = false;              ///< strains and volumes of the host are out of date
    bool stresses_are_ahead_ = false;    ///< stresses of the host are out of date
    bool motion_is_ahead_ = false;       ///< positions and velocities of the host are out of date
    SideStream beside_;                  ///< stream for copies while RVEs advance
    rve::Milestone asked_;
    DeviceBuffer<double> motion_;    ///< findings, data of bodies, positions, velocities
    RigidBodyStep<D> *host_rigid_ = nullptr;
    PointFields<D, Buffer> fields_;
    WaterFields<D, Buffer> water_;
    DeviceBuffer<double> body_force_;
    DeviceBuffer<int> model_, body_;
    std::vector<int> model_copy_, body_copy_;
    DeviceBuffer<Support<D>> support_;
    DeviceBuffer<PointBox<D>> box_;
    DeviceBuffer<Tensor<D>> increment_;
    DeviceBuffer<double> hoop_increment_;
    DeviceBuffer<HoopWeights> hoop_weights_;
    DeviceBuffer<PointLoad<D>> loads_;
    std::vector<PointLoad<D>> load_copy_;
    Findings findings_ = {};
  };

}    // namespace

template <int D>
std::unique_ptr<StepRunner<D>> make_cuda_machine(const SolverOptions<D> &options,
                                                 const Communication &communication,
                                                 const Grid<D> &grid, std::string &obstacle)
{
  const rve::CudaDevice device = rve::find_cuda_device(
      options.device_number,
      reinterpret_cast<const void *>(&over_items<KernelOptions::All, false, NodeVelocity<D>>));
  obstacle = device.obstacle;
  if (!obstacle.empty()) return nullptr;
  SolverOptions<D> own = options;
  own.device_number = device.number;
  return std::make_unique<StepSequence<D, CudaMachine>>(own, communication, grid);
}

template std::unique_ptr<StepRunner<2>>
make_cuda_machine(const SolverOptions<2> &, const Communication &, const Grid<2> &, std::string &);
template std::unique_ptr<StepRunner<3>>
make_cuda_machine(const SolverOptions<3> &, const Communication &, const Grid<3> &, std::string &);

}    // namespace mpm
