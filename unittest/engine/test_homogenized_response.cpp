// SPDX-License-Identifier: GPL-2.0-only
// Tests the homogenization of contacts. Stress and stiffness of a lattice are compared with closed
// forms, and Love's stress with the derivative of the elastic energy.

#include "oracle/love_sum.h"
#include "support/lattice.h"
#include "support/rve_rig.h"

#include "rve/engine/contact_network.h"

#include <gtest/gtest.h>

using namespace rve;
using namespace rve_test;

namespace {

// ---- perfect hexagonal lattice ----

constexpr double RADIUS = 0.005;
constexpr double STIFFNESS = 1e6;
constexpr double THICKNESS = 0.075;

RveState hexagonal_lattice(double overlap, double tangential_stiffness)
{
  Material material = paper_material();
  material.normal_stiffness = STIFFNESS;
  material.tangential_stiffness = tangential_stiffness;
  material.thickness = THICKNESS;
  return rve_test::hexagonal_lattice(material, RADIUS, overlap);
}

/// Returns the change of stress of the lattice per strain, for a small homogeneous strain
/// increment.
Tensor2 stress_rate(const Tensor2 &strain, double overlap, double tangential_stiffness)
{
  RveRig rig(hexagonal_lattice(overlap, tangential_stiffness));
  const double size = 1e-9;
  const Tensor2 before = rig.evaluate().stress;
  Drive drive;
  drive.dt = 1e-6;
  drive.substeps = 10;
  drive.deformation = Tensor2::identity() + size * strain;
  return (1.0 / size) * (rig.advance(drive).stress - before);
}

}    // namespace

TEST(HexagonalLattice, PressureIsThatOfItsSixContactsPerGrain)
{
  for (const double overlap : {1e-4, 1e-5, 1e-6}) {
    RveRig rig(hexagonal_lattice(overlap, STIFFNESS));

    const Result &result = rig.evaluate();

    // N disks have 3 N contacts. p = sqrt(3) k_n delta/(d z), with the overlap delta, the spacing d
    // and the thickness z. Positions are exact to 2^-53 of the cell, or 6e-18 m. This is 6e-12 of
    // the smallest overlap. A few roundings add to it.
    const double pressure =
        std::sqrt(3.0) * STIFFNESS * overlap / ((2.0 * RADIUS - overlap) * THICKNESS);
    EXPECT_EQ(result.num_contacts, 108);
    EXPECT_EQ(result.coordination_number, 6.0);
    EXPECT_NEAR(result.mean_stress() / pressure, 1.0, 1e-10);
    EXPECT_LT(result.deviatoric_stress(), 1e-10 * pressure);
    EXPECT_NEAR(result.fabric(0, 0), 0.5, 1e-10);
    EXPECT_NEAR(result.void_ratio,
                std::sqrt(12.0) / M_PI * std::pow(1.0 - 0.5 * overlap / RADIUS, 2) - 1.0, 1e-12);
  }
}

TEST(HexagonalLattice, StiffnessIsThatOfItsSprings)
{
  // The closed forms omit terms of the order of the relative overlap, 1e-6, and of the strain.
  const double overlap = 1e-8;
  for (const double kt : {0.0, 0.4 * STIFFNESS, STIFFNESS}) {
    const double unit = 2.0 / (std::sqrt(3.0) * THICKNESS);
    const double c1111 = unit * (9.0 / 8.0 * STIFFNESS + 3.0 / 8.0 * kt);
    const double c1122 = unit * 3.0 / 8.0 * (STIFFNESS - kt);
    const double c1212 = unit * 3.0 / 8.0 * (STIFFNESS + kt);

    const Tensor2 stretch = stress_rate(Tensor2{{1.0, 0.0, 0.0, 0.0}}, overlap, kt);
    const Tensor2 other = stress_rate(Tensor2{{0.0, 0.0, 0.0, 1.0}}, overlap, kt);
    const Tensor2 shear = stress_rate(Tensor2{{0.0, 0.5, 0.5, 0.0}}, overlap, kt);

    EXPECT_NEAR(stretch(0, 0) / c1111, 1.0, 1e-5);
    EXPECT_NEAR(other(1, 1) / c1111, 1.0, 1e-5);
    EXPECT_NEAR((stretch(1, 1) - c1122) / c1111, 0.0, 1e-5);
    EXPECT_NEAR((other(0, 0) - c1122) / c1111, 0.0, 1e-5);
    EXPECT_NEAR(shear(0, 1) / c1212, 1.0, 1e-5);    // sigma_12 = 2 C1212 eps_12 with eps_12 = 1/2
    EXPECT_NEAR(shear(1, 0) / c1212, 1.0, 1e-5);
    EXPECT_NEAR(shear(0, 0) / c1111, 0.0, 1e-5);
    EXPECT_NEAR(stretch(0, 1) / c1111, 0.0, 1e-5);
  }
}

// ---- Love's stress ----

TEST(LoveStress, IsTheDerivativeOfTheElasticEnergy)
{
  RveState packing = paper_packing();
  packing.material.friction = 0.0;
  const auto elastic_energy = [&](const Tensor2 &deformation) {
    RveState strained = packing;    // same fractional coordinates: an affine deformation
    strained.cell = deformation * packing.cell;
    return RveRig(strained).evaluate().elastic_energy;
  };
  const Tensor2 stress = RveRig(packing).evaluate().stress;
  const double volume = packing.cell_volume() * packing.material.thickness;

  int crossing = 0;
  for (const rve::TouchingPair &contact : find_contacts(packing))
    for (int a = 0; a < 2; ++a) {
      const double s = static_cast<double>(packing.fractional[2 * contact.second + a]) -
          static_cast<double>(packing.fractional[2 * contact.first + a]);
      if (std::fabs(s) > 0x1p63) ++crossing;
    }
  EXPECT_GT(crossing, 40);    // about 2 sqrt(400) contacts cross each side of the cell

  const double h = 2e-6;
  for (int a = 0; a < 2; ++a)
    for (int b = 0; b < 2; ++b) {
      const Tensor2 step = gradient(a, b, h);
      const double slope = (elastic_energy(Tensor2::identity() + step) -
                            elastic_energy(Tensor2::identity() - step)) /
          (2.0 * h);
      // Energies are summed in units of 2^-38 F r = 7e-12 J. For 875 contacts the error is 1e-10 J,
      // or 0.02 Pa after division by 2 h V, with the strain step h and the volume V. The few
      // contacts that open or close within the strain h add less than 0.01 Pa.
      EXPECT_NEAR(slope / volume, stress(a, b), 2e-6 * 1e5);
    }
}

TEST(LoveStress, MatchesTheSumOverAllPairsAfterStrongShear)
{
  for (const Format format : ALL_FORMATS) {
    RveState packing = paper_packing();
    packing.material.friction = 0.0;    // forces follow from positions alone
    RveRig rig(packing, cpu_options(format));

    // At the final shear strain of 1.5, all neighbours have changed.
    const Result &result = rig.strain(gradient(0, 1, 2.0), 5e-5, 1000, 15);

    const LoveSum oracle = love_sum(rig.state());
    const double rounding = format == Format::Double ? 1e-10
        : format == Format::Mixed                    ? 1e-6
                                                     : 1e-4;
    EXPECT_GT(result.counters.rebuilds, 50);
    EXPECT_GE(result.counters.lattice_reductions, 1);
    // In `fast`, the engine can miss a contact whose overlap is below the rounding error.
    EXPECT_NEAR(result.num_contacts, oracle.num_contacts, format == Format::Fast ? 1 : 0)
        << to_string(format);
    for (int k = 0; k < 4; ++k)
      EXPECT_NEAR(result.stress.component[k], oracle.stress.component[k],
                  rounding * result.mean_stress())
          << to_string(format);
  }
}

TEST(LoveStress, DoesNotDependOnTheChoiceOfLatticeVectors)
{
  RveRig rig(paper_packing());
  rig.strain(gradient(0, 1, 0.05), 5e-5, 2000);
  RveState state = rig.state();
  const Result before = rig.evaluate();

  // The lattice vectors change by b <- b + 2 a. Fractional coordinates change by s_x <- s_x - 2 s_y
  // in wrapping integers. The list is dropped, and the history is kept.
  for (int r = 0; r < 2; ++r) state.cell(r, 1) += 2.0 * state.cell(r, 0);
  for (int i = 0; i < state.num_grains(); ++i)
    state.fractional[2 * i] -= 2 * state.fractional[2 * i + 1];
  state.list_fractional.clear();
  state.list_cell = Tensor2::zero();
  RveState reduced = state;
  // Compared with the original lattice, the vectors of this cell are a and b - a.
  for (int r = 0; r < 2; ++r) reduced.cell(r, 1) -= 3.0 * reduced.cell(r, 0);
  for (int i = 0; i < state.num_grains(); ++i)
    reduced.fractional[2 * i] += 3 * reduced.fractional[2 * i + 1];

  const Result after = RveRig(reduced).evaluate();

  // Branch vectors have different rounding errors, of 1e-16 of the cell. Overlaps are 5e-5 m.
  EXPECT_EQ(after.num_contacts, before.num_contacts);
  for (int k = 0; k < 4; ++k)
    EXPECT_NEAR(after.stress.component[k], before.stress.component[k],
                1e-11 * before.mean_stress());
}
