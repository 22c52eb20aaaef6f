// SPDX-License-Identifier: GPL-2.0-only
// The UMAT of examples/umat, called as by a finite element program. Stresses must be bitwise equal
// to those of librve, and tangents must be their derivatives. STATEV must identify the state of an
// RVE. If an increment fails, the UMAT must request a smaller one.

#include "librve.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

extern "C" void umat_(double *stress, double *statev, double *ddsdde, double *sse, double *spd,
                      double *scd, double *rpl, double *ddsddt, double *drplde, double *drpldt,
                      const double *stran, const double *dstran, const double *time,
                      const double *dtime, const double *temp, const double *dtemp,
                      const double *predef, const double *dpred, const char *cmname, const int *ndi,
                      const int *nshr, const int *ntens, const int *nstatv, const double *props,
                      const int *nprops, const double *coords, const double *drot, double *pnewdt,
                      const double *celent, const double *dfgrd0, const double *dfgrd1,
                      const int *noel, const int *npt, const int *layer, const int *kspt,
                      const int *kstep, const int *kinc);

namespace {

constexpr double DT_SPHERES = 2e-6, DT_DISKS = 1e-5;
constexpr int STEPS = 20;

using Strain = std::array<double, 6>;      // 11, 22, 33, 12, 13, 23, engineering shear
using Gradient = std::array<double, 9>;    // rows one after another
using Tangent = std::array<double, 36>;    // columns one after another
using State = std::array<double, 3>;

constexpr Gradient IDENTITY = {1, 0, 0, 0, 1, 0, 0, 0, 1};

struct Answer {
  Strain stress{};
  State state{};
  Tangent tangent{};
  double new_time = 1.0;
};

/// An integration point of a finite element program.
struct Point {
  std::string material = "S500";
  double largest_step = DT_SPHERES, probe = 0.0;
  bool finite_strain = false;
  int element = 0, nshr = 3;

  Answer call(const State &state, const Strain &dstran, const Gradient &f0 = IDENTITY,
              const Gradient &f1 = IDENTITY) const
  {
    Answer answer;
    answer.state = state;
    std::string name = material + std::string(80 - material.size(), ' ');    // Fortran string
    const std::array<double, 4> props = {1.0, largest_step, probe, finite_strain ? 1.0 : 0.0};
    const double duration = STEPS * largest_step, coords[3] = {0.0, 0.0, 0.0};
    const int ndi = 3, ntens = ndi + nshr, nstatv = 3, nprops = 4, point = 1;
    double none[9] = {};
    const int nothing = 0;
    // matrices in Fortran's order
    Gradient columns0{}, columns1{};
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        columns0[i + 3 * j] = f0[3 * i + j];
        columns1[i + 3 * j] = f1[3 * i + j];
      }
    umat_(answer.stress.data(), answer.state.data(), answer.tangent.data(), none, none, none, none,
          none, none, none, none, dstran.data(), none, &duration, none, none, none, none,
          name.c_str(), &ndi, &nshr, &ntens, &nstatv, props.data(), &nprops, coords, none,
          &answer.new_time, none, columns0.data(), columns1.data(), &element, &point, &nothing,
          &nothing, &nothing, &nothing);
    return answer;
  }
};

Point new_point()
{
  setenv("GPU_RVE_UMAT_PACKINGS", RVE_PACKINGS_DIR, 1);
  static int element = 0;
  Point point;
  point.element = ++element;
  return point;
}

Point new_disks()
{
  Point point = new_point();
  point.material = "A_h0075";
  point.largest_step = DT_DISKS;
  return point;
}

Strain strain_of(int k)
{
  Strain strain;
  for (int c = 0; c < 6; ++c) strain[c] = 1e-4 * std::sin(1.0 + k + 2.0 * c);
  return strain;
}

Gradient stretched(const Strain &e)
{
  return {1.0 + e[0], 0.5 * e[3], 0.5 * e[4], 0.5 * e[3], 1.0 + e[1],
          0.5 * e[5], 0.5 * e[4], 0.5 * e[5], 1.0 + e[2]};
}

/// The same RVE as in Point, called directly through librve.
class Direct {
 public:
  Direct()
  {
    rve_packing *packing = nullptr;
    EXPECT_EQ(rve_packing_read((std::string(RVE_PACKINGS_DIR) + "/S500.rve").c_str(), &packing),
              RVE_SUCCESS);
    rve_batch *made = nullptr;
    EXPECT_EQ(rve_batch_create(&packing, 1, "format double device cpu threads 1", &made),
              RVE_SUCCESS);
    batch.reset(made);
    rve_packing_free(packing);
  }

  Strain advance(const Gradient &increment)
  {
    Gradient stress;
    const double dt = STEPS * DT_SPHERES / STEPS;
    const int32_t steps = STEPS;
    EXPECT_EQ(
        rve_advance(batch.get(), nullptr, 1, increment.data(), &dt, &steps, stress.data(), nullptr),
        RVE_SUCCESS);
    return {stress[0], stress[4], stress[8], stress[1], stress[2], stress[5]};
  }

 private:
  std::unique_ptr<rve_batch, void (*)(rve_batch *)> batch{nullptr, rve_batch_free};
};

TEST(Umat, HasTheBitsOfTheLibrary)
{
  const Point point = new_point();
  Direct direct;

  State state{};
  for (int k = 0; k < 4; ++k) {
    const Answer answer = point.call(state, strain_of(k));
    EXPECT_EQ(answer.stress, direct.advance(stretched(strain_of(k)))) << k;
    EXPECT_EQ(answer.new_time, 1.0);
    state = answer.state;
  }
}

TEST(Umat, IterationsChangeNoState)
{
  Point point = new_point();
  point.probe = 1e-5;
  Direct direct;

  State state{};
  for (int k = 0; k < 3; ++k) {
    point.call(state, strain_of(10 + k));
    point.call(state, strain_of(20 + k));
    const Answer answer = point.call(state, strain_of(k));
    EXPECT_EQ(answer.stress, direct.advance(stretched(strain_of(k)))) << k;
    state = answer.state;
  }
}

TEST(Umat, EarlierTrialMayBeAccepted)
{
  const Point point = new_point();
  Direct direct;

  const Answer accepted = point.call({}, strain_of(0));
  point.call({}, strain_of(1));
  const Answer next = point.call(accepted.state, strain_of(2));

  direct.advance(stretched(strain_of(0)));
  EXPECT_EQ(next.stress, direct.advance(stretched(strain_of(2))));
}

TEST(Umat, PointsAreIndependent)
{
  const Point one = new_point(), other = new_point();

  const Answer first = one.call({}, strain_of(0));
  const Answer there = other.call({}, strain_of(0));

  EXPECT_NE(first.state[0], there.state[0]);
  EXPECT_EQ(first.stress, there.stress);
  EXPECT_EQ(one.call(first.state, strain_of(1)).stress,
            other.call(there.state, strain_of(1)).stress);
}

TEST(Umat, RepeatedFirstIncrementHasTheSameRve)
{
  const Point point = new_point();

  const State first = point.call({}, strain_of(0)).state,
              again = point.call({}, strain_of(1)).state;

  EXPECT_EQ(first[0], again[0]);
}

TEST(Umat, FiniteStrainFollowsTheGradientOfDeformation)
{
  Point point = new_point();
  point.finite_strain = true;
  Direct direct;

  // F1 F0^-1 is exact, since F0 is a stretch by powers of two.
  const Gradient f0 = {2, 0, 0, 0, 0.5, 0, 0, 0, 4};
  Gradient g = stretched(strain_of(3));
  g[1] += 1e-4;    // a rotation as well
  Gradient f1;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) f1[3 * i + j] = g[3 * i + j] * f0[4 * j];
  const Answer answer = point.call({}, {}, f0, f1);

  EXPECT_EQ(answer.stress, direct.advance(g));
}

TEST(Umat, TheTangentIsTheDerivativeOfTheStress)
{
  Point point = new_point();
  point.probe = 1e-6;
  const Strain strain = strain_of(0);
  const Answer before = point.call({}, strain);

  for (int column = 0; column < 6; ++column) {
    Strain changed = strain;
    changed[column] += point.probe;
    const Answer after = point.call({}, changed);
    for (int row = 0; row < 6; ++row)
      EXPECT_NEAR(after.stress[row] - before.stress[row],
                  before.tangent[row + 6 * column] * point.probe,
                  1e-9 * std::abs(before.stress[0]))    // rounding error of 1 + strain
          << row << " by " << column;
  }
}

TEST(Umat, TheAffineStiffnessIsStifferThanTheTangent)
{
  Point affine = new_point(), consistent = new_point();
  consistent.probe = 1e-5;

  const Tangent upper = affine.call({}, strain_of(0)).tangent;
  const Tangent tangent = consistent.call({}, strain_of(0)).tangent;

  for (int k = 0; k < 6; ++k) EXPECT_GT(upper[7 * k], tangent[7 * k]) << k;
  for (int k = 0; k < 6; ++k) EXPECT_LT(upper[7 * k], 3.0 * tangent[7 * k]) << k;
}

/// For finite strain, the tangent is the derivative of the Kirchhoff stress with respect to the
/// rate of deformation, divided by the volume ratio J.
TEST(Umat, TheTangentOfFiniteStrainHasTheChangeOfVolume)
{
  Point point = new_point();
  point.probe = 1e-6;
  point.finite_strain = true;
  const Answer before = point.call({}, {}, IDENTITY, IDENTITY);

  for (int column = 0; column < 6; ++column) {
    Strain probe{};
    probe[column] = point.probe;
    const Strain after = point.call({}, {}, IDENTITY, stretched(probe)).stress;
    const double volume = column < 3 ? 1.0 + point.probe : 1.0;
    for (int row = 0; row < 6; ++row)
      EXPECT_NEAR(volume * after[row] - before.stress[row],
                  before.tangent[row + 6 * column] * point.probe,
                  1e-8 * std::abs(before.stress[0]))    // terms of second order in the probe
          << row << " by " << column;
  }
}

TEST(Umat, DisksWorkInPlaneStrain)
{
  const Point space = new_disks();
  Point plane = new_disks();
  plane.nshr = 1;

  const Answer six = space.call({}, {1e-4, -2e-4, 0, 1e-4, 0, 0}),
               four = plane.call({}, {1e-4, -2e-4, 0, 1e-4, 0, 0});

  EXPECT_LT(six.stress[1], 0.0);
  EXPECT_EQ(six.stress[2], 0.0);
  for (int k = 0; k < 4; ++k) EXPECT_EQ(four.stress[k], six.stress[k]);
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column)
      EXPECT_EQ(four.tangent[row + 4 * column], six.tangent[row + 6 * column]);
}

TEST(Umat, FailedIncrementRequestsASmallerOne)
{
  const Point point = new_point();
  const Answer before = point.call({}, strain_of(0));

  const Answer failed = point.call(before.state, {-0.3, -0.3, -0.3, 0, 0, 0});

  EXPECT_EQ(failed.new_time, 0.5);
  EXPECT_TRUE(std::isnan(failed.stress[0]));
  EXPECT_EQ(failed.state, before.state);
  Direct direct;
  direct.advance(stretched(strain_of(0)));
  EXPECT_EQ(point.call(before.state, strain_of(1)).stress, direct.advance(stretched(strain_of(1))));
}

TEST(UmatDeathTest, ReportsErrors)
{
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  const auto end = testing::ExitedWithCode(1);
  Point point = new_point();
  const Answer first = point.call({}, strain_of(0));
  const Answer second = point.call(first.state, strain_of(1));
  point.call(second.state, strain_of(2));
  EXPECT_EXIT(point.call(first.state, strain_of(1)), end, "goes back to trial 1 of this point");
  EXPECT_EXIT(point.call({99, 1, 0}, {}), end, "STATEV\\(1\\) is 99");
  EXPECT_EXIT(point.call(second.state, {NAN, 0, 0, 0, 0, 0}), end, "not a finite number");
  Point plane = new_point();
  plane.nshr = 1;
  EXPECT_EXIT(plane.call({}, {}), end, "of spheres, and NTENS 4");
  EXPECT_EXIT(new_disks().call({}, {0, 0, 1e-4, 0, 0, 0}), end, "strain out of the plane");
  Point nowhere = new_point();
  nowhere.material = "NOWHERE";
  EXPECT_EXIT(nowhere.call({}, {}), end, "NOWHERE.rve");
  Point wrong = new_point();
  wrong.largest_step = -1.0;
  EXPECT_EXIT(wrong.call({}, {}), end, "PROPS\\(2\\), largest DEM time step");
}

}    // namespace
