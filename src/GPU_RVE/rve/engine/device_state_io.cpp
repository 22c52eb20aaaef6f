// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/device_state_io.h"

#include "rve/algorithm/rigid_turn.h"
#include "rve/algorithm/system_view.h"
#include "rve/block/block_serial.h"
#include "rve/engine/force_bounds.h"
#include "rve/engine/variant_configs.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <type_traits>

namespace rve {

namespace {

  /// Converts fractional coordinates from 64 bits to the coordinates of a format; widen() converts
  /// them back. `fast` keeps the upper 32 bits.
  template <class Coordinate> Coordinate narrow(std::uint64_t s)
  {
    if constexpr (std::is_same_v<Coordinate, FloatFraction>)
      return wrapped(static_cast<float>(std::ldexp(static_cast<double>(s), -64)));
    else
      return static_cast<Coordinate>(s >> (64 - 8 * sizeof(Coordinate)));
  }
  template <class Coordinate> std::uint64_t widen(Coordinate s)
  {
    if constexpr (std::is_same_v<Coordinate, FloatFraction>)
      return static_cast<std::uint64_t>(std::ldexp(static_cast<double>(s.value), 64));
    else
      return static_cast<std::uint64_t>(s) << (64 - 8 * sizeof(Coordinate));
  }

  /// Returns the grain numbers in storage order: row by row along x, and in space layer by layer.
  /// The neighbours of a grain then have storage indices near its own, or near those of the
  /// adjacent rows.
  template <int D> std::vector<std::int32_t> storage_order(const RveStateOf<D> &state)
  {
    const int n = state.num_grains();
    const double edge = D == 2 ? std::sqrt(static_cast<double>(n))
                               : std::cbrt(static_cast<double>(n));
    const double to_row = std::max(1.0, std::floor(0.75 * edge)) / 18446744073709551616.0;
    std::vector<std::int32_t> order(n);
    std::iota(order.begin(), order.end(), 0);
    const auto row = [&](int i, int axis) {
      return static_cast<int>(static_cast<double>(state.fractional[D * i + axis]) * to_row);
    };
    std::stable_sort(order.begin(), order.end(), [&](int i, int j) {
      for (int axis = D - 1; axis > 0; --axis)
        if (row(i, axis) != row(j, axis)) return row(i, axis) < row(j, axis);
      return state.fractional[D * i] < state.fractional[D * j];
    });
    return order;
  }

  /// Returns a pair of a state, with the history from a device state.
  template <class Config>
  PairOf<Config::D> pair_of(int first, int second, const typename Config::History &history)
  {
    PairOf<Config::D> pair{};
    pair.first = first;
    pair.second = second;
    Config::Law::to_pair(history, pair);
    // A state has no negative zeros.
    for (const auto &number : pair_memory<Config::D>()) number.of(pair) += 0.0;
    return pair;
  }

  template <class Config> DeviceState build(const RveStateOf<Config::D> &state, int extra_capacity)
  {
    constexpr int D = Config::D, spins = Config::spins;
    const int n = state.num_grains();
    std::vector<int> owned(n, 0);
    int num_extra = 0;
    for (const PairOf<D> &pair : state.pairs)
      if (owned[pair.first] < Config::owned_pairs)
        ++owned[pair.first];
      else
        ++num_extra;

    DeviceState device_state;
    device_state.num_grains = n;
    device_state.extra_capacity = std::max(extra_capacity, num_extra);
    device_state.bytes.assign(device_state_size<Config>(n, device_state.extra_capacity), 0);
    const auto view =
        carve_device_state<Config>(device_state.bytes.data(), n, device_state.extra_capacity);

    StateHeader<D> &header = *view.header;
    header = StateHeader<D>();
    header.num_grains = n;
    header.extra_capacity = device_state.extra_capacity;
    header.list_valid = !state.list_fractional.empty();
    store_tensor(state.cell, header.cell);
    store_tensor(state.deformation, header.deformation);
    store_tensor(header.list_valid ? state.list_cell : state.cell, header.list_cell);
    store_tensor(state.servo_velocity_gradient, header.servo_velocity_gradient);
    set_material_in(header, state.material);
    // The sums are computed from radii that are rounded to the number format. So a state that has
    // been read back gives the same sums.
    RveStateOf<D> stored;
    for (double r : state.radius) stored.radius.push_back(static_cast<typename Config::Wide>(r));
    const auto [smallest, largest] =
        std::minmax_element(stored.radius.begin(), stored.radius.end());
    header.largest_radius = *largest;
    double sum = 0.0;
    for (double r : stored.radius) sum += r;
    header.mean_radius = sum / n;
    header.solid_volume = stored.solid_volume();
    header.neighbor_bits = neighbor_bits<D>(*smallest, *largest, state.material);
    header.largest_contact_force = state.largest_contact_force;
    header.steps = state.counters.steps;
    header.rebuilds = state.counters.rebuilds;
    header.lattice_reductions = state.counters.lattice_reductions;
    header.repeats = state.counters.repeats;
    header.work = state.energy.work;
    header.friction_loss = state.energy.friction;
    header.damping_loss = state.energy.local_damping;
    header.viscous_loss = state.energy.viscous;

    using Coordinate = typename Config::Coordinate;
    using Real = typename Config::Real;
    const auto &list = header.list_valid ? state.list_fractional : state.fractional;
    const std::vector<std::int32_t> order = state.order.empty() ? storage_order(state)
                                                                : state.order;
    std::vector<int> site(n);    // storage index of each grain
    for (int k = 0; k < n; ++k) {
      const int i = order[k];
      site[i] = k;
      view.number[k] = i;
      for (int a = 0; a < D; ++a) {
        view.position[k][a] = narrow<Coordinate>(state.fractional[D * i + a]);
        view.list_position[k][a] = static_cast<std::uint32_t>(list[D * i + a] >> 32);
        view.velocity[k][a] = static_cast<Real>(state.velocity[D * i + a]);
      }
      for (int s = 0; s < spins; ++s)
        spin_component(view.spin[k], s) = static_cast<Real>(state.spin[spins * i + s]);
      view.radius[k] = static_cast<typename Config::Wide>(state.radius[i]);
      for (int m = 0; m < Config::owned_pairs; ++m) view.partner[m * n + k] = k;
      owned[k] = 0;
    }
    for (const PairOf<D> &pair : state.pairs) {
      const int first = site[pair.first], second = site[pair.second];
      if (owned[first] < Config::owned_pairs) {
        const int slot = owned[first]++ * n + first;
        view.partner[slot] = second;
        view.history[slot] = Config::Law::of_pair(pair);
      } else {
        view.extra_first[header.num_extra] = first;
        view.extra_second[header.num_extra] = second;
        view.extra_history[header.num_extra] = Config::Law::of_pair(pair);
        ++header.num_extra;
      }
    }
    return device_state;
  }

  template <class Config> RveStateOf<Config::D> read(const DeviceState &device_state)
  {
    constexpr int D = Config::D, spins = Config::spins;
    const int n = device_state.num_grains;
    const auto view = carve_device_state<Config>(const_cast<char *>(device_state.bytes.data()), n,
                                                 device_state.extra_capacity);
    const StateHeader<D> &header = *view.header;
    RveStateOf<D> state;
    static_cast<MaterialNumbers &>(state.material) = header.material;
    state.material.law = Config::Law::contact_law;
    state.cell = load_tensor<D>(header.cell);
    state.deformation = load_tensor<D>(header.deformation);
    state.servo_velocity_gradient = load_tensor<D>(header.servo_velocity_gradient);
    state.largest_contact_force = header.largest_contact_force;
    state.counters = {header.steps, header.rebuilds, header.lattice_reductions, header.repeats};
    state.energy = {header.work, header.friction_loss, header.damping_loss, header.viscous_loss};
    state.radius.resize(n);
    state.fractional.resize(D * n);
    state.velocity.resize(D * n);
    state.spin.resize(spins * n);
    if (header.list_valid) {
      state.list_cell = load_tensor<D>(header.list_cell);
      state.list_fractional.resize(D * n);
    }
    state.order.assign(view.number, view.number + n);
    for (int k = 0; k < n; ++k) {
      const int i = view.number[k];
      for (int a = 0; a < D; ++a) {
        state.fractional[D * i + a] = widen(view.position[k][a]);
        state.velocity[D * i + a] = view.velocity[k][a];
        if (header.list_valid) state.list_fractional[D * i + a] = widen(view.list_position[k][a]);
      }
      for (int s = 0; s < spins; ++s) state.spin[spins * i + s] = spin_component(view.spin[k], s);
      state.radius[i] = view.radius[k];
      for (int m = 0; m < Config::owned_pairs; ++m)
        if (view.partner[m * n + k] != k)
          state.pairs.push_back(
              pair_of<Config>(i, view.number[view.partner[m * n + k]], view.history[m * n + k]));
    }
    for (int m = 0; m < header.num_extra; ++m)
      state.pairs.push_back(pair_of<Config>(view.number[view.extra_first[m]],
                                            view.number[view.extra_second[m]],
                                            view.extra_history[m]));
    return state;
  }

  template <class Config>
  void turn(DeviceState &device_state, const Tensor<double, Config::D> &rotation)
  {
    BlockSerial block;
    turn_rigidly(block,
                 carve_device_state<Config>(device_state.bytes.data(), device_state.num_grains,
                                            device_state.extra_capacity),
                 rotation);
  }

  /// Calls work(config) and returns its result. `config` is the configuration of the variant that
  /// prepares calls of `memory`, in the format `Numbers`.
  template <int D, class Numbers, class Work>
  auto with_numbers(KernelVariant memory, const Work &work)
  {
    return with_variant<D>(memory, [&](auto variant) {
      return work(VariantConfig<variant.prepared_like, Numbers>());
    });
  }

  /// Calls work(config) and returns its result. `config` has the number format and memory layout of
  /// device states.
  template <int D, class Work>
  auto with_config(Format format, KernelVariant memory, const Work &work)
  {
    switch (format) {
      case Format::Fast:
        return with_numbers<D, FastNumbers>(memory, work);
      case Format::Mixed:
        return with_numbers<D, MixedNumbers>(memory, work);
      case Format::Single:
        if constexpr (D == 2) return with_numbers<D, SingleNumbers>(memory, work);
        break;    // make_engine refuses it
      case Format::Double:
        break;
    }
    return with_numbers<D, DoubleNumbers>(memory, work);
  }

}    // namespace

template <int D> void set_material_in(StateHeader<D> &header, const Material &material)
{
  header.material = material;
  header.obliquity = obliquity_of(material, D);
  header.inverse_obliquity = 1.0 / header.obliquity;
  header.all_forces_count = all_forces_count(material) ? 1 : 0;
}

template <int D>
DeviceState build_device_state(Format format, const RveStateOf<D> &state, int extra_capacity,
                               KernelVariant memory)
{
  return with_config<D>(
      format, memory, [&](auto config) { return build<decltype(config)>(state, extra_capacity); });
}

template <int D>
RveStateOf<D> read_device_state(Format format, const DeviceState &device_state,
                                KernelVariant memory)
{
  return with_config<D>(format, memory,
                        [&](auto config) { return read<decltype(config)>(device_state); });
}

template <int D>
void turn_device_state(Format format, DeviceState &device_state, const Tensor<double, D> &rotation,
                       KernelVariant memory)
{
  with_config<D>(format, memory,
                 [&](auto config) { turn<decltype(config)>(device_state, rotation); });
}

template <int D>
std::size_t device_state_bytes(Format format, int num_grains, int extra_capacity,
                               KernelVariant memory)
{
  return with_config<D>(format, memory, [&](auto config) {
    return device_state_size<decltype(config)>(num_grains, extra_capacity);
  });
}

template <int D> int initial_extra_capacity(int num_grains)
{
  return num_grains / PairCounts<D>::grains_per_extra_at_first + 8;
}

template void set_material_in(StateHeader<2> &, const Material &);
template DeviceState build_device_state(Format, const RveStateOf<2> &, int, KernelVariant);
template RveStateOf<2> read_device_state(Format, const DeviceState &, KernelVariant);
template void turn_device_state(Format, DeviceState &, const Tensor<double, 2> &, KernelVariant);
template std::size_t device_state_bytes<2>(Format, int, int, KernelVariant);
template int initial_extra_capacity<2>(int);

template void set_material_in(StateHeader<3> &, const Material &);
template DeviceState build_device_state(Format, const RveStateOf<3> &, int, KernelVariant);
template RveStateOf<3> read_device_state(Format, const DeviceState &, KernelVariant);
template void turn_device_state(Format, DeviceState &, const Tensor<double, 3> &, KernelVariant);
template std::size_t device_state_bytes<3>(Format, int, int, KernelVariant);
template int initial_extra_capacity<3>(int);

}    // namespace rve
