// SPDX-License-Identifier: GPL-2.0-only
// Measures the throughput of the engine in DEM steps of RVEs per second. The RVEs are copies of a
// packing of disks or of spheres and are sheared. The program times whole calls that return the
// short answer, rve::ResponseOf (the long answer is rve::ResultOf). It writes JSON rows
// (doc/src/dev_gpu_kernels.rst). It asserts nothing about times; a failed RVE ends the experiment.
//
//   bench_engine <packing.rve> <output.json> [--device cpu|cuda] [--suite quick|full|core|paper|
//                substeps|grains|queue|features|rebuilds|skins|memory|sanitize|races|profile]
//                [--seconds S] [--rves N[,N...]] [--format fast|mixed|double] [--threads N]
//                [--part K/N]

#include "bench_packings.h"
#include "bench_report.h"
#include "sanitizer_batch.h"

#include "rve/core/error.h"
#include "rve/core/threads.h"
#include "rve/engine/packing_io.h"
#include "rve/engine/stability.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <future>
#include <map>
#include <sstream>
#include <thread>
#include <tuple>

namespace {

using bench::Report;
using nlohmann::json;
using rve::Arithmetic;
using rve::Format;

// Largest strain of a case, so that the packing stays much the same while it is timed.
constexpr double LARGEST_STRAIN = 0.05;
constexpr int REPEATS = 5;    // timings of a case; their median is the result

/// Simple shear in steps of equal strain.
template <int D> struct Shearing {
  double rate;         ///< [1/time]
  double time_step;    ///< [time]

  rve::DriveOf<D> drive(int substeps) const
  {
    auto gradient = rve::Tensor<double, D>::zero();
    gradient(0, 1) = rate;
    return rve::DriveOf<D>::constant_velocity_gradient(gradient, time_step, substeps);
  }
  double strain_of(int substeps) const { return rate * time_step * substeps; }
};

/// Returns the shearing of an experiment. All packings of disks have the rate 0.05/s and the time
/// step 5e-5 s of the paper. Spheres have 0.3 of their stable time step and a strain of 5e-7 per
/// step. At overlaps of 5e-4 diameters, their inertial number is 1e-4.
Shearing<2> shearing_of(const rve::RveState &)
{
  return {0.05, 5e-5};
}

Shearing<3> shearing_of(const rve::RveStateOf<3> &packing)
{
  const double time_step = 0.3 * rve::stable_time_step(packing);
  return {5e-7 / time_step, time_step};
}

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start)
{
  return std::chrono::duration<double>(Clock::now() - start).count();
}

struct Arguments {
  std::string packing, output, suite = "quick";
  bool cuda = false;
  double seconds = 0.5;    // approximate duration of a case
  // Numbers of RVEs from the option --rves; empty: each experiment has its own. An experiment that
  // runs only one number of RVEs uses the last number of the list.
  std::vector<int> rves;
  std::string format;    // number format; empty: all
  int threads = 0;       // threads of a block on a GPU; 0: the engine chooses
  // The sanitizer suites are divided into `parts` parts, and this process runs the part with the
  // index `part`.
  int part = 0, parts = 1;
};

struct Precision {
  Format format;
  Arithmetic arithmetic;
  bool operator==(const Precision &other) const
  {
    return format == other.format && arithmetic == other.arithmetic;
  }
};

/// Arguments, packing and report, which all experiments use.
template <int D> struct Bench {
  Arguments arguments;
  rve::RveStateOf<D> packing;
  Report report;
  std::string gpu;    // short name; empty on a CPU
  int visits = 0;     // kernel variants visited by the sanitizer suites, over all parts

  int cores() const { return static_cast<int>(std::thread::hardware_concurrency()); }
  int many() const
  {
    if (!arguments.rves.empty()) return arguments.rves.back();
    return arguments.cuda ? (D == 2 ? 9600 : 6000) : 8 * cores();
  }
  std::vector<Precision> precisions() const
  {
    std::vector<Precision> all = {{Format::Fast, Arithmetic::Strict},
                                  {Format::Mixed, Arithmetic::Strict},
                                  {Format::Double, Arithmetic::Strict}};
    if (arguments.cuda) all.insert(all.begin(), {Format::Fast, Arithmetic::Relaxed});
    if (!arguments.format.empty())
      all.erase(std::remove_if(all.begin(), all.end(),
                               [this](const Precision &one) {
                                 return rve::to_string(one.format) != arguments.format;
                               }),
                all.end());
    return all;
  }
  /// Returns all precisions including a rare one, whose kernels are compiled when they are run.
  std::vector<Precision> all_precisions() const
  {
    std::vector<Precision> all = precisions();
    if (arguments.cuda && (arguments.format.empty() || arguments.format == "mixed"))
      all.push_back({Format::Mixed, Arithmetic::Relaxed});
    return all;
  }
  /// Returns the fastest and the default precision.
  std::vector<Precision> two_precisions() const
  {
    return {precisions().front(), {Format::Mixed, Arithmetic::Strict}};
  }
};

template <int D> rve::Options options_for(const Bench<D> &bench, Precision precision, int rves)
{
  rve::Options options;
  options.format = precision.format;
  options.arithmetic = precision.arithmetic;
  options.device = bench.arguments.cuda ? rve::Device::Cuda : rve::Device::Cpu;
  options.block_size = bench.arguments.threads;
  options.threads = bench.arguments.cuda ? 0 : (rves == 1 ? 1 : bench.cores());
  return options;
}

template <int D>
rve::Options with_contacts_of(const rve::RveStateOf<D> &packing, rve::Options options)
{
  options.contacts = rve::contacts_of(packing);
  return options;
}

/// Copies of one packing in their own engine.
template <int D> struct Batch {
  rve::Options options;
  int grains;
  rve::Material material;
  Shearing<D> shearing;
  std::unique_ptr<rve::EngineOf<D>> engine;
  std::vector<int> rves;

  Batch(const rve::Options &options_in, const rve::RveStateOf<D> &packing, int count) :
      options(with_contacts_of(packing, options_in)), grains(packing.num_grains()),
      material(packing.material), shearing(shearing_of(packing)),
      engine(rve::make_engine<D>(options)), rves(count)
  {
    for (int &rve : rves) rve = engine->add(packing);
  }

  /// Returns the complete result of the first RVE without advancing it.
  rve::ResultOf<D> evaluate() const
  {
    std::vector<rve::ResultOf<D>> results;
    engine->advance({rves[0]}, {rve::DriveOf<D>()}, results);
    return results[0];
  }
};

void require_sound(std::uint32_t status)
{
  if (status & rve::status::Fatal)
    throw std::runtime_error("an RVE failed: " + rve::describe_status(status));
}

/// Returns the seconds that the calls take. Answer is rve::ResponseOf<D> or rve::ResultOf<D>.
template <int D, class Answer>
double time_calls(rve::EngineOf<D> &engine, const std::vector<int> &rves,
                  const std::vector<rve::DriveOf<D>> &drives, long calls,
                  std::vector<Answer> &answers)
{
  const auto start = Clock::now();
  for (long c = 0; c < calls; ++c) engine.advance(rves, drives, answers);
  return seconds_since(start);
}

struct Measured {
  double median = 0.0, best = 0.0, mean = 0.0;    // RVE-steps per second
  long calls = 0;                                 // number of calls in a repeat
  double rebuilds = 0.0;                          // per 1000 steps of the first RVE
  double pressure = 0.0;    // final pressure of the first RVE; equal in all formats
};

/// Returns the number of calls in a repeat, at least one. All repeats together then take about
/// `seconds`, or less time if the strain would otherwise exceed LARGEST_STRAIN.
long calls_in_repeat(double seconds, double seconds_per_call, double strain_of_call)
{
  const double by_time = seconds / REPEATS / seconds_per_call;
  const double by_strain = LARGEST_STRAIN / REPEATS / strain_of_call;
  return std::max(1L, static_cast<long>(std::min(by_time, by_strain)));
}

/// Measures the rates of REPEATS repeats. Two calls come before them: one for preparation, and one
/// that estimates the duration of a call.
template <template <int> class Answer = rve::ResponseOf, int D>
Measured measure(const Batch<D> &batch, const std::vector<rve::DriveOf<D>> &of_all, double seconds)
{
  // The calls omit RVEs without a step, as fix rve omits quiescent RVEs.
  std::vector<int> rves;
  std::vector<rve::DriveOf<D>> drives;
  for (std::size_t k = 0; k < of_all.size(); ++k) {
    if (of_all[k].substeps == 0) continue;
    rves.push_back(batch.rves[k]);
    drives.push_back(of_all[k]);
  }
  long steps = 0;
  int longest = 1;
  for (const rve::DriveOf<D> &drive : drives) {
    steps += drive.substeps;
    longest = std::max(longest, drive.substeps);
  }
  std::vector<Answer<D>> answers;
  time_calls(*batch.engine, rves, drives, 1, answers);
  const double estimate = time_calls(*batch.engine, rves, drives, 1, answers);
  const rve::Counters before = batch.evaluate().counters;
  Measured measured;
  measured.calls = calls_in_repeat(seconds, estimate, batch.shearing.strain_of(longest));
  const double steps_of_repeat = static_cast<double>(steps) * measured.calls;
  std::vector<double> rates(REPEATS);
  double all_seconds = 0.0;
  for (double &rate : rates) {
    const double took = time_calls(*batch.engine, rves, drives, measured.calls, answers);
    rate = steps_of_repeat / took;
    all_seconds += took;
  }
  measured.mean = REPEATS * steps_of_repeat / all_seconds;
  for (const Answer<D> &answer : answers) require_sound(answer.status);
  std::sort(rates.begin(), rates.end());
  measured.median = rates[REPEATS / 2];
  measured.best = rates.back();
  const rve::ResultOf<D> after = batch.evaluate();
  measured.rebuilds = 1000.0 * static_cast<double>(after.counters.rebuilds - before.rebuilds) /
      std::max(1.0, static_cast<double>(after.counters.steps - before.steps));
  measured.pressure = after.mean_stress();
  return measured;
}

template <int D> Measured measure(const Batch<D> &batch, int substeps, double seconds)
{
  return measure(batch,
                 std::vector<rve::DriveOf<D>>(batch.rves.size(), batch.shearing.drive(substeps)),
                 seconds);
}

/// Returns words for the contact law, for example "hooke", "hertz rolling" or "hertz
/// mindlin/force".
std::string words_of(const rve::ContactModel &contacts, const rve::Material &material)
{
  const bool keeps_force =
      contacts.law == rve::ContactLaw::Hertz && material.mindlin_displacement == 0.0;
  return std::string(word_of(contacts.law)) + (contacts.rolling ? " rolling" : "") +
      (keeps_force ? " mindlin/force" : "");
}

template <int D>
json case_of(const Bench<D> &bench, const std::string &experiment, const Batch<D> &batch,
             int substeps)
{
  const rve::Options &options = batch.options;
  json keys = {{"device",
                bench.arguments.cuda       ? bench.gpu
                    : options.threads == 1 ? "cpu-1"
                                           : "cpu-all"},
               {"code", "gpu_rve"},
               {"scene", "element"},
               {"experiment", experiment},
               {"dim", D},
               {"grains", batch.grains},
               {"rves", batch.rves.size()},
               {"format", to_string(options.format)},
               {"arithmetic", options.arithmetic == Arithmetic::Relaxed ? "relaxed" : "strict"},
               {"substeps", substeps}};
  if (D == 3) keys["law"] = words_of(options.contacts, batch.material);
  if (!bench.arguments.cuda)
    keys["threads"] = options.threads;
  else if (options.block_size > 0)
    keys["threads"] = options.block_size;
  else
    keys["threads"] = "auto";
  return keys;
}

void print(const json &keys, const std::string &note, const Measured &m)
{
  std::printf("%-8s %-6s %-7s %7d RVEs x %5d grains, %4d substeps, %-18s %10.4f M RVE-steps/s  "
              "(best %.4f, %.2f rebuilds in 1000 "
              "steps, p %.6g)\n",
              keys["experiment"].get<std::string>().c_str(),
              keys["format"].get<std::string>().c_str(),
              keys["arithmetic"].get<std::string>().c_str(), keys["rves"].get<int>(),
              keys["grains"].get<int>(), keys["substeps"].get<int>(), note.c_str(), 1e-6 * m.median,
              1e-6 * m.best, m.rebuilds, m.pressure);
  std::fflush(stdout);
}

/// Returns the numbers that another code needs to run the same case (compare_lammps.py).
template <int D> json conditions_of(const Batch<D> &batch)
{
  const rve::Material &material = batch.material;
  const bool linear = material.law == rve::ContactLaw::Linear;
  return {{"strain_rate", batch.shearing.rate},
          {"time_step", batch.shearing.time_step},
          {"normal_stiffness", linear ? material.normal_stiffness : material.hertz_stiffness},
          {"tangential_stiffness",
           linear ? material.tangential_stiffness : material.mindlin_stiffness}};
}

/// Reports and prints one case.
template <int D>
void record(Bench<D> &bench, const json &keys, const Measured &m, const std::string &note = "",
            const json &conditions = json::object())
{
  json details = {{"best", m.best}, {"repeats", REPEATS}, {"rebuilds_per_1000_steps", m.rebuilds}};
  details.update(conditions);
  bench.report.add(keys, "rve_steps_per_second", m.median, "1/s", details);
  print(keys, note, m);
}

// ---- experiments ----

/// Returns the packing and, for spheres, the same packing with Hertz' contacts that store a
/// displacement (*mindlin*) or a force. The speed of disks with Hertz' contacts, which few users
/// need, is not measured.
template <int D> std::vector<rve::RveStateOf<D>> packings_by_law(const Bench<D> &bench)
{
  std::vector<rve::RveStateOf<D>> packings = {bench.packing};
  if (D == 3 && bench.packing.material.law == rve::ContactLaw::Linear)
    for (const double displacement : {1.0, 0.0}) {
      packings.push_back(bench::with_hertz_contacts(bench.packing));
      packings.back().material.mindlin_displacement = displacement;
    }
  return packings;
}

/// Measures the throughput for several formats and numbers of RVEs, with short and long calls.
template <int D> void run_core(Bench<D> &bench)
{
  std::vector<int> counts = bench.arguments.rves;
  if (counts.empty())
    counts = bench.arguments.cuda ? std::vector<int>{1, 132, bench.many()}
                                  : std::vector<int>{1, bench.many()};
  for (const rve::RveStateOf<D> &packing : packings_by_law(bench))
    for (const Precision precision : bench.all_precisions()) {
      for (const int count : counts)
        for (const int substeps : {10, 2000}) {
          const Batch<D> batch(options_for(bench, precision, count), packing, count);
          record(bench, case_of(bench, "core", batch, substeps),
                 measure(batch, substeps, bench.arguments.seconds),
                 words_of(batch.options.contacts, batch.material), conditions_of(batch));
        }
      const Batch<D> one(options_for(bench, precision, 1), packing, 1);
      json keys = case_of(bench, "core", one, 0);
      keys.erase("substeps");
      keys.erase("rves");
      bench.report.add(keys, "bytes_per_rve",
                       static_cast<double>(one.engine->bytes_per_rve(one.grains)), "B");
    }
}

/// Measures the throughput for several numbers of threads per block (Figure 11 and Table 6 of the
/// paper).
template <int D> void run_block_sizes(Bench<D> &bench)
{
  if (!bench.arguments.cuda) return;
  for (const Precision precision : bench.two_precisions())
    for (const int threads :
         {0, 32, 64, 96, 128, 160, 192, 224, 256, 320, 384, 416, 448, 512, 640, 768, 896, 1024}) {
      rve::Options options = options_for(bench, precision, bench.many());
      options.block_size = threads;
      const Batch<D> batch(options, bench.packing, bench.many());
      const int substeps = 200;
      record(bench, case_of(bench, "block_size", batch, substeps),
             measure(batch, substeps, bench.arguments.seconds),
             threads ? std::to_string(threads) + " threads" : "automatic");
    }
}

/// Measures the throughput for several numbers of RVEs (Figures 12 and 13 of the paper).
template <int D> void run_counts(Bench<D> &bench)
{
  const std::vector<int> counts = bench.arguments.cuda
      ? std::vector<int>{1,   8,   32,   66,   100,  132,  200,  264,   330,  396,
                         528, 792, 1000, 1320, 2000, 5000, 9600, 10000, 20000}
      : std::vector<int>{1, bench.cores(), 4 * bench.cores(), 100};
  for (const Precision precision : bench.two_precisions())
    for (const int count : counts) {
      const Batch<D> batch(options_for(bench, precision, count), bench.packing, count);
      const int substeps = 500;
      record(bench, case_of(bench, "rves", batch, substeps),
             measure(batch, substeps, bench.arguments.seconds));
    }
}

/// Measures the rate of successive calls with one RVE each.
template <int D> Measured measure_one_by_one(const Batch<D> &batch, int substeps)
{
  const std::vector<rve::DriveOf<D>> drive = {batch.shearing.drive(substeps)};
  std::vector<rve::ResponseOf<D>> answer;
  Measured measured;
  measured.calls = static_cast<long>(batch.rves.size());
  std::vector<double> rates(REPEATS + 1);    // the first one builds the lists
  for (double &rate : rates) {
    const auto start = Clock::now();
    for (const int rve : batch.rves) {
      batch.engine->advance({rve}, drive, answer);
      require_sound(answer[0].status);
    }
    rate = static_cast<double>(substeps) * measured.calls / seconds_since(start);
  }
  std::sort(rates.begin() + 1, rates.end());
  measured.median = rates[1 + REPEATS / 2];
  measured.best = rates.back();
  const rve::ResultOf<D> after = batch.evaluate();
  measured.rebuilds = 1000.0 * static_cast<double>(after.counters.rebuilds) /
      static_cast<double>(after.counters.steps);
  measured.pressure = after.mean_stress();
  return measured;
}

/// Compares one launch for all RVEs with a launch for each RVE.
template <int D> void run_launches(Bench<D> &bench)
{
  const int count = bench.arguments.cuda ? 1320 : bench.many();
  for (const int substeps : {10, 100})
    for (const bool together : {true, false}) {
      const Batch<D> batch(options_for(bench, bench.precisions().front(), count), bench.packing,
                           count);
      json keys = case_of(bench, "launches", batch, substeps);
      keys["launches"] = together ? 1 : count;
      record(bench, keys,
             together ? measure(batch, substeps, bench.arguments.seconds)
                      : measure_one_by_one(batch, substeps),
             together ? "one launch" : "a launch for each");
    }
}

/// Measures the throughput for several numbers of DEM steps per call, which shows the cost of
/// loading and storing the state.
template <int D> void run_substeps(Bench<D> &bench)
{
  for (const Precision precision : bench.two_precisions())
    for (const int substeps : {1, 2, 5, 10, 20, 50, 100, 2000}) {
      const Batch<D> batch(options_for(bench, precision, bench.many()), bench.packing,
                           bench.many());
      record(bench, case_of(bench, "substeps", batch, substeps),
             measure(batch, substeps, bench.arguments.seconds));
    }
}

/// Measures the throughput for several numbers of grains per RVE. The total number of grains is
/// about the same for all of them.
template <int D> void run_grains(Bench<D> &bench)
{
  const std::vector<int> sizes = D == 2
      ? std::vector<int>{50, 100, 200, 400, 700, 1000, 1500, 3000, 6000, 12000, 20000}
      : std::vector<int>{50, 100, 200, 500, 1000, 1500, 2000, 4000, 8000};
  std::vector<std::future<rve::RveStateOf<D>>> packings;
  for (const int grains : sizes)
    packings.push_back(std::async(
        std::launch::async, [&bench, grains] { return bench::packing_of(bench.packing, grains); }));
  // On a GPU the total is one RVE of 8000 grains, or several smaller ones, for each of 132
  // multiprocessors.
  const int fewest = bench.arguments.cuda ? 132 : 2;
  const int total = bench.arguments.cuda ? fewest * 8000 : 10000 * bench.cores();
  const int substeps = bench.arguments.cuda ? 2000 : 20;
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    const rve::RveStateOf<D> packing = packings[k].get();
    const int count = std::max(fewest, total / sizes[k]);
    for (const Precision precision : bench.precisions()) {
      const Batch<D> batch(options_for(bench, precision, count), packing, count);
      const json keys = case_of(bench, "grains", batch, substeps);
      const Measured measured = measure(batch, substeps, bench.arguments.seconds);
      record(bench, keys, measured);
      bench.report.add(keys, "grain_steps_per_second", measured.median * sizes[k], "1/s");
      bench.report.add(keys, "bytes_per_rve",
                       static_cast<double>(batch.engine->bytes_per_rve(sizes[k])), "B");
    }
  }
}

/// Returns drives with steps_at(x) steps. The numbers x are evenly distributed from 0 to 1 in a
/// mixed order: x_k is the fractional part of (k + 1)/phi, where phi = 1.618 is the golden ratio.
template <int D, class StepsAt>
std::vector<rve::DriveOf<D>> mixed_drives(const Shearing<D> &shearing, int count,
                                          const StepsAt &steps_at)
{
  std::vector<rve::DriveOf<D>> drives;
  for (int k = 0; k < count; ++k)
    drives.push_back(shearing.drive(steps_at(std::fmod(0.6180339887498949 * (k + 1), 1.0))));
  return drives;
}

/// Returns drives with evenly distributed numbers of steps. The least number is mean/10.5, the
/// largest is 20 times the least, and the average is `mean`.
template <int D>
std::vector<rve::DriveOf<D>> unequal_drives(const Shearing<D> &shearing, int count, double mean)
{
  const double least = mean / 10.5;
  return mixed_drives(shearing, count, [least](double place) {
    return static_cast<int>(std::lround(least * (1.0 + 19.0 * place)));
  });
}

/// Returns drives as adaptive substeps produce them: one of a hundred RVEs takes 50 steps, half of
/// the RVEs take one, and the rest none. The mean is one.
template <int D> std::vector<rve::DriveOf<D>> drives_of_few(const Shearing<D> &shearing, int count)
{
  return mixed_drives(shearing, count, [](double place) {
    return place > 0.99 ? 50 : place > 0.49 ? 1 : 0;
  });
}

/// Returns drives with the same sum of steps as `unequal`, divided as equally as integers allow.
template <int D>
std::vector<rve::DriveOf<D>> equal_drives(const Shearing<D> &shearing,
                                          const std::vector<rve::DriveOf<D>> &unequal)
{
  long total = 0;
  for (const rve::DriveOf<D> &drive : unequal) total += drive.substeps;
  const long count = static_cast<long>(unequal.size());
  std::vector<rve::DriveOf<D>> drives;
  for (long k = 0; k < count; ++k)
    drives.push_back(shearing.drive(static_cast<int>((k + 1) * total / count - k * total / count)));
  return drives;
}

/// Compares RVEs that have different numbers of substeps with RVEs that have equal numbers and the
/// same sum of substeps. The largest of the different numbers is 20 times the least one. If the
/// mean is one, the numbers are 50, 1 and 0 (drives_of_few()).
template <int D> void run_queue(Bench<D> &bench)
{
  for (const Precision precision : bench.two_precisions())
    for (const int mean : {1, 21, 1050}) {
      if (mean == 1 && bench.many() < 1000)
        continue;    // too few RVEs to give 50 steps to one of a hundred
      const Shearing<D> shearing = shearing_of(bench.packing);
      const int spread = mean == 1 ? 50 : 20;
      const auto unequal = mean == 1 ? drives_of_few(shearing, bench.many())
                                     : unequal_drives(shearing, bench.many(), mean);
      double rate_of[2];
      for (const bool balanced : {true, false}) {
        const Batch<D> batch(options_for(bench, precision, bench.many()), bench.packing,
                             bench.many());
        json keys = case_of(bench, "queue", batch, mean);
        keys["spread"] = balanced ? 1 : spread;
        const Measured measured = measure(
            batch, balanced ? equal_drives(shearing, unequal) : unequal, bench.arguments.seconds);
        record(bench, keys, measured, balanced ? "equal" : "spread 1:" + std::to_string(spread));
        rate_of[balanced] = measured.median;
        if (!balanced)
          bench.report.add(keys, "fraction_of_balanced", rate_of[false] / rate_of[true], "1");
      }
    }
}

/// Adds dashpots with a tenth of the critical damping of the mean grain.
template <int D> rve::RveStateOf<D> viscous(rve::RveStateOf<D> packing)
{
  rve::Material &material = packing.material;
  const double mass = packing.mass() / packing.num_grains();
  material.normal_viscosity = material.tangential_viscosity =
      0.1 * 2.0 * std::sqrt(0.5 * mass * material.normal_stiffness);
  return packing;
}

/// Removes friction and the tangential forces of the packing.
template <int D> rve::RveStateOf<D> frictionless(rve::RveStateOf<D> packing)
{
  packing.material.friction = 0.0;
  bench::forget_tangential_forces(packing);
  return packing;
}

/// Adds rolling resistance, and for spheres also twisting resistance.
template <int D> rve::RveStateOf<D> rolling(rve::RveStateOf<D> packing)
{
  rve::Material &material = packing.material;
  material.rolling_stiffness = 0.5 * material.normal_stiffness;
  material.rolling_friction = 0.1;
  if (D == 3) {
    const double radius = bench::mean_radius(packing);
    material.twisting_stiffness = 0.1 * material.normal_stiffness * radius * radius;
    material.twisting_friction = 0.1 * radius;
  }
  return packing;
}

/// Returns the packing with a feature: "frictionless", "viscous", "rolling" or "hertz". Other
/// features do not change the packing.
template <int D>
rve::RveStateOf<D> with_feature(const rve::RveStateOf<D> &packing, const std::string &feature)
{
  if (feature == "frictionless") return frictionless(packing);
  if (feature == "viscous") return viscous(packing);
  if (feature == "rolling") return rolling(packing);
  if (feature == "hertz") return bench::with_hertz_contacts(packing);
  return packing;
}

/// Returns a drive that holds the normal stress along y at its value in the packing.
template <int D> rve::DriveOf<D> servo_drive(const rve::RveStateOf<D> &packing, int substeps)
{
  const Shearing<D> shearing = shearing_of(packing);
  rve::DriveOf<D> drive = shearing.drive(substeps);
  drive.velocity_gradient(0, 1) = shearing.rate;
  drive.controlled[1][1] = true;
  drive.stress_goal = bench::evaluate(packing).stress;
  drive.servo_gain = rve::default_servo_gain(packing);
  return drive;
}

/// Measures calls with features and compares them with the plain call.
template <int D> void run_features(Bench<D> &bench)
{
  const int substeps = 200;
  const double seconds = bench.arguments.seconds;
  const std::vector<std::string> few = D == 2
      ? std::vector<std::string>{"plain", "frictionless", "servo"}
      : std::vector<std::string>{"plain", "rolling", "hertz"},
                                 all = D == 2
      ? std::vector<std::string>{"plain", "frictionless", "viscous",    "rolling",
                                 "servo", "energy",       "long_answer"}
      : std::vector<std::string>{"plain", "viscous", "rolling",    "hertz",
                                 "servo", "energy",  "long_answer"};
  const std::vector<Precision> two = bench.two_precisions();
  for (const Precision precision : bench.precisions())
    for (const std::string &feature : precision == two[0] || precision == two[1] ? all : few) {
      rve::Options options = options_for(bench, precision, bench.many());
      options.track_energy = feature == "energy";
      const rve::RveStateOf<D> packing = with_feature(bench.packing, feature);
      const Batch<D> batch(options, packing, bench.many());
      const rve::DriveOf<D> drive = feature == "servo" ? servo_drive(packing, substeps)
                                                       : batch.shearing.drive(substeps);
      const std::vector<rve::DriveOf<D>> drives(batch.rves.size(), drive);
      json keys = case_of(bench, "features", batch, substeps);
      keys["feature"] = feature;
      record(bench, keys,
             feature == "long_answer" ? measure<rve::ResultOf>(batch, drives, seconds)
                                      : measure(batch, drives, seconds),
             feature);
    }
}

/// Measures the throughput for several skins of the neighbor lists. A thin skin has fewer pairs
/// without contact and more rebuilds.
template <int D> void run_skins(Bench<D> &bench)
{
  const int substeps = 1000;
  for (const Precision precision : bench.two_precisions())
    for (const double share : {0.01, 0.02, 0.03, 0.05, 0.07, 0.1, 0.15}) {
      rve::Options options = options_for(bench, precision, bench.many());
      options.skin = share * bench::mean_radius(bench.packing);
      const Batch<D> batch(options, bench.packing, bench.many());
      json keys = case_of(bench, "skins", batch, substeps);
      keys["skin_over_mean_radius"] = share;
      record(bench, keys, measure(batch, substeps, bench.arguments.seconds),
             "skin " + rve::number(share));
    }
}

/// Measures the cost of a rebuild of the neighbor lists, in units of DEM steps, with a skin so thin
/// that rebuilds are frequent.
template <int D> void run_rebuilds(Bench<D> &bench)
{
  const int substeps = 200;
  for (const Precision precision : bench.precisions()) {
    rve::Options options = options_for(bench, precision, bench.many());
    Measured of[2];
    for (const bool thin : {false, true}) {
      if (thin) options.skin = 1e-3 * bench::mean_radius(bench.packing);
      const Batch<D> batch(options, bench.packing, bench.many());
      json keys = case_of(bench, "rebuilds", batch, substeps);
      keys["skin"] = thin ? "thin" : "usual";
      of[thin] = measure(batch, substeps, bench.arguments.seconds);
      record(bench, keys, of[thin], thin ? "thin skin" : "usual skin");
      const double more_rebuilds = 1e-3 * (of[1].rebuilds - of[0].rebuilds);    // per step
      if (thin && more_rebuilds > 0.0)
        // The means over all repeats include all rebuilds, while the numbers of rebuilds of single
        // repeats differ by one or two.
        bench.report.add(keys, "steps_per_rebuild", (of[0].mean / of[1].mean - 1.0) / more_rebuilds,
                         "step");
    }
  }
}

/// Adds RVEs until there are `goal` or the memory is full, and prints the reason.
template <int D> class Filling {
 public:
  Filling(rve::EngineOf<D> &engine_in, const rve::RveStateOf<D> &packing_in) :
      engine(engine_in), packing(packing_in)
  {
  }

  void fill(int goal)
  {
    const auto start = Clock::now();
    try {
      for (; count < goal; ++count) {
        engine.add(packing);
        if ((count + 1) % 250000 == 0) {
          std::printf("memory   %d RVEs are there\n", count + 1);
          std::fflush(stdout);
        }
      }
    } catch (const std::exception &error) {
      std::printf("memory   no more than %d RVEs: %s\n", count, error.what());
    }
    seconds += seconds_since(start);
  }

  int count = 0;
  double seconds = 0.0;

 private:
  rve::EngineOf<D> &engine;
  const rve::RveStateOf<D> &packing;
};

/// Advances every RVE in calls of `chunk` RVEs and returns the seconds.
template <int D> double advance_all(const Batch<D> &batch, int count, int chunk, int substeps)
{
  double seconds = 0.0;
  std::vector<rve::ResponseOf<D>> answers;
  for (int first = 0; first < count; first += chunk) {
    std::vector<int> rves(std::min(chunk, count - first));
    for (std::size_t k = 0; k < rves.size(); ++k) rves[k] = first + static_cast<int>(k);
    const std::vector<rve::DriveOf<D>> drives(rves.size(), batch.shearing.drive(substeps));
    seconds += time_calls(*batch.engine, rves, drives, 1, answers);
    for (const rve::ResponseOf<D> &answer : answers) require_sound(answer.status);
  }
  return seconds;
}

/// Measures a given number of RVEs in one call. If the memory is too small, it measures as many
/// RVEs as fit, in several smaller calls. Buffers for calls of this smaller size are allocated
/// before the RVEs fill the memory.
template <int D> void run_memory(Bench<D> &bench)
{
  const int goal = !bench.arguments.rves.empty() ? bench.arguments.rves.back()
      : bench.arguments.cuda                     ? (D == 2 ? 2500000 : 1000000)
                                                 : 2000;
  const int first = std::min(goal, 50000), substeps = 10;
  Batch<D> batch(options_for(bench, bench.precisions().front(), goal), bench.packing, 0);
  rve::EngineOf<D> &engine = *batch.engine;
  Filling<D> filling(engine, bench.packing);
  filling.fill(first);
  advance_all(batch, filling.count, first, substeps);
  filling.fill(goal);
  const int count = filling.count, chunk = count == goal ? goal : first;
  batch.rves.resize(count);
  advance_all(batch, count, chunk, substeps);    // builds the lists
  const double seconds = advance_all(batch, count, chunk, substeps);

  const json keys = case_of(bench, "memory", batch, substeps);
  const double bytes = static_cast<double>(engine.bytes_per_rve(batch.grains));
  const double rate = static_cast<double>(count) * substeps / seconds;
  bench.report.add(keys, "rve_steps_per_second", rate, "1/s",
                   {{"rves_in_a_call", chunk}, {"grains_in_all", 1.0 * count * batch.grains}});
  bench.report.add(keys, "bytes_per_rve", bytes, "B", {{"bytes_in_all", bytes * count}});
  bench.report.add(keys, "wall_s", seconds, "s", {{"what", "ten steps of all RVEs"}});
  bench.report.add(keys, "wall_s", filling.seconds, "s", {{"what", "adding the RVEs"}});
  std::printf("memory   %d RVEs, %.4g grains, %.4g GB: %d steps in %.3f s, %.4f M RVE-steps/s; "
              "%.1f us to add one\n",
              count, 1.0 * count * batch.grains, 1e-9 * bytes * count, substeps, seconds,
              1e-6 * rate, 1e6 * filling.seconds / count);
}

/// Returns the names of the kernel variants of a dimension that the sanitizer suites visit.
template <int D> std::vector<std::string> visited_variants()
{
  if (D == 2) return {"plain", "frictionless", "steered", "general", "rolling"};
  return {"plain", "steered", "general", "rolling", "hertz"};
}

/// Number of threads of a block that keeps its grains in registers while many RVEs share a
/// multiprocessor.
template <int D> constexpr int REGISTERS = D == 2 ? 416 : 256;

/// Number of threads of a block that keeps grains in registers, for disks with a servo. Each thread
/// has two grains.
constexpr int STEERED = 224;

/// Runs every path of the kernel variants once, for compute-sanitizer. This is not a measurement.
/// Throws if a path was not taken.
template <int D>
void visit_all_paths(Bench<D> &bench, const rve::RveStateOf<D> &packing, const Precision &precision,
                     int block, const bench::Company &company,
                     const std::vector<std::string> &variants)
{
  for (const std::string &variant : variants) {
    if (bench.visits++ % bench.arguments.parts != bench.arguments.part) continue;
    rve::Options options = options_for(bench, precision, bench.cores());
    options.block_size = block;
    options.track_energy = variant != "plain" && variant != "frictionless" && variant != "steered";
    const rve::RveStateOf<D> grains = with_feature(packing, variant);
    bench::Company in = company;
    // Kernel variants with energy bookkeeping are slow under a sanitizer and have only one kernel
    // for large calls. For them, large calls are made with one block size only.
    if (options.track_energy && block != REGISTERS<D>) in = {true, 0, company.is_light};
    bench::visit_all_paths(options, grains, shearing_of(grains).time_step, in, variant);
  }
}

/// Runs all paths for compute-sanitizer. Spheres have one kernel more than disks and take longer,
/// so their packing has only 200 grains.
template <int D> void run_sanitize(Bench<D> &bench)
{
  const auto packing = D == 2 ? bench.packing : bench::packing_of(bench.packing, 200);
  std::vector<int> blocks = {0};
  if (bench.arguments.cuda)
    blocks = D == 2 ? std::vector<int>{64, REGISTERS<D>, 1024}
                    : std::vector<int>{64, REGISTERS<D>, 512, 1024};
  for (const Precision precision : bench.precisions())
    for (const int block : blocks)
      visit_all_paths(bench, packing, precision, block, {true, 400, false}, visited_variants<D>());
  if (D == 3) return;
  for (const Precision precision : bench.precisions())
    visit_all_paths(bench, packing, precision, STEERED, {true, 400, false}, {"steered"});
}

/// Runs a selection of paths for racecheck, which is slow. In the format fast, it runs every kernel
/// variant with grains in registers and in memory. In the other formats, it runs only the variants
/// plain and general, and steered for disks, with grains in registers. Accesses to shared memory do
/// not depend on the arithmetic or the number of grains.
template <int D> void run_races(Bench<D> &bench)
{
  const auto packing = bench::packing_of(bench.packing, D == 2 ? 60 : 200);
  const bench::Company in_registers = {false, 140, true}, in_memory = {true, 0, true};
  for (const Precision precision : bench.precisions()) {
    if (precision.arithmetic == Arithmetic::Relaxed) continue;
    const bool fast = precision.format == Format::Fast;
    for (const std::string &variant : visited_variants<D>()) {
      if (fast || variant == "plain" || variant == "general")
        visit_all_paths(bench, packing, precision, REGISTERS<D>, in_registers, {variant});
      if (fast) visit_all_paths(bench, packing, precision, 64, in_memory, {variant});
    }
    if (D == 2) visit_all_paths(bench, packing, precision, STEERED, in_registers, {"steered"});
  }
}

/// Runs a few long calls with many RVEs in each format, for profile_pipes.py.
template <int D> void run_profile(Bench<D> &bench)
{
  for (const rve::RveStateOf<D> &packing : packings_by_law(bench))
    for (const Precision precision : bench.precisions()) {
      const Batch<D> batch(options_for(bench, precision, bench.many()), packing, bench.many());
      std::vector<rve::ResponseOf<D>> answers;
      const std::vector<rve::DriveOf<D>> drives(batch.rves.size(), batch.shearing.drive(100));
      time_calls(*batch.engine, batch.rves, drives, 4, answers);
      for (const rve::ResponseOf<D> &answer : answers) require_sound(answer.status);
    }
}

template <int D> using Experiment = void (*)(Bench<D> &);

template <int D> const std::map<std::string, std::vector<Experiment<D>>> &suites()
{
  static const std::map<std::string, std::vector<Experiment<D>>> all = {
      {"core", {run_core<D>}},
      {"paper", {run_block_sizes<D>, run_counts<D>, run_launches<D>}},
      {"substeps", {run_substeps<D>}},
      {"grains", {run_grains<D>}},
      {"queue", {run_queue<D>}},
      {"features", {run_features<D>, run_rebuilds<D>}},
      {"rebuilds", {run_rebuilds<D>}},
      {"skins", {run_skins<D>}},
      {"memory", {run_memory<D>}},
      {"sanitize", {run_sanitize<D>}},
      {"races", {run_races<D>}},
      {"profile", {run_profile<D>}},
      {"quick", {run_core<D>, run_substeps<D>, run_queue<D>}},
      {"full",
       {run_core<D>, run_block_sizes<D>, run_counts<D>, run_launches<D>, run_substeps<D>,
        run_grains<D>, run_queue<D>, run_features<D>, run_rebuilds<D>}}};
  return all;
}

// ---- main program ----

std::string words_of_suites()
{
  std::string words;
  for (const auto &[name, experiments] : suites<2>()) words += (words.empty() ? "" : "|") + name;
  return words;
}

double positive_number(const std::string &option, const std::string &word)
{
  char *end = nullptr;
  const double value = std::strtod(word.c_str(), &end);
  rve::require(end != word.c_str() && *end == 0 && value > 0.0 && std::isfinite(value),
               option + " must be a positive number, got " + word);
  return value;
}

std::vector<int> positive_integers(const std::string &option, const std::string &words)
{
  std::vector<int> numbers;
  std::stringstream list(words);
  for (std::string word; std::getline(list, word, ',');) {
    const double value = positive_number(option, word);
    rve::require(value == std::floor(value) && value <= 1e8,
                 option + " must be whole numbers up to 1e8, got " + word);
    numbers.push_back(static_cast<int>(value));
  }
  return numbers;
}

/// Returns K - 1 and N for "K/N".
std::pair<int, int> part_of_parts(const std::string &option, const std::string &word)
{
  int part = 0, parts = 0, used = 0;
  const int read = std::sscanf(word.c_str(), "%d/%d%n", &part, &parts, &used);
  rve::require(read == 2 && used == static_cast<int>(word.size()) && 1 <= part && part <= parts,
               option + " must be K/N with K from 1 to N, got " + word);
  return {part - 1, parts};
}

Arguments parse(int argc, char **argv)
{
  rve::require(argc >= 3,
               "usage: bench_engine <packing.rve> <output.json> [--device cpu|cuda] [--suite " +
                   words_of_suites() +
                   "] [--seconds S] [--rves N,...] [--format F] [--threads N] [--part K/N]");
  Arguments arguments;
  arguments.packing = argv[1];
  arguments.output = argv[2];
  for (int a = 3; a < argc; a += 2) {
    const std::string option = argv[a], word = a + 1 < argc ? argv[a + 1] : "";
    if (option == "--device") {
      rve::require(word == "cpu" || word == "cuda", "--device must be cpu or cuda, got " + word);
      arguments.cuda = word == "cuda";
    } else if (option == "--suite") {
      rve::require(suites<2>().count(word) == 1,
                   "--suite must be " + words_of_suites() + ", got " + word);
      arguments.suite = word;
    } else if (option == "--seconds") {
      arguments.seconds = positive_number(option, word);
    } else if (option == "--rves") {
      arguments.rves = positive_integers(option, word);
    } else if (option == "--format") {
      rve::require(word == "fast" || word == "mixed" || word == "double",
                   "--format must be fast, mixed or double, got " + word);
      arguments.format = word;
    } else if (option == "--threads") {
      arguments.threads = positive_integers(option, word).front();
    } else if (option == "--part") {
      std::tie(arguments.part, arguments.parts) = part_of_parts(option, word);
    } else {
      throw rve::InputError("unknown option " + option);
    }
  }
  return arguments;
}

/// Returns "H200" for "NVIDIA H200, mixed, strict" and "H100" for "NVIDIA H100 80GB HBM3, ...".
std::string short_gpu_name(const std::string &description)
{
  std::stringstream words(description.substr(0, description.find(',')));
  std::string name;
  for (std::string word; words >> word;) {
    if (word == "NVIDIA" || word == "GeForce" || word == "Tesla") continue;
    if (word.size() > 2 && word.compare(word.size() - 2, 2, "GB") == 0) break;
    name += (name.empty() ? "" : " ") + word;
  }
  return name;
}

/// Sets the name of the machine and runs the device until its clock has risen, so that the first
/// timed calls are not slower.
template <int D> void start_device(Bench<D> &bench)
{
  const std::string &suite = bench.arguments.suite;
  const bool timed = suite != "sanitize" && suite != "races" && suite != "profile";
  const int count = timed ? bench.many() : 1;
  const Batch<D> batch(options_for(bench, {Format::Fast, Arithmetic::Strict}, count), bench.packing,
                       count);
  const std::string description = batch.engine->description();
  const std::string device = description.substr(0, description.find(','));
  if (bench.arguments.cuda) bench.gpu = short_gpu_name(description);
  bench.report.set_machine((bench.arguments.cuda ? device : bench::processor_name()) + ", " +
                           std::to_string(bench.cores()) + " CPU threads");
  if (timed) measure(batch, 100, bench.arguments.seconds);
}

template <int D> int run(const Arguments &arguments, const Report &report)
{
  Bench<D> bench{arguments, rve::read_packing<D>(arguments.packing), report, ""};
  // The number of threads is the same as in LAMMPS with a GPU (RankResources::threads_beside_gpu).
  if (arguments.cuda) rve::most_in_a_team() = std::max(1, bench.cores() / 2);
  start_device(bench);
  int failed = 0;
  for (const Experiment<D> experiment : suites<D>().at(arguments.suite)) {
    try {
      experiment(bench);
    } catch (const std::exception &error) {
      std::fprintf(stderr, "bench_engine: %s\n", error.what());
      failed = 1;
    }
    bench.report.write();
  }
  return failed;
}

}    // namespace

int main(int argc, char **argv)
{
  try {
    const Arguments arguments = parse(argc, argv);
    const Report report(argc, argv, arguments.output);
    return rve::dimension_of_packing(arguments.packing) == 2 ? run<2>(arguments, report)
                                                             : run<3>(arguments, report);
  } catch (const std::exception &error) {
    std::fprintf(stderr, "bench_engine: %s\n", error.what());
    return 1;
  }
}
