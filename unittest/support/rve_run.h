// SPDX-License-Identifier: GPL-2.0-only
// Runs one call of the block program on a CPU, in memory that is filled with garbage. The block is
// either a single thread that works on arrays, or a substitute for a thread block of a GPU. The
// substitute keeps the numbers of each item in "registers" apart from the arrays. The registers
// start as garbage, so that a number which was not loaded, kept or published gives a wrong result.

#pragma once

#include "rve/algorithm/step_loop.h"
#include "rve/block/block_serial.h"
#include "rve/core/status.h"
#include "rve/engine/batch_engine.h"
#include "rve/engine/packing.h"
#include "rve/engine/variant_configs.h"
#include "support/packings.h"
#include "support/spheres.h"

#include <gtest/gtest.h>

#include <cstring>
#include <vector>

namespace rve_test {

using namespace rve;

constexpr int CAPACITY = 416;    // capacity of the block in grains
constexpr int GARBAGE = 0x7f;    // value of every byte: numbers of 1e38 and more

class BlockInRegisters : public BlockSerial {
 public:
  static constexpr bool kInRegisters = true;
  // Lists are built on chip, in the memory that otherwise holds the sums and the plans of steps.
  static constexpr int kCapacity = CAPACITY;
  static inline char *present_chip = nullptr;    ///< memory on chip of the present call
  static char *chip() { return present_chip; }

  template <class T> struct Resident {
    T *array;
    std::vector<T> value;    ///< registers: one number per item
    T &operator[](int item) { return value[item]; }
    void load(int item) { value[item] = array[item]; }
    void save(int item) { array[item] = value[item]; }
    void load_whole(int item) { load(item); }
    void save_whole(int item) { save(item); }
    void keep(int item, const T &x) { value[item] = x; }
    void publish(int item, const T &x) { value[item] = array[item] = x; }
  };

  /// The block has CAPACITY threads. A visit of registers includes threads without a grain.
  using BlockSerial::for_items;
  template <Visit way = Visit::Items, class F> void for_items(int n, F f)
  {
    for_each(way == Visit::Registers ? CAPACITY : n, f);
  }
  template <Visit way = Visit::Items, class F> bool any_item(int n, F f)
  {
    return any(way == Visit::Registers ? CAPACITY : n, f);
  }
  template <class F> static void for_empty_registers(int n, F f)
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

/// A block with two grains per thread. Only the first grain of each thread takes part in shared
/// work. No register is without a grain.
class BlockOfTwo : public BlockInRegisters {
 public:
  using BlockSerial::any_item;
  using BlockSerial::for_items;
  template <class F> static void for_empty_registers(int, F) {}
  template <class F> static void share_out(int i, int n, int count, F f)
  {
    const int threads = (n + 1) / 2;
    if (i < threads)
      for (int k = i; k < count; k += threads) f(k);
  }
};

/// A block whose kernel keeps the constants of a step in uniform registers. One thread processes
/// the grains one after the other.
struct BlockOfUniforms : BlockInRegisters {
  static constexpr bool kHasUniforms = true;
};

/// Device state of an RVE and the results of its last call by one block program.
template <int D> struct RveRun {
  DeviceState image;
  AnswerRecord<D> answer = {};
  DetailRecord<D> detail = {};
};

/// Makes one call in memory that is filled with garbage.
template <class Block, class Config>
void advance(RveRun<Config::D> &run, const DriveRecord<Config::D> &drive, bool with_details,
             double skin = 0.0, bool with_ledger = false,
             const SteeringRecord<Config::D> &steering = SteeringRecord<Config::D>())
{
  char *image = run.image.bytes.data();
  const int n = run.image.num_grains, pair_capacity = 32 * n;
  const int capacity = Block::kInRegisters ? CAPACITY : n;
  std::vector<char> chip(shared_size<Config>(capacity, Block::kInRegisters), GARBAGE),
      workspace(workspace_size<Config>(n, pair_capacity), GARBAGE);
  const SharedView<Config> shared =
      carve_shared<Config>(chip.data(), capacity, Block::kInRegisters);
  BlockInRegisters::present_chip = chip.data();
  using Begin = CallBegin<Block, Config>;
  using Planning = StepPlanning<Block, Config>;
  CallState<Config> call;
  std::memset(static_cast<void *>(&call), GARBAGE, sizeof(call));
  std::memcpy(&call.header, image, sizeof(StateHeader<Config::D>));
  call.drive = drive;
  call.steering = steering;
  call.batch = BatchConstants{skin, 0.5, 0.5, with_ledger, 1};
  Begin::prepare(call, image, pair_capacity);
  for (int t = 0; t < call.plan_last; ++t) Planning::plan_step(call, t, 1);
  Begin::set_views(call, n, shared, workspace.data(), pair_capacity);
  std::memset(static_cast<void *>(&run.answer), 0, sizeof(run.answer));
  std::memset(static_cast<void *>(&run.detail), 0, sizeof(run.detail));
  Block block;
  RveKernel<Block, Config> variant(block, call, shared);
  variant.run(run.answer, with_details ? &run.detail : nullptr);
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

/// Returns short and long calls, with and without new lists, and a call without steps.
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

/// Returns a run that starts from the state. Its force scale is coarse enough for the first call.
/// The engine repeats a call if the scale is too fine, but these tests do not.
template <class Numbers, int D> RveRun<D> run_of(RveStateOf<D> state, KernelVariant memory)
{
  state.largest_contact_force = 1e4;
  return RveRun<D>{build_device_state(format_of<Numbers>(), state, 2000, memory)};
}

template <class Numbers> RveRun<2> disks(double friction)
{
  RveState state = packing_of_400();
  shake(state, 0.2, 5);
  state.material.friction = friction;
  return run_of<Numbers>(state, KernelVariant::General);
}

template <class Numbers, int D> RveStateOf<D> state_of(const RveRun<D> &run, KernelVariant memory)
{
  return read_device_state<D>(format_of<Numbers>(), run.image, memory);
}

/// Expects the same bits of results and states. The bytes of the device states can differ, since a
/// zero in a history can have either sign.
template <class Numbers, int D>
void expect_same_bits(const RveRun<D> &run, const RveRun<D> &expected, KernelVariant memory)
{
  EXPECT_EQ(std::memcmp(&run.answer, &expected.answer, sizeof(run.answer)), 0);
  EXPECT_EQ(std::memcmp(&run.detail, &expected.detail, sizeof(run.detail)), 0);
  EXPECT_EQ(serialize(state_of<Numbers>(run, memory)),
            serialize(state_of<Numbers>(expected, memory)));
}

/// Time steps of the disks of the examples, and of spheres of the same stiffness [s].
constexpr double DISK_DT = 5e-5, SPHERE_DT = 2e-6;

/// Returns a servo for disks(). It holds the stress along x at 100 kPa during shear and compression
/// along y.
inline SteeringRecord<2> servo_of_disks()
{
  SteeringRecord<2> steering = SteeringRecord<2>();
  steering.controlled[0] = 1;
  steering.stress_goal[0] = -1e5;
  steering.velocity_gradient[1] = steering.velocity_gradient[3] = -3.0;
  steering.servo_gain = default_servo_gain(packing_of_400());
  steering.servo_max_rate = 20.0;
  return steering;
}

#if defined(__SANITIZE_ADDRESS__)
// Builds with sanitizers test one format: compilation takes minutes per format, and all formats
// have the same source.
using Formats = testing::Types<MixedNumbers>;
#else
using Formats = testing::Types<FastNumbers, MixedNumbers, DoubleNumbers>;
#endif

}    // namespace rve_test
