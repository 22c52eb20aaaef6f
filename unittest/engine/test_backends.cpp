// SPDX-License-Identifier: GPL-2.0-only
// All builds of the kernels give the same bits: both instruction sets of the CPU, and the GPU.

#include "cuda/cuda_required.h"
#include "rve/core/error.h"
#include "rve/engine/batch_engine.h"
#include "rve/engine/engine.h"
#include "rve/engine/finite_strain.h"
#include "rve/engine/host_kernels.h"
#include "rve/engine/packing.h"
#include "rve/engine/servo_modes.h"
#include "support/packings.h"
#include "support/spheres.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstring>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

using namespace rve;
using namespace rve_test;

namespace {

constexpr double DT = 5e-5;
constexpr double PRESSURE = 1e5;

template <class T> void append(std::vector<char> &bytes, const T &value)
{
  const auto *first = reinterpret_cast<const char *>(&value);
  bytes.insert(bytes.end(), first, first + sizeof(T));
}

/// Returns the bytes of every member of the result, without padding.
template <int D> std::vector<char> bytes_of(const ResultOf<D> &r)
{
  std::vector<char> bytes;
  append(bytes, r.status);
  for (const Tensor<double, D> &t :
       {r.stress, r.cell, r.deformation, r.fabric, r.servo_velocity_gradient})
    append(bytes, t);
  for (double x : {r.void_ratio, r.coordination_number, r.mechanical_coordination_number,
                   r.sliding_fraction, r.unbalanced_ratio, r.kinetic_energy, r.elastic_energy,
                   r.largest_overlap, r.mean_overlap, r.largest_contact_force})
    append(bytes, x);
  for (std::int32_t x : {r.num_grains, r.num_contacts, r.num_pairs, r.num_rattlers})
    append(bytes, x);
  append(bytes, r.counters);
  append(bytes, r.energy);
  return bytes;
}

/// One RVE of a scene and its drive, which is the same in each call.
template <int D> struct MemberOf {
  std::string name;
  RveStateOf<D> state;
  DriveOf<D> drive;
};
using Member = MemberOf<2>;

template <int D>
DriveOf<D> shear_at_pressure(const RveStateOf<D> &state, double rate, double dt, int substeps)
{
  DriveOf<D> drive;
  drive.dt = dt;
  drive.substeps = substeps;
  for (int a = 0; a < D; ++a) {
    drive.controlled[a][a] = true;
    drive.stress_goal(a, a) = -PRESSURE;
  }
  drive.velocity_gradient(0, 1) = rate;
  // For disks this is the gain of default_servo_gain().
  const double width = D == 2 ? state.material.thickness : std::cbrt(state.cell_volume());
  drive.servo_gain = 10.0 * width / state.mass();
  drive.servo_max_rate = 20.0;
  return drive;
}

/// Returns the drive of shear_at_pressure(), but with servo modes instead of stress components. The
/// modes control the mean pressure and the differences of normal stresses.
template <int D>
DriveOf<D> shear_at_pressure_by_modes(const RveStateOf<D> &state, double rate, double dt,
                                      int substeps)
{
  static const ServoModesOf<D> control = [] {
    constexpr int shears = Space<D>::strains - D;
    std::vector<ComponentSum<D>> rates(shears), stresses(D);
    for (int c = 0; c < shears; ++c) rates[c][D + c] = 1.0;
    for (int a = 0; a < D; ++a) {
      stresses[0][a] = -1.0 / D;
      if (a == 0) continue;
      stresses[a][a] = 1.0;
      stresses[a][a - 1] = -1.0;
    }
    return ServoModesOf<D>(rates, stresses);
  }();
  DriveOf<D> drive = shear_at_pressure(state, rate, dt, substeps);
  for (int a = 0; a < D; ++a) drive.controlled[a][a] = false;
  drive.modes = control.modes.data();
  drive.num_modes = D;
  return drive;
}

Drive biaxial_shear(const RveState &state, double rate, int substeps)
{
  return shear_at_pressure(state, rate, DT, substeps);
}

Material dry_material()
{
  return packing_of_400().material;
}

/// Skin for full_scene() [m]. It exceeds the radii. The lists then have more pairs than their
/// initial capacity and must grow.
constexpr double WIDE_SKIN = 5e-3;

/// Returns RVEs of different sizes, drives and numbers of substeps.
std::vector<Member> full_scene(bool viscous, bool rolling = false)
{
  std::vector<Member> members;
  const auto add = [&](const std::string &name, const RveState &state, const Drive &drive) {
    members.push_back({name, state, drive});
    if (viscous) {
      members.back().state.material.normal_viscosity = 3.0;
      members.back().state.material.tangential_viscosity = 1.5;
    }
    if (rolling) {
      members.back().state.material.rolling_stiffness = 5e5;
      members.back().state.material.rolling_friction = 0.3;
    }
  };
  const RveState small = triangular_packing(dry_material(), 6, 8, 0.0037, 1),
                 middle = packing_of_400();
  RveState large = tiled(middle, 2, 2), mixer = middle, gas = small;
  shake(large, 0.05, 2);
  shake(mixer, 0.2, 3);
  gas.cell = 1.7 * gas.cell;
  shake(gas, 1.0, 4);
  add("48 grains with servo", small, biaxial_shear(small, 40.0, 700));
  add("400 grains with servo", middle, biaxial_shear(middle, 40.0, 300));
  add("1600 grains with servo", large, biaxial_shear(large, 40.0, 260));
  add("48 grains with modes of a servo", small, shear_at_pressure_by_modes(small, 40.0, DT, 700));
  add("400 grains on a path", mixer,
      Drive::constant_velocity_gradient(Tensor2{{0.5, 12.0, -4.0, 0.8}}, DT, 190));
  add("gas", gas, Drive::constant_velocity_gradient(Tensor2{{-1.0, 0.0, 0.0, -1.0}}, DT, 77));
  return members;
}

/// Skin for spheres_scene() [m]. It is half a radius, so that lists must grow.
constexpr double WIDE_SKIN_OF_SPHERES = 2.5e-3;

/// Returns RVEs of spheres. One of them has more spheres than a block has threads.
std::vector<MemberOf<3>> spheres_scene(bool viscous, int substeps = 300)
{
  Material material = dry_material();
  material.thickness = material.mass_depth = 1.0;
  if (viscous) {
    material.normal_viscosity = 3.0;
    material.tangential_viscosity = 1.5;
  }
  const double dt = 1e-5;
  Spheres small = disordered_spheres(material, 6, 1), large = disordered_spheres(material, 11, 2);
  for (Spheres *state : {&small, &large}) state->cell = 0.96 * state->cell;
  return {{"216 spheres with servo", small, shear_at_pressure(small, 60.0, dt, substeps)},
          {"1331 spheres with servo", large, shear_at_pressure(large, 60.0, dt, substeps)},
          {"216 spheres with modes of a servo", small,
           shear_at_pressure_by_modes(small, 60.0, dt, substeps)},
          {"216 spheres on a path", small,
           DriveOf<3>::constant_velocity_gradient(
               Tensor3{{0.5, 12.0, -4.0, 20.0, 0.8, -15.0, 0.0, 7.0, -1.0}}, dt, substeps / 2)}};
}

/// Returns `count` RVEs of side^3 spheres on paths.
std::vector<MemberOf<3>> spheres_on_paths(int side, int count)
{
  Material material = dry_material();
  material.thickness = material.mass_depth = 1.0;
  std::vector<MemberOf<3>> members;
  for (int k = 0; k < count; ++k) {
    Spheres state = disordered_spheres(material, side, 1 + k);
    state.cell = 0.93 * state.cell;
    members.push_back({std::to_string(side * side * side) + " spheres, " + std::to_string(k), state,
                       DriveOf<3>::constant_velocity_gradient(
                           Tensor3{{0.4, 50.0, -4.0, 5.0, 0.2, -8.0, 0.0, 7.0, -0.8}}, 1e-5, 150)});
  }
  return members;
}

/// Returns RVEs with few steps, for tests in which a block of a GPU has one thread and is slow.
std::vector<Member> short_scene()
{
  RveState small = triangular_packing(dry_material(), 6, 8, 0.0037, 1), middle = packing_of_400();
  shake(small, 0.5, 2);
  shake(middle, 0.5, 3);
  return {
      {"48 grains", small, biaxial_shear(small, 40.0, 60)},
      {"400 grains", middle, biaxial_shear(middle, 40.0, 25)},
      {"path", middle, Drive::constant_velocity_gradient(Tensor2{{0.5, 12.0, -4.0, 0.8}}, DT, 20)}};
}

template <int D> struct OutcomeOf {
  std::vector<std::vector<char>> states;    // final states, by member
  // results with stiffness, by call and member
  std::vector<std::vector<std::vector<char>>> results;
  std::vector<ResultOf<D>> last;
};
using Outcome = OutcomeOf<2>;

/// Returns the options with the contact model of these members.
template <int D> Options with_contacts_of(const std::vector<MemberOf<D>> &members, Options options)
{
  std::vector<RveStateOf<D>> states;
  for (const MemberOf<D> &member : members) states.push_back(member.state);
  options.contacts = contacts_of(states);
  return options;
}

/// RVEs of a call and their drives.
template <int D> struct BatchOf {
  std::vector<int> rves;
  std::vector<DriveOf<D>> drives;
};
template <int D>
BatchOf<D> add_members(EngineOf<D> &engine, const std::vector<MemberOf<D>> &members)
{
  BatchOf<D> batch;
  for (const MemberOf<D> &member : members) {
    batch.rves.push_back(engine.add(member.state));
    batch.drives.push_back(member.drive);
  }
  return batch;
}

template <int D>
OutcomeOf<D> run_batch(EngineOf<D> &engine, const std::vector<MemberOf<D>> &members, int calls)
{
  OutcomeOf<D> outcome;
  const auto [rves, drives] = add_members(engine, members);
  std::vector<ElasticResultOf<D>> answers;
  for (int call = 0; call < calls; ++call) {
    engine.advance(rves, drives, answers);
    outcome.results.emplace_back();
    outcome.last.clear();
    for (const ElasticResultOf<D> &answer : answers) {
      outcome.last.push_back(answer.result);
      outcome.results.back().push_back(bytes_of(answer.result));
      append(outcome.results.back().back(), answer.stiffness);
    }
  }
  for (int rve : rves) outcome.states.push_back(serialize(engine.state(rve)));
  return outcome;
}

template <int D>
void expect_same_bits(const OutcomeOf<D> &x, const OutcomeOf<D> &y,
                      const std::vector<MemberOf<D>> &members)
{
  for (std::size_t k = 0; k < members.size(); ++k) {
    for (std::size_t call = 0; call < x.results.size(); ++call)
      EXPECT_TRUE(x.results[call][k] == y.results[call][k])
          << members[k].name << ": results of call " << call << " differ";
    ASSERT_EQ(x.states[k].size(), y.states[k].size()) << members[k].name;
    EXPECT_EQ(std::memcmp(x.states[k].data(), y.states[k].data(), x.states[k].size()), 0)
        << members[k].name << ": states differ";
  }
}

/// Final states and responses of all calls. A response (short answer) has only status, number of
/// contacts and stress. On a GPU, calls that return responses have their own kernels.
template <int D> struct BriefOutcomeOf {
  std::vector<RveStateOf<D>> states;
  std::vector<std::vector<char>> answers;    // by member
};
template <int D>
BriefOutcomeOf<D> play_briefly(EngineOf<D> &engine, const std::vector<MemberOf<D>> &members,
                               int calls)
{
  BriefOutcomeOf<D> outcome;
  outcome.answers.resize(members.size());
  const auto [rves, drives] = add_members(engine, members);
  std::vector<ResponseOf<D>> responses;
  for (int call = 0; call < calls; ++call) {
    engine.advance(rves, drives, responses);
    for (std::size_t k = 0; k < members.size(); ++k) {
      append(outcome.answers[k], responses[k].status);
      append(outcome.answers[k], responses[k].num_contacts);
      append(outcome.answers[k], responses[k].stress);
    }
  }
  for (const int rve : rves) outcome.states.push_back(engine.state(rve));
  return outcome;
}

/// Makes the same calls on two engines, of which `full` returns Results and `brief` returns
/// Responses. Expects the same bits of status, number of contacts, stress and states. A member that
/// fails is added to the batch.
void expect_short_answers(Engine &full, Engine &brief, std::vector<Member> members)
{
  Member crushed{"crushed", packing_of_400(),
                 Drive::constant_velocity_gradient(Tensor2{{-20.0, 0.0, 0.0, -20.0}}, DT, 600)};
  members.push_back(crushed);
  const auto [of_full, drives] = add_members(full, members);
  const std::vector<int> of_brief = add_members(brief, members).rves;
  std::vector<Result> results;
  std::vector<Response> responses(1);    // not the size of the batch
  for (int call = 0; call < 3; ++call) {
    full.advance(of_full, drives, results);
    brief.advance(of_brief, drives, responses);

    ASSERT_EQ(responses.size(), members.size());
    for (std::size_t k = 0; k < members.size(); ++k) {
      SCOPED_TRACE(members[k].name + ", call " + std::to_string(call));
      EXPECT_EQ(responses[k].status, results[k].status) << describe_status(responses[k].status);
      EXPECT_TRUE(serialize(full.state(of_full[k])) == serialize(brief.state(of_brief[k])));
      if (results[k].status & status::Fatal) continue;
      EXPECT_EQ(responses[k].num_contacts, results[k].num_contacts);
      EXPECT_EQ(std::memcmp(&responses[k].stress, &results[k].stress, sizeof(Tensor2)), 0);
      EXPECT_NE(results[k].num_contacts == 0, results[k].mean_stress() > 0.0);
    }
    EXPECT_NE(responses.back().status & status::OverlapTooLarge, 0u)
        << describe_status(responses.back().status);
  }
}

Options options_for(Format format, Device device, double skin = 0.0)
{
  Options options;
  options.format = format;
  options.device = device;
  options.threads = 2;
  options.skin = skin;
  return options;
}

class Backends : public ::testing::TestWithParam<Format> {};
std::string name_of(const ::testing::TestParamInfo<Format> &info)
{
  return to_string(info.param);
}
INSTANTIATE_TEST_SUITE_P(Formats, Backends,
                         ::testing::Values(Format::Fast, Format::Mixed, Format::Double), name_of);

/// Compares the CPU with the GPU; skipped without a GPU.
class CpuAndCuda : public Backends {
 protected:
  void SetUp() override
  {
    try {
      make_engine(options_for(Format::Fast, Device::Cuda));
    } catch (const InputError &error) {
      if (cuda_required()) FAIL() << error.what();
      GTEST_SKIP() << error.what();
    }
  }
};
INSTANTIATE_TEST_SUITE_P(Formats, CpuAndCuda,
                         ::testing::Values(Format::Fast, Format::Mixed, Format::Double), name_of);

/// Returns true if the list of extra pairs must have grown: the RVE has more pairs than the slots
/// of its grains and the initial list of extra pairs can hold.
template <int D> bool has_grown(const ResultOf<D> &result)
{
  constexpr int owned = D == 2 ? 3 : 4;
  return result.num_pairs >
      owned * result.num_grains + initial_extra_capacity<D>(result.num_grains);
}

/// Expects that the run had rebuilds, lattice reductions, repeated calls, grown lists and sliding
/// contacts. A comparison of backends is significant only then.
template <int D>
void expect_eventful(const OutcomeOf<D> &outcome, const std::vector<MemberOf<D>> &members)
{
  for (std::size_t k = 0; k < members.size(); ++k) {
    const ResultOf<D> &result = outcome.last[k];
    EXPECT_EQ(result.status & status::Fatal, 0u)
        << members[k].name << ": " << describe_status(result.status);
    if (!members[k].drive.has_servo()) continue;
    EXPECT_GE(result.counters.rebuilds, 20) << members[k].name;
    EXPECT_GE(result.counters.lattice_reductions, 1) << members[k].name;
    EXPECT_GE(result.counters.repeats, 1) << members[k].name;
    EXPECT_TRUE(has_grown(result)) << members[k].name << ": " << result.num_pairs << " pairs";
    EXPECT_GE(result.sliding_fraction, 0.1) << members[k].name;
  }
}

// ---- instruction sets ---------------------------------------------------------------------------

#if defined(RVE_WITH_X86_64_V3) && !defined(RVE_WITHOUT_BASELINE)

/// Device state and answers of an RVE after a call of one build of the kernels.
struct KernelRun {
  DeviceState image;
  AnswerRecord<2> answer;
  DetailRecord<2> detail;
};

KernelRun run_kernel(const HostKernel<2> &kernel, DeviceState image, const DriveRecord<2> &drive,
                     const SteeringRecord<2> *steering, KernelVariant scene)
{
  const int pair_capacity = 6 * image.num_grains;
  const HostWorkspaceSizes sizes = kernel.workspace_sizes(image.num_grains, pair_capacity, scene);
  std::vector<char> shared(sizes.shared), workspace(sizes.workspace);
  KernelRun run{std::move(image), AnswerRecord<2>(), DetailRecord<2>()};
  const bool general = scene == KernelVariant::General || scene == KernelVariant::Rolling;
  const BatchConstants batch{0.0, 0.5, 0.5, general ? 1 : 0, 1};
  kernel.advance(run.image.bytes.data(), drive, steering, batch,
                 {shared.data(), workspace.data(), pair_capacity}, scene, run.answer, &run.detail);
  return run;
}

/// Returns a simple shear that is large enough for a lattice reduction.
DriveRecord<2> kernel_drive()
{
  DriveRecord<2> drive = DriveRecord<2>();
  drive.dt = DT;
  drive.substeps = 600;
  drive.segments = 1;
  drive.deformation[0] = drive.deformation[3] = 1.0;
  drive.deformation[1] = 0.9;
  return drive;
}

SteeringRecord<2> kernel_steering(const RveState &state)
{
  SteeringRecord<2> steering = SteeringRecord<2>();
  steering.controlled[0] = steering.controlled[3] = 1;
  steering.stress_goal[0] = steering.stress_goal[3] = -PRESSURE;
  steering.velocity_gradient[1] = 30.0;
  steering.servo_gain = default_servo_gain(state);
  steering.servo_max_rate = 20.0;
  return steering;
}

bool same_records(const KernelRun &x, const KernelRun &y)
{
  static_assert(sizeof(AnswerRecord<2>) == 4 * 4 + 6 * 8, "no padding");
  // all bytes except the padding at the end
  const std::size_t size = reinterpret_cast<const char *>(x.detail.stiffness + kStiffness<2>) -
      reinterpret_cast<const char *>(&x.detail);
  return std::memcmp(&x.answer, &y.answer, sizeof(AnswerRecord<2>)) == 0 &&
      std::memcmp(&x.detail, &y.detail, size) == 0;
}

#endif

}    // namespace

TEST_P(Backends, InstructionSetsGiveTheSameBits)
{
#if defined(RVE_WITH_X86_64_V3) && !defined(RVE_WITHOUT_BASELINE)
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma") ||
      !__builtin_cpu_supports("bmi2"))
    GTEST_SKIP() << "this CPU has no x86-64-v3";
  const Format format = GetParam();
  RveState state = packing_of_400();
  state.cell = 1.01 * state.cell;
  shake(state, 0.2, 5);
  // The force scale is coarse enough for the whole call, since this test does not repeat calls.
  state.largest_contact_force = 1e4;
  RveState viscous = state;
  viscous.material.normal_viscosity = 3.0;
  viscous.material.tangential_viscosity = 1.5;
  RveState slippery = state;
  slippery.material.friction = 0.0;
  RveState rolling = viscous;
  rolling.material.rolling_stiffness = 5e5;
  rolling.material.rolling_friction = 0.3;
  const DriveRecord<2> drive = kernel_drive();
  const SteeringRecord<2> servo = kernel_steering(state);
  struct {
    const char *name;
    const RveState &state;
    const SteeringRecord<2> *steering;
    KernelVariant scene;
  } const cases[] = {
      {"plain", state, nullptr, KernelVariant::Plain},
      {"without friction", slippery, nullptr, KernelVariant::Frictionless},
      {"with dashpots and energy", viscous, nullptr, KernelVariant::General},
      {"with rolling resistance", rolling, nullptr, KernelVariant::Rolling},
      {"with rolling resistance and a servo", rolling, &servo, KernelVariant::Rolling},
      {"with a servo", state, &servo, KernelVariant::Steered},
      {"with a servo and dashpots", viscous, &servo, KernelVariant::General}};

  for (const auto &one : cases) {
    SCOPED_TRACE(one.name);
    const DeviceState image =
        build_device_state(GetParam(), one.state, 2000, features_of(one.scene).memory);

    const KernelRun baseline = run_kernel(host_kernel<InstructionSet::baseline, 2>(format), image,
                                          drive, one.steering, one.scene);
    const KernelRun v3 = run_kernel(host_kernel<InstructionSet::v3, 2>(format), image, drive,
                                    one.steering, one.scene);

    EXPECT_EQ(baseline.answer.status, status::Ok) << describe_status(baseline.answer.status);
    EXPECT_GE(baseline.detail.progress.rebuilds, 5);
    EXPECT_GE(baseline.detail.progress.lattice_reductions, 1);
    EXPECT_GT(baseline.detail.num_sliding, 20);
    EXPECT_GT(baseline.detail.stiffness[0], 0.0);
    // States are compared without the signs of zeros. The baseline build can store zeros with other
    // signs in numbers that are used only with friction.
    const KernelVariant memory = features_of(one.scene).memory;
    EXPECT_TRUE(serialize(read_device_state(format, baseline.image, memory)) ==
                serialize(read_device_state(format, v3.image, memory)));
    EXPECT_TRUE(same_records(baseline, v3));
    EXPECT_FALSE(baseline.image.bytes == image.bytes);    // the state has changed
  }
#else
  GTEST_SKIP() << "built for one instruction set only";
#endif
}

TEST_P(Backends, SceneOfTheComparisonGoesThroughRebuildsReductionsGrowthAndSliding)
{
  // CpuAndCuda compares this scene. Its counters are checked here, since this test also runs on
  // machines without a GPU.
  const auto members = full_scene(false);

  const Outcome outcome =
      run_batch(*make_engine(options_for(GetParam(), Device::Cpu, WIDE_SKIN)), members, 6);

  expect_eventful(outcome, members);
}

TEST_P(Backends, SceneOfSpheresGoesThroughRebuildsReductionsGrowthAndSliding)
{
  const auto members = spheres_scene(false);
  const Options options =
      with_contacts_of(members, options_for(GetParam(), Device::Cpu, WIDE_SKIN_OF_SPHERES));

  const auto outcome = run_batch(*make_engine<3>(options), members, 6);

  expect_eventful(outcome, members);
}

TEST_P(Backends, ShortAndLongAnswersAndStatesAgree)
{
  // The scene `plain` has neither servos nor dashpots, `general` has both, and `rolling` has both
  // and rolling resistance.
  for (const char *scene : {"plain", "general", "rolling"}) {
    SCOPED_TRACE(scene);
    auto members = full_scene(scene != std::string("plain"), scene == std::string("rolling"));
    if (scene == std::string("plain"))
      for (Member &member : members)
        member.drive = Drive::constant_velocity_gradient(Tensor2{{0.1, 0.3, 0.2, -0.2}}, DT, 150);
    const Options options =
        with_contacts_of(members, options_for(GetParam(), Device::Cpu, WIDE_SKIN));
    const auto full = make_engine(options), brief = make_engine(options);

    expect_short_answers(*full, *brief, members);
  }
}

// The forces of a packing without contacts are unknown before its first collision. If they exceed
// the range of the sums, the engine repeats the call and does not report that the overlap limit is
// exceeded.
TEST_P(Backends, FirstContactsBeyondTheForceRangeRepeatTheCall)
{
  RveState gas = triangular_packing(dry_material(), 6, 8, 0.0037, 1);
  gas.cell = 1.7 * gas.cell;
  gas.material.friction = 0.0;
  shake(gas, 1.0, 4);
  const Drive drive = Drive::constant_velocity_gradient(Tensor2{{0.5, 12.0, -4.0, 0.8}}, DT, 190);
  const auto engine = make_engine(options_for(GetParam(), Device::Cpu));
  const int rve = engine->add(gas);

  std::vector<Result> results;
  engine->advance({rve}, {drive}, results);

  EXPECT_EQ(results[0].status & status::Fatal, 0u) << describe_status(results[0].status);
  const RveState end = engine->state(rve);
  EXPECT_EQ(end.counters.steps, 190);
  EXPECT_GT(end.counters.repeats, 0);
}

TEST_P(Backends, RvesWithMoreFeaturesDoNotChangeABitOfTheOthers)
{
  // A servo or a dashpot in the batch selects another kernel variant; a rotation selects another
  // path in the kernel.
  RveState state = packing_of_400();
  shake(state, 0.2, 3);
  const Drive straight = Drive::constant_velocity_gradient(Tensor2{{0.5, 3.0, 3.0, 0.8}}, DT, 150);
  const std::vector<Member> alone = {{"plain", state, straight}};
  RveState viscous = state;
  viscous.material.normal_viscosity = 3.0;
  RveState rolling = state;
  rolling.material.rolling_stiffness = 5e5;
  rolling.material.rolling_friction = 0.3;
  const std::vector<Member> company[] = {
      {alone[0], {"servo", state, biaxial_shear(state, 40.0, 100)}},
      {alone[0], {"dashpots", viscous, straight}},
      {alone[0], {"rolling resistance", rolling, straight}},
      {alone[0],
       {"turning", state,
        Drive::constant_velocity_gradient(Tensor2{{0.0, -12.0, 12.0, 0.0}}, DT, 150)}}};
  const Outcome expected = run_batch(*make_engine(options_for(GetParam(), Device::Cpu)), alone, 3);

  for (const auto &members : company) {
    SCOPED_TRACE(members[1].name);

    const Options options = with_contacts_of(members, options_for(GetParam(), Device::Cpu));
    const Outcome outcome = run_batch(*make_engine(options), members, 3);

    expect_same_bits(expected, outcome, alone);
  }
}

TEST_P(CpuAndCuda, ShortAnswerOfTheGpuIsTheResultOfTheCpu)
{
  const auto cpu = make_engine(options_for(GetParam(), Device::Cpu, WIDE_SKIN));
  const auto gpu = make_engine(options_for(GetParam(), Device::Cuda, WIDE_SKIN));

  expect_short_answers(*cpu, *gpu, full_scene(false));
}

TEST_P(CpuAndCuda, GiveTheSameStatesAndResultsAfterAnEventfulRun)
{
  for (const bool viscous : {false, true}) {
    SCOPED_TRACE(viscous ? "with dashpots" : "without dashpots");
    const auto members = full_scene(viscous);
    const auto cpu = make_engine(options_for(GetParam(), Device::Cpu, WIDE_SKIN));
    const auto gpu = make_engine(options_for(GetParam(), Device::Cuda, WIDE_SKIN));

    const Outcome on_cpu = run_batch(*cpu, members, 6), on_gpu = run_batch(*gpu, members, 6);

    if (!viscous) expect_eventful(on_gpu, members);
    expect_same_bits(on_cpu, on_gpu, members);
  }
}

TEST_P(CpuAndCuda, GiveTheSameSpheresAfterAnEventfulRun)
{
  for (const bool viscous : {false, true}) {
    SCOPED_TRACE(viscous ? "with dashpots and energy" : "without dashpots");
    const auto members = spheres_scene(viscous);
    Options options =
        with_contacts_of(members, options_for(GetParam(), Device::Cpu, WIDE_SKIN_OF_SPHERES));
    options.track_energy = viscous;
    const auto cpu = make_engine<3>(options);
    options.device = Device::Cuda;
    const auto gpu = make_engine<3>(options);

    const auto on_cpu = run_batch(*cpu, members, 6), on_gpu = run_batch(*gpu, members, 6);

    expect_same_bits(on_cpu, on_gpu, members);
  }
}

TEST_P(CpuAndCuda, GiveTheSameSpheresForEveryBlockSize)
{
  const auto members = spheres_scene(false, 40);
  Options options = with_contacts_of(members, options_for(GetParam(), Device::Cpu));
  const auto on_cpu = run_batch(*make_engine<3>(options), members, 3);

  options.device = Device::Cuda;
  for (const int threads : {32, 96, 100, 256, 512, 1024}) {
    SCOPED_TRACE(std::to_string(threads) + " threads");
    options.block_size = threads;

    expect_same_bits(on_cpu, run_batch(*make_engine<3>(options), members, 3), members);
  }
}

// The batch has more RVEs than a GPU has multiprocessors. Most RVEs have servos. One RVE has fewer
// grains than a warp has threads.
TEST_P(CpuAndCuda, GiveTheSameBitsWhereManyRvesHaveAServo)
{
  auto members = full_scene(false);
  members.erase(std::find_if(members.begin(), members.end(), [](const Member &member) {
    return member.state.num_grains() > 1000;
  }));
  const RveState few = triangular_packing(dry_material(), 4, 6, 0.0037, 1);
  members.push_back({"few grains with servo", few, biaxial_shear(few, 40.0, 200)});
  const RveState small = triangular_packing(dry_material(), 6, 8, 0.0037, 5);
  while (members.size() < 150)
    members.push_back({"one of many with servo", small,
                       biaxial_shear(small, 40.0, 40 + static_cast<int>(members.size()))});
  const auto cpu = make_engine(options_for(GetParam(), Device::Cpu, WIDE_SKIN));
  const auto gpu = make_engine(options_for(GetParam(), Device::Cuda, WIDE_SKIN));

  const Outcome on_cpu = run_batch(*cpu, members, 4), on_gpu = run_batch(*gpu, members, 4);

  expect_same_bits(on_cpu, on_gpu, members);
  EXPECT_GT(on_gpu.last[0].counters.rebuilds, 10);
}

// The first batch has many small RVEs. The other batches have one RVE each, of increasing size. The
// size and the format decide where a GPU keeps grains: in registers, with one or two grains per
// thread, or in memory.
TEST_P(CpuAndCuda, GiveTheSameSpheresOfAllSizes)
{
  for (const int side : {5, 6, 9, 11, 13}) {
    const auto members = spheres_on_paths(side, side == 5 ? 134 : 1);
    Options options =
        with_contacts_of(members, options_for(GetParam(), Device::Cpu, WIDE_SKIN_OF_SPHERES));
    const auto on_cpu = play_briefly(*make_engine<3>(options), members, 8);
    options.device = Device::Cuda;
    const auto on_gpu = play_briefly(*make_engine<3>(options), members, 8);

    for (std::size_t k = 0; k < members.size(); ++k) {
      SCOPED_TRACE(members[k].name);
      EXPECT_TRUE(on_cpu.answers[k] == on_gpu.answers[k]);
      EXPECT_TRUE(serialize(on_cpu.states[k]) == serialize(on_gpu.states[k]));
    }
    EXPECT_GE(on_cpu.states[0].counters.rebuilds, 20);
    EXPECT_GE(on_cpu.states[0].counters.lattice_reductions, 1);
    EXPECT_GE(on_cpu.states[0].pairs.size(), 2 * on_cpu.states[0].radius.size());
  }
}

TEST_P(CpuAndCuda, RotateRvesToTheSameBits)
{
  const auto turned_scene = [&](const std::vector<Member> &members, Device device) {
    const auto engine =
        make_engine(with_contacts_of(members, options_for(GetParam(), device, WIDE_SKIN)));
    run_batch(*engine, members, 2);
    std::vector<int> rves(
        members.size());    // all RVEs in the order of run_batch(), except the second one
    std::iota(rves.begin(), rves.end(), 0);
    const int left_alone = 1;
    rves.erase(rves.begin() + left_alone);
    std::vector<Tensor2> rotations;
    for (const int rve : rves) rotations.push_back(plane_rotation(0.3 * rve - 0.4));
    engine->turn(rves, rotations);
    std::vector<std::vector<char>> states;
    for (std::size_t rve = 0; rve < members.size(); ++rve)
      states.push_back(serialize(engine->state(static_cast<int>(rve))));
    return states;
  };

  for (const bool rolling : {false, true}) {
    const auto members = full_scene(false, rolling);

    const auto on_cpu = turned_scene(members, Device::Cpu);
    const auto on_gpu = turned_scene(members, Device::Cuda);

    for (std::size_t k = 0; k < members.size(); ++k)
      EXPECT_TRUE(on_cpu[k] == on_gpu[k]) << members[k].name << (rolling ? " that roll" : "");
  }
}

TEST_P(CpuAndCuda, GiveTheSameBitsWithTheAutomaticSkinAndEnergyTracking)
{
  const auto members = full_scene(true);
  Options options = options_for(GetParam(), Device::Cpu);
  options.track_energy = true;
  const auto cpu = make_engine(options);
  options.device = Device::Cuda;
  const auto gpu = make_engine(options);

  const Outcome on_cpu = run_batch(*cpu, members, 3), on_gpu = run_batch(*gpu, members, 3);

  expect_same_bits(on_cpu, on_gpu, members);
  for (const Result &result : on_gpu.last) EXPECT_NE(result.energy.local_damping, 0.0);
}

TEST_P(CpuAndCuda, GiveTheSameBitsWithRollingResistance)
{
  // The batch has an RVE with more grains than threads and one without rolling resistance.
  auto members = full_scene(true, true);
  members[1].state.material.rolling_friction = 0.0;
  Options options = with_contacts_of(members, options_for(GetParam(), Device::Cpu, WIDE_SKIN));
  options.track_energy = true;
  const auto cpu = make_engine(options);
  options.device = Device::Cuda;
  const auto gpu = make_engine(options);

  const Outcome on_cpu = run_batch(*cpu, members, 4), on_gpu = run_batch(*gpu, members, 4);

  expect_same_bits(on_cpu, on_gpu, members);
  for (const Result &result : on_gpu.last) EXPECT_NE(result.energy.local_damping, 0.0);
  const auto others = full_scene(false, true);
  expect_short_answers(
      *make_engine(with_contacts_of(others, options_for(GetParam(), Device::Cpu))),
      *make_engine(with_contacts_of(others, options_for(GetParam(), Device::Cuda))), others);
}

// The batch moves to another engine half-way.
TEST_P(CpuAndCuda, GiveTheSameBitsWhenRollingResistanceIsAddedLater)
{
  const auto members = short_scene();
  Outcome outcomes[2];
  std::vector<Member> all = members;
  all.push_back(members[1]);
  all.back().state.material.rolling_stiffness = 5e5;
  all.back().state.material.rolling_friction = 0.3;

  for (const Device device : {Device::Cpu, Device::Cuda}) {
    auto engine = make_engine(options_for(GetParam(), device));
    Outcome &outcome = outcomes[device == Device::Cuda ? 1 : 0];
    std::vector<int> rves;
    std::vector<Drive> drives;
    for (std::size_t k = 0; k < all.size(); ++k) {
      const ContactModel contacts = contacts_of(all[k].state);
      if (!engine->contacts().serves(contacts)) {
        auto other = engine->empty_with(contacts);
        for (int &rve : rves) rve = other->add(engine->state(rve));
        engine = std::move(other);
      }
      rves.push_back(engine->add(all[k].state));
      drives.push_back(all[k].drive);
      engine->advance(rves, drives, outcome.last);
    }
    for (int rve : rves) outcome.states.push_back(serialize(engine->state(rve)));
  }

  expect_same_bits(outcomes[0], outcomes[1], all);
}

// On the CPU, RVEs without friction have another kernel variant.
TEST_P(CpuAndCuda, GiveTheSameBitsWithoutFriction)
{
  auto members = full_scene(false);
  for (Member &member : members) {
    member.state.material.friction = 0.0;
    member.drive = Drive::constant_velocity_gradient(Tensor2{{0.5, 12.0, -4.0, 0.8}}, DT, 190);
  }
  const auto cpu = make_engine(options_for(GetParam(), Device::Cpu));
  const auto gpu = make_engine(options_for(GetParam(), Device::Cuda));

  const Outcome on_cpu = run_batch(*cpu, members, 3), on_gpu = run_batch(*gpu, members, 3);

  expect_same_bits(on_cpu, on_gpu, members);
}

/// Returns RVEs for a call in which most of them make one step. Two RVEs make a hundred steps, and
/// one of these two rotates so far that its path has several segments.
template <int D> std::vector<MemberOf<D>> few_with_many_steps(const RveStateOf<D> &state, double dt)
{
  auto strain = Tensor<double, D>::zero(), spin = strain;
  strain(0, 0) = -2.0;
  strain(0, 1) = 5.0;
  spin(1, 0) = 0.05 / (100 * dt);
  spin(0, 1) = -spin(1, 0);
  std::vector<MemberOf<D>> members;
  for (int k = 0; k < 12; ++k)
    members.push_back({"one step", state, DriveOf<D>::constant_velocity_gradient(strain, dt, 1)});
  for (const auto &gradient : {strain, strain + spin})
    members.push_back(
        {"many steps", state, DriveOf<D>::constant_velocity_gradient(gradient, dt, 100)});
  return members;
}

template <int D>
void expect_same_with_few_long_calls(Options options, const RveStateOf<D> &state, double dt)
{
  const auto members = few_with_many_steps(state, dt);
  options = with_contacts_of(members, options);
  const auto cpu = make_engine<D>(options);
  options.device = Device::Cuda;
  const auto gpu = make_engine<D>(options);
  expect_same_bits(run_batch(*cpu, members, 3), run_batch(*gpu, members, 3), members);
}

// Before a call, a GPU plans as many steps as most RVEs make. The blocks of the other RVEs plan
// further steps during the call.
TEST_P(CpuAndCuda, GiveTheSameBitsWhereFewRvesMakeManySteps)
{
  expect_same_with_few_long_calls(options_for(GetParam(), Device::Cpu, 0.0), packing_of_400(), DT);
  Material material = dry_material();
  material.thickness = material.mass_depth = 1.0;
  Spheres spheres = disordered_spheres(material, 6, 1);
  spheres.cell = 0.96 * spheres.cell;
  expect_same_with_few_long_calls(options_for(GetParam(), Device::Cpu, 0.0), spheres, 1e-5);
}

TEST_P(CpuAndCuda, GiveTheSameBitsForEveryBlockSize)
{
  const auto members = short_scene();
  const double skin = 1e-3;
  const Outcome on_cpu =
      run_batch(*make_engine(options_for(GetParam(), Device::Cpu, skin)), members, 3);

  for (const int threads : {1, 32, 96, 100, 128, 208, 256, 1024}) {
    SCOPED_TRACE(std::to_string(threads) + " threads");
    Options options = options_for(GetParam(), Device::Cuda, skin);
    options.block_size = threads;

    expect_same_bits(on_cpu, run_batch(*make_engine(options), members, 3), members);
  }
}

TEST_P(CpuAndCuda, ContinueEachOthersStatesBitForBit)
{
  const auto members = short_scene();
  const auto cpu = make_engine(options_for(GetParam(), Device::Cpu));
  const auto gpu = make_engine(options_for(GetParam(), Device::Cuda));
  const Outcome straight = run_batch(*cpu, members, 4);

  Outcome first = run_batch(*gpu, members, 2);
  auto continued = members;
  for (std::size_t k = 0; k < members.size(); ++k)
    continued[k].state = deserialize(first.states[k].data(), first.states[k].size());
  const Outcome second = run_batch(*cpu, continued, 2);

  for (std::size_t k = 0; k < members.size(); ++k)
    EXPECT_TRUE(straight.states[k] == second.states[k]) << members[k].name;
}

// ---- memory -------------------------------------------------------------------------------------

/// Returns the memory that the engine expects for this number of RVEs of 400 grains and for a call
/// with all of them [bytes].
double estimate(Engine &engine, int num_rves)
{
  return static_cast<double>(num_rves) * static_cast<double>(engine.bytes_per_rve(400)) +
      static_cast<double>(engine.bytes_of_call(num_rves, 400));
}

TEST_P(Backends, ReportFreeMemoryAndTheMemoryOfCalls)
{
  const auto engine = make_engine(options_for(GetParam(), Device::Cpu));

  const Memory memory = engine->memory();

  EXPECT_TRUE(memory.is_known);
  EXPECT_TRUE(memory.is_host);
  EXPECT_GT(memory.free, 1u << 20);
  EXPECT_EQ(engine->bytes_of_call(0, 400), 0u);
  EXPECT_GT(engine->bytes_of_call(1, 400), 0u);
  EXPECT_GT(engine->bytes_of_call(2000, 400), engine->bytes_of_call(1000, 400));
  EXPECT_GT(engine->bytes_of_call(1, 4000), engine->bytes_of_call(1, 400));
}

/// If the estimate is too low, a run fails in its set-up. If the estimate is too high, the engine
/// refuses runs that would fit.
TEST_P(CpuAndCuda, MemoryEstimateCoversTheDeviceAllocation)
{
  const int count = 20000;
  const auto engine = make_engine(options_for(GetParam(), Device::Cuda));
  const RveState state = packing_of_400();
  const Drive shear = Drive::constant_velocity_gradient(Tensor2{{0.0, 0.1, 0.0, 0.0}}, DT, 40);
  const double needed = estimate(*engine, count);
  const Memory before = engine->memory();
  ASSERT_TRUE(before.is_known);
  ASSERT_FALSE(before.is_host);

  std::vector<int> rves;
  std::vector<Result> results;
  for (int k = 0; k < count; ++k) rves.push_back(engine->add(state));
  engine->advance(rves, std::vector<Drive>(count, shear), results);

  const double taken =
      static_cast<double>(before.free) - static_cast<double>(engine->memory().free);
  EXPECT_LE(taken, needed);
  EXPECT_GE(taken, 0.5 * (needed - estimate(*engine, 1)));
}
