// SPDX-License-Identifier: GPL-2.0-only
// Fabric of contacts, branch vectors and forces, compared with LAMMPS' compute fabric. LAMMPS runs
// spheres with pair_style granular in a box with all tilts. The test converts their positions and
// contacts to the state of an RVE.

#include "rve/core/pi.h"
#include "rve/engine/contact_measures.h"
#include "rve/engine/state.h"
#include "script.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

namespace {

using rve::Tensor3;

constexpr int ROWS = 5;
constexpr double SPACING = 0.0096, WIDTH = ROWS * SPACING;    // [m]

class Granular : public Script {
 public:
  Granular()
  {
    const auto text = [](double x) { return std::to_string(x) + " "; };
    *this << "units si\ndimension 3\nboundary p p p\natom_style sphere\natom_modify map "
             "array\nnewton off\n"
             "comm_modify vel yes\nregion box prism 0 " +
            text(WIDTH) + "0 " + text(WIDTH) + "0 " + text(WIDTH) + text(0.2 * WIDTH) +
            text(-0.1 * WIDTH) + text(0.15 * WIDTH) +
            "units box\ncreate_box 1 box\n"
            "lattice custom " +
            text(SPACING) +
            "a1 1 0 0 a2 0.2 1 0 a3 -0.1 0.15 1 basis 0.5 0.5 0.5 origin 0.01 0.01 "
            "0.01\ncreate_atoms 1 region box\n"
            "variable diameter atom 0.0094+0.0006*random(0,1,7)\n"
            "set group all diameter v_diameter density 2650\n"
            "displace_atoms all random 2e-4 2e-4 2e-4 3 units box\n"
            "velocity all create 1e18 5\n"
            "pair_style granular\n"
            "pair_coeff * * hooke 1e5 0 tangential linear_history 8e4 0 0.4 damping velocity\n"
            "timestep 1e-5\nneighbor 2e-3 bin\nneigh_modify delay 0 every 1 check yes\n"
            "fix integrate all nve/sphere\n"
            "compute fabric all fabric radius contact branch force/normal force/tangential\n"
            "compute pairs all property/local patom1 patom2\n"
            "compute springs all pair/local p1 p2 p3\n"
            "run 300\n";
  }

  rve::RveStateOf<3> state()
  {
    LAMMPS_NS::Atom *atom = lmp->atom;
    rve::RveStateOf<3> state;
    state.material.normal_stiffness = 1e5;
    state.material.tangential_stiffness = 8e4;
    state.material.friction = 0.4;
    state.material.density = 2650.0;
    state.cell = {{WIDTH, 0.2 * WIDTH, -0.1 * WIDTH, 0.0, WIDTH, 0.15 * WIDTH, 0.0, 0.0, WIDTH}};
    std::vector<double> places;
    for (int i = 0; i < atom->nlocal; ++i) {
      const int local = atom->map(i + 1);
      state.radius.push_back(atom->radius[local]);
      places.insert(places.end(), atom->x[local], atom->x[local] + 3);
    }
    state.velocity.assign(places.size(), 0.0);
    state.spin.assign(places.size(), 0.0);
    state.set_positions(places);
    LAMMPS_NS::Compute *pairs = lmp->modify->get_compute_by_id("pairs"),
                       *springs = lmp->modify->get_compute_by_id("springs");
    pairs->compute_local();
    springs->compute_local();
    for (int k = 0; k < springs->size_local_rows; ++k) {
      const double *spring = springs->array_local[k];
      state.pairs.push_back({static_cast<std::int32_t>(pairs->array_local[k][0]) - 1,
                             static_cast<std::int32_t>(pairs->array_local[k][1]) - 1,
                             {{spring[0], spring[1], spring[2]}}});
    }
    return state;
  }
};

}    // namespace

TEST(Fabric, AgreesWithLammpsComputeFabric)
{
  Granular lammps;
  LAMMPS_NS::Compute *fabric = lammps.lmp->modify->get_compute_by_id("fabric");
  fabric->compute_vector();
  const auto measures = rve::contact_measures(lammps.state());

  EXPECT_GT(fabric->compute_scalar(), 100);    // number of contacts
  const int a[6] = {0, 1, 2, 0, 0, 1}, b[6] = {0, 1, 2, 1, 2, 2};
  const Tensor3 *tensors[4] = {&measures.contact, &measures.branch, &measures.normal_force,
                               &measures.tangential_force};
  for (int t = 0; t < 4; ++t) {
    double largest = 0.0;
    for (int k = 0; k < 6; ++k) {
      const double theirs = fabric->vector[6 * t + k];
      largest = std::fmax(largest, std::fabs(theirs));
      // The RVE rounds fractional coordinates to 2^-64. An overlap is about 1e-4 of a diameter, so
      // a force has about four digits less than a coordinate.
      EXPECT_NEAR((*tensors[t])(a[k], b[k]), theirs, 1e-9) << "tensor " << t << " component " << k;
    }
    EXPECT_GT(largest, t == 1 ? 1e-4 : 1e-2);    // the tensors are not negligible
  }
}
