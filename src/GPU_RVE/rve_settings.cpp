/* ----------------------------------------------------------------------
   LAMMPS - Large-scale Atomic/Molecular Massively Parallel Simulator
   https://www.lammps.org/, Sandia National Laboratories
   LAMMPS development team: developers@lammps.org

   Copyright (2003) Sandia Corporation.  Under the terms of Contract
   DE-AC04-94AL85000 with Sandia Corporation, the U.S. Government retains
   certain rights in this software.  This software is distributed under
   the GNU General Public License.

   See the README file in the top-level LAMMPS directory.
------------------------------------------------------------------------- */

#include "rve_settings.h"

#include "atom.h"
#include "error.h"
#include "input.h"
#include "lammps.h"
#include "rve/core/error.h"
#include "rve/core/suggestion.h"
#include "variable.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>

using namespace LAMMPS_NS;
using macro::StressFrom;

namespace {

constexpr const char *COMPONENTS[2][2] = {{"xx", "xy"}, {"yx", "yy"}};

bool find_component(const char *word, int &row, int &column)
{
  for (row = 0; row < 2; ++row)
    for (column = 0; column < 2; ++column)
      if (strcmp(word, COMPONENTS[row][column]) == 0) return true;
  return false;
}

/// Reads words one by one; says what is missing.
class Words {
 public:
  Words(LAMMPS *_lmp, std::string _command, int _narg, char **_arg, int begin) :
      lmp(_lmp), command(std::move(_command)), narg(_narg), arg(_arg), iarg(begin)
  {
  }

  bool empty() const { return iarg >= narg; }
  const char *peek() const { return empty() ? "" : arg[iarg]; }
  int position() const { return iarg; }
  void skip(int count) { iarg += count; }
  /// Takes the next word if it is this one.
  bool take(const char *word)
  {
    if (strcmp(peek(), word) != 0) return false;
    ++iarg;
    return true;
  }
  /// The words from a position up to here.
  std::string since(int begin) const
  {
    std::string text = arg[begin];
    for (int k = begin + 1; k < iarg; ++k) text += std::string(" ") + arg[k];
    return text;
  }
  bool starts_number() const
  {
    return !empty() && (isdigit(arg[iarg][0]) || strchr("+-.", arg[iarg][0]));
  }

  const char *next(const std::string &what)
  {
    if (empty())
      lmp->error->all(FLERR, "{}: {} has no value; the command ends there", command, what);
    return arg[iarg++];
  }

  double number(const std::string &what)
  {
    const char *word = next(what);
    if (!utils::is_double(word))
      lmp->error->all(FLERR, "{}: {} is '{}'; it must be a number", command, what, word);
    return utils::numeric(FLERR, word, false, lmp);
  }

  double positive(const std::string &what, const char *unit)
  {
    const double value = number(what);
    if (!std::isfinite(value) || value <= 0.0)
      lmp->error->all(FLERR, "{}: {} is {} {}; it must be greater than 0", command, what,
                      rve::number(value), unit);
    return value;
  }

  int integer(const std::string &what, int least)
  {
    const char *word = next(what);
    if (!utils::is_integer(word))
      lmp->error->all(FLERR, "{}: {} is '{}'; it must be a whole number", command, what, word);
    const int value = utils::inumeric(FLERR, word, false, lmp);
    if (value < least)
      lmp->error->all(FLERR, "{}: {} is {}; it must be at least {}", command, what, value, least);
    return value;
  }

  template <class T>
  T choice(const std::string &what, std::initializer_list<std::pair<const char *, T>> choices)
  {
    const char *word = next(what);
    std::string allowed;
    for (const auto &[name, value] : choices) {
      if (strcmp(word, name) == 0) return value;
      allowed += (allowed.empty() ? "" : " or ") + std::string(name);
    }
    lmp->error->all(FLERR, "{}: {} is '{}'; it must be {}", command, what, word, allowed);
  }

  double within(const std::string &what, const char *unit, double above, double most)
  {
    const double value = number(what);
    if (!(value > above && value <= most))
      lmp->error->all(FLERR, "{}: {} is {} {}; it must be greater than {} and at most {}", command,
                      what, rve::number(value), unit, rve::number(above), rve::number(most));
    return value;
  }

  std::vector<TensorComponent> components(const std::string &what, bool symmetric)
  {
    std::vector<TensorComponent> list;
    int row, column;
    while (!empty() && find_component(arg[iarg], row, column)) {
      const std::string name = arg[iarg++];
      if (symmetric && row > column)
        lmp->error->all(FLERR, "{}: {} has no component yx; the servo shears by xy", command, what);
      for (const auto &other : list)
        if (other.row == row && other.column == column)
          lmp->error->all(FLERR, "{}: {} has component {} twice", command, what, name);
      const std::string component = what + " " + name;
      list.push_back({row, column, ScriptValue::parse(lmp, command, component, next(component))});
    }
    if (list.empty())
      lmp->error->all(FLERR, "{}: {} needs at least one of the components {}, got '{}'", command,
                      what, symmetric ? "xx yy xy" : "xx yy xy yx", peek());
    return list;
  }

 private:
  LAMMPS *lmp;
  std::string command;
  int narg;
  char **arg;
  int iarg;
};

// why fix_modify cannot change what a keyword says; null if it can
constexpr const char *OF_ENGINE = "the engine that holds the RVEs is made with it; write a restart "
                                  "file and read it with another fix rve";
constexpr const char *OF_PACKING = "RVEs that are there keep their grains; define another fix rve "
                                   "for other packings";

constexpr struct {
  const char *name;
  const char *fixed;
} KEYWORDS[] = {{"drive", nullptr},
                {"servo", nullptr},
                {"servo_gain", nullptr},
                {"servo_max_rate", nullptr},
                {"dt", nullptr},
                {"dt_check", nullptr},
                {"substeps", nullptr},
                {"quiescent", nullptr},
                {"stress", nullptr},
                {"mass_scaling", nullptr},
                {"policy", nullptr},
                {"progress", nullptr},
                {"dump", nullptr},
                {"shadow", OF_ENGINE},
                {"preset", "it also says the number format; give dt and mass_scaling one by one"},
                {"packings", OF_PACKING},
                {"packing_variable", OF_PACKING},
                {"packing_random", OF_PACKING},
                {"packing_void_ratio", OF_PACKING},
                {"packing_image", OF_PACKING},
                {"format", OF_ENGINE},
                {"arithmetic", OF_ENGINE},
                {"device", OF_ENGINE},
                {"threads", OF_ENGINE},
                {"skin", OF_ENGINE},
                {"block_size", OF_ENGINE},
                {"arms", OF_ENGINE},
                {"overlap_limit", OF_ENGINE},
                {"energy", OF_ENGINE}};

bool is_keyword(std::string_view word)
{
  const rve::Words keywords = fix_rve_keywords(false);
  return std::find(keywords.begin(), keywords.end(), word) != keywords.end();
}

// An RVE that is skipped longer than this answers from a stiffness that it has no more: contacts slide from a thousandth on.
constexpr double LARGEST_QUIESCENT_STRAIN = 1e-2;

// Of adaptive substeps, unless the script says otherwise.
constexpr int MOST_SUBSTEPS = 100000;

enum class Preset { Draft, Standard, Reference };

/// What doc/src/accuracy.rst recommends; keywords that follow replace parts of it.
void apply(Preset preset, FixRveSettings &s)
{
  s.dt_auto = s.dt_given = true;
  s.mass_scaling = 1.0;
  switch (preset) {
    case Preset::Draft:
      s.options.format = rve::Format::Fast;
      s.dt_fraction = 0.9;
      s.mass_scaling = 4.0;
      break;
    case Preset::Standard:
      s.options.format = rve::Format::Mixed;
      s.dt_fraction = 0.9;
      break;
    case Preset::Reference:
      s.options.format = rve::Format::Double;
      s.dt_fraction = 0.1;
      break;
  }
}

}    // namespace

rve::Words LAMMPS_NS::material_keywords()
{
  rve::Words words;
  for (const MaterialKeyword &keyword : MATERIAL_KEYWORDS) words.emplace_back(keyword.name);
  return words;
}

rve::Words LAMMPS_NS::fix_rve_keywords(bool only_changeable)
{
  rve::Words words = material_keywords();
  for (const auto &keyword : KEYWORDS)
    if (!only_changeable || !keyword.fixed) words.emplace_back(keyword.name);
  return words;
}

const char *LAMMPS_NS::rve_component_name(int row, int column)
{
  return COMPONENTS[row][column];
}

/* ---------------------------------------------------------------------- */

bool MaterialWords::take(LAMMPS *lmp, const std::string &command, int iarg, int narg, char **arg)
{
  for (const auto &[name, word, member] : MATERIAL_KEYWORDS)
    if (strcmp(arg[iarg], name) == 0) {
      const double value = Words(lmp, command, narg, arg, iarg + 1).number(name);
      if (this->*word)
        lmp->error->all(FLERR, "{}: {} is given twice, as {} and as {}; give it once", command,
                        name, rve::number(*(this->*word)), rve::number(value));
      this->*word = value;
      return true;
    }
  return false;
}

void LAMMPS_NS::change_material(rve::Material &material, const MaterialWords &words,
                                double mass_scaling, double mass_scaling_before)
{
  words.apply(material);
  // of inertia only: density stays
  if (words.mass_depth)
    material.mass_depth *= mass_scaling;
  else if (mass_scaling != mass_scaling_before)
    material.mass_depth *= mass_scaling / mass_scaling_before;
}

bool MaterialWords::any() const
{
  return std::any_of(std::begin(MATERIAL_KEYWORDS), std::end(MATERIAL_KEYWORDS),
                     [this](const MaterialKeyword &keyword) {
                       return (this->*keyword.word).has_value();
                     });
}

void MaterialWords::apply(rve::Material &material) const
{
  for (const MaterialKeyword &keyword : MATERIAL_KEYWORDS)
    if (this->*keyword.word) material.*keyword.member = *(this->*keyword.word);
  if (rolling_friction.value_or(0.0) > 0.0 && !kr && material.rolling_stiffness == 0.0)
    material.rolling_stiffness = material.tangential_stiffness;
}

/* ---------------------------------------------------------------------- */

ScriptValue ScriptValue::parse(LAMMPS *lmp, const std::string &command, const std::string &what,
                               const char *word)
{
  ScriptValue value;
  if (strncmp(word, "v_", 2) == 0)
    value.variable = word + 2;
  else if (utils::is_double(word))
    value.constant = utils::numeric(FLERR, word, false, lmp);
  else
    lmp->error->all(
        FLERR, "{}: {} is '{}'; it must be a number or v_name of a variable{}", command, what, word,
        lmp->input->variable->find(word) >= 0 ? fmt::format("; did you mean v_{}?", word) : "");
  return value;
}

void ScriptValue::find(LAMMPS *lmp, const std::string &command)
{
  if (variable.empty()) return;
  Variable *variables = lmp->input->variable;
  index = variables->find(variable.c_str());
  if (index < 0) lmp->error->all(FLERR, "{}: variable {} does not exist", command, variable);
  per_atom = variables->atomstyle(index);
  if (!per_atom && !variables->equalstyle(index))
    lmp->error->all(FLERR, "{}: variable {} must be of equal or atom style", command, variable);
}

void ScriptValue::evaluate(LAMMPS *lmp, int igroup, std::vector<double> &values) const
{
  Variable *variables = lmp->input->variable;
  values.assign(lmp->atom->nlocal, constant);
  if (per_atom)
    variables->compute_atom(index, igroup, values.data(), 1, 0);
  else if (index >= 0)
    std::fill(values.begin(), values.end(), variables->compute_equal(index));
}

/* ---------------------------------------------------------------------- */

FixRveSettings FixRveSettings::parse(LAMMPS *lmp, int narg, char **arg)
{
  const std::string command = "fix rve";
  FixRveSettings s;
  s.packings.push_back(Words(lmp, command, narg, arg, 3).next("packing file"));
  s.take_keywords(lmp, command, narg, arg, 4, false);
  s.check(lmp, command);
  return s;
}

FixRveSettings FixRveSettings::modified(LAMMPS *lmp, int narg, char **arg) const
{
  const std::string command = "fix_modify of fix rve";
  FixRveSettings s = *this;
  s.material = MaterialWords();
  s.mass_scaling.reset();
  s.dt_given = false;
  s.take_keywords(lmp, command, narg, arg, 0, true);
  s.check(lmp, command);
  return s;
}

/* ---------------------------------------------------------------------- */

void FixRveSettings::take_keywords(LAMMPS *lmp, const std::string &command, int narg, char **arg,
                                   int begin, bool modifies)
{
  FixRveSettings &s = *this;
  Words words(lmp, command, narg, arg, begin);
  std::map<std::string, std::string> given;    // keyword: it and its values
  std::string last;                            // of these
  while (!words.empty()) {
    const int place = words.position();
    if (s.material.take(lmp, command, place, narg, arg)) {
      words.skip(2);
      last = words.since(place);
      continue;
    }
    const std::string keyword = words.next("keyword");
    if (modifies)
      for (const auto &[name, fixed] : KEYWORDS)
        if (fixed && keyword == name)
          lmp->error->all(FLERR, "{}: {} cannot be changed: {}", command, keyword, fixed);
    if (keyword == "drive") {
      s.driver = words.choice<RveDriver>(keyword,
                                         {{"none", RveDriver::None},
                                          {"velocity_gradient", RveDriver::VelocityGradient},
                                          {"mpm", RveDriver::Mpm}});
      s.velocity_gradient.clear();
      if (s.driver == RveDriver::VelocityGradient)
        s.velocity_gradient = words.components("drive velocity_gradient", false);
    } else if (keyword == "servo") {
      s.stress_goal.clear();
      if (!words.take("none")) s.stress_goal = words.components(keyword, true);
    } else if (keyword == "servo_gain") {
      s.servo_gain = words.positive(keyword, "[1/(stress time^2)]");
    } else if (keyword == "servo_max_rate") {
      s.servo_max_rate = words.positive(keyword, "[1/time]");
    } else if (keyword == "dt") {
      s.dt_given = true;
      s.dt_auto = words.take("auto");
      if (s.dt_auto) {
        if (words.starts_number()) s.dt_fraction = words.positive("dt auto fraction", "[-]");
        if (s.dt_fraction > 1.0)
          lmp->error->all(FLERR, "{}: dt auto fraction is {} [-]; it must be in (0, 1]", command,
                          rve::number(s.dt_fraction));
      } else {
        s.dt = words.positive("dt", "[time]");
      }
    } else if (keyword == "dt_check") {
      s.dt_check_interval = words.integer(keyword, 0);
    } else if (keyword == "substeps") {
      s.substeps = 0;
      s.macro_step.adaptive.reset();
      if (words.take("match")) {
        // as many as cover the LAMMPS time step
      } else if (words.take("adaptive")) {
        rve::AdaptiveSubsteps adaptive;
        adaptive.strain_per_step = words.within("substeps adaptive strain", "[-]", 0.0, 1e-2);
        adaptive.inertial_number =
            words.within("substeps adaptive inertial number", "[-]", 0.0, 1.0);
        adaptive.most = words.starts_number() ? words.integer("substeps adaptive most", 1)
                                              : MOST_SUBSTEPS;
        s.macro_step.adaptive = adaptive;
      } else {
        s.substeps = words.integer(keyword, 1);
      }
    } else if (keyword == "quiescent") {
      s.macro_step.quiescent_strain = words.take("none")
          ? 0.0
          : words.within("quiescent strain", "[-]", 0.0, LARGEST_QUIESCENT_STRAIN);
    } else if (keyword == "mass_scaling") {
      s.mass_scaling = words.positive(keyword, "[-]");
    } else if (keyword == "stress") {
      s.macro_step.stress_from = words.choice<StressFrom>(keyword,
                                                          {{"end", StressFrom::End},
                                                           {"average", StressFrom::Average},
                                                           {"regression", StressFrom::Regression}});
      if (s.macro_step.stress_from != StressFrom::End) {
        s.macro_step.stress_samples = words.integer("stress samples", 2);
        s.macro_step.stress_spacing = words.integer("stress spacing", 1);
      }
    } else if (keyword == "shadow") {
      s.num_shadows = words.integer(keyword, 1);
      if (words.starts_number())
        s.macro_step.shadow_refinement = words.integer("shadow refinement", 1);
    } else if (keyword == "preset") {
      if (place != begin)
        lmp->error->all(FLERR,
                        "{}: preset must be the first keyword: those that follow replace "
                        "parts of it",
                        command);
      apply(words.choice<Preset>(keyword,
                                 {{"draft", Preset::Draft},
                                  {"standard", Preset::Standard},
                                  {"reference", Preset::Reference}}),
            s);
    } else if (keyword == "format") {
      s.options.format = words.choice<rve::Format>(keyword,
                                                   {{"fast", rve::Format::Fast},
                                                    {"mixed", rve::Format::Mixed},
                                                    {"double", rve::Format::Double},
                                                    {"single", rve::Format::Single}});
    } else if (keyword == "arithmetic") {
      s.options.arithmetic = words.choice<rve::Arithmetic>(
          keyword, {{"strict", rve::Arithmetic::Strict}, {"relaxed", rve::Arithmetic::Relaxed}});
    } else if (keyword == "device") {
      s.options.device = words.choice<rve::Device>(
          keyword,
          {{"auto", rve::Device::Auto}, {"cpu", rve::Device::Cpu}, {"cuda", rve::Device::Cuda}});
    } else if (keyword == "threads") {
      s.options.threads = words.integer(keyword, 0);
      s.threads_given = true;
    } else if (keyword == "skin") {
      s.options.skin = words.positive(keyword, "[length]");
    } else if (keyword == "block_size") {
      s.options.block_size = words.integer(keyword, 0);
    } else if (keyword == "arms") {
      s.options.arms = words.choice<rve::Arms>(
          keyword, {{"contact", rve::Arms::Contact}, {"lammps", rve::Arms::Lammps}});
    } else if (keyword == "overlap_limit") {
      s.options.overlap_limit = words.number(keyword);
      if (!(s.options.overlap_limit > 0.0 && s.options.overlap_limit < 1.0))
        lmp->error->all(FLERR, "{}: overlap_limit is {} [radius]; it must be in (0, 1)", command,
                        rve::number(s.options.overlap_limit));
    } else if (keyword == "policy") {
      s.freeze = words.choice<bool>(keyword, {{"stop", false}, {"freeze", true}});
    } else if (keyword == "energy") {
      s.options.track_energy = words.choice<bool>(keyword, {{"yes", true}, {"no", false}});
    } else if (keyword == "progress") {
      s.progress_interval = words.number(keyword);
      if (!(s.progress_interval >= 0.0))
        lmp->error->all(FLERR,
                        "{}: progress is {} [seconds of wall time]; it must be at least 0, which "
                        "means never",
                        command, rve::number(s.progress_interval));
    } else if (keyword == "packings") {
      while (!words.empty() && !is_keyword(words.peek())) s.packings.push_back(words.next(keyword));
    } else if (keyword == "packing_variable") {
      s.choice.number = ScriptValue::parse(lmp, command, keyword, words.next(keyword));
    } else if (keyword == "packing_random") {
      s.choice.seed = words.integer(keyword, 0);
    } else if (keyword == "packing_void_ratio") {
      s.choice.void_ratio = ScriptValue::parse(lmp, command, keyword, words.next(keyword));
      s.choice.tolerance = words.positive("packing_void_ratio tolerance", "[-]");
    } else if (keyword == "packing_image") {
      if (strcmp(words.peek(), "random") == 0) {
        words.skip(1);
        s.choice.image_seed = words.integer("packing_image random seed", 0);
      } else {
        s.choice.image = ScriptValue::parse(lmp, command, keyword, words.next(keyword));
      }
    } else if (keyword == "dump") {
      s.dump_atoms.clear();
      s.dump_interval = words.take("none") ? 0 : words.integer("dump interval", 1);
      if (s.dump_interval > 0) {
        s.dump_prefix = words.next("dump file prefix");
        do s.dump_atoms.push_back(words.integer("dump atom ID", 1));
        while (words.starts_number());
      }
    } else {
      rve::Words known = fix_rve_keywords(modifies);
      // a component that is none ends the list of them
      if (last.rfind("drive", 0) == 0 || last.rfind("servo ", 0) == 0)
        for (const auto &row : COMPONENTS)
          known.insert(known.begin(), std::begin(row), std::end(row));
      lmp->error->all(FLERR, "{}: {}", command, rve::unknown_keyword(keyword, known, last));
    }
    const std::string text = words.since(place);
    last = text;
    const auto [before, is_new] = given.emplace(keyword, text);
    if (!is_new)
      lmp->error->all(FLERR, "{}: {} is given twice, as '{}' and as '{}'; give it once{}", command,
                      keyword, before->second, text,
                      keyword == "servo" || keyword == "drive" ? ", with all its components" : "");
  }
}

/* ---------------------------------------------------------------------- */

void FixRveSettings::check(LAMMPS *lmp, const std::string &command) const
{
  const FixRveSettings &s = *this;
  if (s.driver == RveDriver::Mpm && !s.stress_goal.empty())
    lmp->error->all(FLERR, "{}: servo and drive mpm exclude each other", command);
  if (s.macro_step.adaptive && !s.stress_goal.empty())
    lmp->error->all(FLERR,
                    "{}: substeps adaptive needs a strain that is known beforehand and "
                    "cannot be used with servo",
                    command);
  if (s.macro_step.quiescent_strain > 0.0 && !s.stress_goal.empty())
    lmp->error->all(FLERR,
                    "{}: quiescent and servo exclude each other: a servo has to feel the "
                    "stress of the grains",
                    command);
  if (s.macro_step.adaptive && s.macro_step.quiescent_strain > 0.0 &&
      s.macro_step.quiescent_strain < s.macro_step.adaptive->strain_per_step)
    lmp->error->warning(FLERR,
                        "fix rve: quiescent strain {} is less than the strain of one adaptive "
                        "substep, {}: an RVE wakes for a single step",
                        rve::number(s.macro_step.quiescent_strain),
                        rve::number(s.macro_step.adaptive->strain_per_step));
  for (const auto &goal : s.stress_goal)
    for (const auto &rate : s.velocity_gradient)
      if (goal.row == rate.row && goal.column == rate.column)
        lmp->error->all(FLERR, "{}: component {} is driven by both velocity_gradient and servo",
                        command, rve_component_name(goal.row, goal.column));
  if (!s.choice.number.variable.empty() && (s.choice.seed || s.choice.void_ratio))
    lmp->error->all(FLERR, "{}: packing_variable and {} exclude each other", command,
                    s.choice.seed ? "packing_random" : "packing_void_ratio");
  for (const auto &goal : s.stress_goal)
    if (goal.row == goal.column && goal.value.variable.empty() && goal.value.constant > 0.0)
      lmp->error->all(FLERR,
                      "{}: the goal of servo {} is {} [stress], a tension, and grains without "
                      "cohesion carry none; it must be at most 0, because stresses are negative in "
                      "compression",
                      command, rve_component_name(goal.row, goal.column),
                      rve::number(goal.value.constant));
  const auto &adaptive = s.macro_step.adaptive;
  const double steps =
      static_cast<double>(adaptive ? adaptive->most : s.substeps) * s.steps_per_step();
  if (steps > MAXSMALLINT)
    lmp->error->all(FLERR,
                    "{}: {} DEM steps per LAMMPS step{} times {} for each one of a shadow are {}; "
                    "there can be {} at most: use fewer substeps or a lower refinement of shadow",
                    command, adaptive ? adaptive->most : s.substeps,
                    adaptive ? " (the most of substeps adaptive)" : "", s.steps_per_step(),
                    rve::number(steps), MAXSMALLINT);
}

/* ---------------------------------------------------------------------- */

std::map<std::string, std::string> FixRveSettings::account() const
{
  const auto &steps = macro_step;
  std::map<std::string, std::string> account;
  account["format"] = rve::to_string(options.format);
  account["arithmetic"] = options.arithmetic == rve::Arithmetic::Strict ? "strict" : "relaxed";
  account["arms"] = options.arms == rve::Arms::Contact ? "contact" : "lammps";
  account["skin"] = options.skin > 0.0 ? rve::number(options.skin) : "automatic";
  account["overlap_limit"] = rve::number(options.overlap_limit);
  account["energy"] = options.track_energy ? "yes" : "no";
  account["policy"] = freeze ? "freeze" : "stop";
  account["substeps"] = steps.adaptive
      ? fmt::format("adaptive {} {} {}", rve::number(steps.adaptive->strain_per_step),
                    rve::number(steps.adaptive->inertial_number), steps.adaptive->most)
      : substeps > 0 ? std::to_string(substeps)
                     : "match";
  account["quiescent"] = steps.quiescent_strain > 0.0 ? rve::number(steps.quiescent_strain)
                                                      : "none";
  const auto samples = [&](const char *word) {
    return fmt::format("{} {} {}", word, steps.stress_samples, steps.stress_spacing);
  };
  account["stress"] = steps.stress_from == StressFrom::End ? "end"
      : steps.stress_from == StressFrom::Average           ? samples("average")
                                                           : samples("regression");
  account["shadow"] = num_shadows > 0 ? fmt::format("{} {}", num_shadows, steps.shadow_refinement)
                                      : "none";
  account["dt_check"] = std::to_string(dt_check_interval);
  return account;
}
