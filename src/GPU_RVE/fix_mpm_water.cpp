// SPDX-License-Identifier: GPL-2.0-only

#include "fix_mpm_water.h"

#include "lammps/collective_error.h"
#include "rve/core/error.h"

#include "atom.h"
#include "comm.h"
#include "error.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;

namespace {

constexpr const char *NAMES = "water_volume grain_volume initial_pore_pressure "
                              "initial_vertical_stress";

// A warning is printed if the modulus of the water is below this multiple of the P-wave modulus of
// the ground: then more than 1/11 of an undrained load acts on the grains.
constexpr double STIFF = 10.0;

}    // namespace

// ---- numbers of points ----

template <int D> std::string MpmWater<D>::names() const
{
  return exists() ? NAMES : "";
}

template <int D> void MpmWater<D>::resize(int count)
{
  if (!exists()) return;
  for (std::vector<double> &column : numbers) column.resize(count);
}

template <int D> void MpmWater<D>::clear(int i)
{
  if (!exists()) return;
  for (std::vector<double> &column : numbers) column[i] = 0.0;
}

template <int D> void MpmWater<D>::copy(int i, int j)
{
  if (!exists()) return;
  for (std::vector<double> &column : numbers) column[j] = column[i];
}

template <int D> double *MpmWater<D>::pack(int i, double *buf) const
{
  if (exists())
    for (const std::vector<double> &column : numbers) *buf++ = column[i];
  return buf;
}

template <int D> const double *MpmWater<D>::unpack(int i, const double *buf)
{
  if (exists())
    for (std::vector<double> &column : numbers) column[i] = *buf++;
  return buf;
}

template <int D> void MpmWater<D>::show(Points &points)
{
  if (!exists() || settings().is_submerged()) return;
  points.water.water_volume = numbers[WATER].data();
  points.water.grain_volume = numbers[GRAINS].data();
}

/// A force on a submerged point, such as its weight, is reduced to the share of the mass that
/// exceeds the mass of the displaced water. The share does not change: water that leaves the pores
/// takes its weight and its buoyancy with it.
template <int D> double *MpmWater<D>::body_forces(const double *mass)
{
  if (!settings().is_submerged()) return &atom->f[0][0];
  forces.assign(&atom->f[0][0], &atom->f[0][0] + 3 * (std::size_t) atom->nlocal);
  for (int i = 0; i < atom->nlocal; i++) {
    const double displaced = numbers[WATER][i] > 0.0 ? numbers[WATER][i] + numbers[GRAINS][i] : 0.0;
    const double share = 1.0 - settings().density * displaced / mass[i];
    for (int c = 0; c < 3; c++) forces[3 * (std::size_t) i + c] *= share;
  }
  return forces.data();
}

// ---- initial values ----

template <int D> bool MpmWater<D>::is_wet(int i) const
{
  if (!exists() || !(atom->mask[i] & settings().groupbit)) return false;
  return !setup.settings.in_situ.water_table || atom->x[i][D - 1] < table[i];
}

template <int D> double MpmWater<D>::pressure_at_start(int i) const
{
  if (!is_wet(i) || !setup.settings.in_situ.water_table) return 0.0;
  const double weight = settings().density * setup.settings.in_situ.gravity;
  return weight * (table[i] - atom->x[i][D - 1]);
}

template <int D> void MpmWater<D>::find_porosities(const Points &points, const Atoms &made)
{
  if (!exists()) return;
  if (setup.settings.in_situ.water_table)
    setup.settings.in_situ.water_table->evaluate(lmp, setup.fix->igroup, table);
  if (settings().takes_porosity_of_rves)
    porosity.assign(atom->nlocal, 0.0);
  else
    settings().porosity.evaluate(lmp, setup.fix->igroup, porosity);
  CollectiveError without_spheres, wrong, wrong_table;
  for (const int i : made) {
    if (!(atom->mask[i] & settings().groupbit)) continue;
    if (setup.settings.in_situ.water_table && !std::isfinite(table[i]))
      wrong_table.add(atom->tag[i], {table[i], 0.0, 0.0});
    if (settings().takes_porosity_of_rves) {
      const FixRve *source = setup.grains[points.model[i]];
      if (!source || source->rves().dimension != 3) {
        without_spheres.add(atom->tag[i], {source ? 1.0 : 0.0, 0.0, 0.0});
        continue;
      }
      const double void_ratio = source->rves().void_ratio(i);
      porosity[i] = void_ratio / (1.0 + void_ratio);
    }
    if (!(porosity[i] >= mpm::LEAST_POROSITY && porosity[i] < 1.0))
      wrong.add(atom->tag[i], {porosity[i], 0.0, 0.0});
  }
  without_spheres.raise_if_any(lmp, [&](bigint all, tagint id, const CollectiveError::Values &at) {
    return fmt::format("fix mpm {}: water: porosity rve needs RVEs of spheres, but atom {} has {}; "
                       "give the porosity as a number (atoms without an RVE of spheres: {})",
                       setup.fix->id, id,
                       at[0] > 0.0 ? "disks, which only give the area of their voids" : "no RVE",
                       all);
  });
  wrong.raise_if_any(lmp, [&](bigint all, tagint id, const CollectiveError::Values &at) {
    return fmt::format("fix mpm {}: water: the porosity of atom {} is {} [-]; it must be at least "
                       "{} and below 1 (atoms with an invalid value: {})",
                       setup.fix->id, id, rve::number(at[0]), mpm::LEAST_POROSITY, all);
  });
  wrong_table.raise_if_any(lmp, [&](bigint all, tagint id, const CollectiveError::Values &at) {
    return fmt::format("fix mpm {}: insitu: water_table of atom {} is {} [length]; it must be a "
                       "finite number (atoms with an invalid value: {})",
                       setup.fix->id, id, rve::number(at[0]), all);
  });
}

template <int D> void MpmWater<D>::begin(const Points &points, const Atoms &made)
{
  if (!exists()) return;
  for (const int i : made) {
    clear(i);
    if (!(atom->mask[i] & settings().groupbit)) continue;
    const double all = setup.settings.initial_volume;
    const double pores = porosity[i] * all;
    numbers[GRAINS][i] = all - pores;
    numbers[VERTICAL][i] = -points.stress[i](D - 1, D - 1);
    if (!is_wet(i)) continue;
    numbers[PRESSURE][i] = pressure_at_start(i);
    // pores as pore_pressure() computes them, so that water without pressure has exactly none
    numbers[WATER][i] = settings().is_submerged()
        ? all - numbers[GRAINS][i]
        : mpm::water_volume_at(setup.settings.options.water, all - numbers[GRAINS][i],
                               numbers[PRESSURE][i]);
  }
  check_buoyancy(points, made);
  int any = !made.empty();
  MPI_Allreduce(MPI_IN_PLACE, &any, 1, MPI_INT, MPI_MAX, world);
  is_new = is_new || any;
}

template <int D> void MpmWater<D>::check_buoyancy(const Points &points, const Atoms &made) const
{
  if (!settings().is_submerged()) return;
  CollectiveError floating;
  for (const int i : made) {
    const double density = points.mass[i] / points.volume[i];
    if (is_wet(i) && !(density > settings().density))
      floating.add(atom->tag[i], {density, 0.0, 0.0});
  }
  floating.raise_if_any(lmp, [&](bigint all, tagint id, const CollectiveError::Values &at) {
    return fmt::format(
        "fix mpm {}: water: the density of atom {} with its water is {} "
        "[mass/length^3]; submerged ground must be denser than water, {} (atoms with "
        "an invalid value: {})",
        setup.fix->id, id, rve::number(at[0]), rve::number(settings().density), all);
  });
}

// ---- output ----

template <int D> int MpmWater<D>::column(const std::string &name)
{
  for (int k = 0; k < COLUMNS; k++)
    if (name == COLUMN_NAMES[k]) return k;
  return -1;
}

template <int D> double MpmWater<D>::value(int column, const Points &points, int i) const
{
  if (!(numbers[GRAINS][i] > 0.0)) return 0.0;
  if (column == POROSITY) return volumes(points, i).porosity();
  if (column == WATER_VOLUME) return numbers[WATER][i];
  const double now = pressure(points, i);
  if (column == PORE_PRESSURE) return now;
  return numbers[VERTICAL][i] > 0.0 ? (now - numbers[PRESSURE][i]) / numbers[VERTICAL][i] : 0.0;
}

template <int D> void MpmWater<D>::report(const Points &points)
{
  if (!is_new) return;
  is_new = false;
  setup.solver->fetch(points);
  for (mpm::Constitutive<D> *law : setup.laws) law->expect_questions();
  bigint wet = 0;
  // largest negative porosity, porosity, negative pressure, pressure, modulus of the ground as a
  // multiple of that of the water, and coefficient of consolidation
  double most[6] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL, -HUGE_VAL, 0.0, 0.0};
  for (int i = 0; i < atom->nlocal; i++) {
    if (points.rigid_body[i] >= 0 || !(numbers[WATER][i] > 0.0)) continue;
    wet++;
    const double n = volumes(points, i).porosity(), p = pressure(points, i);
    const double modulus = setup.laws[points.model[i]]->p_wave_modulus(i);
    const double softness =
        settings().is_submerged() ? 0.0 : modulus / setup.solver->modulus_of_water(points, i);
    const double consolidation = setup.settings.options.water.mobility * modulus / (1.0 + softness);
    const double own[] = {-n, n, -p, p, softness, consolidation};
    for (int k = 0; k < 6; k++) most[k] = std::max(most[k], own[k]);
  }
  MPI_Allreduce(MPI_IN_PLACE, &wet, 1, MPI_LMP_BIGINT, MPI_SUM, world);
  MPI_Allreduce(MPI_IN_PLACE, most, 6, MPI_DOUBLE, MPI_MAX, world);
  if (comm->me != 0) return;
  if (wet == 0) {
    error->warning(FLERR,
                   "fix mpm {}: water: no point has water, because none of the group is below the "
                   "water table",
                   setup.fix->id);
    return;
  }
  if (settings().is_submerged()) {
    utils::logmesg(lmp,
                   "fix mpm {}: {} points are submerged: porosity {:.4g} to {:.4g}; forces on them "
                   "are reduced by buoyancy\n",
                   setup.fix->id, wet, -most[0], most[1]);
    return;
  }
  utils::logmesg(
      lmp,
      "fix mpm {}: {} points have water: porosity {:.4g} to {:.4g}, pore pressure {:.4g} "
      "to {:.4g} [stress]\n",
      setup.fix->id, wet, -most[0], most[1], -most[2], most[3]);
  if (settings().flows())
    utils::logmesg(
        lmp,
        "fix mpm {}: the coefficient of consolidation is at most {:.4g} [length^2/time]; "
        "a layer with a drained side at the distance H consolidates in about H^2 over "
        "it\n",
        setup.fix->id, most[5]);
  if (STIFF * most[4] > 1.0)
    error->warning(
        FLERR,
        "fix mpm {}: the modulus of the water over the porosity is {:.3g} times the "
        "P-wave modulus of the ground, below {}, so that the grains carry {:.2g} % of an "
        "undrained load; use a higher kw",
        setup.fix->id, 1.0 / most[4], STIFF, 100.0 * most[4] / (1.0 + most[4]));
}

template <int D> void MpmWater<D>::report_cavitation(const Points &points) const
{
  if (!exists() || std::isinf(setup.settings.options.water.cavitation)) return;
  setup.solver->fetch(points);
  const double limit = setup.settings.options.water.least_pressure();
  bigint cavitating = 0;
  for (int i = 0; i < atom->nlocal; i++)
    if (points.rigid_body[i] < 0 && numbers[WATER][i] > 0.0 && pressure(points, i) == limit)
      cavitating++;
  MPI_Allreduce(MPI_IN_PLACE, &cavitating, 1, MPI_LMP_BIGINT, MPI_SUM, world);
  if (cavitating > 0 && comm->me == 0)
    error->warning(FLERR,
                   "fix mpm {}: the water of {} points is at the limit of cavitation, {} [stress]",
                   setup.fix->id, cavitating, rve::number(limit));
}

template class LAMMPS_NS::MpmWater<2>;
template class LAMMPS_NS::MpmWater<3>;
