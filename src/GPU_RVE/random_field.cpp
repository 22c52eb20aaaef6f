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

#include "random_field.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "field/circulant_embedding.h"
#include "field/interpolation.h"
#include "field/marginal.h"
#include "lammps/collective_error.h"
#include "lammps/on_rank_zero.h"
#include "lammps/script_arguments.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

using namespace LAMMPS_NS;

namespace {

struct FieldRequest {
  int groupbit = 0;
  double *property = nullptr;    ///< custom property of the local atoms
  std::string name;
  std::optional<field::Vec> lengths;            ///< correlation lengths [length]
  double angle = 0.0;                           ///< from the x axis to the first length [degrees]
  std::optional<field::Vec> spacing, lo, hi;    ///< of the grid [length]
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

field::Vec read_pair(ScriptArguments &words, const char *first, const char *second)
{
  const double value = words.number(first);
  return {value, words.number(second)};
}

void read_covariance(ScriptArguments &words, FieldRequest &request)
{
  field::Covariance &covariance = request.covariance;
  if (words.take("exponential"))
    covariance.function = field::Exponential{};
  else if (words.take("gaussian"))
    covariance.function = field::Gaussian{};
  else if (words.take("matern"))
    covariance.function = field::Matern(words.number("matern nu"));
  else
    words.refuse(fmt::format("covariance is '{}'; it must be exponential, gaussian or matern nu",
                             words.next()));
}

void read_marginal(ScriptArguments &words, FieldRequest &request)
{
  field::Marginal &marginal = request.marginal;
  if (words.take("normal")) {
    const field::Vec v = read_pair(words, "mean", "standard deviation");
    marginal = field::Normal(v[0], v[1]);
  } else if (words.take("lognormal")) {
    const field::Vec v = read_pair(words, "mean", "standard deviation");
    marginal = field::Lognormal(v[0], v[1]);
  } else if (words.take("uniform")) {
    const field::Vec v = read_pair(words, "lo", "hi");
    marginal = field::Uniform(v[0], v[1]);
  } else if (words.take("bounded")) {
    const field::Vec bounds = read_pair(words, "lo", "hi");
    const field::Vec v = read_pair(words, "location", "scale");
    marginal = field::Bounded(bounds[0], bounds[1], v[0], v[1]);
  } else {
    words.refuse(fmt::format("marginal is '{}'; it must be normal, lognormal, uniform or bounded",
                             words.next()));
  }
}

auto pair_of(const char *first, const char *second)
{
  return [=](ScriptArguments &words) { return read_pair(words, first, second); };
}

auto whole(long long least)
{
  return [=](ScriptArguments &words) { return words.whole("", least, MAXBIGINT); };
}

using Kind = field::InterpolationKind;

const ScriptKeyword<FieldRequest> KEYWORDS[] = {
    {"covariance", "exponential | gaussian | matern nu", read_covariance},
    {"lengths", "horizontal vertical",
     into(pair_of("horizontal", "vertical"), &FieldRequest::lengths)},
    {"angle", "degrees", into(any_number, &FieldRequest::angle)},
    {"spacing", "dx dy", into(pair_of("dx", "dy"), &FieldRequest::spacing)},
    {"domain", "xlo xhi ylo yhi",
     [](ScriptArguments &words, FieldRequest &request) {
       const field::Vec x = read_pair(words, "xlo", "xhi"), y = read_pair(words, "ylo", "yhi");
       request.lo = {x[0], y[0]};
       request.hi = {x[1], y[1]};
     }},
    {"marginal",
     "normal mean sd | lognormal mean sd | uniform lo hi | bounded lo hi location scale",
     read_marginal},
    {"interpolation", "linear | nearest",
     into(one_of<Kind>({{"linear", Kind::Linear}, {"nearest", Kind::Nearest}}),
          &FieldRequest::interpolation)},
    {"bounds", "lo hi",
     [](ScriptArguments &words, FieldRequest &request) {
       const field::Vec bounds = read_pair(words, "lo", "hi");
       request.bounds = field::Interval(bounds[0], bounds[1]);
     }},
    {"seed", "N", into(whole(0), &FieldRequest::seed)},
    {"max_points", "N", into(whole(4), &FieldRequest::max_points)}};

FieldRequest parse(LAMMPS *lmp, int narg, char **arg)
{
  Error *error = lmp->error;
  ScriptArguments words(lmp, "random_field", narg, arg, 0);
  FieldRequest request;
  request.groupbit = words.groupbit("group");
  request.name = words.next("property");
  request.property = find_property(lmp, request.name);

  words.set_keywords(names_of(KEYWORDS));
  while (words.next_keyword()) words.read(KEYWORDS, request);
  if (!words.has("covariance"))
    error->all(FLERR, "random_field: the keyword covariance must be given");
  if (!request.lengths) error->all(FLERR, "random_field: the keyword lengths must be given");
  if (!request.spacing) error->all(FLERR, "random_field: the keyword spacing must be given");
  if (lmp->domain->triclinic && !request.lo)
    error->all(FLERR, "random_field: the box is triclinic; give the domain of the field");
  const field::Vec lo{lmp->domain->boxlo[0], lmp->domain->boxlo[1]};
  const field::Vec hi{lmp->domain->boxhi[0], lmp->domain->boxhi[1]};
  request.covariance.anisotropy = field::Anisotropy(*request.lengths, request.angle);
  request.grid =
      field::Grid::covering(request.lo.value_or(lo), request.hi.value_or(hi), *request.spacing);
  return request;
}

void report(LAMMPS *lmp, const FieldRequest &request, const field::CirculantEmbedding &embedding)
{
  const field::TorusReport &first = embedding.trials().front(), &last = embedding.trials().back();
  utils::logmesg(lmp, "random_field {}: {} covariance on {} nodes, torus of {} points, seed {}\n",
                 request.name, request.covariance.name(), field::to_string(request.grid.nodes),
                 field::to_string(last.points), request.seed);
  if (first.num_negative > 0)
    utils::logmesg(lmp,
                   "random_field {}: a torus of {} points has {} negative eigenvalues, smallest "
                   "{:.3g}, largest {:.3g}; padding by {} points removes them\n",
                   request.name, field::to_string(first.points), first.num_negative, first.smallest,
                   first.largest, field::to_string(embedding.padding()));
  if (last.num_rounded > 0)
    utils::logmesg(
        lmp,
        "random_field {}: {} eigenvalues between {:.3g} and 0 are rounding errors and set "
        "to 0; covariances change by less than {:.3g}\n",
        request.name, last.num_rounded, last.smallest, last.covariance_error);
}

/// Evaluates the field at the local atoms of the group. All values are checked before the first one
/// is stored. Logs their mean and standard deviation; collective.
void store(LAMMPS *lmp, const FieldRequest &request, const std::vector<double> &nodes)
{
  const Atom *atom = lmp->atom;
  const field::Interpolation interpolation(request.interpolation, request.grid, request.covariance);
  std::vector<double> values(atom->nlocal, 0.0);
  CollectiveError outside, out_of_bounds;
  double extremes[2] = {-HUGE_VAL, -HUGE_VAL};    // negative of the least value, largest value
  const auto evaluate = [&](const auto &marginal) {
    for (int i = 0; i < atom->nlocal; i++) {
      if (!(atom->mask[i] & request.groupbit)) continue;
      double x[3] = {atom->x[i][0], atom->x[i][1], atom->x[i][2]};
      lmp->domain->remap(x);    // atoms may have left through periodic faces
      const field::Vec position{x[0], x[1]};
      if (!request.grid.contains(position)) {
        outside.add(atom->tag[i], {x[0], x[1], 0.0});
        continue;
      }
      const double value = marginal(interpolation.value(nodes, position));
      values[i] = value;
      if (request.bounds && !request.bounds->contains(value))
        out_of_bounds.add(atom->tag[i], {x[0], x[1], value});
      extremes[0] = std::fmax(extremes[0], -value);
      extremes[1] = std::fmax(extremes[1], value);
    }
  };
  std::visit(evaluate, request.marginal);

  outside.raise_if_any(lmp, [&](bigint count, tagint id, const CollectiveError::Values &at) {
    const field::Grid &grid = request.grid;
    return fmt::format("random_field: atom {} at ({:.8g}, {:.8g}) is outside the domain, x from "
                       "{:.8g} to {:.8g} and y from {:.8g} to {:.8g} (atoms outside: {})",
                       id, at[0], at[1], grid.origin[0], grid.origin[0] + grid.extent(0),
                       grid.origin[1], grid.origin[1] + grid.extent(1), count);
  });
  out_of_bounds.raise_if_any(lmp, [&](bigint count, tagint id, const CollectiveError::Values &at) {
    return fmt::format("random_field: the value {:.8g} of atom {} at ({:.8g}, {:.8g}) is outside "
                       "the bounds {} (atoms outside: {})",
                       at[2], id, at[0], at[1], request.bounds->to_string(), count);
  });

  double sums[3] = {0.0, 0.0, 0.0}, all[3], range[2];
  MPI_Allreduce(extremes, range, 2, MPI_DOUBLE, MPI_MAX, lmp->world);
  // sums are scaled by a power of two near the largest value, so that no square overflows
  const double largest = std::fmax(std::fabs(range[0]), std::fabs(range[1]));
  // the scale is 1 if all values are 0, or if there are no values
  const bool has_exponent = largest > 0.0 && std::isfinite(largest);
  const int exponent = has_exponent ? std::ilogb(largest) : 0;
  for (int i = 0; i < atom->nlocal; i++) {
    if (!(atom->mask[i] & request.groupbit)) continue;
    request.property[i] = values[i];
    const double scaled = std::scalbn(values[i], -exponent);
    sums[0] += 1.0;
    sums[1] += scaled;
    sums[2] += scaled * scaled;
  }
  MPI_Allreduce(sums, all, 3, MPI_DOUBLE, MPI_SUM, lmp->world);
  if (lmp->comm->me > 0) return;
  if (all[0] == 0.0) {
    lmp->error->warning(FLERR, "random_field {}: the group has no atoms, and no value is set",
                        request.name);
    return;
  }
  const double mean = all[1] / all[0];
  utils::logmesg(
      lmp,
      "random_field {}: {:.0f} atoms: mean {:.5g}, standard deviation {:.5g}, from {:.5g} "
      "to {:.5g}\n",
      request.name, all[0], std::scalbn(mean, exponent),
      std::scalbn(std::sqrt(std::fmax(all[2] / all[0] - mean * mean, 0.0)), exponent), -range[0],
      range[1]);
}

}    // namespace

/// Rank 0 samples the field and broadcasts it, and each rank evaluates it at its atoms. This is
/// faster than sampling it on each rank, and the memory for the Fourier transform is needed only
/// once (doc/src/dev_numerics.rst has the numbers).
void RandomField::command(int narg, char **arg)
{
  if (domain->box_exist == 0)
    error->all(FLERR, "random_field: the simulation box must be defined before");
  if (domain->dimension != 2)
    error->all(FLERR, "random_field: dimension is {}; it must be 2", domain->dimension);
  if (!atom->tag_enable) error->all(FLERR, "random_field: atoms must have IDs");
  std::optional<FieldRequest> request;
  collectively(lmp, "random_field", [&] { request = parse(lmp, narg, arg); });

  std::vector<double> nodes;
  const std::string failure = on_rank_zero(world, [&]() {
    field::CirculantEmbedding embedding(request->grid, request->covariance, request->max_points);
    report(lmp, *request, embedding);
    nodes = embedding.sample(request->seed);
  });
  if (!failure.empty()) error->all(FLERR, "random_field: {}", failure);

  // this ends with an error if the field does not fit into the memory of a rank
  collectively(lmp, "random_field", [&] { nodes.resize(field::total(request->grid.nodes)); });
  constexpr std::size_t CHUNK = 1 << 30;    // counts of MPI are of type int
  for (std::size_t begin = 0; begin < nodes.size(); begin += CHUNK)
    MPI_Bcast(&nodes[begin], static_cast<int>(std::min(CHUNK, nodes.size() - begin)), MPI_DOUBLE, 0,
              world);
  store(lmp, *request, nodes);
}
