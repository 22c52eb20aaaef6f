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

#include "error.h"
#include "one_rank.h"
#include "rve/core/error.h"
#include "rve/engine/packing.h"
#include "rve/engine/packing_io.h"
#include "rve_settings.h"

#include <cstring>
#include <string>

using namespace LAMMPS_NS;

namespace {

struct Order {
  std::string path;
  rve::PackingRecipe recipe;
  rve::Options options;
};

Order parse(LAMMPS *lmp, int narg, char **arg)
{
  Error *error = lmp->error;
  Order order;
  rve::PackingRecipe &recipe = order.recipe;
  MaterialWords material;
  order.path = arg[0];
  order.options.device = rve::Device::Cpu;    // one RVE: a CPU thread is as fast
  order.options.threads = 1;

  int iarg = 1;
  while (iarg < narg) {
    const std::string keyword = arg[iarg];
    if (material.take(lmp, "create_rve", iarg, narg, arg)) {
      iarg += 2;
      continue;
    }
    const int values = keyword == "radius" ? 3 : 1;
    if (iarg + values >= narg) utils::missing_cmd_args(FLERR, "create_rve " + keyword, error);
    const char *value = arg[iarg + 1];
    const auto real = [&]() {
      return utils::numeric(FLERR, value, false, lmp);
    };
    if (keyword == "grains") {
      recipe.num_grains = utils::inumeric(FLERR, value, false, lmp);
    } else if (keyword == "seed") {
      const bigint seed = utils::bnumeric(FLERR, value, false, lmp);
      if (seed < 0) error->all(FLERR, "create_rve: seed is {}; it must be at least 0", seed);
      recipe.seed = static_cast<std::uint64_t>(seed);
    } else if (keyword == "radius") {
      if (strcmp(value, "uniform") != 0)
        error->all(FLERR, "create_rve: radius is '{}'; it must be uniform lo hi", value);
      recipe.radius_min = utils::numeric(FLERR, arg[iarg + 2], false, lmp);
      recipe.radius_max = utils::numeric(FLERR, arg[iarg + 3], false, lmp);
    } else if (keyword == "pressure") {
      recipe.pressure = real();
    } else if (keyword == "void_ratio") {
      recipe.void_ratio = real();
    } else if (keyword == "friction_prep") {
      recipe.preparation_friction = real();
    } else if (keyword == "damping_prep") {
      recipe.preparation_damping = real();
    } else if (keyword == "tolerance") {
      recipe.stress_tolerance = recipe.unbalanced_tolerance = real();
    } else if (keyword == "format") {
      try {
        order.options.format = rve::format_from_string(value);
      } catch (const rve::InputError &e) {
        error->all(FLERR, "create_rve: {}", e.what());
      }
    } else if (keyword == "threads") {
      order.options.threads = utils::inumeric(FLERR, value, false, lmp);
    } else {
      error->all(FLERR, "Unknown create_rve keyword: {}", keyword);
    }
    iarg += values + 1;
  }
  material.apply(recipe.material);
  // grains with the stiffness of their normal spring in the tangent too, unless said otherwise
  if (!material.kt) recipe.material.tangential_stiffness = recipe.material.normal_stiffness;
  if (recipe.void_ratio && recipe.preparation_friction > 0.0)
    error->all(FLERR, "create_rve: void_ratio finds friction_prep itself; give one of them");
  return order;
}

}    // namespace

/* ----------------------------------------------------------------------
   one rank works, so the packing is the same on any number of ranks; the others sleep
------------------------------------------------------------------------- */

void CreateRve::command(int narg, char **arg)
{
  if (narg < 1) utils::missing_cmd_args(FLERR, "create_rve", error);
  const Order order = parse(lmp, narg, arg);

  const std::string failure = on_rank_zero(world, [&]() {
    auto engine = rve::make_engine(order.options);
    utils::logmesg(lmp, "create_rve {}: {} grains, seed {}, {}\n", order.path,
                   order.recipe.num_grains, order.recipe.seed, engine->description());
    int lines = 0;
    const auto progress = [&](const rve::PackingReport &r) {
      if (lines++ == 0)
        utils::logmesg(lmp, "{:>10} {:>17} {:>8} {:>12} {:>10} {:>12} {:>10}\n", "step", "phase",
                       "friction", "pressure", "void_ratio", "coordination", "unbalanced");
      utils::logmesg(lmp, "{:>10} {:>17} {:>8.4f} {:>12.5g} {:>10.5f} {:>12.4f} {:>10.3g}\n",
                     r.step, r.phase, r.preparation_friction, r.pressure + 0.0, r.void_ratio,
                     r.coordination_number, r.unbalanced_ratio);
    };
    const rve::RveState state = rve::generate_packing(order.recipe, *engine, progress);
    rve::write_packing(order.path, state);
    utils::logmesg(lmp, "create_rve {}: written, void ratio {:.5f}\n", order.path,
                   state.cell_area() / state.solid_area() - 1.0);
  });
  if (!failure.empty()) error->all(FLERR, "create_rve: {}", failure);
}
