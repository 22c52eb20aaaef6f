#include "rve/engine/batch_engine.h"

#include "rve/algorithm/rigid_turn.h"
#include "rve/algorithm/system_view.h"
#include "rve/block/block_serial.h"
#include "rve/core/error.h"
#include "rve/core/threads.h"
#include "rve/engine/program_scenes.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <map>
#include <numeric>
#include <omp.h>
#include <type_traits>

namespace rve {

namespace {

  /// A call is repeated with a coarser force scale this often, by 16 each time, before the RVE fails: 16^8 covers any guess.
  constexpr int MAX_REPEATS = 8;

  /// Coordinates of the state are 64-bit fractions; `fast` keeps the leading half.
  std::uint32_t narrow(std::uint64_t s, std::uint32_t)
  {
    return static_cast<std::uint32_t>(s >> 32);
  }
  std::uint64_t narrow(std::uint64_t s, std::uint64_t)
  {
    return s;
  }
  FloatFraction narrow(std::uint64_t s, FloatFraction)
  {
    return wrapped(static_cast<float>(std::ldexp(static_cast<double>(s), -64)));
  }
  std::uint64_t widen(FloatFraction s)
  {
    return static_cast<std::uint64_t>(std::ldexp(static_cast<double>(s.value), 64));
  }
  std::uint64_t widen(std::uint32_t s)
  {
    return static_cast<std::uint64_t>(s) << 32;
  }
  std::uint64_t widen(std::uint64_t s)
  {
    return s;
  }

  void copy_tensor(const Tensor2 &from, double *to)
  {
    std::copy_n(from.component, 4, to);
  }

  Tensor2 tensor_from(const double *from)
  {
    Tensor2 t;
    std::copy_n(from, 4, t.component);
    return t;
  }

  /// More neighbours than 2^8 would let the two limbs of a sum in `double` overflow.
  constexpr int LARGEST_NEIGHBOR_BITS = 8;

  /// Bits for the number of the smallest grains that touch the largest one: pi / asin(r / (r + R)) stand
  /// side by side, and a fifth more where overlaps bring them closer. At most one more than are allowed.
  int neighbor_bits(double smallest_radius, double largest_radius)
  {
    const double side_by_side =
        3.14159265358979323846 / std::asin(smallest_radius / (smallest_radius + largest_radius));
    // the number is infinite where the quotient of the radii underflows
    return static_cast<int>(
        std::fmin(std::ceil(std::log2(1.2 * side_by_side)), LARGEST_NEIGHBOR_BITS + 1));
  }

  bool is_viscous(const Material &material)
  {
    return material.normal_viscosity > 0.0 || material.tangential_viscosity > 0.0;
  }

  /// Largest number that a contact may add to a sum of forces or torques, over its normal force: |f| = sqrt(1 + mu^2) f_n, or the moment
  /// (a mu + R mu_r) f_n. In internal units an arm a is below 1/2 and the reduced radius R below 1/4.
  double possible_obliquity(const Material &material)
  {
    const double force = std::sqrt(1.0 + material.friction * material.friction);
    const double moment = 0.5 * material.friction + 0.25 * material.rolling_friction;
    return resists_rolling(material) ? std::max(force, moment) : force;
  }

  /// Up to this obliquity, of friction 10, room for all that friction could do costs the sums less than four bits. Beyond it they
  /// would have few left for the forces that are there.
  const double LARGEST_OBLIQUITY = std::sqrt(1.0 + 10.0 * 10.0);

  /// Whether all forces count for the unit of forces, not the normal one and what friction could add to it.
  bool all_forces_count(const Material &material)
  {
    return possible_obliquity(material) > LARGEST_OBLIQUITY;
  }

  /// The bound over the force that counts. Over the largest of f_n, f_t and f_r/2, |f| is at most sqrt(2), and a moment 1/2 + 2/4.
  double obliquity_of(const Material &material)
  {
    return all_forces_count(material) ? std::sqrt(2.0) : possible_obliquity(material);
  }

  void set_material_in(ImageHeader &header, const Material &material)
  {
    header.normal_stiffness = material.normal_stiffness;
    header.tangential_stiffness = material.tangential_stiffness;
    header.friction = material.friction;
    header.rolling_stiffness = material.rolling_stiffness;
    header.rolling_friction = material.rolling_friction;
    header.density = material.density;
    header.local_damping = material.local_damping;
    header.normal_viscosity = material.normal_viscosity;
    header.tangential_viscosity = material.tangential_viscosity;
    header.thickness = material.thickness;
    header.mass_depth = material.mass_depth;
    header.obliquity = obliquity_of(material);
    header.inverse_obliquity = 1.0 / header.obliquity;
    header.all_forces_count = all_forces_count(material) ? 1 : 0;
  }

  /// Grain numbers row by row, each row along x: a grain's neighbours have numbers near its own, or near those of its row above.
  std::vector<std::int32_t> storage_order(const RveState &state)
  {
    const int n = state.num_grains();
    const double rows = std::max(1.0, std::floor(0.75 * std::sqrt(static_cast<double>(n))));
    const double to_row = rows / 18446744073709551616.0;
    std::vector<std::int32_t> order(n);
    std::iota(order.begin(), order.end(), 0);
    const auto row = [&](int i) {
      return static_cast<int>(static_cast<double>(state.fractional[2 * i + 1]) * to_row);
    };
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
      const int row_a = row(a), row_b = row(b);
      return row_a != row_b ? row_a < row_b : state.fractional[2 * a] < state.fractional[2 * b];
    });
    return order;
  }

  /// What an image has of the history of a pair.
  template <class Scene> typename Scene::History stored_history(const Pair &pair)
  {
    using Spring = typename Scene::Spring;
    const Spring tangential = static_cast<Spring>(pair.tangential_force);
    if constexpr (Scene::has_rolling)
      return {tangential, static_cast<Spring>(pair.rolling_force)};
    else
      return tangential;
  }

  /// A pair with the history that an image has of it.
  template <class History> Pair pair_of(int first, int second, const History &history)
  {
    Pair pair{first, second, 0.0};
    // a zero has no sign there
    if constexpr (std::is_arithmetic_v<History>) {
      pair.tangential_force = static_cast<double>(history) + 0.0;
    } else {
      pair.tangential_force = static_cast<double>(history.tangential) + 0.0;
      pair.rolling_force = static_cast<double>(history.rolling) + 0.0;
    }
    return pair;
  }

  template <class Scene> StateImage build(const RveState &state, int extra_capacity)
  {
    const int n = state.num_grains();
    std::vector<int> owned(n, 0);
    int num_extra = 0;
    for (const Pair &pair : state.pairs)
      if (owned[pair.first] < kOwnedPairs)
        ++owned[pair.first];
      else
        ++num_extra;

    StateImage image;
    image.num_grains = n;
    image.extra_capacity = std::max(extra_capacity, num_extra);
    image.rolling = Scene::has_rolling;
    image.bytes.assign(image_size<Scene>(n, image.extra_capacity), 0);
    const auto view = carve_image<Scene>(image.bytes.data(), n, image.extra_capacity);

    ImageHeader &header = *view.header;
    header = ImageHeader();
    header.num_grains = n;
    header.extra_capacity = image.extra_capacity;
    header.list_valid = !state.list_fractional.empty();
    copy_tensor(state.cell, header.cell);
    copy_tensor(state.deformation, header.deformation);
    copy_tensor(header.list_valid ? state.list_cell : state.cell, header.list_cell);
    copy_tensor(state.servo_velocity_gradient, header.servo_velocity_gradient);
    set_material_in(header, state.material);
    // of the radii as the image has them: that of its state is the same again
    RveState stored;
    for (double r : state.radius) stored.radius.push_back(static_cast<typename Scene::Wide>(r));
    const auto [smallest, largest] =
        std::minmax_element(stored.radius.begin(), stored.radius.end());
    header.largest_radius = *largest;
    double sum = 0.0;
    for (double r : stored.radius) sum += r;
    header.mean_radius = sum / n;
    header.solid_area = stored.solid_area();
    header.neighbor_bits = neighbor_bits(*smallest, *largest);
    header.largest_contact_force = state.largest_contact_force;
    header.steps = state.counters.steps;
    header.rebuilds = state.counters.rebuilds;
    header.lattice_reductions = state.counters.lattice_reductions;
    header.repeats = state.counters.repeats;
    header.work = state.energy.work;
    header.friction_loss = state.energy.friction;
    header.damping_loss = state.energy.local_damping;
    header.viscous_loss = state.energy.viscous;

    using Coordinate = typename Scene::Coordinate;
    using Real = typename Scene::Real;
    const auto &list = header.list_valid ? state.list_fractional : state.fractional;
    const std::vector<std::int32_t> order = state.order.empty() ? storage_order(state)
                                                                : state.order;
    std::vector<int> place(n);    // of a grain number
    for (int k = 0; k < n; ++k) {
      const int i = order[k];
      place[i] = k;
      view.number[k] = i;
      for (int a = 0; a < 2; ++a) {
        view.position[k][a] = narrow(state.fractional[2 * i + a], Coordinate());
        view.list_position[k][a] = static_cast<std::uint32_t>(list[2 * i + a] >> 32);
        view.velocity[k][a] = static_cast<Real>(state.velocity[2 * i + a]);
      }
      view.spin[k] = static_cast<Real>(state.spin[i]);
      view.radius[k] = static_cast<typename Scene::Wide>(state.radius[i]);
      for (int m = 0; m < kOwnedPairs; ++m) view.partner[m * n + k] = k;
      owned[k] = 0;
    }
    for (const Pair &pair : state.pairs) {
      const int first = place[pair.first], second = place[pair.second];
      if (owned[first] < kOwnedPairs) {
        const int slot = owned[first]++ * n + first;
        view.partner[slot] = second;
        view.history[slot] = stored_history<Scene>(pair);
      } else {
        view.extra_first[header.num_extra] = first;
        view.extra_second[header.num_extra] = second;
        view.extra_history[header.num_extra] = stored_history<Scene>(pair);
        ++header.num_extra;
      }
    }
    return image;
  }

  template <class Scene> RveState read(const StateImage &image)
  {
    const int n = image.num_grains;
    const auto view =
        carve_image<Scene>(const_cast<char *>(image.bytes.data()), n, image.extra_capacity);
    const ImageHeader &header = *view.header;
    RveState state;
    state.material.normal_stiffness = header.normal_stiffness;
    state.material.tangential_stiffness = header.tangential_stiffness;
    state.material.friction = header.friction;
    state.material.rolling_stiffness = header.rolling_stiffness;
    state.material.rolling_friction = header.rolling_friction;
    state.material.density = header.density;
    state.material.local_damping = header.local_damping;
    state.material.normal_viscosity = header.normal_viscosity;
    state.material.tangential_viscosity = header.tangential_viscosity;
    state.material.thickness = header.thickness;
    state.material.mass_depth = header.mass_depth;
    state.cell = tensor_from(header.cell);
    state.deformation = tensor_from(header.deformation);
    state.servo_velocity_gradient = tensor_from(header.servo_velocity_gradient);
    state.largest_contact_force = header.largest_contact_force;
    state.counters = {header.steps, header.rebuilds, header.lattice_reductions, header.repeats};
    state.energy = {header.work, header.friction_loss, header.damping_loss, header.viscous_loss};
    state.radius.resize(n);
    state.fractional.resize(2 * n);
    state.velocity.resize(2 * n);
    state.spin.resize(n);
    if (header.list_valid) {
      state.list_cell = tensor_from(header.list_cell);
      state.list_fractional.resize(2 * n);
    }
    state.order.assign(view.number, view.number + n);
    for (int k = 0; k < n; ++k) {
      const int i = view.number[k];
      for (int a = 0; a < 2; ++a) {
        state.fractional[2 * i + a] = widen(view.position[k][a]);
        state.velocity[2 * i + a] = view.velocity[k][a];
        if (header.list_valid) state.list_fractional[2 * i + a] = widen(view.list_position[k][a]);
      }
      state.spin[i] = view.spin[k];
      state.radius[i] = view.radius[k];
      for (int m = 0; m < kOwnedPairs; ++m)
        if (view.partner[m * n + k] != k)
          state.pairs.push_back(
              pair_of(i, view.number[view.partner[m * n + k]], view.history[m * n + k]));
    }
    for (int m = 0; m < header.num_extra; ++m)
      state.pairs.push_back(pair_of(view.number[view.extra_first[m]],
                                    view.number[view.extra_second[m]], view.extra_history[m]));
    return state;
  }

  template <class Scene> void turn(StateImage &image, const Tensor2 &rotation)
  {
    BlockSerial block;
    turn_image(block,
               carve_image<Scene>(image.bytes.data(), image.num_grains, image.extra_capacity),
               rotation);
  }

  /// Segments of a macro increment that rotates by `angle`: at most 0.01 rad each, so that the chord through the rotation
  /// loses at most 2.5e-5 of the area on its way.
  constexpr double LARGEST_TURN = 0.01;
  int path_segments(double angle)
  {
    return std::max(1, static_cast<int>(std::ceil(std::fabs(angle) / LARGEST_TURN)));
  }

  bool finite(const Tensor2 &t)
  {
    return std::all_of(t.component, t.component + 4, [](double x) {
      return std::isfinite(x);
    });
  }

  /// Of the settings of a servo: what follows from them are numbers.
  constexpr double SMALLEST = 1e-30, LARGEST = 1e30;

  /// Throws unless the drive makes sense.
  void check(const Drive &drive)
  {
    require(drive.substeps >= 0, [&] {
      return "substeps must be 0 or more, got " + std::to_string(drive.substeps);
    });
    require(drive.substeps == 0 || (std::isfinite(drive.dt) && drive.dt > 0.0), [&] {
      return "DEM time step must be positive and finite, got " + number(drive.dt) + " [time]";
    });
    require(!drive.controlled[1][0],
            "the stress servo controls xx, xy and yy; component yx cannot be controlled");
    if (drive.has_servo()) {
      require(finite(drive.velocity_gradient),
              "velocity gradient has a component that is not a finite number [1/time]");
      require(finite(drive.stress_goal),
              "stress goal has a component that is not a finite number [stress]");
      require(drive.servo_gain >= SMALLEST && drive.servo_gain <= LARGEST, [&] {
        return "servo gain must be positive, from 1e-30 to 1e30, got " + number(drive.servo_gain) +
            " [1/(stress time^2)]";
      });
      require(drive.servo_max_rate >= SMALLEST && drive.servo_max_rate <= LARGEST, [&] {
        return "largest servo rate must be positive, from 1e-30 to 1e30, got " +
            number(drive.servo_max_rate) + " [1/time]";
      });
    } else {
      const Tensor2 &f = drive.deformation;
      require(finite(f), "deformation increment has a component that is not a finite number");
      require(determinant(f) > 0.0, [&] {
        return "deformation increment must keep a positive area, its determinant is " +
            number(determinant(f));
      });
    }
  }

  /// Whether a drive needs a SteeringRecord: for a servo, or to turn the RVE in several segments.
  bool needs_steering(const Drive &drive)
  {
    const Tensor2 &f = drive.deformation;
    const double twice_cosine = f(0, 0) + f(1, 1), twice_sine = f(1, 0) - f(0, 1);
    return drive.has_servo() || !(std::fabs(twice_sine) < LARGEST_TURN * twice_cosine);
  }

  /// Of a path in one segment.
  DriveRecord to_record(const Drive &drive)
  {
    DriveRecord record;
    record.dt = drive.dt;
    record.substeps = drive.substeps;
    record.segments = 1;
    copy_tensor(drive.deformation, record.deformation);
    return record;
  }

  /// What a drive that needs steering has beyond its DriveRecord; sets the number of segments there.
  SteeringRecord to_steering(const Drive &drive, DriveRecord &record)
  {
    SteeringRecord steering = SteeringRecord();
    if (drive.has_servo()) {
      for (int a = 0; a < 2; ++a)
        for (int b = 0; b < 2; ++b) steering.controlled[2 * a + b] = drive.controlled[a][b];
      copy_tensor(drive.stress_goal, steering.stress_goal);
      copy_tensor(drive.velocity_gradient, steering.velocity_gradient);
      steering.servo_gain = drive.servo_gain;
      steering.servo_max_rate = drive.servo_max_rate;
      return steering;
    }
    // polar decomposition F = R U in the plane
    const Tensor2 &f = drive.deformation;
    const double angle = std::atan2(f(1, 0) - f(0, 1), f(0, 0) + f(1, 1));
    record.segments = path_segments(angle);
    Tensor2 rotation = Tensor2::identity(), back;
    const double part = angle / record.segments;
    rotation(0, 0) = rotation(1, 1) = std::cos(part);
    rotation(1, 0) = std::sin(part);
    rotation(0, 1) = -rotation(1, 0);
    back(0, 0) = back(1, 1) = std::cos(angle);
    back(0, 1) = std::sin(angle);
    back(1, 0) = -back(0, 1);
    copy_tensor(rotation, steering.rotation);
    copy_tensor(back * f - Tensor2::identity(), steering.stretch);
    return steering;
  }

  /// Whether a call did not succeed for a reason that the engine can mend.
  bool must_repeat(const AnswerRecord &answer)
  {
    return (answer.status & (status::ListFull | status::ForceSaturated)) != 0;
  }

  /// Threads that may translate between the caller and the RVEs.
  int helpers(const Options &options)
  {
    return options.threads > 0 ? options.threads : omp_get_max_threads();
  }

  void to_result(const AnswerRecord &answer, const DetailRecord &record, Result &result)
  {
    const ImageProgress &after = record.progress;
    result = Result();
    result.status = answer.status;
    result.stress = tensor_from(answer.stress);
    result.fabric = tensor_from(record.fabric);
    result.cell = tensor_from(after.cell);
    result.deformation = tensor_from(after.deformation);
    result.servo_velocity_gradient = tensor_from(after.servo_velocity_gradient);
    const int n = record.num_grains, contacts = record.num_contacts;
    result.num_grains = n;
    result.num_contacts = contacts;
    result.num_pairs = record.num_pairs;
    result.num_rattlers = record.num_rattlers;
    result.void_ratio = determinant(result.cell) / record.solid_area - 1.0;
    result.coordination_number = 2.0 * contacts / n;
    const int carrying =
        n - record.num_rattlers;    // Thornton: contacts of grains with a single one do not count
    result.mechanical_coordination_number =
        carrying > 0 ? (2.0 * contacts - record.num_single) / carrying : 0.0;
    result.sliding_fraction = contacts > 0 ? static_cast<double>(record.num_sliding) / contacts
                                           : 0.0;
    result.unbalanced_ratio = record.contact_force_sum > 0.0
        ? (record.grain_force_sum / n) / (record.contact_force_sum / contacts)
        : 0.0;
    result.kinetic_energy = record.kinetic_energy;
    result.elastic_energy = record.elastic_energy;
    result.largest_overlap = record.largest_overlap;
    result.mean_overlap = contacts > 0 ? record.overlap_sum / contacts : 0.0;
    result.largest_contact_force = record.largest_contact_force;
    result.counters = {after.steps, after.rebuilds, after.lattice_reductions, after.repeats};
    result.energy = {after.work, after.friction_loss, after.damping_loss, after.viscous_loss};
  }

  void to_result(const AnswerRecord &answer, const DetailRecord &record, ElasticResult &result)
  {
    to_result(answer, record, result.result);
    static_assert(sizeof(result.stiffness.component) == sizeof(record.stiffness), "all of it");
    std::memcpy(result.stiffness.component, record.stiffness, sizeof(record.stiffness));
  }

  /// Of an RVE whose call failed: as it was before.
  DetailRecord details_of(const ImageHeader &header)
  {
    DetailRecord record = DetailRecord();
    record.num_grains = header.num_grains;
    record.solid_area = header.solid_area;
    record.progress = header;
    return record;
  }

  template <class Numbers, class Work> auto with_rolling(bool rolling, const Work &work)
  {
    return rolling ? work(ProgramScene<Program::Rolling, Numbers>())
                   : work(ProgramScene<Program::General, Numbers>());
  }

  /// work(a scene), in numbers as `format` says, whose pairs remember what images hold.
  template <class Work> auto with_scene(Format format, bool rolling, const Work &work)
  {
    switch (format) {
      case Format::Fast:
        return with_rolling<FastNumbers>(rolling, work);
      case Format::Mixed:
        return with_rolling<MixedNumbers>(rolling, work);
      case Format::Single:
        return with_rolling<SingleNumbers>(rolling, work);
      default:
        return with_rolling<DoubleNumbers>(rolling, work);
    }
  }

  BatchConstants to_constants(const Options &options)
  {
    require(std::isfinite(options.skin) && options.skin >= 0.0,
            "skin must be 0 (automatic) or positive, got " + number(options.skin) + " [length]");
    require(options.overlap_limit > 0.0 && options.overlap_limit < 1.0,
            "overlap limit must be in (0, 1), got " + number(options.overlap_limit));
    require(options.threads >= 0,
            "threads must be 0 (automatic) or more, got " + std::to_string(options.threads));
    require_threads(helpers(options));
    return {options.skin, options.overlap_limit, options.arms == Arms::Contact ? 0.5 : 0.0,
            options.track_energy ? 1 : 0, 0};
  }

}    // namespace

StateImage build_image(Format format, const RveState &state, int extra_capacity, bool rolling)
{
  return with_scene(format, rolling, [&](auto scene) {
    return build<decltype(scene)>(state, extra_capacity);
  });
}

RveState read_image(Format format, const StateImage &image)
{
  return with_scene(format, image.rolling, [&](auto scene) {
    return read<decltype(scene)>(image);
  });
}

void turn_image(Format format, StateImage &image, const Tensor2 &rotation)
{
  with_scene(format, image.rolling, [&](auto scene) {
    turn<decltype(scene)>(image, rotation);
  });
}

std::size_t image_bytes(Format format, int num_grains, int extra_capacity, bool rolling)
{
  return with_scene(format, rolling, [&](auto scene) {
    return image_size<decltype(scene)>(num_grains, extra_capacity);
  });
}

int initial_extra_capacity(int num_grains)
{
  return num_grains / 16 + 8;
}

BatchEngine::BatchEngine(const Options &options_in) :
    options(options_in), constants(to_constants(options_in))
{
}

int BatchEngine::add(const RveState &state)
{
  state.check();
  const auto [smallest, largest] = std::minmax_element(state.radius.begin(), state.radius.end());
  require(neighbor_bits(*smallest, *largest) <= LARGEST_NEIGHBOR_BITS,
          "the largest grain must be at most 60 times as large as the smallest, got " +
              number(*largest / *smallest));
  if (state.needs_rolling_forces()) expect_rolling_resistance();
  const int n = state.num_grains();
  const bool is_new = free_numbers.empty();
  const int rve = is_new ? static_cast<int>(grains_of.size()) : free_numbers.back();
  put_image(rve,
            build_image(options.format, state, initial_extra_capacity(n),
                        rolling));    // may find no memory
  if (is_new) {
    grains_of.push_back(n);
  } else {
    free_numbers.pop_back();
    grains_of[rve] = n;
  }
  any_viscous = any_viscous || is_viscous(state.material);
  any_large_friction = any_large_friction || all_forces_count(state.material);
  any_friction = any_friction || state.material.friction > 0.0 ||
      std::any_of(state.pairs.begin(), state.pairs.end(), [](const Pair &pair) {
                   return pair.tangential_force != 0.0;
                 });
  return rve;
}

void BatchEngine::remove(int rve)
{
  check_slot(rve);
  drop_image(rve);
  grains_of[rve] = 0;
  free_numbers.push_back(rve);
}

int BatchEngine::size() const
{
  return static_cast<int>(grains_of.size() - free_numbers.size());
}

RveState BatchEngine::state(int rve) const
{
  check_slot(rve);
  return read_image(options.format, get_image(rve));
}

void BatchEngine::set_material(int rve, const Material &material)
{
  check_slot(rve);
  RveState probe = state(rve);
  probe.material = material;
  probe.check();
  if (resists_rolling(material)) expect_rolling_resistance();
  ImageHeader header = get_header(rve);
  set_material_in(header, material);
  put_header(rve, header);
  any_viscous = any_viscous || is_viscous(material);
  any_large_friction = any_large_friction || all_forces_count(material);
  any_friction = any_friction || material.friction > 0.0;
}

void BatchEngine::turn(const std::vector<int> &rves, const std::vector<Tensor2> &rotations)
{
  require(rves.size() == rotations.size(),
          "one rotation per RVE is needed: " + std::to_string(rves.size()) + " RVEs, " +
              std::to_string(rotations.size()) + " rotations");
  for (std::size_t k = 0; k < rves.size(); ++k) {
    check_slot(rves[k]);
    const Tensor2 &r = rotations[k];
    const Tensor2 error = transpose(r) * r - Tensor2::identity();
    require(std::all_of(error.component, error.component + 4,
                        [](double x) {
                          return std::fabs(x) < 1e-12;
                        }) &&
                determinant(r) > 0.0,
            "an RVE can be turned by a rotation only, and the tensor is none");
  }
  if (!rves.empty()) turn_images(rves, rotations);
}

void BatchEngine::expect_rolling_resistance()
{
  if (rolling) return;
  try {
    lay_out_images(true);
  } catch (...) {    // no memory: all as it was, in pieces that are free now
    lay_out_images(false);
    throw;
  }
  rolling = true;
}

void BatchEngine::lay_out_images(bool with_rolling)
{
  for (int rve = 0; rve < static_cast<int>(grains_of.size()); ++rve) {
    if (grains_of[rve] == 0) continue;
    const StateImage old = get_image(rve);
    if (old.rolling == with_rolling) continue;
    const StateImage fresh = build_image(options.format, read_image(options.format, old),
                                         old.extra_capacity, with_rolling);
    drop_image(rve);
    try {
      put_image(rve, fresh);
    } catch (...) {
      put_image(rve, old);
      throw;
    }
  }
}

std::size_t BatchEngine::bytes_per_rve(int num_grains) const
{
  return image_bytes(options.format, num_grains, initial_extra_capacity(num_grains), rolling);
}

Memory BatchEngine::memory() const
{
  Memory memory = backend_memory();
  const char *word = std::getenv("GPU_RVE_MEMORY_LIMIT");
  if (!word || !*word) return memory;
  char *end = nullptr;
  const double limit = std::strtod(word, &end);
  // beyond 2^53 a double does not count single bytes any more
  require(*end == '\0' && limit >= 0.0 && limit <= 9007199254740992.0,
          "GPU_RVE_MEMORY_LIMIT in the environment must be a number of bytes in [0, 2^53], got " +
              std::string(word));
  const std::size_t bytes = static_cast<std::size_t>(limit);
  memory.free = memory.is_known ? std::min(memory.free, bytes) : bytes;
  memory.is_known = true;
  return memory;
}

void BatchEngine::check_slot(int rve) const
{
  require(rve >= 0 && rve < static_cast<int>(grains_of.size()) && grains_of[rve] > 0, [&] {
    return "there is no RVE with number " + std::to_string(rve);
  });
}

void BatchEngine::prepare_repeat(int rve, const AnswerRecord &result)
{
  ImageHeader header = get_header(rve);
  ++header.repeats;
  if (result.status & status::ForceSaturated)
    header.largest_contact_force = 16.0 * result.expected_force;
  put_header(rve, header);
  if (result.needed_extra > header.extra_capacity) {
    const StateImage old = get_image(rve);
    const RveState state = read_image(options.format, old);
    drop_image(rve);
    put_image(rve,
              build_image(options.format, state, result.needed_extra + result.needed_extra / 4 + 8,
                          rolling));
  }
  pairs_per_grain = std::max(pairs_per_grain,
                             (result.needed_pairs + result.needed_pairs / 4) / grains_of[rve] + 1);
}

void BatchEngine::prepare(Call &call, const std::vector<int> &rves,
                          const std::vector<Drive> &drives)
{
  const int count = static_cast<int>(rves.size());
  DriveRecord *records = room_for_drives(count);
  call.rves = &rves;
  call.drives = records;
  int first_bad = count, largest = 0, longest = 0;
  double least_cost = std::numeric_limits<double>::max(), most_cost = 0.0;
  bool servo = false, steered = false;
  {
    const LightWork work(count, helpers(options));
#pragma omp parallel for num_threads(work.team) reduction(min                      \
                                                          : first_bad, least_cost) \
    reduction(max                                                                  \
              : largest, longest, most_cost) reduction(||                          \
                                                       : servo, steered)
    for (int k = 0; k < count; ++k) {
      try {
        check_slot(rves[k]);
        check(drives[k]);
      } catch (const InputError &) {
        first_bad = std::min(first_bad, k);
        continue;
      }
      records[k] = to_record(drives[k]);
      largest = std::max(largest, grains_of[rves[k]]);
      longest = std::max(longest, drives[k].substeps);
      const double cost = cost_of(rves[k], drives[k]);
      least_cost = std::min(least_cost, cost);
      most_cost = std::max(most_cost, cost);
      servo = servo || drives[k].has_servo();
      steered = steered || needs_steering(drives[k]);
    }
  }
  if (first_bad < count) {    // says what is wrong
    check_slot(rves[first_bad]);
    check(drives[first_bad]);
  }
  if (steered) {
    call.steering.resize(count);
    for (int k = 0; k < count; ++k) call.steering[k] = to_steering(drives[k], records[k]);
  }
  call.largest = largest;
  call.longest = longest;
  call.pair_capacity = pair_capacity(largest);
  const bool general = servo || options.track_energy || any_viscous || any_large_friction ||
      options.arms == Arms::Lammps;
  call.program = rolling ? Program::Rolling
      : general          ? Program::General
      : any_friction     ? Program::Plain
                         : Program::Frictionless;
  if (least_cost < most_cost) put_longest_first(call, drives, most_cost);
}

double BatchEngine::cost_of(int rve, const Drive &drive) const
{
  return static_cast<double>(drive.substeps) * grains_of[rve];
}

void BatchEngine::put_longest_first(Call &call, const std::vector<Drive> &drives,
                                    double most_cost) const
{
  // sorted roughly, in one pass: the last ones to run are short, and that is all that matters
  constexpr int classes = 256;
  const int count = static_cast<int>(call.rves->size());
  const auto class_of = [&](int k) {
    const double share = cost_of((*call.rves)[k], drives[k]) / most_cost;
    return classes - 1 - static_cast<int>(share * (classes - 1));
  };
  std::vector<int> start(classes + 1, 0);
  for (int k = 0; k < count; ++k) ++start[class_of(k) + 1];
  std::partial_sum(start.begin(), start.end(), start.begin());
  call.order.resize(count);
  for (int k = 0; k < count; ++k) call.order[start[class_of(k)]++] = k;
}

const AnswerRecord *BatchEngine::start(const std::vector<int> &rves,
                                       const std::vector<Drive> &drives, Answer kind)
{
  require(rves.size() == drives.size(),
          "one drive per RVE is needed: " + std::to_string(rves.size()) + " RVEs, " +
              std::to_string(drives.size()) + " drives");
  if (rves.empty()) return nullptr;
  Call call;
  prepare(call, rves, drives);
  call.with_details = kind != Answer::Short;
  call.constants = constants;
  if (kind == Answer::Longest) call.constants.extra_detail = kStiffnessDetail;
  if (kind == Answer::TimeStep) {
    call.constants.extra_detail = kTimeStepDetail;
    if (call.program != Program::Rolling) call.program = Program::General;
  }
  return launch(call, details);
}

const AnswerRecord *BatchEngine::repeat(const std::vector<int> &rves,
                                        const std::vector<Drive> &drives,
                                        const AnswerRecord *answers, Answer kind)
{
  const bool with_details = kind != Answer::Short;
  mended.assign(answers, answers + rves.size());
  std::vector<DetailRecord> all_details;    // `details` are those of the last start
  if (with_details) all_details = details;
  std::map<std::size_t, ImageHeader> before;    // of the RVEs whose call is repeated
  for (int round = 0; round < MAX_REPEATS; ++round) {
    std::vector<std::size_t> again;
    for (std::size_t k = 0; k < rves.size(); ++k)
      if (must_repeat(mended[k])) again.push_back(k);
    if (again.empty()) break;
    std::vector<int> some_rves;
    std::vector<Drive> some_drives;
    for (std::size_t k : again) {
      before.emplace(k, get_header(rves[k]));
      prepare_repeat(rves[k], mended[k]);
      some_rves.push_back(rves[k]);
      some_drives.push_back(drives[k]);
    }
    const AnswerRecord *some_answers = start(some_rves, some_drives, kind);
    for (std::size_t m = 0; m < again.size(); ++m) {
      mended[again[m]] = some_answers[m];
      if (with_details) all_details[again[m]] = details[m];
    }
  }
  if (with_details) details = std::move(all_details);

  // a call that fails in the end leaves no trace of its repeats either
  for (const auto &[k, first] : before) {
    if (!(mended[k].status & status::Fatal)) continue;
    ImageHeader header = get_header(rves[k]);
    header.repeats = first.repeats;
    header.largest_contact_force = first.largest_contact_force;
    put_header(rves[k], header);
  }
  return mended.data();
}

template <class AnyResult>
void BatchEngine::advance_with_details(const std::vector<int> &rves,
                                       const std::vector<Drive> &drives, Answer kind,
                                       std::vector<AnyResult> &results)
{
  const AnswerRecord *answers = start(rves, drives, kind);
  const int count = static_cast<int>(rves.size());
  if (std::any_of(answers, answers + count, must_repeat))
    answers = repeat(rves, drives, answers, kind);
  for (int k = 0; k < count; ++k)
    if (answers[k].status & status::Fatal) details[k] = details_of(get_header(rves[k]));
  results.resize(count);
  const LightWork work(count, helpers(options));
#pragma omp parallel for num_threads(work.team)
  for (int k = 0; k < count; ++k) to_result(answers[k], details[k], results[k]);
}

void BatchEngine::advance(const std::vector<int> &rves, const std::vector<Drive> &drives,
                          std::vector<Result> &results)
{
  advance_with_details(rves, drives, Answer::Long, results);
}

void BatchEngine::advance(const std::vector<int> &rves, const std::vector<Drive> &drives,
                          std::vector<ElasticResult> &results)
{
  advance_with_details(rves, drives, Answer::Longest, results);
}

void BatchEngine::bound_time_steps(const std::vector<int> &rves, double enough,
                                   std::vector<double> &bounds)
{
  require(std::isfinite(enough) && enough > 0.0,
          "a sufficient time step must be positive and finite, got " + number(enough) + " [time]");
  Drive look;
  look.dt = enough;
  const std::vector<Drive> drives(rves.size(), look);
  const AnswerRecord *answers = start(rves, drives, Answer::TimeStep);
  const std::size_t count = rves.size();
  if (std::any_of(answers, answers + count, must_repeat))
    answers = repeat(rves, drives, answers, Answer::TimeStep);
  bounds.resize(count);
  for (std::size_t k = 0; k < count; ++k)
    bounds[k] = answers[k].status & status::Fatal ? 0.0 : details[k].stiffness[0];
}

void BatchEngine::advance(const std::vector<int> &rves, const std::vector<Drive> &drives,
                          std::vector<Response> &responses)
{
  const AnswerRecord *answers = start(rves, drives, Answer::Short);
  const int count = static_cast<int>(rves.size());
  responses.resize(count);
  const auto respond = [&] {
    bool unfinished = false;
    const LightWork work(count, helpers(options));
#pragma omp parallel for num_threads(work.team) reduction(|| : unfinished)
    for (int k = 0; k < count; ++k) {
      responses[k] = {answers[k].status, answers[k].num_contacts, tensor_from(answers[k].stress)};
      unfinished = unfinished || must_repeat(answers[k]);
    }
    return unfinished;
  };
  if (!respond()) return;
  answers = repeat(rves, drives, answers, Answer::Short);
  respond();
}

}    // namespace rve
