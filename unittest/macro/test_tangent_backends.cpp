// SPDX-License-Identifier: GPL-2.0-only
// The tangent of an RVE is bitwise equal on a GPU and on a CPU, with any number of threads and with
// any other RVEs in the call.

#include "macro/tangent_probes.h"
#include "support/lattice.h"
#include "support/on_device.h"
#include "support/packings.h"
#include "support/spheres.h"

#include <gtest/gtest.h>

#include <cstring>
#include <vector>

using namespace macro;
using namespace rve_test;

namespace {

template <int D> using State = rve::RveStateOf<D>;

template <int D>
std::vector<ProbedTangentOf<D>> probe(const std::vector<State<D>> &states, TangentKind kind,
                                      rve::Format format, rve::Device device, int threads)
{
  rve::Options options = cpu_options(format, threads);
  options.device = device;
  options.contacts = rve::contacts_of(states);
  auto how = TangentOptions::of(format, kind);
  how.lead_steps = 1000;
  auto rate = rve::Tensor<double, D>::zero();
  rate(0, 0) = 0.6;
  rate(1, 1) = -0.8;
  TangentProbesOf<D> probes(rve::make_engine<D>(options), how);
  return probes.probe(
      static_cast<int>(states.size()), [&](int k) { return states[k]; }, [&](int) { return rate; });
}

template <int D> bool same_bits(const ProbedTangentOf<D> &a, const ProbedTangentOf<D> &b)
{
  return a.is_measured && b.is_measured &&
      std::memcmp(&a.tangent, &b.tangent, sizeof(a.tangent)) == 0 &&
      std::memcmp(&a.stress, &b.stress, sizeof(a.stress)) == 0 &&
      std::memcmp(&a.response, &b.response, sizeof(a.response)) == 0 && a.steps == b.steps &&
      a.status == b.status && a.nonlinearity == b.nonlinearity && a.unrest == b.unrest;
}

template <int D> void expect_bits(const State<D> &state, const State<D> &other, rve::Format format)
{
  for (const TangentKind kind : {TangentKind::Elastic, TangentKind::Loading}) {
    const auto alone = probe<D>({state}, kind, format, rve::Device::Cpu, 1);
    const auto batch = probe<D>({other, state, state}, kind, format, DEVICE, 3);
    EXPECT_TRUE(same_bits(batch[1], alone[0]));
    EXPECT_TRUE(same_bits(batch[2], alone[0]));
    EXPECT_FALSE(same_bits(batch[0], alone[0]));
  }
}

}    // namespace

class TangentBits : public OnDevice {};

TEST_P(TangentBits, AreThoseOfASingleRveOnACpu)
{
  const rve::Material material = paper_material();
  rve::RveState disks = triangular_packing(material, 10, 10, 0.005, 3);
  shake(disks, 0.05, 5);
  expect_bits<2>(disks, hexagonal_lattice(material, 0.005, 2e-5), GetParam());

  const Spheres lattice = face_centred_cubic(spheres_material(), 2, 0.005, 2e-5);
  Spheres other = lattice;
  other.material.tangential_stiffness *= 0.5;
  expect_bits<3>(lattice, other, GetParam());
}

INSTANTIATE_TEST_SUITE_P(Formats, TangentBits, testing::ValuesIn(ALL_FORMATS),
                         [](const auto &format) { return rve::to_string(format.param); });
