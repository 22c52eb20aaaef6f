// SPDX-License-Identifier: GPL-2.0-only
// Material points for the solver: arrays that the caller owns, and loads on points.

#pragma once

#include "mpm/constitutive.h"
#include "mpm/point_fields.h"
#include "mpm/pore_water.h"
#include "rve/core/error.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace mpm {

/// Contiguous rows of three doubles, such as `{&atom->x[0][0]}` in LAMMPS.
struct Rows3 {
  double *first = nullptr;
  RVE_HD double *operator[](int i) const { return first + 3 * static_cast<std::ptrdiff_t>(i); }
};

/// Returns the larger number; unlike rve::larger, it ignores a `b` that is NaN.
RVE_HD inline double larger(double a, double b)
{
  return a < b ? b : a;
}

/// Returns the largest magnitude of D components.
template <int D> RVE_HD double largest(const double *component)
{
  double result = std::abs(component[0]);
  for (int a = 1; a < D; ++a) result = larger(result, std::abs(component[a]));
  return result;
}

/// Returns the vector of the first D components.
template <int D> RVE_HD Vec<D> first_of(const double *component)
{
  Vec<D> vector;
  for (int a = 0; a < D; ++a) vector[a] = component[a];
  return vector;
}

/// True if D components are finite numbers.
template <int D> RVE_HD bool are_finite(const double *component)
{
  for (int a = 0; a < D; ++a)
    if (!std::isfinite(component[a])) return false;
  return true;
}

/// Text of D components, separated by `between`.
template <int D> std::string in_words(const double *component, const char *between)
{
  std::string text = rve::number(component[0]);
  for (int a = 1; a < D; ++a) text += rve::concat(between, component[a]);
  return text;
}

/// The points of this rank. Arrays have `count` elements. A step changes fields that are not const,
/// the state variables, and the first D components of positions and velocities.
template <int D> struct PointView : PointFields<D, Pointer> {
  int count = 0;
  int memory_width = 0;                ///< doubles in a row of `memory`
  const std::int64_t *id = nullptr;    ///< used in messages
  Rows3 position;                      ///< centre [length]
  Rows3 velocity;                      ///< [length/time]
  Rows3 body_force;                    ///< [force]; a step only reads it
  double *memory = nullptr;            ///< rows of state variables
  const int *model = nullptr;          ///< index of the constitutive model
  const int *rigid_body = nullptr;     ///< index of the rigid body, or -1 for a deformable point
  WaterFields<D, Pointer> water;       ///< null unless SolverOptions::water exists

  /// Volumes of a point with the volume `all` [length³]. The point must have fields of water.
  RVE_HD PoreVolumes pore_volumes(int p, double all) const
  {
    return {water.water_volume[p], water.grain_volume[p], all};
  }
};

/// A traction vector [stress] on one face of the boxes of some local points.
///
/// It acts on the current area of the face projected along its initial normal (load_extent). A
/// vertical load on a surface that tilts thus remains a load per horizontal length or area. A
/// following load is a pressure on the present face along its present normal; `traction` is then
/// the vector before the deformation. The list of loads is the same on all ranks, but the points
/// differ.
template <int D> struct TractionLoad {
  Vec<D> traction;
  Face face = Face::YHi;
  bool follows = false;
  std::vector<int> point_index;
  /// Traction of each point of point_index, which replaces `traction` unless it is empty.
  std::vector<Vec<D>> of_point{};
};

/// Error for a point that is outside of the grid, inverted or not finite. The message names its id
/// and position. The error can occur on one rank only.
class PointError : public std::runtime_error {
 public:
  PointError(std::int64_t id, const std::string &message) :
      std::runtime_error(message), point_id(id)
  {
  }
  std::int64_t point_id;
};

}    // namespace mpm
