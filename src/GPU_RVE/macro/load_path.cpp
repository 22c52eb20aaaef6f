// SPDX-License-Identifier: GPL-2.0-only
#include "macro/load_path.h"

#include "rve/core/error.h"
#include "rve/core/pi.h"
#include "rve/core/suggestion.h"
#include "rve/engine/files.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <map>
#include <sstream>

namespace macro {

namespace {

  /// The same in every locale.
  bool read_number(const std::string &word, double &value)
  {
    const char *begin = word.data(), *last = begin + word.size();
    if (begin != last && *begin == '+') ++begin;
    const auto [end, error] = std::from_chars(begin, last, value);
    return error == std::errc() && end == last && std::isfinite(value);
  }

  bool is_number(const std::string &word)
  {
    double value;
    return read_number(word, value);
  }

  /// Fields of a row of a table: what stands between commas, if there are any, or else words.
  std::vector<std::string> fields_of(const std::string &row)
  {
    std::vector<std::string> fields;
    const bool has_commas = row.find(',') != std::string::npos;
    std::istringstream parts(row);
    std::string field;
    if (!has_commas) {
      while (parts >> field) fields.push_back(field);
      return fields;
    }
    constexpr const char *BLANK = " \t\v\f";
    std::size_t begin = 0, end;
    do {
      end = std::min(row.find(',', begin), row.size());
      field = row.substr(begin, end - begin);
      const std::size_t first = field.find_first_not_of(BLANK);
      rve::require(first != std::string::npos, "a field before or after a comma is empty");
      fields.push_back(field.substr(first, field.find_last_not_of(BLANK) - first + 1));
      begin = end + 1;
    } while (end < row.size());
    return fields;
  }

  /// Whether the first field of a table is meant as a number, although it may be none: "0s", "1d-3", "\"0\"", "nan".
  bool begins_like_a_number(const std::string &word)
  {
    std::string lower;
    for (const char letter : word)
      lower += static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
    for (const char *sign : {"\"", "'", "+", "-", "\xE2\x88\x92", "\xE2\x80\x93"})    // dashes
      if (lower.rfind(sign, 0) == 0) lower.erase(0, std::string(sign).size());
    return lower == "nan" || lower == "inf" || lower == "infinity" ||
        (!lower.empty() && (lower[0] == '.' || std::isdigit(static_cast<unsigned char>(lower[0]))));
  }

  /// What a limit in time may lack by rounding of sums of steps [-].
  constexpr double ROUNDING_OF_TIME = 1e-9;

  constexpr const char *CLAUSES[] = {"path",   "stage",   "rate",  "strain", "stress",
                                     "circle", "reverse", "until", "repeat"};

  rve::Words clauses()
  {
    return rve::Words(std::begin(CLAUSES), std::end(CLAUSES));
  }

  bool is_clause(const std::string &word)
  {
    const rve::Words known = clauses();
    return std::find(known.begin(), known.end(), word) != known.end();
  }

  /// Of the strains that a path counts: F is upper triangular, and so is its logarithm's rate L.
  template <int D> double strain_component(const rve::Tensor<double, D> &f, int c)
  {
    const int a = rve::strain_row<D>(c), b = rve::strain_column<D>(c);
    return a == b ? std::log(f(a, a)) : f(a, b) / f(b, b);
  }

  template <int D>
  double strain_sum(const rve::ComponentSum<D> &sum, const rve::Tensor<double, D> &f)
  {
    double strain = 0.0;
    for (int c = 0; c < rve::Space<D>::strains; ++c)
      if (sum[c] != 0.0) strain += sum[c] * strain_component<D>(f, c);
    return strain;
  }

}    // namespace

std::vector<PathWord> path_words(const std::string &text, const std::string &file)
{
  std::vector<PathWord> words;
  std::istringstream lines(rve::plain_text(text, file));
  std::string line, word;
  for (int number = 1; std::getline(lines, line); ++number) {
    std::istringstream rest(line.substr(0, line.find('#')));
    while (rest >> word) words.push_back({word, file + ":" + std::to_string(number)});
  }
  return words;
}

// ---- tables and values ----------------------------------------------------------------------------------------------------------

PathTable::PathTable(const std::string &text, const std::string &name) : file(name)
{
  std::istringstream lines(rve::plain_text(text, file));
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    try {
      const std::vector<std::string> row = fields_of(line.substr(0, line.find('#')));
      if (row.empty()) continue;
      rve::require(row.size() >= 2, "a row of a table has a time and at least one value");
      if (columns.empty() && names.empty() && !begins_like_a_number(row.front()))
        read_names(row);
      else
        read_numbers(row);
    } catch (const rve::InputError &e) {
      throw rve::InputError(file + ":" + std::to_string(number) + ": " + e.what());
    }
  }
  rve::require(!columns.empty(), file + " has no rows of numbers");
}

void PathTable::read_names(const std::vector<std::string> &row)
{
  for (std::size_t c = 0; c < row.size(); ++c) {
    rve::require(!is_number(row[c]),
                 "'" + row[c] +
                     "' is a number among names; a first row has names only, or numbers");
    rve::require(std::find(row.begin(), row.begin() + c, row[c]) == row.begin() + c,
                 "two columns have the name '" + row[c] + "'");
  }
  names = row;
}

void PathTable::read_numbers(const std::vector<std::string> &row)
{
  if (columns.empty()) {
    rve::require(names.empty() || row.size() == names.size(), [&] {
      return "the row has " + std::to_string(row.size()) + " numbers, and there are " +
          std::to_string(names.size()) +
          " names of columns; names with blanks or units need commas between them";
    });
    columns.resize(row.size());
  }
  rve::require(row.size() == columns.size(), [&] {
    return "the row has " + std::to_string(row.size()) + " numbers, others have " +
        std::to_string(columns.size());
  });
  for (std::size_t c = 0; c < row.size(); ++c) {
    double value;
    rve::require(read_number(row[c], value), [&] {
      return "'" + row[c] + "' is not a finite number" +
          (row[c].find(' ') == std::string::npos
               ? ""
               : "; a row has commas between its numbers, or blanks, and decimals have a point");
    });
    rve::require(c > 0 || columns[0].empty() || value > columns[0].back(),
                 "the time " + row[c] + " is not after that of the row before");
    columns[c].push_back(value);
  }
}

int PathTable::column(const std::string &word) const
{
  const auto named = std::find(names.begin(), names.end(), word);
  if (named != names.end() && named != names.begin())
    return static_cast<int>(named - names.begin());
  double value;
  const double most = static_cast<double>(columns.size());
  rve::require(
      read_number(word, value) && value >= 2.0 && value <= most && value == std::floor(value), [&] {
        std::string known;
        for (std::size_t c = 1; c < names.size(); ++c) known += " " + names[c];
        return "table " + file + " has no column '" + word + "'; it must be a number from 2 to " +
            rve::number(most) + (known.empty() ? "" : ", or one of" + known);
      });
  return static_cast<int>(value) - 1;
}

std::pair<double, double> PathTable::range(int column) const
{
  const auto [least, most] = std::minmax_element(columns[column].begin(), columns[column].end());
  return {*least, *most};
}

double PathTable::at(int column, double time) const
{
  const std::vector<double> &times = columns[0], &values = columns[column];
  const auto above = std::upper_bound(times.begin(), times.end(), time) - times.begin();
  if (above == 0) return values.front();
  if (above == static_cast<std::ptrdiff_t>(times.size())) return values.back();
  const double share = (time - times[above - 1]) / (times[above] - times[above - 1]);
  return values[above - 1] + share * (values[above] - values[above - 1]);
}

std::pair<double, double> PathValue::range() const
{
  switch (kind) {
    case Kind::Script:
      return {0.0, 0.0};
    case Kind::Ramp:
      return std::minmax(number[0], number[1]);
    case Kind::Wave:
      return {number[0] - std::fabs(number[1]), number[0] + std::fabs(number[1])};
    case Kind::Table:
      return table->range(index);
    default:
      return {number[0], number[0]};
  }
}

double PathValue::at(double time, const double *script) const
{
  switch (kind) {
    case Kind::Script:
      return script[index];
    case Kind::Ramp:
      return time < number[2] ? number[0] + (time / number[2]) * (number[1] - number[0])
                              : number[1];
    case Kind::Wave:
      return number[0] + number[1] * std::sin(2.0 * rve::kPi * (time / number[2]) + number[3]);
    case Kind::Table:
      return table->at(index, time);
    default:
      return number[0];
  }
}

// ---- reading --------------------------------------------------------------------------------------------------------------------

template <int D> class LoadPathsOf<D>::Reader {
 public:
  Reader(LoadPathsOf &of, const std::vector<PathWord> &all, const ReadPathFile &read) :
      target(of), words(all), read_file(read)
  {
  }

  /// Returns how many words belong to paths; all must, unless they are `open`.
  std::size_t read(bool open)
  {
    while (position < words.size() && !(open && ends_here())) {
      const std::string clause = next("a clause");
      if (clause == "path") {
        const std::string name = next("the name of a path");
        for (const Path &other : target.paths)
          if (other.name == name) refuse("there are two paths " + name);
        close_stage();
        target.paths.push_back({name, {}});
      } else if (clause == "stage") {
        close_stage();
        if (target.paths.empty()) target.paths.push_back({"", {}});
        target.paths.back().stages.emplace_back();
        stage().where = here();
      } else if (!is_clause(clause)) {
        refuse("unknown word '" + clause + "'" +
               rve::did_you_mean(clause, clauses(), "it must be one of"));
      } else {
        if (target.paths.empty() || target.paths.back().stages.empty())
          refuse("'" + clause + "' belongs to a stage; a path begins with the word stage");
        read_clause(clause);
      }
    }
    close_stage();
    if (target.paths.empty())
      throw rve::InputError("a path has at least one stage, and there is none");
    for (const Path &path : target.paths)
      if (path.stages.empty()) throw rve::InputError("path " + path.name + " has no stage");
    return position;
  }

 private:
  LoadPathsOf &target;
  const std::vector<PathWord> &words;
  const ReadPathFile &read_file;
  std::size_t position = 0;
  std::map<std::string, std::shared_ptr<const PathTable>> tables;

  // ---- words ----

  std::string here() const
  {
    return words.empty() ? "" : words[position > 0 ? position - 1 : 0].where;
  }
  [[noreturn]] void refuse(const std::string &message) const
  {
    throw rve::InputError(here() + ": " + message);
  }
  std::string peek(std::size_t ahead = 0) const
  {
    return position + ahead < words.size() ? words[position + ahead].text : "";
  }
  std::string next(const std::string &what)
  {
    if (position >= words.size()) refuse("the path ends where " + what + " was expected");
    return words[position++].text;
  }
  /// In a script the keyword stress of the fix may follow.
  bool ends_here() const
  {
    if (!is_clause(peek()) || peek() == "path") return true;
    const std::string after = peek(1);
    return peek() == "stress" && (after == "end" || after == "average" || after == "regression");
  }
  double number(const std::string &what)
  {
    const std::string word = next(what);
    double value;
    if (!read_number(word, value)) refuse(what + " is '" + word + "'; it must be a finite number");
    return value;
  }
  double positive(const std::string &what, const char *unit)
  {
    const double value = number(what);
    if (!(value > 0.0))
      refuse(what + " is " + rve::number(value) + " " + unit + "; it must be above 0");
    return value;
  }
  int whole(const std::string &what, int least, int most)
  {
    const std::string word = peek();
    const double value = number(what);
    if (!(value >= least && value <= most) || value != std::floor(value))
      refuse(what + " is " + word + "; it must be a whole number from " + std::to_string(least) +
             " to " + std::to_string(most));
    return static_cast<int>(value);
  }

  // ---- quantities and values ----

  int component(const std::string &word) const
  {
    for (int c = 0; c < rve::Space<D>::strains; ++c)
      if (word == rve::strain_name<D>(c)) return c;
    return -1;
  }

  int diagonal(const std::string &word) const
  {
    const int c = component(word);
    if (c < 0 || c >= D) {
      std::string names;
      for (int a = 0; a < D; ++a) names += " " + rve::strain_name<D>(a);
      refuse("'" + word + "' is no normal component; it must be one of" + names);
    }
    return c;
  }

  std::string known_quantities(Of of) const
  {
    std::string names;
    for (int c = 0; c < rve::Space<D>::strains; ++c) names += " " + rve::strain_name<D>(c);
    return names + (of != Of::Stress ? " volume" : D == 2 ? " p qx qy" : " p qx qy qz");
  }

  void add_term(Sum &sum, double factor, const std::string &name, const std::string &word,
                Of of) const
  {
    const int c = component(name);
    if (c >= 0) {
      sum[c] += factor;
    } else if (name == "volume" && of != Of::Stress) {
      for (int a = 0; a < D; ++a) sum[a] += factor;
    } else if (name == "p" && of == Of::Stress) {
      for (int a = 0; a < D; ++a) sum[a] -= factor / D;
    } else if (name.size() == 2 && name[0] == 'q' && name[1] >= 'x' && name[1] < 'x' + D &&
               of == Of::Stress) {
      // q of a state that is the same about this axis, compression positive; in the plane half the difference
      for (int a = 0; a < D; ++a)
        sum[a] += factor *
            (D == 2                   ? 0.5
                 : a == name[1] - 'x' ? 1.0
                                      : 0.5) *
            (a == name[1] - 'x' ? -1.0 : 1.0);
    } else {
      refuse("'" + name + "' in '" + word + "' is not known; the quantities are" +
             known_quantities(of) + ", and sums of them as in xx-0.5*yy");
    }
  }

  /// The next sign that is not that of an exponent.
  static std::size_t end_of_term(const std::string &word, std::size_t begin)
  {
    std::size_t end = begin;
    do end = word.find_first_of("+-", end + 1);
    while (end != std::string::npos && end >= 2 && (word[end - 1] == 'e' || word[end - 1] == 'E') &&
           std::isdigit(static_cast<unsigned char>(word[end - 2])));
    return std::min(end, word.size());
  }

  /// "xx", "xx-0.5*yy", ...
  Sum quantity(Of of)
  {
    const std::string word = next("a quantity");
    Sum sum{};
    std::size_t begin = 0;
    while (begin < word.size()) {
      double factor = 1.0;
      if (word[begin] == '+' || word[begin] == '-') factor = word[begin++] == '-' ? -1.0 : 1.0;
      const std::size_t end = end_of_term(word, begin);
      std::string term = word.substr(begin, end - begin);
      if (const std::size_t star = term.find('*'); star != std::string::npos) {
        double value;
        if (!read_number(term.substr(0, star), value))
          refuse("the factor '" + term.substr(0, star) + "' in '" + word + "' is not a number");
        factor *= value;
        term = term.substr(star + 1);
      }
      add_term(sum, factor, term, word, of);
      begin = end;
    }
    if (std::all_of(sum.begin(), sum.end(), [](double x) { return x == 0.0; }))
      refuse("the quantity '" + word + "' is no sum of components; the quantities are" +
             known_quantities(of));
    return sum;
  }

  PathValue value(const std::string &what)
  {
    PathValue result;
    const std::string word = peek();
    if (word == "ramp") {
      next("");
      result.kind = PathValue::Kind::Ramp;
      result.number[0] = number("first value of the ramp");
      result.number[1] = number("last value of the ramp");
      result.number[2] = positive("time of the ramp", "[time]");
    } else if (word == "wave") {
      next("");
      result.kind = PathValue::Kind::Wave;
      result.number[0] = number("mean of the wave");
      result.number[1] = number("amplitude of the wave");
      result.number[2] = positive("period of the wave", "[time]");
      if (is_number(peek())) result.number[3] = number("phase of the wave") * (rve::kPi / 180.0);
    } else if (word == "table") {
      next("");
      result.kind = PathValue::Kind::Table;
      const std::string file = next("the file of a table");
      auto &table = tables[file];
      const std::string column = next("the column of a table");
      try {
        if (!table) table = std::make_shared<PathTable>(read_file(file), file);
        result.index = table->column(column);
      } catch (const rve::InputError &e) {
        refuse(e.what());
      }
      result.table = table;
    } else if (word.size() > 2 && word.compare(0, 2, "v_") == 0) {
      next("");
      result.kind = PathValue::Kind::Script;
      const std::string name = word.substr(2);
      auto &names = target.scripts;
      const auto found = std::find(names.begin(), names.end(), name);
      result.index = static_cast<int>(found - names.begin());
      if (found == names.end()) names.push_back(name);
    } else {
      if (!word.empty() && !is_number(word)) {
        next("");
        refuse(what + " is '" + word + "'; it must be a number, v_NAME, ramp, wave or table");
      }
      result.number[0] = number(what);
    }
    return result;
  }

  // ---- clauses ----

  Stage &stage() { return target.paths.back().stages.back(); }

  void add(Of of, const Sum &sum, const PathValue &of_time, const std::string &text)
  {
    (of == Of::Stress ? stage().stresses : stage().motion).push_back({of, sum, of_time, text});
  }

  void read_clause(const std::string &clause)
  {
    if (clause == "rate")
      read_condition(Of::Rate);
    else if (clause == "strain")
      read_condition(Of::Strain);
    else if (clause == "stress" && peek() == "b")
      read_b();
    else if (clause == "stress")
      read_condition(Of::Stress);
    else if (clause == "circle")
      read_circle();
    else if (clause == "reverse")
      read_reversal();
    else if (clause == "until")
      read_event();
    else
      read_repeat();
  }

  void read_condition(Of of)
  {
    const std::string text = peek();
    const Sum sum = quantity(of);
    const PathValue of_time = value("the value of " + text);
    if (of == Of::Stress) {
      const auto [least, most] = of_time.range();
      const int c = component(text);
      if (c >= 0 && c < D && most > 0.0)
        refuse("the goal of stress " + text + (of_time.is_constant() ? " is " : " goes up to ") +
               rve::number(most) +
               " [stress], a tension, and grains without cohesion carry none; it must be at most "
               "0, because stresses are negative in compression");
      if (text == "p" && least < 0.0)
        refuse("the goal of p " + std::string(of_time.is_constant() ? "is " : "goes down to ") +
               rve::number(least) + " [stress]; it must be at least 0, because p is a pressure");
    }
    add(of, sum, of_time, text);
  }

  /// s_intermediate - s_minor = b (s_major - s_minor)
  void read_b()
  {
    next("");
    const int major = diagonal(next("the major axis")),
              intermediate = diagonal(next("the intermediate axis"));
    if (D == 2) refuse("b needs three axes, and the RVEs are of disks");
    const int minor = diagonal(next("the minor axis"));
    if (major == intermediate || major == minor || minor == intermediate)
      refuse("b needs three different axes");
    const double b = number("b");
    if (!(b >= 0.0 && b <= 1.0)) refuse("b is " + rve::number(b) + " [-]; it must be from 0 to 1");
    Sum sum{};
    sum[major] = -b;
    sum[intermediate] = 1.0;
    sum[minor] = b - 1.0;
    add(Of::Stress, sum, PathValue(), "b");
  }

  void read_circle()
  {
    const double p = positive("p of the circle", "[stress]"),
                 radius = positive("radius of the circle", "[stress]"),
                 period = positive("period of the circle", "[time]");
    // of disks a normal stress goes up by the radius, of spheres by that of the circle in the deviatoric plane
    const double largest = p * (D == 2 ? 1.0 : std::sqrt(1.5));
    if (radius > largest)
      refuse("radius of the circle is " + rve::number(radius) +
             " [stress], and a normal stress would be a tension, which grains without cohesion do "
             "not carry; it must be at most " +
             rve::number(largest) + (D == 2 ? ", which is p" : ", which is p sqrt(3/2)"));
    PathValue wave;
    wave.kind = PathValue::Kind::Wave;
    wave.number[2] = period;
    const auto add_wave = [&](int c, double mean, double amplitude, double phase) {
      wave.number[0] = mean;
      wave.number[1] = amplitude;
      wave.number[3] = phase;
      Sum sum{};
      sum[c] = 1.0;
      add(Of::Stress, sum, wave, rve::strain_name<D>(c));
    };
    const double quarter = 0.5 * rve::kPi;
    if (D == 2) {    // of (s_xx - s_yy)/2 and s_xy
      add_wave(0, -p, radius, quarter);
      add_wave(1, -p, -radius, quarter);
      add_wave(2, 0.0, radius, 0.0);
    } else {    // |s'| = radius
      for (int a = 0; a < D; ++a)
        add_wave(a, -p, std::sqrt(2.0 / 3.0) * radius, quarter - a * 2.0 * rve::kPi / 3.0);
    }
  }

  void read_reversal()
  {
    if (!stage().reversed.empty()) refuse("a stage is reversed by one quantity only");
    const std::string of = next("strain or stress");
    if (of != "strain" && of != "stress")
      refuse("'" + of + "' cannot reverse a stage; it must be strain or stress");
    const Of measured = of == "strain" ? Of::Strain : Of::Stress;
    stage().reversed.push_back({measured, quantity(measured)});
    const PathValue low = stage().low = value("the low limit");
    const PathValue high = stage().high = value("the high limit");
    if (low.is_constant() && high.is_constant() && !(low.number[0] < high.number[0]))
      refuse("the limits are " + rve::number(low.number[0]) + " and " +
             rve::number(high.number[0]) + "; the first one must be below the second one");
  }

  void read_event()
  {
    static const std::map<std::string, Of> measures = {
        {"strain", Of::Strain},        {"stress", Of::Stress}, {"ratio", Of::Ratio},
        {"void_ratio", Of::VoidRatio}, {"time", Of::Time},     {"cycles", Of::Cycles}};
    const std::string word = next("what ends the stage");
    const auto found = measures.find(word);
    if (found == measures.end()) {
      rve::Words known;
      for (const auto &[name, of] : measures) known.emplace_back(name);
      refuse("'" + word + "' ends no stage" + rve::did_you_mean(word, known, "it must be one of"));
    }
    Event event{};
    event.measure.of = found->second;
    if (event.measure.of == Of::Strain || event.measure.of == Of::Stress)
      event.measure.sum = quantity(event.measure.of);
    const std::string side = next("< or >");
    if (side != "<" && side != ">") refuse("found '" + side + "' where < or > was expected");
    event.below = side == "<";
    event.limit = number("the limit");
    stage().events.push_back(event);
  }

  void read_repeat()
  {
    constexpr int MOST = 1000000000;
    stage().times = whole("the number of repeats", 1, MOST) + 1;
    const auto &stages = target.paths.back().stages;
    const int here = static_cast<int>(stages.size());
    stage().back_to = whole("the stage to go back to", 1, here) - 1;
    for (int k = stage().back_to; k < here - 1; ++k)
      if (stages[k].times > 1)
        refuse("stage " + std::to_string(k + 1) +
               " repeats too; repeats do not contain each other");
  }

  /// The stage is complete: what it steers follows.
  void close_stage()
  {
    if (target.paths.empty() || target.paths.back().stages.empty()) return;
    Stage &last = stage();
    if (last.control) return;
    Sum named{};
    std::vector<Sum> rates, stresses;
    for (const Condition &condition : last.motion) rates.push_back(condition.sum);
    for (const Condition &condition : last.stresses) stresses.push_back(condition.sum);
    for (const Event &event : last.events)
      if (event.measure.of == Of::Cycles && last.reversed.empty())
        throw rve::InputError(last.where +
                              ": the stage ends by cycles, and nothing reverses it; it "
                              "needs 'reverse strain' or 'reverse stress', too");
    const std::size_t given = rates.size() + stresses.size();
    for (const auto *list : {&rates, &stresses})
      for (const Sum &sum : *list)
        for (std::size_t c = 0; c < sum.size(); ++c) named[c] += std::fabs(sum[c]);
    std::size_t components = 0;
    std::string names;
    for (int c = 0; c < rve::Space<D>::strains; ++c) {
      if (named[c] != 0.0) {
        ++components;
        names += " " + rve::strain_name<D>(c);
        continue;
      }
      Sum still{};
      still[c] = 1.0;
      rates.push_back(still);
    }
    if (given != components)
      throw rve::InputError(last.where + ": the stage has " + std::to_string(given) +
                            " conditions on " + std::to_string(components) + " components (" +
                            names.substr(names.empty() ? 0 : 1) +
                            "); as many as these are needed, rate, strain or stress");
    try {
      last.control = std::make_shared<rve::ServoModesOf<D>>(rates, stresses);
    } catch (const rve::InputError &e) {
      throw rve::InputError(last.where + ": " + e.what());
    }
    const auto counts_strain = [](const Measure &measure) {
      return measure.of == Of::Strain || measure.of == Of::VoidRatio;
    };
    target.any_servo = target.any_servo || !stresses.empty();
    for (const Condition &condition : last.motion)
      target.any_strain = target.any_strain || condition.of == Of::Strain;
    for (const Measure &measure : last.reversed)
      target.any_strain = target.any_strain || counts_strain(measure);
    for (const Event &event : last.events)
      target.any_strain = target.any_strain || counts_strain(event.measure);
  }
};

template <int D>
LoadPathsOf<D>::LoadPathsOf(const std::vector<PathWord> &words, const ReadPathFile &read_file,
                            std::size_t *used)
{
  const std::size_t count = Reader(*this, words, read_file).read(used != nullptr);
  if (used) *used = count;
}

// ---- following ------------------------------------------------------------------------------------------------------------------

template <int D> void LoadPathsOf<D>::check(const PathState<D> &state) const
{
  rve::require(state.path >= 0 && state.path < size(), [&] {
    return "it is on path " + std::to_string(state.path + 1) + ", and there are " +
        std::to_string(size());
  });
  rve::require(state.stage >= 0 && state.stage < num_stages(state.path), [&] {
    return "it is in stage " + std::to_string(state.stage + 1) + " of its path, which has " +
        std::to_string(num_stages(state.path));
  });
}

template <int D>
void LoadPathsOf<D>::begin(PathState<D> &state, int path, const Matrix &deformation) const
{
  state = PathState<D>();
  state.path = path;
  state.begin = deformation;
  check(state);
}

template <int D>
rve::DriveOf<D> LoadPathsOf<D>::drive(const PathState<D> &state, const PathStep &step,
                                      const double *script, const Matrix &deformation) const
{
  check(state);
  const Stage &stage = paths[state.path].stages[state.stage];
  const rve::ServoModesOf<D> &control = *stage.control;
  const double duration = step.dt * step.substeps;
  const auto finite = [&](double value, const Condition &condition) {
    rve::require(std::isfinite(value), [&] {
      return "the value of " + condition.text + " in stage " + std::to_string(state.stage + 1) +
          " of its path is " + rve::number(value) + "; it must be a finite number";
    });
    return value;
  };
  if (!stage.reversed.empty()) {
    const double low = stage.low.at(state.time + duration, script),
                 high = stage.high.at(state.time + duration, script);
    rve::require(low < high && std::isfinite(low) && std::isfinite(high), [&] {
      return "the limits that reverse stage " + std::to_string(state.stage + 1) +
          " of its path are " + rve::number(low) + " and " + rve::number(high) +
          "; they must be finite numbers, the first one below the second one";
    });
  }

  Matrix gradient = Matrix::zero();
  for (std::size_t k = 0; k < stage.motion.size(); ++k) {
    const Condition &condition = stage.motion[k];
    double rate;
    if (condition.of == Of::Rate)
      rate = state.direction * condition.value.at(state.time + 0.5 * duration, script);
    else
      rate = (condition.value.at(state.time + duration, script) -
              strain_sum<D>(condition.sum, deformation * rve::inverse(state.begin))) /
          duration;
    gradient = gradient + finite(rate, condition) * control.unit_rates[k];
  }
  if (stage.stresses.empty())
    return rve::DriveOf<D>::constant_velocity_gradient(gradient, step.dt, step.substeps);

  rve::DriveOf<D> drive;
  drive.dt = step.dt;
  drive.substeps = step.substeps;
  drive.velocity_gradient = gradient;
  for (std::size_t k = 0; k < stage.stresses.size(); ++k) {
    const Condition &condition = stage.stresses[k];
    const double goal = condition.value.at(state.time + duration, script);
    drive.stress_goal = drive.stress_goal + finite(goal, condition) * control.unit_stresses[k];
  }
  drive.servo_gain = step.servo_gain;
  drive.servo_max_rate = step.servo_max_rate;
  drive.modes = control.modes.data();
  drive.num_modes = static_cast<int>(control.modes.size());
  drive.modes_begin = !state.steered;
  return drive;
}

template <int D>
double LoadPathsOf<D>::measured(const Measure &measure, const PathState<D> &state,
                                const rve::ResultOf<D> &result)
{
  switch (measure.of) {
    case Of::Strain:
      return strain_sum<D>(measure.sum, result.deformation * rve::inverse(state.begin));
    case Of::Stress:
      return rve::sum_of<D>(measure.sum, result.stress);
    case Of::Ratio:
      return result.deviatoric_stress() / result.mean_stress();
    case Of::VoidRatio:
      return result.void_ratio;
    case Of::Cycles:
      return state.cycles();
    default:
      return state.time;
  }
}

template <int D>
void LoadPathsOf<D>::follow(PathState<D> &state, const PathStep &step,
                            const rve::ResultOf<D> &result, const double *script) const
{
  const Stage &stage = paths[state.path].stages[state.stage];
  state.time += step.dt * step.substeps;
  state.steered = !stage.stresses.empty();
  if (!stage.reversed.empty()) {
    const double now = measured(stage.reversed.front(), state, result);
    const int limit = now <= stage.low.at(state.time, script) ? -1
        : now >= stage.high.at(state.time, script)            ? 1
                                                              : 0;
    if (limit != 0 && limit != state.limit) {
      state.limit = limit;
      state.direction = -state.direction;
      ++state.reversals;
    }
  }
  if (has_event(state, result)) next_stage(state, result.deformation);
}

template <int D>
bool LoadPathsOf<D>::has_event(const PathState<D> &state, const rve::ResultOf<D> &result) const
{
  const Stage &stage = paths[state.path].stages[state.stage];
  return std::any_of(stage.events.begin(), stage.events.end(), [&](const Event &event) {
    const double now = measured(event.measure, state, result);
    const double slack = event.measure.of == Of::Time ? ROUNDING_OF_TIME * event.limit : 0.0;
    return event.below ? now <= event.limit : now >= event.limit - slack;
  });
}

template <int D>
void LoadPathsOf<D>::resume(PathState<D> &state, const rve::ResultOf<D> &result) const
{
  check(state);
  if (!state.ended) return;
  state.ended = 0;
  if (has_event(state, result)) next_stage(state, result.deformation);
}

template <int D>
void LoadPathsOf<D>::next_stage(PathState<D> &state, const Matrix &deformation) const
{
  const Stage &stage = paths[state.path].stages[state.stage];
  const bool again = state.rounds + 1 < stage.times;
  const int next = again ? stage.back_to : state.stage + 1;
  if (next == num_stages(state.path)) {    // its rounds stay, for resume()
    state.ended = 1;
    return;
  }
  if (stage.times > 1) state.rounds = again ? state.rounds + 1 : 0;
  state.stage = next;
  state.direction = 1;
  state.limit = state.reversals = 0;
  state.time = 0.0;
  state.begin = deformation;
}

template class LoadPathsOf<2>;
template class LoadPathsOf<3>;

}    // namespace macro
