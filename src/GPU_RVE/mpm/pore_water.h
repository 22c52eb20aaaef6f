// SPDX-License-Identifier: GPL-2.0-only
// Pore water of material points: its fields, its pressure and its modulus.
//
// Water that flows obeys Darcy's law without its inertia (doc/src/theory_water.rst).
//
// A point of saturated ground stores the volume of its water and the volume of its grains. The
// grains are incompressible, so the pores have the volume V - V_s. The pressure is a function of
// these volumes alone. It therefore does not drift, and the limit of cavitation is reversible. The
// stresses of constitutive laws are effective stresses. Forces on nodes follow from the total
// stress σ' - p 1 (Terzaghi 1936).

#pragma once

#include "rve/core/tensor.h"

#include <cmath>
#include <limits>

namespace mpm {

/// The water in the pores of all points.
struct PoreWater {
  double modulus = 0.0;    ///< bulk modulus K_w [stress]; 0: there is no water
  /// Largest suction of the water [stress]. Below this pressure the water cavitates and its
  /// pressure is constant.
  double cavitation = std::numeric_limits<double>::infinity();
  /// Mobility k/(ρ_w g): flux of volume per area over the gradient of the pressure [length⁴/(force
  /// time)]; 0: the water does not flow. The conductivity k is a velocity.
  double mobility = 0.0;
  double density = 0.0;    ///< ρ_w in the weight of water that flows [mass/length³]
  int impervious = 0;      ///< bit f: no water passes the side f of the grid (Face)

  RVE_HD bool exists() const { return modulus > 0.0; }
  RVE_HD bool flows() const { return mobility > 0.0; }
  /// True if no water passes a side, given by its axis and its end.
  RVE_HD bool is_impervious(int axis, bool high) const
  {
    return (impervious >> (2 * axis + (high ? 1 : 0)) & 1) != 0;
  }
  /// Pressure of water that cavitates [stress]; a limit of 0 gives a positive zero.
  RVE_HD double least_pressure() const { return 0.0 - cavitation; }
};

/// Fields of the pore water of points. `Array<T>` holds one field of all points. All arrays are
/// null if no point has water.
template <int D, template <class> class Array> struct WaterFields {
  /// Volume of the water at zero pressure, or 0 at a point without water [length³]. A step changes
  /// it if the water flows.
  Array<double> water_volume{};
  Array<const double> grain_volume{};    ///< volume of the grains V_s [length³]

  /// Calls visit(field of each set...) for all fields in the order of the members.
  template <class Visit, class... Sets>
  static constexpr void each(const Visit &visit, Sets &...sets)
  {
    visit(sets.water_volume...);
    visit(sets.grain_volume...);
  }
};

/// Volumes of a point: of its water at zero pressure V_w, of its grains V_s and of all V [length³].
struct PoreVolumes {
  double water, grains, all;

  RVE_HD double porosity() const { return 1.0 - grains / all; }
};

/// Returns the pressure of the water, p = K_w (V_w/(V - V_s) - 1), but at least the limit of
/// cavitation; compression positive [stress]. It is 0 without water.
RVE_HD inline double pore_pressure(const PoreWater &water, const PoreVolumes &volumes)
{
  if (!(volumes.water > 0.0)) return 0.0;
  const double pressure = water.modulus * (volumes.water / (volumes.all - volumes.grains) - 1.0);
  return pressure < water.least_pressure() ? water.least_pressure() : pressure;
}

/// Returns the modulus -V dp/dV of the water in a point without a limit of cavitation [stress]. It
/// is K_w/n at zero pressure, with the porosity n.
RVE_HD inline double pore_modulus(const PoreWater &water, const PoreVolumes &volumes)
{
  if (!(volumes.water > 0.0)) return 0.0;
  const double pores = volumes.all - volumes.grains;
  return water.modulus * (volumes.water / pores) * (volumes.all / pores);
}

/// Returns the volume of water at zero pressure that has the pressure `pressure` [stress] in pores
/// of the volume `pores` [length³].
inline double water_volume_at(const PoreWater &water, double pores, double pressure)
{
  return pores * (1.0 + pressure / water.modulus);
}

/// Least porosity of a point with water [-].
constexpr double LEAST_POROSITY = 0.01;

}    // namespace mpm
