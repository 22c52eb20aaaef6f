// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/packing.h"

#include "rve/core/error.h"
#include "rve/core/first_error.h"
#include "rve/engine/contact_laws.h"
#include "rve/engine/packing_way.h"
#include "rve/engine/stability.h"
#include "rve/physics/grain_shape.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <numeric>

namespace rve {

namespace {

  /// Throws InputError if radii, stiffness and pressure give an overlap / diameter above
  /// LARGEST_CONTACT_STRAIN. Called before the preparation.
  template <int D> void check_overlap(const PackingRecipe &recipe)
  {
    const Material &material = recipe.material;
    const double radius = mean_radius(recipe);
    const double strain = contact_strain<D>(recipe.pressure, material, radius);
    const double largest_pressure = contact_pressure<D>(LARGEST_CONTACT_STRAIN, material, radius);
    const bool is_linear = has_constant_moduli<D>(material);
    const double depth = loaded_depth<D>(material, 2.0 * radius);
    if (strain <= LARGEST_CONTACT_STRAIN) return;
    const char *depth_word = D == 2 ? "thickness" : "diameter";
    std::string text =
        concat("overlap of the grains would be about ", strain, " of their diameter");
    if (is_linear) text += concat(" (pressure * ", depth_word, " / kn)");
    text += concat("; it must be at most ", LARGEST_CONTACT_STRAIN, ". With ");
    if (is_linear) text += concat("kn ", material.normal_stiffness, " [force/length] and ");
    text += concat(depth_word, " ", depth, " [length], the pressure must be at most ",
                   largest_pressure, " [stress]; with pressure ", recipe.pressure, " [stress],");
    if (is_linear)
      text += concat(" kn must be at least ", recipe.pressure * depth / LARGEST_CONTACT_STRAIN,
                     " [force/length]");
    if (D == 2)
      text +=
          concat(is_linear ? " or" : "", " the thickness of the disks", is_linear ? "" : " must be",
                 " at most ", material.thickness * largest_pressure / recipe.pressure, " [length]");
    else if (!is_linear)
      text += " the grains must be stiffer";
    throw InputError(text);
  }

  Material preparation_material(const PackingRecipe &recipe, double friction)
  {
    Material material = recipe.material;
    material.friction = friction;
    // The packing gets resistance to rolling and twisting after the preparation. This disturbs no
    // grain at rest.
    material.rolling_friction = material.twisting_friction = material.twisting_marshall = 0.0;
    material.local_damping = recipe.preparation_damping;
    return material;
  }

  // Argument `enough` of bound_time_steps() for which all bounds are accurate.
  constexpr double ANY_TIME_STEP = 1e30;

  // Returns the frequency of a contact of the two lightest spheres with this overlap [1/time]: the
  // larger of its normal and its tangential frequency. In the tangential frequency the inverse mass
  // of a sphere is 1/m + r^2/I = 7/(2 m).
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

  /// RVE in the engine, made from a state. The destructor removes the RVE.
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

  /// Returns a text with the values of the pressures along the axes: "-sigma_xx and -sigma_yy" for
  /// disks.
  template <int D> std::string pressures(const ResultOf<D> &result)
  {
    std::string words = number(-result.stress(0, 0));
    for (int a = 1; a < D; ++a)
      words += (a + 1 < D ? ", " : " and ") + number(-result.stress(a, a));
    return words;
  }

  /// Returns the ratio of the mean lateral stress to the vertical stress [-]; 0 without stress.
  template <int D> double lateral_ratio(const Tensor<double, D> &stress)
  {
    const double vertical = stress(D - 1, D - 1);
    return vertical == 0.0 ? 0.0 : (trace(stress) - vertical) / ((D - 1) * vertical);
  }

  /// Returns the remedy if grains may be unable to carry the unequal stresses of a leg; empty for
  /// equal stresses. The text begins with `before`.
  std::string remedy_of_ratio(const Leg &leg, const std::string &before)
  {
    if (leg.k0 == 1.0) return "";
    return before + " a k0 closer to 1 than " + number(leg.k0) +
        ", because grains with friction coefficient " + number(leg.friction) +
        " may not carry this ratio of stresses";
  }

  /// Preparation of one packing by successive calls of an engine. Other preparations use the same
  /// engine.
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

    /// Processes the result of a call: the leg continues, the next leg or another way begins, or
    /// the packing is ready. Throws InputError if the preparation failed.
    PackingReport take(const ResultOf<D> &result)
    {
      const Leg &leg = way.legs[current];
      steps += STEPS_PER_CALL;
      steps_of_leg += STEPS_PER_CALL;
      if (result.status & status::Fatal)
        throw InputError(concat("packing failed after ", steps,
                                " steps: ", describe_status(result.status), " (pressure ",
                                result.mean_stress() + 0.0, " [stress], void ratio ",
                                result.void_ratio, ", ", result.num_grains, " grains)",
                                remedy_of_status(result.status), remedy_of_ratio(leg, "; use")));
      const PackingReport report{steps,
                                 leg.phase,
                                 leg.friction,
                                 result.mean_stress(),
                                 result.void_ratio,
                                 result.coordination_number,
                                 result.unbalanced_ratio,
                                 lateral_ratio<D>(result.stress)};
      // The packing must be at rest after two successive calls. An oscillating servo can pass its
      // goal at a moment at which the stress error and the unbalanced ratio are small by chance.
      const bool is_at_rest = at_rest(result, leg);
      if (is_at_rest && was_at_rest) {
        k0 = report.k0;
        finish_leg(result.void_ratio);
        return report;
      }
      was_at_rest = is_at_rest;
      if (steps_of_leg >= recipe.max_steps)
        throw InputError(concat("packing did not come to rest at ", leg.pressure,
                                " [stress] within ", recipe.max_steps, " steps: pressures ",
                                pressures(result), " (tolerance ", recipe.stress_tolerance,
                                "), unbalanced force ratio ", result.unbalanced_ratio,
                                " (tolerance ", recipe.unbalanced_tolerance,
                                "); use a larger tolerance, another damping_prep, or another seed",
                                remedy_of_ratio(leg, ", or")));
      return report;
    }

    /// Returns true if the packing is not ready and its leg is not new. The time step must then be
    /// updated.
    bool follows_time_step() const { return lease && steps_of_leg > 0; }
    /// Sets the time step: for disks from the state, for spheres from the bound that the engine has
    /// computed.
    void follow_time_step(const RveStateOf<D> &state) { dt = time_step(state); }
    void follow_time_step(double bound) { dt = time_step(bound); }

    void give_up() { lease.reset(); }

    PreparedPackingOf<D> result() const
    {
      RveStateOf<D> state = specimen.state;
      state.material = recipe.material;
      forget_past(state);
      return {std::move(state), way.friction, way.peak / recipe.pressure, k0, {}};
    }

   private:
    static constexpr int STEPS_PER_CALL = 250;

    const PackingRecipe &recipe;
    EngineOf<D> &engine;
    RveStateOf<D> cloud;
    WaySearch<D> search;
    std::unique_ptr<Lease<D>> lease;    // RVE of the present leg; null when the packing is ready
    Way<D> way{};
    std::size_t current = 0;    // index of the leg
    Specimen<D> specimen{};     // state at the end of the last leg
    DriveOf<D> drive;
    double dt = 0.0;
    double coming_pair_frequency = 0.0;    // pair_frequency_at() for the leg [1/time]
    bool was_at_rest = false;
    double k0 = 1.0;    // lateral over vertical stress at the end of the last leg
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
      dt = first_time_step(start);
    }

    void finish_leg(double void_ratio)
    {
      specimen = {engine.state(rve()), void_ratio};
      if (++current < way.legs.size()) {
        begin_leg(specimen.state);
      } else if (std::optional<Way<D>> next = search.after(specimen)) {
        begin(std::move(*next));
      } else {
        require(void_ratio > 0.0, "void ratio of the packing is ", void_ratio,
                " [-]; it must be above 0, but the overlaps exceed the pore volume: use a larger "
                "kn, a lower pressure or a smaller thickness");
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

    // Returns the overlap of two grains of the mean radius at the highest pressure of the way
    // [length].
    double deepest_overlap(const Material &material) const
    {
      const double radius = mean_radius(recipe);
      return 2.0 * radius *
          contact_strain<D>(std::max(recipe.pressure, way.peak), material, radius);
    }

    // Returns the time step of the next call for disks. Gershgorin's bound does not include
    // contacts that form within a call, so the step is 0.8 of the bound. It is at most half of the
    // step for a single contact with deepest_overlap(). A packing without contacts gets this half,
    // which is short enough for a dense network: there the stable step is about 0.55 of the step
    // for a single contact.
    double time_step(const RveStateOf<D> &state) const
    {
      const double overlap = deepest_overlap(state.material);
      const double pair_time_step =
          2.0 / (pair_frequency(state, overlap) * std::sqrt(1.0 + state.material.local_damping));
      return std::min(0.8 * gershgorin_time_step(state, overlap), 0.5 * pair_time_step);
    }

    // Returns the time step of the next call for spheres, from the bound of the engine (0: none
    // found).
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
      call.servo_gain = default_servo_gain(state);
      call.servo_max_rate = default_compression_rate(state, isotropic_pressure(recipe));
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

  /// Updates the time steps of the next call. For disks the host computes Gershgorin's bounds
  /// between two calls, with all threads. For spheres the engine computes the bounds.
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

  /// Returns the length by which a pressure is multiplied to give a force per length of the cell:
  /// the thickness of disks, or the width of a cell of spheres [length].
  template <int D> double servo_depth(const RveStateOf<D> &state)
  {
    return D == 2 ? state.material.thickness : edge_of_volume<D>(state.cell_volume());
  }

}    // namespace

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
  state.energy = EnergyTotals{};
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
  template double default_servo_gain(const RveStateOf<D> &);                                      \
  template double default_compression_rate(const RveStateOf<D> &, double);                        \
  template void forget_past(RveStateOf<D> &);                                                     \
  template std::vector<PreparedPackingOf<D>> generate_packings(                                   \
      const std::vector<PackingRecipe> &, EngineOf<D> &, const PreparedPackingOf<D>::Progress &); \
  template RveStateOf<D> generate_packing(const PackingRecipe &, EngineOf<D> &,                   \
                                          const PackingProgress &);
RVE_PACKING(2)
RVE_PACKING(3)
#undef RVE_PACKING

}    // namespace rve
