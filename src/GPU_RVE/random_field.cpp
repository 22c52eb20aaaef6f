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

#include "random_field.h"

#include "atom.h"
#include "collective_error.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "field/circulant_embedding.h"
#include "field/interpolation.h"
#include "field/marginal.h"
#include "group.h"
#include "on_rank_zero.h"
#include "rve/core/error.h"
#include "rve/core/suggestion.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <set>
#include <string>
#include <vector>

using namespace LAMMPS_NS;

namespace {

const rve::Words KEYWORDS = {"covariance", "lengths",       "angle",  "spacing", "domain",
                             "marginal",   "interpolation", "bounds", "seed",    "max_points"};

struct Order {
  int groupbit = 0;
  double *property = nullptr;    ///< of the local atoms
  std::string name;
  field::Grid grid;
  field::Covariance covariance{field::Exponential{}, field::Anisotropy({1.0, 1.0})};
  field::Marginal marginal = field::Normal(0.0, 1.0);
  field::InterpolationKind interpolation = field::InterpolationKind::Linear;
  std::optional<field::Interval> bounds;
  std::uint64_t seed = 1;
  std::int64_t max_points = field::CirculantEmbedding::DEFAULT_LIMIT;
};

double *find_property(LAMMPS *lmp, const std::string &word)
{
  if (word.size() < 3 || word.compare(0, 2, "d_") != 0)
    lmp->error->all(
        FLERR, "random_field: property is '{}'; it must be d_name of a fix property/atom", word);
  int is_double, columns;
  const int index = lmp->atom->find_custom(word.c_str() + 2, is_double, columns);
  if (index < 0 || !is_double || columns)
    lmp->error->all(FLERR,
                    "random_field: there is no per-atom vector {}; define it first: fix ID all "
                    "property/atom {}",
                    word, word);
  return lmp->atom->dvector[index];
}

/// Keywords as they come; the grid and the ellipse are made of several of them.
Order parse(LAMMPS *lmp, int narg, char **arg)
{
  Error *error = lmp->error;
  Order order;
  const int igroup = lmp->group->find(arg[0]);
  if (igroup < 0) error->all(FLERR, "random_field: there is no group '{}'", arg[0]);
  order.groupbit = lmp->group->bitmask[igroup];
  order.name = arg[1];
  order.property = find_property(lmp, order.name);

  std::optional<field::Vec> lengths, spacing;
  bool has_covariance = false, has_domain = false;
  double angle = 0.0;
  field::Vec lo{lmp->domain->boxlo[0], lmp->domain->boxlo[1]};
  field::Vec hi{lmp->domain->boxhi[0], lmp->domain->boxhi[1]};

  std::set<std::string> given;
  std::string last;    // keyword, and its values
  int iarg = 2;
  while (iarg < narg) {
    const std::string keyword = arg[iarg++];
    if (!given.insert(keyword).second)
      error->all(FLERR, "random_field: {} is given twice; give it once", keyword);
    const int first = iarg - 1;
    const auto word = [&]() -> std::string {
      if (iarg == narg) utils::missing_cmd_args(FLERR, "random_field " + keyword, error);
      return arg[iarg++];
    };
    const auto real = [&]() {
      const std::string text = word();
      if (!utils::is_double(text))
        error->all(FLERR, "random_field: {} has '{}' where a number must be", keyword, text);
      return utils::numeric(FLERR, text, false, lmp);
    };
    const auto whole = [&]() {
      return utils::bnumeric(FLERR, word(), false, lmp);
    };
    if (keyword == "covariance") {
      const std::string kind = word();
      has_covariance = true;
      if (kind == "exponential")
        order.covariance.function = field::Exponential{};
      else if (kind == "gaussian")
        order.covariance.function = field::Gaussian{};
      else if (kind == "matern")
        order.covariance.function = field::Matern(real());
      else
        error->all(
            FLERR,
            "random_field: covariance is '{}'; it must be exponential, gaussian or matern nu",
            kind);
    } else if (keyword == "lengths") {
      const double horizontal = real();
      lengths = {horizontal, real()};
    } else if (keyword == "angle") {
      angle = real();
    } else if (keyword == "spacing") {
      const double dx = real();
      spacing = {dx, real()};
    } else if (keyword == "domain") {
      for (int a = 0; a < field::AXES; a++) {
        lo[a] = real();
        hi[a] = real();
      }
      has_domain = true;
    } else if (keyword == "marginal") {
      const std::string kind = word();
      const double first =
          kind == "normal" || kind == "lognormal" || kind == "uniform" || kind == "bounded" ? real()
                                                                                            : 0.0;
      if (kind == "normal") {
        order.marginal = field::Normal(first, real());
      } else if (kind == "lognormal") {
        order.marginal = field::Lognormal(first, real());
      } else if (kind == "uniform") {
        order.marginal = field::Uniform(first, real());
      } else if (kind == "bounded") {
        const double upper = real(), location = real();
        order.marginal = field::Bounded(first, upper, location, real());
      } else {
        error->all(FLERR,
                   "random_field: marginal is '{}'; it must be normal, lognormal, uniform or "
                   "bounded",
                   kind);
      }
    } else if (keyword == "interpolation") {
      const std::string kind = word();
      if (kind != "linear" && kind != "nearest")
        error->all(FLERR, "random_field: interpolation is '{}'; it must be linear or nearest",
                   kind);
      order.interpolation = kind == "linear" ? field::InterpolationKind::Linear
                                             : field::InterpolationKind::Nearest;
    } else if (keyword == "bounds") {
      const double lower = real();
      order.bounds = field::Interval(lower, real());
    } else if (keyword == "seed") {
      const bigint seed = whole();
      if (seed < 0) error->all(FLERR, "random_field: seed is {}; it must be at least 0", seed);
      order.seed = static_cast<std::uint64_t>(seed);
    } else if (keyword == "max_points") {
      order.max_points = whole();
      if (order.max_points < 4)
        error->all(FLERR, "random_field: max_points is {}; it must be at least 4",
                   order.max_points);
    } else {
      error->all(FLERR, "random_field: {}", rve::unknown_keyword(keyword, KEYWORDS, last));
    }
    last = arg[first];
    for (int i = first + 1; i < iarg; i++) last += std::string(" ") + arg[i];
  }
  if (!has_covariance) error->all(FLERR, "random_field: no covariance is given");
  if (!lengths) error->all(FLERR, "random_field: no correlation lengths are given");
  if (!spacing) error->all(FLERR, "random_field: no grid spacing is given");
  if (lmp->domain->triclinic && !has_domain)
    error->all(FLERR, "random_field: the box is triclinic; give the domain of the field");
  order.covariance.anisotropy = field::Anisotropy(*lengths, angle);
  order.grid = field::Grid::covering(lo, hi, *spacing);
  return order;
}

void report(LAMMPS *lmp, const Order &order, const field::CirculantEmbedding &embedding)
{
  const field::TorusReport &first = embedding.trials().front(), &last = embedding.trials().back();
  utils::logmesg(lmp, "random_field {}: {} covariance on {} nodes, torus of {} points, seed {}\n",
                 order.name, order.covariance.name(), field::to_string(order.grid.nodes),
                 field::to_string(last.points), order.seed);
  if (first.num_negative > 0)
    utils::logmesg(lmp,
                   "  a torus of {} points has {} negative eigenvalues, smallest {:.3g}, largest "
                   "{:.3g}; padding by {} points removes them\n",
                   field::to_string(first.points), first.num_negative, first.smallest,
                   first.largest, field::to_string(embedding.padding()));
  if (last.num_rounded > 0)
    utils::logmesg(lmp,
                   "  {} eigenvalues between {:.3g} and 0 are zero but for rounding, and set to "
                   "it; covariances change by less than {:.3g}\n",
                   last.num_rounded, last.smallest, last.covariance_error);
}

/// Values at the local atoms of the group, all checked before the first one is stored.
void store(LAMMPS *lmp, const Order &order, const std::vector<double> &nodes)
{
  const Atom *atom = lmp->atom;
  const field::Interpolation interpolation(order.interpolation, order.grid, order.covariance);
  std::vector<double> values(atom->nlocal, 0.0);
  CollectiveError outside, out_of_bounds;
  double extremes[2] = {-HUGE_VAL, -HUGE_VAL};    // -min, max
  const auto evaluate = [&](const auto &marginal) {
    for (int i = 0; i < atom->nlocal; i++) {
      if (!(atom->mask[i] & order.groupbit)) continue;
      double x[3] = {atom->x[i][0], atom->x[i][1], atom->x[i][2]};
      lmp->domain->remap(x);    // through periodic sides
      const field::Vec position{x[0], x[1]};
      if (!order.grid.contains(position)) {
        outside.add(atom->tag[i], {x[0], x[1], 0.0});
        continue;
      }
      const double value = marginal(interpolation.value(nodes, position));
      values[i] = value;
      if (order.bounds && !order.bounds->contains(value))
        out_of_bounds.add(atom->tag[i], {x[0], x[1], value});
      extremes[0] = std::fmax(extremes[0], -value);
      extremes[1] = std::fmax(extremes[1], value);
    }
  };
  std::visit(evaluate, order.marginal);

  outside.raise_if_any(lmp, [&](bigint count, tagint id, const CollectiveError::Values &at) {
    const field::Grid &grid = order.grid;
    return fmt::format("random_field: atom {} at ({:.8g}, {:.8g}) is outside of the domain, x from "
                       "{:.8g} to {:.8g} and y from {:.8g} to {:.8g} ({} atoms are)",
                       id, at[0], at[1], grid.origin[0], grid.origin[0] + grid.extent(0),
                       grid.origin[1], grid.origin[1] + grid.extent(1), count);
  });
  out_of_bounds.raise_if_any(lmp, [&](bigint count, tagint id, const CollectiveError::Values &at) {
    return fmt::format(
        "random_field: the value {:.8g} of atom {} at ({:.8g}, {:.8g}) is outside of "
        "the bounds {} ({} atoms are)",
        at[2], id, at[0], at[1], order.bounds->to_string(), count);
  });

  double sums[3] = {0.0, 0.0, 0.0}, all[3], range[2];
  MPI_Allreduce(extremes, range, 2, MPI_DOUBLE, MPI_MAX, lmp->world);
  // in a power of two near the largest value, so that no square overflows
  const int exponent = std::ilogb(std::fmax(std::fabs(range[0]), std::fabs(range[1])));
  for (int i = 0; i < atom->nlocal; i++) {
    if (!(atom->mask[i] & order.groupbit)) continue;
    order.property[i] = values[i];
    const double scaled = std::scalbn(values[i], -exponent);
    sums[0] += 1.0;
    sums[1] += scaled;
    sums[2] += scaled * scaled;
  }
  MPI_Allreduce(sums, all, 3, MPI_DOUBLE, MPI_SUM, lmp->world);
  if (lmp->comm->me > 0) return;
  if (all[0] == 0.0) {
    lmp->error->warning(FLERR, "random_field: the group has no atoms");
    return;
  }
  const double mean = all[1] / all[0];
  utils::logmesg(lmp,
                 "  {:.0f} atoms: mean {:.5g}, standard deviation {:.5g}, from {:.5g} to {:.5g}\n",
                 all[0], std::scalbn(mean, exponent),
                 std::scalbn(std::sqrt(std::fmax(all[2] / all[0] - mean * mean, 0.0)), exponent),
                 -range[0], range[1]);
}

}    // namespace

/* ----------------------------------------------------------------------
   One rank makes the field and gives it to the others, which evaluate it at their atoms. That is faster than to make it on each rank,
   and takes the memory of the transform once (doc/src/random_field.rst has the numbers).
------------------------------------------------------------------------- */

void RandomField::command(int narg, char **arg)
{
  if (narg < 2) utils::missing_cmd_args(FLERR, "random_field", error);
  if (domain->box_exist == 0) error->all(FLERR, "random_field: there is no simulation box yet");
  if (domain->dimension != 2)
    error->all(FLERR, "random_field: dimension is {}; it must be 2", domain->dimension);
  if (!atom->tag_enable) error->all(FLERR, "random_field: atoms must have IDs");
  std::optional<Order> order;
  try {
    order = parse(lmp, narg, arg);
  } catch (const rve::InputError &e) {
    error->all(FLERR, "random_field: {}", e.what());
  }

  std::vector<double> nodes;
  const std::string failure = on_rank_zero(world, [&]() {
    field::CirculantEmbedding embedding(order->grid, order->covariance, order->max_points);
    report(lmp, *order, embedding);
    nodes = embedding.sample(order->seed);
  });
  if (!failure.empty()) error->all(FLERR, "random_field: {}", failure);

  nodes.resize(field::total(order->grid.nodes));
  constexpr std::size_t CHUNK = 1 << 30;    // MPI counts in int
  for (std::size_t begin = 0; begin < nodes.size(); begin += CHUNK)
    MPI_Bcast(&nodes[begin], static_cast<int>(std::min(CHUNK, nodes.size() - begin)), MPI_DOUBLE, 0,
              world);
  store(lmp, *order, nodes);
}
