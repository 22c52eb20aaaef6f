// SPDX-License-Identifier: GPL-2.0-only
#include "capi/librve.h"

#include "capi/step_bound.h"
#include "capi/words.h"
#include "cuda/device_arrays.h"
#include "macro/load_path.h"
#include "macro/quantities.h"
#include "rve/core/checksum.h"
#include "rve/core/error.h"
#include "rve/engine/contact_network.h"
#include "rve/engine/drift.h"
#include "rve/engine/drive_record.h"
#include "rve/engine/files.h"
#include "rve/engine/packing.h"
#include "rve/engine/packing_image.h"
#include "rve/engine/packing_io.h"
#include "rve/engine/stability.h"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <initializer_list>
#include <iterator>
#include <limits>
#include <memory>
#include <new>
#include <numeric>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <type_traits>
#include <variant>

using rve::require;

namespace {

thread_local std::string last_error = "";

/// Runs `work` and turns what it throws into a code and a text.
template <class Work> int guarded(const Work &work) noexcept
{
  const auto failed = [](int code, const char *text) {
    try {
      last_error = text;
    } catch (...) {
      last_error.clear();    // no memory for a text
    }
    return code;
  };
  try {
    work();
    return RVE_SUCCESS;
  } catch (const rve::InputError &e) {
    return failed(RVE_BAD_INPUT, e.what());
  } catch (const std::bad_alloc &) {
    return failed(RVE_NO_MEMORY, "there is not enough memory");
  } catch (const std::length_error &) {
    return failed(RVE_NO_MEMORY, "there is not enough memory");
  } catch (const std::exception &e) {
    return failed(RVE_FAILED, e.what());
  } catch (...) {
    return failed(RVE_FAILED, "unknown failure");
  }
}

void require_pointer(const void *pointer, const char *name)
{
  require(pointer != nullptr, [&] { return std::string(name) + " is a null pointer"; });
}

/// Product of the extents of an array of doubles. Throws InputError if no memory can have it.
std::size_t size_of_array(const char *name, std::initializer_list<std::size_t> extents)
{
  constexpr std::size_t most = std::numeric_limits<std::size_t>::max() / sizeof(double);
  std::size_t product = 1;
  for (const std::size_t extent : extents) {
    require(extent == 0 || product <= most / extent,
            [&] { return std::string(name) + " would have more numbers than memory can have"; });
    product *= extent;
  }
  return product;
}

/// Text of a file that a loading path names.
std::string text_of(const std::string &file)
{
  rve::require_readable(file, "file of a path");
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

std::string text_or_empty(const char *text)
{
  return text ? text : "";
}

using AnyState = std::variant<rve::RveStateOf<2>, rve::RveStateOf<3>>;

template <int D> rve::Tensor<double, D> matrix_at(const double *values, std::size_t k)
{
  rve::Tensor<double, D> matrix;
  std::copy_n(values + k * D * D, D * D, matrix.component);
  return matrix;
}

template <int D>
void put_matrix(const rve::Tensor<double, D> &matrix, double *values, std::size_t k)
{
  std::copy_n(matrix.component, D * D, values + k * D * D);
}

}    // namespace

// ---- packings -------------------------------------------------------------------------------------------------------------------

struct rve_packing {
  AnyState state;
};

namespace {

int dimension_of(const AnyState &state)
{
  return state.index() == 0 ? 2 : 3;
}

/// Throws InputError if the grains drift. There is no log in which a correction could be reported.
template <int D> void require_no_drift(const rve::RveStateOf<D> &state, const std::string &whose)
{
  const std::string drift = rve::describe_drift(rve::drift_of(state));
  require(drift.empty(), [&] {
    return whose + " has a " + drift +
        ", which is most of the motion of its grains; it must be 0: " +
        "subtract it from the velocities";
  });
}

template <int D> AnyState read_state_of(const char *file)
{
  rve::RveStateOf<D> state = rve::read_packing<D>(file);
  require_no_drift(state, file);
  return state;
}

AnyState read_state(const char *file)
{
  require_pointer(file, "file");
  return rve::dimension_of_packing(file) == 3 ? read_state_of<3>(file) : read_state_of<2>(file);
}

template <int D> std::vector<AnyState> states_of_library(const char *file)
{
  rve::PackingLibraryOf<D> library = rve::read_library<D>(file);
  for (std::size_t k = 0; k < library.packings.size(); ++k)
    require_no_drift(library.packings[k], std::string(file) + ": packing " + std::to_string(k));
  return {std::make_move_iterator(library.packings.begin()),
          std::make_move_iterator(library.packings.end())};
}

template <int D> AnyState prepare(const capi::Order &order)
{
  const auto engine = rve::make_engine<D>(order.options);
  return rve::generate_packing(order.recipe, *engine);
}

template <int D>
std::vector<double> array_named(const rve::RveStateOf<D> &state, const std::string &name)
{
  const auto components = [](const rve::Tensor<double, D> &matrix) {
    return std::vector<double>(std::begin(matrix.component), std::end(matrix.component));
  };
  if (name == "cell") return components(state.cell);
  if (name == "deformation") return components(state.deformation);
  if (name == "radius") return state.radius;
  if (name == "position") return state.positions();
  if (name == "velocity") return state.velocity;
  if (name == "spin") return state.spin;
  throw rve::InputError("there is no array '" + name +
                        "'; there are cell, deformation, radius, position, velocity, spin");
}

void copy_out(const std::vector<double> &from, double *values, std::size_t count)
{
  require_pointer(values, "values");
  require(count == from.size(), [&] {
    return "count is " + std::to_string(count) + "; it must be " + std::to_string(from.size());
  });
  std::copy(from.begin(), from.end(), values);
}

template <int D> std::vector<double> contact_table(const rve::RveStateOf<D> &state)
{
  std::vector<double> table;
  for (const rve::SpringContactOf<D> &contact : rve::find_spring_contacts(state)) {
    table.push_back(contact.geometry.first);
    table.push_back(contact.geometry.second);
    for (int a = 0; a < D; ++a) table.push_back(contact.geometry.branch[a]);
    table.push_back(contact.geometry.overlap);
    table.push_back(contact.normal_force);
    for (int a = 0; a < D; ++a) table.push_back(contact.force_on_first[a]);
    table.push_back(contact.mobilized_friction >= rve::SLIDING ? 1.0 : 0.0);
  }
  return table;
}

}    // namespace

// ---- bytes ------------------------------------------------------------------------------------------------------------------------

namespace {

/// The bytes of rve_save and rve_packing_save: this header, then for each RVE the size of its record and the record.
struct SavedHeader {
  char magic[8];
  std::uint64_t dimension, count, bytes, checksum;
};
static_assert(std::has_unique_object_representations_v<SavedHeader>, "it is copied as bytes");
constexpr char SAVED_MAGIC[8] = {'l', 'i', 'b', 'r', 'v', 'e', ' ', '2'};
/// In the first version the checksum did not cover the header.
constexpr char FIRST_SAVED_MAGIC[8] = {'l', 'i', 'b', 'r', 'v', 'e', ' ', '1'};

bool has_magic(const SavedHeader &header, const char (&magic)[8])
{
  return std::memcmp(header.magic, magic, sizeof(magic)) == 0;
}

/// Checksum of the header, which counts with a checksum of zero, and of the records.
std::uint64_t checksum_of_saved(SavedHeader header, const char *records, std::size_t size)
{
  if (has_magic(header, FIRST_SAVED_MAGIC)) return rve::checksum_of(records, size);
  header.checksum = 0;
  rve::Checksum checksum;
  checksum.add(&header, sizeof(header));
  checksum.add(records, size);
  return checksum.value();
}

/// Bytes of `count` RVEs, the k-th of which is state_of(k).
template <int D, class StateOf> std::vector<char> saved(std::size_t count, const StateOf &state_of)
{
  std::vector<char> bytes(sizeof(SavedHeader));
  for (std::size_t k = 0; k < count; ++k) {
    const std::vector<char> record = rve::serialize(state_of(k));
    const std::uint64_t length = record.size();
    const char *begin = reinterpret_cast<const char *>(&length);
    bytes.insert(bytes.end(), begin, begin + sizeof(length));
    bytes.insert(bytes.end(), record.begin(), record.end());
  }
  SavedHeader header{};
  std::memcpy(header.magic, SAVED_MAGIC, sizeof(header.magic));
  header.dimension = D;
  header.count = count;
  header.bytes = bytes.size();
  header.checksum =
      checksum_of_saved(header, bytes.data() + sizeof(header), bytes.size() - sizeof(header));
  std::memcpy(bytes.data(), &header, sizeof(header));
  return bytes;
}

/// Throws InputError unless these are whole bytes of RVEs.
SavedHeader header_of(const char *bytes, std::size_t size)
{
  SavedHeader header{};
  require(size >= sizeof(header), "these are no saved RVEs: there are too few bytes");
  std::memcpy(&header, bytes, sizeof(header));
  require(has_magic(header, SAVED_MAGIC) || has_magic(header, FIRST_SAVED_MAGIC),
          "these are no bytes of rve_save, or of another machine's byte order");
  require(header.bytes == size &&
              header.checksum ==
                  checksum_of_saved(header, bytes + sizeof(header), size - sizeof(header)),
          "the saved RVEs are damaged");
  require(header.dimension == 2 || header.dimension == 3, [&] {
    return "the saved RVEs are damaged: their dimension is " + std::to_string(header.dimension) +
        "; it must be 2 or 3";
  });
  return header;
}

/// Throws InputError unless the records after the header are exactly those of header.count sound states.
template <int D>
std::vector<rve::RveStateOf<D>> states_in(const char *bytes, const SavedHeader &header)
{
  std::vector<rve::RveStateOf<D>> states;
  std::size_t place = sizeof(header);
  for (std::size_t k = 0; k < header.count; ++k) {
    std::uint64_t length = 0;
    const bool has_length = header.bytes - place >= sizeof(length);
    if (has_length) {
      std::memcpy(&length, bytes + place, sizeof(length));
      place += sizeof(length);
    }
    require(has_length && length <= header.bytes - place, [&] {
      return "the saved RVEs are damaged: the bytes end in RVE " + std::to_string(k) + " of " +
          std::to_string(header.count);
    });
    states.push_back(rve::deserialize<D>(bytes + place, length));
    states.back().check();
    place += length;
  }
  require(place == header.bytes, [&] {
    return "the saved RVEs are damaged: " + std::to_string(header.bytes - place) +
        " bytes are left over after " + std::to_string(header.count) + " RVEs";
  });
  return states;
}

template <int D> std::vector<char> saved_packing(const rve::RveStateOf<D> &state)
{
  return saved<D>(1, [&](std::size_t) -> const rve::RveStateOf<D> & { return state; });
}

/// Gives a caller bytes, or only their number.
void give_bytes(const std::vector<char> &saved, void *bytes, std::size_t capacity,
                std::size_t *size)
{
  *size = saved.size();
  if (!bytes) return;
  require(saved.size() <= capacity, [&] {
    return "capacity is " + std::to_string(capacity) + " bytes; it must be at least " +
        std::to_string(saved.size());
  });
  std::memcpy(bytes, saved.data(), saved.size());
}

}    // namespace

// ---- batches --------------------------------------------------------------------------------------------------------------------

namespace {

template <int D> class Batch {
 public:
  Batch(const std::vector<const rve::RveStateOf<D> *> &states, rve::Options options)
  {
    std::vector<rve::RveStateOf<D>> copies;
    for (const rve::RveStateOf<D> *state : states) copies.push_back(*state);
    options.contacts =
        rve::contacts_of(copies, [](int k) { return "packing " + std::to_string(k); });
    engine = rve::make_engine<D>(options);
    engine_options = options;
    for (const rve::RveStateOf<D> &state : copies) members.push_back({engine->add(state)});
    description = engine->description();
    evaluate();
  }

  std::size_t size() const { return members.size(); }
  const char *text() const { return description.c_str(); }
  int cuda_device() const { return engine->cuda_device(); }

  void time_steps(const std::vector<std::size_t> &which, double *dt)
  {
    std::vector<double> bounds;
    engine->bound_time_steps(numbers_of(which), std::numeric_limits<double>::max(), bounds);
    std::copy(bounds.begin(), bounds.end(), dt);
  }

  void run(const std::vector<std::size_t> &which, const double *increments, const double *dt,
           const std::int32_t *substeps, double *stresses, std::uint32_t *statuses, bool keeps)
  {
    std::vector<rve::DriveOf<D>> drives(which.size());
    for (std::size_t k = 0; k < which.size(); ++k) {
      drives[k].dt = dt[k];
      drives[k].substeps = substeps[k];
      drives[k].deformation = matrix_at<D>(increments, k);
    }
    if (keeps) require_no_trial();
    // a call that is refused leaves the trials before it as they are
    for (std::size_t k = 0; k < which.size(); ++k) check_drive(which[k], drives[k]);
    require_stable_steps(which, drives);
    if (keeps)
      begin_to_keep(which);
    else
      for (const std::size_t m : which) return_to_committed(members[m]);
    std::vector<rve::ResultOf<D>> results;
    engine->advance(numbers_of(which), drives, results);
    for (std::size_t k = 0; k < which.size(); ++k) {
      Member &member = members[which[k]];
      const rve::ResultOf<D> &result = results[k];
      const bool took = take(member, result);
      if (!keeps) member.tried = took;
      if (stresses) put_matrix<D>(member.result.stress, stresses, k);
      if (statuses) statuses[k] = result.status;
    }
  }

  void commit()
  {
    for (Member &member : members) {
      member.tried = false;
      member.forget_committed();
    }
  }

  void follow(const std::vector<std::size_t> &which, const std::string &text, double dt,
              int substeps, std::size_t calls, const std::string &names, double *table,
              std::uint32_t *statuses)
  {
    require(dt > 0.0 && std::isfinite(dt),
            [&] { return "dt is " + rve::number(dt) + "; it must be positive [time]"; });
    require(substeps > 0,
            [&] { return "substeps is " + std::to_string(substeps) + "; it must be at least 1"; });
    const macro::LoadPathsOf<D> paths(macro::path_words(text, "path"), text_of);
    require(paths.script_names().empty(), [&] {
      return "the path has v_" + paths.script_names().front() + "; there are no variables here";
    });
    require(paths.size() == 1 || paths.size() == static_cast<int>(which.size()), [&] {
      return "there are " + std::to_string(paths.size()) +
          " paths; there must be 1, or one for each of the " + std::to_string(which.size()) +
          " RVEs";
    });
    std::vector<std::string> quantities;
    std::istringstream words(names);
    for (std::string name; words >> name;) quantities.push_back(name);
    require(calls < std::numeric_limits<std::size_t>::max(),
            [&] { return "calls is " + std::to_string(calls) + "; there are too many"; });
    const std::size_t row_size = size_of_array("table", {which.size(), quantities.size()});
    // a caller has all of it or nothing
    std::vector<double> found(size_of_array("table", {calls + 1, row_size})), column(which.size());
    require_no_trial();
    begin_to_keep(which);

    struct Walker {
      macro::PathState<D> path;
      double gain;
      std::uint32_t status = 0;
    };
    std::vector<Walker> walkers(which.size());
    for (std::size_t k = 0; k < which.size(); ++k) {
      const Member &member = members[which[k]];
      walkers[k].gain = rve::default_servo_gain(engine->state(member.number));
      paths.begin(walkers[k].path, paths.size() == 1 ? 0 : static_cast<int>(k),
                  member.result.deformation);
    }
    const auto step_of = [&](const Walker &walker) {
      return macro::PathStep{dt, substeps, walker.gain, macro::SERVO_STRAIN_PER_STEP / dt};
    };
    const auto write_row = [&](std::size_t row) {
      double *rows = found.data() + row * row_size;
      for (std::size_t j = 0; j < quantities.size(); ++j) {
        quantity(quantities[j], which, column.data());
        for (std::size_t k = 0; k < which.size(); ++k) rows[k * quantities.size() + j] = column[k];
      }
    };
    const auto walk = [&](std::size_t row) {
      std::vector<std::size_t> walking, moved;
      std::vector<rve::DriveOf<D>> drives;
      for (std::size_t k = 0; k < which.size(); ++k) {
        if (walkers[k].path.ended || walkers[k].status & rve::status::Fatal) continue;
        walking.push_back(k);
        moved.push_back(which[k]);
        drives.push_back(paths.drive(walkers[k].path, step_of(walkers[k]), nullptr,
                                     members[which[k]].result.deformation));
      }
      require_stable_steps(moved, drives);
      std::vector<rve::ResultOf<D>> results;
      engine->advance(numbers_of(moved), drives, results);
      for (std::size_t j = 0; j < walking.size(); ++j) {
        Walker &walker = walkers[walking[j]];
        walker.status = results[j].status;
        if (take(members[moved[j]], results[j]))
          paths.follow(walker.path, step_of(walker), results[j]);
      }
      write_row(row);
    };
    // a path may turn out to ask for what cannot be in one of its later stages
    for (const std::size_t m : which) keep_committed(members[m]);
    try {
      write_row(0);
      for (std::size_t call = 0; call < calls; ++call) walk(call + 1);
    } catch (...) {
      for (const std::size_t m : which) {
        members[m].tried = true;
        return_to_committed(members[m]);
      }
      throw;
    }
    for (const std::size_t m : which) members[m].forget_committed();
    std::copy(found.begin(), found.end(), table);
    if (statuses)
      for (std::size_t k = 0; k < which.size(); ++k) statuses[k] = walkers[k].status;
  }

  void revert()
  {
    for (Member &member : members)
      if (member.tried) return_to_committed(member);
  }

  void quantity(const std::string &name, const std::vector<std::size_t> &which,
                double *values) const
  {
    macro::with_quantity_named(name, D, [&](const auto &quantity) {
      for (std::size_t k = 0; k < which.size(); ++k)
        values[k] = value_of(quantity, members[which[k]]);
    });
  }

  void affine_stiffness(const std::vector<std::size_t> &which, double *stiffness)
  {
    std::vector<rve::ElasticResultOf<D>> answers;
    engine->advance(numbers_of(which), std::vector<rve::DriveOf<D>>(which.size(), resting()),
                    answers);
    for (const rve::ElasticResultOf<D> &answer : answers)
      for (const auto &row : answer.stiffness.component)
        stiffness = std::copy(std::begin(row), std::end(row), stiffness);
  }

  void tangents(const std::vector<std::size_t> &which, const std::string &words,
                const double *strain_rates, double *tangents, int *measured)
  {
    constexpr int S = rve::Space<D>::strains;
    const auto [format, options] = capi::read_tangent_options(words, engine_options.format);
    require(strain_rates || options.kind == macro::TangentKind::Elastic,
            "strain_rates is a null pointer; kind loading needs the directions of straining");
    rve::Options of_copies = engine_options;
    of_copies.format = format;
    of_copies.arithmetic = rve::Arithmetic::Strict;
    macro::TangentProbesOf<D> probes(rve::make_engine<D>(of_copies), options);
    const auto answers = probes.probe(
        static_cast<int>(which.size()),
        [&](int k) { return engine->state(members[which[k]].number); },
        [&](int k) {
          return strain_rates ? matrix_at<D>(strain_rates, k) : rve::Tensor<double, D>::zero();
        });
    for (std::size_t k = 0; k < answers.size(); ++k) {
      for (int row = 0; row < S; ++row)
        std::copy_n(answers[k].tangent.component[row], S, tangents + (k * S + row) * S);
      if (measured) measured[k] = answers[k].is_measured ? 1 : 0;
    }
  }

  rve::RveStateOf<D> state(std::size_t which) const { return engine->state(members[which].number); }

  void set_state(std::size_t which, const rve::RveStateOf<D> &state)
  {
    const int number = engine->add(state);    // may refuse it
    engine->remove(members[which].number);
    members[which] = Member{number};
    evaluate();
  }

  std::vector<char> save() const
  {
    return saved<D>(members.size(), [&](std::size_t k) {
      const Member &member = members[k];
      return member.tried ? *member.committed : engine->state(member.number);
    });
  }

  void restore(const char *bytes, std::size_t size)
  {
    const SavedHeader header = header_of(bytes, size);
    require(header.dimension == D, [&] {
      return "these are RVEs of dimension " + std::to_string(header.dimension) +
          "; the batch has dimension " + std::to_string(D);
    });
    require(header.count == members.size(), [&] {
      return "there are " + std::to_string(header.count) + " saved RVEs; the batch has " +
          std::to_string(members.size());
    });
    const std::vector<rve::RveStateOf<D>> states = states_in<D>(bytes, header);
    // all come in before any goes
    std::vector<int> numbers;
    try {
      for (const auto &state : states) numbers.push_back(engine->add(state));
    } catch (...) {
      for (const int number : numbers) engine->remove(number);
      throw;
    }
    for (std::size_t k = 0; k < members.size(); ++k) {
      engine->remove(members[k].number);
      members[k] = Member{numbers[k]};
    }
    evaluate();
  }

 private:
  struct Member {
    int number;            ///< in the engine
    bool tried = false;    ///< the engine has its trial
    /// Kept from the first trial on that begins from it, until a commit.
    std::optional<rve::RveStateOf<D>> committed = {};
    std::optional<rve::ResultOf<D>> committed_result = {};
    rve::ResultOf<D> result = {};    ///< of what the engine has
    capi::StepBound bound = {};      ///< of the committed state
    /// The same, when it was asked for: one quantity of contacts costs as much as all of them.
    mutable std::optional<rve::ContactMeasuresOf<D>> contacts = {};

    void forget_committed()
    {
      committed.reset();
      committed_result.reset();
    }
  };

  std::unique_ptr<rve::EngineOf<D>> engine;
  std::vector<Member> members;
  rve::Options engine_options;
  std::string description;

  double value_of(const macro::Quantity &quantity, const Member &member) const
  {
    return quantity.of(member.result);
  }
  double value_of(const macro::ContactQuantity &quantity, const Member &member) const
  {
    if (!member.contacts) member.contacts = rve::contact_measures(engine->state(member.number));
    return quantity.of(*member.contacts);
  }

  static rve::DriveOf<D> resting()
  {
    rve::DriveOf<D> drive;
    drive.dt = 1.0;    // of no step
    return drive;
  }

  std::vector<int> numbers_of(const std::vector<std::size_t> &which) const
  {
    std::vector<int> numbers;
    for (const std::size_t m : which) numbers.push_back(members[m].number);
    return numbers;
  }

  void require_no_trial() const
  {
    require(std::none_of(members.begin(), members.end(),
                         [](const Member &member) { return member.tried; }),
            "an RVE has a trial, which must be committed or reverted before an advance");
  }

  /// Before RVEs are moved for good: what was kept for trials is not their committed state any more.
  void begin_to_keep(const std::vector<std::size_t> &which)
  {
    for (const std::size_t m : which) members[m].forget_committed();
  }

  static void check_drive(std::size_t which, const rve::DriveOf<D> &drive)
  {
    try {
      rve::check(drive);
      for (int a = 0; a < D && drive.substeps == 0; ++a)
        for (int b = 0; b < D; ++b)
          require(drive.deformation(a, b) == (a == b ? 1.0 : 0.0), [&] {
            return "increment component " + std::string(1, "xyz"[a]) + "xyz"[b] + " is " +
                rve::number(drive.deformation(a, b)) +
                " with 0 substeps; it must be that of the identity, since no step can deform the "
                "RVE";
          });
    } catch (const rve::InputError &e) {
      throw rve::InputError("RVE " + std::to_string(which) + ": " + e.what());
    }
  }

  bool has_constant_moduli() const { return engine->contacts().law == rve::ContactLaw::Linear; }

  /// What the engine would find if the member had no trial.
  static const rve::ResultOf<D> &result_of_committed(const Member &member)
  {
    return member.tried ? *member.committed_result : member.result;
  }

  /// Throws InputError if a drive makes DEM steps that are too long for the committed state of its RVE. Determines bounds only
  /// where StepBound does not have them: those of RVEs in the engine there, the exact ones of few RVEs on the host.
  void require_stable_steps(const std::vector<std::size_t> &which,
                            const std::vector<rve::DriveOf<D>> &drives)
  {
    std::vector<std::size_t> in_engine, exactly;    // places in `which`
    double longest = 0.0;
    for (std::size_t k = 0; k < which.size(); ++k) {
      const Member &member = members[which[k]];
      if (drives[k].substeps == 0 || member.bound.allows(drives[k].dt, result_of_committed(member)))
        continue;
      (member.tried ? exactly : in_engine).push_back(k);
      if (!member.tried) longest = std::max(longest, drives[k].dt);
    }
    std::vector<int> numbers;
    for (const std::size_t k : in_engine) numbers.push_back(members[which[k]].number);
    std::vector<double> bounds;
    if (!numbers.empty()) engine->bound_time_steps(numbers, longest, bounds);
    for (std::size_t j = 0; j < in_engine.size(); ++j) {
      Member &member = members[which[in_engine[j]]];
      if (drives[in_engine[j]].dt <= bounds[j])
        member.bound.note(bounds[j], result_of_committed(member), has_constant_moduli());
      else
        exactly.push_back(in_engine[j]);
    }
    for (const std::size_t k : exactly) require_stable_step(which[k], drives[k].dt);
  }

  void require_stable_step(std::size_t which, double dt)
  {
    Member &member = members[which];
    const double bound =
        rve::stable_time_step(member.tried ? *member.committed : engine->state(member.number));
    require(dt <= bound, [&] {
      return "dt of RVE " + std::to_string(which) + " is " + rve::number(dt) +
          " [time]; it must be at most the stability bound " + rve::number(bound) +
          " [time], and should be at most 0.9 of it (rve_time_steps)";
    });
    member.bound.note(bound, result_of_committed(member), has_constant_moduli());
  }

  /// The answer of a call; false if the RVE failed, and stayed as it was.
  static bool take(Member &member, const rve::ResultOf<D> &result)
  {
    const bool failed = result.status & rve::status::Fatal;
    if (!failed) member.result = result;
    member.result.status = result.status;
    member.contacts.reset();
    return !failed;
  }

  void keep_committed(Member &member)
  {
    if (member.committed) return;
    member.committed = engine->state(member.number);
    member.committed_result = member.result;
  }

  /// Before a trial, and where one is forgotten.
  void return_to_committed(Member &member)
  {
    keep_committed(member);
    if (!member.tried) return;
    const int number = engine->add(*member.committed);
    engine->remove(member.number);
    member.number = number;
    member.result = *member.committed_result;
    member.contacts.reset();
    member.tried = false;
  }

  /// Results of RVEs that have just come in.
  void evaluate()
  {
    std::vector<Member *> fresh;
    std::vector<int> numbers;
    for (Member &member : members)
      if (member.result.num_grains == 0) {
        fresh.push_back(&member);
        numbers.push_back(member.number);
      }
    std::vector<rve::ResultOf<D>> results;
    engine->advance(numbers, std::vector<rve::DriveOf<D>>(numbers.size(), resting()), results);
    for (std::size_t k = 0; k < fresh.size(); ++k) fresh[k]->result = results[k];
  }
};

/// The numbers that a caller names: all, or `count` different ones of them.
std::vector<std::size_t> chosen(const std::size_t *which, std::size_t count, std::size_t size)
{
  std::vector<std::size_t> all;
  if (!which) {
    require(count == size, [&] {
      return "count is " + std::to_string(count) + "; all RVEs are " + std::to_string(size);
    });
    all.resize(size);
    std::iota(all.begin(), all.end(), std::size_t(0));
    return all;
  }
  require(count <= size, [&] {
    return "count is " + std::to_string(count) + "; there are " + std::to_string(size) + " RVEs";
  });
  std::vector<char> seen(size, 0);
  for (std::size_t k = 0; k < count; ++k) {
    require(which[k] < size, [&] {
      return "which[" + std::to_string(k) + "] is " + std::to_string(which[k]) +
          "; it must be below " + std::to_string(size);
    });
    require(!seen[which[k]]++,
            [&] { return "which has RVE " + std::to_string(which[k]) + " twice"; });
    all.push_back(which[k]);
  }
  return all;
}

using AnyBatch = std::variant<Batch<2>, Batch<3>>;

template <int D>
AnyBatch make_batch(const rve_packing *const *packings, std::size_t count,
                    const rve::Options &options)
{
  std::vector<const rve::RveStateOf<D> *> states;
  for (std::size_t k = 0; k < count; ++k) {
    const auto *state = std::get_if<rve::RveStateOf<D>>(&packings[k]->state);
    require(state != nullptr, [&] {
      return "packing 0 is of " + std::string(D == 2 ? "disks" : "spheres") + ", and packing " +
          std::to_string(k) + " of " + (D == 2 ? "spheres" : "disks") +
          "; all of a batch must have the same grains";
    });
    states.push_back(state);
  }
  return Batch<D>(states, options);
}

}    // namespace

struct rve_batch {
  AnyBatch any;

  template <class Work> decltype(auto) visit(const Work &work) { return std::visit(work, any); }
  template <class Work> decltype(auto) visit(const Work &work) const
  {
    return std::visit(work, any);
  }
  std::size_t size() const
  {
    return visit([](const auto &batch) { return batch.size(); });
  }
  int dimension() const { return any.index() == 0 ? 2 : 3; }
};

// ---- arrays of callers: on the host, or on the device of a batch ------------------------------------------------------------------

namespace {

/// Where the arrays of numbers of a call may be.
enum class Arrays { OnHost, OnEither };

/// The device that an array is on; -1: the host. Throws InputError, which names the array, unless the batch can reach it.
int device_of(const rve_batch &batch, Arrays arrays, const double *array, const char *name)
{
  if (arrays == Arrays::OnHost || !array) return -1;
  const int device = rve_batch_device_number(&batch);
  require(device >= 0, [&] {
    return std::string(name) + " may not be in the memory of a device: the batch is on " +
        rve_batch_description(&batch) + "; the function without _device serves it";
  });
  return rve::is_on_device(array, name, device) ? device : -1;
}

/// Numbers that a caller gives, as the host has them.
class Given {
 public:
  Given(const rve_batch &batch, Arrays arrays, const double *array, const char *name,
        std::size_t count) :
      numbers(array)
  {
    const int device = device_of(batch, arrays, array, name);
    if (device < 0) return;
    copy.resize(count);
    rve::copy_numbers(array, copy.data(), count, device);
    numbers = copy.data();
  }
  Given(const Given &) = delete;
  Given &operator=(const Given &) = delete;

  const double *values() const { return numbers; }

 private:
  const double *numbers;
  std::vector<double> copy;
};

/// Numbers that a caller is to receive: they are written on the host, and delivered in the end.
class Wanted {
 public:
  Wanted(const rve_batch &batch, Arrays arrays, double *array_in, const char *name,
         std::size_t count) :
      array(array_in),
      device(device_of(batch, arrays, array_in, name))
  {
    if (device >= 0) copy.resize(count);
  }

  double *room() { return device >= 0 ? copy.data() : array; }
  void deliver() const
  {
    if (device >= 0) rve::copy_numbers(copy.data(), array, copy.size(), device);
  }

 private:
  double *array;
  int device;
  std::vector<double> copy;
};

int move_batch(rve_batch *batch, const size_t *which, size_t count, const double *increments,
               const double *dt, const int32_t *substeps, double *stresses, uint32_t *statuses,
               bool keeps, Arrays arrays)
{
  return guarded([&] {
    require_pointer(batch, "batch");
    if (count > 0) {
      require_pointer(increments, "increments");
      require_pointer(dt, "dt");
      require_pointer(substeps, "substeps");
    }
    const auto members = chosen(which, count, batch->size());
    const std::size_t numbers = count * batch->dimension() * batch->dimension();
    const Given given(*batch, arrays, increments, "increments", numbers);
    Wanted wanted(*batch, arrays, stresses, "stresses", numbers);
    batch->visit([&](auto &one) {
      one.run(members, given.values(), dt, substeps, wanted.room(), statuses, keeps);
    });
    wanted.deliver();
  });
}

int tell_quantity(rve_batch *batch, const char *name, const size_t *which, size_t count,
                  double *values, Arrays arrays)
{
  return guarded([&] {
    require_pointer(batch, "batch");
    require_pointer(name, "name");
    require_pointer(values, "values");
    const auto members = chosen(which, count, batch->size());
    Wanted wanted(*batch, arrays, values, "values", count);
    batch->visit([&](const auto &one) { one.quantity(name, members, wanted.room()); });
    wanted.deliver();
  });
}

int tell_affine_stiffness(rve_batch *batch, const size_t *which, size_t count, double *stiffness,
                          Arrays arrays)
{
  return guarded([&] {
    require_pointer(batch, "batch");
    require_pointer(stiffness, "stiffness");
    const auto members = chosen(which, count, batch->size());
    const std::size_t d = batch->dimension(), strains = d * (d + 1) / 2;
    Wanted wanted(*batch, arrays, stiffness, "stiffness", count * d * d * strains);
    batch->visit([&](auto &one) { one.affine_stiffness(members, wanted.room()); });
    wanted.deliver();
  });
}

}    // namespace

// ---- the interface --------------------------------------------------------------------------------------------------------------

extern "C" {

int rve_api_version(void)
{
  return 1000 * RVE_API_MAJOR + RVE_API_MINOR;
}
const char *rve_release(void)
{
  return GPU_RVE_RELEASE;
}
const char *rve_error(void)
{
  return last_error.c_str();
}

int rve_packing_read(const char *file, rve_packing **packing)
{
  return guarded([&] {
    require_pointer(packing, "packing");
    *packing = new rve_packing{read_state(file)};
  });
}

int rve_packing_write(const rve_packing *packing, const char *file)
{
  return guarded([&] {
    require_pointer(packing, "packing");
    require_pointer(file, "file");
    std::visit([&](const auto &state) { rve::write_packing(file, state); }, packing->state);
  });
}

int rve_packing_create(const char *recipe, rve_packing **packing)
{
  return guarded([&] {
    require_pointer(packing, "packing");
    const capi::Order order = capi::read_recipe(text_or_empty(recipe));
    *packing = new rve_packing{order.dimension == 3 ? prepare<3>(order) : prepare<2>(order)};
  });
}

int rve_library_read(const char *file, rve_packing **packings, size_t capacity, size_t *count)
{
  return guarded([&] {
    require_pointer(file, "file");
    require_pointer(count, "count");
    std::vector<AnyState> states = rve::dimension_of_packing(file) == 3
        ? states_of_library<3>(file)
        : states_of_library<2>(file);
    *count = states.size();
    if (!packings) return;
    require(states.size() <= capacity, [&] {
      return "capacity is " + std::to_string(capacity) + " packings; it must be at least " +
          std::to_string(states.size());
    });
    // a caller has all of them or none
    std::vector<std::unique_ptr<rve_packing>> all;
    for (AnyState &state : states)
      all.push_back(std::make_unique<rve_packing>(rve_packing{std::move(state)}));
    for (std::size_t k = 0; k < all.size(); ++k) packings[k] = all[k].release();
  });
}

int rve_packing_image(const rve_packing *packing, int image, rve_packing **seen)
{
  return guarded([&] {
    require_pointer(packing, "packing");
    require_pointer(seen, "seen");
    *seen =
        std::visit([&](const auto &state) { return new rve_packing{rve::image_of(state, image)}; },
                   packing->state);
  });
}

int rve_packing_copy(const rve_packing *packing, rve_packing **copy)
{
  return guarded([&] {
    require_pointer(packing, "packing");
    require_pointer(copy, "copy");
    *copy = new rve_packing(*packing);
  });
}

void rve_packing_free(rve_packing *packing)
{
  delete packing;
}

int rve_packing_save(const rve_packing *packing, void *bytes, size_t capacity, size_t *size)
{
  return guarded([&] {
    require_pointer(packing, "packing");
    require_pointer(size, "size");
    const std::vector<char> all =
        std::visit([](const auto &state) { return saved_packing(state); }, packing->state);
    give_bytes(all, bytes, capacity, size);
  });
}

int rve_packing_restore(const void *bytes, size_t size, rve_packing **packing)
{
  return guarded([&] {
    require_pointer(bytes, "bytes");
    require_pointer(packing, "packing");
    const char *begin = static_cast<const char *>(bytes);
    const SavedHeader header = header_of(begin, size);
    require(header.count == 1, [&] {
      return "there are " + std::to_string(header.count) + " saved RVEs; a packing is one";
    });
    *packing = header.dimension == 3 ? new rve_packing{states_in<3>(begin, header).front()}
                                     : new rve_packing{states_in<2>(begin, header).front()};
  });
}

int rve_packing_dimension(const rve_packing *packing)
{
  return packing ? dimension_of(packing->state) : 0;
}

size_t rve_packing_grains(const rve_packing *packing)
{
  if (!packing) return 0;
  return std::visit([](const auto &state) { return state.radius.size(); }, packing->state);
}

double rve_packing_void_ratio(const rve_packing *packing)
{
  if (!packing) return 0.0;
  return std::visit([](const auto &state) { return state.void_ratio(); }, packing->state);
}

int rve_packing_array(const rve_packing *packing, const char *name, double *values, size_t count)
{
  return guarded([&] {
    require_pointer(packing, "packing");
    require_pointer(name, "name");
    std::visit([&](const auto &state) { copy_out(array_named(state, name), values, count); },
               packing->state);
  });
}

int rve_packing_parameter(const rve_packing *packing, const char *keyword, double *value)
{
  return guarded([&] {
    require_pointer(packing, "packing");
    require_pointer(keyword, "keyword");
    require_pointer(value, "value");
    std::visit(
        [&](const auto &state) {
          *value = state.material.*
              capi::parameter_named(keyword, state.material.law, dimension_of(packing->state));
        },
        packing->state);
  });
}

int rve_packing_set_parameter(rve_packing *packing, const char *keyword, double value)
{
  return guarded([&] {
    require_pointer(packing, "packing");
    require_pointer(keyword, "keyword");
    std::visit(
        [&](auto &state) {
          auto changed = state;
          changed.material.*
              capi::parameter_named(keyword, state.material.law, dimension_of(packing->state)) =
              value;
          changed.check();
          state = std::move(changed);
        },
        packing->state);
  });
}

size_t rve_contact_columns(int dimension)
{
  return dimension == 2 || dimension == 3 ? 5 + 2 * static_cast<size_t>(dimension) : 0;
}

int rve_packing_contacts(const rve_packing *packing, size_t *rows)
{
  return guarded([&] {
    require_pointer(packing, "packing");
    require_pointer(rows, "rows");
    std::visit([&](const auto &state) { *rows = rve::find_contacts(state).size(); },
               packing->state);
  });
}

int rve_packing_contact_table(const rve_packing *packing, double *values, size_t count)
{
  return guarded([&] {
    require_pointer(packing, "packing");
    std::visit([&](const auto &state) { copy_out(contact_table(state), values, count); },
               packing->state);
  });
}

int rve_batch_create(const rve_packing *const *packings, size_t count, const char *options,
                     rve_batch **batch)
{
  return guarded([&] {
    require_pointer(batch, "batch");
    require_pointer(packings, "packings");
    require(count > 0, "count is 0; a batch has at least one RVE");
    for (size_t k = 0; k < count; ++k) require_pointer(packings[k], "a packing");
    const rve::Options chosen_options = capi::read_options(text_or_empty(options));
    *batch = new rve_batch{rve_packing_dimension(packings[0]) == 2
                               ? make_batch<2>(packings, count, chosen_options)
                               : make_batch<3>(packings, count, chosen_options)};
  });
}

void rve_batch_free(rve_batch *batch)
{
  delete batch;
}
int rve_batch_dimension(const rve_batch *batch)
{
  return batch ? batch->dimension() : 0;
}
size_t rve_batch_size(const rve_batch *batch)
{
  return batch ? batch->size() : 0;
}

const char *rve_batch_description(const rve_batch *batch)
{
  if (!batch) return "";
  return batch->visit([](const auto &one) { return one.text(); });
}

int rve_time_steps(rve_batch *batch, const size_t *which, size_t count, double *dt)
{
  return guarded([&] {
    require_pointer(batch, "batch");
    require_pointer(dt, "dt");
    const auto members = chosen(which, count, batch->size());
    batch->visit([&](auto &one) { one.time_steps(members, dt); });
  });
}

int rve_trial(rve_batch *batch, const size_t *which, size_t count, const double *increments,
              const double *dt, const int32_t *substeps, double *stresses, uint32_t *statuses)
{
  return move_batch(batch, which, count, increments, dt, substeps, stresses, statuses, false,
                    Arrays::OnHost);
}

int rve_advance(rve_batch *batch, const size_t *which, size_t count, const double *increments,
                const double *dt, const int32_t *substeps, double *stresses, uint32_t *statuses)
{
  return move_batch(batch, which, count, increments, dt, substeps, stresses, statuses, true,
                    Arrays::OnHost);
}

int rve_commit(rve_batch *batch)
{
  return guarded([&] {
    require_pointer(batch, "batch");
    batch->visit([](auto &one) { one.commit(); });
  });
}

int rve_revert(rve_batch *batch)
{
  return guarded([&] {
    require_pointer(batch, "batch");
    batch->visit([](auto &one) { one.revert(); });
  });
}

int rve_follow_path(rve_batch *batch, const size_t *which, size_t count, const char *path,
                    double dt, int32_t substeps, size_t calls, const char *quantities,
                    double *table, uint32_t *statuses)
{
  return guarded([&] {
    require_pointer(batch, "batch");
    require_pointer(path, "path");
    require_pointer(quantities, "quantities");
    require_pointer(table, "table");
    const auto members = chosen(which, count, batch->size());
    batch->visit([&](auto &one) {
      one.follow(members, path, dt, substeps, calls, quantities, table, statuses);
    });
  });
}

uint32_t rve_status_fatal(void)
{
  return rve::status::Fatal;
}

const char *rve_status_text(uint32_t status)
{
  thread_local std::string text;
  const int code = guarded([&] { text = rve::describe_status(status); });
  return code == RVE_SUCCESS ? text.c_str() : "";
}

int rve_quantity(rve_batch *batch, const char *name, const size_t *which, size_t count,
                 double *values)
{
  return tell_quantity(batch, name, which, count, values, Arrays::OnHost);
}

size_t rve_num_quantities(int dimension)
{
  return dimension == 2 || dimension == 3 ? macro::quantity_names(dimension).size() : 0;
}

const char *rve_quantity_name(int dimension, size_t k)
{
  if (dimension != 2 && dimension != 3) return nullptr;
  const auto &names = macro::quantity_names(dimension);
  return k < names.size() ? names[k] : "";
}

int rve_affine_stiffness(rve_batch *batch, const size_t *which, size_t count, double *stiffness)
{
  return tell_affine_stiffness(batch, which, count, stiffness, Arrays::OnHost);
}

int rve_tangents(rve_batch *batch, const size_t *which, size_t count, const char *options,
                 const double *strain_rates, double *tangents, int *measured)
{
  return guarded([&] {
    require_pointer(batch, "batch");
    require_pointer(tangents, "tangents");
    const auto members = chosen(which, count, batch->size());
    batch->visit([&](auto &one) {
      one.tangents(members, text_or_empty(options), strain_rates, tangents, measured);
    });
  });
}

int rve_batch_device_number(const rve_batch *batch)
{
  if (!batch) return -1;
  return batch->visit([](const auto &one) { return one.cuda_device(); });
}

int rve_trial_device(rve_batch *batch, const size_t *which, size_t count, const double *increments,
                     const double *dt, const int32_t *substeps, double *stresses,
                     uint32_t *statuses)
{
  return move_batch(batch, which, count, increments, dt, substeps, stresses, statuses, false,
                    Arrays::OnEither);
}

int rve_advance_device(rve_batch *batch, const size_t *which, size_t count,
                       const double *increments, const double *dt, const int32_t *substeps,
                       double *stresses, uint32_t *statuses)
{
  return move_batch(batch, which, count, increments, dt, substeps, stresses, statuses, true,
                    Arrays::OnEither);
}

int rve_quantity_device(rve_batch *batch, const char *name, const size_t *which, size_t count,
                        double *values)
{
  return tell_quantity(batch, name, which, count, values, Arrays::OnEither);
}

int rve_affine_stiffness_device(rve_batch *batch, const size_t *which, size_t count,
                                double *stiffness)
{
  return tell_affine_stiffness(batch, which, count, stiffness, Arrays::OnEither);
}

int rve_batch_packing(rve_batch *batch, size_t which, rve_packing **packing)
{
  return guarded([&] {
    require_pointer(batch, "batch");
    require_pointer(packing, "packing");
    const size_t member = chosen(&which, 1, batch->size())[0];
    *packing = batch->visit([&](const auto &one) { return new rve_packing{one.state(member)}; });
  });
}

int rve_batch_set_packing(rve_batch *batch, size_t which, const rve_packing *packing)
{
  return guarded([&] {
    require_pointer(batch, "batch");
    require_pointer(packing, "packing");
    require(rve_packing_dimension(packing) == batch->dimension(),
            "the packing has grains of another dimension than the batch");
    const size_t member = chosen(&which, 1, batch->size())[0];
    if (auto *disks = std::get_if<Batch<2>>(&batch->any))
      disks->set_state(member, std::get<rve::RveStateOf<2>>(packing->state));
    else
      std::get<Batch<3>>(batch->any)
          .set_state(member, std::get<rve::RveStateOf<3>>(packing->state));
  });
}

int rve_save(rve_batch *batch, void *bytes, size_t capacity, size_t *size)
{
  return guarded([&] {
    require_pointer(batch, "batch");
    require_pointer(size, "size");
    const std::vector<char> all = batch->visit([](const auto &one) { return one.save(); });
    give_bytes(all, bytes, capacity, size);
  });
}

int rve_restore(rve_batch *batch, const void *bytes, size_t size)
{
  return guarded([&] {
    require_pointer(batch, "batch");
    require_pointer(bytes, "bytes");
    batch->visit([&](auto &one) { one.restore(static_cast<const char *>(bytes), size); });
  });
}

}    // extern "C"
