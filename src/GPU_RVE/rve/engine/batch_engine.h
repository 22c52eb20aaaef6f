// SPDX-License-Identifier: GPL-2.0-only
// Base class of the engines on CPU threads and on a CUDA device. It keeps the table of RVEs, checks
// input, and converts public structs to the records of the block program and back. The block
// program is the code that advances one RVE. The base class also repeats the call of an RVE whose
// lists were too short or whose force scale was too fine.

#pragma once

#include "rve/algorithm/device_state.h"
#include "rve/engine/device_state_io.h"
#include "rve/engine/engine.h"
#include "rve/engine/quiescence.h"
#include "rve/engine/variant_choice.h"

#include <algorithm>
#include <functional>
#include <limits>

namespace rve {

/// Size of a call. It determines the memory and the kernels of the launch.
struct CallShape {
  int num_rves = 0;
  int largest = 0;          ///< grains in the largest RVE
  int longest = 0;          ///< largest number of substeps
  double mean = 0.0;        ///< mean number of substeps
  int pair_capacity = 0;    ///< pair capacity that a workspace must have
  KernelVariant variant = KernelVariant::Plain;
  bool with_details = false;
};

template <int D> class BatchEngine : public EngineOf<D> {
 public:
  explicit BatchEngine(const Options &options);

  const ContactModel &contacts() const override { return options.contacts; }
  std::unique_ptr<EngineOf<D>> empty_with(const ContactModel &contacts) const override;
  int add(const RveStateOf<D> &state) override;
  void remove(int rve) override;
  int size() const override { return static_cast<int>(grains_of.size() - free_numbers.size()); }
  RveStateOf<D> state(int rve) const override;
  void set_material(int rve, const Material &material) override;
  void turn(const std::vector<int> &rves, const std::vector<Tensor<double, D>> &rotations) override;
  void advance(const std::vector<int> &rves, const std::vector<DriveOf<D>> &drives,
               std::vector<ResultOf<D>> &results) override;
  void advance(const std::vector<int> &rves, const std::vector<DriveOf<D>> &drives,
               std::vector<ElasticResultOf<D>> &results) override;
  void advance(const std::vector<int> &rves, const std::vector<DriveOf<D>> &drives,
               std::vector<ResponseOf<D>> &responses) override;
  Request *begin(const std::vector<int> &rves, IncrementCallOf<D> &call) override;
  void bound_time_steps(const std::vector<int> &rves, double enough,
                        std::vector<double> &bounds) override;
  std::size_t bytes_per_rve(int num_grains) const override;
  Memory memory() const override;

 protected:
  /// Returns an engine of the same kind on the same device.
  virtual std::unique_ptr<BatchEngine> make_alike(const Options &other) const = 0;
  /// Returns the device state of an RVE. A list that was built for a smaller skin or reach is left
  /// out, since pairs that this engine needs can be missing from it.
  DeviceState device_state_of(const RveStateOf<D> &state) const;
  /// The following functions store and return device states in the memory of the backend.
  /// put_device_state() requires a free number `rve`, the others a number in use.
  virtual void put_device_state(int rve, const DeviceState &device_state) = 0;
  virtual DeviceState get_device_state(int rve) const = 0;
  virtual void drop_device_state(int rve) = 0;
  virtual void put_header(int rve, const StateHeader<D> &header) = 0;
  virtual StateHeader<D> get_header(int rve) const = 0;
  virtual void turn_device_states(const std::vector<int> &rves,
                                  const std::vector<Tensor<double, D>> &rotations) = 0;
  /// Arguments of one launch of the block program for some RVEs.
  struct Call : CallShape {
    const std::vector<int> *rves = nullptr;     ///< numbers of the RVEs
    const DriveRecord<D> *drives = nullptr;     ///< memory from drive_buffer()
    std::vector<SteeringRecord<D>> steering;    ///< one per RVE, or none; can point to `modes`
    std::vector<SteeredModes<D>> modes;         ///< one per RVE, or none
    const std::vector<int> *order =
        nullptr;    ///< indices in the call, most expensive first; null: all cost the same
    /// (num_rves) Index of the details of each RVE, -1: no details. Null if all RVEs or none have
    /// details.
    const std::vector<int> *detail_of = nullptr;
    int num_details = 0;
    BatchConstants constants;
  };

  /// Returns write-only memory for the prescribed motions of the next launch. The former contents
  /// can be lost.
  virtual DriveRecord<D> *drive_buffer(std::size_t count) = 0;
  /// Answers of a call, one per RVE, and the requested details. Both are valid until the next call.
  struct Answers {
    const AnswerRecord<D> *answers = nullptr;
    const DetailRecord<D> *details =
        nullptr;    ///< null if no details were requested; undefined for an RVE that failed
  };
  /// Runs the block program once for each RVE. The answers are complete after end_launch().
  virtual Answers begin_launch(const Call &call) = 0;
  virtual void end_launch() {}
  /// Returns memory() without the limit by GPU_RVE_MEMORY_LIMIT.
  virtual Memory backend_memory() const = 0;

  /// Returns the kernel variant of calls that need friction but no other feature. Estimates of
  /// memory use it.
  KernelVariant usual_variant() const;
  /// Returns the capacity of the workspaces for RVEs of at most this many grains.
  int pair_capacity(int num_grains) const { return pairs_per_grain * num_grains; }
  /// Memory per RVE that this class keeps for calls [bytes].
  static constexpr std::size_t BYTES_PER_ANSWER = sizeof(AnswerRecord<D>) +
      sizeof(DetailRecord<D>) + sizeof(ElasticResultOf<D>) + sizeof(DriveOf<D>);

  /// Kind of the answer to a call: without details, with details, with details and the affine
  /// stiffness, or with a bound of the stable time step.
  enum class Answer { Short, Long, Longest, TimeStep };
  /// Function that returns the prescribed motion of the RVE with a given index in the call.
  using DriveAt = std::function<DriveOf<D>(std::size_t index)>;
  /// Repeats a call for the RVEs that need longer lists or a coarser force scale. Returns the final
  /// answers.
  Answers repeat(const std::vector<int> &rves, const DriveAt &drive_at, const Answers &first,
                 Answer kind);
  /// Passes the answers of a call with `increments` to the caller. Repeats the call for RVEs that
  /// need it. Also passes the diagnostic evaluations: from the details in `first`, at the indices
  /// in detail_of, and from the repeated calls.
  void answer(const std::vector<int> &rves, IncrementCallOf<D> &caller, const Answers &first);
  /// Passes diagnostic evaluations and deferred increments to the caller, for the RVEs whose rest
  /// is known. Called after answer() in a call whose increments are in device memory.
  void report_rest(int count, const Rest *rest, const QuiescentStateOf<D> *states,
                   IncrementCallOf<D> &caller) const;
  /// Returns a call whose increments are in device memory. `largest` is the number of grains of the
  /// largest RVE, `longest` the largest number of DEM steps of an RVE, `steps` the sum of DEM steps
  /// over RVEs, `num_details` the number of RVEs with details.
  Call call_of_increments(const std::vector<int> &rves, int largest, int longest,
                          std::int64_t steps, int num_details);
  static void request_evaluations(Call &call, int num_details);
  int grains(int rve) const { return grains_of[rve]; }
  static ResponseOf<D> to_response(const AnswerRecord<D> &answer);
  void require_nothing_under_way() const;

  std::vector<IncrementOf<D>> increments;    ///< increments of the last call of begin()
  /// Index of the details of each RVE in the last call with diagnostic evaluations; -1: no details.
  std::vector<int> detail_of;

  const Options options;
  const BatchConstants constants;
  /// Kernel variant that defines the memory layout of the RVEs.
  const KernelVariant memory_layout;

 private:
  bool is_there(int rve) const;
  void check_slot(int rve) const;
  /// Adds the features that calls of an RVE with this material need to `needs`.
  void note_needs(const Material &material);
  void require_contacts(const ContactModel &needed) const;
  void prepare_repeat(int rve, const AnswerRecord<D> &answer);
  /// Size of a call: maxima and sums over its RVEs and their prescribed motions.
  struct Extent {
    int largest = 0, longest = 0;    ///< grains, DEM steps
    std::int64_t steps = 0;          ///< sum over RVEs
    double least_cost = std::numeric_limits<double>::max(),
           most_cost = 0.0;    ///< DEM steps times grains

    void add(int grains, int substeps)
    {
      const double cost = cost_of(grains, substeps);
      add({grains, substeps, substeps, cost, cost});
    }
    void add(const Extent &other)
    {
      largest = std::max(largest, other.largest);
      longest = std::max(longest, other.longest);
      steps += other.steps;
      least_cost = std::min(least_cost, other.least_cost);
      most_cost = std::max(most_cost, other.most_cost);
    }
  };
  static double cost_of(int grains, int substeps) { return static_cast<double>(substeps) * grains; }
  /// Sets sizes, order and kernel variant of a call. `costs` must contain the cost of each RVE.
  void plan(Call &call, const Extent &extent, bool servo, Answer kind);
  /// Orders RVEs of unequal cost so that the most expensive ones run first and the last ones are
  /// short.
  void put_longest_first(Call &call, double most_cost);
  /// Checks and translates the prescribed motions, and sets sizes, order and kernel variant.
  void prepare(Call &call, const std::vector<int> &rves, const std::vector<DriveOf<D>> &drives,
               Answer kind);
  void number_evaluations(Call &call);
  /// Runs one call without repetitions.
  Answers start(const std::vector<int> &rves, const std::vector<DriveOf<D>> &drives, Answer kind);
  /// Runs a call with detailed answers, with or without the stiffness.
  template <class AnyResult>
  void advance_with_details(const std::vector<int> &rves, const std::vector<DriveOf<D>> &drives,
                            Answer kind, std::vector<AnyResult> &results);

  std::vector<int> grains_of;    ///< by RVE; 0: the number is free
  std::vector<int> free_numbers;
  CallNeeds needs;    ///< features that at least one RVE added so far needs
  // Work arrays of a call.
  std::vector<double> costs;
  std::vector<unsigned char> cost_class;
  std::vector<int> order, class_begin;
  /// Prescribed motions of bound_time_steps(). They are kept for its next call, since they take
  /// megabytes.
  std::vector<DriveOf<D>> drives_of_bounds;
  /// Request of a call of begin(), with increments in host memory.
  class IncrementRequest final : public Request {
   public:
    explicit IncrementRequest(BatchEngine &engine) : engine_(engine) {}
    void set(const std::vector<int> &rves, IncrementCallOf<D> &caller, const Answers &first);

   private:
    StressesAre wait() override;
    BatchEngine &engine_;
    const std::vector<int> *rves_ = nullptr;
    IncrementCallOf<D> *caller_ = nullptr;
    Answers first_;
  };
  IncrementRequest increment_request{*this};
  int pairs_per_grain = 4;    ///< capacity of the workspaces, grows on demand
  // Results of repeated calls.
  std::vector<AnswerRecord<D>> repeated;
  std::vector<DetailRecord<D>> repeated_details;
};

}    // namespace rve
