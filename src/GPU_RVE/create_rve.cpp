// SPDX-License-Identifier: GPL-2.0-only
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

#include "create_rve.h"

#include "lammps/collective_error.h"

#include "error.h"
#include "lammps/on_rank_zero.h"
#include "lammps/rve_settings.h"
#include "lammps/script_arguments.h"
#include "lammps/unit_styles.h"
#include "rve/core/error.h"
#include "rve/engine/files.h"
#include "rve/engine/grading.h"
#include "rve/engine/packing.h"
#include "rve/engine/packing_io.h"
#include "rve/engine/packing_recipe.h"

#include <algorithm>
#include <climits>
#include <functional>
#include <optional>
#include <string>
#include <vector>

using namespace LAMMPS_NS;

namespace {

// Largest number of grains in all packings of a library
constexpr bigint MOST_GRAINS = 100000000;
// For the limit MOST_GRAINS, a packing with fewer grains counts as this many grains.
constexpr int FEWEST_GRAINS = 100;

/// Parsed arguments of the command.
struct PackingRequest {
  std::string path;
  int dimension = 2;    ///< dimension of the grains: 2 for disks, 3 for spheres
  rve::PackingRecipe recipe;
  std::optional<rve::SizeChoice> sizes;    ///< without a value radii are uniform
  std::vector<double> pressures{0.0}, void_ratios, frictions;
  int num_seeds = 0;    ///< number of seeds of a library; 0 without the keyword seeds
  rve::Options options;
  bool skip = false;    ///< omit the packings of a library whose preparation fails

  bool is_library() const
  {
    return num_seeds > 0 || pressures.size() > 1 || void_ratios.size() > 1 || frictions.size() > 1;
  }
  bigint num_packings() const
  {
    return bigint(std::max<std::size_t>(1, frictions.size() + void_ratios.size())) *
        bigint(pressures.size()) * std::max(1, num_seeds);
  }
  /// Returns the recipes of a library, ordered by pressure, then by preparation goal (the
  /// frictions, then the void ratios, as the script gives them), then by seed.
  std::vector<rve::PackingRecipe> recipes() const
  {
    std::vector<rve::PackingRecipe> goals, all;
    for (const double friction : frictions) {
      goals.push_back(recipe);
      goals.back().preparation_friction = friction;
    }
    for (const double void_ratio : void_ratios) {
      goals.push_back(recipe);
      goals.back().void_ratio = void_ratio;
    }
    if (goals.empty()) goals.push_back(recipe);
    for (const double pressure : pressures)
      for (const auto &goal : goals)
        for (int k = 0; k < std::max(1, num_seeds); ++k) {
          all.push_back(goal);
          all.back().pressure = pressure;
          all.back().seed += k;
        }
    return all;
  }
};

const auto several_numbers = std::mem_fn(&ScriptArguments::numbers);

using Recipe = rve::PackingRecipe;

void read_radius(ScriptArguments &words, PackingRequest &request)
{
  enum class Radii { Uniform, Lognormal, PowerLaw };
  const auto radii = words.choice<Radii>("",
                                         {{"uniform", Radii::Uniform},
                                          {"lognormal", Radii::Lognormal},
                                          {"power_law", Radii::PowerLaw}});
  const double median = radii == Radii::Lognormal ? words.number("median") : 0.0;
  const double sigma = radii == Radii::Lognormal ? words.number("sigma") : 0.0;
  const double exponent = radii == Radii::PowerLaw ? words.number("exponent") : 0.0;
  const double lo = words.number("lo"), hi = words.number("hi");
  if (radii == Radii::Uniform) {
    request.recipe.radius_min = lo;
    request.recipe.radius_max = hi;
  } else if (radii == Radii::Lognormal) {
    request.sizes = rve::LognormalRadii{median, sigma, lo, hi};
  } else {
    request.sizes = rve::PowerLawRadii{exponent, lo, hi};
  }
}

void read_grading(ScriptArguments &words, PackingRequest &request)
{
  const std::vector<double> list = words.numbers();
  if (list.size() % 2 != 0)
    words.refuse(fmt::format("grading has {} numbers; it must have pairs of a diameter and the "
                             "percent passing",
                             list.size()));
  rve::GradingCurve curve;
  for (std::size_t k = 0; k < list.size(); k += 2) curve.push_back({list[k], list[k + 1]});
  request.sizes = curve;
}

const ScriptKeyword<PackingRequest> KEYWORDS[] = {
    {"shape", "disk | sphere",
     into(one_of<int>({{"disk", 2}, {"sphere", 3}}), &PackingRequest::dimension)},
    {"grains", "N", into(integer(INT_MIN), &PackingRequest::recipe, &Recipe::num_grains)},
    {"seed", "N",
     [](ScriptArguments &words, PackingRequest &request) {
       request.recipe.seed = words.whole("", 0, MAXBIGINT);
     }},
    {"seeds", "first N",
     [](ScriptArguments &words, PackingRequest &request) {
       request.recipe.seed = words.whole("first", 0, MAXBIGINT);
       request.num_seeds = words.integer("number", 1);
     }},
    {"radius", "uniform lo hi | lognormal median sigma lo hi | power_law exponent lo hi",
     read_radius},
    {"grading", "d1 p1 d2 p2 ...", read_grading},
    {"pressure", "value ...", into(several_numbers, &PackingRequest::pressures)},
    {"k0", "value | rest",
     [](ScriptArguments &words, PackingRequest &request) {
       request.recipe.at_rest = words.take("rest");
       if (!request.recipe.at_rest) request.recipe.k0 = words.number();
     }},
    {"void_ratio", "value ...", into(several_numbers, &PackingRequest::void_ratios)},
    {"friction_prep", "value ...", into(several_numbers, &PackingRequest::frictions)},
    {"void_ratio_tolerance", "value",
     into(any_number, &PackingRequest::recipe, &Recipe::void_ratio_tolerance)},
    {"damping_prep", "value",
     into(any_number, &PackingRequest::recipe, &Recipe::preparation_damping)},
    {"tolerance", "value",
     [](ScriptArguments &words, PackingRequest &request) {
       request.recipe.stress_tolerance = request.recipe.unbalanced_tolerance = words.number();
     }},
    {"format", "fast | mixed | double | single",
     into(one_of(rve::FORMAT_CHOICES), &PackingRequest::options, &rve::Options::format)},
    {"threads", "N", into(integer(INT_MIN), &PackingRequest::options, &rve::Options::threads)},
    {"device", "auto | cpu | cuda",
     into(one_of(rve::DEVICE_CHOICES), &PackingRequest::options, &rve::Options::device)},
    {"policy", "stop | skip",
     into(one_of<bool>({{"stop", false}, {"skip", true}}), &PackingRequest::skip)}};

PackingRequest parse(LAMMPS *lmp, int narg, char **arg)
{
  Error *error = lmp->error;
  ScriptArguments words(lmp, "create_rve", narg, arg, 0);
  PackingRequest request;
  rve::PackingRecipe &recipe = request.recipe;
  MaterialArguments material;
  request.path = words.next("file");
  words.set_keywords(material_keywords());
  words.add_keywords(names_of(KEYWORDS));
  while (words.next_keyword())
    if (!material.read(words)) words.read(KEYWORDS, request);
  if (words.has("seed") && words.has("seeds"))
    error->all(FLERR, "create_rve: seed and seeds exclude each other");
  if (words.has("radius") && words.has("grading"))
    error->all(FLERR,
               "create_rve: radius and grading exclude each other; both give sizes of grains");
  std::vector<std::string> missing;
  for (const std::string needed : {"radius", "kn", "density", "pressure"})
    if (!words.has(needed) && !(needed == "kn" && words.has("contact")) &&
        !(needed == "radius" && words.has("grading")))
      missing.push_back(needed);
  if (!missing.empty())
    error->all(FLERR, "create_rve: {} must be given", utils::join_words(missing, ", "));

  for (const char *of_disks : {"thickness", "mass_depth"})
    if (request.dimension == 3 && words.has(of_disks))
      error->all(FLERR, "create_rve: spheres have no {}; it is for shape disk", of_disks);

  // kt has the value of kn unless it is given
  std::optional<double> &kt = material[&rve::Material::tangential_stiffness];
  if (!kt) kt = material[&rve::Material::normal_stiffness];
  material.apply(recipe.material);
  request.options.contacts = rve::contacts_of(recipe.material);
  request.options.contacts.dimension = request.dimension;
  if (request.is_library()) {
    // all packings and the text of their file are in memory at the same time
    const bigint most = MOST_GRAINS / std::max(recipe.num_grains, FEWEST_GRAINS);
    if (request.num_packings() > most)
      error->all(FLERR,
                 "create_rve: a library of {} packings with {} grains each is too large; the limit "
                 "is {} packings of this size, {} grains in total, which take tens of GB: use "
                 "fewer seeds, or make several libraries",
                 request.num_packings(), recipe.num_grains, most, MOST_GRAINS);
    return request;
  }

  if (!request.void_ratios.empty() && !request.frictions.empty() && request.frictions[0] > 0.0)
    error->all(FLERR,
               "create_rve: void_ratio and friction_prep exclude each other, because void_ratio "
               "determines friction_prep");
  if (request.skip)
    error->all(FLERR,
               "create_rve: policy skip is for libraries only; give seeds, or several values of "
               "pressure, void_ratio or friction_prep");
  recipe.pressure = request.pressures[0];
  if (!request.void_ratios.empty()) recipe.void_ratio = request.void_ratios[0];
  if (!request.frictions.empty()) recipe.preparation_friction = request.frictions[0];
  // One RVE runs on one CPU thread, so further threads do not help, and a GPU needs many RVEs.
  if (!words.has("device")) request.options.device = rve::Device::Cpu;
  if (!words.has("threads")) request.options.threads = 1;
  return request;
}

/// Writes a line to the screen and the log file, and flushes them, so that no line is lost if the
/// program is killed.
void log_line(LAMMPS *lmp, const std::string &line)
{
  utils::logmesg(lmp, line);
  utils::flush_buffers(lmp);
}

/// Warns of large overlaps at the highest of the pressures.
template <int D> void warn_of_overlap(LAMMPS *lmp, const PackingRequest &request)
{
  rve::PackingRecipe recipe = request.recipe;
  recipe.pressure = *std::max_element(request.pressures.begin(), request.pressures.end());
  const double strain = rve::contact_strain<D>(recipe);
  // a strain above LARGEST_CONTACT_STRAIN ends with an error when the packings are generated
  if (strain <= rve::SMALL_CONTACT_STRAIN || strain > rve::LARGEST_CONTACT_STRAIN) return;
  const double kn = recipe.material.normal_stiffness;
  // pressure times this depth is a force per length, which is compared with kn
  const double depth = D == 2 ? recipe.material.thickness : 2.0 * rve::mean_radius(recipe);
  const bool is_linear = recipe.material.law == rve::ContactLaw::Linear;
  const std::string why = is_linear
      ? fmt::format(", pressure {} [stress] * {} {} [length] / kn {} [force/length]",
                    rve::number(recipe.pressure), D == 2 ? "thickness" : "diameter",
                    rve::number(depth), rve::number(kn))
      : "";
  const std::string remedy = is_linear
      ? "kn of at least " + rve::number(recipe.pressure * depth / rve::SMALL_CONTACT_STRAIN)
      : "stiffer grains";
  lmp->error->warning(
      FLERR,
      "create_rve: grains will overlap by about {} of their diameter{}; above {} a packing is "
      "softer and denser than one of stiff grains: use {}, or a smaller pressure{}",
      rve::number(strain), why, rve::SMALL_CONTACT_STRAIN, remedy, D == 2 ? " or thickness" : "");
}

/// Sets the sizes of the grains of a grading curve or a distribution, and logs them. Warns if there
/// are fewer grains than the distribution needs.
template <int D> void set_sizes(LAMMPS *lmp, PackingRequest &request)
{
  if (!request.sizes) return;
  using Sizes = rve::SizeDistribution;
  const rve::SizeReport report = rve::set_sizes<D>(request.recipe, *request.sizes);
  const std::string rule = fmt::format(
      "{} in the coarsest tenth of the mass, and a cell {} of the largest diameters wide",
      Sizes::FEWEST_COARSE, rve::number(Sizes::WIDTH_OF_CELL));
  log_line(lmp,
           fmt::format("create_rve {}: {} grains with diameters from {} to {} [length] (ratio {}), "
                       "{} of them in the coarsest tenth of the mass; the distribution needs {} "
                       "grains\n",
                       request.path, report.grains, rve::rounded(report.smallest),
                       rve::rounded(report.largest), rve::rounded(report.largest / report.smallest),
                       report.coarse, report.needed));
  if (report.cut_percent > 0.0)
    log_line(lmp,
             fmt::format("create_rve {}: fines below {} [length], {} % of the mass, are cut off\n",
                         request.path, rve::rounded(report.cut_diameter),
                         rve::rounded(report.cut_percent)));
  if (report.grains < report.needed)
    lmp->error->warning(FLERR,
                        "create_rve: {} grains represent the distribution of sizes poorly; use at "
                        "least {} grains ({})",
                        report.grains, report.needed, rule);
}

/// Returns the grading of a packing for the log.
template <int D> std::string grading_words(const rve::RveStateOf<D> &state)
{
  const rve::Grading grading = rve::grading_of(state.radius, D);
  return fmt::format("d10 {}, d50 {}, d60 {} [length] by mass, coefficient of uniformity {}",
                     rve::rounded(grading.d10), rve::rounded(grading.d50),
                     rve::rounded(grading.d60), rve::rounded(grading.uniformity()));
}

template <int D>
void make_packing(LAMMPS *lmp, const PackingRequest &request, rve::EngineOf<D> &engine)
{
  log_line(lmp,
           fmt::format("create_rve {}: {} grains, seed {}, {}\n", request.path,
                       request.recipe.num_grains, request.recipe.seed, engine.description()));
  int lines = 0;
  double k0 = 1.0;
  const auto progress = [&](const rve::PackingReport &r) {
    k0 = r.k0;
    if (lines++ == 0)
      utils::logmesg(lmp, "{:>10} {:>17} {:>8} {:>12} {:>10} {:>12} {:>10}\n", "step", "phase",
                     "friction", "pressure", "void_ratio", "coordination", "unbalanced");
    log_line(lmp,
             fmt::format("{:>10} {:>17} {:>8.4f} {:>12.5g} {:>10.5f} {:>12.4f} {:>10.3g}\n", r.step,
                         r.phase, r.preparation_friction, r.pressure + 0.0, r.void_ratio,
                         r.coordination_number, r.unbalanced_ratio));
  };
  const rve::RveStateOf<D> state = rve::generate_packing(request.recipe, engine, progress);
  rve::write_packing(request.path, state);
  utils::logmesg(
      lmp, "create_rve {}: written, void ratio {:.5f}{}\n", request.path, state.void_ratio(),
      request.recipe.at_rest ? fmt::format(", lateral over vertical stress {:.4f}", k0) : "");
  utils::logmesg(lmp, "create_rve {}: {}\n", request.path, grading_words<D>(state));
}

/// Prepares all packings in one batch, and logs a line for each packing that is ready.
template <int D>
void make_library(LAMMPS *lmp, const PackingRequest &request, rve::EngineOf<D> &engine)
{
  const std::vector<rve::PackingRecipe> recipes = request.recipes();
  log_line(lmp,
           fmt::format("create_rve {}: library of {} packings, {} grains each, {}\n", request.path,
                       recipes.size(), request.recipe.num_grains, engine.description()));
  const bool has_stresses = request.pressures.size() > 1 || request.recipe.at_rest;
  std::size_t num_ready = 0;
  const auto progress = [&](std::size_t k, const rve::PackingReport &report,
                            const rve::PreparedPackingOf<D> &packing) {
    if (!packing.ready()) return;
    if (num_ready++ == 0)
      utils::logmesg(lmp, "{:>7} {:>12} {:>8} {:>10} {:>8} {:>10}{}\n", "ready", "seed", "friction",
                     "overcons.", "steps", "void_ratio",
                     has_stresses ? fmt::format(" {:>12} {:>8}", "pressure", "k0") : "");
    log_line(lmp,
             fmt::format("{:>7} {:>12} {:>8.4f} {:>10.4g} {:>8} {:>10.5f}{}\n", num_ready,
                         recipes[k].seed, packing.preparation_friction,
                         packing.overconsolidation_ratio, report.step, packing.state.void_ratio(),
                         has_stresses
                             ? fmt::format(" {:>12.5g} {:>8.4f}", recipes[k].pressure, packing.k0)
                             : ""));
  };
  std::vector<rve::PreparedPackingOf<D>> packings =
      rve::generate_packings(recipes, engine, progress);

  rve::PackingLibraryOf<D> library;
  std::string failures;
  for (std::size_t k = 0; k < packings.size(); ++k) {
    rve::PreparedPackingOf<D> &packing = packings[k];
    const rve::PackingRecipe &recipe = recipes[k];
    if (packing.ready()) {
      const rve::LibraryRow row{recipe.seed,
                                packing.state.void_ratio(),
                                packing.preparation_friction,
                                packing.overconsolidation_ratio,
                                recipe.pressure,
                                packing.state.num_grains()};
      library.add(row, std::move(packing.state));
    } else {
      const std::string pressure =
          request.pressures.size() > 1 ? ", pressure " + rve::number(recipe.pressure) : "";
      failures += fmt::format("\n  seed {}{}: {}", recipe.seed, pressure, packing.failure);
    }
  }
  if (!failures.empty()) {
    const std::string message =
        fmt::format("{} of {} packings cannot be prepared:{}",
                    packings.size() - library.packings.size(), packings.size(), failures);
    rve::require(request.skip && !library.packings.empty(), message);
    lmp->error->warning(FLERR, "create_rve: {}", message);
  }
  rve::write_library(request.path, library);
  const auto [least, most] =
      std::minmax_element(library.index.begin(), library.index.end(),
                          [](const auto &a, const auto &b) { return a.void_ratio < b.void_ratio; });
  utils::logmesg(lmp, "create_rve {}: written, {} packings, void ratios from {:.5f} to {:.5f}\n",
                 request.path, library.packings.size(), least->void_ratio, most->void_ratio);
  // all packings have the same grains
  if (request.sizes)
    utils::logmesg(lmp, "create_rve {}: {}\n", request.path,
                   grading_words<D>(library.packings.front()));
}

template <int D> void make(LAMMPS *lmp, PackingRequest &request)
{
  set_sizes<D>(lmp, request);
  warn_of_overlap<D>(lmp, request);
  std::string notice;
  const auto engine = rve::make_engine<D>(request.options, &notice);
  if (!notice.empty()) utils::logmesg(lmp, "create_rve: {}\n", notice);
  if (request.is_library())
    make_library(lmp, request, *engine);
  else
    make_packing(lmp, request, *engine);
}

}    // namespace

/// Rank 0 generates the packings while the other ranks wait, so that a packing does not depend on
/// the number of ranks.
void CreateRve::command(int narg, char **arg)
{
  require_mechanical_units(lmp, "create_rve");
  PackingRequest request;
  collectively(lmp, "create_rve", [&] { request = parse(lmp, narg, arg); });
  request.options.log = [this](const std::string &line) {
    log_line(lmp, "create_rve: " + line + "\n");
  };

  const std::string failure = on_rank_zero(world, [&]() {
    rve::require_writable(request.path);    // check the path before the long work
    if (request.dimension == 2)
      make<2>(lmp, request);
    else
      make<3>(lmp, request);
  });
  if (!failure.empty()) error->all(FLERR, "create_rve: {}", failure);
}
