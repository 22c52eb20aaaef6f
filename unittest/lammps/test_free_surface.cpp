// SPDX-License-Identifier: GPL-2.0-only
// A free heap of grains: its points lose all contacts, fall, and are compressed again when they
// land.

#include "grains_script.h"
#include "variable.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

using namespace grains_script;

namespace {

constexpr double GRAVITY = 9.81, TIMESTEP = 5e-4;
constexpr double PRESSURE = 2e4;    // pressure of the packing

const std::string COMPUTES =
    "compute p all rve/atom p\ncompute q all rve/atom q\ncompute status all rve/atom status\n"
    "compute elastic all rve/atom elastic\ncompute xx all rve/atom cell_xx\n"
    "compute yy all rve/atom cell_yy\n";

/// A heap of RVEs under pressure that is not supported. The heap falls freely for half a metre.
/// Then its points share grid nodes with the ground.
struct Heap {
  std::string script;
  int points;
  std::string up;
  double size;         ///< area in the plane [m²], volume in space [m³]
  double thickness;    ///< thickness of the disks [m]; unused in space
  /// In flight, at most this many RVEs still have contacts, because their moving grains collide.
  int collisions;
};

/// Returns 8 x 4 points with disks.
Heap heap_of_disks()
{
  return {"units si\ndimension 2\nboundary f f p\natom_style sphere\natom_modify map array sort 0 "
          "0.0\n"
          "region box block 0 4 0 4 -0.1 0.1 units box\ncreate_box 1 box\n"
          "lattice sq 0.25 origin 0.5 0.5 0.0\nregion ground block 1 3 1 2 -0.05 0.05 units box\n"
          "create_atoms 1 region ground\nset group all diameter 0.25\npair_style none\n"
          "neighbor 0.5 bin\ncomm_modify cutoff 0.5\ntimestep 5e-4\n"
          "fix grains all rve " +
              few_grains() +
              " threads 1 dt 1e-4 drive mpm\n"
              "fix soil all mpm 0.5 points_per_cell 4 domain 0 4 0 4 boundary ylo fixed boundary "
              "xlo roller boundary xhi roller model all rve grains density rve\n"
              "fix gravity all gravity 9.81 vector 0 -1 0\n" +
              COMPUTES,
          32,
          "y",
          2.0,
          0.075,
          4};
}

/// Returns 4 x 4 x 4 points with spheres.
Heap heap_of_spheres()
{
  const std::string file = rve_test::temporary_path("few_spheres.rve");
  Script() << BOX + "create_rve " + file +
          " shape sphere grains 30 seed 5 radius uniform 0.004 0.005 kn 1e5 friction 0.5 "
          "damping 0.3 density 2650 pressure 2e4\n";
  return {"units si\ndimension 3\nboundary f f f\natom_style sphere\natom_modify map array sort 0 "
          "0.0\n"
          "region box block 0 3 0 3 0 3 units box\ncreate_box 1 box\n"
          "lattice sc 0.25 origin 0.5 0.5 0.5\nregion ground block 1 2 1 2 1 2 units box\n"
          "create_atoms 1 region ground\nset group all diameter 0.25\npair_style none\n"
          "neighbor 0.5 bin\ncomm_modify cutoff 0.5\ntimestep 5e-4\n"
          "fix grains all rve " +
              file +
              " threads 1 dt 3e-5 drive mpm\n"
              "fix soil all mpm 0.5 points_per_cell 8 domain 0 3 0 3 0 3 boundary zlo fixed model "
              "all rve grains density rve\n"
              "fix gravity all gravity 9.81 vector 0 0 -1\n" +
              COMPUTES + "compute zz all rve/atom cell_zz\n",
          64,
          "z",
          1.0,
          0.0,
          4};
}

void expect_no_stress_and_no_energy_from_nothing(const Heap &heap)
{
  GrainsScript script;
  script << heap.script + "run 0";
  const auto of_points = [&](const std::string &formula) {
    return script.lmp->input->variable->compute_equal(formula);
  };
  const double mass = script.Script::fix_value("soil", 4);
  const auto motion_and_height = [&] {
    return script.Script::fix_value("soil", 3) +
        mass * GRAVITY * of_points("xcm(all," + heap.up + ")");
  };
  // The packing gives the elastic energy per volume of its cell. This energy density times the size
  // of the heap is the elastic energy of the heap.
  const double thickness = heap.up == "z" ? script.per_atom("zz", 0) : heap.thickness;
  const double stored = heap.size * script.per_atom("elastic", 0) /
      (script.per_atom("xx", 0) * script.per_atom("yy", 0) * thickness);
  const double at_first = motion_and_height() + stored;

  constexpr int STEPS = 20;
  bool has_landed = false;
  int open_in_flight = 0;
  double pressure_in_flight = 0.0, pressure_after = 0.0;
  for (int step = STEPS; step <= 960; step += STEPS) {
    script << "run " + std::to_string(STEPS);
    const Script::Values p = script.compute("p"), q = script.compute("q"),
                         status = script.compute("status");
    // Only gravity changes the momentum of the heap until nodes of the ground act on it.
    const double fallen =
        std::fabs(of_points("vcm(all," + heap.up + ")") + GRAVITY * TIMESTEP * step);
    has_landed = has_landed || step * TIMESTEP > 0.3;
    if (!has_landed) {
      EXPECT_LE(fallen, 1e-12) << step;
      open_in_flight = 0;    // only the last check in flight counts
    }
    for (const auto &[id, pressure] : p) {
      EXPECT_GE(pressure, -1e-9 * PRESSURE) << "atom " << id << ", step " << step;
      double &most = has_landed ? pressure_after : pressure_in_flight;
      if (step > 2 * STEPS) most = std::max(most, pressure);
      if (status.at(id) != 64.0) continue;
      EXPECT_EQ(pressure, 0.0);
      EXPECT_EQ(q.at(id), 0.0);
      if (!has_landed) ++open_in_flight;
    }
    EXPECT_LE(motion_and_height(), at_first * (1.0 + 1e-6)) << step;
  }

  // In flight, all but `collisions` RVEs have no contacts. In these few RVEs, moving grains
  // collide.
  EXPECT_GE(open_in_flight, heap.points - heap.collisions);
  EXPECT_LT(pressure_in_flight, 0.01 * PRESSURE);
  // The heap is one metre high, has 2.2 t/m^3 (spheres: 1.6) and falls at 3 m/s. Its momentum per
  // area is 6.6 kPa s (4.8). It loses this momentum in less than 0.07 s (0.05 s), which requires a
  // pressure of about 1e5 Pa.
  EXPECT_GT(pressure_after, 1e5);
  EXPECT_EQ(script.fix_value(2), 0.0);    // number of frozen RVEs
}

}    // namespace

TEST(FreeSurface, FallingHeapOfDisksHasNoSpuriousStressOrEnergy)
{
  expect_no_stress_and_no_energy_from_nothing(heap_of_disks());
}

TEST(FreeSurface, FallingHeapOfSpheresHasNoSpuriousStressOrEnergy)
{
  expect_no_stress_and_no_energy_from_nothing(heap_of_spheres());
}
