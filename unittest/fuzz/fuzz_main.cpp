// SPDX-License-Identifier: GPL-2.0-only
// Runs a target without libFuzzer. The first inputs are the files of the folders and the seeds of
// the target. Then follow randomly changed copies of these inputs.
//
//   fuzz_x [--seed N] [--count N] [--seconds S] [--keep FILE] [folder or file ...]
//
// The current input is in FILE (default: fuzz_x.input in the current folder). After a failure, FILE
// remains, and fuzz_x --count 0 FILE repeats its input. An input that takes more than a minute is
// also a failure.

#include "fuzz_target.h"

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <unistd.h>

namespace {

constexpr unsigned LIMIT = 60;    // time limit of one input [s]

std::string content_of(const std::filesystem::path &path)
{
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

void add_inputs(const std::filesystem::path &path, std::vector<std::string> &inputs)
{
  if (!std::filesystem::is_directory(path)) {
    inputs.push_back(content_of(path));
    return;
  }
  std::vector<std::filesystem::path> files;
  for (const auto &entry : std::filesystem::directory_iterator(path)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());    // directory_iterator has no fixed order
  for (const auto &file : files) inputs.push_back(content_of(file));
}

void treat(const std::string &input, const std::string &keep)
{
  std::ofstream(keep, std::ios::binary) << input;
  alarm(LIMIT);
  LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t *>(input.data()), input.size());
  alarm(0);
}

}    // namespace

void fuzz::fail(const std::string &reason)
{
  std::fprintf(stderr, "fuzzing: %s\n", reason.c_str());
  std::abort();
}

int main(int argc, char **argv)
{
  std::uint64_t seed = 1;
  long count = 1000;
  double seconds = 1e9;
  std::string keep = std::filesystem::path(argv[0]).filename().string() + ".input";
  std::vector<std::string> inputs = fuzz::seeds();
  try {
    for (int k = 1; k < argc; ++k) {
      const std::string word = argv[k];
      const bool is_option = word == "--seed" || word == "--count" || word == "--seconds" ||
          word == "--keep";
      if (!is_option) {
        add_inputs(word, inputs);
        continue;
      }
      if (++k >= argc) throw std::runtime_error(word + " wants a value");
      if (word == "--seed") seed = std::stoull(argv[k]);
      if (word == "--count") count = std::stol(argv[k]);
      if (word == "--seconds") seconds = std::stod(argv[k]);
      if (word == "--keep") keep = argv[k];
    }
    std::printf("the input under way is in %s\n", keep.c_str());
    std::fflush(stdout);
    for (const std::string &input : inputs) treat(input, keep);
    fuzz::Mutator mutator(seed);
    const auto start = std::chrono::steady_clock::now();
    long done = 0;
    for (; done < count; ++done) {
      const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
      if (elapsed.count() > seconds) break;
      treat(fuzz::changed(mutator.one_of(inputs), mutator), keep);
    }
    std::printf("%zu inputs and %ld changed ones (seed %llu): no failure\n", inputs.size(), done,
                static_cast<unsigned long long>(seed));
    std::filesystem::remove(keep);
  } catch (const std::exception &error) {
    std::fprintf(stderr, "uncaught exception: %s\n", error.what());
    std::abort();
  }
}
