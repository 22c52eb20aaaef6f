#include "rve/engine/batch_engine.h"

#include "rve/algorithm/system_view.h"
#include "rve/core/error.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>

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

  /// Bits for the number of the smallest grains that touch the largest one: pi / asin(r / (r + R)) stand
  /// side by side, and a fifth more where overlaps bring them closer.
  int neighbor_bits(double smallest_radius, double largest_radius)
  {
    const double side_by_side =
        3.14159265358979323846 / std::asin(smallest_radius / (smallest_radius + largest_radius));
    return static_cast<int>(std::ceil(std::log2(1.2 * side_by_side)));
  }

  bool is_viscous(const Material &material)
  {
    return material.normal_viscosity > 0.0 || material.tangential_viscosity > 0.0;
  }

  void set_material_in(ImageHeader &header, const Material &material)
  {
    header.normal_stiffness = material.normal_stiffness;
    header.tangential_stiffness = material.tangential_stiffness;
    header.friction = material.friction;
    header.density = material.density;
    header.local_damping = material.local_damping;
    header.normal_viscosity = material.normal_viscosity;
    header.tangential_viscosity = material.tangential_viscosity;
    header.thickness = material.thickness;
    header.mass_depth = material.mass_depth;
  }

  template <class NumberFormat> StateImage build(const RveState &state, int extra_capacity)
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
    std::size_t size;
    carve_image<NumberFormat>(nullptr, n, image.extra_capacity, &size);
    image.bytes.assign(size, 0);
    const auto view = carve_image<NumberFormat>(image.bytes.data(), n, image.extra_capacity);

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
    header.largest_radius = *std::max_element(state.radius.begin(), state.radius.end());
    double sum = 0.0;
    for (double r : state.radius) sum += r;
    header.mean_radius = sum / n;
    header.solid_area = state.solid_area();
    header.neighbor_bits = neighbor_bits(
        *std::min_element(state.radius.begin(), state.radius.end()), header.largest_radius);
    header.largest_contact_force = state.largest_contact_force;
    header.steps = state.counters.steps;
    header.rebuilds = state.counters.rebuilds;
    header.lattice_reductions = state.counters.lattice_reductions;
    header.repeats = state.counters.repeats;
    header.work = state.energy.work;
    header.friction_loss = state.energy.friction;
    header.damping_loss = state.energy.local_damping;
    header.viscous_loss = state.energy.viscous;

    using Coordinate = typename NumberFormat::Coordinate;
    using Real = typename NumberFormat::Real;
    using History = typename NumberFormat::History;
    const auto &list = header.list_valid ? state.list_fractional : state.fractional;
    for (int i = 0; i < n; ++i) {
      for (int a = 0; a < 2; ++a) {
        view.position[i][a] = narrow(state.fractional[2 * i + a], Coordinate());
        view.list_position[i][a] = narrow(list[2 * i + a], Coordinate());
        view.velocity[i][a] = static_cast<Real>(state.velocity[2 * i + a]);
      }
      view.spin[i] = static_cast<Real>(state.spin[i]);
      view.radius[i] = static_cast<typename NumberFormat::Wide>(state.radius[i]);
      for (int k = 0; k < kOwnedPairs; ++k) view.partner[k * n + i] = i;
      owned[i] = 0;
    }
    for (const Pair &pair : state.pairs) {
      if (owned[pair.first] < kOwnedPairs) {
        const int slot = owned[pair.first]++ * n + pair.first;
        view.partner[slot] = pair.second;
        view.history[slot] = static_cast<History>(pair.tangential_force);
      } else {
        view.extra_first[header.num_extra] = pair.first;
        view.extra_second[header.num_extra] = pair.second;
        view.extra_history[header.num_extra] = static_cast<History>(pair.tangential_force);
        ++header.num_extra;
      }
    }
    return image;
  }

  template <class NumberFormat> RveState read(const StateImage &image)
  {
    const int n = image.num_grains;
    const auto view =
        carve_image<NumberFormat>(const_cast<char *>(image.bytes.data()), n, image.extra_capacity);
    const ImageHeader &header = *view.header;
    RveState state;
    state.material.normal_stiffness = header.normal_stiffness;
    state.material.tangential_stiffness = header.tangential_stiffness;
    state.material.friction = header.friction;
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
    for (int i = 0; i < n; ++i) {
      for (int a = 0; a < 2; ++a) {
        state.fractional[2 * i + a] = widen(view.position[i][a]);
        state.velocity[2 * i + a] = view.velocity[i][a];
        if (header.list_valid) state.list_fractional[2 * i + a] = widen(view.list_position[i][a]);
      }
      state.spin[i] = view.spin[i];
      state.radius[i] = view.radius[i];
      for (int k = 0; k < kOwnedPairs; ++k)
        if (view.partner[k * n + i] != i)
          state.pairs.push_back(
              {i, view.partner[k * n + i], static_cast<double>(view.history[k * n + i])});
    }
    for (int m = 0; m < header.num_extra; ++m)
      state.pairs.push_back(
          {view.extra_first[m], view.extra_second[m], static_cast<double>(view.extra_history[m])});
    return state;
  }

  /// Segments of a macro increment that rotates by `angle`: at most 0.01 rad each, so that the chord through the rotation
  /// loses at most 2.5e-5 of the area on its way.
  int path_segments(double angle)
  {
    return std::max(1, static_cast<int>(std::ceil(std::fabs(angle) / 0.01)));
  }

  bool finite(const Tensor2 &t)
  {
    return std::all_of(t.component, t.component + 4, [](double x) {
      return std::isfinite(x);
    });
  }

  DriveRecord to_record(const Drive &drive)
  {
    require(drive.substeps >= 0,
            "substeps must be 0 or more, got " + std::to_string(drive.substeps));
    require(drive.substeps == 0 || (std::isfinite(drive.dt) && drive.dt > 0.0),
            "DEM time step must be positive and finite, got " + number(drive.dt) + " [time]");
    require(!drive.controlled[1][0],
            "the stress servo controls xx, xy and yy; component yx cannot be controlled");
    DriveRecord record = DriveRecord();
    record.dt = drive.dt;
    record.substeps = drive.substeps;
    record.segments = 1;
    copy_tensor(Tensor2::identity(), record.deformation);
    copy_tensor(Tensor2::identity(), record.rotation);
    if (drive.has_servo()) {
      require(finite(drive.velocity_gradient),
              "velocity gradient has a component that is not a finite number [1/time]");
      require(finite(drive.stress_goal),
              "stress goal has a component that is not a finite number [stress]");
      require(std::isfinite(drive.servo_gain) && drive.servo_gain > 0.0,
              "servo gain must be positive, got " + number(drive.servo_gain) +
                  " [1/(stress time^2)]");
      require(std::isfinite(drive.servo_max_rate) && drive.servo_max_rate > 0.0,
              "largest servo rate must be positive, got " + number(drive.servo_max_rate) +
                  " [1/time]");
      for (int a = 0; a < 2; ++a)
        for (int b = 0; b < 2; ++b) record.controlled[2 * a + b] = drive.controlled[a][b];
      copy_tensor(drive.stress_goal, record.stress_goal);
      copy_tensor(drive.velocity_gradient, record.velocity_gradient);
      record.servo_gain = drive.servo_gain;
      record.servo_max_rate = drive.servo_max_rate;
      return record;
    }
    const Tensor2 &f = drive.deformation;
    require(finite(f), "deformation increment has a component that is not a finite number");
    require(determinant(f) > 0.0,
            "deformation increment must keep a positive area, its determinant is " +
                number(determinant(f)));
    // polar decomposition F = R U in the plane
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
    copy_tensor(f, record.deformation);
    copy_tensor(rotation, record.rotation);
    copy_tensor(back * f - Tensor2::identity(), record.stretch);
    return record;
  }

  Result to_result(const ResultRecord &record)
  {
    Result result;
    result.status = record.status;
    result.stress = tensor_from(record.stress);
    result.fabric = tensor_from(record.fabric);
    result.cell = tensor_from(record.cell);
    result.deformation = tensor_from(record.deformation);
    result.servo_velocity_gradient = tensor_from(record.servo_velocity_gradient);
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
    result.counters = {record.steps, record.rebuilds, record.lattice_reductions, record.repeats};
    result.energy = {record.work, record.friction_loss, record.damping_loss, record.viscous_loss};
    return result;
  }

  BatchConstants to_constants(const Options &options)
  {
    require(std::isfinite(options.skin) && options.skin >= 0.0,
            "skin must be 0 (automatic) or positive, got " + number(options.skin) + " [length]");
    require(options.overlap_limit > 0.0 && options.overlap_limit < 1.0,
            "overlap limit must be in (0, 1), got " + number(options.overlap_limit));
    require(options.threads >= 0,
            "threads must be 0 (automatic) or more, got " + std::to_string(options.threads));
    return {options.skin, options.overlap_limit, options.arms == Arms::Contact ? 0.5 : 0.0};
  }

}    // namespace

StateImage build_image(Format format, const RveState &state, int extra_capacity)
{
  switch (format) {
    case Format::Fast:
      return build<FastFormat>(state, extra_capacity);
    case Format::Mixed:
      return build<MixedFormat>(state, extra_capacity);
    default:
      return build<DoubleFormat>(state, extra_capacity);
  }
}

RveState read_image(Format format, const StateImage &image)
{
  switch (format) {
    case Format::Fast:
      return read<FastFormat>(image);
    case Format::Mixed:
      return read<MixedFormat>(image);
    default:
      return read<DoubleFormat>(image);
  }
}

std::size_t image_bytes(Format format, int num_grains, int extra_capacity)
{
  std::size_t size = 0;
  switch (format) {
    case Format::Fast:
      carve_image<FastFormat>(nullptr, num_grains, extra_capacity, &size);
      break;
    case Format::Mixed:
      carve_image<MixedFormat>(nullptr, num_grains, extra_capacity, &size);
      break;
    case Format::Double:
      carve_image<DoubleFormat>(nullptr, num_grains, extra_capacity, &size);
      break;
  }
  return size;
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
  int rve;
  if (free_numbers.empty()) {
    rve = static_cast<int>(grains_of.size());
    grains_of.push_back(0);
  } else {
    rve = free_numbers.back();
    free_numbers.pop_back();
  }
  put_image(rve, build_image(options.format, state, initial_extra_capacity(state.num_grains())));
  grains_of[rve] = state.num_grains();
  any_viscous = any_viscous || is_viscous(state.material);
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
  ImageHeader header = get_header(rve);
  set_material_in(header, material);
  put_header(rve, header);
  any_viscous = any_viscous || is_viscous(material);
}

SceneKind BatchEngine::scene() const
{
  if (options.track_energy) return SceneKind::Energy;
  return any_viscous ? SceneKind::Viscous : SceneKind::Plain;
}

std::size_t BatchEngine::bytes_per_rve(int num_grains) const
{
  return image_bytes(options.format, num_grains, initial_extra_capacity(num_grains));
}

void BatchEngine::check_slot(int rve) const
{
  require(rve >= 0 && rve < static_cast<int>(grains_of.size()) && grains_of[rve] > 0,
          "there is no RVE with number " + std::to_string(rve));
}

void BatchEngine::prepare_repeat(int rve, const ResultRecord &result)
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
    put_image(
        rve, build_image(options.format, state, result.needed_extra + result.needed_extra / 4 + 8));
  }
  pairs_per_grain = std::max(pairs_per_grain,
                             (result.needed_pairs + result.needed_pairs / 4) / grains_of[rve] + 1);
}

void BatchEngine::advance(const std::vector<int> &rves, const std::vector<Drive> &drives,
                          std::vector<Result> &results)
{
  require(rves.size() == drives.size(),
          "one drive per RVE is needed: " + std::to_string(rves.size()) + " RVEs, " +
              std::to_string(drives.size()) + " drives");
  std::vector<DriveRecord> records(rves.size());
  int largest = 0;
  for (std::size_t k = 0; k < rves.size(); ++k) {
    check_slot(rves[k]);
    records[k] = to_record(drives[k]);
    largest = std::max(largest, grains_of[rves[k]]);
  }
  std::vector<ResultRecord> answers(rves.size());
  if (!rves.empty()) launch(rves, records, largest, pairs_per_grain * largest, answers);

  std::map<std::size_t, ImageHeader> before;    // of the RVEs whose call is repeated
  for (int repeat = 0; repeat < MAX_REPEATS; ++repeat) {
    std::vector<std::size_t> again;
    for (std::size_t k = 0; k < rves.size(); ++k)
      if (answers[k].status & (status::ListFull | status::ForceSaturated)) again.push_back(k);
    if (again.empty()) break;
    std::vector<int> some_rves;
    std::vector<DriveRecord> some_records;
    for (std::size_t k : again) {
      before.emplace(k, get_header(rves[k]));
      prepare_repeat(rves[k], answers[k]);
      some_rves.push_back(rves[k]);
      some_records.push_back(records[k]);
    }
    std::vector<ResultRecord> some_answers(again.size());
    launch(some_rves, some_records, largest, pairs_per_grain * largest, some_answers);
    for (std::size_t m = 0; m < again.size(); ++m) answers[again[m]] = some_answers[m];
  }

  // a call that fails in the end leaves no trace of its repeats either
  for (const auto &[k, first] : before) {
    if (!(answers[k].status & status::Fatal)) continue;
    ImageHeader header = get_header(rves[k]);
    header.repeats = answers[k].repeats = first.repeats;
    header.largest_contact_force = first.largest_contact_force;
    put_header(rves[k], header);
  }

  results.resize(rves.size());
  std::transform(answers.begin(), answers.end(), results.begin(), to_result);
}

}    // namespace rve
