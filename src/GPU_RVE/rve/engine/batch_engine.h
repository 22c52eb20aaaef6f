// What both backends share: the table of RVEs, input checks, the translation between the public structs and the records
// that the block program reads, and the repetition of calls whose lists or force scale did not suffice.

#ifndef RVE_ENGINE_BATCH_ENGINE_H
#define RVE_ENGINE_BATCH_ENGINE_H

#include "rve/algorithm/image.h"
#include "rve/engine/engine.h"
#include "rve/engine/program_choice.h"
#include "rve/engine/rve_image.h"

namespace rve {

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
  struct Call {
    const std::vector<int> *rves = nullptr;     ///< their numbers
    const DriveRecord<D> *drives = nullptr;     ///< in room_for_drives()
    std::vector<SteeringRecord<D>> steering;    ///< as many as RVEs, or none; they point at `modes`
    std::vector<SteeredModes<D>> modes;         ///< as many as RVEs, or none
    std::vector<int> order;    ///< positions, the most expensive first; none: all cost the same
    int largest = 0;           ///< grains in the largest RVE
    int longest = 0;           ///< most substeps
    double mean = 0.0;         ///< substeps
    int pair_capacity = 0;     ///< that workspaces must have at least
    Program program = Program::Plain;
    bool with_details = false;
    BatchConstants constants;
  };

  /// Where the drives of the next launch shall be written, and not read. What was there before may be lost.
  virtual DriveRecord<D> *room_for_drives(std::size_t count) = 0;
  /// Runs the block program once for each RVE. Returns the answers, valid until the next launch. `details` are filled when they
  /// are wanted.
  virtual const AnswerRecord<D> *launch(const Call &call,
                                        std::vector<DetailRecord<D>> &details) = 0;
  /// memory() without the limit of the environment.
  virtual Memory backend_memory() const = 0;

  /// That of calls that need nothing but friction: sizes of calls are estimated with it.
  Program usual_program() const;
  /// Capacity of the workspaces for RVEs of at most this many grains.
  int pair_capacity(int num_grains) const { return pairs_per_grain * num_grains; }
  /// What this class keeps of calls, per RVE [bytes].
  static constexpr std::size_t BYTES_PER_ANSWER = sizeof(AnswerRecord<D>) +
      sizeof(DetailRecord<D>) + sizeof(ElasticResultOf<D>) + sizeof(DriveOf<D>);

  const Options options;
  const BatchConstants constants;
  /// The program whose memory the RVEs have.
  const Program memory_layout;

 private:
  void check_slot(int rve) const;
  /// Notes what an RVE needs of its calls.
  void note_needs(const Material &material);
  void require_contacts(const ContactModel &needed) const;
  void prepare_repeat(int rve, const AnswerRecord<D> &answer);
  double cost_of(int rve, const DriveOf<D> &drive) const;
  /// With RVEs of unequal cost the last ones to run shall be short.
  void put_longest_first(Call &call, const std::vector<DriveOf<D>> &drives, double most_cost);
  /// What a call answers.
  enum class Answer { Short, Long, Longest, TimeStep };
  /// Checks and translates; sizes, order and program follow from the drives.
  void prepare(Call &call, const std::vector<int> &rves, const std::vector<DriveOf<D>> &drives,
               Answer kind);
  /// One call without repeats. Returns the answers, valid until the next call; `details` has them, if wanted.
  const AnswerRecord<D> *start(const std::vector<int> &rves, const std::vector<DriveOf<D>> &drives,
                               Answer kind);
  /// Repeats what has to be, with longer lists or another scale of forces, of a call that has been started. Returns the answers
  /// that hold.
  const AnswerRecord<D> *repeat(const std::vector<int> &rves, const std::vector<DriveOf<D>> &drives,
                                const AnswerRecord<D> *answers, Answer kind);
  /// The long answers of a call, or the longest.
  template <class AnyResult>
  void advance_with_details(const std::vector<int> &rves, const std::vector<DriveOf<D>> &drives,
                            Answer kind, std::vector<AnyResult> &results);

  std::vector<int> grains_of;    ///< by RVE; 0: the number is free
  std::vector<int> free_numbers;
  CallNeeds needs;                          ///< of calls of all RVEs that have been added
  std::vector<unsigned char> cost_class;    ///< of the RVEs of a call
  int pairs_per_grain = 4;                  ///< capacity of the workspaces, grows on demand
  std::vector<AnswerRecord<D>> mended;      ///< answers of a call that was repeated for some RVEs
  std::vector<DetailRecord<D>> details;     ///< of the last call that wanted them
};

}    // namespace rve

#endif
