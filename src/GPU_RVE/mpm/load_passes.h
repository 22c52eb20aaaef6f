// SPDX-License-Identifier: GPL-2.0-only
// Passes over tractions on faces of points.

#pragma once

#include "mpm/point_nodes.h"
#include "rve/core/pi.h"

namespace mpm {

/// Coordinate along its normal of the face on which a load acts [cells].
template <int D> RVE_HD double place_of_face(const StepView<D> &step, const PointLoad<D> &load)
{
  const int p = load.point;
  const int normal = axis_of(load.face);
  const double face =
      step.points.position[p][normal] + outward(load.face) * step.points.half_size[p][normal];
  return step.follows() ? step.box[p].place[normal] + outward(load.face) * step.box[p].half[normal]
                        : step.grid.scaled(face, normal);
}

/// Extent out of the plane of the face on which a load acts [length]: the thickness or, in
/// axisymmetry, the present circumference of the middle of the face.
template <int D> RVE_HD double depth_of_face(const StepView<D> &step, const PointLoad<D> &load)
{
  if (!step.is_axisymmetric()) return step.thickness;
  const double radius = axis_of(load.face) == 0
      ? step.grid.cell_size() * step.grid.radius(place_of_face(step, load))
      : step.points.position[load.point][0];
  return 2.0 * rve::kPi * radius;
}

/// Area on which the traction acts [length²]: the area of the deformed face projected along its
/// initial normal. In 2D it is the depth of the face times |F_tt| times the initial length of the
/// face, with the axis t along the face and the deformation gradient F. In 3D it is the projected
/// area of the parallelogram that the two edges of the face span.
template <int D> RVE_HD double load_extent(const StepView<D> &step, const PointLoad<D> &load)
{
  static_assert(D == 2 || D == 3, "a face has one or two tangential axes");
  const int normal = axis_of(load.face);
  const Vec<D> &half = step.points.half_size[load.point];
  const Tensor<D> &F = step.points.deformation_gradient[load.point];
  if constexpr (D == 2) {
    const int tangent = 1 - normal;
    return 2.0 * half[tangent] * std::abs(F(tangent, tangent)) * depth_of_face(step, load);
  } else {
    const int s = (normal + 1) % 3, t = (normal + 2) % 3;
    return 4.0 * half[s] * half[t] * std::abs(F(s, s) * F(t, t) - F(s, t) * F(t, s));
  }
}

/// Force of a load [force]. A following load acts on the present area vector A det(F) F^-T N of the
/// face, where A is its initial area and N its initial normal (Nanson's formula). det(F) F^-T N is
/// a column of the cofactor matrix of F.
template <int D> RVE_HD Vec<D> load_force(const StepView<D> &step, const PointLoad<D> &load)
{
  Vec<D> force;
  if (!load.follows) {
    const double extent = load_extent(step, load);
    for (int c = 0; c < D; ++c) force[c] = load.traction[c] * extent;
    return force;
  }
  const int normal = axis_of(load.face);
  const Vec<D> &half = step.points.half_size[load.point];
  const Tensor<D> &F = step.points.deformation_gradient[load.point];
  if constexpr (D == 2) {
    const int tangent = 1 - normal;
    const double length = 2.0 * half[tangent] * depth_of_face(step, load);
    force[normal] = load.traction[normal] * length * F(tangent, tangent);
    force[tangent] = -(load.traction[normal] * length * F(normal, tangent));
  } else {
    const int s = (normal + 1) % 3, t = (normal + 2) % 3;
    const double area = 4.0 * half[s] * half[t];
    for (int c = 0; c < 3; ++c) {
      const int a = (c + 1) % 3, b = (c + 2) % 3;
      force[c] = load.traction[normal] * area * (F(a, s) * F(b, t) - F(b, s) * F(a, t));
    }
  }
  return force;
}

/// Checks loads and finds bounds of their forces.
template <int D> struct PrepareLoad : LoadPass<D> {
  using Pass<D>::step;
  static constexpr int STAGE = 0;
  bool bounds_forces;

  template <class Tally> RVE_HD void operator()(int k, Tally &tally) const
  {
    const PointLoad<D> &load = step.loads[k];
    if (step.points.rigid_body[load.point] >= 0) {
      tally.error(load.point, ErrorCode::RigidTraction);
    } else if (!are_finite<D>(load.traction.component)) {
      tally.error(load.point, ErrorCode::Traction);
    } else if (bounds_forces) {
      tally.raise(step.load_maximum(load.load), largest<D>(load_force(step, load).component));
    }
  }
};

/// Adds the tractions on faces of boxes of points to the sums of forces,
///   f_I = t A N_t,I(x_t) H_n,I(x_face)
/// with the traction t, the area A of the face, the shape function N_t of the point along the face
/// and the hat function H_n along the normal. N_t is taken at the point, H_n at the position of the
/// face. A uniform stress σ is then in equilibrium, to round-off, with the traction t = σ n, where
/// n is the outward normal (doc/src/theory_mpm.rst, tractions).
template <int D> struct ScatterLoad : LoadPass<D> {
  using Pass<D>::step;
  rve::FixedScale scale = {};

  RVE_HD void begin() { scale = step.force_scale(); }
  template <class Sums> RVE_HD void operator()(int k, const Sums &sums) const
  {
    const PointLoad<D> &load = step.loads[k];
    const int p = load.point;
    const int normal = axis_of(load.face);
    const double xi = place_of_face(step, load);

    // the three rows contain the face and do not reach beyond the ghost layer
    const int row = static_cast<int>(std::floor(xi));
    const int highest = step.grid.cells(normal) - 1;
    AxisWeights across = {row < -1 ? -1 : row > highest ? highest : row, {}, {}};
    for (int b = 0; b < 3; ++b)
      across.value[b] = larger(0.0, 1.0 - std::abs(xi - (across.first + b)));
    const Vec<D> whole = load_force(step, load);
    each_part(step, p, [&](const Support<D> &of_part, const BoxPart<D> &part) {
      if (part.place[normal] != 0) return;    // one part represents all parts across the face
      Support<D> support = of_part;
      for (int a = 0; a < D; ++a)
        if (a == normal) support.axis[a] = across;
      support.locate(step.grid);
      double share = part.count == 1 ? 1.0 : part.share() * step.box[p].parts(normal);
      // all parts along the axis of symmetry have the same radius
      if (part.is_ring && normal == 0) share = 1.0 / step.box[p].parts(1);
      for (int c = 0; c < D; ++c) {
        const double force = whole[c] * share;
        scatter<width_of<D>(VectorSums)>(
            support, scale, force,
            [&](const NodeIndex<D> &place) { return force * support.value(place); },
            sums[VectorSums], c);
      }
    });
  }
};

}    // namespace mpm
