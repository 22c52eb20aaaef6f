// SPDX-License-Identifier: GPL-2.0-only
#include "macro/load_path.h"
#include "rve/core/error.h"
#include "rve/core/pi.h"
#include "rve/core/suggestion.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>

namespace macro {

namespace {

  bool is_number(const std::string &word)
  {
    double value;
    return read_number(word, value);
  }

  const rve::Words CLAUSES = {"path",   "stage",   "rate",  "strain", "stress",
                              "circle", "reverse", "until", "repeat"};

  bool is_clause(const std::string &word)
  {
    return std::find(CLAUSES.begin(), CLAUSES.end(), word) != CLAUSES.end();
  }

}    // namespace

/// Parser of load paths.
template <int D> class LoadPathsOf<D>::Reader {
 public:
  Reader(LoadPathsOf &of, const std::vector<PathWord> &all, const ReadPathFile &read) :
      target(of), words(all), read_file(read)
  {
  }

  /// Reads all words. With `open` it stops before the first word that cannot belong to a path.
  /// Returns the number of words read.
  std::size_t read(bool open)
  {
    while (position < words.size() && !(open && ends_here())) {
      const std::string clause = next("a clause");
      if (clause == "path") {
        const std::string name = next("the name of a path");
        for (const Path &other : target.paths)
          if (other.name == name) refuse("two paths have the name ", name);
        close_stage();
        target.paths.push_back({name, {}});
      } else if (clause == "stage") {
        close_stage();
        if (target.paths.empty()) target.paths.push_back({"", {}});
        target.paths.back().stages.emplace_back();
        stage().where = here();
      } else if (!is_clause(clause)) {
        refuse("unknown word '", clause, "'",
               rve::did_you_mean(clause, CLAUSES, "it must be one of"));
      } else {
        if (target.paths.empty() || target.paths.back().stages.empty())
          refuse("'", clause, "' belongs to a stage; a path begins with the word stage");
        read_clause(clause);
      }
    }
    close_stage();
    if (target.paths.empty())
      throw rve::InputError("the path has no stage; it must have at least one stage");
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
  /// Throws InputError with a position in the input and the text of these parts.
  template <class... Parts>
  [[noreturn]] static void refuse_at(const std::string &where, const Parts &...parts)
  {
    throw rve::InputError(rve::concat(where, ": ", parts...));
  }
  /// Throws InputError with the position of the last word and the text of these parts.
  template <class... Parts> [[noreturn]] void refuse(const Parts &...parts) const
  {
    refuse_at(here(), parts...);
  }
  std::string peek(std::size_t ahead = 0) const
  {
    return position + ahead < words.size() ? words[position + ahead].text : "";
  }
  std::string next(const std::string &what)
  {
    if (position >= words.size()) refuse("the path ends where ", what, " was expected");
    return words[position++].text;
  }
  /// True if the next word does not continue the path. In a script, the keyword *stress* of the fix
  /// can follow the path.
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
    if (!read_number(word, value)) refuse(what, " is '", word, "'; it must be a finite number");
    return value;
  }
  double positive(const std::string &what, const char *unit)
  {
    const double value = number(what);
    if (!(value > 0.0)) refuse(what, " is ", value, " ", unit, "; it must be above 0");
    return value;
  }
  int whole(const std::string &what, int least, int most)
  {
    const std::string word = peek();
    const double value = number(what);
    if (!(value >= least && value <= most) || value != std::floor(value))
      refuse(what, " is ", word, "; it must be a whole number from ", least, " to ", most);
    return static_cast<int>(value);
  }

  // ---- quantities and values ----

  /// Index of a component such as "xy"; -1 if the word is no component.
  int component(const std::string &word) const
  {
    for (int c = 0; c < rve::Space<D>::strains; ++c)
      if (word == rve::strain_name<D>(c)) return c;
    return -1;
  }

  /// Returns the names of the first `count` components, with a blank before each name.
  static std::string component_names(int count)
  {
    std::string names;
    for (int c = 0; c < count; ++c) names += " " + rve::strain_name<D>(c);
    return names;
  }

  int diagonal(const std::string &word) const
  {
    const int c = component(word);
    if (c < 0 || c >= D)
      refuse("'", word, "' is not a normal component; it must be one of", component_names(D));
    return c;
  }

  static std::string known_quantities(Of of)
  {
    return component_names(rve::Space<D>::strains) +
        (of != Of::Stress ? " volume"
             : D == 2     ? " p qx qy"
                          : " p qx qy qz");
  }

  /// Adds a term of a quantity to `sum`. `word` is the whole quantity.
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
      // spheres: q of a stress state with symmetry about this axis, compression positive; disks:
      // half the difference of the normal stresses
      const int axis = name[1] - 'x';
      for (int a = 0; a < D; ++a)
        sum[a] += factor * (D == 3 && a == axis ? 1.0 : 0.5) * (a == axis ? -1.0 : 1.0);
    } else {
      refuse("'", name, "' in '", word, "' is not known; the quantities are", known_quantities(of),
             ", and sums of them as in xx-0.5*yy");
    }
  }

  /// Position of the next sign that does not belong to an exponent.
  static std::size_t end_of_term(const std::string &word, std::size_t begin)
  {
    std::size_t end = begin;
    do end = word.find_first_of("+-", end + 1);
    while (end != std::string::npos && end >= 2 && (word[end - 1] == 'e' || word[end - 1] == 'E') &&
           std::isdigit(static_cast<unsigned char>(word[end - 2])));
    return std::min(end, word.size());
  }

  /// Reads a quantity such as "xx" or "xx-0.5*yy".
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
          refuse("the factor '", term.substr(0, star), "' in '", word, "' is not a number");
        factor *= value;
        term = term.substr(star + 1);
      }
      add_term(sum, factor, term, word, of);
      begin = end;
    }
    if (std::all_of(sum.begin(), sum.end(), [](double x) { return x == 0.0; }))
      refuse("the quantity '", word, "' is not a sum of components; the quantities are",
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
        refuse(what, " is '", word, "'; it must be a number, v_NAME, ramp, wave or table");
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
        refuse("the goal of stress ", text, of_time.is_constant() ? " is " : " goes up to ", most,
               " [stress], a tension, and grains without cohesion carry none; it must be at most "
               "0, because stresses are negative in compression");
      if (text == "p" && least < 0.0)
        refuse("the goal of p ", of_time.is_constant() ? "is " : "goes down to ", least,
               " [stress]; it must be at least 0, because p is a pressure");
    }
    add(of, sum, of_time, text);
  }

  /// Reads the condition s_intermediate - s_minor = b (s_major - s_minor).
  void read_b()
  {
    next("");
    const int major = diagonal(next("the major axis")),
              intermediate = diagonal(next("the intermediate axis"));
    if (D == 2) refuse("b needs three axes, but RVEs of disks have two");
    const int minor = diagonal(next("the minor axis"));
    if (major == intermediate || major == minor || minor == intermediate)
      refuse("b needs three different axes");
    const double b = number("b");
    if (!(b >= 0.0 && b <= 1.0)) refuse("b is ", b, " [-]; it must be from 0 to 1");
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
    // the amplitude of a normal stress is the radius for disks, and sqrt(2/3) times the radius for
    // spheres
    const double largest = p * (D == 2 ? 1.0 : std::sqrt(1.5));
    if (radius > largest)
      refuse("radius of the circle is ", radius,
             " [stress], and a normal stress would be a tension, which grains without cohesion do "
             "not carry; it must be at most ",
             largest, D == 2 ? ", which is p" : ", which is p sqrt(3/2)");
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
    if (D == 2) {    // radius in the plane of (s_xx - s_yy)/2 and s_xy
      add_wave(0, -p, radius, quarter);
      add_wave(1, -p, -radius, quarter);
      add_wave(2, 0.0, radius, 0.0);
    } else {    // the radius is the norm of the deviator s'
      for (int a = 0; a < D; ++a)
        add_wave(a, -p, std::sqrt(2.0 / 3.0) * radius, quarter - a * 2.0 * rve::kPi / 3.0);
    }
  }

  void read_reversal()
  {
    if (!stage().reversed.empty())
      refuse("the stage has two reverse clauses; it must have at most one");
    const std::string of = next("strain or stress");
    if (of != "strain" && of != "stress")
      refuse("'", of, "' cannot reverse a stage; it must be strain or stress");
    const Of measured = of == "strain" ? Of::Strain : Of::Stress;
    stage().reversed.push_back({measured, quantity(measured)});
    const PathValue low = stage().low = value("the low limit");
    const PathValue high = stage().high = value("the high limit");
    if (low.is_constant() && high.is_constant() && !(low.number[0] < high.number[0]))
      refuse("the limits are ", low.number[0], " and ", high.number[0],
             "; the first one must be below the second one");
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
      refuse("'", word, "' cannot end a stage",
             rve::did_you_mean(word, known, "it must be one of"));
    }
    Event event{};
    event.measure.of = found->second;
    if (event.measure.of == Of::Strain || event.measure.of == Of::Stress)
      event.measure.sum = quantity(event.measure.of);
    const std::string side = next("< or >");
    if (side != "<" && side != ">") refuse("found '", side, "' where < or > was expected");
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
        refuse("stage ", k + 1, " has a repeat, too; repeats must not be nested");
  }

  /// Completes the last stage: checks its conditions and sets its servo modes.
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
        refuse_at(last.where,
                  "the stage ends after a number of cycles, but it has no reversal; add 'reverse "
                  "strain' or 'reverse stress'");
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
      refuse_at(
          last.where, "the stage has ", given, " conditions on ", components, " components (",
          names.substr(names.empty() ? 0 : 1),
          "); the number of conditions (rate, strain or stress) must be that of the components");
    try {
      last.control = std::make_shared<rve::ServoModesOf<D>>(rates, stresses);
    } catch (const rve::InputError &e) {
      refuse_at(last.where, e.what());
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

template class LoadPathsOf<2>;
template class LoadPathsOf<3>;

}    // namespace macro
