// SPDX-License-Identifier: GPL-2.0-only
// Colliding spheres must have the same motion in the engine and in LAMMPS' pair_style granular. The
// engine and LAMMPS define velocities half a step apart. The spheres start without contacts, so
// velocities are constant at first and this difference has no effect.

#include "rve/engine/contact_model.h"
#include "script.h"
#include "support/random.h"
#include "support/spheres.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

using rve_test::Spheres;
using Vector = rve::Vec<double, 3>;

namespace {

constexpr int ROWS = 4;
constexpr double RADIUS = 0.005, SPACING = 0.0106, WIDTH = ROWS * SPACING;    // [m]
constexpr double DT = 1e-5;      // [s], a collision takes about 100 steps
constexpr double SPEED = 0.5;    // [m/s]

const rve::Tensor3 CELL{
    {WIDTH, 0.2 * WIDTH, -0.15 * WIDTH, 0.0, WIDTH, 0.25 * WIDTH, 0.0, 0.0, WIDTH}};

std::string digits(double x)
{
  char text[32];
  std::snprintf(text, sizeof(text), "%.17g ", x);
  return text;
}

/// Returns spheres without contacts. If `in_plane` is true, they move in a plane and spin about its
/// normal.
Spheres gas(const rve::Material &material, bool in_plane)
{
  rve_test::Random random(11);
  std::vector<double> places, radii;
  Spheres state;
  std::vector<double> velocity, spin;
  for (int k = 0; k < (in_plane ? 1 : ROWS); ++k)
    for (int j = 0; j < ROWS; ++j)
      for (int i = 0; i < ROWS; ++i) {
        const Vector place = CELL * Vector{{(i + 0.5) / ROWS, (j + 0.5) / ROWS, (k + 0.5) / ROWS}};
        radii.push_back(random.uniform(0.9, 1.0) * RADIUS);
        for (int a = 0; a < 3; ++a) {
          const bool moves = !in_plane || a < 2, turns = !in_plane || a == 2;
          places.push_back(place[a] + (moves ? random.uniform(-2e-5, 2e-5) : 0.0));
          velocity.push_back(moves ? random.uniform(-SPEED, SPEED) : 0.0);
          spin.push_back(turns ? random.uniform(-SPEED, SPEED) / RADIUS : 0.0);
        }
      }
  state = rve_test::spheres(material, CELL, radii, places);
  state.velocity = velocity;
  state.spin = spin;
  return state;
}

class Lammps : public Script {
 public:
  Lammps(const Spheres &state, const std::string &law)
  {
    *this << "units si\ndimension 3\nboundary p p p\natom_style sphere\natom_modify sort 0 0\n"
             "newton off\ncomm_modify vel yes\nregion box prism 0 " +
            digits(WIDTH) + "0 " + digits(WIDTH) + "0 " + digits(WIDTH) + digits(CELL(0, 1)) +
            digits(CELL(0, 2)) + digits(CELL(1, 2)) + "units box\ncreate_box 1 box\n";
    const std::vector<double> places = state.positions();
    for (int i = 0; i < state.num_grains(); ++i) {
      const std::string id = std::to_string(i + 1);
      const double *place = &places[3 * i];
      *this << "create_atoms 1 single " + digits(place[0]) + digits(place[1]) + digits(place[2]) +
              "units box\nset atom " + id + " diameter " + digits(2.0 * state.radius[i]) +
              "\nset atom " + id + " density " + digits(state.material.density) + "\nset atom " +
              id + " vx " + digits(state.velocity[3 * i]) + "vy " +
              digits(state.velocity[3 * i + 1]) + "vz " + digits(state.velocity[3 * i + 2]) +
              "omega " + digits(state.spin[3 * i]) + digits(state.spin[3 * i + 1]) +
              digits(state.spin[3 * i + 2]) + "\n";
    }
    *this << "pair_style granular\npair_coeff * * " + law + "\ntimestep " + digits(DT) +
            "\nneighbor 2e-3 bin\nneigh_modify delay 0 every 1 check yes\n"
            "fix integrate all nve/sphere\n";
  }
};

/// Differences between the engine and LAMMPS after a run.
struct Difference {
  double place = 0.0;    ///< [m]
  double spin = 0.0;     ///< difference of spins at the middle of a step [1/s]
};

Difference difference(Spheres state, const std::string &law, int steps)
{
  Lammps lammps(state, law);
  lammps << "run " + std::to_string(steps);
  rve::Options options = rve_test::sphere_options();
  options.arms = rve::Arms::Lammps;
  options.contacts = rve::contacts_of(state);
  rve_test::SphereRig rig(state, options);
  rig.strain(rve::Tensor3::zero(), DT, steps);
  const Spheres after = rig.state();
  const std::vector<double> places = after.positions();

  const LAMMPS_NS::Atom *atom = lammps.lmp->atom;
  Difference found;
  const rve::Tensor3 to_fraction = rve::inverse(CELL);
  for (int k = 0; k < atom->nlocal; ++k) {
    const int i = static_cast<int>(atom->tag[k]) - 1;
    Vector apart;
    for (int a = 0; a < 3; ++a) apart[a] = atom->x[k][a] - places[3 * i + a];
    const Vector fraction = to_fraction * apart;
    Vector images;
    for (int a = 0; a < 3; ++a) images[a] = std::round(fraction[a]);
    apart = apart - CELL * images;
    const double inertia = 0.4 * atom->rmass[k] * atom->radius[k] * atom->radius[k];
    for (int a = 0; a < 3; ++a) {
      found.place = std::fmax(found.place, std::fabs(apart[a]));
      const double before = atom->omega[k][a] - 0.5 * DT * atom->torque[k][a] / inertia,
                   behind = atom->omega[k][a] + 0.5 * DT * atom->torque[k][a] / inertia;
      found.spin = std::fmax(found.spin,
                             std::fmin(std::fabs(before - after.spin[3 * i + a]),
                                       std::fabs(behind - after.spin[3 * i + a])));
    }
  }
  return found;
}

rve::Material springs(double friction)
{
  rve::Material material;
  material.normal_stiffness = 1e5;
  material.tangential_stiffness = 8e4;
  material.friction = friction;
  material.density = 2650.0;
  return material;
}

}    // namespace

// The programs round differently. Each collision amplifies the difference about tenfold.

TEST(MotionOfSpheres, WithoutFrictionAgreesWithLammps)
{
  const Difference found =
      difference(gas(springs(0.0), false),
                 "hooke 1e5 0 tangential linear_history 8e4 0 0 damping velocity", 1600);

  EXPECT_LT(found.place, 1e-9 * RADIUS);
}

TEST(MotionOfSpheres, InAPlaneWithFrictionAgreesWithLammps)
{
  // If all spheres move in a plane, spin axes are perpendicular to the contact normals, and no
  // contact rotates about its own normal.
  const Difference found =
      difference(gas(springs(0.4), true),
                 "hooke 1e5 0 tangential linear_history 8e4 0 0.4 damping velocity", 1600);

  EXPECT_LT(found.place, 1e-9 * RADIUS);
  EXPECT_LT(found.spin, 1e-8 * SPEED / RADIUS);
}

TEST(MotionOfSpheres, InSpaceWithFrictionDiffersByTermsThatLammpsOmits)
{
  // LAMMPS omits the rotation of forces about the normal, and uses the normal at the end of a step
  // instead of its middle. The differences follow from spins of about 100 rad/s and collisions of a
  // millisecond.
  const Difference found =
      difference(gas(springs(0.4), false),
                 "hooke 1e5 0 tangential linear_history 8e4 0 0.4 damping velocity", 400);

  EXPECT_LT(found.place, 5e-4 * RADIUS);
  EXPECT_LT(found.spin, 1e-2 * SPEED / RADIUS);
  EXPECT_GT(found.spin, 1e-4 * SPEED / RADIUS);
}
