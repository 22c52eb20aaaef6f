// SPDX-License-Identifier: GPL-2.0-only
// Tests that a fixed set of runs gives the results of golden_bits.txt to the last bit ("golden
// bits").
//
//   golden_bits [--device cpu|cuda] [--file FILE] [--only PART]
//       runs everything with PART in its name, compares the results with the file and prints the
//       differences
//   golden_bits --renew "reason" [--file FILE]
//       rewrites the file; the lines that differ get the reason
//
// A changed bit is not always an error, but it must be intended. A commit that changes bits must
// also renew the file.

#include "golden_scenes.h"

#include "rve/core/error.h"
#include "rve/engine/engine.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>

namespace {

using golden::Record;

constexpr int SKIPPED = 77;    // SKIP_RETURN_CODE in CMakeLists.txt

constexpr const char *HEAD =
    "# Golden bits: what fixed runs compute, kept by golden_bits (unittest/golden). A line has a "
    "name, the hash of all bits, and some of\n"
    "# the numbers behind it, exact, so that the size of a change is seen. The hash of a state "
    "does not depend on the order of its grains\n"
    "# and pairs. After # stands why the bits are not those of the line before:\n"
    "#     golden_bits --renew \"reason\"\n";

/// A line of golden_bits.txt.
struct Line {
  Record record;
  std::string reason;
};

std::string hash_text(std::uint64_t hash)
{
  char text[32];
  std::snprintf(text, sizeof(text), "%016llx", static_cast<unsigned long long>(hash));
  return text;
}

/// Returns an exact text of the value: decimal for integers below 1e9, hexadecimal for all others.
std::string exact(double value)
{
  char text[64];
  const bool is_count = value == std::floor(value) && std::fabs(value) < 1e9;
  std::snprintf(text, sizeof(text), is_count ? "%.0f" : "%a", value);
  return text;
}

std::string text_of(const Line &line)
{
  std::string text = line.record.name + "  " + hash_text(line.record.hash);
  for (const auto &[name, value] : line.record.numbers) text += "  " + name + "=" + exact(value);
  if (!line.reason.empty()) text += "  # " + line.reason;
  return text;
}

Line line_from(const std::string &text)
{
  Line line;
  const auto comment = text.find('#');
  if (comment != std::string::npos) {
    const auto begin = text.find_first_not_of(" #", comment);
    if (begin != std::string::npos) line.reason = text.substr(begin);
  }
  std::istringstream words(text.substr(0, comment));
  std::string hash;
  if (!(words >> line.record.name >> hash))
    throw std::runtime_error("not a line of golden bits: " + text);
  line.record.hash = std::stoull(hash, nullptr, 16);
  for (std::string word; words >> word;) {
    const auto equals = word.find('=');
    if (equals == std::string::npos)
      throw std::runtime_error("not a number of golden bits: " + word);
    line.record.numbers.emplace_back(word.substr(0, equals),
                                     std::strtod(word.c_str() + equals + 1, nullptr));
  }
  return line;
}

std::map<std::string, Line> read(const std::string &path)
{
  std::map<std::string, Line> lines;
  std::ifstream file(path);
  for (std::string text; std::getline(file, text);) {
    if (text.empty() || text[0] == '#') continue;
    const Line line = line_from(text);
    lines[line.record.name] = line;
  }
  return lines;
}

void tell_difference(const Record &stored, const Record &now)
{
  std::printf("%s: %s -> %s\n", now.name.c_str(), hash_text(stored.hash).c_str(),
              hash_text(now.hash).c_str());
  bool seen = false;
  for (const auto &[name, value] : now.numbers)
    for (const auto &[old_name, old_value] : stored.numbers) {
      // Texts are compared, since nan is not equal to itself.
      if (name != old_name || exact(value) == exact(old_value)) continue;
      const double size = std::max(std::fabs(value), std::fabs(old_value));
      std::printf("    %s: %.17g -> %.17g (%s -> %s), relative change %.2g\n", name.c_str(),
                  old_value, value, exact(old_value).c_str(), exact(value).c_str(),
                  std::fabs(value - old_value) / size);
      seen = true;
    }
  if (!seen) std::printf("    the numbers beside the hash are the same: the change is in others\n");
}

struct Arguments {
  golden::Device device = golden::Device::Cpu;
  std::string file = GOLDEN_BITS_FILE;
  std::string part;    ///< runs are selected if their names contain this text
  bool renew = false;
  std::string reason;
};

Arguments arguments_from(int argc, char **argv)
{
  Arguments arguments;
  for (int k = 1; k < argc; ++k) {
    const std::string word = argv[k];
    const auto value = [&]() -> std::string {
      if (++k >= argc) throw rve::InputError(word + " wants a value");
      return argv[k];
    };
    if (word == "--device") {
      const std::string device = value();
      rve::require(device == "cpu" || device == "cuda",
                   "--device is '" + device + "'; it must be cpu or cuda");
      arguments.device = device == "cuda" ? golden::Device::Cuda : golden::Device::Cpu;
    } else if (word == "--file") {
      arguments.file = value();
    } else if (word == "--only") {
      arguments.part = value();
    } else if (word == "--renew") {
      arguments.renew = true;
      arguments.reason = value();
      rve::require(!arguments.reason.empty() && arguments.reason.find('\n') == std::string::npos,
                   "--renew wants a reason of one line: why the bits are others");
    } else {
      throw rve::InputError(
          "'" + word +
          "' is no option; there are --device cpu|cuda, --file FILE, --only PART and "
          "--renew \"reason\"");
    }
  }
  rve::require(!arguments.renew ||
                   (arguments.device == golden::Device::Cpu && arguments.part.empty()),
               "golden bits are renewed on the CPU and all together: use --renew without --device "
               "cuda and without --only");
  return arguments;
}

/// Prints the differences and returns true if there are none. With `has_all`, a stored run that is
/// missing in `now` is a difference.
bool compare(const std::map<std::string, Line> &stored, const std::vector<Record> &now,
             bool has_all)
{
  int different = 0, missing = 0;
  for (const Record &record : now) {
    const auto found = stored.find(record.name);
    if (found == stored.end()) {
      std::printf("%s: not in the file\n", record.name.c_str());
      ++missing;
    } else if (found->second.record.hash != record.hash) {
      tell_difference(found->second.record, record);
      ++different;
    }
  }
  if (has_all)
    for (const auto &[name, line] : stored)
      if (std::none_of(now.begin(), now.end(),
                       [&name = name](const Record &record) { return record.name == name; })) {
        std::printf("%s: in the file, but no longer computed\n", name.c_str());
        ++missing;
      }
  std::printf("golden_bits: %zu compared, %d different, %d on one side only\n", now.size(),
              different, missing);
  if (different + missing > 0)
    std::printf("golden_bits: if that is meant, say so: golden_bits --renew \"reason\"\n");
  return different + missing == 0;
}

void renew(const Arguments &arguments, std::map<std::string, Line> &stored,
           const std::vector<Record> &now)
{
  std::ofstream file(arguments.file);
  file << HEAD;
  for (const Record &record : now) {
    const auto found = stored.find(record.name);
    const bool same = found != stored.end() && found->second.record.hash == record.hash;
    file << text_of({record, same ? found->second.reason : arguments.reason}) << "\n";
  }
  file.close();
  rve::require(static_cast<bool>(file), "cannot write " + arguments.file);
  std::printf("golden_bits: %zu lines in %s\n", now.size(), arguments.file.c_str());
}

int run(const Arguments &arguments)
{
  if (arguments.device == golden::Device::Cuda) {
    std::string obstacle;
    rve::Options options;
    options.device = rve::Device::Auto;
    rve::make_engine(options,
                     &obstacle);    // throws if GPU_RVE_REQUIRE_CUDA is set and no device works
    if (!obstacle.empty()) {
      std::printf("golden_bits: skipped: %s\n", obstacle.c_str());
      return SKIPPED;
    }
  }
  std::map<std::string, Line> stored = read(arguments.file);
  std::vector<Record> now = golden::device_records(arguments.device, arguments.part);
  rve::require(!now.empty() || arguments.part.empty(),
               "no run has '" + arguments.part + "' in its name; names are in " + arguments.file);
  const bool on_host = arguments.device == golden::Device::Cpu && arguments.part.empty();
  if (on_host) {
    const std::vector<Record> more = golden::host_records();
    now.insert(now.end(), more.begin(), more.end());
  }
  const bool same = compare(stored, now, on_host);
  if (!arguments.renew) return same ? EXIT_SUCCESS : EXIT_FAILURE;
  renew(arguments, stored, now);
  return EXIT_SUCCESS;
}

}    // namespace

int main(int argc, char **argv)
{
  try {
    return run(arguments_from(argc, argv));
  } catch (const std::exception &error) {
    std::fprintf(stderr, "golden_bits: %s\n", error.what());
    return EXIT_FAILURE;
  }
}
