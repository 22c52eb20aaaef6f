// SPDX-License-Identifier: GPL-2.0-only
// Measures costs and errors of the settings of fix rve in six fixed element tests, the scenes. The
// error of a setting is the deviation of the stress from a reference run with small steps in double
// precision. The packings are all of disks or all of spheres.
//
//   bench_accuracy <output.json> <packing.rve> [<packing.rve> ...] [--device cpu|cuda]
//                  [--copies N] [--machine words] [--scenes a,b]
//                  [--short] [--ensemble] [--presets] [--skipping] [--floor]
//
// --ensemble compares only the mean stress ratio and its scatter for several numbers of grains.
// --presets compares only the costs of the three presets. Choose --copies so that the packings fill
// the device.
// --skipping compares only the costs of adaptive substeps with and without *quiescent*.
// --floor holds packings at rest in each number format and measures the unbalanced force that
// remains and the change of the pressure.
//
// The motion of grains is chaotic: tiny differences between two runs grow. Beyond some strain,
// called the bifurcation, the stresses of single packings differ and only means over packings
// agree. The program finds this strain with twins: runs whose grains are displaced at the start by
// a small part of the mean overlap. Before the bifurcation all twins agree, and the error of a
// setting is the largest error of a macro step. After it, only means over the packings are
// compared.
//
// All packings run in one batch. For a GPU, the batch has N copies of each packing (--copies). Some
// settings have a planted defect. Their errors must exceed a limit, which shows that the scenes
// detect defects.
//
// The cost of a setting on a CPU is the CPU time of one thread. Between macro steps, the program
// times a fixed piece of work. Costs are divided by the time of this work, so that other load on
// the machine cancels. The cost on a GPU is the wall time, with all threads of the host.

#include "bench_report.h"
#include "steps_on_device.h"

#include "macro/rve_points.h"
#include "rve/core/error.h"
#include "rve/core/pi.h"
#include "rve/core/space.h"
#include "rve/engine/finite_strain.h"
#include "rve/engine/packing.h"
#include "rve/engine/packing_io.h"
#include "rve/engine/stability.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <iterator>
#include <map>
#include <omp.h>
#include <optional>
#include <random>
#include <sstream>

using namespace rve;
using macro::MacroStepOptions;
using macro::StressFrom;
using nlohmann::json;

namespace {

// Pressure of the packings [Pa]. A servo holds the normal stresses along its axes at this pressure.
constexpr double PRESSURE = 1e5;

/// Strain rate of the element tests [1/s]. The inertial number of disks is 2e-4. Disks are prisms
/// of 1 m and have more mass than spheres. Spheres therefore need smaller time steps and have a
/// larger rate.
template <int D> constexpr double RATE = D == 2 ? 0.05 : 0.2;

// Largest displacements of the twins' grains, divided by the mean overlap [-]. They are of the
// order of the truncation error of the first steps, so that truncation and displacements have grown
// to similar errors when the curves part. DISPLACEMENT_SLOW is for slow scenes, where a
// displacement changes the stiffness as much as truncation does.
constexpr double DISPLACEMENT = 1e-3, DISPLACEMENT_SLOW = 1e-5;
// Number of displaced twins. A packing is compared with the reference until the first of its twins
// has parted.
constexpr int NUM_TWINS = 5;

// Curves have parted (bifurcated) when the deviation() of a twin reaches this value [-]. It is a
// fifth of LIMIT, so that an error near LIMIT before the bifurcation comes from the setting.
constexpr double PARTED = 0.002;

// Largest allowed error of a setting before bifurcation [-]. Planted defects must exceed it.
constexpr double LIMIT = 0.01;

constexpr int PACES = 40;    // measurements of the machine's pace in a run

// Macro steps between checks of the stability bound, which need details of all RVEs. The value is
// the default of fix rve.
constexpr int CHECK_INTERVAL = 100;

// Largest number of DEM steps of a scene with the preset reference if only costs are compared.
constexpr double MOST_STEPS_FOR_COST = 1.2e5;

// ---- scenes -------------------------------------------------------------------------------------

template <int D> struct Config {
  std::string name;
  double rate;          // strain rate [1/s]
  double macro_step;    // duration of a macro step [s]
  int steps;            // number of macro steps
  bool servo;           // stresses along the other axes are held at PRESSURE
  bool slow;    // starts sheared and at rest; errors are divided by the largest stress change
  Tensor<double, D> (*gradient)(double rate, double time);
};

/// Returns the velocity gradient of compression along the last axis.
template <int D> Tensor<double, D> compression(double rate, double)
{
  auto gradient = Tensor<double, D>::zero();
  gradient(D - 1, D - 1) = -rate;
  return gradient;
}

template <int D> Tensor<double, D> shear(double rate, double)
{
  auto gradient = Tensor<double, D>::zero();
  gradient(0, 1) = rate;
  return gradient;
}

// Returns the velocity gradient of cyclic shear with a strain amplitude of 0.4 %.
template <int D> Tensor<double, D> cycles(double rate, double time)
{
  const double quarter = std::fmod(time * rate / 0.004, 4.0);
  return shear<D>(quarter < 1.0 || quarter >= 3.0 ? rate : -rate, time);
}

/// Returns the six element tests. A macro step of spheres has the same strain as a macro step of
/// disks, and about as many DEM steps.
template <int D> std::array<Config<D>, 6> scenes()
{
  const double rate = RATE<D>, macro_step = 5e-5 / rate, creep = rate / 100.0;
  return {{{"uniaxial", rate, macro_step, 1200, false, false, compression<D>},
           {"shear", rate, macro_step, 1200, false, false, shear<D>},
           {D == 2 ? "biaxial" : "triaxial", rate, macro_step, 1200, true, false, compression<D>},
           {"cyclic", rate, macro_step, 640, false, false, cycles<D>},
           {D == 2 ? "creep_5e-4" : "creep_2e-3", creep, macro_step, 400, false, true, shear<D>},
           {D == 2 ? "creep_5e-6" : "creep_2e-5", 0.01 * creep, 10.0 * macro_step, 400, false, true,
            shear<D>}}};
}

// ---- settings -----------------------------------------------------------------------------------

enum class Defect { None, HistoryDroppedAtRebuild, EulerCellInSinglePrecision };

struct Setting {
  std::string name = {}, knob = {};    // the knob that the setting changes, for the table
  Format format = Format::Mixed;
  Arithmetic arithmetic = Arithmetic::Strict;
  double dt_fraction = 0.9;
  double mass_scaling = 1.0;
  double damping = -1.0;    // Cundall's local damping; negative: as in the packing
  // Ratio of the viscosity of normal and tangential dashpots to the critical damping of a contact
  // between mean grains [-]
  double viscosity = 0.0;
  double skin = 0.0;
  MacroStepOptions macro = {};
  Defect defect = Defect::None;
  double displacement = 0.0;        // initial displacement of grains / mean overlap
  int seed = 0;                     // seed of the displacements
  double friction = -1.0;           // negative: as in the packing
  double rolling_friction = 0.0;    // with k_r = k_t
  bool track_energy = false;
  Arms arms = Arms::Contact;
};

MacroStepOptions adaptive(double strain, double inertia, double quiescent = 0.0)
{
  MacroStepOptions options;
  options.adaptive = AdaptiveSubsteps{strain, inertia, 100000};
  options.quiescent_strain = quiescent;
  return options;
}

MacroStepOptions samples(StressFrom from, int number, int spacing)
{
  MacroStepOptions options;
  options.stress_from = from;
  options.stress_samples = number;
  options.stress_spacing = spacing;
  return options;
}

const Setting REFERENCE{"small-step reference", "reference", Format::Double, Arithmetic::Strict,
                        0.05};

/// Presets, beginning with the cheapest one. The last one is the preset reference, and the others
/// are compared with it.
const Setting PRESETS[] = {{"draft", "preset", Format::Fast, Arithmetic::Strict, 0.9, 4.0},
                           {"standard", "preset", Format::Mixed, Arithmetic::Strict, 0.9},
                           {"reference", "preset", Format::Double, Arithmetic::Strict, 0.1}};

template <int D> std::vector<Setting> settings(bool cuda)
{
  const Arithmetic strict = Arithmetic::Strict;
  std::vector<Setting> list(std::begin(PRESETS), std::end(PRESETS));

  list.push_back({"fast", "format", Format::Fast});
  list.push_back({"double", "format", Format::Double});
  if (cuda) {
    list.push_back({"fast, relaxed", "arithmetic", Format::Fast, Arithmetic::Relaxed});
    list.push_back({"mixed, relaxed", "arithmetic", Format::Mixed, Arithmetic::Relaxed});
  } else if (D == 2)    // the format exists on CPUs for disks only
    list.push_back({"single", "format", Format::Single});
  for (const double fraction : {0.1, 0.2, 0.45, 0.7})
    list.push_back({"dt " + number(fraction), "dt", Format::Mixed, strict, fraction});
  for (const double factor : {4.0, 16.0, 100.0})
    list.push_back(
        {"mass_scaling " + number(factor), "mass_scaling", Format::Mixed, strict, 0.9, factor});
  for (const double damping : {0.1, 0.5, 0.7})
    list.push_back(
        {"damping " + number(damping), "damping", Format::Mixed, strict, 0.9, 1.0, damping});
  for (const double share : {0.1, 0.5})
    list.push_back(
        {"viscous " + number(share), "damping", Format::Mixed, strict, 0.9, 1.0, 0.0, share});
  for (const double skin : {0.25e-3, 2e-3})
    list.push_back(
        {"skin " + number(skin), "skin", Format::Mixed, strict, 0.9, 1.0, -1.0, 0.0, skin});
  const auto with = [&](const std::string &name, const std::string &knob,
                        const MacroStepOptions &macro) {
    Setting setting{name, knob};
    setting.macro = macro;
    list.push_back(setting);
  };
  with("adaptive 1e-6 1e-3", "substeps", adaptive(1e-6, 1e-3));
  with("adaptive 1e-5 1e-3", "substeps", adaptive(1e-5, 1e-3));
  with("adaptive 1e-5 1e-2", "substeps", adaptive(1e-5, 1e-2));
  for (const double strain : {1e-6, 1e-5, 1e-4})
    with("quiescent " + number(strain), "quiescent", adaptive(1e-6, 1e-3, strain));
  with("average 3 2", "stress", samples(StressFrom::Average, 3, 2));
  with("regression 5 2", "stress", samples(StressFrom::Regression, 5, 2));

  // Optional features. Some of them change the physics, so only their costs are compared.
  const auto feature = [&](const std::string &name) -> Setting & {
    list.push_back({name, "feature"});
    return list.back();
  };
  feature("no friction").friction = 0.0;
  feature("rolling 0.1").rolling_friction = 0.1;
  feature("no damping").damping = 0.0;
  feature("arms lammps").arms = Arms::Lammps;
  feature("energy ledger").track_energy = true;

  for (const Defect defect :
       {Defect::HistoryDroppedAtRebuild, Defect::EulerCellInSinglePrecision}) {
    Setting planted{defect == Defect::HistoryDroppedAtRebuild ? "history dropped at rebuild"
                                                              : "Euler cell in fp32",
                    "defect"};
    planted.defect = defect;
    list.push_back(planted);
  }
  return list;
}

/// Returns true if fix rve accepts the setting in this scene and, for a setting with a defect, if
/// the defect can occur there.
template <int D> bool fits(const Setting &setting, const Config<D> &scene)
{
  const bool of_a_strain = setting.macro.adaptive || setting.macro.quiescent_strain > 0.0 ||
      setting.defect == Defect::EulerCellInSinglePrecision;
  return !(scene.servo && of_a_strain);
}

// ---- runs ---------------------------------------------------------------------------------------

/// Stresses of one packing after each macro step.
template <int D> using Curve = std::vector<Tensor<double, D>>;

template <int D> struct Outcome {
  std::vector<Curve<D>> curves;    // one per packing
  double seconds = 0.0;            // time for all packings and copies [s]
  double looking = 0.0;            // part of `seconds` for macro steps that end with details
  double pace = 1.0;               // mean time of the fixed piece of work during the run [s]
  double dem_steps = 0.0;          // mean number of DEM steps of one packing
  std::string failure;             // description of the status; empty without failure
  double cost() const { return seconds / pace; }
};

struct Machine {
  Device device = Device::Cpu;
  int copies = 1;
  int threads = 1;    // threads of the host
};

template <int D> Options options_for(const Setting &setting, const Machine &machine)
{
  Options options;
  options.contacts.dimension = D;
  options.format = setting.format;
  options.arithmetic = setting.arithmetic;
  options.device = machine.device;
  options.threads = machine.threads;
  options.skin = setting.skin;
  options.arms = setting.arms;
  options.track_energy = setting.track_energy;
  return options;
}

template <int D> RveStateOf<D> prepared(RveStateOf<D> state, const Setting &setting)
{
  Material &material = state.material;
  material.mass_depth *= setting.mass_scaling;
  if (setting.damping >= 0.0) material.local_damping = setting.damping;
  if (setting.friction >= 0.0) material.friction = setting.friction;
  if (setting.rolling_friction > 0.0) {
    material.rolling_friction = setting.rolling_friction;
    material.rolling_stiffness = material.tangential_stiffness;
  }
  if (setting.viscosity > 0.0) {
    const double mass = state.mass() / state.num_grains();
    // The critical damping is 2 sqrt(k m*) with the reduced mass m* = m/2.
    material.normal_viscosity = material.tangential_viscosity =
        setting.viscosity * 2.0 * std::sqrt(0.5 * mass * material.normal_stiffness);
  }
  if (setting.displacement > 0.0) {
    // Approximate overlap of mean grains: p h d/k_n for disks and p d^2/k_n for spheres, with the
    // pressure p, the thickness h, the diameter d and the normal stiffness k_n.
    const double of_a_grain = state.solid_volume() / state.num_grains();
    const double size =
        2.0 * (D == 2 ? std::sqrt(of_a_grain / kPi) : std::cbrt(0.75 * of_a_grain / kPi));
    const double overlap =
        PRESSURE * (D == 2 ? material.thickness : size) / material.normal_stiffness * size;
    std::mt19937_64 random(setting.seed);
    std::vector<double> positions = state.positions();
    for (double &x : positions)
      x += setting.displacement * overlap * (static_cast<double>(random() >> 11) * 0x1p-52 - 1.0);
    state.set_positions(positions);
  }
  return state;
}

template <int D>
DriveOf<D> drive_for(const Config<D> &scene, const Tensor<double, D> &gradient, double dt,
                     const RveStateOf<D> &state)
{
  const int substeps =
      std::max(1, static_cast<int>(std::ceil(scene.macro_step / dt * (1.0 - 1e-12))));
  DriveOf<D> drive =
      DriveOf<D>::constant_velocity_gradient(gradient, scene.macro_step / substeps, substeps);
  if (scene.servo) {
    for (int a = 0; a + 1 < D; ++a) {
      drive.controlled[a][a] = true;
      drive.stress_goal(a, a) = -PRESSURE;
    }
    drive.servo_gain = default_servo_gain(state);
    drive.servo_max_rate = 5e-5 / drive.dt;    // the limit of fix rve
  }
  return drive;
}

/// Returns the time that measures costs [s]: the wall time for a GPU, the CPU time for a CPU. CPU
/// time does not advance while other programs use the core.
double now(const Machine &machine)
{
  if (machine.device == Device::Cpu) return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Measures the present speed of the CPU by a fixed piece of work: DEM steps at rest in double
/// precision. It does nothing if the RVEs are on a GPU, which is not shared.
template <int D> class Pace {
 public:
  Pace(const RveStateOf<D> &packing, const Machine &_machine) : machine(_machine)
  {
    if (machine.device != Device::Cpu) return;
    engine = make_engine<D>(options_for<D>(REFERENCE, machine));
    rve = engine->add(packing);
    drive = DriveOf<D>::constant_velocity_gradient(Tensor<double, D>::zero(),
                                                   0.2 * stable_time_step(packing), 500);
  }

  void take()
  {
    if (!engine) return;
    std::vector<ResultOf<D>> results;
    const double start = now(machine);
    engine->advance({rve}, {drive}, results);
    seconds += now(machine) - start;
    ++count;
  }

  double mean() const { return count > 0 ? seconds / count : 1.0; }

 private:
  Machine machine;
  std::unique_ptr<EngineOf<D>> engine;
  int rve = 0, count = 0;
  DriveOf<D> drive;
  double seconds = 0.0;
};

/// Sets new stiffening limits for RVEs that have stiffened, as fix rve does, but does not check
/// their time-step bounds.
template <int D> void note_stiffened(macro::RvePointsOf<D> &points, const std::vector<int> &slots)
{
  if (!points.any_has_stiffened()) return;
  std::vector<int> stiffened;
  for (const int slot : slots)
    if (points.has_stiffened(slot)) stiffened.push_back(slot);
  points.note_check(stiffened);
}

/// Runs a scene with the classes of fix rve, so that a setting has the same meaning as in fix rve.
/// Details are requested when the stability bound is checked and at the end. On a GPU, increments
/// and stresses lie in the memory of the device, unless the scene has a servo.
template <int D>
Outcome<D> run_points(const Config<D> &scene, const std::vector<RveStateOf<D>> &packings,
                      const Setting &setting, const Machine &machine)
{
  std::vector<RveStateOf<D>> states;
  std::vector<const RveStateOf<D> *> copies;
  for (const RveStateOf<D> &packing : packings) states.push_back(prepared(packing, setting));
  Options options = options_for<D>(setting, machine);
  options.contacts = contacts_of(states);
  auto engine = make_engine<D>(options);
  const int device = scene.servo ? -1 : engine->cuda_device();
  macro::RvePointsOf<D> points(std::move(engine), nullptr, setting.macro, machine.threads);
  for (int copy = 0; copy < machine.copies; ++copy)
    for (const RveStateOf<D> &state : states) copies.push_back(&state);
  const std::vector<int> slots = points.add(copies);
  std::optional<bench::StepsOnDevice<D>> there;
  if (device >= 0) there.emplace(points, slots, device);

  const auto bound = [&] {
    double least = HUGE_VAL;
    for (std::size_t k = 0; k < packings.size(); ++k)
      least = std::min(least, stable_time_step(points.state(slots[k])));
    return least;
  };
  double dt = setting.dt_fraction * bound();
  Pace<D> pace(packings[0], machine);
  Outcome<D> outcome;
  outcome.curves.resize(packings.size());
  std::vector<DriveOf<D>> drives(slots.size());
  Tensor<double, D> gradient_before = Tensor<double, D>::zero();
  double dt_before = 0.0;
  for (int step = 0; step < scene.steps; ++step) {
    if (step % (scene.steps / PACES) == 0) pace.take();
    const bool checks = step % CHECK_INTERVAL == CHECK_INTERVAL - 1;
    if (checks) {
      const double limit = bound();
      if (dt > 0.95 * limit) dt = setting.dt_fraction * limit;
    }
    const Tensor<double, D> gradient = scene.gradient(scene.rate, (step + 0.5) * scene.macro_step);
    if (dt != dt_before || norm(gradient - gradient_before) > 0.0) {
      const DriveOf<D> of_first = drive_for(scene, gradient, dt, states[0]);
      for (std::size_t k = 0; k < drives.size(); ++k) {
        drives[k] = of_first;
        if (scene.servo) drives[k].servo_gain = points.servo_gain(slots[k]);
        if (setting.macro.adaptive) drives[k].dt = dt;
      }
      if (there) there->set_increment(drives[0].deformation, drives[0].dt, drives[0].substeps);
      gradient_before = gradient;
      dt_before = dt;
    }
    const bool with_details = checks || step + 1 == scene.steps;
    std::vector<int> failed;
    const double start = now(machine);
    const bool is_there = there && there->advance(with_details, failed);
    if (!is_there) failed = points.advance(slots, drives, with_details);
    note_stiffened(points, slots);
    const double took = now(machine) - start;
    outcome.seconds += took;
    if (with_details) outcome.looking += took;
    if (!failed.empty()) {
      outcome.failure = describe_status(points.point(failed[0]).result.status);
      return outcome;
    }
    const std::vector<Tensor<double, D>> stresses = is_there ? there->stresses(packings.size())
                                                             : std::vector<Tensor<double, D>>();
    for (std::size_t k = 0; k < packings.size(); ++k)
      outcome.curves[k].push_back(is_there ? stresses[k] : points.stress(slots[k]));
  }
  points.fetch_results();
  outcome.pace = pace.mean();
  for (std::size_t k = 0; k < packings.size(); ++k)
    outcome.dem_steps += static_cast<double>(points.point(slots[k]).last_steps().counters.steps -
                                             packings[k].counters.steps) /
        packings.size();
  return outcome;
}

/// Runs a scene with a planted defect. The engine itself has no defect. This function causes the
/// defect between the calls of the engine.
template <int D>
Outcome<D> run_with_defect(const Config<D> &scene, const std::vector<RveStateOf<D>> &packings,
                           const Setting &setting, const Machine &machine)
{
  Outcome<D> outcome;
  for (const RveStateOf<D> &packing : packings) {
    RveStateOf<D> state = prepared(packing, setting);
    Options options = options_for<D>(setting, machine);
    options.contacts = contacts_of(state);
    const auto engine = make_engine<D>(options);
    int rve = engine->add(state);
    const double dt = setting.dt_fraction * stable_time_step(state);
    Tensor<double, D> cell = state.cell;
    std::int64_t rebuilds = state.counters.rebuilds;
    std::vector<ResultOf<D>> results;
    Curve<D> curve;
    for (int step = 0; step < scene.steps; ++step) {
      const Tensor<double, D> gradient =
          scene.gradient(scene.rate, (step + 0.5) * scene.macro_step);
      DriveOf<D> drive = drive_for(scene, gradient, dt, state);
      const int calls = setting.defect == Defect::EulerCellInSinglePrecision ? drive.substeps : 1;
      if (calls > 1) drive.substeps = 1;
      for (int call = 0; call < calls; ++call) {
        if (setting.defect == Defect::EulerCellInSinglePrecision) {
          // H + dt L H with every number rounded to single precision
          const Tensor<double, D> old = cell;
          for (int a = 0; a < D; ++a)
            for (int b = 0; b < D; ++b) {
              float rate = static_cast<float>(gradient(a, 0)) * static_cast<float>(old(0, b));
              for (int c = 1; c < D; ++c)
                rate += static_cast<float>(gradient(a, c)) * static_cast<float>(old(c, b));
              cell(a, b) = static_cast<float>(old(a, b)) + static_cast<float>(drive.dt) * rate;
            }
          drive.deformation = cell * inverse(old);
        }
        engine->advance({rve}, {drive}, results);
        if (results[0].status & status::Fatal) {
          outcome.failure = describe_status(results[0].status);
          return outcome;
        }
        if (setting.defect == Defect::HistoryDroppedAtRebuild &&
            results[0].counters.rebuilds > rebuilds) {
          rebuilds = results[0].counters.rebuilds;
          RveStateOf<D> forgetful = engine->state(rve);
          for (PairOf<D> &pair : forgetful.pairs) pair.tangential_force = {};
          engine->remove(rve);
          rve = engine->add(forgetful);
        }
      }
      curve.push_back(results[0].stress);
    }
    outcome.curves.push_back(curve);
  }
  return outcome;
}

template <int D>
Outcome<D> run(const Config<D> &scene, const std::vector<RveStateOf<D>> &packings,
               const Setting &setting, const Machine &machine)
{
  return setting.defect == Defect::None ? run_points(scene, packings, setting, machine)
                                        : run_with_defect(scene, packings, setting, machine);
}

/// Returns the packing after 0.3 % of shear and a rest. All its contacts have tangential forces.
/// The slow scenes begin with this packing.
template <int D> RveStateOf<D> sheared(const RveStateOf<D> &packing)
{
  const auto engine = make_engine<D>(options_for<D>(REFERENCE, Machine()));
  const int rve = engine->add(packing);
  const double dt = 0.2 * stable_time_step(packing);
  std::vector<ResultOf<D>> results;
  engine->advance({rve},
                  {DriveOf<D>::constant_velocity_gradient(
                      shear<D>(RATE<D>, 0.0), dt, static_cast<int>(0.003 / (RATE<D> * dt)))},
                  results);
  for (int k = 0; k < 40; ++k)
    engine->advance({rve},
                    {DriveOf<D>::constant_velocity_gradient(Tensor<double, D>::zero(), dt, 2000)},
                    results);
  require(results[0].unbalanced_ratio < 1e-7,
          "a sheared packing does not come to rest: unbalanced ratio " +
              number(results[0].unbalanced_ratio));
  return engine->state(rve);
}

// ---- errors -------------------------------------------------------------------------------------

struct Errors {
  std::vector<double> pointwise;    // largest error before bifurcation, of each packing
  double pressure = 0.0;            // relative difference of the mean pressure after bifurcation
  double stress_ratio = 0.0;        // difference of the mean q/p after bifurcation
  double scatter = 0.0;             // standard error of the mean q/p over packings in the reference
  double before = 1.0;              // share of the scene before bifurcation, mean over packings
};

template <int D> double stress_ratio(const Tensor<double, D> &stress)
{
  ResultOf<D> result;
  result.stress = stress;
  return result.deviatoric_stress() / result.mean_stress();
}

/// Statistics of the errors of all packings. Each packing has its own seed. A setting can exceed
/// LIMIT with one seed and not with another.
struct Range {
  double least, median, largest;
  int beyond;    ///< number of errors beyond LIMIT
  int seeds;

  explicit Range(std::vector<double> errors) : seeds(static_cast<int>(errors.size()))
  {
    std::sort(errors.begin(), errors.end());
    least = errors.front();
    largest = errors.back();
    median = 0.5 * (errors[(errors.size() - 1) / 2] + errors[errors.size() / 2]);
    beyond = static_cast<int>(std::count_if(errors.begin(), errors.end(),
                                            [](double error) { return !(error <= LIMIT); }));
  }
  std::string verdict() const
  {
    if (beyond == 0) return "within";
    return beyond == seeds ? "beyond the limit" : "beyond for some seeds";
  }
};

/// The curves of the reference, and the step of each curve at which bifurcation occurs.
template <int D> struct Standard {
  std::vector<Curve<D>> curves;
  std::vector<double> change;      ///< largest change of the stress of each packing [stress]
  std::vector<int> bifurcation;    ///< step at which the first twin has parted, or the end
};

/// Returns the relative deviation of two curves at a step [-]: the norm of the stress difference,
/// divided by the pressure. In slow scenes, it is the norm of the difference of the stress changes
/// since the first step, divided by `change` [stress].
template <int D>
double deviation(const Config<D> &scene, const Curve<D> &curve, const Curve<D> &exact,
                 double change, int step)
{
  if (!scene.slow)
    return norm(curve[step] - exact[step]) / std::max(PRESSURE, mean_stress(exact[step]));
  return norm((curve[step] - curve[0]) - (exact[step] - exact[0])) / change;
}

/// Runs the twins. The first one has no displacements, and the others are compared with it. To save
/// time, twins have larger DEM steps than the reference. These steps are small enough that the
/// bifurcation does not depend on them.
template <int D>
std::vector<Outcome<D>> twins_of(const Config<D> &scene, const std::vector<RveStateOf<D>> &packings,
                                 const Machine &machine, int count)
{
  std::vector<Outcome<D>> twins;
  const Machine once{machine.device, 1};
  for (int seed = 0; seed <= count; ++seed) {
    Setting setting = REFERENCE;
    setting.name = "twin";
    setting.dt_fraction = 0.2;
    setting.seed = seed;
    if (seed > 0) setting.displacement = scene.slow ? DISPLACEMENT_SLOW : DISPLACEMENT;
    twins.push_back(run(scene, packings, setting, once));
    require(twins.back().failure.empty(),
            "a twin fails in " + scene.name + ": " + twins.back().failure);
  }
  return twins;
}

template <int D>
Standard<D> standard_of(const Outcome<D> &reference, const std::vector<Outcome<D>> &twins,
                        const Config<D> &scene)
{
  Standard<D> standard;
  standard.curves = reference.curves;
  for (std::size_t k = 0; k < reference.curves.size(); ++k) {
    const Curve<D> &curve = reference.curves[k];
    double change = 0.0;
    for (const Tensor<double, D> &stress : curve)
      change = std::max(change, norm(stress - curve[0]));
    standard.change.push_back(change);
    int step = 0;
    const auto agree = [&] {
      return std::all_of(twins.begin() + 1, twins.end(), [&](const Outcome<D> &twin) {
        return deviation(scene, twin.curves[k], twins[0].curves[k], change, step) < PARTED;
      });
    };
    while (step < scene.steps && agree()) ++step;
    standard.bifurcation.push_back(step);
  }
  return standard;
}

template <int D>
Errors errors_of(const Standard<D> &standard, const Outcome<D> &outcome, const Config<D> &scene)
{
  Errors errors;
  errors.before = 0.0;
  const double count = static_cast<double>(standard.curves.size());
  double sum = 0.0, squares = 0.0, parted = 0.0;
  for (std::size_t k = 0; k < standard.curves.size(); ++k) {
    const Curve<D> &exact = standard.curves[k], &curve = outcome.curves[k];
    const int end = standard.bifurcation[k];
    errors.before += static_cast<double>(end) / scene.steps / count;
    double largest = 0.0;
    for (int step = 0; step < end; ++step)
      largest = std::max(largest, deviation(scene, curve, exact, standard.change[k], step));
    errors.pointwise.push_back(largest);
    if (end == scene.steps) continue;
    double p[2] = {0.0, 0.0}, ratio[2] = {0.0, 0.0};
    for (int step = end; step < scene.steps; ++step) {
      p[0] += mean_stress(exact[step]);
      p[1] += mean_stress(curve[step]);
      ratio[0] += stress_ratio(exact[step]) / (scene.steps - end);
      ratio[1] += stress_ratio(curve[step]) / (scene.steps - end);
    }
    errors.pressure += p[1] / p[0] - 1.0;
    errors.stress_ratio += ratio[1] - ratio[0];
    sum += ratio[0];
    squares += ratio[0] * ratio[0];
    parted += 1.0;
  }
  if (parted > 0.0) {
    errors.pressure /= parted;
    errors.stress_ratio /= parted;
    const double variance = std::max(0.0, squares / parted - sum / parted * sum / parted);
    errors.scatter = parted > 1.0 ? std::sqrt(variance / (parted - 1.0)) : 0.0;
  }
  return errors;
}

// ---- tests of the reference ---------------------------------------------------------------------

/// Returns the relative error of the coefficient of restitution of two grains with local damping.
/// The exact value is sqrt((1 - a)/(1 + a)), where a is the local damping [-]. The damping scales
/// the contact force by 1 - a on separation and by 1 + a on approach.
template <int D> double restitution_error(const Machine &machine)
{
  Material material;
  material.normal_stiffness = 1e6;
  material.density = 2650.0;
  material.local_damping = 0.3;
  RveStateOf<D> state;
  state.material = material;
  state.cell = 0.2 * Tensor<double, D>::identity();
  state.radius = {0.005, 0.005};
  state.velocity.assign(2 * D, 0.0);
  state.velocity[0] = 0.1;
  state.velocity[D] = -0.1;
  state.spin.assign(2 * Space<D>::spins, 0.0);
  std::vector<double> positions(2 * D, 0.05);
  positions[D] = 0.06001;
  state.set_positions(positions);
  const auto engine = make_engine<D>(options_for<D>(REFERENCE, machine));
  const int rve = engine->add(state);
  const double dt = 0.01 * stable_time_step(state);
  std::vector<ResultOf<D>> results;
  engine->advance({rve},
                  {DriveOf<D>::constant_velocity_gradient(Tensor<double, D>::zero(), dt, 3000)},
                  results);
  const double expected = std::sqrt((1.0 - 0.3) / (1.0 + 0.3));
  return std::fabs(-engine->state(rve).velocity[0] / 0.1 / expected - 1.0);
}

/// Returns the relative error of the stress increment in one step, compared with the closed form of
/// the affine stiffness of a packing at rest.
template <int D> double stiffness_error(const RveStateOf<D> &packing, const Machine &machine)
{
  const auto engine = make_engine<D>(options_for<D>(REFERENCE, machine));
  const int rve = engine->add(packing);
  std::vector<ElasticResultOf<D>> before;
  std::vector<ResultOf<D>> after;
  engine->advance({rve}, {DriveOf<D>()}, before);
  const double strain = 1e-8;
  DriveOf<D> drive;
  drive.dt = 1e-9;
  drive.substeps = 1;
  drive.deformation(1, 1) -= strain;
  engine->advance({rve}, {drive}, after);
  const Tensor<double, D> expected =
      before[0].stiffness(drive.deformation - Tensor<double, D>::identity());
  return norm(after[0].stress - before[0].result.stress - expected) / norm(expected);
}

/// Returns the largest difference between stresses on a GPU and on a CPU, divided by PRESSURE [-].
/// The setting is the preset standard. The scenes are uniaxial compression, and biaxial or triaxial
/// compression with a servo. The expected value is zero: comparisons of the CPU engine with LAMMPS
/// then also apply to the GPU.
template <int D>
double difference_from_cpu(const std::vector<RveStateOf<D>> &packings, const Machine &machine)
{
  double largest = 0.0;
  for (Config<D> scene : {scenes<D>()[0], scenes<D>()[2]}) {
    scene.steps = 100;
    const Setting standard{"standard", "preset"};
    const Outcome<D> here = run(scene, packings, standard, Machine{machine.device, 1});
    const Outcome<D> there = run(scene, packings, standard, Machine{Device::Cpu, 1});
    for (std::size_t k = 0; k < packings.size(); ++k)
      for (int step = 0; step < scene.steps; ++step)
        largest = std::max(largest, norm(here.curves[k][step] - there.curves[k][step]) / PRESSURE);
  }
  return largest;
}

// ---- main program -------------------------------------------------------------------------------

struct Arguments {
  std::string output, machine, scenes;
  std::vector<std::string> packings;
  bool cuda = false, brief = false, ensemble = false, presets = false, floor = false,
       skipping = false;
  int copies = 1;
};

Arguments parse(int argc, char **argv)
{
  Arguments arguments;
  for (int a = 1; a < argc; ++a) {
    const std::string word = argv[a];
    const auto value = [&] {
      require(a + 1 < argc, word + ": its value is missing");
      return std::string(argv[++a]);
    };
    if (word == "--device")
      arguments.cuda = value() == "cuda";
    else if (word == "--copies")
      arguments.copies = std::stoi(value());
    else if (word == "--machine")
      arguments.machine = value();
    else if (word == "--scenes")
      arguments.scenes = "," + value() + ",";
    else if (word == "--short")    // only the defects and the preset standard, in two scenes
      arguments.brief = true;
    else if (word == "--ensemble")
      arguments.ensemble = true;
    else if (word == "--presets")
      arguments.presets = true;
    else if (word == "--floor")
      arguments.floor = true;
    else if (word == "--skipping")
      arguments.skipping = true;
    else if (arguments.output.empty())
      arguments.output = word;
    else
      arguments.packings.push_back(word);
  }
  require(!arguments.packings.empty() && arguments.copies > 0,
          "usage: bench_accuracy <output.json> <packing.rve> ... [--device cpu|cuda] [--copies N] "
          "[--machine words] [--scenes a,b] [--short] [--ensemble] [--presets] "
          "[--skipping] [--floor]");
  return arguments;
}

/// Reports the stress ratio q/p (deviatoric stress over pressure) with the preset standard for each
/// number of grains: its mean over the second half of a scene, and the scatter of packings.
template <int D>
void compare_numbers_of_grains(const std::vector<RveStateOf<D>> &packings,
                               const Arguments &arguments, const Machine &machine,
                               bench::Report &report)
{
  std::map<int, std::vector<RveStateOf<D>>> groups;
  for (const RveStateOf<D> &packing : packings) groups[packing.num_grains()].push_back(packing);
  for (const Config<D> &scene : scenes<D>()) {
    if (scene.slow || scene.gradient == cycles<D>) continue;
    for (const auto &[grains, some] : groups) {
      const Outcome<D> outcome = run(scene, some, {"standard", "grains"}, machine);
      require(outcome.failure.empty(), scene.name + " fails: " + outcome.failure);
      double sum = 0.0, squares = 0.0;
      for (const Curve<D> &curve : outcome.curves) {
        double mean = 0.0;
        for (int step = scene.steps / 2; step < scene.steps; ++step)
          mean += stress_ratio(curve[step]) / (scene.steps - scene.steps / 2);
        sum += mean;
        squares += mean * mean;
      }
      const double n = static_cast<double>(some.size()), mean = sum / n;
      const double deviation =
          std::sqrt(std::max(0.0, squares / n - mean * mean) * n / std::max(1.0, n - 1.0));
      report.add({{"device", arguments.cuda ? "cuda" : "cpu-1"},
                  {"code", "gpu_rve"},
                  {"scene", scene.name},
                  {"dim", D},
                  {"grains", grains},
                  {"rves", some.size() * machine.copies},
                  {"format", "mixed"},
                  {"preset", "standard"},
                  {"knob", "grains"}},
                 "mean_stress_ratio", mean, "-",
                 {{"packings", some.size()},
                  {"scatter_of_packings", deviation},
                  {"standard_error", deviation / std::sqrt(n)},
                  {"seconds_per_rve", outcome.seconds / (n * machine.copies)}});
      std::printf("%-11s %4d grains, %zu packings: q/p %.4f, scatter %.4f, standard error %.4f\n",
                  scene.name.c_str(), grains, some.size(), mean, deviation,
                  deviation / std::sqrt(n));
    }
  }
  report.write();
}

/// Reports the unbalanced force that remains at rest because a format has finitely many digits. The
/// packings first come to rest in double precision and are then held in each format. There is one
/// report for all packings of the same stiffness.
template <int D>
void measure_floor(const std::vector<RveStateOf<D>> &packings, const Arguments &arguments,
                   const Machine &machine, bench::Report &report)
{
  constexpr int SETTLING = 100000, HELD = 100000, IN_A_CALL = 10000;
  const auto held = [&](const std::vector<RveStateOf<D>> &states, Format format, int steps) {
    Setting setting;
    setting.format = format;
    Options options = options_for<D>(setting, machine);
    options.contacts = contacts_of(states);
    auto engine = make_engine<D>(options);
    std::vector<int> rves;
    std::vector<DriveOf<D>> drives;
    for (const RveStateOf<D> &state : states) {
      rves.push_back(engine->add(state));
      drives.push_back(DriveOf<D>::constant_velocity_gradient(
          Tensor<double, D>::zero(), 0.5 * stable_time_step(state), IN_A_CALL));
    }
    std::vector<ResultOf<D>> results;
    for (int step = 0; step < steps; step += IN_A_CALL) engine->advance(rves, drives, results);
    for (const ResultOf<D> &result : results)
      require(!(result.status & status::Fatal),
              "a packing at rest fails: " + describe_status(result.status));
    std::vector<RveStateOf<D>> after;
    for (const int rve : rves) after.push_back(engine->state(rve));
    return std::make_pair(results, after);
  };

  std::map<double, std::vector<RveStateOf<D>>> by_stiffness;
  for (const RveStateOf<D> &packing : packings)
    by_stiffness[packing.material.normal_stiffness].push_back(packing);
  std::vector<Format> formats = {Format::Fast, Format::Mixed, Format::Double};
  if (!arguments.cuda && D == 2) formats.push_back(Format::Single);
  for (const auto &[stiffness, some] : by_stiffness) {
    const auto [rested, states] = held(some, Format::Double, SETTLING);
    for (const Format format : formats) {
      const auto results = held(states, format, HELD).first;
      double overlap = 0.0, change = 0.0;
      std::vector<double> unbalanced;
      for (std::size_t k = 0; k < results.size(); ++k) {
        unbalanced.push_back(results[k].unbalanced_ratio);
        overlap += rested[k].mean_overlap / results.size();
        change =
            std::max(change, std::fabs(results[k].mean_stress() / rested[k].mean_stress() - 1.0));
      }
      const auto [least, largest] = std::minmax_element(unbalanced.begin(), unbalanced.end());
      report.add({{"device", arguments.cuda ? "cuda" : "cpu-1"},
                  {"code", "gpu_rve"},
                  {"scene", "rest"},
                  {"dim", D},
                  {"grains", packings[0].num_grains()},
                  {"normal_stiffness", stiffness},
                  {"format", to_string(format)}},
                 "unbalanced_ratio", *largest, "-",
                 {{"least", *least},
                  {"overlap", overlap},
                  {"pressure_change", change},
                  {"packings", results.size()},
                  {"dem_steps", HELD}});
      std::printf("rest, overlap %.2e, %-6s: unbalanced ratio %.1e to %.1e, pressure changes by "
                  "%.1e\n",
                  overlap, to_string(format).c_str(), *least, *largest, change);
      std::fflush(stdout);
    }
    report.write();
  }
}

template <int D> bool is_wanted(const Config<D> &scene, const std::string &scenes)
{
  return scenes.empty() || scenes.find("," + scene.name + ",") != std::string::npos;
}

/// Divides the number of copies by three for a scene with a servo. On a GPU, such a scene takes
/// many times as long as other scenes, and fewer RVEs are enough to fill the GPU.
template <int D> Machine for_scene(Machine machine, const Config<D> &scene)
{
  if (scene.servo) machine.copies = (machine.copies + 2) / 3;
  return machine;
}

/// Returns the scene with at most MOST_STEPS_FOR_COST DEM steps of the preset reference.
template <int D> Config<D> shortened(Config<D> scene, const RveStateOf<D> &packing)
{
  const double of_macro_step =
      scene.macro_step / (PRESETS[2].dt_fraction * stable_time_step(packing));
  scene.steps =
      std::min(scene.steps, std::max(PACES, static_cast<int>(MOST_STEPS_FOR_COST / of_macro_step)));
  return scene;
}

/// Reports the speedup of each preset over the preset reference in each scene, and the smallest
/// speedup of each preset.
template <int D>
void compare_costs_of_presets(const std::vector<RveStateOf<D>> &packings,
                              const std::vector<RveStateOf<D>> &sheared_packings,
                              const Arguments &arguments, const Machine &machine,
                              bench::Report &report)
{
  const json common = {{"device", arguments.cuda ? "cuda" : "cpu-1"},
                       {"code", "gpu_rve"},
                       {"dim", D},
                       {"grains", packings[0].num_grains()}};
  // least speedup of a preset, and its scene
  std::map<std::string, std::pair<double, std::string>> least;
  for (const Config<D> &whole : scenes<D>()) {
    if (!is_wanted(whole, arguments.scenes)) continue;
    const std::vector<RveStateOf<D>> &start = whole.slow ? sheared_packings : packings;
    const Config<D> scene = shortened(whole, start[0]);
    const Machine here = for_scene(machine, scene);
    const double rves = static_cast<double>(start.size()) * here.copies;
    std::vector<Outcome<D>> outcomes;
    for (const Setting &preset : PRESETS) {
      outcomes.push_back(run(scene, start, preset, here));
      require(outcomes.back().failure.empty(),
              preset.name + " fails in " + scene.name + ": " + outcomes.back().failure);
    }
    for (std::size_t k = 0; k < outcomes.size(); ++k) {
      const Setting &preset = PRESETS[k];
      const Outcome<D> &outcome = outcomes[k], &reference = outcomes.back();
      const double speedup = reference.cost() / outcome.cost();
      json keys = common;
      keys.update({{"scene", scene.name},
                   {"rves", static_cast<int>(rves)},
                   {"format", to_string(preset.format)},
                   {"preset", preset.name}});
      report.add(keys, "preset_speedup", speedup, "-",
                 {{"ratio_of_steps", reference.dem_steps / outcome.dem_steps},
                  {"dem_steps", outcome.dem_steps},
                  {"macro_steps", scene.steps},
                  {"seconds", outcome.seconds},
                  {"seconds_per_rve", outcome.seconds / rves},
                  {"rve_steps_per_second", outcome.dem_steps * rves / outcome.seconds}});
      std::printf("%-11s %5.0f RVEs %-10s %9.3f s for %d macro steps, %.4g million RVE-steps/s, "
                  "%.2f times cheaper than "
                  "reference with %.2f times fewer steps\n",
                  scene.name.c_str(), rves, preset.name.c_str(), outcome.seconds, scene.steps,
                  1e-6 * outcome.dem_steps * rves / outcome.seconds, speedup,
                  reference.dem_steps / outcome.dem_steps);
      std::fflush(stdout);
      if (&outcome == &reference) continue;
      auto &[value, in_scene] = least.try_emplace(preset.name, HUGE_VAL, "").first->second;
      if (speedup < value) {
        value = speedup;
        in_scene = scene.name;
      }
    }
    report.write();
  }
  for (const Setting &preset : PRESETS) {
    const auto found = least.find(preset.name);
    if (found == least.end()) continue;
    json keys = common;
    keys["preset"] = preset.name;
    report.add(keys, "least_preset_speedup", found->second.first, "-",
               {{"in_scene", found->second.second}});
  }
  report.write();
}

/// Reports for each scene how much faster adaptive substeps are with *quiescent* than without it.
/// Each setting runs twice, in turn with the other settings. The faster of both runs is reported.
template <int D>
void compare_costs_of_skipping(const std::vector<RveStateOf<D>> &packings,
                               const std::vector<RveStateOf<D>> &sheared_packings,
                               const Arguments &arguments, const Machine &machine,
                               bench::Report &report)
{
  constexpr int MACRO_STEPS = 400;
  std::vector<Setting> some = {{"adaptive 1e-6 1e-3", "substeps"}};
  some[0].macro = adaptive(1e-6, 1e-3);
  for (const Setting &setting : settings<D>(arguments.cuda))
    if (setting.knob == "quiescent") some.push_back(setting);
  for (Config<D> scene : scenes<D>()) {
    if (!is_wanted(scene, arguments.scenes) || !fits(some[0], scene)) continue;
    scene.steps = std::min(scene.steps, MACRO_STEPS);
    const std::vector<RveStateOf<D>> &start = scene.slow ? sheared_packings : packings;
    std::vector<Outcome<D>> outcomes;
    for (const bool again : {false, true})
      for (std::size_t s = 0; s < some.size(); ++s) {
        Outcome<D> outcome = run(scene, start, some[s], machine);
        require(outcome.failure.empty(),
                some[s].name + " fails in " + scene.name + ": " + outcome.failure);
        if (!again)
          outcomes.push_back(std::move(outcome));
        else if (outcome.cost() < outcomes[s].cost())
          outcomes[s] = std::move(outcome);
      }
    const double rves = static_cast<double>(start.size()) * machine.copies;
    for (std::size_t s = 0; s < some.size(); ++s) {
      const double speedup = outcomes[0].cost() / outcomes[s].cost();
      report.add({{"device", arguments.cuda ? "cuda" : "cpu-1"},
                  {"code", "gpu_rve"},
                  {"scene", scene.name},
                  {"dim", D},
                  {"grains", packings[0].num_grains()},
                  {"rves", rves},
                  {"format", to_string(some[s].format)},
                  {"setting", some[s].name}},
                 "quiescent_speedup", speedup, "-",
                 {{"dem_steps", outcomes[s].dem_steps},
                  {"macro_steps", scene.steps},
                  {"seconds_per_macro_step", outcomes[s].seconds / scene.steps},
                  {"seconds_with_details", outcomes[s].looking / scene.steps}});
      std::printf("%-11s %5.0f RVEs %-20s %8.1f us per macro step (%.1f with details), %6.2f DEM "
                  "steps in it, %.3f "
                  "times as fast\n",
                  scene.name.c_str(), rves, some[s].name.c_str(),
                  1e6 * outcomes[s].seconds / scene.steps, 1e6 * outcomes[s].looking / scene.steps,
                  outcomes[s].dem_steps / scene.steps, speedup);
      std::fflush(stdout);
    }
    report.write();
  }
}

template <int D> int run(const Arguments &arguments, bench::Report report)
{
  const Machine machine{arguments.cuda ? Device::Cuda : Device::Cpu, arguments.copies,
                        arguments.cuda ? omp_get_max_threads() : 1};
  const std::string engine = make_engine<D>(options_for<D>(Setting(), machine))->description();
  report.set_machine(arguments.machine.empty() ? engine.substr(0, engine.find(','))
                                               : arguments.machine);

  std::vector<RveStateOf<D>> packings, sheared_packings;
  for (const std::string &file : arguments.packings) packings.push_back(read_packing<D>(file));
  if (arguments.ensemble) {
    compare_numbers_of_grains(packings, arguments, machine, report);
    return 0;
  }
  if (arguments.floor) {
    measure_floor(packings, arguments, machine, report);
    return 0;
  }
  for (const RveStateOf<D> &packing : packings) sheared_packings.push_back(sheared(packing));
  if (arguments.presets) {
    compare_costs_of_presets(packings, sheared_packings, arguments, machine, report);
    return 0;
  }
  if (arguments.skipping) {
    compare_costs_of_skipping(packings, sheared_packings, arguments, machine, report);
    return 0;
  }

  bool sound = true;
  const auto check = [&](const std::string &what, double error, double limit) {
    std::printf("%s %s: %.2g, limit %.2g\n", error <= limit ? "pass" : "FAIL", what.c_str(), error,
                limit);
    sound = sound && error <= limit;
    report.add({{"scene", "closed form"}, {"setting", what}}, "stress_error_rel", error, "-",
               {{"limit", limit}});
  };
  check(D == 2 ? "restitution of two disks" : "restitution of two spheres",
        restitution_error<D>(machine), 1e-3);
  check("affine stiffness of a packing", stiffness_error(packings[0], machine), 1e-4);
  if (arguments.cuda) check("GPU against CPU", difference_from_cpu(packings, machine), 0.0);
  require(sound, "the reference fails its closed forms; nothing else is run");

  std::vector<Setting> all = settings<D>(arguments.cuda);
  std::string wanted = arguments.scenes;
  Setting finest = REFERENCE;
  if (arguments.brief) {
    finest.dt_fraction = 0.2;    // the defects exceed the truncation error of this reference
    wanted = ",uniaxial," + scenes<D>().back().name + ",";
    all.erase(std::remove_if(all.begin(), all.end(),
                             [](const Setting &setting) {
                               return setting.name != "standard" && setting.defect == Defect::None;
                             }),
              all.end());
  }
  std::vector<int> flagged(all.size(), 0);
  for (const Config<D> &scene : scenes<D>()) {
    if (!is_wanted(scene, wanted)) continue;
    const std::vector<RveStateOf<D>> &start = scene.slow ? sheared_packings : packings;
    const Machine here = for_scene(machine, scene);
    const Outcome<D> reference = run(scene, start, finest, here);
    require(reference.failure.empty(),
            "the reference fails in " + scene.name + ": " + reference.failure);
    const Standard<D> standard = standard_of(
        reference, twins_of(scene, start, here, arguments.brief ? 2 : NUM_TWINS), scene);
    for (std::size_t s = 0; s < all.size(); ++s) {
      const Setting &setting = all[s];
      if (!fits(setting, scene)) continue;
      const Outcome<D> outcome = run(scene, start, setting, here);
      const json keys = {{"device", arguments.cuda ? "cuda" : "cpu-1"},
                         {"code", "gpu_rve"},
                         {"scene", scene.name},
                         {"dim", D},
                         {"grains", packings[0].num_grains()},
                         {"rves", packings.size() * here.copies},
                         {"format", to_string(setting.format)},
                         {"setting", setting.name},
                         {"knob", setting.knob}};
      if (!outcome.failure.empty()) {
        flagged[s] = 1;
        report.add(keys, "stress_error_rel", -1.0, "-",
                   {{"verdict", "failed: " + outcome.failure}});
        std::printf("%-11s %-28s failed: %s\n", scene.name.c_str(), setting.name.c_str(),
                    outcome.failure.c_str());
        continue;
      }
      const Errors errors = errors_of(standard, outcome, scene);
      const Range range(errors.pointwise);
      flagged[s] = flagged[s] || !(range.largest <= LIMIT);
      const double cost = outcome.seconds / (packings.size() * here.copies);
      const json details = {
          {"verdict", range.verdict()},
          {"limit", LIMIT},
          {"least", range.least},
          {"median", range.median},
          {"seeds", packings.size()},
          {"seeds_beyond", range.beyond},
          {"mean_pressure_afterwards", errors.pressure},
          {"mean_stress_ratio_afterwards", errors.stress_ratio},
          {"scatter_of_stress_ratio", errors.scatter},
          {"share_before_bifurcation", errors.before},
          {"dem_steps", outcome.dem_steps},
          {"cost_over_reference",
           setting.defect == Defect::None ? outcome.cost() / reference.cost() : 0.0}};
      report.add(keys, "stress_error_rel", range.largest, "-", details);
      std::printf(
          "%-11s %-28s error %.1e to %.1e  afterwards p %+.1e, q/p %+.1e (scatter %.1e)  before "
          "%.2f  cost %.3f s = %.3f of the reference\n",
          scene.name.c_str(), setting.name.c_str(), range.least, range.largest, errors.pressure,
          errors.stress_ratio, errors.scatter, errors.before, cost,
          outcome.cost() / reference.cost());
      std::fflush(stdout);
    }
    report.write();
  }
  for (std::size_t s = 0; s < all.size(); ++s) {
    // A defect need not exceed the limit in every scene. It counts as unseen only if all scenes
    // were run.
    if (all[s].defect != Defect::None && !flagged[s] && arguments.scenes.empty()) {
      std::printf("FAIL the planted defect goes unseen: %s\n", all[s].name.c_str());
      sound = false;
    }
    if (all[s].name == "standard" && flagged[s]) {
      std::printf("FAIL the preset standard loses more than %g before bifurcation\n", LIMIT);
      sound = false;
    }
  }
  report.write();
  return sound ? 0 : 1;
}

}    // namespace

int main(int argc, char **argv)
try {
  const Arguments arguments = parse(argc, argv);
  const bench::Report report(argc, argv, arguments.output);
  return dimension_of_packing(arguments.packings[0]) == 2 ? run<2>(arguments, report)
                                                          : run<3>(arguments, report);
} catch (const std::exception &e) {
  std::fprintf(stderr, "bench_accuracy: %s\n", e.what());
  return 2;
}
