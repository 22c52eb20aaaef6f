// SPDX-License-Identifier: GPL-2.0-only
#include "capi/rve_batch.h"

#include "capi/saved_states.h"
#include "macro/load_path.h"
#include "macro/quantities.h"
#include "rve/core/error.h"
#include "rve/engine/drive_record.h"
#include "rve/engine/files.h"
#include "rve/engine/packing.h"
#include "rve/engine/stability.h"
#include "rve/engine/stiffening.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <optional>
#include <sstream>
#include <utility>

namespace capi {

using rve::require;

namespace {

  /// Returns the number of values of a table of doubles. Throws InputError if the table exceeds the
  /// address space.
  std::size_t size_of_table(std::size_t rows, std::size_t columns)
  {
    constexpr std::size_t most = std::numeric_limits<std::size_t>::max() / sizeof(double);
    require(rows <= most / std::max(columns, std::size_t(1)),
            "table would be larger than the address space");
    return rows * columns;
  }

  /// Returns the text of a file of a loading path. Throws InputError if it cannot be read.
  std::string text_of(const std::string &file)
  {
    rve::require_readable(file, "file of a path");
    std::ifstream stream(file);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }

  template <int D> rve::Tensor<double, D> matrix_at(const double *values, std::size_t k)
  {
    rve::Tensor<double, D> matrix;
    std::copy_n(values + k * D * D, D * D, matrix.component);
    return matrix;
  }

  /// Throws InputError, which names RVE `which`, if the drive is out of range.
  template <int D> void check_drive(std::size_t which, const rve::DriveOf<D> &drive)
  {
    try {
      rve::check(drive);
      for (int a = 0; a < D && drive.substeps == 0; ++a)
        for (int b = 0; b < D; ++b)
          require(drive.deformation(a, b) == (a == b ? 1.0 : 0.0), "increment component ", "xyz"[a],
                  "xyz"[b], " is ", drive.deformation(a, b), " with 0 substeps; it must be ",
                  a == b ? 1 : 0, ", because the RVE does not deform without substeps");
    } catch (const rve::InputError &e) {
      throw rve::InputError(rve::concat("RVE ", which, ": ", e.what()));
    }
  }

  /// Parses the paths of an order. Throws InputError unless there is one path for all RVEs or one
  /// for each.
  template <int D> macro::LoadPathsOf<D> paths_of(const PathOrder &order, std::size_t num_rves)
  {
    require(order.dt > 0.0 && std::isfinite(order.dt), "dt is ", order.dt,
            " [time]; it must be positive");
    require(order.substeps > 0, "substeps is ", order.substeps, "; it must be at least 1");
    macro::LoadPathsOf<D> paths(macro::path_words(order.path, "path"), text_of);
    require(paths.script_names().empty(), [&] {
      return "the path has v_" + paths.script_names().front() +
          "; variables are available in scripts of LAMMPS only";
    });
    require(paths.size() == 1 || paths.size() == static_cast<int>(num_rves), "there are ",
            paths.size(), " paths; there must be 1, or one for each of the ", num_rves, " RVEs");
    require(order.calls < std::numeric_limits<std::size_t>::max(), "calls is ", order.calls,
            ", which is too large");
    return paths;
  }

  /// A batch in D dimensions.
  template <int D> class Batch final : public rve_batch {
    using State = rve::RveStateOf<D>;
    using Result = rve::ResultOf<D>;
    using Drive = rve::DriveOf<D>;

   public:
    Batch(const std::vector<State> &states, rve::Options options_in) : options(options_in)
    {
      options.contacts =
          rve::contacts_of(states, [](int k) { return "packing " + std::to_string(k); });
      engine = rve::make_engine<D>(options);
      for (const State &state : states) members.push_back({engine->add(state)});
      text = engine->description();
      evaluate();
    }

    int dimension() const override { return D; }
    std::size_t size() const override { return members.size(); }
    const char *description() const override { return text.c_str(); }
    int cuda_device() const override { return engine->cuda_device(); }

    void time_steps(const Members &which, double *dt) override
    {
      std::vector<double> bounds;
      engine->bound_time_steps(numbers_of(which), std::numeric_limits<double>::max(), bounds);
      std::copy(bounds.begin(), bounds.end(), dt);
    }

    void run(const Members &which, const double *increments, const double *dt,
             const std::int32_t *substeps, double *stresses, std::uint32_t *statuses,
             bool keeps) override
    {
      std::vector<Drive> drives(which.size());
      for (std::size_t k = 0; k < which.size(); ++k) {
        drives[k].dt = dt[k];
        drives[k].substeps = substeps[k];
        drives[k].deformation = matrix_at<D>(increments, k);
      }
      if (keeps) require_no_trial();
      // all checks come first, because a call with an error must keep the earlier trials
      for (std::size_t k = 0; k < which.size(); ++k) check_drive(which[k], drives[k]);
      require_stable_steps(which, drives);
      for (const std::size_t m : which) {
        // an advance changes the committed state, so the copy of this state for trials is no longer
        // valid
        if (keeps)
          members[m].committed.reset();
        else
          return_to_committed(members[m]);
      }
      std::vector<Result> results;
      engine->advance(numbers_of(which), drives, results);
      for (std::size_t k = 0; k < which.size(); ++k) {
        Member &member = members[which[k]];
        const bool succeeded = store_result(member, results[k]);
        if (!keeps) member.has_trial = succeeded;
        if (stresses) std::copy_n(member.result.stress.component, D * D, stresses + k * D * D);
        if (statuses) statuses[k] = results[k].status;
      }
    }

    void commit() override
    {
      for (Member &member : members) {
        member.has_trial = false;
        member.committed.reset();
      }
    }

    void revert() override
    {
      for (Member &member : members)
        if (member.has_trial) return_to_committed(member);
    }

    void follow(const Members &which, const PathOrder &order, double *table,
                std::uint32_t *statuses) override
    {
      const macro::LoadPathsOf<D> paths = paths_of<D>(order, which.size());
      std::istringstream words(order.quantities);
      const std::vector<std::string> quantities{std::istream_iterator<std::string>(words), {}};
      const std::size_t row_size = size_of_table(which.size(), quantities.size());
      // the caller gets the whole table or nothing
      std::vector<double> found(size_of_table(order.calls + 1, row_size));
      require_no_trial();
      std::vector<PathRve> rves;
      for (const std::size_t m : which) {
        members[m].committed.reset();
        rves.push_back(
            {m,
             {},
             {order.dt, order.substeps, rve::default_servo_gain(engine->state(members[m].number)),
              macro::SERVO_STRAIN_PER_STEP / order.dt},
             0});
        paths.begin(rves.back().state, paths.size() == 1 ? 0 : static_cast<int>(rves.size()) - 1,
                    members[m].result.deformation);
      }
      // drive() can throw in a later stage of a path; then all RVEs return to the states that are
      // copied here
      for (const std::size_t m : which) keep_committed(members[m]);
      try {
        write_row(quantities, which, found.data());
        for (std::size_t call = 1; call <= order.calls; ++call) {
          advance_on_paths(paths, rves);
          write_row(quantities, which, found.data() + call * row_size);
        }
      } catch (...) {
        for (const std::size_t m : which) {
          members[m].has_trial = true;
          return_to_committed(members[m]);
        }
        throw;
      }
      for (const std::size_t m : which) members[m].committed.reset();
      std::copy(found.begin(), found.end(), table);
      if (statuses)
        for (const PathRve &one : rves) *statuses++ = one.status;
    }

    void quantity(const std::string &name, const Members &which, double *values) const override
    {
      macro::with_quantity_named(name, D, [&](const auto &quantity) {
        for (std::size_t k = 0; k < which.size(); ++k)
          values[k] = value_of(quantity, members[which[k]]);
      });
    }

    void affine_stiffness(const Members &which, double *stiffness) override
    {
      for (const auto &answer : evaluated<rve::ElasticResultOf<D>>(which))
        for (const auto &row : answer.stiffness.component)
          stiffness = std::copy(std::begin(row), std::end(row), stiffness);
    }

    void tangents(const Members &which, const std::string &words, const double *strain_rates,
                  double *tangents, int *measured) override
    {
      const auto [format, probing] = read_tangent_options(words, options.format);
      require(strain_rates || probing.kind == macro::TangentKind::Elastic,
              "strain_rates is a null pointer; kind loading needs strain rates");
      rve::Options of_copies = options;
      of_copies.format = format;
      of_copies.arithmetic = rve::Arithmetic::Strict;
      macro::TangentProbesOf<D> probes(rve::make_engine<D>(of_copies), probing);
      const auto answers = probes.probe(
          static_cast<int>(which.size()),
          [&](int k) { return engine->state(members[which[k]].number); },
          [&](int k) {
            return strain_rates ? matrix_at<D>(strain_rates, k) : rve::Tensor<double, D>::zero();
          });
      for (const auto &answer : answers) {
        for (const auto &row : answer.tangent.component)
          tangents = std::copy(std::begin(row), std::end(row), tangents);
        if (measured) *measured++ = answer.is_measured ? 1 : 0;
      }
    }

    AnyState state(std::size_t which) const override
    {
      return engine->state(members[which].number);
    }

    void set_state(std::size_t which, const AnyState &state) override
    {
      const int number = engine->add(std::get<State>(state));    // may throw
      engine->remove(members[which].number);
      members[which] = Member{number};
      evaluate();
    }

    std::vector<char> save() const override
    {
      return saved(D, members.size(),
                   [&](std::size_t k) { return rve::serialize(committed_state(members[k])); });
    }

    void restore(const char *bytes, std::size_t size) override
    {
      const SavedHeader header = header_of(bytes, size);
      require(header.dimension == D, "the saved RVEs have dimension ", header.dimension,
              "; the batch has dimension ", D);
      require(header.count == members.size(), "there are ", header.count,
              " saved RVEs; the batch has ", members.size());
      // all saved RVEs are added before any RVE is removed, because add() can throw
      std::vector<Member> restored;
      try {
        for (const State &state : states_in<D>(bytes, header))
          restored.push_back({engine->add(state)});
      } catch (...) {
        for (const Member &member : restored) engine->remove(member.number);
        throw;
      }
      for (const Member &member : members) engine->remove(member.number);
      members = std::move(restored);
      evaluate();
    }

   private:
    /// A state and the result of its last evaluation.
    struct Version {
      State state;
      Result result;
    };
    /// An RVE of the batch.
    struct Member {
      int number;                ///< number of the RVE in the engine
      bool has_trial = false;    ///< true if the RVE of the engine is a trial
      /// Copy of the committed state, from the first trial until the commit.
      std::optional<Version> committed = {};
      Result result = {};    ///< result of the RVE in the engine
      /// Stability bound that the last check of the committed state found [time]; 0: not checked
      /// yet. It is valid until the RVE has stiffened beyond `limit`.
      double stable_dt = 0.0;
      rve::StiffeningLimit limit = {};
      /// Contact measures of the RVE in the engine. The first request computes all of them, because
      /// one of them costs as much as all.
      mutable std::optional<rve::ContactMeasuresOf<D>> contacts = {};

      /// Returns the result of the committed state.
      const Result &committed_result() const { return has_trial ? committed->result : result; }
    };
    /// An RVE on its loading path.
    struct PathRve {
      std::size_t member;    ///< index of the RVE
      macro::PathState<D> state;
      macro::PathStep step;
      std::uint32_t status;
    };

    rve::Options options;
    std::unique_ptr<rve::EngineOf<D>> engine;
    std::vector<Member> members;
    std::string text;

    double value_of(const macro::Quantity &quantity, const Member &member) const
    {
      return quantity.of(member.result);
    }
    double value_of(const macro::ContactQuantity &quantity, const Member &member) const
    {
      if (!member.contacts) member.contacts = rve::contact_measures(engine->state(member.number));
      return quantity.of(*member.contacts);
    }

    std::vector<int> numbers_of(const Members &which) const
    {
      std::vector<int> numbers;
      for (const std::size_t m : which) numbers.push_back(members[m].number);
      return numbers;
    }

    void require_no_trial() const
    {
      require(std::none_of(members.begin(), members.end(),
                           [](const Member &member) { return member.has_trial; }),
              "an RVE has a trial, which must be committed or reverted before an advance");
    }

    /// Writes a row of the table of follow(): the quantities of one RVE after another.
    void write_row(const std::vector<std::string> &quantities, const Members &which,
                   double *row) const
    {
      std::vector<double> column(which.size());
      for (std::size_t j = 0; j < quantities.size(); ++j) {
        quantity(quantities[j], which, column.data());
        for (std::size_t k = 0; k < which.size(); ++k) row[k * quantities.size() + j] = column[k];
      }
    }

    /// Advances the RVEs whose path has not ended by one call.
    void advance_on_paths(const macro::LoadPathsOf<D> &paths, std::vector<PathRve> &rves)
    {
      std::vector<PathRve *> moving;
      Members moved;
      std::vector<Drive> drives;
      for (PathRve &one : rves) {
        if (one.state.ended || one.status & rve::status::Fatal) continue;
        moving.push_back(&one);
        moved.push_back(one.member);
        drives.push_back(
            paths.drive(one.state, one.step, nullptr, members[one.member].result.deformation));
      }
      require_stable_steps(moved, drives);
      std::vector<Result> results;
      engine->advance(numbers_of(moved), drives, results);
      for (std::size_t j = 0; j < moving.size(); ++j) {
        moving[j]->status = results[j].status;
        if (store_result(members[moved[j]], results[j]))
          paths.follow(moving[j]->state, moving[j]->step, results[j]);
      }
    }

    State committed_state(const Member &member) const
    {
      return member.has_trial ? member.committed->state : engine->state(member.number);
    }

    /// Throws InputError if the DEM steps of a drive are too long for the committed state of its
    /// RVE. RVEs whose step is at most the bound of a check that is still valid are skipped. The
    /// engine computes a lower bound of the stable step for the others. The host computes the exact
    /// stable step if the RVE has a trial or if its step exceeds the bound from the engine.
    void require_stable_steps(const Members &which, const std::vector<Drive> &drives)
    {
      Members in_engine, exactly;    // indices in `which`
      std::vector<int> numbers;
      double longest = 0.0;
      for (std::size_t k = 0; k < which.size(); ++k) {
        const Member &member = members[which[k]];
        if (drives[k].substeps == 0 || is_known_stable(member, drives[k].dt)) continue;
        if (member.has_trial) {
          exactly.push_back(k);
          continue;
        }
        in_engine.push_back(k);
        numbers.push_back(member.number);
        longest = std::max(longest, drives[k].dt);
      }
      std::vector<double> bounds;
      if (!numbers.empty()) engine->bound_time_steps(numbers, longest, bounds);
      for (std::size_t j = 0; j < in_engine.size(); ++j) {
        const std::size_t k = in_engine[j];
        if (drives[k].dt <= bounds[j])
          note_bound(members[which[k]], bounds[j]);
        else
          exactly.push_back(k);
      }
      for (const std::size_t k : exactly) require_stable_step(which[k], drives[k].dt);
    }

    /// Throws InputError if dt exceeds the exact bound of the committed state.
    void require_stable_step(std::size_t which, double dt)
    {
      Member &member = members[which];
      const double bound = rve::stable_time_step(committed_state(member));
      require(dt <= bound, "dt of RVE ", which, " is ", dt,
              " [time]; it must be at most the stability bound ", bound,
              " [time], and should be at most 0.9 of it (rve_time_steps)");
      note_bound(member, bound);
    }

    static rve::StiffnessMeasures measures(const Result &result)
    {
      return {result.num_contacts, result.peak_force, result.mean_stress()};
    }

    /// Returns true if dt is at most the bound of the last check and the RVE has not stiffened
    /// since.
    static bool is_known_stable(const Member &member, double dt)
    {
      return dt <= member.stable_dt &&
          !member.limit.is_exceeded(measures(member.committed_result()));
    }

    void note_bound(Member &member, double bound) const
    {
      const Result &result = member.committed_result();
      const bool has_constant_moduli = engine->contacts().law == rve::ContactLaw::Linear;
      member.stable_dt = bound;
      member.limit =
          rve::stiffening_limit(measures(result), result.num_grains, has_constant_moduli);
    }

    /// Stores the result of a call. Returns false if the RVE failed and keeps its earlier state.
    static bool store_result(Member &member, const Result &result)
    {
      const bool failed = result.status & rve::status::Fatal;
      if (!failed) member.result = result;
      member.result.status = result.status;
      member.contacts.reset();
      return !failed;
    }

    /// Copies the committed state from the engine unless there is a copy.
    void keep_committed(Member &member)
    {
      if (!member.committed)
        member.committed = Version{engine->state(member.number), member.result};
    }

    /// Copies the committed state unless there is a copy. If the engine has a trial, puts the
    /// committed state back into the engine.
    void return_to_committed(Member &member)
    {
      keep_committed(member);
      if (!member.has_trial) return;
      const int number = engine->add(member.committed->state);
      engine->remove(member.number);
      member.number = number;
      member.result = member.committed->result;
      member.contacts.reset();
      member.has_trial = false;
    }

    /// Returns the results of the present configurations, without a DEM step.
    template <class Answer> std::vector<Answer> evaluated(const Members &which)
    {
      Drive drive;
      drive.dt = 1.0;
      std::vector<Answer> answers;
      engine->advance(numbers_of(which), std::vector<Drive>(which.size(), drive), answers);
      return answers;
    }

    /// Evaluates the RVEs that have no result yet and stores their results.
    void evaluate()
    {
      Members fresh;
      for (std::size_t m = 0; m < members.size(); ++m)
        if (members[m].result.num_grains == 0) fresh.push_back(m);
      const std::vector<Result> results = evaluated<Result>(fresh);
      for (std::size_t k = 0; k < fresh.size(); ++k) members[fresh[k]].result = results[k];
    }
  };

  template <int D>
  std::unique_ptr<rve_batch> make_batch_of(const std::vector<const rve_packing *> &packings,
                                           const rve::Options &options)
  {
    std::vector<rve::RveStateOf<D>> states;
    for (const rve_packing *packing : packings) {
      const auto *state = std::get_if<rve::RveStateOf<D>>(&packing->state);
      require(state != nullptr, "packing 0 has ", D == 2 ? "disks" : "spheres", ", but packing ",
              states.size(), " has ", D == 2 ? "spheres" : "disks",
              "; all packings of a batch must have the same dimension");
      states.push_back(*state);
    }
    return std::make_unique<Batch<D>>(states, options);
  }

}    // namespace

std::unique_ptr<rve_batch> make_batch(const std::vector<const rve_packing *> &packings,
                                      const rve::Options &options)
{
  return dimension_of(packings.front()->state) == 2 ? make_batch_of<2>(packings, options)
                                                    : make_batch_of<3>(packings, options);
}

}    // namespace capi
