// SPDX-License-Identifier: GPL-2.0-only
// Errors of input and of a run: an exception names the value, its position, and the allowed range.

#include "mpm/mohr_coulomb.h"
#include "scene.h"
#include "support/messages.h"

#include <gtest/gtest.h>
#include <limits>

using MpmSolver = mpm::MpmSolver<2>;
using mpm_test::Scene;
using rve_test::message_of;

namespace {

void expect_contains(const std::string &message, const std::string &part)
{
  EXPECT_NE(message.find(part), std::string::npos) << message;
}

/// One point in a grid of 4 x 4 cells, and its solver.
struct OnePoint {
  Scene scene;
  mpm::LinearElastic<2> law{100.0, 0.3};
  MpmSolver solver{mpm_test::grid_options({{0.0, 0.0}}, {{4.0, 4.0}}, 1.0)};

  OnePoint()
  {
    scene.add(2.0, 2.0, {{0.5, 0.5}}, 1.0);
    scene.id[0] = 4711;
    solver.set_models(std::vector<mpm::Constitutive<2> *>(1, &law));
  }
  std::string step(double dt = 1e-3)
  {
    return message_of<mpm::PointError>([&] { solver.step(scene.view(), {}, dt); });
  }
};

}    // namespace

TEST(GridInput, RefusesWrongCellsWithValueAndRange)
{
  const auto build = [](double hi, double cell) {
    return message_of<rve::InputError>([&] { mpm::Grid<2>({{0.0, 0.0}}, {{hi, 2.0}}, cell); });
  };
  expect_contains(build(2.0, -0.5), "cell size must be positive, got -0.5");
  expect_contains(build(2.3, 0.5), "must be a whole number of cells, got 2.3 / 0.5 = 4.6");
  expect_contains(build(-1.0, 0.5), "extent in x must be positive");
  expect_contains(build(2.0, std::numeric_limits<double>::quiet_NaN()),
                  "cell size must be positive");
}

TEST(SolverInput, RefusesWrongOptions)
{
  const auto build = [](auto change) {
    mpm::SolverOptions<2> options = mpm_test::grid_options({{0.0, 0.0}}, {{4.0, 4.0}}, 1.0);
    change(options);
    return message_of<rve::InputError>([&] { MpmSolver solver(options); });
  };
  expect_contains(build([](auto &o) { o.flip = 1.5; }), "flip fraction must be in [0, 1], got 1.5");
  expect_contains(build([](auto &o) { o.damping = 1.0; }),
                  "local damping must be in [0, 1), got 1");
  expect_contains(build([](auto &o) { o.thickness = 0.0; }), "thickness must be positive, got 0");
  expect_contains(build([](auto &o) { o.threads = 0; }),
                  "number of threads is 0; it must be from 1 to 1024");
}

TEST(SolverInput, RefusesATimeStepThatIsNotPositive)
{
  OnePoint set;
  for (const double dt : {0.0, -1e-3}) {
    const std::string message =
        message_of<rve::InputError>([&] { set.solver.step(set.scene.view(), {}, dt); });
    expect_contains(message, "MPM time step must be positive, got ");
  }
}

TEST(SolverInput, RefusesRowsOfMemoryThatAreTooShortForALaw)
{
  OnePoint one;
  mpm::MohrCoulomb<2> law(100.0, 0.3, 1.0, 30.0, 0.0);
  one.solver.set_models({&law});
  expect_contains(message_of<rve::InputError>([&] { one.solver.step(one.scene.view(), {}, 1e-3); }),
                  "rows of the memory of points have 0 numbers, but a law has 2 state variables");
  one.scene.begin_memory(law);
  EXPECT_NO_THROW(one.solver.step(one.scene.view(), {}, 1e-3));
}

TEST(PointTrouble, LeavingTheGridNamesThePoint)
{
  OnePoint set;
  set.scene.velocity[0] = 3000.0;

  const std::string message = set.step();

  expect_contains(message, "material point 4711 at (5, 2) is outside of the grid, x from 0 to 4");
}

TEST(PointTrouble, StartingOutsideOfTheGridNamesThePoint)
{
  for (const double x : {-1e-9, 4.0 + 1e-9, 1e300, -1e300}) {
    OnePoint set;
    set.scene.position[0] = x;
    expect_contains(set.step(), "material point 4711");
  }
}

TEST(PointTrouble, CornersOfTheGridAreInside)
{
  for (const double x : {0.0, 4.0})
    for (const double y : {0.0, 4.0}) {
      OnePoint set;
      set.scene.position[0] = x;
      set.scene.position[1] = y;
      EXPECT_EQ(set.step(), "no error");
    }
}

TEST(PointTrouble, NonFiniteValuesAreReportedAndNotSummed)
{
  const double bad = std::numeric_limits<double>::quiet_NaN();
  const auto with = [&](auto change) {
    OnePoint set;
    change(set.scene);
    return set.step();
  };
  expect_contains(with([&](Scene &s) { s.position[1] = bad; }), "position that is not finite");
  expect_contains(with([&](Scene &s) { s.velocity[0] = bad; }), "velocity that is not finite");
  expect_contains(with([&](Scene &s) { s.stress[0](0, 1) = bad; }), "stress that is not finite");
  expect_contains(with([&](Scene &s) { s.body_force[0] = bad; }), "body force that is not finite");
  expect_contains(with([&](Scene &s) { s.mass[0] = 0.0; }), "positive mass, got 0");
  expect_contains(with([&](Scene &s) { s.volume[0] = -1.0; }), "positive volume, got -1");
  expect_contains(with([&](Scene &s) { s.half_size[0][0] = 0.6; }), "half sizes in (0, 0.5]");
  expect_contains(with([&](Scene &s) { s.model[0] = 1; }),
                  "constitutive model 1, but the number of models is 1");
  expect_contains(with([&](Scene &s) { s.rigid_body[0] = 0; }),
                  "rigid body 0, but the number of rigid bodies is 0");
}

TEST(PointTrouble, SumsOutOfRangeAreRefused)
{
  OnePoint set;
  set.scene.mass[0] = 1e301;
  const std::string message =
      message_of<rve::InputError>([&] { set.solver.step(set.scene.view(), {}, 1e-3); });
  expect_contains(message, "mass of a point is too large for the sums on the grid");
}

TEST(PointTrouble, InversionNamesThePoint)
{
  OnePoint set;
  set.scene.add(1.2, 2.0, {{0.5, 0.5}}, 1.0);
  set.scene.velocity[0] = -10.0;
  set.scene.velocity[3] = 10.0;

  expect_contains(set.step(0.4), "is inverted, det(F) = ");
}

TEST(Traction, OutsideOfTheLocalPointsIsRefused)
{
  OnePoint set;
  mpm::TractionLoad<2> load;
  load.traction = {{0.0, -1.0}};
  load.point_index = {1};
  const std::string message =
      message_of<rve::InputError>([&] { set.solver.step(set.scene.view(), {load}, 1e-3); });
  expect_contains(message, "point index of a traction is 1; it must be from 0 to 0");
}

TEST(CflNumber, IsTheFastestSignalOverTheCell)
{
  OnePoint set;
  set.scene.velocity[0] = 3.0;
  set.scene.velocity[1] = 4.0;

  const double cfl = set.solver.cfl_number(set.scene.view(), 0.01);

  EXPECT_NEAR(cfl, 0.01 * (std::sqrt(set.law.p_wave_modulus(0)) + 5.0), 1e-14);
}
