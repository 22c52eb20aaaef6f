// SPDX-License-Identifier: GPL-2.0-only
// Runs the scenes of extremes.h in each number format and writes the findings to a file. The file
// has one row for each scene and format. It also has one row for each group of scenes (item) and
// format, with the values that hold, are warned about, are refused or fail. doc/src/stability.rst
// shows the file.
//
//   extremes_report <output.json> [--shape disk|sphere] [--device cpu|cuda|auto]
//                   [--length percent] [--machine words]

#include "stability/extremes.h"

#include "bench_report.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>

using namespace rve;
using namespace rve_test;
using nlohmann::json;

namespace {

constexpr Format FORMATS[] = {Format::Fast, Format::Mixed, Format::Double};

struct Arguments {
  std::string output, shape = "disk", device = "auto", machine;
  double percent = 1.0;
};

Arguments parse(int argc, char **argv)
{
  Arguments arguments;
  if (argc < 2 || argc % 2 != 0)
    throw std::runtime_error(
        "usage: extremes_report <output.json> [--shape disk|sphere] [--device cpu|cuda|auto] "
        "[--length percent] [--machine words]");
  arguments.output = argv[1];
  for (int a = 2; a < argc; a += 2) {
    const std::string word = argv[a], value = argv[a + 1];
    if (word == "--device" && (value == "cpu" || value == "cuda" || value == "auto"))
      arguments.device = value;
    else if (word == "--length" && std::atof(value.c_str()) >= 1.0 &&
             std::atof(value.c_str()) <= 100.0)
      arguments.percent = std::atof(value.c_str());
    else if (word == "--shape" && (value == "disk" || value == "sphere"))
      arguments.shape = value;
    else if (word == "--machine")
      arguments.machine = value;
    else
      throw std::runtime_error(
          word + " " + value +
          ": --shape is disk or sphere, --device is cpu, cuda or auto, --length "
          "from 1 to 100 [percent]");
  }
  return arguments;
}

std::string short_number(double value)
{
  char text[32];
  std::snprintf(text, sizeof(text), "%.4g", value);
  return text;
}

/// Returns the values with the given verdict as text, for example "1e-05 to 0.3, 0.9". Values that
/// follow each other in the list are written as a range.
std::string ranges(const std::vector<std::pair<double, Verdict>> &values, Verdict verdict)
{
  std::string words;
  for (std::size_t k = 0; k < values.size();) {
    std::size_t end = k;
    while (end < values.size() && values[end].second == verdict) ++end;
    if (end == k) {
      ++k;
      continue;
    }
    words += (words.empty() ? "" : ", ") + short_number(values[k].first);
    if (end - k > 1) words += " to " + short_number(values[end - 1].first);
    k = end;
  }
  return words;
}

template <int D> int run(const Arguments &arguments, bench::Report report)
{
  const std::vector<Config<D>> scenes = extreme_scenes<D>(arguments.percent / 100.0);
  const Device device = arguments.device == "cuda" ? Device::Cuda
      : arguments.device == "cpu"                  ? Device::Cpu
                                                   : Device::Auto;
  int silent = 0;
  for (const Format format : FORMATS) {
    std::string engine;
    const auto start = std::chrono::steady_clock::now();
    const std::vector<Finding<D>> findings = run_extremes(scenes, format, device, &engine);
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    report.set_machine(arguments.machine.empty() ? engine.substr(0, engine.find(','))
                                                 : arguments.machine);

    std::vector<std::string> items;
    std::map<std::string, std::vector<std::pair<double, Verdict>>> by_item;
    std::map<std::string, const Config<D> *> scene_of;
    for (const Finding<D> &finding : findings) {
      const Config<D> &scene = *finding.scene;
      if (!by_item.count(scene.item)) items.push_back(scene.item);
      by_item[scene.item].push_back({scene.value, finding.verdict});
      scene_of[scene.item] = &scene;
      silent += finding.verdict == Verdict::Silent;
      const json details = {{"limit", scene.limit[static_cast<int>(format)]},
                            {"verdict", to_string(finding.verdict)},
                            {"words", finding.words},
                            {"steps", finding.steps}};
      report.add({{"item", scene.item},
                  {"quantity", scene.quantity},
                  {"at", scene.value},
                  {"format", to_string(format)}},
                 "deviation", std::isfinite(finding.deviation) ? finding.deviation : -1.0, "-",
                 details);
      if (finding.verdict == Verdict::Silent)
        std::printf("silent: %s, %s %g, %s: deviation %g, limit %g %s\n", scene.item.c_str(),
                    scene.quantity.c_str(), scene.value, to_string(format).c_str(),
                    finding.deviation, scene.limit[static_cast<int>(format)],
                    finding.words.c_str());
    }
    for (const std::string &item : items) {
      const auto &values = by_item[item];
      const long holding = std::count_if(values.begin(), values.end(),
                                         [](const auto &v) { return v.second == Verdict::Holds; });
      json details = {{"property", scene_of[item]->property},
                      {"limit", scene_of[item]->limit[static_cast<int>(format)]}};
      for (const Verdict verdict :
           {Verdict::Holds, Verdict::Warned, Verdict::Status, Verdict::Silent})
        details[to_string(verdict)] = ranges(values, verdict);
      report.add({{"item", item},
                  {"quantity", scene_of[item]->quantity},
                  {"format", to_string(format)},
                  {"percent_of_length", arguments.percent}},
                 "envelope", static_cast<double>(holding) / values.size(),
                 "share of scenes that hold", details);
    }
    std::printf("%s: %zu scenes, %.1f s\n", engine.c_str(), findings.size(), seconds);
    report.write();
  }
  return silent ? 1 : 0;
}

}    // namespace

int main(int argc, char **argv)
try {
  const Arguments arguments = parse(argc, argv);
  const bench::Report report(argc, argv, arguments.output);
  return arguments.shape == "disk" ? run<2>(arguments, report) : run<3>(arguments, report);
} catch (const std::exception &e) {
  std::fprintf(stderr, "extremes_report: %s\n", e.what());
  return 2;
}
