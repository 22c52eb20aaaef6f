// SPDX-License-Identifier: GPL-2.0-only
// The runs with golden bits. Their initial states and drives need only sums, products, quotients
// and roots, which have the same bits on every machine. The lines marked `libm` are exceptions:
// they call the mathematical library of the host, and another library can change the last bits
// there. The results of glibc have been the same for years, on all processors.

#include "golden_scenes.h"
#include "state_hash.h"

#include "field/circulant_embedding.h"
#include "field/interpolation.h"
#include "field/marginal.h"
#include "mpm/ground_in_space.h"
#include "mpm/mohr_coulomb.h"
#include "mpm/scene.h"
#include "rve/engine/engine.h"
#include "rve/engine/packing.h"
#include "rve/engine/packing_image.h"
#include "rve/engine/packing_io.h"
#include "rve/engine/packing_library.h"
#include "rve/engine/stability.h"
#include "support/bit_hash.h"
#include "support/packings.h"
#include "support/spheres.h"

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <unistd.h>

namespace golden {

namespace {

  using namespace rve;
  using namespace rve_test;

  constexpr double DT = 5e-5;
  constexpr double PRESSURE = 1e5;

  // ---- bits and numbers of results of the engine ----

  /// Adds the results that do not depend on the Verlet list. After a fatal status it adds only the
  /// status. The number of pairs is added to the hash of lists instead. Energies have their own
  /// hash, since the engine adds losses in the order of pairs and this order depends on the Verlet
  /// list.
  template <int D> void add_result(BitHash &hash, const ResultOf<D> &r)
  {
    hash.add(r.status);
    if (r.status & status::Fatal) return;
    hash.add(r.stress).add(r.cell).add(r.deformation).add(r.fabric);
    for (const double x :
         {r.void_ratio, r.coordination_number, r.mechanical_coordination_number, r.sliding_fraction,
          r.unbalanced_ratio, r.kinetic_energy, r.elastic_energy, r.largest_overlap, r.mean_overlap,
          r.largest_contact_force})
      hash.add(x);
    hash.add(r.servo_velocity_gradient);
    for (const std::int32_t x : {r.num_grains, r.num_contacts, r.num_rattlers}) hash.add(x);
  }

  double sum_of(const std::vector<double> &values)
  {
    double sum = 0.0;
    for (const double x : values) sum += x;
    return sum;
  }

  /// Sums of the magnitudes of tangential and rolling forces in the histories of pairs.
  struct Remembered {
    double tangential = 0.0, rolling = 0.0;

    void add(const Pair &pair)
    {
      tangential += std::fabs(pair.tangential_force);
      rolling += std::fabs(pair.rolling_force);
    }
    void add(const PairOf<3> &pair)
    {
      for (int a = 0; a < 3; ++a) {
        tangential += std::fabs(pair.tangential_force[a]);
        rolling += std::fabs(pair.rolling_force[a]);
      }
    }
  };

  /// Returns a record of states; `hash` may already contain other numbers.
  template <int D>
  Record record_of_states(const std::string &name, const std::vector<RveStateOf<D>> &states,
                          BitHash hash = BitHash())
  {
    double speeds = 0.0, spins = 0.0;
    Remembered sums;
    for (const RveStateOf<D> &state : states) {
      add_state(hash, state);
      for (const double c : state.velocity) speeds += std::fabs(c);
      for (const double w : state.spin) spins += std::fabs(w);
      for (const PairOf<D> &pair : canonical_pairs(state)) sums.add(pair);
    }
    return {name,
            hash.value(),
            {{"void_ratio", states[0].void_ratio()},
             {"sum_of_speeds", speeds},
             {"sum_of_spins", spins},
             {"sum_of_tangential_forces", sums.tangential},
             {"sum_of_rolling_forces", sums.rolling},
             {"force_of_last_call", states[0].largest_contact_force}}};
  }

  // ---- the engine ----

  /// A batch of RVEs that is advanced `calls` times.
  template <int D> struct SceneOf {
    std::string name;
    Options options;
    std::vector<RveStateOf<D>> states;
    std::vector<DriveOf<D>> drives;
    int calls = 3;
    bool turns = false;    ///< every RVE rotates between the calls
  };
  using Scene = SceneOf<2>;

  Material material()
  {
    Material m;
    m.normal_stiffness = 1e6;
    m.tangential_stiffness = 8e5;
    m.friction = 0.5;
    m.density = 2650.0;
    m.local_damping = 0.3;
    m.thickness = 0.075;
    return m;
  }

  RveState small_packing(std::uint64_t seed = 1)
  {
    RveState state = triangular_packing(material(), 6, 8, 0.0037, seed);
    shake(state, 0.2, seed + 10);
    return state;
  }

  /// Returns the packing of the examples with 400 grains, with random velocities and spins.
  RveState large_packing()
  {
    RveState state = packing_of_400();
    shake(state, 0.1, 3);
    return state;
  }

  /// Returns a drive with a stretch and no rotation.
  Drive stretch(double xx, double xy, double yy, int substeps)
  {
    Drive drive;
    drive.dt = DT;
    drive.substeps = substeps;
    drive.deformation = Tensor2{{1.0 + xx, xy, xy, 1.0 + yy}};
    return drive;
  }

  Drive servo(const RveState &state, double rate, int substeps)
  {
    Drive drive;
    drive.dt = DT;
    drive.substeps = substeps;
    drive.controlled[0][0] = drive.controlled[1][1] = true;
    drive.stress_goal = Tensor2{{-PRESSURE, 0.0, 0.0, -PRESSURE}};
    drive.velocity_gradient = Tensor2{{0.0, rate, 0.0, 0.0}};
    drive.servo_gain = default_servo_gain(state);
    drive.servo_max_rate = 20.0;
    return drive;
  }

  std::vector<RveState> changed(std::vector<RveState> states,
                                const std::function<void(Material &)> &change)
  {
    for (RveState &state : states) change(state.material);
    return states;
  }

  std::vector<Scene> scenes()
  {
    const std::vector<RveState> two = {small_packing(), large_packing()};
    const std::vector<Drive> paths = {stretch(-0.003, 0.004, 0.002, 120),
                                      stretch(0.002, -0.003, -0.002, 70)};
    const std::vector<Drive> servos = {servo(two[0], 40.0, 300), servo(two[1], 40.0, 60)};
    const auto dashpots = [](Material &m) {
      m.normal_viscosity = 3.0;
      m.tangential_viscosity = 1.5;
    };
    const auto rolling = [](Material &m) {
      m.rolling_stiffness = 5e5;
      m.rolling_friction = 0.3;
    };
    const auto hertz = [](Material &m) {
      m.law = ContactLaw::Hertz;
      m.normal_stiffness = m.tangential_stiffness = 0.0;
      // The packings keep their overlaps, which belong to linear springs.
      m.hertz_stiffness = 2e9;
      m.mindlin_stiffness = 1.7e9;
      m.restitution_damping = 0.2;
      m.mindlin_damping = 0.5;
      m.mindlin_displacement = 1.0;
    };
    std::vector<Scene> all;
    const auto add = [&](const std::string &name, const std::vector<RveState> &states,
                         const std::vector<Drive> &drives) -> Scene & {
      all.push_back({name, Options(), states, drives});
      return all.back();
    };

    add("plain", two, paths);
    add("frictionless", changed(two, [](Material &m) { m.friction = 0.0; }), paths);
    add("servo", two, servos);
    add("energy", two, paths).options.track_energy = true;
    add("dashpots", changed(two, dashpots), paths);
    add("rolling", changed(two, rolling), paths);
    Scene &everything =
        add("rolling_dashpots_servo_energy", changed(changed(two, rolling), dashpots), servos);
    everything.options.track_energy = true;
    add("arms_of_lammps", two, paths).options.arms = Arms::Lammps;
    add("hertz", changed(two, hertz), servos).options.track_energy = true;
    add("hertz_without_rescaling",
        changed(changed(two, hertz),
                [](Material &m) {
                  m.mindlin_displacement = m.restitution_damping = 0.0;
                  m.viscoelastic_damping = 1e7;
                }),
        paths);
    std::vector<RveState> undamped = changed(two, hertz);
    for (RveState &state : undamped) state.material.restitution_damping = 0.0;
    undamped[0].material.mindlin_displacement = 3.0;
    add("hertz_undamped", undamped, paths);
    const auto dmt = [](Material &m) {
      m.law = ContactLaw::Dmt;
      m.restitution_damping = 0.0;
      m.normal_viscosity = 3.0;
      m.surface_energy = 100.0;
    };
    add("dmt", changed(changed(two, hertz), dmt), servos).options.track_energy = true;
    add("dmt_reach",
        changed(changed(changed(two, hertz), dmt), [](Material &m) { m.adhesion_reach = 4e-4; }),
        servos)
        .options.track_energy = true;
    add("hertz_rolling", changed(changed(two, hertz), rolling), servos).options.track_energy = true;
    add("dmt_rolling", changed(changed(changed(two, hertz), dmt), rolling), servos)
        .options.track_energy = true;

    // libm: the angle of the path
    Drive turning = paths[0];
    turning.deformation = Tensor2{{0.99, -0.25, 0.3, 0.95}};
    add("rotation", two, {turning, turning});
    Scene &rigid = add("rigid_turn", two, paths);
    rigid.turns = true;

    // The deformation is so large that the lattice is reduced. The cell is enlarged beforehand, so
    // that no overlap exceeds its limit.
    RveState loose = small_packing(2);
    loose.cell = 1.04 * loose.cell;
    Drive far = stretch(0.03, 0.25, 0.03, 600);
    Scene &reductions = add("lattice_reduction", {loose}, {far});
    reductions.calls = 5;
    // With a skin larger than the radius, some grains have more pairs than they can own. The engine
    // keeps these extra pairs in a list.
    add("rebuilds_and_extra_pairs", two, servos).options.skin = 5e-3;

    add("evaluation", two, {stretch(0.0, 0.0, 0.0, 0), stretch(0.0, 0.0, 0.0, 0)}).calls = 1;
    RveState gas = small_packing(4);
    gas.cell = 1.7 * gas.cell;
    RveState crushed = small_packing(5);
    add("gas_and_crushed", {gas, crushed},
        {stretch(-0.004, 0.0, -0.004, 150), stretch(-0.3, 0.0, -0.3, 150)});
    return all;
  }

  // ---- spheres ----

  Spheres small_spheres(unsigned seed)
  {
    Material m = material();
    m.thickness = 1.0;
    Spheres state = disordered_spheres(m, 6, seed);
    for (double &c : state.velocity) c *= 4.0;
    for (double &w : state.spin) w *= 4.0;
    return state;
  }

  DriveOf<3> spatial_stretch(const std::array<double, 6> &e, int substeps)
  {
    DriveOf<3> drive;
    drive.dt = 0.2 * DT;
    drive.substeps = substeps;
    drive.deformation =
        Tensor3{{1.0 + e[0], e[3], e[4], e[3], 1.0 + e[1], e[5], e[4], e[5], 1.0 + e[2]}};
    return drive;
  }

  DriveOf<3> spatial_servo(const Spheres &state, double rate, int substeps)
  {
    DriveOf<3> drive;
    drive.dt = 0.2 * DT;
    drive.substeps = substeps;
    for (int a = 0; a < 3; ++a) drive.controlled[a][a] = true;
    drive.stress_goal = -PRESSURE * Tensor3::identity();
    drive.velocity_gradient = Tensor3{{0.0, rate, 0.0, 0.0, 0.0, 0.5 * rate, 0.0, 0.0, 0.0}};
    drive.servo_gain = 10.0 * state.cell(0, 0) / state.mass();
    drive.servo_max_rate = 20.0;
    return drive;
  }

  std::vector<SceneOf<3>> sphere_scenes()
  {
    // The second packing has more spheres than a block has threads.
    const std::vector<Spheres> two = {small_spheres(1), [] {
                                        Material m = material();
                                        m.thickness = 1.0;
                                        return disordered_spheres(m, 9, 2);
                                      }()};
    const std::vector<DriveOf<3>> paths = {
        spatial_stretch({-0.003, 0.002, -0.004, 0.004, 0.002, -0.003}, 120),
        spatial_stretch({0.002, -0.003, -0.002, -0.002, 0.003, 0.001}, 60)};
    const std::vector<DriveOf<3>> servos = {spatial_servo(two[0], 40.0, 200),
                                            spatial_servo(two[1], 40.0, 60)};
    std::vector<SceneOf<3>> all;
    const auto add = [&](const std::string &name, const std::vector<Spheres> &states,
                         const std::vector<DriveOf<3>> &drives) -> SceneOf<3> & {
      all.push_back({"spheres_" + name, Options(), states, drives});
      return all.back();
    };

    add("path", two, paths);
    SceneOf<3> &everything = add("dashpots_servo_energy", two, servos);
    everything.options.track_energy = true;
    for (Spheres &state : everything.states) {
      state.material.normal_viscosity = 3.0;
      state.material.tangential_viscosity = 1.5;
    }
    add("rebuilds_and_extra_pairs", two, servos).options.skin = 4e-3;
    // libm: the rotation of the path
    DriveOf<3> turning = paths[0];
    turning.deformation = Tensor3{{0.97, -0.2, 0.1, 0.25, 0.95, -0.15, -0.05, 0.2, 0.98}};
    add("rotation", two, {turning, turning}).turns = true;
    DriveOf<3> far = spatial_stretch({}, 600);
    far.deformation(0, 1) = far.deformation(0, 2) = 0.3;
    add("lattice_reduction", {small_spheres(3)}, {far}).calls = 5;

    const auto of_law = [&](ContactLaw law, double displacement, bool resists) {
      std::vector<Spheres> states = two;
      for (Spheres &state : states) {
        Material &m = state.material;
        if (law != ContactLaw::Linear) {
          m.law = law;
          m.normal_stiffness = m.tangential_stiffness = 0.0;
          m.hertz_stiffness = 2e9;
          m.mindlin_stiffness = 1.7e9;
          m.normal_viscosity = 1.0;
          m.mindlin_damping = 0.5;
          m.mindlin_displacement = displacement;
        }
        if (law == ContactLaw::Dmt) m.surface_energy = 20.0;
        if (resists) {
          m.rolling_stiffness = 5e5;
          m.rolling_friction = 0.2;
          m.twisting_stiffness = 3.0;
          m.twisting_friction = 3e-4;
        }
      }
      return states;
    };
    add("rolling_and_twisting", of_law(ContactLaw::Linear, 0.0, true), paths);
    add("hertz", of_law(ContactLaw::Hertz, 1.0, false), servos).options.track_energy = true;
    add("hertz_rolling_and_twisting", of_law(ContactLaw::Hertz, 0.0, true), paths).turns = true;
    std::vector<Spheres> undamped = of_law(ContactLaw::Hertz, 3.0, false);
    for (Spheres &state : undamped) state.material.normal_viscosity = 0.0;
    undamped[1].material.mindlin_displacement = 1.0;
    add("hertz_undamped", undamped, paths);
    // These states use the kernel variant without contact radii.
    for (Spheres &state : undamped) state.material.mindlin_displacement = 0.0;
    add("hertz_without_rescaling", undamped, paths);
    add("dmt", of_law(ContactLaw::Dmt, 2.0, false), paths);
    add("dmt_rolling_and_twisting", of_law(ContactLaw::Dmt, 3.0, true), paths);
    std::vector<Spheres> reaching = of_law(ContactLaw::Dmt, 1.0, true);
    for (Spheres &state : reaching) state.material.adhesion_reach = 4e-4;
    add("dmt_reach", reaching, servos).options.track_energy = true;
    return all;
  }

  /// Returns a rotation from the triangle 3-4-5, whose components need no library function. In
  /// space it is combined with a quarter turn about a second axis.
  template <int D> Tensor<double, D> quarter_or_so()
  {
    if constexpr (D == 2)
      return {{0.8, -0.6, 0.6, 0.8}};
    else
      return {{0.8, -0.6, 0.0, 0.0, 0.0, -1.0, 0.6, 0.8, 0.0}};
  }

  template <int D> std::string run_name(const SceneOf<D> &scene, Format format)
  {
    return "engine/" + scene.name + "/" + to_string(format) + "/";
  }

  template <int D>
  void run(const SceneOf<D> &scene, Format format, rve::Device device, std::vector<Record> &records)
  {
    Options options = scene.options;
    options.format = format;
    options.device = device;
    options.threads = 2;
    options.contacts = contacts_of(scene.states);
    const auto engine = make_engine<D>(options);
    std::vector<int> rves;
    for (const RveStateOf<D> &state : scene.states) rves.push_back(engine->add(state));

    BitHash results, responses, stiffness, lists, totals;
    // Without bookkeeping all energies are zero.
    BitHash &energies = options.track_energy ? totals : results;
    std::vector<ElasticResultOf<D>> answers;
    std::vector<ResponseOf<D>> short_answers;
    double stiffness_xx = 0.0;
    for (int call = 0; call < scene.calls; ++call) {
      engine->advance(rves, scene.drives, answers);
      for (const ElasticResultOf<D> &answer : answers) {
        add_result(results, answer.result);
        if (answer.result.status & status::Fatal) continue;
        stiffness.add(answer.stiffness);
        lists.add(answer.result.num_pairs);
        energies.add(answer.result.energy);
      }
      stiffness_xx = answers[0].stiffness.component[0][0];
      if (scene.turns)
        engine->turn(rves, std::vector<Tensor<double, D>>(rves.size(), quarter_or_so<D>()));
    }
    Counters counters;
    for (const ElasticResultOf<D> &answer : answers) {
      counters.steps += answer.result.counters.steps;
      counters.rebuilds += answer.result.counters.rebuilds;
      counters.lattice_reductions += answer.result.counters.lattice_reductions;
      counters.repeats += answer.result.counters.repeats;
    }
    std::vector<RveStateOf<D>> states;
    for (const int rve : rves) states.push_back(engine->state(rve));
    lists.add(counters);
    for (const RveStateOf<D> &state : states) {
      add_list(lists, state);
      energies.add(state.energy);
    }
    // A call that returns responses instead of full results takes another path through the engine.
    // It comes last, so that it does not change the recorded states.
    engine->advance(rves, scene.drives, short_answers);
    for (const ResponseOf<D> &answer : short_answers) {
      responses.add(answer.status);
      if (!(answer.status & status::Fatal)) responses.add(answer.num_contacts).add(answer.stress);
    }

    const std::string name = run_name(scene, format);
    const ResultOf<D> &last = answers[0].result;
    records.push_back(record_of_states(name + "states", states));
    records.push_back({name + "lists",
                       lists.value(),
                       {{"steps", static_cast<double>(counters.steps)},
                        {"rebuilds", static_cast<double>(counters.rebuilds)},
                        {"lattice_reductions", static_cast<double>(counters.lattice_reductions)},
                        {"repeats", static_cast<double>(counters.repeats)},
                        {"pairs", static_cast<double>(states[0].pairs.size())}}});
    records.push_back({name + "results",
                       results.value(),
                       {{"p", last.mean_stress()},
                        {"q", last.deviatoric_stress()},
                        {"void_ratio", last.void_ratio},
                        {"coordination_number", last.coordination_number},
                        {"kinetic_energy", last.kinetic_energy},
                        {"elastic_energy", last.elastic_energy}}});
    if (options.track_energy)
      records.push_back({name + "ledger",
                         totals.value(),
                         {{"work", last.energy.work},
                          {"friction", last.energy.friction},
                          {"local_damping", last.energy.local_damping},
                          {"viscous", last.energy.viscous}}});
    records.push_back({name + "stiffness", stiffness.value(), {{"C_xxxx", stiffness_xx}}});
    records.push_back(
        {name + "short_answers", responses.value(), {{"p", -trace(short_answers[0].stress) / D}}});
  }

  void prepare_packing(Format format, rve::Device device, std::vector<Record> &records)
  {
    Options options;
    options.format = format;
    options.device = device;
    options.threads = 2;
    PackingRecipe recipe;
    recipe.material = material();
    recipe.pressure = PRESSURE;
    recipe.seed = 7;
    recipe.num_grains = 40;
    recipe.radius_min = 0.003;
    recipe.radius_max = 0.005;
    recipe.preparation_friction = 0.2;
    const auto engine = make_engine(options);
    const RveState state = generate_packing(recipe, *engine);
    const std::string name = "packing/" + to_string(format);
    records.push_back(record_of_states<2>(name, {state}, BitHash().add(state.energy)));
    BitHash lists;
    add_list(lists, state);
    records.push_back(
        {name + "/lists", lists.value(), {{"pairs", static_cast<double>(state.pairs.size())}}});
  }

  // ---- the material point method ----

  /// Runs a block of ground with two material laws. A footing moves down into it, a traction acts
  /// on the surface next to the footing, and a plate above the ground moves to the right.
  void run_mpm(mpm::Scheme scheme, mpm::ShapeFunction shape, Device device,
               std::vector<Record> &records)
  {
    constexpr double CELL = 0.05, STEP = 2e-4;
    constexpr int STEPS = 50;
    mpm::SolverOptions<2> options = mpm_test::grid_options({{0.0, 0.0}}, {{1.2, 1.0}}, CELL);
    options.scheme = scheme;
    options.shape = shape;
    options.damping = shape == mpm::ShapeFunction::Gimp ? 0.05 : 0.0;
    options.flip = 0.99;
    options.sides = {mpm::SideKind::Roller, mpm::SideKind::Roller, mpm::SideKind::Fixed,
                     mpm::SideKind::Free};
    options.rigid_bodies.resize(2);
    options.rigid_bodies[1].face = mpm::Face::XHi;
    options.rigid_bodies[1].rough = false;
    options.rigid_bodies[1].separation = true;
    options.threads = 2;
    options.device = device == Device::Cuda ? mpm::Device::Cuda : mpm::Device::Cpu;

    mpm_test::Scene scene;
    scene.add_block({{0.0, 0.0}}, {{1.2, 0.8}}, 0.5 * CELL, 2000.0);
    const int ground = scene.size();
    scene.add_block({{0.0, 0.8}}, {{0.3, 0.85}}, CELL, 2000.0);
    const int footing = scene.size();
    scene.add_block({{0.5, 0.8}}, {{0.55, 0.95}}, CELL, 2000.0);
    Random random(5);
    std::vector<mpm::TractionLoad<2>> loads(1);
    loads[0].traction = {{1e3, -20e3}};
    for (int p = 0; p < scene.size(); ++p) {
      scene.rigid_body[p] = p < ground ? -1 : p < footing ? 0 : 1;
      scene.model[p] = scene.position[3 * p + 1] > 0.4 ? 1 : 0;
      for (int a = 0; a < 2; ++a) scene.velocity[3 * p + a] = random.uniform(-0.01, 0.01);
      scene.body_force[3 * p + 1] = -9.81 * scene.mass[p];
      scene.stress[p] = Tensor2{{-20e3, 0.0, 0.0, -20e3}};
      if (p < ground && scene.position[3 * p + 1] > 0.8 - 0.5 * CELL && scene.position[3 * p] > 0.6)
        loads[0].point_index.push_back(p);
    }

    mpm::LinearElastic<2> elastic(10e6, 0.3);
    mpm::MohrCoulomb<2> frictional(10e6, 0.3, 2e3, 30.0, 5.0);    // libm: its two angles
    scene.begin_memory(frictional);
    mpm::MpmSolver<2> solver(options);
    solver.set_models({&elastic, &frictional});
    solver.set_body_velocity(0, {{0.0, -0.2}});
    solver.set_body_velocity(1, {{0.05, 0.0}});
    for (int step = 0; step < STEPS; ++step) solver.step(scene.view(), loads, STEP);
    solver.fetch(scene.view());

    BitHash hash;
    hash.add(scene.position).add(scene.velocity).add(scene.volume).add(scene.stress);
    std::vector<std::array<double, 2>> memory;
    for (int p = 0; p < scene.size(); ++p) memory.push_back({scene.row(p)[0], scene.row(p)[1]});
    hash.add(scene.deformation_gradient).add(scene.velocity_gradient).add(memory);
    double pressure = 0.0, plastic = 0.0;
    for (int p = 0; p < ground; ++p) {
      pressure -= 0.5 * trace(scene.stress[p]) / ground;
      plastic += scene.row(p)[mpm::MohrCoulomb<2>::PlasticStrain] / ground;
    }
    const mpm::Vec2 reaction = solver.body_reaction(0);
    const double unbalanced = solver.max_unbalanced_force();
    const std::string name = std::string("mpm/") +
        (scheme == mpm::Scheme::Musl ? "musl" : "usavg") + "/" +
        (shape == mpm::ShapeFunction::Gimp ? "gimp" : "linear") + "/";
    records.push_back({name + "points",
                       hash.value(),
                       {{"mean_pressure", pressure},
                        {"mean_plastic_strain", plastic},
                        {"sum_of_positions", sum_of(scene.position)},
                        {"sum_of_velocities", sum_of(scene.velocity)}}});
    BitHash forces;
    forces.add(reaction).add(unbalanced).add(solver.body_reaction(1));
    for (const mpm::Face side : {mpm::Face::XLo, mpm::Face::XHi, mpm::Face::YLo, mpm::Face::YHi})
      forces.add(solver.side_reaction(side));
    records.push_back({name + "forces",
                       forces.value(),
                       {{"reaction_y", reaction[1]}, {"unbalanced", unbalanced}}});
  }

  /// Runs the three-dimensional ground of the MPM tests (GroundInSpace) from random velocities,
  /// which need no library function.
  void run_mpm_in_space(mpm::Scheme scheme, mpm::ShapeFunction shape, Device device,
                        std::vector<Record> &records)
  {
    constexpr int STEPS = 20;
    using Ground = mpm_test::GroundInSpace;
    const bool gimp = shape == mpm::ShapeFunction::Gimp;
    Ground ground({scheme, shape, gimp ? 0.05 : 0.0, 0.99, gimp, !gimp});
    ground.options.threads = 2;
    ground.options.device = device == Device::Cuda ? mpm::Device::Cuda : mpm::Device::Cpu;
    Random random(5);
    for (double &velocity : ground.scene.velocity) velocity = random.uniform(-0.05, 0.05);
    mpm::MpmSolver<3> solver = ground.solver();
    for (int step = 0; step < STEPS; ++step)
      solver.step(ground.scene.view(), ground.loads, Ground::STEP);
    mpm_test::SceneOf<3> &scene = ground.scene;
    solver.fetch(scene.view());

    BitHash hash;
    hash.add(scene.position).add(scene.velocity).add(scene.volume).add(scene.stress);
    hash.add(scene.deformation_gradient).add(scene.velocity_gradient).add(scene.memory);
    double pressure = 0.0, plastic = 0.0;
    for (int p = 0; p < scene.size(); ++p) {
      if (scene.rigid_body[p] >= 0) continue;
      pressure -= trace(scene.stress[p]) / 3.0 / scene.size();
      plastic += scene.row(p)[mpm::MohrCoulomb<3>::PlasticStrain] / scene.size();
    }
    const std::string name = std::string("mpm_in_space/") +
        (scheme == mpm::Scheme::Musl ? "musl" : "usavg") + "/" + (gimp ? "gimp" : "linear") + "/";
    records.push_back({name + "points",
                       hash.value(),
                       {{"sum_of_pressures", pressure},
                        {"sum_of_plastic_strains", plastic},
                        {"sum_of_positions", sum_of(scene.position)},
                        {"sum_of_velocities", sum_of(scene.velocity)}}});
    const std::vector<double> numbers = ground.numbers(solver);
    records.push_back({name + "forces",
                       BitHash().add(numbers).value(),
                       {{"reaction_z", solver.body_reaction(Ground::FOOTING)[2]},
                        {"unbalanced", solver.max_unbalanced_force()}}});
  }

  /// Features of the material point method that run_mpm_feature() can run.
  enum class MpmFeature { BoxesThatFollow, MeanDilation, DrivenBody, AbsorbingSides, ConvexBody };

  bool has_body(MpmFeature feature)
  {
    return feature == MpmFeature::DrivenBody || feature == MpmFeature::ConvexBody;
  }

  /// Runs a layer of frictional ground with one feature that the runs above do not use:
  ///   BoxesThatFollow   boxes of points that stretch and shear over several cells
  ///   MeanDilation      mean dilation over cells with several points
  ///   DrivenBody        a tilted box that falls on the layer, moved only by weight and contact
  ///   AbsorbingSides    sides that absorb waves
  ///   ConvexBody        a triangle or tetrahedron that lands on its tip
  template <int D>
  void run_mpm_feature(MpmFeature feature, Device device, std::vector<Record> &records)
  {
    constexpr double CELL = 0.1, STEP = 4e-4, DENSITY = 2000.0, YOUNG = 10e6;
    constexpr int STEPS = 40;
    const auto corner = [](double across, double height) {
      mpm::Vec<D> place;
      for (int a = 0; a < D; ++a) place[a] = a == D - 1 ? height : across;
      return place;
    };
    mpm::SolverOptions<D> options =
        mpm_test::grid_options_of<D>(corner(0.0, 0.0), corner(1.0, 1.0), CELL);
    for (int side = 0; side < mpm::FACES<D> - 1; ++side)
      options.sides[side] = mpm::SideKind::Roller;
    options.flip = 0.99;
    options.threads = 2;
    options.device = device == Device::Cuda ? mpm::Device::Cuda : mpm::Device::Cpu;

    mpm_test::SceneOf<D> scene;
    scene.add_block(corner(0.0, 0.0), corner(1.0, 0.5), 0.5 * CELL, DENSITY);
    const int ground = scene.size();
    Random random(7);
    for (int p = 0; p < ground; ++p) {
      for (int a = 0; a < D; ++a) scene.velocity[3 * p + a] = random.uniform(-0.05, 0.05);
      scene.stress[p] = -20e3 * mpm::Tensor<D>::identity();
    }

    std::string name = D == 2 ? "mpm_features/plane/" : "mpm_features/space/";
    if (feature == MpmFeature::BoxesThatFollow) {
      name += "boxes_that_follow/";
      options.shape = mpm::ShapeFunction::Cpgimp;
      for (int p = 0; p < ground; ++p) {
        mpm::Tensor<D> &F = scene.deformation_gradient[p];
        for (int k = 0; k < D * D; ++k) F.component[k] = random.uniform(-0.4, 0.4);
        for (int a = 0; a < D; ++a)
          F(a, a) = a == 0 ? random.uniform(1.5, 3.0) : random.uniform(0.7, 1.0);
        scene.volume[p] = determinant(F) * scene.initial_volume[p];
      }
    } else if (feature == MpmFeature::MeanDilation) {
      name += "mean_dilation/";
      options.mean_dilation = true;
      options.scheme = mpm::Scheme::Usavg;
    } else if (has_body(feature)) {
      name += feature == MpmFeature::ConvexBody ? "convex_body/" : "driven_body/";
      scene.add_block(corner(0.3, 0.5), corner(0.6, 0.8), CELL, DENSITY);
      options.rigid_bodies.resize(1);
      mpm::RigidBodyOptions &body = options.rigid_bodies[0];
      body.form = mpm::BodyForm::Box;
      if (feature == MpmFeature::ConvexBody) {
        body.form = mpm::BodyForm::Convex;
        if constexpr (D == 2)
          options.rigid_body_vertices = {{{{0.43, 0.45}}, {{0.72, 0.87}}, {{0.21, 0.83}}}};
        else
          options.rigid_body_vertices = {{{{0.43, 0.43, 0.28}},
                                          {{0.75, 0.5, 0.87}},
                                          {{0.3, 0.75, 0.85}},
                                          {{0.25, 0.2, 0.83}}}};
      }
      body.rough = false;
      body.separation = true;
      body.friction = 0.4;
      body.free = (1 << mpm::FREEDOMS<D>) -1;
      body.turned[0] = 0.1;    // about x in space, so that the body lands on an edge
      for (int p = ground; p < scene.size(); ++p) {
        scene.rigid_body[p] = 0;
        scene.velocity[3 * p] = 0.5;
        scene.velocity[3 * p + D - 1] = -1.0;
        scene.body_force[3 * p + D - 1] = -9.81 * scene.mass[p];
      }
    } else {
      name += "absorbing_sides/";
      // The moduli of the layer are E (1 - ν)/((1 + ν)(1 - 2ν)) = 1.35 E and E/(2 (1 + ν)).
      const mpm::Dashpots of_layer = {std::sqrt(1.35 * YOUNG / DENSITY),
                                      std::sqrt(YOUNG / 2.6 / DENSITY)};
      for (int side = 0; side < 2; ++side) {
        options.sides[side] = mpm::SideKind::Free;
        options.dashpots[side] = of_layer;
      }
      options.dashpots[2 * (D - 1)] = {
          0.0, of_layer.tangential};    // side below the layer, which rests on a roller
    }

    mpm::MohrCoulomb<D> law(YOUNG, 0.3, 2e3, 30.0,
                            5.0);    // libm: angles of friction and dilation, rotation of a body
    scene.begin_memory(law);
    mpm::MpmSolver<D> solver(options);
    solver.set_models({&law});
    for (int step = 0; step < STEPS; ++step) solver.step(scene.view(), {}, STEP);
    solver.fetch(scene.view());

    BitHash hash;
    hash.add(scene.position).add(scene.velocity).add(scene.volume).add(scene.stress);
    hash.add(scene.deformation_gradient).add(scene.velocity_gradient).add(scene.memory);
    double pressure = 0.0, plastic = 0.0;
    for (int p = 0; p < ground; ++p) {
      pressure -= trace(scene.stress[p]) / D / ground;
      plastic += scene.row(p)[mpm::MohrCoulomb<D>::PlasticStrain] / ground;
    }
    records.push_back({name + "points",
                       hash.value(),
                       {{"mean_pressure", pressure},
                        {"mean_plastic_strain", plastic},
                        {"sum_of_positions", sum_of(scene.position)},
                        {"sum_of_velocities", sum_of(scene.velocity)}}});
    BitHash forces;
    const double unbalanced = solver.max_unbalanced_force();
    forces.add(unbalanced);
    for (int side = 0; side < mpm::FACES<D>; ++side)
      forces.add(solver.side_reaction(static_cast<mpm::Face>(side)));
    std::vector<std::pair<std::string, double>> numbers = {
        {"unbalanced", unbalanced}, {"side_reaction", solver.side_reaction(mpm::Face::XLo)[0]}};
    if (has_body(feature)) {
      forces.add(solver.body_reaction(0)).add(solver.rigid_bodies().record(0));
      numbers.push_back({"reaction", solver.body_reaction(0)[D - 1]});
      numbers.push_back({"spin", solver.rigid_bodies().rates(0)[D]});
    }
    records.push_back({name + "forces", forces.value(), numbers});
  }

  template <int D> void run_mpm_features(Device device, std::vector<Record> &records)
  {
    for (const MpmFeature feature :
         {MpmFeature::BoxesThatFollow, MpmFeature::MeanDilation, MpmFeature::DrivenBody,
          MpmFeature::AbsorbingSides, MpmFeature::ConvexBody})
      run_mpm_feature<D>(feature, device, records);
  }

  // ---- results of the host ----

  void bounds_and_images(std::vector<Record> &records)
  {
    RveState state = small_packing();
    state.material.normal_viscosity = 3.0;
    BitHash images;
    for (int k = 0; k < NUM_IMAGES; ++k) add_state(images, image_of(state, k));
    records.push_back(
        {"host/packing_images", images.value(), {{"void_ratio", image_of(state, 5).void_ratio()}}});

    const double dt = stable_time_step(state), cheap = gershgorin_time_step(state),
                 pair = pair_frequency(state);
    records.push_back({"host/stable_time_step",
                       BitHash().add(dt).add(cheap).add(pair).value(),
                       {{"dt", dt}, {"dt_by_gershgorin", cheap}, {"pair_frequency", pair}}});
  }

  void random_field(std::vector<Record> &records)
  {
    // libm. FFTW also uses different instructions on different processors. The values are therefore
    // rounded to 2^-20 of the standard deviation.
    const field::Grid grid = field::Grid::covering({0.0, 0.0}, {8.0, 4.0}, {0.25, 0.25});
    const field::Covariance covariance{field::Exponential(), field::Anisotropy({2.0, 1.0})};
    field::CirculantEmbedding embedding(grid, covariance);
    const std::vector<double> values = embedding.sample(11);
    BitHash hash;
    for (const double x : values) hash.add(static_cast<std::int64_t>(std::nearbyint(x * 0x1p20)));
    const auto rounded = [](double x) { return std::nearbyint(x * 0x1p20) * 0x1p-20; };
    records.push_back({"host/random_field",
                       hash.value(),
                       {{"first", rounded(values.front())}, {"last", rounded(values.back())}}});
  }

  /// Returns the bytes of a file that `write` creates at a path.
  std::string bytes_of_file(const std::function<void(const std::string &)> &write)
  {
    const std::filesystem::path folder = std::filesystem::temp_directory_path() /
        ("golden_bits_" + std::to_string(static_cast<long>(getpid())));
    std::filesystem::create_directories(folder);
    const std::string path = (folder / "file").string();
    write(path);
    std::stringstream text;
    text << std::ifstream(path, std::ios::binary).rdbuf();
    std::filesystem::remove_all(folder);
    return text.str();
  }

  void layouts(std::vector<Record> &records)
  {
    // The state has a value for everything that a record or a file can hold. The values are made
    // up; no engine computes them.
    RveState state = small_packing(6);
    state.material.rolling_stiffness = 5e5;
    state.material.rolling_friction = 0.3;
    state.deformation = Tensor2{{1.1, 0.03, -0.01, 0.9}};
    state.servo_velocity_gradient = Tensor2{{0.1, 0.2, 0.0, -0.3}};
    state.largest_contact_force = 12.5;
    state.list_cell = state.cell;
    state.list_fractional = state.fractional;
    for (int i = 0; i < state.num_grains(); ++i) state.order.push_back(i);
    for (int i = 0; i + 1 < state.num_grains(); ++i)
      state.pairs.push_back({i, i + 1, 0.1 * i, -0.3 * i});
    state.counters = {11, 7, 3, 2};
    state.energy = {0.1, 0.2, 0.3, 0.4};
    state.check();

    const std::vector<char> image = serialize(state);
    records.push_back({"layout/record_of_a_state",
                       BitHash().add(std::string(image.begin(), image.end())).value(),
                       {{"bytes", static_cast<double>(image.size())}}});
    const auto add_file = [&](const std::string &name,
                              const std::function<void(const std::string &)> &write) {
      const std::string text = bytes_of_file(write);
      records.push_back({"layout/" + name,
                         BitHash().add(text).value(),
                         {{"bytes", static_cast<double>(text.size())}}});
    };
    add_file("packing_file", [&](const std::string &path) { write_packing(path, state); });
    add_file("data_file_of_lammps",
             [&](const std::string &path) { write_lammps_data(path, state); });
    add_file("library_file", [&](const std::string &path) {
      PackingLibrary library;
      LibraryRow row{};
      row.num_grains = state.num_grains();
      row.void_ratio = state.void_ratio();
      row.pressure = PRESSURE;
      row.overconsolidation_ratio = 1.0;
      library.add(row, state);
      write_library(path, library);
    });
  }

}    // namespace

std::vector<Record> device_records(Device device, const std::string &part)
{
  std::vector<Record> records;
  const auto is_wanted = [&](const std::string &name) {
    return name.find(part) != std::string::npos;
  };
  const rve::Device of_engine = device == Device::Cuda ? rve::Device::Cuda : rve::Device::Cpu;
  std::vector<Format> formats = {Format::Fast, Format::Mixed, Format::Double};
  if (device == Device::Cpu) formats.push_back(Format::Single);
  for (const Scene &scene : scenes())
    for (const Format format : formats)
      if (is_wanted(run_name(scene, format))) run(scene, format, of_engine, records);
  for (const SceneOf<3> &scene : sphere_scenes())
    for (const Format format : formats)
      if (format != Format::Single && is_wanted(run_name(scene, format)))
        run(scene, format, of_engine, records);
  if (is_wanted("packing/"))
    for (const Format format : formats) prepare_packing(format, of_engine, records);
  for (const mpm::Scheme scheme : {mpm::Scheme::Musl, mpm::Scheme::Usavg})
    for (const mpm::ShapeFunction shape : {mpm::ShapeFunction::Linear, mpm::ShapeFunction::Gimp})
      if (is_wanted("mpm/")) run_mpm(scheme, shape, device, records);
  for (const mpm::Scheme scheme : {mpm::Scheme::Musl, mpm::Scheme::Usavg})
    for (const mpm::ShapeFunction shape : {mpm::ShapeFunction::Linear, mpm::ShapeFunction::Gimp})
      if (is_wanted("mpm_in_space/")) run_mpm_in_space(scheme, shape, device, records);
  if (is_wanted("mpm_features/")) {
    run_mpm_features<2>(device, records);
    run_mpm_features<3>(device, records);
  }
  return records;
}

std::vector<Record> host_records()
{
  std::vector<Record> records;
  bounds_and_images(records);
  random_field(records);
  layouts(records);
  return records;
}

}    // namespace golden
