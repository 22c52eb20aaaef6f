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

#include "mpm_settings.h"

#include "mpm/law_table.h"
#include "progress.h"
#include "rank_resources.h"
#include "rve/core/error.h"

#include "domain.h"
#include "error.h"
#include "group.h"
#include "lammps.h"
#include "utils.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;

namespace {

constexpr double LARGEST =
    1e30;    // of any number: products of two, and sums of many, are still numbers

constexpr double MAX_COURANT =
    10.0;    // the estimate for RVEs is an upper bound, if no larger one than that

/// What keywords refer to: *face* and *separation* to the load or body before them.
struct Said {
  LAMMPS *lmp;
  MpmSettings &settings;
  mpm::SolverOptions<2> &options = settings.options;
  mpm::Face *face = nullptr;
  std::string owner{};
};

mpm::Face read_side(ScriptWords &words)
{
  return words.choice<mpm::Face>("",
                                 {{"xlo", mpm::Face::XLo},
                                  {"xhi", mpm::Face::XHi},
                                  {"ylo", mpm::Face::YLo},
                                  {"yhi", mpm::Face::YHi}});
}

void read_boundary(ScriptWords &words, Said &said)
{
  const std::string side = words.peek();
  mpm::SideKind &kind = said.options.sides[(int) read_side(words)];
  words.about("boundary " + side);
  kind = words.choice<mpm::SideKind>(side,
                                     {{"free", mpm::SideKind::Free},
                                      {"roller", mpm::SideKind::Roller},
                                      {"fixed", mpm::SideKind::Fixed}});
}

void read_model(ScriptWords &words, Said &said)
{
  std::string form = "group-ID rve fix-ID";    // or a law of the table
  rve::Words choices = {"rve"};
  for (const mpm::LawEntry<2> &entry : mpm::law_table<2>()) {
    form += " | " + entry.word + " " + utils::join_words(entry.arguments, " ");
    choices.emplace_back(entry.word);
  }
  words.set_form(form);
  MpmModel model;
  model.group = words.peek();
  model.groupbit = words.groupbit("group");
  words.about("model " + model.group);
  const int choice = words.choice("law", choices);
  model.word = choices[choice];
  if (choice == 0) {
    model.fix_rve = words.next("rve fix ID");
  } else {
    const mpm::LawEntry<2> &entry = mpm::law_table<2>()[choice - 1];
    std::vector<double> arguments;
    for (const std::string &name : entry.arguments)
      arguments.push_back(words.number(entry.word + " " + name));
    model.law = entry.make(arguments.data());
  }
  said.settings.models.push_back(model);
}

void read_density(ScriptWords &words, Said &said)
{
  said.settings.density = 0.0;
  if (words.take("rve")) return;
  said.settings.density = words.number();
  if (!(said.settings.density > 0.0))
    words.refuse(fmt::format("density is {} [mass/length^3]; it must be greater than 0, or rve",
                             rve::number(said.settings.density)));
}

/// The area of a point, or how many share a cell: two ways to say the same.
void read_volume(ScriptWords &words, Said &said)
{
  const bool is_share = words.keyword() == "points_per_cell";
  words.about("volume");
  const double given = words.positive("", is_share ? "[-]" : "[length^2]");
  const double cell = said.options.cell_size * said.options.cell_size;
  said.settings.initial_volume = is_share ? cell / given : given;
}

void read_rigid(ScriptWords &words, Said &said)
{
  MpmRigidBody body;
  mpm::RigidBodyOptions how;
  body.group = words.peek();
  body.groupbit = words.groupbit("group");
  said.owner = "rigid " + body.group;
  words.about(said.owner);
  const char *components[] = {"vx", "vy"};
  for (int a = 0; a < 2; a++) {
    if (!words.take(components[a]))
      words.refuse(fmt::format("rigid has '{}' where {} must be; it must read: rigid group-ID vx "
                               "value vy value rough | smooth",
                               words.next(components[a]), components[a]));
    body.velocity[a] = words.value(components[a]);
  }
  how.rough = words.choice<bool>("contact", {{"smooth", false}, {"rough", true}});
  said.settings.bodies.push_back(body);
  said.options.rigid_bodies.push_back(how);
  said.options.rigid_body_names.push_back(body.group);
  said.face = &said.options.rigid_bodies.back().face;
}

void read_separation(ScriptWords &words, Said &said)
{
  if (said.options.rigid_bodies.empty()) words.refuse("separation must follow a rigid body");
  words.about(said.owner + " separation");
  said.options.rigid_bodies.back().separation = words.logical();
}

/// Several loads may be on the same points.
void read_traction(ScriptWords &words, Said &said)
{
  MpmTraction load;
  load.id = words.peek();
  const bool is_region =
      said.lmp->domain->get_region_by_id(load.id) && said.lmp->group->find(load.id) < 0;
  if (is_region) words.next();
  load.groupbit = is_region ? 0 : words.groupbit("group");
  words.about("traction " + load.id, true);
  for (int a = 0; a < 2; a++) load.traction[a] = words.value(a == 0 ? "tx" : "ty");
  said.settings.tractions.push_back(load);
  said.face = &said.settings.tractions.back().face;
  said.owner = fmt::format("traction {} number {}", load.id, said.settings.tractions.size());
}

void read_face(ScriptWords &words, Said &said)
{
  if (!said.face) words.refuse("face must follow a traction or a rigid body");
  words.about(said.owner + " face");
  *said.face = read_side(words);
}

void read_cfl(ScriptWords &words, Said &said)
{
  MpmSettings &s = said.settings;
  s.courant_warn = words.number("warn");
  s.courant_error = words.number("error");
  if (!(s.courant_warn > 0.0 && s.courant_error >= s.courant_warn &&
        s.courant_error <= MAX_COURANT))
    words.refuse(fmt::format("cfl must have 0 < warn <= error <= {:g}, got {} {}; above 1 a step "
                             "is unstable",
                             MAX_COURANT, rve::number(s.courant_warn),
                             rve::number(s.courant_error)));
}

constexpr ScriptKeyword<Said> KEYWORDS[] = {
    {"domain", "xlo xhi ylo yhi",
     [](ScriptWords &words, Said &said) {
       mpm::SolverOptions<2> &options = said.options;
       for (int a = 0; a < 2; a++) {
         options.lo[a] = words.number(a == 0 ? "xlo" : "ylo");
         options.hi[a] = words.number(a == 0 ? "xhi" : "yhi");
       }
     }},
    {"shape", "linear | gimp",
     [](ScriptWords &words, Said &said) {
       said.options.shape = words.choice<mpm::ShapeFunction>(
           "", {{"linear", mpm::ShapeFunction::Linear}, {"gimp", mpm::ShapeFunction::Gimp}});
     }},
    {"scheme", "musl | usavg",
     [](ScriptWords &words, Said &said) {
       said.options.scheme = words.choice<mpm::Scheme>(
           "", {{"musl", mpm::Scheme::Musl}, {"usavg", mpm::Scheme::Usavg}});
     }},
    {"flip", "share",
     [](ScriptWords &words, Said &said) {
       said.options.flip = words.number();
     }},
    {"damping", "value",
     [](ScriptWords &words, Said &said) {
       said.options.damping = words.number();
     }},
    {"device", "auto | cpu | cuda",
     [](ScriptWords &words, Said &said) {
       said.options.device = words.choice<mpm::Device>(
           "",
           {{"auto", mpm::Device::Auto}, {"cpu", mpm::Device::Cpu}, {"cuda", mpm::Device::Cuda}});
     }},
    {"boundary", "xlo | xhi | ylo | yhi free | roller | fixed", read_boundary},
    {"model", "group-ID rve fix-ID | law ...", read_model},
    {"column", "name",
     [](ScriptWords &words, Said &said) {
       said.settings.columns.emplace_back(words.next());
       words.about("column " + said.settings.columns.back());
     }},
    {"density", "value | rve", read_density},
    {"stress", "sxx syy sxy",
     [](ScriptWords &words, Said &said) {
       const double xx = words.number("sxx"), yy = words.number("syy"), xy = words.number("sxy");
       said.settings.initial_stress = {{xx, xy, xy, yy}};
     }},
    {"volume", "value", read_volume},
    {"points_per_cell", "value", read_volume},
    {"rigid", "group-ID vx value vy value rough | smooth", read_rigid},
    {"separation", "yes | no", read_separation},
    {"traction", "ID tx ty", read_traction},
    {"face", "xlo | xhi | ylo | yhi", read_face},
    {"cfl", "warn error", read_cfl},
    {"progress", "seconds", [](ScriptWords &words, Said &said) {
       said.settings.progress_interval = read_progress(words);
     }}};

}    // namespace

MpmSettings MpmSettings::parse(LAMMPS *lmp, int narg, char **arg)
{
  ScriptWords words(lmp, "Fix mpm", narg, arg, 3);
  words.limit_numbers(LARGEST);
  MpmSettings settings;
  mpm::SolverOptions<2> &options = settings.options;
  settings.words.emplace_back("cell size", words.peek());
  options.cell_size = words.positive("cell size", "[length]");
  options.lo = {{lmp->domain->boxlo[0], lmp->domain->boxlo[1]}};
  options.hi = {{lmp->domain->boxhi[0], lmp->domain->boxhi[1]}};
  settings.initial_volume = options.cell_size * options.cell_size;
  const RankResources share(lmp->world);
  options.threads = share.threads();
  options.device = mpm::Device::Auto;
  options.device_number = share.rank;

  words.set_keywords(names_of(KEYWORDS));
  try {
    Said said{lmp, settings};
    while (words.next_keyword()) words.read(KEYWORDS, said);
    const double half = 0.5 * std::sqrt(settings.initial_volume);
    if (half > 0.5 * options.cell_size * (1.0 + 1e-6))
      lmp->error->all(
          FLERR, "Fix mpm volume of a point must be in (0, {}] (one cell), got {} [distance^2]",
          options.cell_size * options.cell_size, settings.initial_volume);
  } catch (const rve::InputError &problem) {
    lmp->error->all(FLERR, "Fix mpm: {}", problem.what());
  }
  for (const auto &given : words.given())
    settings.words.emplace_back(given.subject,
                                given.keyword == "points_per_cell"
                                    ? fmt::format("{:.17g}", settings.initial_volume)
                                    : given.values);
  return settings;
}

void MpmSettings::find(LAMMPS *lmp)
{
  // groups may be deleted, and their bits be those of others
  const auto check_group = [lmp](const char *keyword, const std::string &name, int bit) {
    const int found = lmp->group->find(name);
    if (found < 0)
      lmp->error->all(FLERR, "Fix mpm {}: group '{}' has been deleted since the fix was defined",
                      keyword, name);
    if (lmp->group->bitmask[found] != bit)
      lmp->error->all(FLERR,
                      "Fix mpm {}: group '{}' has been deleted and defined anew since the fix was "
                      "defined; define the fix after its groups",
                      keyword, name);
    return found;
  };
  for (const auto &body : bodies) check_group("rigid", body.group, body.groupbit);
  for (const auto &model : models) check_group("model", model.group, model.groupbit);
  for (const auto &load : tractions)
    if (load.groupbit) {
      const int found = check_group("traction", load.id, load.groupbit);
      if (lmp->group->count(found) == 0)
        lmp->error->all(FLERR, "Fix mpm traction: group '{}' has no atoms", load.id);
    }
  for (auto &body : bodies)
    for (auto &velocity : body.velocity) velocity.find(lmp, "Fix mpm", false);
  for (auto &load : tractions) {
    for (auto &component : load.traction) component.find(lmp, "Fix mpm", false);
    if (!load.groupbit && !lmp->domain->get_region_by_id(load.id))
      lmp->error->all(FLERR, "Fix mpm traction: region '{}' does not exist", load.id);
  }
}

std::string LAMMPS_NS::mpm_differences(const MpmWords &then, const MpmWords &now, bool of_points)
{
  // have no influence on results
  const auto is_aside = [](const std::string &about) {
    return about == "device" || about == "progress" || about == "cfl" ||
        about.rfind("column ", 0) == 0;
  };
  const auto is_of_points = [](const std::string &about) {
    return about == "volume" || about == "density" || about == "stress";
  };
  // the values of one keyword, of all loads on the same points together
  const auto said = [](const MpmWords &words, const std::string &about) {
    std::string all;
    for (const auto &[other, values] : words)
      if (other == about) all += (all.empty() ? "" : ", ") + values;
    return all.empty() ? std::string("not given") : all;
  };
  // word by word, numbers by their value
  const auto is_same = [](const std::string &one, const std::string &other) {
    const std::vector<std::string> a = utils::split_words(one), b = utils::split_words(other);
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto &x, const auto &y) {
      return utils::is_double(x) && utils::is_double(y) ? std::stod(x) == std::stod(y) : x == y;
    });
  };
  std::vector<std::string> keys;
  for (const MpmWords *words : {&then, &now})
    for (const auto &one : *words)
      if (std::find(keys.begin(), keys.end(), one.first) == keys.end()) keys.push_back(one.first);
  std::string text;
  for (const std::string &key : keys) {
    if (is_aside(key) || is_of_points(key) != of_points) continue;
    const std::string before = said(then, key), after = said(now, key);
    if (!is_same(before, after))
      text += (text.empty() ? "" : ", ") + key + " " + before + " -> " + after;
  }
  return text;
}
