// SPDX-License-Identifier: GPL-2.0-only
// Geometry of the contact of two ellipses or ellipsoids by their common normal.
//
// An ellipsoid is given by its centre and the symmetric tensor A = Q diag(a^2, b^2, c^2) Q^T, with
// the semi-axes a, b, c and the rotation Q. Its farthest point in the direction n is p = A n / h
// from its centre, with the support function h(n) = sqrt(n.A n). The overlap of grains i and j is
// the least translation that separates them,
//
//   delta = min over unit vectors n of f(n),    f(n) = h_i(n) + h_j(n) - r.n,
//
// with the branch r from i to j. At the minimum r - p_i - p_j = -delta n: the tangents at both
// points are perpendicular to n, the common normal (Lin & Ng 1995, Int. J. Numer. Anal. Meth.
// Geomech. 19, 653; Wellmann, Lillie & Wriggers 2008, Eng. Comput. 25, 432). A normal force that is
// a function of delta is the gradient of a potential. Every n with f(n) < 0 separates the grains.

#pragma once

#include "rve/core/arithmetic.h"
#include "rve/core/tensor.h"

namespace rve {
inline namespace RVE_ISA {

  /// Largest ratio of semi-axes for which common_normal() was tested. With an aspect ratio of 4 it
  /// needs 8 iterations, and with 6 it finds no normal for some pairs.
  constexpr double kLargestAspectRatio = 3.0;

  /// Returns the number of iterations of common_normal() for grains with at most this ratio of
  /// largest to smallest semi-axis. If rounding is smaller, the errors of normals are then below
  /// 2e-8 rad with overlaps of 0.001 radii, and below 1e-5 rad with 0.05 radii.
  constexpr int common_normal_iterations(double aspect_ratio)
  {
    return aspect_ratio <= 1.5 ? 3 : aspect_ratio <= 2.0 ? 4 : 5;
  }

  /// Support function of an ellipsoid and the point that belongs to it.
  template <class Real, int D> struct SupportPoint {
    Real height;           ///< h(n) [length]
    Vec<Real, D> point;    ///< p = grad h, from the centre [length]

    RVE_INLINE SupportPoint(const Tensor<Real, D> &shape, const Vec<Real, D> &normal)
    {
      const Vec<Real, D> image = shape * normal;
      const auto root = root_and_inverse(dot(normal, image));
      height = root.root;
      point = root.inverse * image;
    }
  };

  template <class Real, int D> RVE_INLINE Vec<Real, D> unit_vector(const Vec<Real, D> &v)
  {
    return root_and_inverse(dot(v, v)).inverse * v;
  }

  /// Returns (A - p p^T)/h, the derivative of p with respect to n. Its eigenvalue along p is zero,
  /// the others are radii of curvature [length].
  template <class Real, int D>
  RVE_INLINE Tensor<Real, D> support_hessian(const Tensor<Real, D> &shape,
                                             const SupportPoint<Real, D> &support)
  {
    return reciprocal(support.height) * (shape - dyad(support.point, support.point));
  }

  /// Returns the common normal, a unit vector from i to j, after `iterations` Newton steps
  ///
  ///   n <- unit(n + C^-1 P (r - p_i - p_j)),    P = I - n n^T,
  ///   C = H_i + H_j + (h_i + h_j) n n^T,
  ///
  /// with the Hessians H; the last term of C makes it regular. The first n is
  /// unit((A_i + A_j)^-1 r).
  /// The Hessian of f on the sphere also contains -f P. Without it each step reduces the error by
  /// only delta/R near the end, but no pair is lost. If i and j are exchanged, the normal changes
  /// its sign exactly.
  template <class Real, int D>
  RVE_INLINE Vec<Real, D> common_normal(const Tensor<Real, D> &shape_i,
                                        const Tensor<Real, D> &shape_j, const Vec<Real, D> &branch,
                                        int iterations)
  {
    Vec<Real, D> normal = unit_vector(inverse(shape_i + shape_j) * branch);
    for (int k = 0; k < iterations; ++k) {
      const SupportPoint<Real, D> i(shape_i, normal), j(shape_j, normal);
      const Vec<Real, D> error = branch - (i.point + j.point);
      const Vec<Real, D> tangential = fma(-dot(normal, error), normal, error);
      const Tensor<Real, D> hessian = support_hessian(shape_i, i) + support_hessian(shape_j, j);
      const Tensor<Real, D> regular = hessian + (i.height + j.height) * dyad(normal, normal);
      normal = unit_vector(normal + inverse(regular) * tangential);
    }
    return normal;
  }

  /// Overlap of two ellipsoids and the point of their contact, as seen from both centres. The
  /// points have the distance of the branch whatever the error of the normal, so that the torques
  /// of a pair balance. If i and j are exchanged, the points are exchanged and change sign exactly.
  template <class Real, int D> struct EllipsoidContact {
    Real overlap;                     ///< f(n); the grains touch if it is positive [length]
    Vec<Real, D> point_i, point_j;    ///< from the centres of i and j [length]

    /// An error e of the normal changes the overlap by a multiple of e^2, so that a normal of a
    /// narrower number format is good enough for an overlap of a wide one.
    RVE_INLINE EllipsoidContact(const Tensor<Real, D> &shape_i, const Tensor<Real, D> &shape_j,
                                const Vec<Real, D> &branch, const Vec<Real, D> &normal)
    {
      const SupportPoint<Real, D> i(shape_i, normal), j(shape_j, normal);
      overlap = (i.height + j.height) - dot(branch, normal);
      point_i = Real(0.5) * ((i.point - j.point) + branch);
      point_j = Real(0.5) * ((i.point - j.point) - branch);
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
