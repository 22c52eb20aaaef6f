#include "rve/engine/packing.h"

#include "rve/core/error.h"
#include "rve/engine/contact_network.h"
#include "rve/engine/stability.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

namespace rve {

namespace {

  void check_recipe(const PackingRecipe &recipe)
  {
    const auto in_range = [](double value, double least, double most, const char *what) {
      require(value >= least && value <= most,
              std::string(what) + " is " + number(value) + "; it must lie between " +
                  number(least) + " and " + number(most));
    };
    constexpr double LARGEST = 1e300;
    constexpr double LEAST = 1e-300;
    in_range(recipe.pressure, LEAST, LARGEST, "packing pressure [stress]");
    in_range(recipe.preparation_friction, 0.0, LARGEST, "preparation friction [-]");
    in_range(recipe.preparation_damping, 0.0, 0.99, "preparation damping [-]");
    in_range(recipe.stress_tolerance, 1e-12, 0.5, "stress tolerance of the packing [-]");
    in_range(recipe.unbalanced_tolerance, 1e-12, 0.5,
             "unbalanced force tolerance of the packing [-]");
    in_range(recipe.initial_solid_fraction, 0.01, 0.5, "initial solid fraction [-]");
    in_range(recipe.dt, 0.0, LARGEST, "time step of the packing [time]");
    in_range(recipe.servo_gain, 0.0, LARGEST, "servo gain of the packing [1/(stress time^2)]");
    in_range(recipe.max_rate, 0.0, LARGEST, "compression rate of the packing [1/time]");
    in_range(static_cast<double>(recipe.max_steps), 1.0, LARGEST, "number of steps of the packing");
    in_range(recipe.void_ratio_tolerance, 1e-9, LARGEST, "void ratio tolerance [-]");
    if (recipe.void_ratio) in_range(*recipe.void_ratio, -0.9, 10.0, "void ratio [-]");
    if (!recipe.radii.empty()) {
      for (const double r : recipe.radii) in_range(r, LEAST, LARGEST, "grain radius [length]");
      return;
    }
    in_range(recipe.num_grains, 1.0, INT32_MAX / 4, "number of grains");
    in_range(recipe.radius_min, LEAST, LARGEST, "smallest grain radius [length]");
    in_range(recipe.radius_max, recipe.radius_min, LARGEST, "largest grain radius [length]");
  }

  /// Places grains one by one where they touch none of those already there.
  class RandomAddition {
   public:
    RandomAddition(RveState &_state, double largest_radius) : state(_state)
    {
      const double side = state.cell(0, 0);
      bins_per_side = std::clamp(static_cast<int>(side / (2.0 * largest_radius)), 1, 1024);
      if (bins_per_side < 3) bins_per_side = 1;    // fewer would show one bin on both sides
      bins.resize(static_cast<std::size_t>(bins_per_side) * bins_per_side);
    }

    bool place(int grain, std::uint64_t s_x, std::uint64_t s_y)
    {
      state.fractional[2 * grain] = s_x;
      state.fractional[2 * grain + 1] = s_y;
      const int x = bin(s_x), y = bin(s_y);
      const int reach = bins_per_side > 1 ? 1 : 0;
      for (int dy = -reach; dy <= reach; ++dy)
        for (int dx = -reach; dx <= reach; ++dx)
          for (const int other : at(x + dx, y + dy)) {
            const Vec<double, 2> branch = branch_vector(state, grain, other);
            const double contact_distance = state.radius[grain] + state.radius[other];
            if (dot(branch, branch) <= contact_distance * contact_distance) return false;
          }
      at(x, y).push_back(grain);
      return true;
    }

   private:
    RveState &state;
    int bins_per_side;
    std::vector<std::vector<int>> bins;

    int bin(std::uint64_t s) const { return static_cast<int>(((s >> 32) * bins_per_side) >> 32); }

    std::vector<int> &at(int x, int y)
    {
      const int wrapped_x = (x + bins_per_side) % bins_per_side;
      const int wrapped_y = (y + bins_per_side) % bins_per_side;
      return bins[static_cast<std::size_t>(wrapped_y) * bins_per_side + wrapped_x];
    }
  };

  Material preparation_material(const PackingRecipe &recipe, double friction)
  {
    Material material = recipe.material;
    material.friction = friction;
    material.local_damping = recipe.preparation_damping;
    return material;
  }

  /// A packing at rest on the way, and what it is.
  struct Specimen {
    RveState state;
    double void_ratio;
  };

  /// Runs compressions of one recipe and counts their steps.
  class Preparation {
   public:
    Preparation(const PackingRecipe &_recipe, Engine &_engine, const PackingProgress &_progress) :
        recipe(_recipe), engine(_engine), progress(_progress)
    {
    }

    /// Compresses `cloud` with `friction`. Where that exceeds the final friction the packing could not stand: it settles.
    Specimen compress(const RveState &cloud, double friction)
    {
      Specimen specimen = bring_to(cloud, recipe.pressure, friction, "compression");
      if (friction <= recipe.material.friction) return specimen;
      return bring_to(std::move(specimen.state), recipe.pressure, recipe.material.friction,
                      "settling");
    }

    /// Brings `start` to rest at `pressure` with `friction`.
    Specimen bring_to(RveState start, double pressure, double friction, const char *phase)
    {
      start.material = preparation_material(recipe, friction);
      Drive drive = servo(start, pressure);
      const Lease rve(engine, start);
      std::vector<Result> results(1);
      double dt = recipe.dt > 0.0 ? recipe.dt : time_step(start);
      bool was_at_rest = false;
      for (std::int64_t done = 0; done < recipe.max_steps; done += STEPS_PER_CALL) {
        drive.dt = dt;
        engine.advance({rve.id}, {drive}, results);
        const Result &result = results[0];
        steps += STEPS_PER_CALL;
        require(!(result.status & status::Fatal),
                "packing failed after " + std::to_string(steps) + " steps: " +
                    describe_status(result.status) + " (pressure " + number(result.mean_stress()) +
                    " [stress], void ratio " + number(result.void_ratio) + ", " +
                    std::to_string(result.num_grains) + " grains)");
        if (progress)
          progress({steps, phase, friction, result.mean_stress(), result.void_ratio,
                    result.coordination_number, result.unbalanced_ratio});
        // Twice in a row: a swinging servo passes through its goal with both numbers small by chance.
        const bool is_at_rest = at_rest(result, pressure);
        if (is_at_rest && was_at_rest) return {engine.state(rve.id), result.void_ratio};
        was_at_rest = is_at_rest;
        if (recipe.dt == 0.0) dt = time_step(engine.state(rve.id));
      }
      throw InputError("packing did not come to rest at " + number(pressure) + " [stress] within " +
                       std::to_string(recipe.max_steps) + " steps: pressures " +
                       number(-results[0].stress(0, 0)) + " and " +
                       number(-results[0].stress(1, 1)) + " (tolerance " +
                       number(recipe.stress_tolerance) + "), unbalanced force ratio " +
                       number(results[0].unbalanced_ratio) + " (tolerance " +
                       number(recipe.unbalanced_tolerance) + ")");
    }

   private:
    static constexpr int STEPS_PER_CALL = 250;

    // Contacts that form within a call are not in Gershgorin's bound yet, so a margin is kept; a gas gets the step that its
    // grains will need in a dense network, which is about 0.55 of the step for single contacts.
    static double time_step(const RveState &state)
    {
      const double pair_time_step =
          2.0 / (pair_frequency(state) * std::sqrt(1.0 + state.material.local_damping));
      return std::min(0.8 * gershgorin_time_step(state), 0.5 * pair_time_step);
    }

    /// Holds a copy of a state in the engine, and takes it out again on every way out.
    struct Lease {
      Engine &engine;
      int id;
      Lease(Engine &_engine, const RveState &state) : engine(_engine), id(engine.add(state)) {}
      ~Lease() { engine.remove(id); }
      Lease(const Lease &) = delete;
      Lease &operator=(const Lease &) = delete;
    };

    const PackingRecipe &recipe;
    Engine &engine;
    const PackingProgress &progress;
    std::int64_t steps = 0;

    Drive servo(const RveState &state, double pressure) const
    {
      Drive drive;
      drive.substeps = STEPS_PER_CALL;
      for (int a = 0; a < 2; ++a) {
        drive.controlled[a][a] = true;
        drive.stress_goal(a, a) = -pressure;
      }
      drive.servo_gain = recipe.servo_gain > 0.0 ? recipe.servo_gain : default_servo_gain(state);
      drive.servo_max_rate = recipe.max_rate > 0.0
          ? recipe.max_rate
          : default_compression_rate(state, recipe.pressure);
      return drive;
    }

    bool at_rest(const Result &result, double pressure) const
    {
      return result.num_contacts > 0 && result.unbalanced_ratio <= recipe.unbalanced_tolerance &&
          std::fabs(-result.stress(0, 0) - pressure) <= recipe.stress_tolerance * pressure &&
          std::fabs(-result.stress(1, 1) - pressure) <= recipe.stress_tolerance * pressure;
    }
  };

  /// The packing as it is handed out.
  RveState finished(RveState state, const Material &material)
  {
    state.material = material;
    std::fill(state.velocity.begin(), state.velocity.end(), 0.0);
    std::fill(state.spin.begin(), state.spin.end(), 0.0);
    state.deformation = Tensor2::identity();
    state.servo_velocity_gradient = Tensor2::zero();
    state.counters = Counters{};
    state.energy = EnergyLedger{};
    return state;
  }

  /// Searches x in [low, high] for a void ratio, `specimen(x)` growing or falling with x. A packing is a discontinuous function
  /// of its preparation: bisection finds where it passes the goal, but may find a jump there. Then the neighbourhood is sampled,
  /// wider and wider, where other jumps land elsewhere.
  template <class Make>
  Specimen search(double low, double high, bool growing, double goal, double tolerance,
                  Make &&specimen)
  {
    constexpr int MOST_HALVINGS = 8, MOST_SAMPLES = 60;
    const double spacing = (high - low) / 500, least = low, most = high;
    double best = 0.0, error = 1e300;
    for (int attempt = 0; attempt < MOST_HALVINGS + MOST_SAMPLES; ++attempt) {
      double x = 0.5 * (low + high);
      if (attempt >= MOST_HALVINGS) {
        const int k = attempt - MOST_HALVINGS;
        x += (k % 2 ? 1.0 : -1.0) * (k / 2 + 1) * spacing;    // to both sides, farther and farther
        if (x <= least || x >= most) continue;
      }
      Specimen made = specimen(x);
      if (std::fabs(made.void_ratio - goal) <= tolerance) return made;
      if (std::fabs(made.void_ratio - goal) < error) {
        best = made.void_ratio;
        error = std::fabs(best - goal);
      }
      if (attempt + 1 < MOST_HALVINGS) ((made.void_ratio < goal) == growing ? low : high) = x;
    }
    throw InputError("no packing with void ratio " + number(goal) + " within " + number(tolerance) +
                     " was found for this seed; the closest has " + number(best) +
                     ": take another seed or a larger tolerance");
  }

  [[noreturn]] void unreachable(double goal, const char *limit, double reached, double other_end)
  {
    throw InputError("void ratio " + number(goal) + " cannot be reached at this pressure: the " +
                     limit + " packing of this recipe has " + number(reached) + "; reachable is " +
                     number(std::min(reached, other_end)) + " to " +
                     number(std::max(reached, other_end)) +
                     " on this side of the frictionless packing");
  }

  Specimen with_void_ratio(const PackingRecipe &recipe, const RveState &cloud,
                           Preparation &preparation)
  {
    constexpr double LARGEST_FRICTION =
        1.0;    // beyond, hardly a contact slides and nothing changes
    constexpr double LARGEST_CONTACT_STRAIN =
        0.04;    // p h / k_n, about twice the mean overlap / diameter

    const double goal = *recipe.void_ratio;
    const double tolerance = recipe.void_ratio_tolerance;
    const auto with_friction = [&](double friction) {
      return preparation.compress(cloud, friction);
    };
    const Specimen frictionless = with_friction(0.0);
    if (std::fabs(frictionless.void_ratio - goal) <= tolerance) return frictionless;

    if (goal > frictionless.void_ratio) {
      const Specimen loosest = with_friction(LARGEST_FRICTION);
      if (std::fabs(loosest.void_ratio - goal) <= tolerance) return loosest;
      if (goal > loosest.void_ratio)
        unreachable(goal, "loosest (preparation friction 1)", loosest.void_ratio,
                    frictionless.void_ratio);
      // void ratio against root of friction is closest to a line: most of its growth is below 0.2
      return search(0.0, std::sqrt(LARGEST_FRICTION), true, goal, tolerance, [&](double root) {
        return with_friction(root * root);
      });
    }

    const double largest_pressure =
        LARGEST_CONTACT_STRAIN * recipe.material.normal_stiffness / recipe.material.thickness;
    const auto overconsolidated = [&](double log_ratio) {
      const double peak = recipe.pressure * std::exp(log_ratio);
      Specimen loaded = preparation.bring_to(frictionless.state, peak, 0.0, "overconsolidation");
      return preparation.bring_to(std::move(loaded.state), recipe.pressure, 0.0, "unloading");
    };
    const double largest_log_ratio = std::log(std::max(1.0, largest_pressure / recipe.pressure));
    const Specimen densest = overconsolidated(largest_log_ratio);
    if (std::fabs(densest.void_ratio - goal) <= tolerance) return densest;
    if (goal < densest.void_ratio)
      unreachable(goal, "densest (overconsolidated)", densest.void_ratio, frictionless.void_ratio);
    return search(0.0, largest_log_ratio, false, goal, tolerance, overconsolidated);
  }

}    // namespace

double default_servo_gain(const RveState &state)
{
  return 10.0 * state.material.thickness / state.mass();
}

double default_compression_rate(const RveState &state, double pressure)
{
  const double mass = state.mass();
  return std::min(0.01 * std::sqrt(state.material.normal_stiffness / mass),
                  0.2 * std::sqrt(pressure * state.material.thickness / mass));
}

RveState loose_cloud(const PackingRecipe &recipe)
{
  check_recipe(recipe);
  std::mt19937_64 random(
      recipe.seed);    // its output is fixed by the C++ standard; that of the distributions is not
  const auto uniform = [&random] {
    return static_cast<double>(random() >> 11) * 0x1p-53;
  };

  RveState state;
  state.material = recipe.material;
  state.radius = recipe.radii;
  if (state.radius.empty())
    for (int i = 0; i < recipe.num_grains; ++i)
      state.radius.push_back(recipe.radius_min +
                             (recipe.radius_max - recipe.radius_min) * uniform());
  const int n = state.num_grains();
  state.fractional.resize(2 * n);
  state.velocity.resize(2 * n, 0.0);
  state.spin.resize(n, 0.0);
  const double side = std::sqrt(state.solid_area() / recipe.initial_solid_fraction);
  state.cell = side * Tensor2::identity();
  state.check();

  std::vector<int> order(n);
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int i, int j) {
    return state.radius[i] > state.radius[j];
  });
  RandomAddition addition(state, state.radius[order.front()]);
  constexpr int MOST_ATTEMPTS = 1000000;
  for (const int grain : order) {
    int attempt = 0;
    while (true) {
      const std::uint64_t s_x = random();
      const std::uint64_t s_y = random();
      if (addition.place(grain, s_x, s_y)) break;
      require(++attempt < MOST_ATTEMPTS,
              "no room for grain " + std::to_string(grain + 1) + " at initial solid fraction " +
                  number(recipe.initial_solid_fraction) + "; take a smaller one");
    }
  }
  return state;
}

RveState generate_packing(const PackingRecipe &recipe, Engine &engine,
                          const PackingProgress &progress)
{
  const RveState cloud = loose_cloud(recipe);
  Preparation preparation(recipe, engine, progress);
  const Specimen specimen = recipe.void_ratio
      ? with_void_ratio(recipe, cloud, preparation)
      : preparation.compress(cloud, recipe.preparation_friction);
  return finished(specimen.state, recipe.material);
}

}    // namespace rve
