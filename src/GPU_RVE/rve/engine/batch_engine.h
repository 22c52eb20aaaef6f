// SPDX-License-Identifier: GPL-2.0-only
// What both backends share: the table of RVEs, input checks, the translation between the public structs and the records
// that the block program reads, and the repetition of calls whose lists or force scale did not suffice.

#pragma once

#include "rve/algorithm/image.h"
#include "rve/engine/engine.h"
#include "rve/engine/program_choice.h"
#include "rve/engine/rve_image.h"
#include "rve/engine/sleep.h"

#include <algorithm>
#include <functional>
#include <limits>

namespace rve {

/// Size of a call, from which the memory and the kernels of its launch follow.
struct CallShape {
  int num_rves = 0;
  int largest = 0;          ///< grains in the largest RVE
  int longest = 0;          ///< largest number of substeps
  double mean = 0.0;        ///< mean number of substeps
  int pair_capacity = 0;    ///< least capacity of the workspaces
  Program program = Program::Plain;
  bool with_details = false;
};

template <int D> class BatchEngine : public EngineOf<D> {
 public:
  explicit BatchEngine(const Options &options);

  const ContactModel &contacts() const override { return options.contacts; }
  std::unique_ptr<EngineOf<D>> empty_with(const ContactModel &contacts) const override;
  int add(const RveStateOf<D> &state) override;
  void remove(int rve) override;
  int size() const override;
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
  /// An engine of the same kind, on the same device.
  virtual std::unique_ptr<BatchEngine> make_alike(const Options &other) const = 0;
  /// Of a state, without a list that was built for a smaller skin or reach: it may lack pairs that this engine counts on.
  StateImage image_of(const RveStateOf<D> &state) const;
  /// Where the image of an RVE lives is the backend's business. `rve` is free on put and used otherwise.
  virtual void put_image(int rve, const StateImage &image) = 0;
  virtual StateImage get_image(int rve) const = 0;
  virtual void drop_image(int rve) = 0;
  virtual void put_header(int rve, const ImageHeader<D> &header) = 0;
  virtual ImageHeader<D> get_header(int rve) const = 0;
  virtual void turn_images(const std::vector<int> &rves,
                           const std::vector<Tensor<double, D>> &rotations) = 0;
  /// One run of the block program over some RVEs.
  struct Call : CallShape {
    const std::vector<int> *rves = nullptr;     ///< their numbers
    const DriveRecord<D> *drives = nullptr;     ///< in room_for_drives()
    std::vector<SteeringRecord<D>> steering;    ///< as many as RVEs, or none; they point at `modes`
    std::vector<SteeredModes<D>> modes;         ///< as many as RVEs, or none
    const std::vector<int> *order =
        nullptr;    ///< places, the most expensive first; null: all cost the same
    /// By place, where not all are asked for details: which ones of so many are its; -1: none.
    const std::vector<int> *detail_of = nullptr;
    int num_details = 0;
    BatchConstants constants;
  };

  /// Where the drives of the next launch shall be written, and not read. What was there before may be lost.
  virtual DriveRecord<D> *room_for_drives(std::size_t count) = 0;
  /// As many as RVEs of a call, valid until the next one; details as many as are asked for them.
  struct Answers {
    const AnswerRecord<D> *answers = nullptr;
    const DetailRecord<D> *details =
        nullptr;    ///< where they are wanted; of no meaning for an RVE that failed
  };
  /// Runs the block program once for each RVE. The answers are complete after end_launch().
  virtual Answers begin_launch(const Call &call) = 0;
  virtual void end_launch() {}
  /// memory() without the limit of the environment.
  virtual Memory backend_memory() const = 0;

  /// That of calls that need nothing but friction: sizes of calls are estimated with it.
  Program usual_program() const;
  /// Capacity of the workspaces for RVEs of at most this many grains.
  int pair_capacity(int num_grains) const { return pairs_per_grain * num_grains; }
  /// What this class keeps of calls, per RVE [bytes].
  static constexpr std::size_t BYTES_PER_ANSWER = sizeof(AnswerRecord<D>) +
      sizeof(DetailRecord<D>) + sizeof(ElasticResultOf<D>) + sizeof(DriveOf<D>);

  /// What a call answers.
  enum class Answer { Short, Long, Longest, TimeStep };
  /// The drive at a place of a call.
  using DriveAt = std::function<DriveOf<D>(std::size_t place)>;
  /// Repeats what has to be, with longer lists or another scale of forces, of a call that has been started. Returns the answers
  /// that hold.
  Answers repeat(const std::vector<int> &rves, const DriveAt &drive_at, const Answers &first,
                 Answer kind);
  /// Gives the answers of a call by `increments`, and repeats it where that must be. Looks are those of details in the order of detail_of, if there
  /// are any, and of calls that are repeated.
  void answer(const std::vector<int> &rves, IncrementCallOf<D> &caller, const Answers &first);
  /// What is known of the rest of the RVEs of such a call, behind answer().
  void tell_rest(int count, const Rest *rest, const SleepOf<D> *sleeps,
                 IncrementCallOf<D> &caller) const;
  /// A call by increments that are elsewhere: RVEs of at most so many grains, the most DEM steps of one and the sum of all. So many are asked for
  /// details.
  Call call_of_increments(const std::vector<int> &rves, int largest, int longest,
                          std::int64_t steps, int num_details);
  static void ask_for_looks(Call &call, int num_details);
  int grains(int rve) const { return grains_of[rve]; }
  static ResponseOf<D> to_response(const AnswerRecord<D> &answer);
  void require_nothing_under_way() const;

  std::vector<IncrementOf<D>> increments;    ///< of the last call by them
  std::vector<int> detail_of;                ///< of the last call by them that asked for looks

  const Options options;
  const BatchConstants constants;
  /// The program whose memory the RVEs have.
  const Program memory_layout;

 private:
  bool is_there(int rve) const;
  void check_slot(int rve) const;
  /// Notes what an RVE needs of its calls.
  void note_needs(const Material &material);
  void require_contacts(const ContactModel &needed) const;
  void prepare_repeat(int rve, const AnswerRecord<D> &answer);
  /// What the drives of a call make of it.
  struct Extent {
    int largest = 0, longest = 0;    ///< grains, DEM steps
    std::int64_t steps = 0;          ///< of all
    double least_cost = std::numeric_limits<double>::max(),
           most_cost = 0.0;    ///< steps times grains

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
  /// Sizes, order and program; `costs` are there.
  void plan(Call &call, const Extent &extent, bool servo, Answer kind);
  /// With RVEs of unequal cost the last ones to run shall be short.
  void put_longest_first(Call &call, double most_cost);
  /// Checks and translates; sizes, order and program follow from the drives.
  void prepare(Call &call, const std::vector<int> &rves, const std::vector<DriveOf<D>> &drives,
               Answer kind);
  void number_looks(Call &call);
  /// One call without repeats.
  Answers start(const std::vector<int> &rves, const std::vector<DriveOf<D>> &drives, Answer kind);
  /// The long answers of a call, or the longest.
  template <class AnyResult>
  void advance_with_details(const std::vector<int> &rves, const std::vector<DriveOf<D>> &drives,
                            Answer kind, std::vector<AnyResult> &results);

  std::vector<int> grains_of;    ///< by RVE; 0: the number is free
  std::vector<int> free_numbers;
  CallNeeds needs;    ///< of calls of all RVEs that have been added
  // of the RVEs of a call
  std::vector<double> costs;
  std::vector<unsigned char> cost_class;
  std::vector<int> order, class_begin;
  /// That finds time steps: megabytes, kept from one to the next.
  std::vector<DriveOf<D>> drives_of_look;
  /// A call by increments of the host.
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
  // of a call that was repeated for some RVEs
  std::vector<AnswerRecord<D>> mended;
  std::vector<DetailRecord<D>> mended_details;
};

}    // namespace rve
