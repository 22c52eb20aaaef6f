// Arrays of spheres that several tests start from.

#ifndef RVE_UNITTEST_SUPPORT_SPHERES_H
#define RVE_UNITTEST_SUPPORT_SPHERES_H

#include "engine/test_states.h"
#include "support/random.h"

#include <cmath>
#include <vector>

namespace rve_test {

/// That of the disks without a thickness.
inline rve::Material spheres_material()
{
  rve::Material material = paper_material();
  material.thickness = 1.0;
  return material;
}

/// Spheres at rest at the given places of a cell.
inline rve::RveStateOf<3> spheres_at(const rve::Material &material, const rve::Tensor3 &cell,
                                     const std::vector<double> &radius,
                                     const std::vector<double> &xyz)
{
  rve::RveStateOf<3> state;
  state.material = material;
  state.cell = cell;
  state.radius = radius;
  state.velocity.assign(3 * radius.size(), 0.0);
  state.spin.assign(3 * radius.size(), 0.0);
  state.set_positions(xyz);
  return state;
}

/// Face-centred cubic array of m^3 cubes of four spheres that touch with this overlap [length].
inline rve::RveStateOf<3> face_centred_cubic(const rve::Material &material, int m, double radius,
                                             double overlap)
{
  const double edge = std::sqrt(2.0) * (2.0 * radius - overlap);
  std::vector<double> x;
  const double corner[4][3] = {{0, 0, 0}, {0.5, 0.5, 0}, {0.5, 0, 0.5}, {0, 0.5, 0.5}};
  for (int i = 0; i < m; ++i)
    for (int j = 0; j < m; ++j)
      for (int k = 0; k < m; ++k)
        for (const auto &c : corner)
          x.insert(x.end(),
                   {edge * (i + c[0] + 0.25), edge * (j + c[1] + 0.25), edge * (k + c[2] + 0.25)});
  return spheres_at(material, (m * edge) * rve::Tensor3::identity(),
                    std::vector<double>(x.size() / 3, radius), x);
}

/// Pressure of that array: six contacts per sphere of volume l^3/sqrt(2) give p = 2 sqrt(2) k_n overlap / l^2 [stress].
inline double face_centred_pressure(const rve::Material &material, double radius, double overlap)
{
  const double distance = 2.0 * radius - overlap;
  return 2.0 * std::sqrt(2.0) * material.normal_stiffness * overlap / (distance * distance);
}

/// Its elastic constants without overlap, along the cube's axes [stress].
struct CubicConstants {
  double c11, c12, c44;
};
inline CubicConstants face_centred_constants(const rve::Material &material, double radius)
{
  const double kn = material.normal_stiffness, kt = material.tangential_stiffness;
  const double factor = std::sqrt(2.0) / (2.0 * radius);
  return {factor * (kn + kt), 0.5 * factor * (kn - kt), 0.5 * factor * (kn + kt)};
}

/// m^3 spheres around the places of a simple cubic array, of different radii, of which some touch.
inline rve::RveStateOf<3> disordered_spheres(const rve::Material &material, int m, double radius,
                                             std::uint64_t seed)
{
  Random random(seed);
  const double spacing = 1.9 * radius;
  std::vector<double> x, radii;
  for (int i = 0; i < m; ++i)
    for (int j = 0; j < m; ++j)
      for (int k = 0; k < m; ++k) {
        for (const int number : {i, j, k})
          x.push_back(spacing * (number + 0.5) + random.uniform(-0.05, 0.05) * radius);
        radii.push_back(random.uniform(0.85, 1.0) * radius);
      }
  return spheres_at(material, (m * spacing) * rve::Tensor3::identity(), radii, x);
}

}    // namespace rve_test

#endif
