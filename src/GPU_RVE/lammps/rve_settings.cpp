// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/rve_settings.h"

#include "error.h"
#include "lammps.h"
#include "lammps/on_rank_zero.h"
#include "lammps/progress.h"
#include "rve/core/checksum.h"
#include "rve/core/error.h"
#include "rve/engine/files.h"
#include "rve/engine/packing_io.h"
#include "utils.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string_view>

using namespace LAMMPS_NS;
using macro::StressFrom;
namespace fs = std::filesystem;

namespace {

/// Returns the end of the error message for a packing file that does not exist.
std::string where_packings_come_from(const std::string &file)
{
  const rve::Words near = rve::nearest_words(file, fix_rve_keywords());
  if (!near.empty() && file.find_first_of("./") == std::string::npos)
    return fmt::format("; {} is not a file: did you mean the keyword {}?", file, near.front());
  return fmt::format(
      " (looked in folder {}). The command create_rve makes packings, as in create_rve "
      "{} grains 400 radius uniform 0.0025 0.005 ...",
      fs::absolute(file).lexically_normal().parent_path().string(), file);
}

/// Default of *copies*: two doublings, one for each of the two axes along which a stretched cell of
/// spheres narrows.
constexpr int MOST_COPIES = 4;

constexpr const char *COMPONENTS[3][3] = {
    {"xx", "xy", "xz"}, {"yx", "yy", "yz"}, {"zx", "zy", "zz"}};

bool find_component(const std::string &word, int dimension, int &row, int &column)
{
  for (row = 0; row < dimension; ++row)
    for (column = 0; column < dimension; ++column)
      if (word == COMPONENTS[row][column]) return true;
  return false;
}

/// Returns the names of the components of a tensor: the diagonal, the components above it, and
/// those below it unless the tensor is symmetric.
rve::Words component_names(int dimension, bool symmetric)
{
  rve::Words names;
  for (int a = 0; a < dimension; ++a) names.emplace_back(COMPONENTS[a][a]);
  for (const bool below : {false, true})
    for (int a = 0; a < dimension; ++a)
      for (int b = a + 1; b < dimension; ++b)
        if (!below || !symmetric) names.emplace_back(below ? COMPONENTS[b][a] : COMPONENTS[a][b]);
  return names;
}

/// Reads at least one component of a tensor with its value. Error messages name `part`, as in
/// ScriptArguments.
std::vector<TensorComponent> read_components(ScriptArguments &words, const std::string &part,
                                             int dimension, bool symmetric)
{
  const std::string what = words.keyword() + (part.empty() ? "" : " ") + part;
  std::vector<TensorComponent> list;
  int row, column;
  while (find_component(words.peek(), dimension, row, column)) {
    const std::string name = words.next();
    if (symmetric && row > column)
      words.refuse(fmt::format("{} has no component {}; use {}, because the stress is symmetric",
                               what, name, COMPONENTS[column][row]));
    for (const auto &other : list)
      if (other.row == row && other.column == column)
        words.refuse(what + " has component " + name + " twice");
    list.push_back({row, column, words.value(part.empty() ? name : part + " " + name)});
  }
  if (find_component(words.peek(), 3, row, column))
    words.refuse(fmt::format("{} has component {}, but the RVEs consist of disks: only RVEs of "
                             "spheres have z components",
                             what, words.peek()));
  if (list.empty()) {
    std::string names;
    for (const auto &name : component_names(dimension, symmetric))
      names += fmt::format(" {}", name);
    words.refuse(fmt::format("{} needs at least one of the components{}, got '{}'", what, names,
                             words.peek()));
  }
  rve::Words others = component_names(dimension, false);
  std::reverse(others.begin(), others.end());
  words.suggest(others);
  return list;
}

// Upper limit of the strain of *quiescent* [-]. The stress of a quiescent RVE follows from an
// elastic stiffness, which is not valid beyond the limit: contacts begin to slide at a strain of
// about 1e-3.
constexpr double LARGEST_QUIESCENT_STRAIN = 1e-2;

// Default of the largest number of adaptive substeps.
constexpr int MOST_SUBSTEPS = 100000;

// ---- values of keywords ----

void read_drive(ScriptArguments &words, FixRveSettings &s)
{
  s.driver = words.choice<RveDriver>("",
                                     {{"none", RveDriver::None},
                                      {"velocity_gradient", RveDriver::VelocityGradient},
                                      {"mpm", RveDriver::Mpm}});
  s.velocity_gradient.clear();
  if (s.driver == RveDriver::VelocityGradient)
    s.velocity_gradient = read_components(words, "velocity_gradient", s.dimension, false);
}

/// Returns the text of a path file, which rank 0 reads. Throws InputError on all ranks. Collective.
std::string text_of_file(LAMMPS *lmp, const std::string &file)
{
  std::string text;
  const std::string failure = on_rank_zero(lmp->world, [&] {
    rve::require_readable(file, "path file");
    std::ifstream in(file);
    text.assign(std::istreambuf_iterator<char>(in), {});
    rve::require(text.size() <= MAXSMALLINT, file + " is too large for a path file");
  });
  if (!failure.empty()) throw rve::InputError(failure);
  broadcast(lmp->world, 0, text);
  return text;
}

/// Parses loading paths and adds their variables to `s`. Returns the number of words that belong to
/// the paths. In a script, other keywords can follow the paths. A path file contains only paths.
template <int D>
std::size_t read_paths(ScriptArguments &words, const std::vector<macro::PathWord> &path,
                       bool in_script, std::shared_ptr<const macro::LoadPathsOf<D>> &result,
                       PathSettings &s)
{
  std::size_t used = path.size();
  const auto read_file = [&](const std::string &file) { return text_of_file(words.owner(), file); };
  try {
    result = std::make_shared<macro::LoadPathsOf<D>>(path, read_file, in_script ? &used : nullptr);
  } catch (const rve::InputError &e) {
    words.refuse(e.what());
  }
  for (const std::string &name : result->script_names()) s.values.emplace_back().variable = name;
  return used;
}

void read_path(ScriptArguments &words, FixRveSettings &settings)
{
  PathSettings &s = settings.path;
  s.of_disks.reset();
  s.of_spheres.reset();
  s.values.clear();
  s.text = "none";
  if (!words.has("path_variable")) {
    s.number = ScriptValue();
    s.number_given = false;
  }
  if (!words.has("path_end")) s.halts = false;
  if (words.take("none")) return;
  const bool in_script = std::string_view(words.peek()) == "stage";
  std::vector<macro::PathWord> path;
  std::vector<std::string> texts;
  if (in_script) {
    for (int k = 0; *words.peek(k) != '\0'; ++k) path.push_back({words.peek(k), "path"});
  } else {
    do {
      const std::string file = words.next("file");
      try {
        const std::string text = text_of_file(words.owner(), file);
        for (macro::PathWord &word : macro::path_words(text, file)) path.push_back(std::move(word));
        texts.push_back(fmt::format("{} with checksum {:016x}", file,
                                    rve::checksum_of(text.data(), text.size())));
      } catch (const rve::InputError &e) {
        words.refuse(e.what());
      }
    } while (!words.empty() && !words.at_keyword());
  }
  const std::size_t used = settings.dimension == 2
      ? read_paths<2>(words, path, in_script, s.of_disks, s)
      : read_paths<3>(words, path, in_script, s.of_spheres, s);
  for (std::size_t k = 0; in_script && k < used; ++k) texts.emplace_back(words.next());
  s.text = utils::join_words(texts, " ");
}

void read_dt(ScriptArguments &words, FixRveSettings &s)
{
  s.dt_given = true;
  s.dt_auto = words.take("auto");
  if (!s.dt_auto)
    s.dt = words.positive("", "[time]");
  else if (words.starts_number())
    s.dt_fraction = words.within("auto fraction", "[-]", 0.0, 1.0);
}

void read_substeps(ScriptArguments &words, FixRveSettings &s)
{
  s.substeps = 0;
  s.macro_step.adaptive.reset();
  if (words.take("match")) return;    // as many substeps as cover the LAMMPS time step
  if (!words.take("adaptive")) {
    s.substeps = words.integer("", 1);
    return;
  }
  rve::AdaptiveSubsteps adaptive;
  adaptive.strain_per_step = words.within("adaptive strain", "[-]", 0.0, 1e-2);
  adaptive.inertial_number = words.within("adaptive inertial number", "[-]", 0.0, 1.0);
  adaptive.most = words.starts_number() ? words.integer("adaptive most", 1) : MOST_SUBSTEPS;
  s.macro_step.adaptive = adaptive;
}

constexpr rve::Choice<StressFrom> STRESS_CHOICES[] = {{"end", StressFrom::End},
                                                      {"average", StressFrom::Average},
                                                      {"regression", StressFrom::Regression}};

void read_stress(ScriptArguments &words, FixRveSettings &s)
{
  s.macro_step.stress_from = words.choice("", STRESS_CHOICES);
  if (s.macro_step.stress_from == StressFrom::End) return;
  s.macro_step.stress_samples = words.integer("samples", 2);
  s.macro_step.stress_spacing = words.integer("spacing", 1);
}

/// Applies the values that doc/src/accuracy.rst recommends. Later keywords replace parts of them.
void read_preset(ScriptArguments &words, FixRveSettings &s)
{
  if (!words.given().empty())
    words.refuse(
        "preset must be the first keyword, because later keywords replace some of its values");
  struct Preset {
    rve::Format format;
    double dt_fraction, mass_scaling;
  };
  const auto preset = words.choice<Preset>("",
                                           {{"draft", {rve::Format::Fast, 0.9, 4.0}},
                                            {"standard", {rve::Format::Mixed, 0.9, 1.0}},
                                            {"reference", {rve::Format::Double, 0.1, 1.0}}});
  s.dt_auto = s.dt_given = true;
  s.options.format = preset.format;
  s.dt_fraction = preset.dt_fraction;
  s.mass_scaling = preset.mass_scaling;
}

void read_dump(ScriptArguments &words, FixRveSettings &s)
{
  s.dump_atoms.clear();
  s.dump_interval = words.take("none") ? 0 : words.integer("interval", 1);
  if (s.dump_interval == 0) return;
  s.dump_prefix = words.next("file prefix");
  do s.dump_atoms.push_back(words.integer("atom ID", 1));
  while (words.starts_number());
}

// Reasons why fix_modify cannot change the value of a keyword.
constexpr const char *OF_ENGINE = "it is fixed when the RVEs are created; write a restart file, "
                                  "and define fix rve with another value after read_restart";
constexpr const char *OF_PACKING =
    "it selects the grains of new RVEs only; define another fix rve for other packings";

using Settings = FixRveSettings;
using rve::Options;

struct FixRveKeyword : ScriptKeyword<Settings> {
  const char *fixed = nullptr;    ///< reason why fix_modify cannot change it; null if it can
};

constexpr rve::Choice<RvePolicy> POLICIES[] = {
    {"stop", RvePolicy::Stop}, {"freeze", RvePolicy::Freeze}, {"fresh", RvePolicy::Fresh}};
const FixRveKeyword KEYWORDS[] = {
    {"drive", "none | mpm | velocity_gradient component rate ...", read_drive},
    {"servo", "none | component stress ...",
     [](ScriptArguments &words, Settings &s) {
       s.stress_goal.clear();
       if (!words.take("none")) s.stress_goal = read_components(words, "", s.dimension, true);
     }},
    {"servo_gain", "gain", into(positive("[1/(stress time^2)]"), &Settings::servo_gain)},
    {"servo_max_rate", "rate", into(positive("[1/time]"), &Settings::servo_max_rate)},
    {"path", "none | file ... | stage condition ...", read_path},
    {"path_variable", "v_name",
     [](ScriptArguments &words, Settings &s) {
       s.path.number = words.value();
       s.path.number_given = true;
     }},
    {"path_end", "hold | halt",
     into(one_of<bool>({{"hold", false}, {"halt", true}}), &Settings::path, &PathSettings::halts)},
    {"dt", "time | auto [fraction]", read_dt},
    {"dt_check", "N", into(integer(0), &Settings::dt_check_interval)},
    {"substeps", "N | match | adaptive strain inertia [most]", read_substeps},
    {"quiescent", "none | strain",
     [](ScriptArguments &words, Settings &s) {
       s.macro_step.quiescent_strain =
           words.take("none") ? 0.0 : words.within("strain", "[-]", 0.0, LARGEST_QUIESCENT_STRAIN);
     }},
    {"stress", "end | average samples spacing | regression samples spacing", read_stress},
    {"mass_scaling", "factor", into(positive("[-]"), &Settings::mass_scaling)},
    {"policy", "stop | freeze | fresh", into(one_of(POLICIES), &Settings::policy)},
    {"copies", "N",
     [](ScriptArguments &words, Settings &s) {
       s.macro_step.most_copies = words.integer("", 1);
       if (s.macro_step.most_copies & (s.macro_step.most_copies - 1))
         words.refuse(fmt::format(
             "copies is {}; it must be a power of two (1, 2, 4 ...), because cells are doubled",
             s.macro_step.most_copies));
     }},
    {"progress", "seconds", into(read_progress, &Settings::progress_interval)},
    {"dump", "none | N prefix atom-ID ...", read_dump},
    {"shadow", "N [refinement]",
     [](ScriptArguments &words, Settings &s) {
       s.num_shadows = words.integer("", 1);
       if (words.starts_number()) s.macro_step.shadow_refinement = words.integer("refinement", 1);
     },
     OF_ENGINE},
    {"preset", "draft | standard | reference", read_preset,
     "it also sets the number format; give dt and mass_scaling instead"},
    {"packings", "file ...",
     [](ScriptArguments &words, Settings &s) {
       while (!words.empty() && !words.at_keyword()) s.packings.emplace_back(words.next());
     },
     OF_PACKING},
    {"packing_variable", "v_name", into(any_value, &Settings::choice, &PackingChoice::number),
     OF_PACKING},
    {"packing_random", "seed", into(integer(0), &Settings::choice, &PackingChoice::seed),
     OF_PACKING},
    {"packing_stress", "stress", into(any_value, &Settings::choice, &PackingChoice::stress),
     OF_PACKING},
    {"packing_void_ratio", "e tolerance",
     [](ScriptArguments &words, Settings &s) {
       s.choice.void_ratio = words.value();
       s.choice.tolerance = words.positive("tolerance", "[-]");
     },
     OF_PACKING},
    {"packing_image", "number | v_name | random seed",
     [](ScriptArguments &words, Settings &s) {
       if (words.take("random"))
         s.choice.image_seed = words.integer("random seed", 0);
       else
         s.choice.image = words.value();
     },
     OF_PACKING},
    {"format", "fast | mixed | double | single",
     into(one_of(rve::FORMAT_CHOICES), &Settings::options, &Options::format), OF_ENGINE},
    {"arithmetic", "strict | relaxed",
     into(one_of(rve::ARITHMETIC_CHOICES), &Settings::options, &Options::arithmetic), OF_ENGINE},
    {"device", "auto | cpu | cuda",
     into(one_of(rve::DEVICE_CHOICES), &Settings::options, &Options::device), OF_ENGINE},
    {"threads", "N",
     [](ScriptArguments &words, Settings &s) {
       s.options.threads = words.integer("", 0);
       s.threads_given = true;
     },
     OF_ENGINE},
    {"skin", "length", into(positive("[length]"), &Settings::options, &Options::skin), OF_ENGINE},
    {"block_size", "N", into(integer(0), &Settings::options, &Options::block_size), OF_ENGINE},
    {"arms", "contact | lammps", into(one_of(rve::ARM_CHOICES), &Settings::options, &Options::arms),
     OF_ENGINE},
    {"overlap_limit", "fraction",
     [](ScriptArguments &words, Settings &s) {
       s.options.overlap_limit = words.number();
       if (!(s.options.overlap_limit > 0.0 && s.options.overlap_limit < 1.0))
         words.refuse(fmt::format("overlap_limit is {} [radius]; it must be in (0, 1)",
                                  rve::number(s.options.overlap_limit)));
     },
     OF_ENGINE},
    {"energy", "yes | no", into(yes_or_no, &Settings::options, &Options::track_energy), OF_ENGINE}};

}    // namespace

rve::Words LAMMPS_NS::fix_rve_keywords()
{
  rve::Words keywords = material_keywords();
  const rve::Words others = names_of(KEYWORDS);
  keywords.insert(keywords.end(), others.begin(), others.end());
  return keywords;
}

const char *LAMMPS_NS::rve_component_name(int row, int column)
{
  return COMPONENTS[row][column];
}

std::string LAMMPS_NS::packing_failure(const std::string &file, const rve::InputError &e)
{
  const std::string message = e.what();
  std::error_code unknown;    // set if the file system gives no answer, as for a loop of links
  if (!fs::exists(file, unknown) && !unknown) return message + where_packings_come_from(file);
  return (message.find(file) != std::string::npos ? "" : file + ": ") + message;
}

/// Returns the dimension of a packing file, which rank 0 reads. Ends with error->all if it cannot
/// be read. The message begins with `name`. Collective.
static int dimension_of(LAMMPS *lmp, const std::string &name, const std::string &file)
{
  int dimension = 0;
  const std::string failure = on_rank_zero(lmp->world, [&] {
    try {
      dimension = rve::dimension_of_packing(file);
    } catch (const rve::InputError &e) {
      throw rve::InputError(packing_failure(file, e));
    }
  });
  if (!failure.empty()) lmp->error->all(FLERR, "{}: {}", name, failure);
  MPI_Bcast(&dimension, 1, MPI_INT, 0, lmp->world);
  return dimension;
}

void FixRveSettings::require_one_dimension(LAMMPS *lmp) const
{
  const auto grains = [](int d) { return d == 2 ? "disks" : "spheres"; };
  for (const std::string &file : packings)
    if (const int other = dimension_of(lmp, name(), file); other != dimension)
      lmp->error->all(
          FLERR,
          "{}: packing {} consists of {} and packing {} of {}; all packings of a fix must "
          "have the same kind of grains",
          name(), packings.front(), grains(dimension), file, grains(other));
}

FixRveSettings FixRveSettings::parse(LAMMPS *lmp, int narg, char **arg)
{
  FixRveSettings s;
  s.id = arg[0];
  ScriptArguments words(lmp, s.name(), narg, arg, 3);
  s.macro_step.most_copies = MOST_COPIES;
  s.packings.emplace_back(words.next("packing file"));
  s.dimension = dimension_of(lmp, s.name(), s.packings.front());
  s.read(words, false);
  s.require_one_dimension(lmp);
  s.check(lmp, s.name());
  return s;
}

FixRveSettings FixRveSettings::modified(LAMMPS *lmp, int narg, char **arg) const
{
  const std::string command = "fix_modify " + id;
  ScriptArguments words(lmp, command, narg, arg, 0);
  FixRveSettings s = *this;
  s.material = MaterialArguments();
  s.mass_scaling.reset();
  s.dt_given = false;
  s.read(words, true);
  s.check(lmp, command);
  return s;
}

void FixRveSettings::read(ScriptArguments &words, bool modifies)
{
  words.set_keywords(material_keywords());
  for (const FixRveKeyword &keyword : KEYWORDS)
    if (!modifies || !keyword.fixed) words.add_keywords({keyword.name});
  const auto refuse_fixed = [&]() {
    for (const FixRveKeyword &keyword : KEYWORDS)
      if (modifies && keyword.fixed && std::string_view(words.peek()) == keyword.name)
        words.refuse(fmt::format("{} cannot be changed: {}", words.next(), keyword.fixed));
  };
  for (refuse_fixed(); words.next_keyword(); refuse_fixed())
    if (!material.read(words)) words.read(KEYWORDS, *this);
}

void FixRveSettings::check(LAMMPS *lmp, const std::string &command) const
{
  const auto refuse = [&](const std::string &message) {
    lmp->error->all(FLERR, "{}: {}", command, message);
  };
  const bool has_drive = driver != RveDriver::None;
  const bool has_servo = !stress_goal.empty() || path.has_servo();
  const auto &adaptive = macro_step.adaptive;
  const double quiescent = macro_step.quiescent_strain;
  if (driver == RveDriver::Mpm && !stress_goal.empty())
    refuse("servo and drive mpm exclude each other");
  if (path.any() && (has_drive || !stress_goal.empty()))
    refuse(fmt::format(
        "path and {} exclude each other, because a path has rates and stresses of its own",
        has_drive ? "drive" : "servo"));
  if (!path.any() && (path.number_given || path.halts))
    refuse(fmt::format("{} requires a path", path.halts ? "path_end halt" : "path_variable"));
  if (adaptive && has_servo)
    refuse("substeps adaptive and servo exclude each other, because the strain of a step must be "
           "known before the step");
  if (quiescent > 0.0 && has_servo)
    refuse("quiescent and servo exclude each other, because a servo needs the stress of the grains "
           "in each step");
  if (adaptive && quiescent > 0.0 && quiescent < adaptive->strain_per_step)
    lmp->error->warning(
        FLERR,
        "{}: quiescent strain {} is less than the strain of one adaptive substep, {}, so that an "
        "RVE is active for a single step only; use a larger quiescent strain",
        command, rve::number(quiescent), rve::number(adaptive->strain_per_step));
  for (const auto &goal : stress_goal)
    for (const auto &rate : velocity_gradient)
      if (goal.row == rate.row && goal.column == rate.column)
        refuse(fmt::format("component {} is prescribed by both velocity_gradient and servo",
                           rve_component_name(goal.row, goal.column)));
  if (!choice.number.variable.empty() && choice.is_by_property())
    refuse(fmt::format("packing_variable and {} exclude each other",
                       choice.seed         ? "packing_random"
                           : choice.stress ? "packing_stress"
                                           : "packing_void_ratio"));
  for (const auto &goal : stress_goal)
    if (goal.row == goal.column && goal.value.variable.empty() && goal.value.constant > 0.0)
      refuse(fmt::format(
          "the goal of servo {} is {} [stress], which is a tension; grains without cohesion carry "
          "no tension. It must be at most 0, because stresses are negative in compression",
          rve_component_name(goal.row, goal.column), rve::number(goal.value.constant)));
  const int most = adaptive ? adaptive->most : substeps;
  const double steps = static_cast<double>(most) * steps_per_step();
  if (steps > MAXSMALLINT)
    refuse(fmt::format("{} DEM steps per LAMMPS step{}, times {} for a shadow, are {}; the limit "
                       "is {}: use fewer substeps or a lower refinement of shadow",
                       most, adaptive ? " (the most of substeps adaptive)" : "", steps_per_step(),
                       rve::number(steps), MAXSMALLINT));
}

std::map<std::string, std::string> FixRveSettings::account() const
{
  const auto &steps = macro_step;
  std::map<std::string, std::string> account;
  account["format"] = rve::to_string(options.format);
  account["arithmetic"] = word_of(rve::ARITHMETIC_CHOICES, options.arithmetic);
  account["arms"] = word_of(rve::ARM_CHOICES, options.arms);
  account["skin"] = options.skin > 0.0 ? rve::number(options.skin) : "automatic";
  account["overlap_limit"] = rve::number(options.overlap_limit);
  account["energy"] = options.track_energy ? "yes" : "no";
  account["policy"] = word_of(POLICIES, policy);
  account["copies"] = std::to_string(steps.most_copies);
  account["substeps"] = steps.adaptive
      ? fmt::format("adaptive {} {} {}", rve::number(steps.adaptive->strain_per_step),
                    rve::number(steps.adaptive->inertial_number), steps.adaptive->most)
      : substeps > 0 ? std::to_string(substeps)
                     : "match";
  account["quiescent"] = steps.quiescent_strain > 0.0 ? rve::number(steps.quiescent_strain)
                                                      : "none";
  account["stress"] = word_of(STRESS_CHOICES, steps.stress_from);
  if (steps.stress_from != StressFrom::End)
    account["stress"] += fmt::format(" {} {}", steps.stress_samples, steps.stress_spacing);
  account["shadow"] = num_shadows > 0 ? fmt::format("{} {}", num_shadows, steps.shadow_refinement)
                                      : "none";
  account["dt_check"] = std::to_string(dt_check_interval);
  account["path"] = path.text;
  return account;
}
