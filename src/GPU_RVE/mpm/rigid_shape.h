// SPDX-License-Identifier: GPL-2.0-only
// Convex rigid bodies that can turn: form, freedoms of motion, and data of a body in a time step.

#pragma once

#include "mpm/grid.h"

#include <cmath>
#include <cstdint>

namespace mpm {

/// Form of a rigid body. Face: the box around the points of the body. It does not turn and presses
/// with one face (ImposeBody in face_contact.h). The other forms are convex bodies that can turn
/// and have contact on their whole surface. Ball: a disk in 2D. Cylinder: 3D only, along the third
/// axis of the body. Convex: the intersection of half spaces.
enum class BodyForm { Face, Box, Ball, Cylinder, Convex };

template <int D> constexpr int FREEDOMS = rve::Space<D>::freedoms;

/// Velocity at `arm` [length] from the origin of a body that moves with unit rate in one freedom:
/// translation along an axis, or rotation about an axis (in 2D about the normal of the plane).
template <int D> RVE_HD Vec<D> unit_motion(int freedom, const Vec<D> &arm)
{
  Vec<D> motion = Vec<D>::zero();
  if (freedom < D) {
    motion[freedom] = 1.0;
  } else if constexpr (D == 2) {
    motion = {{-arm[1], arm[0]}};
  } else {
    const int k = freedom - D, next = (k + 1) % 3, last = (k + 2) % 3;
    motion[next] = -arm[last];
    motion[last] = arm[next];
  }
  return motion;
}

/// Velocity v + ω × r [length/time] at `arm` r of a body with these rates in its freedoms.
template <int D> RVE_HD Vec<D> velocity_at(const double *rates, const Vec<D> &arm)
{
  Vec<D> velocity = Vec<D>::zero();
  for (int k = 0; k < FREEDOMS<D>; ++k) velocity = velocity + rates[k] * unit_motion(k, arm);
  return velocity;
}

/// Tensor W of the spin of a body with these rates: W x = ω × x.
template <int D> RVE_HD Tensor<D> spin_tensor(const double *rates)
{
  Tensor<D> spin;
  for (int b = 0; b < D; ++b) {
    Vec<D> axis = Vec<D>::zero();
    axis[b] = 1.0;
    Vec<D> motion = Vec<D>::zero();
    for (int k = D; k < FREEDOMS<D>; ++k) motion = motion + rates[k] * unit_motion(k, axis);
    for (int a = 0; a < D; ++a) spin(a, b) = motion[a];
  }
  return spin;
}

/// Returns the rotation of a body with these rates during `dt` [time], accurate to round-off. The
/// rotation vector is ω dt with the spin ω; in 2D it is an angle.
///
/// Rodrigues' formula is R = I + (sin θ / θ) W + ((1 - cos θ) / θ²) W², with the spin tensor W of ω
/// dt and θ = |ω dt|. Both factors are computed as power series of θ². Unlike library functions,
/// sums and products have the same bits on CPUs and devices.
template <int D> RVE_HD Tensor<D> turn_of(const double *rates, double dt)
{
  constexpr int SERIES = 9, MOST_HALVINGS = 64;
  double square = 0.0;
  for (int k = D; k < FREEDOMS<D>; ++k) square += (dt * rates[k]) * (dt * rates[k]);
  double part = dt;    // halved until the angle is at most 1; each halving is undone by a squaring
  int halvings = 0;
  for (; square > 1.0 && halvings < MOST_HALVINGS; ++halvings) {
    square *= 0.25;
    part *= 0.5;
  }
  double of_sine = 1.0, of_cosine = 1.0;    // Horner's scheme from the last term to the first
  for (int k = SERIES; k > 0; --k) {
    of_sine = 1.0 - of_sine * (square / ((2 * k) * (2 * k + 1)));
    of_cosine = 1.0 - of_cosine * (square / ((2 * k + 1) * (2 * k + 2)));
  }
  of_cosine *= 0.5;
  const Tensor<D> spin = part * spin_tensor<D>(rates);
  Tensor<D> turn = Tensor<D>::identity() + of_sine * spin + of_cosine * (spin * spin);
  for (int k = 0; k < halvings; ++k) turn = turn * turn;
  return turn;
}

/// Solves A x = b for the free components of x by Gaussian elimination with pivots. The other
/// components keep their values. Bit k of `free` marks component k.
template <int D>
RVE_HD void solve_free(const double *matrix, const double *right, int free, double *x)
{
  constexpr int S = FREEDOMS<D>;
  double a[S][S + 1];
  int freedom[S];
  int count = 0;
  for (int i = 0; i < S; ++i)
    if (free >> i & 1) freedom[count++] = i;
  for (int i = 0; i < count; ++i) {
    const double *row = matrix + S * freedom[i];
    double rest = right[freedom[i]];
    for (int j = 0; j < S; ++j)
      if (!(free >> j & 1)) rest -= row[j] * x[j];
    for (int j = 0; j < count; ++j) a[i][j] = row[freedom[j]];
    a[i][count] = rest;
  }
  for (int k = 0; k < count; ++k) {
    int pivot = k;
    for (int i = k + 1; i < count; ++i)
      if (std::abs(a[i][k]) > std::abs(a[pivot][k])) pivot = i;
    for (int j = k; j <= count; ++j) {
      const double value = a[k][j];
      a[k][j] = a[pivot][j];
      a[pivot][j] = value;
    }
    for (int i = k + 1; i < count; ++i) {
      const double factor = a[i][k] / a[k][k];
      for (int j = k; j <= count; ++j) a[i][j] -= factor * a[k][j];
    }
  }
  for (int k = count - 1; k >= 0; --k) {
    double value = a[k][count];
    for (int j = k + 1; j < count; ++j) value -= a[k][j] * x[freedom[j]];
    x[freedom[k]] = value / a[k][k];
  }
}

/// Half space on the inner side of a plane. The normal of the plane points outward.
template <int D> struct HalfSpace {
  Vec<D> normal;    ///< unit vector in the axes of a body
  double
      distance;    ///< distance from the centre of the body to the plane along the normal [length]
};

/// Largest number of half spaces of a body.
constexpr int MOST_HALF_SPACES = 64;

/// A convex body with its position and orientation.
template <int D> struct RigidShape {
  BodyForm form = BodyForm::Box;
  int num_half_spaces = 0;           ///< used by the form Convex
  Vec<D> centre = Vec<D>::zero();    ///< [length]
  /// Half sizes along the axes of the body; the first is the radius of round bodies [length].
  Vec<D> half = Vec<D>::zero();
  Tensor<D> orientation = Tensor<D>::identity();    ///< columns: axes of the body
  HalfSpace<D> half_space[MOST_HALF_SPACES] = {};

  /// Points at which a line enters and leaves the body.
  struct Crossing {
    double place[2];     ///< coordinates along the line [length]
    Vec<D> normal[2];    ///< outward normals
    double depth[2];     ///< distances to the nearest other face [length]
  };

  /// Finds where the line through `point` along a coordinate axis enters and leaves the body.
  /// Coordinates along the line start at `point`. Returns false if the line does not meet the body.
  /// A line that is parallel to a face still meets the body if it is at most `tolerance` [length]
  /// outside of the face.
  RVE_HD bool cross(const Vec<D> &point, int axis, double tolerance, Crossing &crossing) const
  {
    const Vec<D> start = transpose(orientation) * (point - centre);
    Vec<D> direction;
    for (int b = 0; b < D; ++b) direction[b] = orientation(axis, b);
    if (form == BodyForm::Convex) return cross_planes(start, direction, tolerance, crossing);
    constexpr int ROUND = -1;
    crossing.place[0] = -1e300;
    crossing.place[1] = 1e300;
    int face[2] = {D, D};    // body axis normal to the flat face that the line meets, or ROUND
    const auto narrow = [&](int end, double place, const Vec<D> &normal, int which) {
      if (end == 0 ? place > crossing.place[0] : place < crossing.place[1]) {
        crossing.place[end] = place;
        crossing.normal[end] = orientation * normal;
        face[end] = which;
      }
    };
    for (int b = first_flat(); b < D; ++b) {
      if (std::abs(direction[b]) < PARALLEL) {
        if (std::abs(start[b]) > half[b] + tolerance) return false;
        continue;
      }
      const double to_low = (-half[b] - start[b]) / direction[b];
      const double to_high = (half[b] - start[b]) / direction[b];
      Vec<D> normal = Vec<D>::zero();
      normal[b] = to_low < to_high ? -1.0 : 1.0;
      narrow(0, to_low < to_high ? to_low : to_high, normal, b);
      normal[b] = -normal[b];
      narrow(1, to_low < to_high ? to_high : to_low, normal, b);
    }
    double square = 0.0, product = 0.0, distance = -half[0] * half[0];
    for (int b = 0; b < first_flat(); ++b) {
      square += direction[b] * direction[b];
      product += direction[b] * start[b];
      distance += start[b] * start[b];
    }
    if (first_flat() > 0 && square < 1e-24) {
      if (distance > 2.0 * half[0] * tolerance) return false;
    } else if (first_flat() > 0) {
      const double root = product * product - square * distance;
      if (!(root > 0.0)) return false;
      for (int end = 0; end < 2; ++end) {
        const double place = (-product + (end == 0 ? -1.0 : 1.0) * std::sqrt(root)) / square;
        Vec<D> normal = Vec<D>::zero();
        for (int b = 0; b < first_flat(); ++b)
          normal[b] = (start[b] + place * direction[b]) / half[0];
        narrow(end, place, normal, ROUND);
      }
    }
    if (!(crossing.place[0] < crossing.place[1])) return false;
    for (int end = 0; end < 2; ++end) {
      double &depth = crossing.depth[end];
      depth = 1e300;
      double off_axis = 0.0;
      for (int b = 0; b < D; ++b) {
        const double place = start[b] + crossing.place[end] * direction[b];
        const double below = half[b] - std::abs(place);
        if (b < first_flat())
          off_axis += place * place;
        else if (b != face[end] && below < depth)
          depth = below;
      }
      if (first_flat() == 0 || face[end] == ROUND) continue;
      const double below = half[0] - std::sqrt(off_axis);
      if (below < depth) depth = below;
    }
    return true;
  }

  /// Returns the outward normal of the face that is nearest to `point`, a position inside the body.
  RVE_HD Vec<D> normal_at(const Vec<D> &point) const
  {
    const Vec<D> start = transpose(orientation) * (point - centre);
    if (form == BodyForm::Convex) return orientation * normal_of_planes(start);
    Vec<D> normal = Vec<D>::zero();
    double depth = 1e300;
    for (int b = first_flat(); b < D; ++b)
      if (half[b] - std::abs(start[b]) < depth) {
        depth = half[b] - std::abs(start[b]);
        normal = Vec<D>::zero();
        normal[b] = start[b] < 0.0 ? -1.0 : 1.0;
      }
    double square = 0.0;
    for (int b = 0; b < first_flat(); ++b) square += start[b] * start[b];
    const double distance = std::sqrt(square);
    if (first_flat() > 0 && half[0] - distance < depth) {
      normal = Vec<D>::zero();
      if (distance > 0.0)
        for (int b = 0; b < first_flat(); ++b) normal[b] = start[b] / distance;
      else
        normal[0] = 1.0;
    }
    return orientation * normal;
  }

  /// Radius of a sphere around the body [length].
  RVE_HD double radius() const
  {
    if (form == BodyForm::Ball) return half[0];
    double square = 0.0;
    for (int b = form == BodyForm::Cylinder ? 1 : 0; b < D; ++b) square += half[b] * half[b];
    return std::sqrt(square);
  }

 private:
  /// Index of the first body axis along which flat faces bound the body. Along the axes before it
  /// the surface is round.
  RVE_HD int first_flat() const
  {
    return form == BodyForm::Ball ? D : form == BodyForm::Cylinder ? 2 : 0;
  }

  static constexpr double PARALLEL = 1e-12;    // sine of an angle; smaller angles count as 0

  /// Does the work of cross() for the form Convex, with vectors in the axes of the body.
  RVE_HD bool cross_planes(const Vec<D> &start, const Vec<D> &direction, double tolerance,
                           Crossing &crossing) const
  {
    crossing.place[0] = -1e300;
    crossing.place[1] = 1e300;
    int face[2] = {-1, -1};
    for (int k = 0; k < num_half_spaces; ++k) {
      const double slope = dot(half_space[k].normal, direction);
      const double above = dot(half_space[k].normal, start) - half_space[k].distance;
      if (std::abs(slope) < PARALLEL) {
        if (above > tolerance) return false;
        continue;
      }
      const double place = -above / slope;
      if (slope < 0.0 && place > crossing.place[0]) {
        crossing.place[0] = place;
        face[0] = k;
      } else if (slope > 0.0 && place < crossing.place[1]) {
        crossing.place[1] = place;
        face[1] = k;
      }
    }
    if (face[0] < 0 || face[1] < 0 || !(crossing.place[0] < crossing.place[1])) return false;
    const double same = SAME_DEPTH * radius();
    for (int end = 0; end < 2; ++end) {
      const Vec<D> &normal = half_space[face[end]].normal;
      const Vec<D> place = start + crossing.place[end] * direction;
      const double outward = end == 0 ? -1.0 : 1.0;
      const bool is_steep = outward * dot(normal, direction) > STEEP;
      Vec<D> sum = normal;
      double &depth = crossing.depth[end];
      depth = 1e300;
      for (int k = 0; k < num_half_spaces; ++k) {
        if (k == face[end]) continue;
        const Vec<D> &other = half_space[k].normal;
        double below = half_space[k].distance - dot(other, place);
        // lines along this axis have contacts with both faces, so their common edge sets no depth;
        // at the edge, the normal is the mean of both normals
        if (is_steep && outward * dot(other, direction) > STEEP) {
          if (below < same) sum = sum + other;
          continue;
        }
        if (!is_behind_edge(normal, other, below)) continue;
        if (below < depth) depth = below;
      }
      crossing.normal[end] = orientation * ((1.0 / std::sqrt(dot(sum, sum))) * sum);
    }
    return true;
  }

  static constexpr double SAME_DEPTH = 1e-9;    // tolerance relative to the size of the body
  /// Cosine of the angle between a normal and an axis. Of two perpendicular normals, at most one
  /// has a larger cosine.
  static constexpr double STEEP = 0.7072;

  /// True if the faces with these two normals count as having a common edge. Contacts are then
  /// limited by `below`, the depth inside of the other face [length]. Faces whose normals differ by
  /// up to 45 degrees approximate a round body and have no edge. Between 45 and 90 degrees `below`
  /// is multiplied by a factor that falls to 1 at 90 degrees. Opposite faces have no common edge.
  RVE_HD bool is_behind_edge(const Vec<D> &normal, const Vec<D> &other, double &below) const
  {
    constexpr double ROUND = 0.3;    // 1 - cos of 45.6 degrees
    const double turn = 1.0 - dot(normal, other);
    if (turn <= ROUND || turn > 2.0 - 1e-12) return false;
    if (turn < 1.0) below *= (1.0 - ROUND) / (turn - ROUND);
    return true;
  }

  /// Does the work of normal_at() for the form Convex, with vectors in the axes of the body. If
  /// several faces are nearest, the result is the mean of their normals, which preserves symmetry.
  RVE_HD Vec<D> normal_of_planes(const Vec<D> &start) const
  {
    const double same = SAME_DEPTH * radius();
    double depth = 1e300;
    Vec<D> first = Vec<D>::zero(), sum = Vec<D>::zero();
    for (int k = 0; k < num_half_spaces; ++k) {
      const double below = half_space[k].distance - dot(half_space[k].normal, start);
      if (below < depth - same) {
        depth = below;
        first = sum = half_space[k].normal;
      } else if (below < depth + same) {
        sum = sum + half_space[k].normal;
      }
    }
    const double length = std::sqrt(dot(sum, sum));
    return length > 0.5 ? (1.0 / length) * sum : first;    // normals of opposite faces cancel
  }
};

/// Data and results of a step for a body that can turn. Sums are integers over all ranks.
template <int D> struct RigidBodyStep {
  static constexpr int S = FREEDOMS<D>;

  int body;      ///< index among all bodies
  int free;      ///< bit k: freedom k obeys forces; other freedoms are prescribed
  int is_new;    ///< 1 if the body has not moved yet, otherwise 0
  int unused;
  RigidShape<D> shape;
  Vec<D> origin;    ///< centre of rotation [length]
  /// Upper bound of the distance of the surface from the origin [length]. The sums over contacts
  /// use it as the unit of lever arms.
  double reach;
  std::int64_t terms;    ///< upper bound of the number of contacts
  double before[S];      ///< rates in the previous step [length/time], [1/time]
  /// Rates of this step [length/time], [1/time]: first without contact, then the rates that satisfy
  /// the contacts, finally the rates after the impulses of the contacts.
  double now[S];
  /// Momentum with the forces of this step, without contact [mass length/time], [mass
  /// length²/time].
  double impulse[S];
  double inertia[S * S];

  std::int64_t stiffness[S * S], target[S];    ///< additions of contacts to inertia and impulse
  /// Coarse and fine parts of the impulse of the material on the body.
  std::int64_t felt_coarse[S], felt_fine[S];
  double felt[S];    ///< sum of both parts [mass length/time], [mass length²/time]
};

}    // namespace mpm
