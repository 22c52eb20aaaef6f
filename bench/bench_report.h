// The file that a benchmark writes: machine, date, commit, command, and rows of {case, metric, value, unit}.

#ifndef BENCH_REPORT_H
#define BENCH_REPORT_H

#include <nlohmann/json.hpp>

#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <utility>

namespace bench {

class Report {
 public:
  Report(int argc, char **argv, std::string path_in) : path(std::move(path_in))
  {
    std::string command = std::filesystem::path(argv[0]).filename().string();
    for (int a = 1; a < argc; ++a) command += " " + without_folder_of_this_machine(argv[a]);
    const char *commit = std::getenv("GPU_RVE_COMMIT");
    report["date"] = today();
    report["commit"] = commit ? commit : "";
    report["command"] = command;
    report["rows"] = nlohmann::json::array();
  }

  void set_machine(const std::string &machine) { report["machine"] = machine; }

  /// `details` is what else was seen; a table of the manual can show it as a column.
  void add(const nlohmann::json &keys, const std::string &metric, double value,
           const std::string &unit, const nlohmann::json &details = nullptr)
  {
    nlohmann::json row = {{"case", keys}, {"metric", metric}, {"value", value}, {"unit", unit}};
    if (!details.is_null()) row["details"] = details;
    report["rows"].push_back(row);
  }

  /// Called after each experiment, so that what is measured is kept whatever happens to the rest.
  void write() const
  {
    std::ofstream file(path);
    file << report.dump(1) << "\n";
    file.close();
    if (!file) throw std::runtime_error("cannot write " + path);
  }

 private:
  static std::string today()
  {
    const std::time_t now = std::time(nullptr);
    char text[16];
    std::strftime(text, sizeof(text), "%Y-%m-%d", std::gmtime(&now));
    return text;
  }

  static std::string without_folder_of_this_machine(const std::string &word)
  {
    const std::filesystem::path path(word);
    return path.is_absolute() ? path.filename().string() : word;
  }

  const std::string path;
  nlohmann::json report;
};

}    // namespace bench

#endif
