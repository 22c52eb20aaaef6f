// SPDX-License-Identifier: GPL-2.0-only
// LAMMPS scripts with changed words. Each script runs in its own process and must end normally or
// with an ERROR of LAMMPS; running out of memory is also accepted. A signal, another exception, a
// report of a sanitizer, or a run beyond the time limit is a failure.
//
//   fuzz_scripts [--seed N] [--count N] [--seconds S] [--jobs N] [--limit S] [--keep FOLDER]
//                folder or file ...
//
// Only lines with commands or styles of this package are changed. Scripts that fail are kept with
// their output in FOLDER (default: fuzz_scripts.failed). fuzz_scripts --count 0 FILE runs such a
// script without changes. --limit is the time limit of one script [s of wall time].

#include "exceptions.h"
#include "input.h"
#include "lammps.h"
#include "mutator.h"
#include "rve/engine/packing_io.h"
#include "support/packings.h"
#include "support/spheres.h"

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <mpi.h>
#include <new>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace {

namespace fs = std::filesystem;
using fuzz::Mutator;

// exit statuses of a child
constexpr int IN_ORDER = 0, LAMMPS_ERROR = 10, OUT_OF_MEMORY = 11, OTHER_EXCEPTION = 12;

struct Arguments {
  std::uint64_t seed = 1;
  long count = 300;
  double seconds = 1e9;
  int jobs = 2;
  unsigned limit = 60;
  std::string keep = "fuzz_scripts.failed";
  std::vector<std::string> inputs;
};

std::string content_of(const fs::path &path)
{
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// ---- one script ---------------------------------------------------------------------------------

/// Writes the packing files that the corpus refers to.
void write_packings(const fs::path &folder)
{
  rve::Material material;
  material.normal_stiffness = 1e6;
  material.tangential_stiffness = 8e5;
  material.friction = 0.5;
  material.density = 2650.0;
  material.local_damping = 0.3;
  material.thickness = 0.075;
  rve::PackingLibrary library;
  for (const std::uint64_t seed : {1, 2, 3}) {
    const rve::RveState packing = rve_test::triangular_packing(material, 4, 4, 0.0037, seed);
    if (seed == 1) rve::write_packing((folder / "packing.rve").string(), packing);
    rve::LibraryRow row{};
    row.num_grains = packing.num_grains();
    row.void_ratio = packing.void_ratio();
    row.overconsolidation_ratio = 1.0;
    row.pressure = 1e5;
    library.add(row, packing);
  }
  rve::write_library((folder / "library.rve").string(), library);

  material.thickness = 1.0;
  rve::PackingLibraryOf<3> library_of_spheres;
  for (const unsigned seed : {1, 2}) {
    rve_test::Spheres spheres = rve_test::disordered_spheres(material, 4, seed);
    std::fill(spheres.velocity.begin(), spheres.velocity.end(), 0.0);
    std::fill(spheres.spin.begin(), spheres.spin.end(), 0.0);
    if (seed == 1) rve::write_packing((folder / "spheres.rve").string(), spheres);
    rve::LibraryRow row{};
    row.num_grains = spheres.num_grains();
    row.void_ratio = spheres.void_ratio();
    row.overconsolidation_ratio = 1.0;
    row.pressure = 1e5;
    library_of_spheres.add(row, spheres);
  }
  rve::write_library((folder / "sphere_library.rve").string(), library_of_spheres);
}

[[noreturn]] void run_child(const fs::path &folder, unsigned limit)
{
  fs::current_path(folder);
  if (!std::freopen("printed", "w", stdout) || dup2(fileno(stdout), fileno(stderr)) < 0) _exit(1);
  alarm(limit);
  const rlimit file_size{100u << 20, 100u << 20};
  setrlimit(RLIMIT_FSIZE, &file_size);
#if !defined(__SANITIZE_ADDRESS__)
  const rlimit memory{4ull << 30,
                      4ull << 30};    // excessive allocations must not exhaust the machine
  setrlimit(RLIMIT_AS, &memory);
#endif
  int status = IN_ORDER;
  MPI_Init(nullptr, nullptr);
  try {
    std::vector<std::string> words = {"lmp",  "-in",     "in.script", "-log",
                                      "none", "-screen", "none",      "-nocite"};
    std::vector<char *> argv;
    for (std::string &word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    auto *lammps =
        new LAMMPS_NS::LAMMPS(static_cast<int>(words.size()), argv.data(), MPI_COMM_WORLD);
    lammps->input->file();
    delete lammps;
  } catch (const LAMMPS_NS::LAMMPSException &error) {
    std::printf("%s\n", error.what());
    status = LAMMPS_ERROR;
  } catch (const std::bad_alloc &) {
    status = OUT_OF_MEMORY;
  } catch (const std::exception &error) {
    std::printf("Exception: %s\n", error.what());
    status = OTHER_EXCEPTION;
  }
  std::fflush(stdout);
  _exit(status);    // MPI_Finalize would take as long as the run
}

/// Returns the failure that a status of waitpid means, or an empty string if the script ended
/// normally or with a LAMMPS error.
std::string failure_of(int status, const fs::path &printed)
{
  if (WIFSIGNALED(status)) {
    if (WTERMSIG(status) == SIGALRM) return "runs beyond the limit of time";
    return "ended by signal " + std::to_string(WTERMSIG(status)) + " (" +
        strsignal(WTERMSIG(status)) + ")";
  }
  const int code = WEXITSTATUS(status);
  if (code == OTHER_EXCEPTION) return "an exception that is no error of LAMMPS";
  if (code != IN_ORDER && code != LAMMPS_ERROR && code != OUT_OF_MEMORY)
    return "exit status " + std::to_string(code);
  if (content_of(printed).find("runtime error:") != std::string::npos)
    return "a sanitizer's report";
  return "";
}

// ---- changed scripts ----------------------------------------------------------------------------

bool is_ours(const std::string &line)
{
  std::istringstream words(line);
  std::string command, id, group, style;
  words >> command >> id >> group >> style;
  if (command == "fix") return style == "rve" || style == "mpm";
  if (command == "compute") return style == "rve/atom";
  return command == "create_rve" || command == "write_rve" || command == "random_field";
}

/// Words in the lines of each command of the corpus. Changed lines take words from them.
using Vocabulary = std::map<std::string, std::vector<std::string>>;

std::string command_of(const std::string &line)
{
  std::istringstream words(line);
  std::string command, id, group, style;
  words >> command >> id >> group >> style;
  return command == "fix" ? style : command;
}

void learn(const std::string &script, Vocabulary &vocabulary)
{
  for (const std::string &line : Mutator::split(script, '\n'))
    if (is_ours(line))
      for (const std::string &word : Mutator::split(line, ' '))
        if (!word.empty()) vocabulary[command_of(line)].push_back(word);
}

std::string changed(const std::string &script, const Vocabulary &vocabulary, Mutator &mutator)
{
  std::vector<std::string> lines = Mutator::split(script, '\n');
  std::vector<std::size_t> ours;
  for (std::size_t k = 0; k < lines.size(); ++k)
    if (is_ours(lines[k])) ours.push_back(k);
  if (ours.empty()) return script;
  for (int n = mutator.once_in(3) ? mutator.integer(2, 5) : 1; n > 0; --n) {
    std::string &line = lines[mutator.one_of(ours)];
    const auto words = vocabulary.find(command_of(line));
    line = words == vocabulary.end() ? mutator.words(line) : mutator.words(line, words->second);
  }
  return Mutator::joined(lines, "\n") + "\n";
}

// ---- many scripts -------------------------------------------------------------------------------

class Team {
 public:
  Team(const Arguments &arguments, fs::path root) : arguments_(arguments), root_(std::move(root))
  {
    fs::create_directories(root_ / "packings");
    write_packings(root_ / "packings");
    for (int k = 0; k < arguments.jobs; ++k) free_.push_back(k);
  }
  ~Team() { fs::remove_all(root_); }

  void start(const std::string &script)
  {
    if (free_.empty()) wait_for_one();
    const int place = free_.back();
    free_.pop_back();
    const fs::path folder = root_ / std::to_string(place);
    fs::remove_all(folder);
    fs::create_directories(folder);
    for (const auto &file : fs::directory_iterator(root_ / "packings"))
      fs::copy(file.path(), folder / file.path().filename());
    std::ofstream(folder / "in.script") << script;
    std::fflush(nullptr);
    const pid_t child = fork();
    if (child < 0) throw std::runtime_error("cannot start a process");
    if (child == 0) run_child(folder, arguments_.limit);
    running_[child] = place;
  }

  void finish()
  {
    while (!running_.empty()) wait_for_one();
  }

  int failures() const { return failures_; }
  void report() const
  {
    std::printf("%d scripts: %d ran to their end, %d ended by an ERROR, %d wanted too much memory, "
                "%d failures\n",
                in_order_ + errors_ + memory_ + failures_, in_order_, errors_, memory_, failures_);
  }

 private:
  const Arguments &arguments_;
  fs::path root_;
  std::vector<int> free_;
  std::map<pid_t, int> running_;    // processes and the number of the folder of each
  int in_order_ = 0, errors_ = 0, memory_ = 0, failures_ = 0;

  void wait_for_one()
  {
    int status = 0;
    const pid_t child = wait(&status);
    const auto found = running_.find(child);
    if (found == running_.end()) throw std::runtime_error("lost a process");
    const fs::path folder = root_ / std::to_string(found->second);
    free_.push_back(found->second);
    running_.erase(found);
    const std::string failure = failure_of(status, folder / "printed");
    if (!failure.empty()) {
      keep(failure, folder);
    } else {
      // With --count 0, the output of a script that ends with an error is printed. A script of the
      // corpus should have no error, because changed copies would stop at the same error.
      if (arguments_.count == 0 && WEXITSTATUS(status) == LAMMPS_ERROR)
        std::printf("%s\n%s", content_of(folder / "in.script").c_str(),
                    content_of(folder / "printed").c_str());
      ++(WEXITSTATUS(status) == IN_ORDER           ? in_order_
             : WEXITSTATUS(status) == LAMMPS_ERROR ? errors_
                                                   : memory_);
    }
  }

  void keep(const std::string &failure, const fs::path &folder)
  {
    ++failures_;
    fs::create_directories(arguments_.keep);
    const fs::path script = fs::path(arguments_.keep) / ("in." + std::to_string(failures_));
    const auto replace = fs::copy_options::overwrite_existing;
    fs::copy_file(folder / "in.script", script, replace);
    fs::copy_file(folder / "printed", script.string() + ".printed", replace);
    std::printf("FAILED: %s: %s\n", script.c_str(), failure.c_str());
    for (const std::string &line : Mutator::split(content_of(script), '\n'))
      if (is_ours(line)) std::printf("    %s\n", line.c_str());
    std::fflush(stdout);
  }
};

Arguments arguments_from(int argc, char **argv)
{
  Arguments arguments;
  for (int k = 1; k < argc; ++k) {
    const std::string word = argv[k];
    if (word.rfind("--", 0) != 0) {
      arguments.inputs.push_back(word);
      continue;
    }
    if (++k >= argc) throw std::runtime_error(word + " wants a value");
    if (word == "--seed")
      arguments.seed = std::stoull(argv[k]);
    else if (word == "--count")
      arguments.count = std::stol(argv[k]);
    else if (word == "--seconds")
      arguments.seconds = std::stod(argv[k]);
    else if (word == "--jobs")
      arguments.jobs = std::max(1, std::stoi(argv[k]));
    else if (word == "--limit")
      arguments.limit = static_cast<unsigned>(std::stoul(argv[k]));
    else if (word == "--keep")
      arguments.keep = argv[k];
    else
      throw std::runtime_error(word + " is no option");
  }
  return arguments;
}

int run(const Arguments &arguments)
{
  std::vector<fs::path> files;
  for (const std::string &input : arguments.inputs)
    if (fs::is_directory(input))
      for (const auto &entry : fs::directory_iterator(input)) files.push_back(entry.path());
    else
      files.emplace_back(input);
  std::sort(files.begin(), files.end());    // directory_iterator has no fixed order
  std::vector<std::string> scripts;
  Vocabulary vocabulary;
  for (const fs::path &file : files) {
    scripts.push_back(content_of(file));
    learn(scripts.back(), vocabulary);
  }
  if (scripts.empty()) throw std::runtime_error("no scripts are given");

  setenv("OMP_NUM_THREADS", "1", 0);
  Team team(arguments,
            fs::temp_directory_path() /
                ("fuzz_scripts_" + std::to_string(static_cast<long>(getpid()))));
  Mutator mutator(arguments.seed);
  const auto start = std::chrono::steady_clock::now();
  for (const std::string &script : scripts) team.start(script);
  for (long k = 0; k < arguments.count; ++k) {
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    if (elapsed.count() > arguments.seconds) break;
    team.start(changed(mutator.one_of(scripts), vocabulary, mutator));
  }
  team.finish();
  team.report();
  return team.failures() == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}

}    // namespace

int main(int argc, char **argv)
{
  try {
    return run(arguments_from(argc, argv));
  } catch (const std::exception &error) {
    std::fprintf(stderr, "fuzz_scripts: %s\n", error.what());
    return EXIT_FAILURE;
  }
}
