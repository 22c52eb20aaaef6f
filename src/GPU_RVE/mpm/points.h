// SPDX-License-Identifier: GPL-2.0-only
// Material points as the solver sees them: arrays that the caller owns, and the loads on them.

#pragma once

#include "mpm/constitutive.h"
#include "mpm/point_fields.h"
#include "rve/core/error.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace mpm {

/// Rows of three doubles one after the other: `{&atom->x[0][0]}` of LAMMPS, or a vector of 3 n doubles.
struct Rows3 {
  double *first = nullptr;
  RVE_HD double *operator[](int i) const { return first + 3 * static_cast<std::ptrdiff_t>(i); }
};

/// Not rve::larger, which wants numbers: a `b` that is not a number is passed over.
RVE_HD inline double larger(double a, double b)
{
  return a < b ? b : a;
}

/// The largest magnitude of D components.
template <int D> RVE_HD double largest(const double *component)
{
  double result = std::abs(component[0]);
  for (int a = 1; a < D; ++a) result = larger(result, std::abs(component[a]));
  return result;
}

/// A vector of its D components.
template <int D> RVE_HD Vec<D> first_of(const double *component)
{
  Vec<D> vector;
  for (int a = 0; a < D; ++a) vector[a] = component[a];
  return vector;
}

/// Whether D components are finite numbers.
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

/// The points of this rank. Arrays have `count` entries; a step changes fields that are not const, the
/// memory of the laws and the first D components of position and velocity.
template <int D> struct PointView : PointFields<D, Pointer> {
  int count = 0;
  int memory_width = 0;                ///< doubles in a row of `memory`
  const std::int64_t *id = nullptr;    ///< for messages
  Rows3 position;                      ///< centre [length]
  Rows3 velocity;                      ///< [length/time]
  Rows3 body_force;                    ///< [force]; read only
  double *memory = nullptr;            ///< rows of what the laws remember
  const int *model = nullptr;          ///< index of the constitutive model
  const int *rigid_body = nullptr;     ///< index of the rigid body, or -1 for a deformable point
};

/// A traction vector [stress] on one face of the boxes of some local points.
///
/// It acts per current extent of the face as it is seen along its own direction (load_extent), so that a vertical load on a surface
/// that tilts stays a load per horizontal length or area. A load that follows acts along the present normal of the face, per its present
/// extent: a pressure, of which `traction` is the vector before the deformation. The list of loads is the same on all ranks; the points
/// are not.
template <int D> struct TractionLoad {
  Vec<D> traction;
  Face face = Face::YHi;
  bool follows = false;
  std::vector<int> point_index;
  /// In place of `traction`, where it varies: of each in point_index.
  std::vector<Vec<D>> of_point{};
};

/// A point that the solver cannot treat: outside the grid, inverted, not finite. The message names its id and position.
/// It may be thrown on one rank only.
class PointError : public std::runtime_error {
 public:
  PointError(std::int64_t id, const std::string &message) :
      std::runtime_error(message), point_id(id)
  {
  }
  std::int64_t point_id;
};

}    // namespace mpm
