// Grains that live in registers, as in a thread block of a GPU, on a CPU: a stand-in for that block keeps an item's own numbers beside the
// arrays. They begin as garbage, so that it shows what a program takes for loaded, kept or published and is not.

#include "rve/algorithm/step_loop.h"
#include "rve/block/block_serial.h"
#include "rve/core/status.h"
#include "rve/engine/batch_engine.h"
#include "rve/engine/program_scenes.h"
#include "support/packings.h"

#include <gtest/gtest.h>

#include <cstring>
#include <iterator>
#include <vector>

using namespace rve;
using namespace rve_test;

namespace {

constexpr double DT = 5e-5;
constexpr int CAPACITY = 416;    // of the block, in grains
constexpr int GARBAGE = 0x7f;    // in every byte: numbers of 1e38 and more

class BlockInRegisters : public BlockSerial {
 public:
  static constexpr bool kInRegisters = true;

  template <class T> struct Resident {
    T *array;
    std::vector<T> value;    ///< each is in a register of the item's thread
    T &operator[](int item) { return value[item]; }
    void load(int item) { value[item] = array[item]; }
    void save(int item) { array[item] = value[item]; }
    void keep(int item, const T &x) { value[item] = x; }
    void publish(int item, const T &x) { value[item] = array[item] = x; }
  };

  template <class T> Resident<T> resident(T *array)
  {
    Resident<T> copy{array, std::vector<T>(CAPACITY)};
    std::memset(static_cast<void *>(copy.value.data()), GARBAGE, CAPACITY * sizeof(T));
    return copy;
  }
};

/// An RVE under one program.
struct Run {
  StateImage image;
  AnswerRecord<2> answer;
  DetailRecord<2> detail;
};

/// One call, in memory full of garbage.
template <class Block, class Scene>
void advance(Run &run, const DriveRecord<2> &drive, bool with_details)
{
  char *image = run.image.bytes.data();
  const int n = run.image.num_grains, pair_capacity = 8 * n;
  const int capacity = Block::kInRegisters ? CAPACITY : n;
  std::vector<char> chip(shared_size<Scene>(capacity, Block::kInRegisters), GARBAGE),
      workspace(workspace_size<Scene>(n, pair_capacity), GARBAGE);
  const SharedView<Scene> shared = carve_shared<Scene>(chip.data(), capacity, Block::kInRegisters);
  using Begin = CallBegin<Block, Scene>;
  using Planning = StepPlanning<Block, Scene>;
  CallState<Scene> call;
  std::memset(static_cast<void *>(&call), GARBAGE, sizeof(call));
  std::memcpy(&call.header, image, sizeof(ImageHeader<2>));
  call.drive = drive;
  call.steering = SteeringRecord<2>();
  call.batch = BatchConstants{0.0, 0.5, 0.5, 0, 1};
  Begin::prepare(call, image, pair_capacity);
  for (int t = 0; t < call.plan_last; ++t) Planning::plan_step(call, t, 1);
  Begin::set_views(call, n, shared, workspace.data(), pair_capacity);
  std::memset(static_cast<void *>(&run.answer), 0, sizeof(run.answer));
  std::memset(static_cast<void *>(&run.detail), 0, sizeof(run.detail));
  Block block;
  RveProgram<Block, Scene> program(block, call, shared);
  program.run(run.answer, with_details ? &run.detail : nullptr);
}

DriveRecord<2> shear(double strain, int substeps)
{
  DriveRecord<2> drive = DriveRecord<2>();
  drive.dt = DT;
  drive.substeps = substeps;
  drive.segments = 1;
  drive.deformation[0] = drive.deformation[3] = 1.0;
  drive.deformation[1] = strain;
  return drive;
}

/// Short and long calls, with new lists and without, and a look without steps.
const DriveRecord<2> CALLS[] = {shear(1e-4, 10), shear(0.05, 300), shear(1e-4, 1),
                                shear(0.0, 0),   shear(0.02, 70),  shear(0.0, 5)};

template <class Numbers> constexpr rve::Format format_of();
template <> constexpr rve::Format format_of<FastNumbers>()
{
  return rve::Format::Fast;
}
template <> constexpr rve::Format format_of<MixedNumbers>()
{
  return rve::Format::Mixed;
}
template <> constexpr rve::Format format_of<DoubleNumbers>()
{
  return rve::Format::Double;
}

/// Of a state whose forces fit into the scale of the first call: nobody repeats it here.
template <class Numbers> Run run_of(double friction)
{
  RveState state = packing_of_400();
  shake(state, 0.2, 5);
  state.material.friction = friction;
  state.largest_contact_force = 1e4;
  return Run{build_image(format_of<Numbers>(), state, 2000, Program::General), AnswerRecord<2>(),
             DetailRecord<2>()};
}

/// What a caller sees. States, not images: a zero history may have a sign.
template <class Numbers> void expect_same_bits(const Run &run, const Run &expected)
{
  EXPECT_EQ(std::memcmp(&run.answer, &expected.answer, sizeof(run.answer)), 0);
  EXPECT_EQ(std::memcmp(&run.detail, &expected.detail, sizeof(run.detail)), 0);
  EXPECT_EQ(serialize(read_image(format_of<Numbers>(), run.image, Program::General)),
            serialize(read_image(format_of<Numbers>(), expected.image, Program::General)));
}

template <class Numbers> class Registers : public testing::Test {
};
#if defined(__SANITIZE_ADDRESS__)
// What is in registers is one text for all formats; each of them takes a compiler with sanitizers minutes.
using Formats = testing::Types<MixedNumbers>;
#else
using Formats = testing::Types<FastNumbers, MixedNumbers, DoubleNumbers>;
#endif
TYPED_TEST_SUITE(Registers, Formats);

}    // namespace

TYPED_TEST(Registers, PlainAndGeneralProgramsGiveTheBitsOfArrays)
{
  Run arrays = run_of<TypeParam>(0.5), plain = arrays, general = arrays;

  for (std::size_t k = 0; k < std::size(CALLS); ++k) {
    SCOPED_TRACE(k);
    const bool with_details = k % 2 == 1;
    advance<BlockSerial, ProgramScene<Program::Plain, TypeParam>>(arrays, CALLS[k], with_details);
    advance<BlockInRegisters, ProgramScene<Program::Plain, TypeParam>>(plain, CALLS[k],
                                                                       with_details);
    advance<BlockInRegisters, ProgramScene<Program::General, TypeParam>>(general, CALLS[k],
                                                                         with_details);

    EXPECT_EQ(arrays.answer.status & status::Fatal, 0u) << describe_status(arrays.answer.status);
    expect_same_bits<TypeParam>(plain, arrays);
    expect_same_bits<TypeParam>(general, arrays);
  }
  const RveState end = read_image(format_of<TypeParam>(), arrays.image, Program::General);
  EXPECT_GT(end.counters.rebuilds, 10);
}

TYPED_TEST(Registers, FrictionlessProgramGivesTheBitsOfArraysWithACoefficientOfZero)
{
  Run arrays = run_of<TypeParam>(0.0), frictionless = arrays;

  for (std::size_t k = 0; k < std::size(CALLS); ++k) {
    SCOPED_TRACE(k);
    const bool with_details = k % 2 == 1;
    advance<BlockSerial, ProgramScene<Program::Plain, TypeParam>>(arrays, CALLS[k], with_details);
    advance<BlockInRegisters, ProgramScene<Program::Frictionless, TypeParam>>(
        frictionless, CALLS[k], with_details);

    EXPECT_EQ(arrays.answer.status & status::Fatal, 0u) << describe_status(arrays.answer.status);
    expect_same_bits<TypeParam>(frictionless, arrays);
  }
  const RveState end = read_image(format_of<TypeParam>(), arrays.image, Program::General);
  EXPECT_GT(end.counters.rebuilds, 10);
}
