// SPDX-License-Identifier: GPL-2.0-only
// Report of a benchmark as a JSON file: machine, date, commit, command, and rows of {case, metric,
// value, unit, details}. The file has the compact form that tools/bench_records.py explains.

#pragma once

#include <nlohmann/json.hpp>

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace bench {

/// Returns the name of the processor; "CPU" if /proc/cpuinfo does not have it.
inline std::string processor_name()
{
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  return "CPU";
}

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
  }

  void set_machine(const std::string &machine) { report["machine"] = machine; }
  void set_command(const std::string &command) { report["command"] = command; }

  /// `details` has further results of the row; a table of the manual can show them as columns.
  void add(const nlohmann::json &keys, const std::string &metric, double value,
           const std::string &unit, const nlohmann::json &details = nullptr)
  {
    rows.push_back({rounded(keys), rounded(details.is_null() ? nlohmann::json::object() : details),
                    metric, unit, rounded(value)});
  }

  /// Adds the rows of the file that write() replaces. A file that does not exist has none.
  void add_rows_of_file()
  {
    std::ifstream file(path);
    if (!file) return;
    const nlohmann::json record = nlohmann::json::parse(file);
    for (const nlohmann::json &line : record.at("rows")) {
      nlohmann::json parts[2];
      for (int k = 0; k < 2; ++k) {
        parts[k] = nlohmann::json::object();
        for (const nlohmann::json &some : {record.value("defaults", parts[k]), line})
          if (some.contains(PARTS[k])) parts[k].merge_patch(some[PARTS[k]]);    // null erases
      }
      for (const auto &[metric, value] : line.at("values").items())
        rows.push_back({parts[0], parts[1], metric, record.at("units").at(metric), value});
    }
  }

  /// Writes all rows. It is called after each experiment, so that a later failure loses no rows.
  void write() const
  {
    nlohmann::json head = report;
    head["defaults"] = head["units"] = nlohmann::json::object();
    for (int k = 0; k < 2; ++k) {
      std::map<std::pair<std::string, std::string>, std::size_t> count;
      for (const Row &row : rows)
        for (const auto &[key, value] : row.part(k).items()) ++count[{key, value.dump()}];
      for (const auto &[item, times] : count)
        if (rows.size() > 1 && 2 * times > rows.size())
          head["defaults"][PARTS[k]][item.first] = nlohmann::json::parse(item.second);
    }
    std::vector<nlohmann::json> lines;
    nlohmann::json last;
    for (const Row &row : rows) {
      head["units"][row.metric] = row.unit;
      nlohmann::json own = nlohmann::json::object();
      for (int k = 0; k < 2; ++k) {
        const nlohmann::json some =
            differences(row.part(k), head["defaults"].value(PARTS[k], nlohmann::json::object()));
        if (!some.empty()) own[PARTS[k]] = some;
      }
      if (lines.empty() || own != last || lines.back()["values"].contains(row.metric)) {
        lines.push_back(own);
        last = own;
      }
      lines.back()["values"][row.metric] = row.value;
    }
    std::ofstream file(path);
    file << "{\n";
    for (const auto &[key, value] : head.items()) file << '"' << key << "\": " << value << ",\n";
    file << "\"rows\": [";
    for (std::size_t k = 0; k < lines.size(); ++k) file << (k ? ",\n" : "\n") << lines[k];
    file << "\n]}\n";
    file.close();
    if (!file) throw std::runtime_error("cannot write " + path);
  }

 private:
  static constexpr const char *PARTS[] = {"case", "details"};

  struct Row {
    nlohmann::json keys, details;
    std::string metric, unit;
    nlohmann::json value;

    const nlohmann::json &part(int k) const { return k == 0 ? keys : details; }
  };

  static std::string with_digits(double value, int digits)
  {
    char text[32];
    std::snprintf(text, sizeof(text), "%.*g", digits, value);
    return text;
  }

  /// Returns the value with floating-point numbers rounded to six significant digits. The manual
  /// shows four digits. A number keeps more than six digits if rounding to six would change the
  /// four digits of the manual.
  static nlohmann::json rounded(nlohmann::json value)
  {
    if (value.is_number_float()) {
      const double whole = value.get<double>();
      for (int digits = 6; digits < 18; ++digits) {
        const double shorter = std::strtod(with_digits(whole, digits).c_str(), nullptr);
        if (with_digits(shorter, 4) == with_digits(whole, 4)) return shorter;
      }
    }
    if (value.is_structured())
      for (nlohmann::json &some : value) some = rounded(some);
    return value;
  }

  /// Returns the items that differ from the defaults, and null for a default without an item.
  static nlohmann::json differences(const nlohmann::json &part, const nlohmann::json &defaults)
  {
    nlohmann::json own = nlohmann::json::object();
    for (const auto &[key, value] : part.items())
      if (!defaults.contains(key) || defaults[key].dump() != value.dump()) own[key] = value;
    for (const auto &[key, value] : defaults.items())
      if (!part.contains(key)) own[key] = nullptr;
    return own;
  }

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
  std::vector<Row> rows;
};

}    // namespace bench
