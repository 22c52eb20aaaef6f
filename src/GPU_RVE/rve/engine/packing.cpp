// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/packing.h"

#include "rve/core/error.h"
#include "rve/core/first_error.h"
#include "rve/engine/contact_laws.h"
#include "rve/engine/contact_network.h"
#include "rve/engine/stability.h"
#include "rve/physics/grain_shape.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <numeric>
#include <random>

namespace rve {

namespace {

  /// Fractions of the cell in a loose cloud: where grains are added, and the most that random addition is asked for.
  template <int D> struct CloudFraction;
  template <> struct CloudFraction<2> {
    static constexpr double usual = 0.4, most = 0.5;    // jams at 0.55
  };
  template <> struct CloudFraction<3> {
    static constexpr double usual = 0.25, most = 0.33;    // jams at 0.38
  };

  template <int D> double initial_solid_fraction(const PackingRecipe &recipe)
  {
    return recipe.initial_solid_fraction.value_or(CloudFraction<D>::usual);
  }

  /// Places grains one by one where they touch none of those already there.
  template <int D> class RandomAddition {
   public:
    RandomAddition(RveStateOf<D> &_state, double largest_radius) : state(_state)
    {
      const double side = state.cell(0, 0);
      constexpr int MOST_BINS = D == 2 ? 1024 : 64;
      bins_per_side = std::clamp(static_cast<int>(side / (2.0 * largest_radius)), 1, MOST_BINS);
      if (bins_per_side < 3) bins_per_side = 1;    // fewer would show one bin on both sides
      std::size_t count = 1;
      for (int a = 0; a < D; ++a) count *= static_cast<std::size_t>(bins_per_side);
      bins.resize(count);
    }

    bool place(int grain, const Vec<std::uint64_t, D> &s)
    {
      Vec<int, D> here;
      for (int a = 0; a < D; ++a) {
        state.fractional[D * grain + a] = s[a];
        here[a] = bin(s[a]);
      }
      int around = 1;
      for (int a = 0; bins_per_side > 1 && a < D; ++a) around *= 3;
      for (int k = 0; k < around; ++k) {
        Vec<int, D> there = here;
        for (int a = 0, rest = k; around > 1 && a < D; ++a, rest /= 3) there[a] += rest % 3 - 1;
        for (const int other : at(there)) {
          const Vec<double, D> branch = branch_vector(state, grain, other);
          const double contact_distance = state.radius[grain] + state.radius[other];
          if (dot(branch, branch) <= contact_distance * contact_distance) return false;
        }
      }
      at(here).push_back(grain);
      return true;
    }

   private:
    RveStateOf<D> &state;
    int bins_per_side;
    std::vector<std::vector<int>> bins;

    int bin(std::uint64_t s) const { return static_cast<int>(((s >> 32) * bins_per_side) >> 32); }

    std::vector<int> &at(const Vec<int, D> &place)
    {
      std::size_t bin = 0;
      for (int a = D - 1; a >= 0; --a)
        bin = bin * bins_per_side + (place[a] + bins_per_side) % bins_per_side;
      return bins[bin];
    }
  };

  template <int D> void check_recipe(const PackingRecipe &recipe)
  {
    const auto in_range = [](double value, double least, double most, const char *what) {
      require(value >= least && value <= most,
              std::string(what) + " is " + number(value) + "; it must lie between " +
                  number(least) + " and " + number(most));
    };
    constexpr double LARGEST = 1e300;
    constexpr double LEAST = 1e-300;
    require(recipe.pressure > 0.0, [&] {
      return "pressure of the packing is " + number(recipe.pressure) +
          " [stress]; it must be greater than 0: a pressure is positive in compression, where "
          "stresses are negative";
    });
    in_range(recipe.pressure, LEAST, LARGEST, "pressure of the packing [stress]");
    in_range(recipe.preparation_friction, 0.0, LARGEST, "preparation friction [-]");
    in_range(recipe.preparation_damping, 0.0, 0.99, "preparation damping [-]");
    in_range(recipe.stress_tolerance, 1e-12, 0.5, "stress tolerance of the packing [-]");
    in_range(recipe.unbalanced_tolerance, 1e-12, 0.5,
             "unbalanced force tolerance of the packing [-]");
    in_range(initial_solid_fraction<D>(recipe), 0.01, CloudFraction<D>::most,
             "initial solid fraction [-]");
    in_range(recipe.k0, 0.01, 100.0, "ratio k0 of lateral to vertical stress [-]");
    in_range(recipe.dt, 0.0, LARGEST, "time step of the packing [time]");
    in_range(recipe.servo_gain, 0.0, LARGEST, "servo gain of the packing [1/(stress time^2)]");
    in_range(recipe.max_rate, 0.0, LARGEST, "compression rate of the packing [1/time]");
    in_range(static_cast<double>(recipe.max_steps), 1.0, LARGEST, "number of steps of the packing");
    in_range(recipe.void_ratio_tolerance, 1e-9, LARGEST, "void ratio tolerance [-]");
    if (recipe.void_ratio) in_range(*recipe.void_ratio, 1e-3, 10.0, "void ratio [-]");
    if (!recipe.radii.empty()) {
      for (const double r : recipe.radii) in_range(r, LEAST, LARGEST, "grain radius [length]");
      return;
    }
    in_range(recipe.num_grains, 1.0, INT32_MAX / 4, "number of grains");
    in_range(recipe.radius_min, LEAST, LARGEST, "smallest grain radius [length]");
    in_range(recipe.radius_max, recipe.radius_min, LARGEST, "largest grain radius [length]");
  }

  /// The search for an overlap at a pressure ends only for forces that grow with it.
  template <int D> void check_material(const PackingRecipe &recipe)
  {
    RveStateOf<D> grains;
    grains.material = recipe.material;
    grains.radius = recipe.radii;
    if (grains.radius.empty()) grains.radius = {recipe.radius_min, recipe.radius_max};
    grains.check_sizes();
  }

  double mean_radius(const PackingRecipe &recipe)
  {
    if (recipe.radii.empty()) return 0.5 * (recipe.radius_min + recipe.radius_max);
    return std::accumulate(recipe.radii.begin(), recipe.radii.end(), 0.0) /
        static_cast<double>(recipe.radii.size());
  }

  /// Before anything runs: radii, stiffness and pressure that do not fit make a packing that no soil is.
  template <int D> void check_overlap(const PackingRecipe &recipe)
  {
    const Material &material = recipe.material;
    const double radius = mean_radius(recipe);
    const double strain = contact_strain<D>(recipe.pressure, material, radius);
    const double largest_pressure = contact_pressure<D>(LARGEST_CONTACT_STRAIN, material, radius);
    const bool is_linear = has_constant_moduli<D>(material);
    const double depth = D == 2 ? material.thickness : 2.0 * radius;
    require(strain <= LARGEST_CONTACT_STRAIN, [&] {
      return "grains would overlap by about " + number(strain) + " of their diameter" +
          (is_linear ? std::string(", pressure * ") + (D == 2 ? "thickness" : "diameter") + " / kn"
                     : "") +
          "; it must be at most " + number(LARGEST_CONTACT_STRAIN) + ". With " +
          (is_linear ? "kn " + number(material.normal_stiffness) + " [force/length] and " : "") +
          (D == 2 ? "thickness " : "diameter ") + number(depth) +
          " [length] the pressure must be at most " + number(largest_pressure) +
          " [stress]; with pressure " + number(recipe.pressure) +
          (is_linear
               ? ", kn must be at least " + number(recipe.pressure * depth / LARGEST_CONTACT_STRAIN)
               : "") +
          (D == 3 ? (is_linear ? "" : " the grains must be stiffer")
                  : std::string(is_linear ? " or" : "") + " the thickness of the disks" +
                   (is_linear ? "" : " must be") + " at most " +
                   number(material.thickness * largest_pressure / recipe.pressure));
    });
  }

  Material preparation_material(const PackingRecipe &recipe, double friction)
  {
    Material material = recipe.material;
    material.friction = friction;
    // of the final material alone, set when the packing is ready: it disturbs no grain at rest
    material.rolling_friction = material.twisting_friction = material.twisting_marshall = 0.0;
    material.local_damping = recipe.preparation_damping;
    return material;
  }

  /// Before the anisotropic stress comes [stress].
  double isotropic_pressure(const PackingRecipe &recipe)
  {
    return recipe.at_rest ? START_AT_REST * recipe.pressure : recipe.pressure;
  }

  /// A stretch of a preparation: to rest at a pressure, with a friction.
  struct Leg {
    double pressure;    // [stress]
    double friction;    // [-]
    const char *phase;
    double k0 = 1.0;         // lateral over vertical stress, which is the pressure [-]
    bool at_rest = false;    // the sides are held, and the vertical stress alone has a goal

    template <int D> bool has_goal(int axis) const { return !at_rest || axis + 1 == D; }
    /// Of the stress along an axis; the vertical one is the last.
    template <int D> double goal(int axis) const { return axis + 1 < D ? k0 * pressure : pressure; }
  };

  // A time step for which bounds of others are sought as closely as for any.
  constexpr double ANY_TIME_STEP = 1e30;

  // Of two of the lightest spheres that meet with this overlap [1/time]: along the normal, and along the contact, with
  // 1/m + r^2/I = 7/2 1/m of each.
  double pair_frequency_at(const RveStateOf<3> &state, double overlap)
  {
    std::vector<double> r = state.radius;
    const std::size_t second = r.size() > 1 ? 1 : 0;
    std::nth_element(r.begin(), r.begin() + second, r.end());
    if (second == 1 && r[1] < r[0]) std::swap(r[0], r[1]);
    const ContactModuli moduli = with_law<3>(state.material, [&](const auto &law) {
      return law.stiffness({overlap, r[0], r[second]});
    });
    double per_mass = 0.0;
    for (const double radius : {r[0], r[second]})
      per_mass +=
          1.0 / (state.material.density * state.material.mass_depth * grain_volume<3>(radius));
    return std::sqrt(per_mass * std::max(moduli.normal, 3.5 * moduli.tangential));
  }

  /// A preparation from beginning to end. `peak` is the highest pressure on it.
  template <int D> struct Way {
    const RveStateOf<D> *start;
    std::vector<Leg> legs;
    double friction;    // [-]
    double peak;        // [stress]
  };

  /// A packing at rest at the end of a way, and what it is.
  template <int D> struct Specimen {
    RveStateOf<D> state;
    double void_ratio;
  };

  /// Which ways to try for a recipe: one, or as many as it takes to meet a void ratio.
  ///
  /// A packing is a discontinuous function of its preparation x: bisection finds where it passes the goal, but may find a jump
  /// there. Then the neighbourhood is sampled, wider and wider, where other jumps land elsewhere.
  template <int D> class WaySearch {
   public:
    WaySearch(const PackingRecipe &_recipe, const RveStateOf<D> &_cloud) :
        recipe(_recipe), cloud(_cloud)
    {
    }

    Way<D> first() const
    {
      return with_friction(recipe.void_ratio ? 0.0 : recipe.preparation_friction);
    }

    /// What to try after `made`; nothing if that is what was wanted. Throws InputError where no way is left.
    std::optional<Way<D>> after(const Specimen<D> &made)
    {
      if (!recipe.void_ratio) return {};
      const double goal = *recipe.void_ratio;
      const double error = std::fabs(made.void_ratio - goal);
      if (error <= recipe.void_ratio_tolerance) return {};
      switch (stage) {
        case Stage::Frictionless:
          frictionless = made;
          looser = goal > made.void_ratio;
          most = looser ? std::sqrt(LARGEST_FRICTION) : largest_log_ratio();
          stage = Stage::Extreme;
          return at(most);
        case Stage::Extreme:
          if (looser ? goal > made.void_ratio : goal < made.void_ratio) unreachable(made);
          high = most;
          stage = Stage::Between;
          x = 0.5 * (low + high);
          return at(x);
        case Stage::Between:
          break;
      }
      if (error < least_error) {
        least_error = error;
        best = made.void_ratio;
      }
      if (attempt + 1 < MOST_HALVINGS) ((made.void_ratio < goal) == looser ? low : high) = x;
      while (++attempt < MOST_HALVINGS + MOST_SAMPLES) {
        x = 0.5 * (low + high);
        if (attempt < MOST_HALVINGS) return at(x);
        const int k = attempt - MOST_HALVINGS;
        const double spacing = most / 500;
        x += (k % 2 ? 1.0 : -1.0) * (k / 2 + 1) * spacing;    // to both sides, farther and farther
        if (x > 0.0 && x < most) return at(x);
      }
      throw InputError("no packing with void ratio " + number(goal) + " within " +
                       number(recipe.void_ratio_tolerance) +
                       " was found for this seed; the closest has " + number(best) +
                       ": take another seed or a larger tolerance");
    }

   private:
    // beyond, hardly a contact slides and nothing changes
    static constexpr double LARGEST_FRICTION = 1.0;
    // at the highest pressure
    static constexpr double LARGEST_PEAK_STRAIN = 0.04;
    static constexpr int MOST_HALVINGS = 8, MOST_SAMPLES = 60;

    enum class Stage { Frictionless, Extreme, Between };

    const PackingRecipe &recipe;
    const RveStateOf<D> &cloud;
    Stage stage = Stage::Frictionless;
    Specimen<D> frictionless{};
    bool looser = true;                       // than the frictionless packing
    double x = 0.0, low = 0.0, high = 0.0;    // what is searched: see at()
    double most = 0.0;
    int attempt = 0;
    double best = 0.0, least_error = 1e300;    // of the void ratio

    /// Looser packings by friction: void ratio against its root is closest to a line, since most of the growth is below 0.2.
    /// Denser ones by the logarithm of the overconsolidation ratio.
    Way<D> at(double value) const
    {
      return looser ? with_friction(value * value) : overconsolidated(value);
    }

    /// Where the friction exceeds the final one the packing could not stand: it settles.
    Way<D> with_friction(double friction) const
    {
      const double pressure = isotropic_pressure(recipe);
      Way<D> way{&cloud, {{pressure, friction, "compression"}}, friction, recipe.pressure};
      if (friction > recipe.material.friction)
        way.legs.push_back({pressure, recipe.material.friction, "settling"});
      add_anisotropy(way);
      return way;
    }

    Way<D> overconsolidated(double log_ratio) const
    {
      const double peak = recipe.pressure * std::exp(log_ratio);
      Way<D> way{&frictionless.state,
                 {{peak, 0.0, "overconsolidation"}, {isotropic_pressure(recipe), 0.0, "unloading"}},
                 0.0,
                 peak};
      add_anisotropy(way);
      return way;
    }

    /// Grains that slide freely bear one pressure only, so the other stress comes last, with the final friction.
    void add_anisotropy(Way<D> &way) const
    {
      if (recipe.at_rest)
        way.legs.push_back({recipe.pressure, recipe.material.friction, "load at rest", 1.0, true});
      else if (recipe.k0 != 1.0)
        way.legs.push_back(
            {recipe.pressure, recipe.material.friction, "anisotropic load", recipe.k0});
    }

    double largest_log_ratio() const
    {
      const double largest_pressure =
          contact_pressure<D>(LARGEST_PEAK_STRAIN, recipe.material, mean_radius(recipe));
      return std::log(std::max(1.0, largest_pressure / recipe.pressure));
    }

    [[noreturn]] void unreachable(const Specimen<D> &extreme) const
    {
      const double reached = extreme.void_ratio, other_end = frictionless.void_ratio;
      throw InputError(
          "void ratio " + number(*recipe.void_ratio) + " cannot be reached at this pressure: the " +
          (looser ? "loosest (preparation friction 1)" : "densest (overconsolidated)") +
          " packing of this recipe has " + number(reached) + "; reachable is " +
          number(std::min(reached, other_end)) + " to " + number(std::max(reached, other_end)) +
          " on this side of the frictionless packing");
    }
  };

  /// Holds a copy of a state in the engine, and takes it out again on every way out.
  template <int D> class Lease {
   public:
    Lease(EngineOf<D> &_engine, const RveStateOf<D> &state) :
        engine(_engine), number(engine.add(state))
    {
    }
    ~Lease() { engine.remove(number); }
    Lease(const Lease &) = delete;
    Lease &operator=(const Lease &) = delete;
    int rve() const { return number; }

   private:
    EngineOf<D> &engine;
    int number;
  };

  /// The packing as it is handed out.
  template <int D> RveStateOf<D> finished(RveStateOf<D> state, const Material &material)
  {
    state.material = material;
    forget_past(state);
    return state;
  }

  /// "-sigma_xx and -sigma_yy"
  template <int D> std::string pressures(const ResultOf<D> &result)
  {
    std::string words = number(-result.stress(0, 0));
    for (int a = 1; a < D; ++a)
      words += (a + 1 < D ? ", " : " and ") + number(-result.stress(a, a));
    return words;
  }

  /// Mean lateral over vertical stress; 0 without stress.
  template <int D> double lateral_ratio(const Tensor<double, D> &stress)
  {
    const double vertical = stress(D - 1, D - 1);
    return vertical == 0.0 ? 0.0 : (trace(stress) - vertical) / ((D - 1) * vertical);
  }

  /// What helps if grains fail under unequal stresses.
  std::string remedy_of_ratio(const Leg &leg, const std::string &before)
  {
    if (leg.k0 == 1.0) return "";
    return before + " a k0 nearer 1 than " + number(leg.k0) + ", which grains of friction " +
        number(leg.friction) + " may not bear";
  }

  /// The preparation of one packing, call by call of an engine that others use too.
  template <int D> class Preparation {
   public:
    Preparation(const PackingRecipe &_recipe, EngineOf<D> &_engine) :
        recipe(_recipe), engine(_engine), cloud(loose_cloud<D>(recipe)), search(recipe, cloud)
    {
      check_overlap<D>(recipe);
    }
    Preparation(const Preparation &) = delete;
    Preparation &operator=(const Preparation &) = delete;

    void begin() { begin(search.first()); }

    bool ready() const { return !lease; }
    int rve() const { return lease->rve(); }

    DriveOf<D> next_call() const
    {
      DriveOf<D> call = drive;
      call.dt = dt;
      return call;
    }

    /// Takes the answer to a call: on with this leg, the next one or another way, or ready. Throws InputError when it failed.
    PackingReport take(const ResultOf<D> &result)
    {
      const Leg &leg = way.legs[current];
      steps += STEPS_PER_CALL;
      steps_of_leg += STEPS_PER_CALL;
      require(!(result.status & status::Fatal), [&] {
        return "packing failed after " + std::to_string(steps) +
            " steps: " + describe_status(result.status) + " (pressure " +
            number(result.mean_stress() + 0.0) + " [stress], void ratio " +
            number(result.void_ratio) + ", " + std::to_string(result.num_grains) + " grains)" +
            remedy_of_status(result.status) + remedy_of_ratio(leg, "; use");
      });
      const PackingReport report{steps,
                                 leg.phase,
                                 leg.friction,
                                 result.mean_stress(),
                                 result.void_ratio,
                                 result.coordination_number,
                                 result.unbalanced_ratio,
                                 lateral_ratio<D>(result.stress)};
      // Twice in a row: a swinging servo passes through its goal with both numbers small by chance.
      const bool is_at_rest = at_rest(result, leg);
      if (is_at_rest && was_at_rest) {
        k0 = report.k0;
        finish_leg(result.void_ratio);
        return report;
      }
      was_at_rest = is_at_rest;
      require(steps_of_leg < recipe.max_steps, [&] {
        return "packing did not come to rest at " + number(leg.pressure) + " [stress] within " +
            std::to_string(recipe.max_steps) + " steps: pressures " + pressures(result) +
            " (tolerance " + number(recipe.stress_tolerance) + "), unbalanced force ratio " +
            number(result.unbalanced_ratio) + " (tolerance " + number(recipe.unbalanced_tolerance) +
            "); use a larger tolerance, another damping_prep, or another seed" +
            remedy_of_ratio(leg, ", or");
      });
      return report;
    }

    /// The time step of the next call, where it is chosen and the leg is not new.
    bool follows_time_step() const { return lease && steps_of_leg > 0 && recipe.dt == 0.0; }
    /// From the state, or, of spheres, from the engine's bound.
    void follow_time_step(const RveStateOf<D> &state) { dt = time_step(state); }
    void follow_time_step(double bound) { dt = time_step(bound); }

    void give_up() { lease.reset(); }

    PreparedPackingOf<D> result() const
    {
      return {finished(specimen.state, recipe.material),
              way.friction,
              way.peak / recipe.pressure,
              k0,
              {}};
    }

   private:
    static constexpr int STEPS_PER_CALL = 250;

    const PackingRecipe &recipe;
    EngineOf<D> &engine;
    RveStateOf<D> cloud;
    WaySearch<D> search;
    std::unique_ptr<Lease<D>> lease;    // of the leg under way; none when ready
    Way<D> way{};
    std::size_t current = 0;    // leg of the way
    Specimen<D> specimen{};     // at the end of the last leg
    DriveOf<D> drive;
    double dt = 0.0;
    double coming_pair_frequency = 0.0;    // of spheres, in this leg
    bool was_at_rest = false;
    double k0 = 1.0;    // at the end of the last leg
    std::int64_t steps = 0, steps_of_leg = 0;

    void begin(Way<D> new_way)
    {
      way = std::move(new_way);
      current = 0;
      begin_leg(*way.start);
    }

    void begin_leg(RveStateOf<D> start)
    {
      const Leg &leg = way.legs[current];
      start.material = preparation_material(recipe, leg.friction);
      drive = servo(start, leg);
      was_at_rest = false;
      steps_of_leg = 0;
      lease.reset();
      lease = std::make_unique<Lease<D>>(engine, start);
      dt = recipe.dt > 0.0 ? recipe.dt : first_time_step(start);
    }

    void finish_leg(double void_ratio)
    {
      specimen = {engine.state(rve()), void_ratio};
      if (++current < way.legs.size()) {
        begin_leg(specimen.state);
      } else if (std::optional<Way<D>> next = search.after(specimen)) {
        begin(std::move(*next));
      } else {
        require(void_ratio > 0.0, [&] {
          return "the packing has void ratio " + number(void_ratio) +
              ", so its grains overlap by more than the pores; it must be above 0: take a larger "
              "kn, a lower pressure or a smaller thickness";
        });
        lease.reset();
      }
    }

    double first_time_step(const RveStateOf<D> &start)
    {
      if constexpr (D == 2) {
        return time_step(start);
      } else {
        coming_pair_frequency = pair_frequency_at(start, deepest_overlap(start.material));
        std::vector<double> bounds;
        engine.bound_time_steps({rve()}, ANY_TIME_STEP, bounds);
        return time_step(bounds.front());
      }
    }

    // Of two grains of the mean radius, at the highest pressure of the way [length].
    double deepest_overlap(const Material &material) const
    {
      const double radius = mean_radius(recipe);
      return 2.0 * radius *
          contact_strain<D>(std::max(recipe.pressure, way.peak), material, radius);
    }

    // Contacts that form within a call are not in Gershgorin's bound yet, so a margin is kept; a gas gets the step that its
    // grains will need in a dense network, which is about 0.55 of the step for single contacts. They are as deep as at the pressure.
    double time_step(const RveStateOf<D> &state) const
    {
      const double overlap = deepest_overlap(state.material);
      const double pair_time_step =
          2.0 / (pair_frequency(state, overlap) * std::sqrt(1.0 + state.material.local_damping));
      return std::min(0.8 * gershgorin_time_step(state, overlap), 0.5 * pair_time_step);
    }

    // The same with the engine's bound, where it found one.
    double time_step(double bound) const
    {
      const double of_pair =
          2.0 / (coming_pair_frequency * std::sqrt(1.0 + recipe.preparation_damping));
      return bound > 0.0 ? std::min(0.8 * bound, 0.5 * of_pair) : 0.5 * of_pair;
    }

    DriveOf<D> servo(const RveStateOf<D> &state, const Leg &leg) const
    {
      DriveOf<D> call;
      call.substeps = STEPS_PER_CALL;
      for (int a = 0; a < D; ++a) {
        if (!leg.has_goal<D>(a)) continue;
        call.controlled[a][a] = true;
        call.stress_goal(a, a) = -leg.goal<D>(a);
      }
      call.servo_gain = recipe.servo_gain > 0.0 ? recipe.servo_gain : default_servo_gain(state);
      call.servo_max_rate = recipe.max_rate > 0.0
          ? recipe.max_rate
          : default_compression_rate(state, isotropic_pressure(recipe));
      return call;
    }

    bool at_rest(const ResultOf<D> &result, const Leg &leg) const
    {
      bool rests =
          result.num_contacts > 0 && result.unbalanced_ratio <= recipe.unbalanced_tolerance;
      for (int a = 0; a < D; ++a) {
        if (!leg.has_goal<D>(a)) continue;
        const double goal = leg.goal<D>(a);
        rests = rests && std::fabs(-result.stress(a, a) - goal) <= recipe.stress_tolerance * goal;
      }
      return rests;
    }
  };

  template <int D> double edge_of_volume(double volume)
  {
    return D == 2 ? std::sqrt(volume) : std::cbrt(volume);
  }

  /// Time steps of the next call. Gershgorin's bounds are the host's work between two calls, so all its threads share it; spheres are
  /// bounded where they are.
  template <int D>
  void follow_time_steps(EngineOf<D> &engine, const std::vector<Preparation<D> *> &preparations)
  {
    std::vector<Preparation<D> *> following;
    for (Preparation<D> *one : preparations)
      if (one->follows_time_step()) following.push_back(one);
    if constexpr (D == 3) {
      if (following.empty()) return;
      std::vector<int> rves;
      for (const Preparation<D> *one : following) rves.push_back(one->rve());
      std::vector<double> bounds;
      engine.bound_time_steps(rves, ANY_TIME_STEP, bounds);
      for (std::size_t k = 0; k < following.size(); ++k) following[k]->follow_time_step(bounds[k]);
    } else {
      std::vector<RveStateOf<D>> states;
      for (const Preparation<D> *one : following) states.push_back(engine.state(one->rve()));
      const auto count = static_cast<std::ptrdiff_t>(following.size());
      FirstError failed;
#pragma omp parallel for schedule(dynamic, 8) if (count > 8)
      for (std::ptrdiff_t k = 0; k < count; ++k)
        failed.guard(k, [&] { following[k]->follow_time_step(states[k]); });
      failed.rethrow();
    }
  }

  /// What makes a pressure a force per length of the cell: the thickness of disks, the width of a cell of spheres [length].
  template <int D> double servo_depth(const RveStateOf<D> &state)
  {
    return D == 2 ? state.material.thickness : edge_of_volume<D>(state.cell_volume());
  }

}    // namespace

template <int D> double contact_strain(const PackingRecipe &recipe)
{
  check_recipe<D>(recipe);
  check_material<D>(recipe);
  return contact_strain<D>(recipe.pressure, recipe.material, mean_radius(recipe));
}

template <int D> double default_servo_gain(const RveStateOf<D> &state)
{
  return 10.0 * servo_depth(state) / state.mass();
}

template <int D> double default_compression_rate(const RveStateOf<D> &state, double pressure)
{
  const double mass = state.mass(), depth = servo_depth(state);
  const double radius =
      std::accumulate(state.radius.begin(), state.radius.end(), 0.0) / state.num_grains();
  const double strain = contact_strain<D>(pressure, state.material, radius);
  double stiffness = moduli_at_strain<D>(strain, state.material, radius).normal;
  if (D == 3) stiffness *= depth / (2.0 * radius);
  return std::min(0.01 * std::sqrt(stiffness / mass), 0.2 * std::sqrt(pressure * depth / mass));
}

template <int D> void forget_past(RveStateOf<D> &state)
{
  std::fill(state.velocity.begin(), state.velocity.end(), 0.0);
  std::fill(state.spin.begin(), state.spin.end(), 0.0);
  state.deformation = Tensor<double, D>::identity();
  state.servo_velocity_gradient = Tensor<double, D>::zero();
  state.counters = Counters{};
  state.energy = EnergyLedger{};
}

template <int D> RveStateOf<D> loose_cloud(const PackingRecipe &recipe)
{
  check_recipe<D>(recipe);
  // its output is fixed by the C++ standard; that of the distributions is not
  std::mt19937_64 random(recipe.seed);
  const auto uniform = [&random] { return static_cast<double>(random() >> 11) * 0x1p-53; };

  RveStateOf<D> state;
  state.material = recipe.material;
  state.radius = recipe.radii;
  if (state.radius.empty())
    for (int i = 0; i < recipe.num_grains; ++i)
      state.radius.push_back(recipe.radius_min +
                             (recipe.radius_max - recipe.radius_min) * uniform());
  const int n = state.num_grains();
  state.fractional.resize(D * n);
  state.velocity.resize(D * n, 0.0);
  state.spin.resize(Space<D>::spins * n, 0.0);
  const double side = edge_of_volume<D>(state.solid_volume() / initial_solid_fraction<D>(recipe));
  state.cell = side * Tensor<double, D>::identity();
  state.check();

  std::vector<int> order(n);
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](int i, int j) { return state.radius[i] > state.radius[j]; });
  RandomAddition<D> addition(state, state.radius[order.front()]);
  constexpr int MOST_ATTEMPTS = 1000000;
  for (const int grain : order) {
    int attempt = 0;
    while (true) {
      Vec<std::uint64_t, D> s;
      for (int a = 0; a < D; ++a) s[a] = random();
      if (addition.place(grain, s)) break;
      require(++attempt < MOST_ATTEMPTS,
              "no room for grain " + std::to_string(grain + 1) + " at initial solid fraction " +
                  number(initial_solid_fraction<D>(recipe)) + "; take a smaller one");
    }
  }
  return state;
}

template <int D>
std::vector<PreparedPackingOf<D>>
generate_packings(const std::vector<PackingRecipe> &recipes, EngineOf<D> &engine,
                  const typename PreparedPackingOf<D>::Progress &progress)
{
  std::vector<std::unique_ptr<Preparation<D>>> all;
  for (const PackingRecipe &recipe : recipes)
    all.push_back(std::make_unique<Preparation<D>>(recipe, engine));
  std::vector<PreparedPackingOf<D>> packings(recipes.size());
  std::vector<std::size_t> active(recipes.size());
  std::iota(active.begin(), active.end(), std::size_t{0});
  const auto attempt = [&](std::size_t k, const std::function<void()> &work) {
    try {
      work();
    } catch (const InputError &error) {
      packings[k].failure = error.what();
      all[k]->give_up();
    }
  };
  for (const std::size_t k : active) attempt(k, [&] { all[k]->begin(); });

  while (true) {
    std::vector<std::size_t> going;
    std::vector<Preparation<D> *> preparations;
    std::vector<int> rves;
    std::vector<DriveOf<D>> drives;
    for (const std::size_t k : active) {
      if (all[k]->ready()) continue;
      going.push_back(k);
      preparations.push_back(all[k].get());
      rves.push_back(all[k]->rve());
      drives.push_back(all[k]->next_call());
    }
    active = std::move(going);
    if (active.empty()) return packings;

    std::vector<ResultOf<D>> results;
    engine.advance(rves, drives, results);
    for (std::size_t n = 0; n < active.size(); ++n) {
      const std::size_t k = active[n];
      attempt(k, [&] {
        const PackingReport report = all[k]->take(results[n]);
        if (all[k]->ready()) packings[k] = all[k]->result();
        if (progress) progress(k, report, packings[k]);
      });
    }
    follow_time_steps(engine, preparations);
  }
}

template <int D>
RveStateOf<D> generate_packing(const PackingRecipe &recipe, EngineOf<D> &engine,
                               const PackingProgress &progress)
{
  const typename PreparedPackingOf<D>::Progress report = [&](std::size_t, const PackingReport &now,
                                                             const PreparedPackingOf<D> &) {
    if (progress) progress(now);
  };
  PreparedPackingOf<D> packing = std::move(generate_packings({recipe}, engine, report).front());
  require(packing.failure.empty(), packing.failure);
  return std::move(packing.state);
}

#define RVE_PACKING(D)                                                                            \
  template double contact_strain<D>(const PackingRecipe &);                                       \
  template double default_servo_gain(const RveStateOf<D> &);                                      \
  template double default_compression_rate(const RveStateOf<D> &, double);                        \
  template void forget_past(RveStateOf<D> &);                                                     \
  template RveStateOf<D> loose_cloud(const PackingRecipe &);                                      \
  template std::vector<PreparedPackingOf<D>> generate_packings(                                   \
      const std::vector<PackingRecipe> &, EngineOf<D> &, const PreparedPackingOf<D>::Progress &); \
  template RveStateOf<D> generate_packing(const PackingRecipe &, EngineOf<D> &,                   \
                                          const PackingProgress &);
RVE_PACKING(2)
RVE_PACKING(3)
#undef RVE_PACKING

}    // namespace rve
