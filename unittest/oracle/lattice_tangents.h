// SPDX-License-Identifier: GPL-2.0-only
// Lattices of disks and of spheres under pressure, and their elastic tangents in closed form.

#pragma once

#include "macro/tangent.h"
#include "support/lattice.h"
#include "support/spheres.h"

#include <cmath>
#include <vector>

namespace rve_test {

constexpr double LATTICE_RADIUS = 0.005, LATTICE_OVERLAP = 4e-3 * LATTICE_RADIUS,
                 LATTICE_DISTANCE = 2.0 * LATTICE_RADIUS - LATTICE_OVERLAP;

inline rve::Material linear_springs()
{
  rve::Material material = paper_material();
  material.tangential_stiffness = 0.4 * material.normal_stiffness;
  return material;
}

inline rve::Material hertz_mindlin()
{
  rve::Material material = paper_material();
  material.law = rve::ContactLaw::Hertz;
  material.normal_stiffness = material.tangential_stiffness = 0.0;
  material.hertz_stiffness = 2e9;
  material.mindlin_stiffness = 1.7e9;
  return material;
}

inline rve::Material of_spheres(rve::Material material)
{
  material.thickness = 1.0;
  return material;
}

/// Normal force and stiffnesses of a contact in a lattice.
struct Springs {
  double force;                 ///< normal force [force]
  double normal, tangential;    ///< [force/length]
};
inline Springs springs_of(const rve::Material &material, double overlap = LATTICE_OVERLAP)
{
  if (material.law == rve::ContactLaw::Linear)
    return {material.normal_stiffness * overlap, material.normal_stiffness,
            material.tangential_stiffness};
  const double radius = std::sqrt(0.5 * LATTICE_RADIUS * overlap);    // contact radius
  return {material.hertz_stiffness * radius * overlap, 1.5 * material.hertz_stiffness * radius,
          material.mindlin_stiffness * radius};
}

/// Returns 6 by 6 disks in a square lattice.
inline rve::RveState square_lattice(const rve::Material &material, double overlap = LATTICE_OVERLAP)
{
  const double spacing = 2.0 * LATTICE_RADIUS - overlap;
  std::vector<double> xy;
  for (int i = 0; i < 36; ++i) {
    xy.push_back((i % 6 + 0.5) * spacing);
    xy.push_back((i / 6 + 0.5) * spacing);
  }
  return state_of(material, (6.0 * spacing) * rve::Tensor2::identity(),
                  std::vector<double>(36, LATTICE_RADIUS), xy);
}

/// Returns 5 by 5 by 5 spheres in a simple cubic lattice.
inline Spheres simple_cubic(const rve::Material &material, double overlap = LATTICE_OVERLAP)
{
  const double spacing = 2.0 * LATTICE_RADIUS - overlap;
  std::vector<double> x;
  for (int i = 0; i < 125; ++i)
    x.insert(x.end(),
             {(i % 5 + 0.5) * spacing, (i / 5 % 5 + 0.5) * spacing, (i / 25 + 0.5) * spacing});
  return spheres(material, (5.0 * spacing) * rve::Tensor3::identity(),
                 std::vector<double>(125, LATTICE_RADIUS), x);
}

template <int D> macro::TangentOf<D> cubic_tangent(double c11, double c12, double c44)
{
  auto tangent = macro::TangentOf<D>::isotropic(c12, 0.5 * (c11 - c12));
  for (int k = D; k < macro::TangentOf<D>::size; ++k) tangent.component[k][k] = c44;
  return tangent;
}

/// Adds the effect of the pressure p on a tangent C. Under strain, the contact forces rotate and
/// the volume changes. The result is
///   C_ijkl + p (delta_ij delta_kl - (delta_ik delta_jl + delta_il delta_jk)/2).
/// The rotation also reduces the tangential stiffness k_t of a contact with the normal force f_n
/// and the length l by f_n/l. C must already include this reduction.
template <int D> macro::TangentOf<D> under_pressure(const macro::TangentOf<D> &tangent, double p)
{
  return tangent + macro::TangentOf<D>::isotropic(p, -0.5 * p);
}

// Returns the tangent of a square lattice of disks with thickness h under pressure. Without the
// terms of under_pressure(), the tangent is the sum over the contacts of
//   l^2 (k_n nnnn + (k_t - f_n/l) n (1 - nn) n)/V,
// with the normal n, the distance l, the normal force f_n and the volume V.
inline macro::TangentOf<2> of_squares(const Springs &s, double h)
{
  const double kt = s.tangential - s.force / LATTICE_DISTANCE;
  return under_pressure(cubic_tangent<2>(s.normal / h, 0.0, 0.5 * kt / h),
                        s.force / (LATTICE_DISTANCE * h));
}
inline macro::TangentOf<2> of_hexagons(const Springs &s, double h)
{
  const double kt = s.tangential - s.force / LATTICE_DISTANCE, factor = std::sqrt(3.0) / (4.0 * h);
  return under_pressure(cubic_tangent<2>(factor * (3.0 * s.normal + kt), factor * (s.normal - kt),
                                         factor * (s.normal + kt)),
                        std::sqrt(3.0) * s.force / (LATTICE_DISTANCE * h));
}
inline macro::TangentOf<3> of_cubes(const Springs &s)
{
  const double kt = s.tangential - s.force / LATTICE_DISTANCE;
  return under_pressure(
      cubic_tangent<3>(s.normal / LATTICE_DISTANCE, 0.0, 0.5 * kt / LATTICE_DISTANCE),
      s.force / (LATTICE_DISTANCE * LATTICE_DISTANCE));
}
inline macro::TangentOf<3> of_face_centred_cubes(const Springs &s,
                                                 double distance = LATTICE_DISTANCE)
{
  const double kt = s.tangential - s.force / distance, factor = std::sqrt(0.5) / distance;
  return under_pressure(cubic_tangent<3>(2.0 * factor * (s.normal + kt), factor * (s.normal - kt),
                                         factor * (s.normal + kt)),
                        2.0 * std::sqrt(2.0) * s.force / (distance * distance));
}

}    // namespace rve_test
