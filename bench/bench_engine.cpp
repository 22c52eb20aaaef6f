// Throughput of the engine: RVE-steps per second for formats, batch sizes and substeps per call, on the device at hand, with the
// stress as a check that all of them computed the same thing. Writes JSON rows (doc/performance.rst).
//
//   bench_engine <packing file> <output.json> [device cpu|cuda] [seconds per case] [rves ...]

#include "rve/engine/engine.h"
#include "rve/engine/packing_io.h"

#include <nlohmann/json.hpp>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start)
{
  return std::chrono::duration<double>(Clock::now() - start).count();
}

std::string environment(const char *name)
{
  const char *value = std::getenv(name);
  return value ? value : "";
}

std::string today()
{
  const std::time_t now = std::time(nullptr);
  char text[16];
  std::strftime(text, sizeof(text), "%Y-%m-%d", std::gmtime(&now));
  return text;
}

struct Measured {
  double rve_steps_per_second;
  double pressure;
  long rebuilds;
  long repeats;
};

/// Shear at 0.05 per second in calls of `substeps`, for about `seconds` after one warm-up call.
Measured measure(rve::Engine &engine, const std::vector<int> &rves, int substeps, double seconds)
{
  rve::Tensor2 gradient = rve::Tensor2::zero();
  gradient(0, 1) = 0.05;
  const double dt = 5e-5;
  const std::vector<rve::Drive> drives(
      rves.size(), rve::Drive::constant_velocity_gradient(gradient, dt, substeps));
  std::vector<rve::Result> results;
  engine.advance(rves, drives, results);
  long calls = 0;
  const auto start = Clock::now();
  while (calls == 0 || seconds_since(start) < seconds) {
    engine.advance(rves, drives, results);
    ++calls;
  }
  const double elapsed = seconds_since(start);
  return {static_cast<double>(calls) * substeps * static_cast<double>(rves.size()) / elapsed,
          results[0].mean_stress(), static_cast<long>(results[0].counters.rebuilds),
          static_cast<long>(results[0].counters.repeats)};
}

}    // namespace

int main(int argc, char **argv)
{
  if (argc < 3) {
    std::fprintf(stderr,
                 "usage: %s <packing> <output.json> [cpu|cuda] [seconds per case] [rves ...]\n",
                 argv[0]);
    return 1;
  }
  const std::string device = argc > 3 ? argv[3] : "cpu";
  const double seconds = argc > 4 ? std::atof(argv[4]) : 1.0;
  std::vector<int> batches;
  for (int a = 5; a < argc; ++a) batches.push_back(std::atoi(argv[a]));
  if (batches.empty())
    batches = device == "cuda" ? std::vector<int>{1, 132, 9600} : std::vector<int>{1};

  nlohmann::json report;
  std::string command;
  for (int a = 0; a < argc; ++a)
    command += std::string(a ? " " : "") + (a ? argv[a] : "bench_engine");
  report["date"] = today();
  report["commit"] = environment("GPU_RVE_COMMIT");
  report["command"] = command;
  report["rows"] = nlohmann::json::array();
  try {
    const rve::RveState packing = rve::read_packing(argv[1]);
    for (const rve::Format format : {rve::Format::Fast, rve::Format::Mixed, rve::Format::Double})
      for (const int batch : batches) {
        rve::Options options;
        options.format = format;
        options.device = device == "cuda" ? rve::Device::Cuda : rve::Device::Cpu;
        options.threads = device == "cuda"
            ? 0
            : (batch == 1 ? 1 : static_cast<int>(std::thread::hardware_concurrency()));
        const auto engine = rve::make_engine(options);
        report["machine"] = engine->description();
        std::vector<int> rves(batch);
        for (int &rve : rves) rve = engine->add(packing);
        for (const int substeps : {10, 100, 2000}) {
          const Measured m = measure(*engine, rves, substeps, seconds);
          std::printf("%-8s %6d RVEs %5d substeps: %10.4f M RVE-steps/s  (p %.6g, %ld rebuilds, "
                      "%ld repeats)\n",
                      to_string(format).c_str(), batch, substeps, 1e-6 * m.rve_steps_per_second,
                      m.pressure, m.rebuilds, m.repeats);
          std::fflush(stdout);
          nlohmann::json row;
          row["case"] = {{"device", device == "cuda" ? "H200" : (batch == 1 ? "cpu-1" : "cpu-all")},
                         {"code", "gpu_rve"},
                         {"scene", "element"},
                         {"dim", 2},
                         {"grains", packing.num_grains()},
                         {"rves", batch},
                         {"format", to_string(format)},
                         {"arithmetic", "strict"},
                         {"substeps", substeps}};
          row["metric"] = "rve_steps_per_second";
          row["value"] = m.rve_steps_per_second;
          row["unit"] = "1/s";
          report["rows"].push_back(row);
        }
        nlohmann::json row;
        row["case"] = {{"device", device},
                       {"code", "gpu_rve"},
                       {"grains", packing.num_grains()},
                       {"format", to_string(format)}};
        row["metric"] = "bytes_per_rve";
        row["value"] = engine->bytes_per_rve(packing.num_grains());
        row["unit"] = "B";
        report["rows"].push_back(row);
      }
  } catch (const std::exception &error) {
    std::fprintf(stderr, "bench_engine: %s\n", error.what());
    return 1;
  }
  std::ofstream(argv[2]) << report.dump(1) << "\n";
  return 0;
}
