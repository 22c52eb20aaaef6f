// Grains that live in registers, as in a thread block of a GPU, on a CPU: a stand-in for that block keeps an item's own numbers beside the
// arrays. They begin as garbage, so that it shows what a program takes for loaded, kept or published and is not.

#include "rve/algorithm/step_loop.h"
#include "rve/block/block_serial.h"
#include "rve/core/status.h"
#include "rve/engine/batch_engine.h"
#include "rve/engine/packing.h"
#include "rve/engine/program_scenes.h"
#include "support/packings.h"
#include "support/spheres.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <vector>

using namespace rve;
using namespace rve_test;

namespace {

constexpr int CAPACITY = 416;    // of the block, in grains
constexpr int GARBAGE = 0x7f;    // in every byte: numbers of 1e38 and more

class BlockInRegisters : public BlockSerial {
 public:
  static constexpr bool kInRegisters = true;
  // lists are built on the chip, where the steps have their sums and plans
  static constexpr int kCapacity = CAPACITY;
  static inline char *present_chip = nullptr;    ///< of the call that is made
  static char *chip() { return present_chip; }

  template <class T> struct Resident {
    T *array;
    std::vector<T> value;    ///< each is in a register of the item's thread
    T &operator[](int item) { return value[item]; }
    void load(int item) { value[item] = array[item]; }
    void save(int item) { array[item] = value[item]; }
    void load_whole(int item) { load(item); }
    void save_whole(int item) { save(item); }
    void keep(int item, const T &x) { value[item] = x; }
    void publish(int item, const T &x) { value[item] = array[item] = x; }
  };

  /// There are threads without a grain.
  template <class F> void for_places(int, F f) { for_items(CAPACITY, f); }
  template <class F> bool any_place(int, F f) { return any_item(CAPACITY, f); }
  template <class F> static void for_empty_places(int n, F f)
  {
    for (int i = n; i < CAPACITY; ++i) f(i);
  }
  template <class F> static void share_out(int i, int n, int count, F f)
  {
    if (i < n) BlockSerial::share_out(i, n, count, f);
  }

  template <class T> Resident<T> resident(T *array)
  {
    Resident<T> copy{array, std::vector<T>(CAPACITY)};
    std::memset(static_cast<void *>(copy.value.data()), GARBAGE, CAPACITY * sizeof(T));
    return copy;
  }
};

/// With two grains of a thread: the first one's thread takes what is shared out to both, and each grain is in a branch of its own, so that there
/// are no places without one.
class BlockOfTwo : public BlockInRegisters {
 public:
  template <class F> void for_places(int n, F f) { for_items(n, f); }
  template <class F> bool any_place(int n, F f) { return any_item(n, f); }
  template <class F> static void for_empty_places(int, F) {}
  template <class F> static void share_out(int i, int n, int count, F f)
  {
    const int threads = (n + 1) / 2;
    if (i < threads)
      for (int k = i; k < count; k += threads) f(k);
  }
};

/// Of kernels that hold in uniform registers what is the same for all pairs: one thread, which takes the grains in turn.
struct BlockOfUniforms : BlockInRegisters {
  static constexpr bool kHasUniforms = true;
  static bool is_first(int i) { return i == 0; }
  static void assume(bool) {}
};

/// An RVE under one program.
template <int D> struct RveRun {
  StateImage image;
  AnswerRecord<D> answer = {};
  DetailRecord<D> detail = {};
};

/// One call, in memory full of garbage.
template <class Block, class Scene>
void advance(RveRun<Scene::D> &run, const DriveRecord<Scene::D> &drive, bool with_details,
             double skin = 0.0, bool with_ledger = false,
             const SteeringRecord<Scene::D> &steering = SteeringRecord<Scene::D>())
{
  char *image = run.image.bytes.data();
  const int n = run.image.num_grains, pair_capacity = 32 * n;
  const int capacity = Block::kInRegisters ? CAPACITY : n;
  std::vector<char> chip(shared_size<Scene>(capacity, Block::kInRegisters), GARBAGE),
      workspace(workspace_size<Scene>(n, pair_capacity), GARBAGE);
  const SharedView<Scene> shared = carve_shared<Scene>(chip.data(), capacity, Block::kInRegisters);
  BlockInRegisters::present_chip = chip.data();
  using Begin = CallBegin<Block, Scene>;
  using Planning = StepPlanning<Block, Scene>;
  CallState<Scene> call;
  std::memset(static_cast<void *>(&call), GARBAGE, sizeof(call));
  std::memcpy(&call.header, image, sizeof(ImageHeader<Scene::D>));
  call.drive = drive;
  call.steering = steering;
  call.batch = BatchConstants{skin, 0.5, 0.5, with_ledger, 1};
  Begin::prepare(call, image, pair_capacity);
  for (int t = 0; t < call.plan_last; ++t) Planning::plan_step(call, t, 1);
  Begin::set_views(call, n, shared, workspace.data(), pair_capacity);
  std::memset(static_cast<void *>(&run.answer), 0, sizeof(run.answer));
  std::memset(static_cast<void *>(&run.detail), 0, sizeof(run.detail));
  Block block;
  RveProgram<Block, Scene> program(block, call, shared);
  program.run(run.answer, with_details ? &run.detail : nullptr);
}

template <int D> DriveRecord<D> shear(double strain, int substeps, double dt)
{
  DriveRecord<D> drive = DriveRecord<D>();
  drive.dt = dt;
  drive.substeps = substeps;
  drive.segments = 1;
  Tensor<double, D> deformation = Tensor<double, D>::identity();
  deformation(0, 1) = strain;
  store_tensor(deformation, drive.deformation);
  return drive;
}

/// Short and long calls, with new lists and without, and a look without steps.
template <int D> std::vector<DriveRecord<D>> calls(double dt)
{
  return {shear<D>(1e-4, 10, dt), shear<D>(0.05, 300, dt), shear<D>(1e-4, 1, dt),
          shear<D>(0.0, 0, dt),   shear<D>(0.02, 70, dt),  shear<D>(0.0, 5, dt)};
}

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
template <class Numbers, int D> RveRun<D> run_of(RveStateOf<D> state, Program memory)
{
  state.largest_contact_force = 1e4;
  return RveRun<D>{build_image(format_of<Numbers>(), state, 2000, memory)};
}

template <class Numbers> RveRun<2> disks(double friction)
{
  RveState state = packing_of_400();
  shake(state, 0.2, 5);
  state.material.friction = friction;
  return run_of<Numbers>(state, Program::General);
}

template <class Numbers, int D> RveStateOf<D> state_of(const RveRun<D> &run, Program memory)
{
  return read_image<D>(format_of<Numbers>(), run.image, memory);
}

/// What a caller sees. States, not images: a zero history may have a sign.
template <class Numbers, int D>
void expect_same_bits(const RveRun<D> &run, const RveRun<D> &expected, Program memory)
{
  EXPECT_EQ(std::memcmp(&run.answer, &expected.answer, sizeof(run.answer)), 0);
  EXPECT_EQ(std::memcmp(&run.detail, &expected.detail, sizeof(run.detail)), 0);
  EXPECT_EQ(serialize(state_of<Numbers>(run, memory)),
            serialize(state_of<Numbers>(expected, memory)));
}

/// Time step of the disks of the examples, and of spheres that are as stiff.
constexpr double DISK_DT = 5e-5, SPHERE_DT = 2e-6;

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
  RveRun<2> arrays = disks<TypeParam>(0.5), plain = arrays, general = arrays;
  const auto drives = calls<2>(DISK_DT);

  for (std::size_t k = 0; k < drives.size(); ++k) {
    SCOPED_TRACE(k);
    const bool with_details = k % 2 == 1;
    advance<BlockSerial, ProgramScene<Program::Plain, TypeParam>>(arrays, drives[k], with_details);
    advance<BlockInRegisters, ProgramScene<Program::Plain, TypeParam>>(plain, drives[k],
                                                                       with_details);
    advance<BlockInRegisters, ProgramScene<Program::General, TypeParam>>(general, drives[k],
                                                                         with_details);

    EXPECT_EQ(arrays.answer.status & status::Fatal, 0u) << describe_status(arrays.answer.status);
    expect_same_bits<TypeParam>(plain, arrays, Program::General);
    expect_same_bits<TypeParam>(general, arrays, Program::General);
  }
  const RveState end = state_of<TypeParam>(arrays, Program::General);
  EXPECT_GT(end.counters.rebuilds, 10);
}

TYPED_TEST(Registers, FrictionlessProgramGivesTheBitsOfArraysWithACoefficientOfZero)
{
  RveRun<2> arrays = disks<TypeParam>(0.0), frictionless = arrays;
  const auto drives = calls<2>(DISK_DT);

  for (std::size_t k = 0; k < drives.size(); ++k) {
    SCOPED_TRACE(k);
    const bool with_details = k % 2 == 1;
    advance<BlockSerial, ProgramScene<Program::Plain, TypeParam>>(arrays, drives[k], with_details);
    advance<BlockInRegisters, ProgramScene<Program::Frictionless, TypeParam>>(
        frictionless, drives[k], with_details);

    EXPECT_EQ(arrays.answer.status & status::Fatal, 0u) << describe_status(arrays.answer.status);
    expect_same_bits<TypeParam>(frictionless, arrays, Program::General);
  }
  const RveState end = state_of<TypeParam>(arrays, Program::General);
  EXPECT_GT(end.counters.rebuilds, 10);
}

TYPED_TEST(Registers, SteeredAndGeneralProgramsGiveTheBitsOfArraysWithAServo)
{
  RveRun<2> arrays = disks<TypeParam>(0.5), steered = arrays, two = arrays, general = arrays;
  SteeringRecord<2> steering = SteeringRecord<2>();
  steering.controlled[0] = 1;
  steering.stress_goal[0] = -1e5;
  steering.velocity_gradient[1] = steering.velocity_gradient[3] = -3.0;
  steering.servo_gain = default_servo_gain(packing_of_400());
  steering.servo_max_rate = 20.0;
  for (const int substeps : {10, 300, 1, 0, 70}) {
    SCOPED_TRACE(substeps);
    const DriveRecord<2> drive = shear<2>(0.0, substeps, DISK_DT);
    const bool with_details = substeps == 300;

    advance<BlockSerial, ProgramScene<Program::Steered, TypeParam>>(arrays, drive, with_details,
                                                                    0.0, false, steering);
    advance<BlockInRegisters, ProgramScene<Program::Steered, TypeParam>>(
        steered, drive, with_details, 0.0, false, steering);
    advance<BlockOfTwo, ProgramScene<Program::Steered, TypeParam>>(two, drive, with_details, 0.0,
                                                                   false, steering);
    advance<BlockInRegisters, ProgramScene<Program::General, TypeParam>>(
        general, drive, with_details, 0.0, false, steering);

    EXPECT_EQ(arrays.answer.status & status::Fatal, 0u) << describe_status(arrays.answer.status);
    expect_same_bits<TypeParam>(steered, arrays, Program::General);
    expect_same_bits<TypeParam>(two, arrays, Program::General);
    expect_same_bits<TypeParam>(general, arrays, Program::General);
  }
  const RveState end = state_of<TypeParam>(arrays, Program::General);
  EXPECT_GT(end.counters.rebuilds, 3);
  EXPECT_NE(end.servo_velocity_gradient(0, 0), 0.0);
  // nothing is said of energy where no ledger is kept
  EXPECT_EQ(end.energy.friction, 0.0);
  EXPECT_EQ(end.energy.work, 0.0);
}

// in double, what pairs remember passes by in rows
template <class Numbers> class SpheresInRegisters : public ::testing::Test {
};
TYPED_TEST_SUITE(SpheresInRegisters, Formats);

TYPED_TEST(SpheresInRegisters, GiveTheBitsOfArrays)
{
  using Scene = ProgramScene<Program::Spheres, TypeParam>;
  RveRun<3> arrays =
                run_of<TypeParam>(disordered_spheres(spheres_material(), 7, 1), Program::Spheres),
            registers = arrays;
  const auto drives = calls<3>(SPHERE_DT);

  for (std::size_t k = 0; k < drives.size(); ++k) {
    SCOPED_TRACE(k);
    const bool with_details = k % 2 == 1;
    advance<BlockSerial, Scene>(arrays, drives[k], with_details);
    advance<BlockInRegisters, Scene>(registers, drives[k], with_details);

    EXPECT_EQ(arrays.answer.status & status::Fatal, 0u) << describe_status(arrays.answer.status);
    EXPECT_GT(arrays.answer.num_contacts, 100);
    expect_same_bits<TypeParam>(registers, arrays, Program::Spheres);
  }
  const Spheres end = state_of<TypeParam>(arrays, Program::Spheres);
  EXPECT_GT(end.counters.rebuilds, 10);
}

TYPED_TEST(SpheresInRegisters, OfThreadsThatTakeThemInTurnGiveTheBitsOfArrays)
{
  using Scene = ProgramScene<Program::PlainSpheres, TypeParam>;
  static_assert(kHoldsUniforms<BlockOfUniforms, Scene>);
  RveRun<3> arrays =
                run_of<TypeParam>(disordered_spheres(spheres_material(), 7, 1), Program::Spheres),
            uniforms = arrays;

  for (const DriveRecord<3> &drive : calls<3>(SPHERE_DT)) {
    SCOPED_TRACE(drive.substeps);
    advance<BlockSerial, Scene>(arrays, drive, false);
    advance<BlockOfUniforms, Scene>(uniforms, drive, false);

    EXPECT_EQ(arrays.answer.status & status::Fatal, 0u) << describe_status(arrays.answer.status);
    expect_same_bits<TypeParam>(uniforms, arrays, Program::Spheres);
  }
}

template <class Numbers, Program program>
void expect_that_spheres_may_pass_by(const Material &material, bool with_ledger = false,
                                     const SteeringRecord<3> &steering = SteeringRecord<3>())
{
  using Scene = ProgramScene<program, Numbers>;
  constexpr Program memory = ProgramTraits<program>::prepared_like;
  RveRun<3> stay = run_of<Numbers>(disordered_spheres(material, 7, 1), memory), pass = stay;

  for (const bool with_details : {false, true})
    for (const DriveRecord<3> &drive : calls<3>(SPHERE_DT)) {
      SCOPED_TRACE(drive.substeps);
      advance<BlockSerial, Scene>(stay, drive, with_details, 0.0, with_ledger, steering);
      advance<BlockSerial, InMemory<Scene>>(pass, drive, with_details, 0.0, with_ledger, steering);

      EXPECT_EQ(stay.answer.status & status::Fatal, 0u) << describe_status(stay.answer.status);
      EXPECT_GT(stay.answer.num_contacts, 100);
      expect_same_bits<Numbers>(pass, stay, memory);
    }
  EXPECT_GT(state_of<Numbers>(stay, memory).counters.rebuilds, 10);
}

/// As stiff as the springs where spheres of 4 mm overlap by a hundredth of their radius.
Material hertz_material(ContactLaw law)
{
  Material material = spheres_material();
  material.law = law;
  const double contact_radius = std::sqrt(2e-3 * 4e-5);
  material.hertz_stiffness = material.normal_stiffness / contact_radius;
  material.mindlin_stiffness = material.tangential_stiffness / contact_radius;
  return material;
}

SteeringRecord<3> servo_of_spheres()
{
  SteeringRecord<3> steering = SteeringRecord<3>();
  steering.controlled[0] = steering.controlled[4] = 1;
  steering.stress_goal[0] = steering.stress_goal[4] = -1e5;
  steering.velocity_gradient[1] = 100.0;
  steering.velocity_gradient[8] = -10.0;
  steering.servo_gain = default_servo_gain(disordered_spheres(spheres_material(), 7, 1));
  steering.servo_max_rate = 100.0;
  return steering;
}

TYPED_TEST(SpheresInRegisters, ThatPassByHaveTheBitsOfThoseThatStay)
{
  expect_that_spheres_may_pass_by<TypeParam, Program::PlainSpheres>(spheres_material());
}

TYPED_TEST(SpheresInRegisters, ThatPassByWithAServoHaveTheBitsOfThoseThatStay)
{
  expect_that_spheres_may_pass_by<TypeParam, Program::SteeredSpheres>(spheres_material(), false,
                                                                      servo_of_spheres());
}

// histories of springs, rolling and twisting, what friction and dashpots take, and a servo
TYPED_TEST(SpheresInRegisters, ThatPassByWithAllBooksHaveTheBitsOfThoseThatStay)
{
  Material material = spheres_material();
  material.normal_viscosity = 3.0;
  material.tangential_viscosity = 1.5;
  material.rolling_stiffness = material.twisting_stiffness = 0.5 * material.normal_stiffness;
  material.rolling_friction = material.twisting_friction = 0.1;
  for (const bool servo : {false, true})
    expect_that_spheres_may_pass_by<TypeParam, Program::SpheresRolling>(
        material, true, servo ? servo_of_spheres() : SteeringRecord<3>());
}

// a pair that is in reach and does not touch forgets before its force is computed
TYPED_TEST(SpheresInRegisters, ThatPassByWithinReachHaveTheBitsOfThoseThatStay)
{
  Material material = hertz_material(ContactLaw::Dmt);
  material.surface_energy = 5.0;
  material.adhesion_reach = 4e-4;
  expect_that_spheres_may_pass_by<TypeParam, Program::SphereDmt>(material, true);
}

// their program has no contact radius from step to step
TYPED_TEST(SpheresInRegisters, OfHertzThatKeepForcesHaveTheBitsOfAllBooks)
{
  using All = ProgramScene<Program::SphereHertz, TypeParam>;
  using Own = ProgramScene<Program::SphereMindlinForce, TypeParam>;
  Material material = hertz_material(ContactLaw::Hertz);
  material.mindlin_displacement = 0.0;
  RveRun<3> all = run_of<TypeParam>(disordered_spheres(material, 7, 1), Program::SphereHertz),
            arrays = all, registers = all, two = all, uniforms = all, pass = all;

  for (const DriveRecord<3> &drive : calls<3>(SPHERE_DT)) {
    SCOPED_TRACE(drive.substeps);
    advance<BlockSerial, All>(all, drive, false);
    advance<BlockSerial, Own>(arrays, drive, false);
    advance<BlockInRegisters, Own>(registers, drive, false);
    advance<BlockOfTwo, Own>(two, drive, false);
    advance<BlockOfUniforms, Own>(uniforms, drive, false);
    advance<BlockSerial, InMemory<Own>>(pass, drive, false);

    EXPECT_EQ(all.answer.status & status::Fatal, 0u) << describe_status(all.answer.status);
    for (const RveRun<3> *run : {&arrays, &registers, &two, &uniforms, &pass})
      expect_same_bits<TypeParam>(*run, all, Program::SphereHertz);
    const Spheres now = state_of<TypeParam>(registers, Program::SphereHertz);
    EXPECT_GT(std::count_if(now.pairs.begin(), now.pairs.end(),
                            [](const PairOf<3> &pair) {
                              return pair.contact_radius > 0.0;
                            }),
              100);
  }
}

TEST(TwoSpheresOfAThread, AddUpLossesOfExtraPairsInTheOrderOfGrains)
{
  using Scene = ProgramScene<Program::Spheres, MixedNumbers>;
  const Spheres begin = disordered_spheres(spheres_material(), 6, 2);
  RveRun<3> arrays = run_of<MixedNumbers>(begin, Program::Spheres), two = arrays;
  // more pairs than grains may own
  const double skin = 2.0 * *std::min_element(begin.radius.begin(), begin.radius.end());

  for (const DriveRecord<3> &drive : calls<3>(SPHERE_DT)) {
    advance<BlockSerial, Scene>(arrays, drive, false, skin, true);
    advance<BlockOfTwo, Scene>(two, drive, false, skin, true);

    EXPECT_EQ(arrays.answer.status & status::Fatal, 0u) << describe_status(arrays.answer.status);
    expect_same_bits<MixedNumbers>(two, arrays, Program::Spheres);
  }
  const Spheres end = state_of<MixedNumbers>(arrays, Program::Spheres);
  EXPECT_GT(end.pairs.size(), static_cast<std::size_t>(4 * end.num_grains()));
  EXPECT_GT(end.energy.friction, 0.0);
}
