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
#include "rank_resources.h"
#include "rve/core/suggestion.h"

#include "domain.h"
#include "error.h"
#include "group.h"
#include "input.h"
#include "lammps.h"
#include "utils.h"
#include "variable.h"

#include <algorithm>
#include <cmath>
#include <cstring>

using namespace LAMMPS_NS;

namespace {

constexpr double LARGEST =
    1e30;    // of any number: products of two, and sums of many, are still numbers
const rve::Words KEYWORDS = {
    "domain",   "shape",   "scheme", "flip",     "damping",         "device", "boundary",
    "model",    "density", "stress", "volume",   "points_per_cell", "rigid",  "separation",
    "traction", "face",    "cfl",    "progress", "column"};

constexpr double MAX_COURANT =
    10.0;    // the estimate for RVEs is an upper bound, if no larger one than that

}    // namespace

MpmSettings MpmSettings::parse(LAMMPS *lmp, int narg, char **arg)
{
  if (narg < 4) utils::missing_cmd_args(FLERR, "fix mpm", lmp->error);
  MpmSettings settings;
  mpm::SolverOptions &options = settings.options;
  options.cell_size = utils::numeric(FLERR, arg[3], false, lmp);
  if (!(options.cell_size > 0.0 && options.cell_size <= LARGEST))
    lmp->error->all(FLERR, "Fix mpm cell size must be > 0 and at most {:g} [distance], got {}",
                    LARGEST, arg[3]);
  options.lo = {{lmp->domain->boxlo[0], lmp->domain->boxlo[1]}};
  options.hi = {{lmp->domain->boxhi[0], lmp->domain->boxhi[1]}};
  settings.initial_volume = options.cell_size * options.cell_size;
  const RankResources share(lmp->world);
  options.threads = share.threads();
  options.device = mpm::Device::Auto;
  options.device_number = share.rank;

  mpm::Face *face = nullptr;    // of the last load or body
  std::string owner;            // that load or body
  int iarg = 4;
  const auto need = [&](int n) {
    if (iarg + n >= narg)
      utils::missing_cmd_args(FLERR, std::string("fix mpm ") + arg[iarg], lmp->error);
  };
  const auto number = [&](int k) {
    if (!utils::is_double(arg[iarg + k]))
      lmp->error->all(FLERR, "Fix mpm {}: '{}' must be a number", arg[iarg], arg[iarg + k]);
    const double given = utils::numeric(FLERR, arg[iarg + k], false, lmp);
    if (!(std::fabs(given) <= LARGEST))
      lmp->error->all(FLERR, "Fix mpm {}: numbers must be from {:g} to {:g}, got {}", arg[iarg],
                      -LARGEST, LARGEST, arg[iarg + k]);
    return given;
  };
  const auto value = [&](int k) {
    MpmValue v;
    if (utils::strmatch(arg[iarg + k], "^v_"))
      v.variable = arg[iarg + k] + 2;
    else if (lmp->input->variable->find(arg[iarg + k]) >= 0)
      lmp->error->all(FLERR, "Fix mpm {}: '{}' must be a number or v_name; did you mean v_{}?",
                      arg[iarg], arg[iarg + k], arg[iarg + k]);
    else
      v.number = number(k);
    return v;
  };
  const auto groupbit_of = [&](int k) {
    const int found = lmp->group->find(arg[iarg + k]);
    if (found < 0) {
      rve::Words groups;
      for (int g = 0; g < 32; g++)    // as many as a mask has bits
        if (lmp->group->names[g]) groups.emplace_back(lmp->group->names[g]);
      lmp->error->all(FLERR, "Fix mpm {}: group '{}' does not exist{}", arg[iarg], arg[iarg + k],
                      rve::did_you_mean(arg[iarg + k], groups, "there are"));
    }
    return lmp->group->bitmask[found];
  };
  const auto side = [&](int k) {
    const std::string word = arg[iarg + k];
    if (word == "xlo") return mpm::Face::XLo;
    if (word == "xhi") return mpm::Face::XHi;
    if (word == "ylo") return mpm::Face::YLo;
    if (word != "yhi")
      lmp->error->all(FLERR, "Fix mpm {} must be xlo, xhi, ylo or yhi, got '{}'", arg[iarg], word);
    return mpm::Face::YHi;
  };
  const auto one_of = [&](int k, const std::vector<std::string> &words) {
    for (std::size_t w = 0; w < words.size(); w++)
      if (words[w] == arg[iarg + k]) return (int) w;
    std::string allowed;
    for (const auto &word : words) allowed += (allowed.empty() ? "" : " or ") + word;
    lmp->error->all(FLERR, "Fix mpm {} must be {}, got '{}'", arg[iarg], allowed, arg[iarg + k]);
    return 0;
  };

  // about: the key of a keyword, which must not occur again unless many may
  const auto say = [&](const std::string &about, const std::string &values, bool again = false) {
    const auto same = [&](const auto &said) {
      return said.first == about;
    };
    if (!again && std::any_of(settings.words.begin(), settings.words.end(), same))
      lmp->error->all(FLERR, "Fix mpm: {} is given twice", about);
    settings.words.emplace_back(about, values);
  };
  say("cell size", arg[3]);
  std::string last;    // keyword, and its values

  try {
    while (iarg < narg) {
      const std::string word = arg[iarg];
      const int first = iarg;
      if (word == "domain") {
        need(4);
        options.lo = {{number(1), number(3)}};
        options.hi = {{number(2), number(4)}};
        iarg += 5;
      } else if (word == "shape") {
        need(1);
        options.shape = one_of(1, {"linear", "gimp"}) ? mpm::ShapeFunction::Gimp
                                                      : mpm::ShapeFunction::Linear;
        iarg += 2;
      } else if (word == "scheme") {
        need(1);
        options.scheme = one_of(1, {"musl", "usavg"}) ? mpm::Scheme::Usavg : mpm::Scheme::Musl;
        iarg += 2;
      } else if (word == "flip") {
        need(1);
        options.flip = number(1);
        iarg += 2;
      } else if (word == "damping") {
        need(1);
        options.damping = number(1);
        iarg += 2;
      } else if (word == "device") {
        need(1);
        constexpr mpm::Device DEVICES[] = {mpm::Device::Auto, mpm::Device::Cpu, mpm::Device::Cuda};
        options.device = DEVICES[one_of(1, {"auto", "cpu", "cuda"})];
        iarg += 2;
      } else if (word == "boundary") {
        need(2);
        constexpr mpm::SideKind KINDS[] = {mpm::SideKind::Free, mpm::SideKind::Roller,
                                           mpm::SideKind::Fixed};
        options.sides[(int) side(1)] = KINDS[one_of(2, {"free", "roller", "fixed"})];
        iarg += 3;
      } else if (word == "model") {
        need(3);
        MpmModel model;
        model.group = arg[iarg + 1];
        model.groupbit = groupbit_of(1);
        std::vector<std::string> words = {"rve"};
        for (const mpm::LawEntry &entry : mpm::law_table()) words.push_back(entry.word);
        const int choice = one_of(2, words);
        model.word = words[choice];
        if (choice == 0) {
          model.fix_rve = arg[iarg + 3];
          iarg += 4;
        } else {
          const mpm::LawEntry &entry = mpm::law_table()[choice - 1];
          const int count = (int) entry.arguments.size();
          need(2 + count);
          std::vector<double> arguments;
          for (int k = 0; k < count; k++) arguments.push_back(number(3 + k));
          model.law = entry.make(arguments.data());
          iarg += 3 + count;
        }
        settings.models.push_back(model);
      } else if (word == "column") {
        need(1);
        settings.columns.emplace_back(arg[iarg + 1]);
        iarg += 2;
      } else if (word == "density") {
        need(1);
        const bool of_rve = strcmp(arg[iarg + 1], "rve") == 0;
        settings.density = of_rve ? 0.0 : number(1);
        if (!of_rve && !(settings.density > 0.0))
          lmp->error->all(FLERR, "Fix mpm density must be > 0 [mass/distance^3] or rve, got {}",
                          arg[iarg + 1]);
        iarg += 2;
      } else if (word == "stress") {
        need(3);
        settings.initial_stress = {{number(1), number(3), number(3), number(2)}};
        iarg += 4;
      } else if (word == "volume" || word == "points_per_cell") {
        need(1);
        const double given = number(1);
        if (!(given > 0.0))
          lmp->error->all(FLERR, "Fix mpm {} must be > 0, got {}", word, arg[iarg + 1]);
        settings.initial_volume = word == "volume" ? given
                                                   : options.cell_size * options.cell_size / given;
        iarg += 2;
      } else if (word == "rigid") {
        need(6);
        MpmRigidBody body;
        mpm::RigidBodyOptions how;
        body.group = arg[iarg + 1];
        body.groupbit = groupbit_of(1);
        if (strcmp(arg[iarg + 2], "vx") != 0 || strcmp(arg[iarg + 4], "vy") != 0)
          lmp->error->all(FLERR,
                          "Fix mpm rigid must read: rigid group-ID vx value vy value rough|smooth");
        body.velocity[0] = value(3);
        body.velocity[1] = value(5);
        how.rough = one_of(6, {"smooth", "rough"});
        settings.bodies.push_back(body);
        options.rigid_bodies.push_back(how);
        options.rigid_body_names.push_back(body.group);
        face = &options.rigid_bodies.back().face;
        iarg += 7;
      } else if (word == "separation") {
        need(1);
        if (options.rigid_bodies.empty())
          lmp->error->all(FLERR, "Fix mpm separation must follow a rigid body");
        options.rigid_bodies.back().separation = utils::logical(FLERR, arg[iarg + 1], false, lmp);
        iarg += 2;
      } else if (word == "traction") {
        need(3);
        MpmTraction load;
        load.id = arg[iarg + 1];
        const bool is_region =
            lmp->domain->get_region_by_id(load.id) && lmp->group->find(load.id) < 0;
        load.groupbit = is_region ? 0 : groupbit_of(1);
        load.traction[0] = value(2);
        load.traction[1] = value(3);
        settings.tractions.push_back(load);
        face = &settings.tractions.back().face;
        iarg += 4;
      } else if (word == "face") {
        need(1);
        if (!face) lmp->error->all(FLERR, "Fix mpm face must follow a traction or a rigid body");
        *face = side(1);
        iarg += 2;
      } else if (word == "cfl") {
        need(2);
        settings.courant_warn = number(1);
        settings.courant_error = number(2);
        if (!(settings.courant_warn > 0.0 && settings.courant_error >= settings.courant_warn &&
              settings.courant_error <= MAX_COURANT))
          lmp->error->all(FLERR,
                          "Fix mpm cfl must have 0 < warn <= error <= {:g}, got {} {}; above 1 a "
                          "step is unstable",
                          MAX_COURANT, arg[iarg + 1], arg[iarg + 2]);
        iarg += 3;
      } else if (word == "progress") {
        need(1);
        settings.progress_interval = number(1);
        if (!(settings.progress_interval >= 0.0))
          lmp->error->all(FLERR,
                          "Fix mpm progress must be at least 0 [seconds of wall time], which means "
                          "never, got {}",
                          arg[iarg + 1]);
        iarg += 2;
      } else {
        lmp->error->all(FLERR, "Fix mpm: {}", rve::unknown_keyword(word, KEYWORDS, last));
      }

      last.clear();
      for (int i = first; i < iarg; i++) last += (i > first ? " " : "") + std::string(arg[i]);
      const auto values_from = [&](int begin) {
        std::string text;
        for (int i = begin; i < iarg; i++) text += (i > begin ? " " : "") + std::string(arg[i]);
        return text;
      };
      const bool is_load = word == "traction";
      if (word == "rigid" || is_load) {
        owner = word + " " + arg[first + 1];
        say(owner, values_from(first + 2), is_load);
        if (is_load) owner += " number " + std::to_string(settings.tractions.size());
      } else if (word == "model" || word == "boundary") {
        say(word + " " + arg[first + 1], values_from(first + 2));
      } else if (word == "column") {
        say(word + " " + arg[first + 1], "");
      } else if (word == "face" || word == "separation") {
        say(owner + " " + word, values_from(first + 1));
      } else if (word == "points_per_cell") {
        say("volume", fmt::format("{:.17g}", settings.initial_volume));    // another way to say it
      } else {
        say(word, values_from(first + 1));
      }
    }
    const double half = 0.5 * std::sqrt(settings.initial_volume);
    if (half > 0.5 * options.cell_size * (1.0 + 1e-6))
      lmp->error->all(
          FLERR, "Fix mpm volume of a point must be in (0, {}] (one cell), got {} [distance^2]",
          options.cell_size * options.cell_size, settings.initial_volume);
  } catch (const rve::InputError &problem) {
    lmp->error->all(FLERR, "Fix mpm: {}", problem.what());
  }
  return settings;
}

void MpmSettings::find(LAMMPS *lmp)
{
  const auto look_up = [lmp](MpmValue &value) {
    if (value.variable.empty()) return;
    value.index = lmp->input->variable->find(value.variable.c_str());
    if (value.index < 0)
      lmp->error->all(FLERR, "Fix mpm: variable '{}' does not exist", value.variable);
    if (!lmp->input->variable->equalstyle(value.index))
      lmp->error->all(FLERR, "Fix mpm: variable '{}' must be an equal-style variable",
                      value.variable);
  };
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
    for (auto &velocity : body.velocity) look_up(velocity);
  for (auto &load : tractions) {
    for (auto &component : load.traction) look_up(component);
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
