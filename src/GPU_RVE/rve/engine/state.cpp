// SPDX-License-Identifier: GPL-2.0-only
// Functions of a state, its checks, and its byte record for restarts and migration.

#include "rve/engine/state.h"

#include "rve/core/checksum.h"
#include "rve/core/error.h"
#include "rve/engine/contact_laws.h"
#include "rve/engine/contact_model.h"
#include "rve/engine/dimension_words.h"
#include "rve/physics/grain_shape.h"
#include "rve/physics/solid_cell.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>
#include <utility>

namespace rve {

namespace {

  // ---- checks ----

  /// Throws InputError unless a value is sound. `what` is a name, or a function that returns the
  /// name: thousands of grains are checked, and the name is needed only for an error.
  template <class Name>
  void require_sound(bool sound, double value, const Name &what, const char *unit,
                     const char *demand)
  {
    require(sound, what, " is ", value, " ", unit, "; it must be ", demand);
  }

  // Bounds of sizes. Within them, sizes and products of two or three of them are normal numbers in
  // the engine, whose forces and velocities may have 32 bits (1e-38 to 1e38).
  constexpr double SMALLEST = 1e-30, LARGEST = 1e30;

  template <class Name> void require_size(double value, const Name &what, const char *unit)
  {
    require_sound(!(value != 0.0 && std::fabs(value) < SMALLEST) && std::fabs(value) <= LARGEST,
                  value, what, unit, "between 1e-30 and 1e30 in size");
  }

  template <class Name> void require_positive(double value, const Name &what, const char *unit)
  {
    require_sound(std::isfinite(value) && value > 0.0, value, what, unit,
                  "finite and greater than 0");
    require_size(value, what, unit);
  }

  template <class Name> void require_not_negative(double value, const Name &what, const char *unit)
  {
    require_sound(std::isfinite(value) && value >= 0.0, value, what, unit, "finite and at least 0");
    require_size(value, what, unit);
  }

  // Checks values of motion and history, which may be arbitrarily small.
  template <class Name> void require_finite(double value, const Name &what, const char *unit)
  {
    require_sound(std::isfinite(value), value, what, unit, "a finite number");
    require_sound(std::fabs(value) <= LARGEST, value, what, unit, "at most 1e30 in size");
  }

  // Largest friction coefficient. Above it a normal force would be lost by rounding in a sum with a
  // tangential force.
  constexpr double LARGEST_FRICTION = 1e10;

  void require_friction(double value, const std::string &what)
  {
    require_not_negative(value, what, "[-]");
    require_sound(value <= LARGEST_FRICTION, value, what, "[-]",
                  "at most 1e10 (grains that never slide need no more than 1e3)");
  }

  template <int D>
  void require_finite(const Tensor<double, D> &tensor, const std::string &what, const char *unit)
  {
    for (const double value : tensor.component)
      require_finite(value, "a component of " + what, unit);
  }

  void require_count(std::size_t size, std::size_t expected, const std::string &what)
  {
    require(size == expected, "RVE has ", size, " ", what, "; it must have ", expected);
  }

  void check_parameter(double value, const MaterialParameter &parameter)
  {
    switch (parameter.range) {
      case MaterialRange::Positive:
        return require_positive(value, parameter.what, parameter.unit);
      case MaterialRange::NotNegative:
        return require_not_negative(value, parameter.what, parameter.unit);
      case MaterialRange::Friction:
        return require_friction(value, parameter.what);
      case MaterialRange::Fraction:
        require(value >= 0.0 && value < 1.0, parameter.what, " is ", value, " ", parameter.unit,
                "; it must lie in [0, 1)");
        return;
      case MaterialRange::Choice:
        require(value == 0.0 || value == 1.0 || value == 2.0 || value == 3.0, parameter.what,
                " is ", value, "; it must be 0, 1, 2 or 3");
        return;
      case MaterialRange::Switch:
        require(value == 0.0 || value == 1.0, parameter.what, " is ", value, "; it must be 0 or 1");
    }
  }

  template <int D> void check_material(const Material &material)
  {
    for (const MaterialParameter &parameter : MATERIAL_PARAMETERS) {
      const double value = material.*parameter.member;
      if (parameter.is_of(material.law, D))
        check_parameter(value, parameter);
      else
        require(value == 0.0, parameter.what, " is ", value, " ", parameter.unit,
                ", and the contact law ", word_of(material.law),
                parameter.is_of(material.law, parameter.dimension) ? " of disks" : "",
                " has no such parameter");
    }
    // Parameters without effect are errors.
    require(material.rolling_viscosity == 0.0 || material.rolling_stiffness > 0.0,
            "rolling viscosity is ", material.rolling_viscosity,
            " [force time/length], but rolling stiffness is 0; with a rolling viscosity it must be "
            "above 0");
    const bool has_sds_twisting = material.twisting_stiffness != 0.0 ||
        material.twisting_friction != 0.0 || material.twisting_viscosity != 0.0;
    require(material.twisting_marshall == 0.0 || !has_sds_twisting,
            "twisting stiffness, friction and viscosity are ", material.twisting_stiffness, ", ",
            material.twisting_friction, " and ", material.twisting_viscosity,
            "; they must be 0 with twisting_marshall 1, where friction resists twisting");
    require(material.twisting_viscosity == 0.0 || material.twisting_stiffness > 0.0,
            "twisting viscosity is ", material.twisting_viscosity,
            " [force length time], but twisting stiffness is 0; with a twisting viscosity it must "
            "be above 0");
  }

  // Checks quantities that follow from a material and a radius, for the smallest and the largest
  // grain.
  template <int D> void check_grain(const Material &material, double radius)
  {
    const std::string whose = " of a grain of radius " + number(radius) + " [length]";
    const double mass =
        times_power<D>(material.density * material.mass_depth * GrainShape<D>::volume, radius);
    require_sound(mass >= SMALLEST && mass <= LARGEST, mass,
                  "the mass" + whose + ", " + DimensionWords<D>::volume_of_grain +
                      " times density and mass depth,",
                  "[mass]", "between 1e-30 and 1e30");
    const ContactSite deep{radius, radius, radius};
    double force;
    ContactModuli stiffness, viscosity;
    with_law<D>(material, [&](const auto &law) {
      force = law.spring_force(deep);
      stiffness = law.stiffness(deep);
      viscosity = law.viscosity(deep);
    });
    require_positive(force, "the spring force at an overlap as large as the radius" + whose,
                     "[force]");
    const auto check_moduli = [&](const ContactModuli &moduli, const char *kind, const char *unit) {
      const auto check_one = [&](double modulus, const char *direction, const char *over) {
        if (modulus > 0.0)
          require_positive(
              modulus / mass,
              [&] { return concat("the ", direction, " ", kind, over, " over the mass", whose); },
              unit);
      };
      check_one(moduli.normal, "normal", "");
      check_one(moduli.tangential, "tangential", "");
      check_one(moduli.rolling, "rolling", "");
      check_one(moduli.twisting, "twisting", " over the squared reduced radius");
    };
    check_moduli(stiffness, "stiffness", "[1/time^2]");
    check_moduli(viscosity, "viscosity", "[1/time]");
  }

  // Checks the reach of an adhesion. A smaller reach than allowed would act like a jump of the
  // force. With a larger reach second neighbours would act on a grain, and the integer sums have no
  // capacity for them.
  void check_reach(const Material &material, double smallest_radius)
  {
    constexpr double LEAST_SHARE = 1e-6;
    const double reach = reach_of(material);
    require(reach == 0.0 || (reach >= LEAST_SHARE * smallest_radius && reach <= smallest_radius),
            "the reach of the adhesion is ", reach,
            " [length]; it must be 0, or between 1e-6 and 1 times the smallest radius, ",
            LEAST_SHARE * smallest_radius, " and ", smallest_radius);
  }

  template <int D> void check_cell(const Tensor<double, D> &cell, double contact_range)
  {
    require_finite(cell, "the cell matrix", "[length]");
    require_positive(
        determinant(cell),
        [] {
          return concat("cell ", DimensionWords<D>::volume, " (determinant of the cell matrix)");
        },
        DimensionWords<D>::unit_of_volume);
    const double least = 2.0 * contact_range;
    for (int a = 0; a < D; ++a) {
      const double width = perpendicular_width(cell, a);
      const auto where = [a] {
        return D == 2 ? concat("perpendicular to cell vector ", 1 - a)
                      : concat("between the faces that cell vector ", a, " connects");
      };
      require(width > least, "cell width ", where, " is ", width,
              " [length]; it must exceed twice the largest contact distance, ", least,
              ": use more grains, or a smaller ratio of largest to smallest radius");
    }
  }

  template <int D> void check_pairs(const RveStateOf<D> &state)
  {
    std::vector<std::pair<std::int32_t, std::int32_t>> ends;
    for (std::size_t k = 0; k < state.pairs.size(); ++k) {
      const PairOf<D> &pair = state.pairs[k];
      const auto name = [&] { return concat("pair ", k + 1); };
      for (const std::int32_t grain : {pair.first, pair.second})
        require(grain >= 0 && grain < state.num_grains(), name, " has grain ",
                grain + std::int64_t{1}, "; grain numbers are 1 to ", state.num_grains());
      require(pair.first != pair.second, name, " connects grain ", pair.first + 1, " to itself");
      for (const RememberedNumber<D> &number : pair_memory<D>())
        require_finite(
            number.of(pair), [&] { return concat(number.what, " of ", name); }, number.unit);
      ends.push_back(std::minmax(pair.first, pair.second));
    }
    std::sort(ends.begin(), ends.end());
    const auto twice = std::adjacent_find(ends.begin(), ends.end());
    if (twice != ends.end())
      throw InputError(concat("grains ", twice->first + 1, " and ", twice->second + 1,
                              " form a pair twice; each pair must be given once"));
  }

  // ---- record ----

  // "RVESTATE" as a number. In a file from a machine with another byte order its bytes are
  // reversed.
  constexpr std::uint64_t MAGIC = 0x4554415453455652u;
  // Versions of records of disks: VERSION with linear springs, VERSION_WITH_LAW with another
  // contact law. A record with VERSION_WITH_LAW begins with the name of the law.
  constexpr std::uint32_t VERSION = 3, VERSION_WITH_LAW = 4;
  // Version of records of spheres. They always begin with the name of the law.
  constexpr std::uint32_t VERSION_OF_SPHERES = 5;

  struct RecordHeader {
    std::uint64_t magic;
    std::uint32_t version;
    std::uint32_t num_grains;
    std::uint64_t bytes;       // size of the whole record
    std::uint64_t checksum;    // checksum of everything after the header
  };
  static_assert(std::has_unique_object_representations_v<RecordHeader>, "it is copied as bytes");

  class RecordWriter {
   public:
    explicit RecordWriter(std::vector<char> &_record) : record(_record) {}

    template <class T> void operator()(const T &value) { append(&value, sizeof(T)); }

    template <class T> void operator()(const std::vector<T> &values)
    {
      (*this)(static_cast<std::uint64_t>(values.size()));
      append(values.data(), values.size() * sizeof(T));
    }

   private:
    std::vector<char> &record;

    void append(const void *data, std::size_t size)
    {
      const char *bytes = static_cast<const char *>(data);
      record.insert(record.end(), bytes, bytes + size);
    }
  };

  class RecordReader {
   public:
    RecordReader(const char *_data, std::size_t size) : data(_data), left(size) {}

    template <class T> void operator()(T &value) { take(&value, sizeof(T)); }

    template <class T> void operator()(std::vector<T> &values)
    {
      std::uint64_t count = 0;
      (*this)(count);
      require(count <= left / sizeof(T),
              "RVE record is damaged: an array is longer than the record");
      values.resize(count);
      take(values.data(), count * sizeof(T));
    }

    std::size_t remaining() const { return left; }

   private:
    const char *data;
    std::size_t left;

    void take(void *target, std::size_t size)
    {
      require(size <= left, "RVE record is damaged: it ends too early");
      if (size > 0) std::memcpy(target, data, size);
      data += size;
      left -= size;
    }
  };

  // Record of a pair with the first `Count` numbers of pair_memory().
  template <std::size_t Count> struct PairRecord {
    std::int32_t first, second;
    double number[Count];
  };

  template <std::size_t Count, int D>
  void visit_pairs(RecordWriter &writer, const std::vector<PairOf<D>> &pairs)
  {
    std::vector<PairRecord<Count>> records;
    for (const PairOf<D> &pair : pairs) {
      records.push_back({pair.first, pair.second, {}});
      for (std::size_t k = 0; k < Count; ++k)
        records.back().number[k] = pair_memory<D>()[k].of(pair);
    }
    writer(records);
  }

  template <std::size_t Count, int D>
  void visit_pairs(RecordReader &reader, std::vector<PairOf<D>> &pairs)
  {
    std::vector<PairRecord<Count>> records;
    reader(records);
    pairs.clear();
    for (const PairRecord<Count> &record : records) {
      PairOf<D> pair{};
      pair.first = record.first;
      pair.second = record.second;
      for (std::size_t k = 0; k < Count; ++k) pair_memory<D>()[k].of(pair) = record.number[k];
      pairs.push_back(pair);
    }
  }

  // Reads or writes all members of a record, in the same order for both directions.
  template <int D, class Archive, class State> void visit(Archive &archive, State &state)
  {
    static_assert(sizeof(PairRecord<2>) == 24, "no padding may enter the record");
    static_assert(sizeof(Counters) == 32 && sizeof(EnergyTotals) == 32,
                  "no padding may enter the record");
    static_assert(std::is_trivially_copyable<decltype(state.cell)>::value,
                  "tensors are copied as bytes");
    for (const MaterialMember member : parameters_of(state.material.law, D))
      archive(state.material.*member);
    archive(state.cell);
    archive(state.deformation);
    archive(state.radius);
    archive(state.fractional);
    archive(state.velocity);
    archive(state.spin);
    // Disks with linear springs have a shorter history, and their record keeps its original format.
    constexpr std::size_t all = std::size(pair_memory<D>());
    if (D == 2 && state.material.law == ContactLaw::Linear)
      visit_pairs<std::min<std::size_t>(2, all)>(archive, state.pairs);
    else
      visit_pairs<all>(archive, state.pairs);
    archive(state.list_cell);
    archive(state.list_fractional);
    archive(state.order);
    archive(state.servo_velocity_gradient);
    archive(state.largest_contact_force);
    archive(state.counters);
    archive(state.energy);
  }

  template <int D> void visit_later_parameters(RecordWriter &writer, const Material &material)
  {
    for (const MaterialMember member : parameters_of(material.law, D, true))
      writer(material.*member);
  }

  // A record from an earlier version ends before the parameters that did not exist then.
  template <int D> void visit_later_parameters(RecordReader &reader, Material &material)
  {
    for (const MaterialMember member : parameters_of(material.law, D, true))
      if (reader.remaining() > 0) reader(material.*member);
  }

  template <int D> bool has_later_parameters(const Material &material)
  {
    const std::vector<MaterialMember> members = parameters_of(material.law, D, true);
    return std::any_of(members.begin(), members.end(),
                       [&](MaterialMember member) { return material.*member != 0.0; });
  }

}    // namespace

bool resists_twisting(const Material &material)
{
  if (material.twisting_marshall > 0.0)
    return material.friction > 0.0 &&
        (material.tangential_stiffness > 0.0 || material.mindlin_stiffness > 0.0);
  return material.twisting_stiffness > 0.0 && material.twisting_friction > 0.0;
}

bool resists_rolling(const Material &material)
{
  return (material.rolling_stiffness > 0.0 && material.rolling_friction > 0.0) ||
      resists_twisting(material);
}

template <int D> bool RveStateOf<D>::has_rolling_forces() const
{
  return std::any_of(pairs.begin(), pairs.end(), [](const PairOf<D> &pair) {
    if constexpr (D == 2)
      return pair.rolling_force != 0.0;
    else
      return dot(pair.rolling_force, pair.rolling_force) != 0.0 || pair.twisting_moment != 0.0;
  });
}

template <int D> double RveStateOf<D>::solid_volume() const
{
  double sum = 0.0;
  for (const double r : radius) sum += grain_volume<D>(r);
  return sum;
}

template <int D> double RveStateOf<D>::mass() const
{
  return material.density * material.mass_depth * solid_volume();
}

template <int D> std::vector<double> RveStateOf<D>::positions() const
{
  std::vector<double> x(fractional.size());
  for (std::size_t i = 0; i + D <= fractional.size(); i += D)
    for (int a = 0; a < D; ++a) {
      double sum = cell(a, 0) * (static_cast<double>(fractional[i]) * 0x1p-64);
      for (int b = 1; b < D; ++b)
        sum += cell(a, b) * (static_cast<double>(fractional[i + b]) * 0x1p-64);
      x[i + a] = sum;
    }
  return x;
}

template <int D> void RveStateOf<D>::set_positions(const std::vector<double> &x)
{
  require(determinant(cell) > 0.0, "cell ", DimensionWords<D>::volume, " is ", determinant(cell),
          " ", DimensionWords<D>::unit_of_volume, "; it must be above 0");
  const Tensor<double, D> to_fractional = inverse(cell);
  std::vector<std::uint64_t> result(x.size());
  for (std::size_t i = 0; i + D <= x.size(); i += D)
    for (int a = 0; a < D; ++a) {
      double s = to_fractional(a, 0) * x[i];
      for (int b = 1; b < D; ++b) s += to_fractional(a, b) * x[i + b];
      require(std::isfinite(s), "position of grain ", i / D + 1, " is not a finite number");
      const double scaled = (s - std::floor(s)) * 0x1p64;
      // For s just below a whole number the remainder can be rounded to 1. The grain is then stored
      // at its periodic image, 0.
      result[i + a] = scaled < 0x1p64 ? static_cast<std::uint64_t>(scaled) : 0u;
    }
  fractional = std::move(result);
}

template <int D> void RveStateOf<D>::check_sizes() const
{
  check_material<D>(material);
  if (D == 3)
    require_sound(material.thickness == 1.0, material.thickness, "the thickness of spheres",
                  "[length]", "1, because spheres have no thickness");
  require(!radius.empty(), "RVE has no grains; it needs at least one");
  for (std::size_t i = 0; i < radius.size(); ++i)
    require_positive(
        radius[i], [=] { return concat("radius of grain ", i + 1); }, "[length]");
  const auto [smallest, largest] = std::minmax_element(radius.begin(), radius.end());
  for (const double r : {*smallest, *largest}) check_grain<D>(material, r);
  check_reach(material, *smallest);
}

template <int D> void RveStateOf<D>::check() const
{
  check_sizes();
  constexpr int SPINS = Space<D>::spins;
  const std::size_t n = radius.size();
  require_count(fractional.size(), D * n, "fractional coordinates");
  require_count(velocity.size(), D * n, "velocity components");
  require_count(spin.size(), SPINS * n, "spins");

  double largest_radius = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    const auto of_grain = [&](const char *what) {
      return [=] { return concat(what, " of grain ", i + 1); };
    };
    for (int a = 0; a < D; ++a)
      require_finite(velocity[D * i + a], of_grain("peculiar velocity"), "[length/time]");
    for (int k = 0; k < SPINS; ++k)
      require_finite(spin[SPINS * i + k], of_grain("spin"), "[1/time]");
    largest_radius = std::max(largest_radius, radius[i]);
  }
  check_cell(cell, 2.0 * largest_radius + reach_of(material));
  require_finite(deformation, "the deformation gradient", "[-]");
  require_positive(determinant(deformation), "determinant of the deformation gradient", "[-]");

  check_pairs(*this);
  require_finite(list_cell, "the cell matrix of the Verlet list", "[length]");
  const bool has_list = determinant(list_cell) != 0.0;
  if (!order.empty()) {
    std::vector<char> seen(n, 0);
    require_count(order.size(), n, "storage order");
    for (const std::int32_t i : order) {
      require(i >= 0 && static_cast<std::size_t>(i) < n && !seen[i],
              "storage order must contain each grain once");
      seen[i] = 1;
    }
  }
  if (has_list || !list_fractional.empty())
    require_count(list_fractional.size(), D * n, "list coordinates");
  require_not_negative(list_margin, "the margin of the list of neighbours", "[length]");
  require_finite(servo_velocity_gradient, "the servo velocity gradient", "[1/time]");
  require_not_negative(largest_contact_force, "largest contact force", "[force]");
  // No run makes 2^53 steps, and below this limit a call can increase the counters without an
  // overflow.
  constexpr std::int64_t MOST = std::int64_t(1) << 53;
  for (const std::int64_t count :
       {counters.steps, counters.rebuilds, counters.lattice_reductions, counters.repeats})
    require(count >= 0 && count <= MOST, "a counter of the state is ", count,
            "; it must be from 0 to 2^53");
}

template <int D> std::vector<char> serialize(const RveStateOf<D> &state)
{
  std::vector<char> record(sizeof(RecordHeader));
  RecordWriter writer(record);
  const bool says_law = D == 3 || state.material.law != ContactLaw::Linear;
  if (says_law) {
    const std::string word = word_of(state.material.law);
    writer(std::vector<char>(word.begin(), word.end()));
  }
  visit<D>(writer, state);
  if (has_later_parameters<D>(state.material) || state.list_margin != 0.0)
    visit_later_parameters<D>(writer, state.material);
  if (state.list_margin != 0.0) writer(state.list_margin);
  RecordHeader header{};
  header.magic = MAGIC;
  header.version = D == 3 ? VERSION_OF_SPHERES : says_law ? VERSION_WITH_LAW : VERSION;
  header.num_grains = static_cast<std::uint32_t>(state.num_grains());
  header.bytes = record.size();
  header.checksum = checksum_of(record.data() + sizeof(header), record.size() - sizeof(header));
  std::memcpy(record.data(), &header, sizeof(header));
  return record;
}

template <int D> RveStateOf<D> deserialize(const char *data, std::size_t size)
{
  RecordHeader header{};
  require(size >= sizeof(header), "RVE record is damaged: it has ", size,
          " bytes, but its header alone has ", sizeof(header));
  std::memcpy(&header, data, sizeof(header));
  require(header.magic == MAGIC,
          "the bytes are not an RVE record, or have the byte order of another machine");
  require((D == 3) == (header.version == VERSION_OF_SPHERES),
          D == 3 ? "the RVE record has disks; it must have spheres"
                 : "the RVE record has spheres; it must have disks");
  require(D == 3 || header.version == VERSION || header.version == VERSION_WITH_LAW,
          "RVE record has version ", header.version, "; this program reads versions ", VERSION,
          " and ", VERSION_WITH_LAW);
  require(header.bytes == size, "RVE record is damaged: it has ", size,
          " bytes, but its header gives ", header.bytes);
  require(header.checksum == checksum_of(data + sizeof(header), size - sizeof(header)),
          "RVE record is damaged: its checksum does not match");

  RveStateOf<D> state;
  RecordReader reader(data + sizeof(header), size - sizeof(header));
  if (header.version != VERSION) {
    std::vector<char> word;
    reader(word);
    state.material.law = contact_law_of(std::string(word.begin(), word.end()));
  }
  visit<D>(reader, state);
  if (reader.remaining() > 0) {
    visit_later_parameters<D>(reader, state.material);
    if (reader.remaining() > 0) reader(state.list_margin);
    require(has_later_parameters<D>(state.material) || state.list_margin != 0.0,
            "RVE record is damaged: it has parameters that are all zero");
  }
  require(reader.remaining() == 0, "RVE record is damaged: bytes are left over");
  require_count(header.num_grains, state.radius.size(), "grains in its header");
  return state;
}

template struct RveStateOf<2>;
template std::vector<char> serialize(const RveStateOf<2> &state);
template RveStateOf<2> deserialize(const char *data, std::size_t size);

template struct RveStateOf<3>;
template std::vector<char> serialize(const RveStateOf<3> &state);
template RveStateOf<3> deserialize(const char *data, std::size_t size);

}    // namespace rve
