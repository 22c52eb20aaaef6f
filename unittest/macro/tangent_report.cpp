// SPDX-License-Identifier: GPL-2.0-only
// Prints the tables of doc/src/dev_numerics.rst about tangents by probing: errors as a
// function of the size of the probe in each number format, and the parameters on which a loading
// tangent depends. It takes half a minute.

#include "macro/tangent_probes.h"
#include "oracle/lattice_tangents.h"
#include "oracle/network_stiffness.h"
#include "rve/engine/finite_strain.h"
#include "rve/engine/packing.h"
#include "support/packings.h"
#include "support/rve_rig.h"

#include <cstdio>

using namespace macro;
using namespace rve_test;
using rve::Tensor2;

namespace {

template <int D>
ProbedTangentOf<D> probe(const rve::RveStateOf<D> &state, const TangentOptions &options,
                         rve::Format format, const rve::Tensor<double, D> &rate)
{
  rve::Options engine = cpu_options(format);
  engine.contacts = rve::contacts_of(state);
  return TangentProbesOf<D>(rve::make_engine<D>(engine), options)
      .probe(
          1, [&](int) { return state; }, [&](int) { return rate; })[0];
}

template <int D>
void report(const char *name, const rve::RveStateOf<D> &state, const TangentOf<D> &exact)
{
  std::printf("\nelastic, %s: |C - exact|/|exact|, contacts changed\n", name);
  std::printf("probe    double          mixed           fast\n");
  for (double size = 0.1; size > 0.5e-7; size *= 0.1) {
    std::printf("%.0e  ", size);
    for (const rve::Format format : ALL_FORMATS) {
      auto options = TangentOptions::of(format, TangentKind::Elastic);
      options.probe = size;
      const auto found = probe(state, options, format, rve::Tensor<double, D>::zero());
      std::printf("%8.1e %3d    ", (found.tangent + (-1.0) * exact).norm() / exact.norm(),
                  found.changed_contacts);
    }
    std::printf("\n");
  }
}

rve::RveState at_rest(rve::RveState state)
{
  state.material.local_damping = 0.7;
  RveRig rig(state);
  rig.strain(Tensor2::zero(), 5e-6, 60000);
  return rig.state();
}

/// Returns the packing after 2 % of compression along y with the sides held at 100 kPa.
rve::RveState in_biaxial_compression()
{
  const rve::RveState start = packing_of_400();
  RveRig rig(start);
  rve::Drive drive;
  drive.dt = 4e-6;
  drive.substeps = 40000;
  drive.velocity_gradient(1, 1) = -0.02 / (drive.substeps * drive.dt);
  drive.controlled[0][0] = true;
  drive.stress_goal(0, 0) = -1e5;
  drive.servo_gain = rve::default_servo_gain(start);
  rig.advance(drive);
  return rig.state();
}

void report_loading(const char *name, const rve::RveState &state, double TangentOptions::*member,
                    std::initializer_list<double> values)
{
  const Tensor2 rate{{0.6, 0.0, 0.0, -1.0}};
  std::printf("\nloading: %s, |C : D - rate|/|rate|, response xx, yy [MPa], DEM steps\n", name);
  for (const rve::Format format : {rve::Format::Double, rve::Format::Fast})
    for (const double value : values) {
      auto options = TangentOptions::of(format, TangentKind::Loading);
      options.*member = value;
      const auto found = probe(state, options, format, rate);
      std::printf("%-6s %7.4g  %.1e  %7.3f %7.3f  %d\n", rve::to_string(format).c_str(), value,
                  found.nonlinearity, 1e-6 * found.response(0, 0), 1e-6 * found.response(1, 1),
                  found.steps);
    }
}

}    // namespace

int main()
{
  for (const rve::Material &material : {linear_springs(), hertz_mindlin()}) {
    const Springs springs = springs_of(material);
    std::printf("\n%s\n", rve::word_of(material.law));
    report("hexagonal lattice", hexagonal_lattice(material, LATTICE_RADIUS, LATTICE_OVERLAP),
           of_hexagons(springs, material.thickness));
    report("face-centred cubic lattice",
           face_centred_cubic(of_spheres(material), 2, LATTICE_RADIUS, LATTICE_OVERLAP),
           of_face_centred_cubes(springs));
  }
  const rve::RveState packing = at_rest(packing_of_400());
  report("400 disks at 100 kPa", packing, network_stiffness(packing));

  const rve::RveState loaded = in_biaxial_compression();
  const rve::RveState rested = at_rest(loaded);
  report("400 disks after 2 % of biaxial compression", rested, network_stiffness(rested));
  report_loading("probe", loaded, &TangentOptions::probe,
                 {0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001});
  report_loading("lead", loaded, &TangentOptions::lead, {0.0, 0.01, 0.03, 0.1, 0.2, 0.3});
  report_loading("spread", loaded, &TangentOptions::spread, {0.5, 0.3, 0.2, 0.1, 0.05, 0.02});
}
