// SPDX-License-Identifier: GPL-2.0-only
// Uses four parts of the package without LAMMPS: the engine of an RVE, a macro step of this RVE, an
// elastic law of the MPM, and a random field.
//
//   consumer <packing>

#include <field/circulant_embedding.h>
#include <macro/rve_points.h>
#include <mpm/linear_elastic.h>
#include <rve/engine/engine.h>
#include <rve/engine/packing_io.h>
#include <rve/engine/stability.h>

#include <cmath>
#include <cstdio>

int main(int argc, char **argv)
{
  if (argc != 2) {
    std::puts("which packing?");
    return 2;
  }

  // biaxial compression of one RVE: 500 DEM steps at a rate of 1/s
  const rve::RveState packing = rve::read_packing(argv[1]);
  rve::Options options;
  options.device = rve::Device::Cpu;
  const auto engine = rve::make_engine(options);
  const int number = engine->add(packing);
  const double dt = 0.5 * rve::stable_time_step(packing);
  rve::Tensor2 rate = rve::Tensor2::zero();
  rate(1, 1) = -1.0;
  std::vector<rve::Result> results;
  engine->advance({number}, {rve::Drive::constant_velocity_gradient(rate, dt, 0)}, results);
  const double before = results[0].mean_stress();
  engine->advance({number}, {rve::Drive::constant_velocity_gradient(rate, dt, 500)}, results);
  const double after = results[0].mean_stress();
  std::printf("%s: %d grains, mean stress %.6g Pa, after a strain of %.2g %.6g Pa\n",
              engine->description().c_str(), results[0].num_grains, before, 500 * dt, after);
  const bool compressed = results[0].status == rve::status::Ok && before > 0.0 && after > before;

  // the same in one macro step
  macro::RvePoints points(rve::make_engine(options), nullptr, macro::MacroStepOptions());
  const std::vector<int> slots = points.add({&packing});
  const bool advanced =
      points.advance(slots, {rve::Drive::constant_velocity_gradient(rate, dt, 500)}).empty() &&
      points.stress(slots[0])(1, 1) == results[0].stress(1, 1);

  // uniaxial strain of an elastic point: the modulus of compression waves
  mpm::LinearElastic<2> law(1e6, 0.25);
  const int point = 0;
  rve::Tensor2 increment = rve::Tensor2::identity();
  increment(0, 0) += 1e-6;
  rve::Tensor2 stress = rve::Tensor2::zero();
  law.update(1, &point, &increment, 1.0, &stress, {});
  const double modulus = stress(0, 0) / 1e-6;
  std::printf("modulus of compression waves %.6g Pa\n", modulus);
  const bool elastic = std::fabs(modulus / 1.2e6 - 1.0) < 1e-5;

  // a random field
  field::Grid grid;
  grid.spacing = {0.1, 0.1};
  grid.nodes = {16, 16};
  field::CirculantEmbedding embedding(
      grid, field::Covariance{field::Exponential(), field::Anisotropy({0.5, 0.5})});
  const std::vector<double> values = embedding.sample(7);
  std::printf("random field of %zu values\n", values.size());
  return compressed && advanced && elastic && values.size() == 256 ? 0 : 1;
}
