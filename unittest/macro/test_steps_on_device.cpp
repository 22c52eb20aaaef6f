// SPDX-License-Identifier: GPL-2.0-only
// Steps of a continuum with RVEs. Increments and stresses stay on a GPU, and the host synchronises
// only if necessary. The results must be bitwise equal to the results of CPU threads. Substeps are
// matched or adaptive. The cases include RVEs that rotate, are evaluated, stiffen, repeat a call or
// fail.

#include "macro/rve_constitutive.h"
#include "mpm/mpm_solver.h"
#include "mpm/scene.h"
#include "support/lattice.h"
#include "support/on_device.h"
#include "support/packings.h"
#include "support/spheres.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <utility>
#include <vector>

using namespace macro;
using namespace rve_test;

namespace {

constexpr double H = 0.1, DT = 5e-4, DEM_DT = 1e-4;

template <class T> bool same_bits(const T &a, const T &b)
{
  return std::memcmp(&a, &b, sizeof(T)) == 0;
}

/// Forwards a request and counts its calls.
class CountingRequest final : public rve::Request {
 public:
  void set(rve::Request *request)
  {
    request_ = request;
    note_plan();
  }
  bool launch_early() override
  {
    const bool is_launched = request_->launch_early();
    if (is_launched) ++early;
    return is_launched;
  }
  bool launch() override
  {
    if (!request_->launch()) return false;
    ++launched;
    note_launch();
    return true;
  }
  const std::int32_t *needs_host() const override { return request_->needs_host(); }

  int launched = 0, early = 0;

 private:
  rve::StressesAre wait() override { return request_->fetch(); }
  rve::Request *request_ = nullptr;
};

/// Uses RVEs as fix rve does. The slot of an RVE is the index of its point. Failed RVEs are frozen.
template <int D> class Owner final : public RveOwner<D> {
 public:
  using Points = RvePointsOf<D>;

  Owner(const std::vector<const rve::RveStateOf<D> *> &states, const rve::Options &options,
        const MacroStepOptions &macro) :
      points_(rve::make_engine<D>(options), nullptr, macro)
  {
    points_.add(states);
  }

  /// Returns the points with the results of the last advance.
  Points &points()
  {
    finish();
    points_.fetch_results();
    return points_;
  }

  RveClock clock(double dt) const override
  {
    return {DEM_DT, static_cast<int>(std::lround(dt / DEM_DT))};
  }
  rve::Request *begin(const std::vector<int> &atoms, MacroIncrementsOf<D> &increments) override
  {
    finish();
    atoms_ = &atoms;
    increments_ = &increments;
    rve::Request *const request = points_.begin(atoms, increments);
    if (!request) advance_by_drives(atoms, increments);
    return request;
  }
  rve::Request *plan(const std::vector<int> &atoms, bool is_as_before,
                     const rve::PointsOnDevice &there, MacroIncrementsOf<D> &increments) override
  {
    finish();
    atoms_ = &atoms;
    increments_ = &increments;
    rve::Request *const request = points_.plan(atoms, atoms, is_as_before, there, increments);
    on_device.set(request);
    return request ? &on_device : nullptr;
  }
  void finish() override
  {
    if (!points_.is_under_way()) return;
    for (const int index : points_.finish()) {
      ++failures;
      increments_->take_stress(index, points_.stress((*atoms_)[index]));
    }
    if (on_device.is_running() && on_device.fetch() != rve::StressesAre::OnDevice)
      ++times_unfinished;
    if (points_.any_has_stiffened()) ++times_stiffened;
  }
  bool is_as_before(const std::vector<int> &atoms) override
  {
    return points_.is_as_before(atoms, atoms);
  }
  void synchronise_ranks() override
  {
    if (!points_.any_has_stiffened()) return;
    std::vector<int> stiffened;
    for (const int slot : *atoms_)
      if (points_.has_stiffened(slot)) stiffened.push_back(slot);
    points_.note_check(stiffened);
  }
  const rve::Tensor<double, D> &stress(int atom) const override
  {
    return const_cast<Owner *>(this)->points().stress(atom);
  }
  const typename Points::Point &point(int atom) const override
  {
    return const_cast<Owner *>(this)->points().point(atom);
  }
  void complete() override { points().complete(); }

  CountingRequest on_device;
  int failures = 0, times_stiffened = 0, times_unfinished = 0;

 private:
  void advance_by_drives(const std::vector<int> &atoms, MacroIncrementsOf<D> &increments)
  {
    std::vector<rve::DriveOf<D>> drives(atoms.size());
    for (std::size_t k = 0; k < atoms.size(); ++k) {
      drives[k].dt = increments.dt;
      drives[k].substeps = increments.substeps;
      drives[k].deformation = increments.increment(static_cast<int>(k));
    }
    points().advance(atoms, drives, false);
    for (std::size_t k = 0; k < atoms.size(); ++k)
      increments.take_stress(static_cast<int>(k), points_.stress(atoms[k]));
  }

  Points points_;
  const std::vector<int> *atoms_ = nullptr;
  MacroIncrementsOf<D> *increments_ = nullptr;
};

/// Motion of a free block. If its density is low, the stresses of the RVEs accelerate it strongly.
struct Motion {
  double shrinking, shearing = 0.2;    ///< rates [1/time]
  double density = 2000.0;             ///< [mass/length^3]
  double turning = 1.0;                ///< rate [1/time]
};

/// Returns a free block that rotates, shears and shrinks. The rate of shrinking increases with the
/// distance from the left side of the block.
mpm_test::Scene turning_block(const Motion &motion)
{
  const double shrinking = motion.shrinking, shearing = motion.shearing, turning = motion.turning;
  mpm_test::Scene scene;
  scene.add_block({{0.5, 0.5}}, {{0.9, 0.8}}, 0.5 * H, motion.density);
  for (int p = 0; p < scene.size(); ++p) {
    const double x = scene.position[3 * p] - 0.7, y = scene.position[3 * p + 1] - 0.65;
    scene.velocity[3 * p] = -shrinking * x * (1.0 + x) - (turning + shearing) * y;
    scene.velocity[3 * p + 1] = (turning - shearing) * x - shrinking * y;
  }
  return scene;
}

/// A block and its RVEs on the CPU or on the device.
template <int D> struct Block {
  mpm_test::Scene scene;
  Owner<D> owner;
  RveConstitutive<2, D> law;
  mpm::MpmSolver<2> solver;

  Block(const rve::RveStateOf<D> &state, const Motion &motion, rve::Device device,
        rve::Format format, const MacroStepOptions &macro, double overlap_limit,
        mpm::Scheme scheme) :
      scene(turning_block(motion)),
      owner(std::vector<const rve::RveStateOf<D> *>(scene.size(), &state),
            options_of(state, device, format, overlap_limit), macro),
      law(owner), solver(options_of(device, scheme))
  {
    solver.set_models({&law});
    for (int p = 0; p < scene.size(); ++p)
      scene.stress[p] = rve::leading_components<2>(owner.stress(p));
  }

  static rve::Options options_of(const rve::RveStateOf<D> &state, rve::Device device,
                                 rve::Format format, double overlap_limit)
  {
    rve::Options options = cpu_options(format, 2);
    options.device = device;
    options.overlap_limit = overlap_limit;
    options.contacts = rve::contacts_of(state);
    return options;
  }
  static mpm::SolverOptions<2> options_of(rve::Device device, mpm::Scheme scheme)
  {
    auto options = mpm_test::grid_options({{0.0, 0.0}}, {{1.4, 1.4}}, H);
    options.scheme = scheme;
    options.flip = 0.99;
    options.threads = 2;
    options.device = device;
    return options;
  }

  void steps(int number)
  {
    for (int step = 0; step < number; ++step) solver.step(scene.view(), {}, DT);
  }
};

template <int D> void expect_same(Block<D> &one, Block<D> &other, bool looks_at_rves)
{
  one.solver.fetch(one.scene.view());
  other.solver.fetch(other.scene.view());
  for (int p = 0; p < one.scene.size(); ++p) {
    EXPECT_TRUE(same_bits(one.scene.position[3 * p], other.scene.position[3 * p]));
    EXPECT_TRUE(same_bits(one.scene.deformation_gradient[p], other.scene.deformation_gradient[p]));
    ASSERT_TRUE(same_bits(one.scene.stress[p], other.scene.stress[p])) << "point " << p;
    if (!looks_at_rves) continue;
    const auto &a = one.owner.point(p), &b = other.owner.point(p);
    EXPECT_TRUE(same_bits(a.result.stress, b.result.stress));
    EXPECT_TRUE(same_bits(a.result.cell, b.result.cell));
    EXPECT_TRUE(same_bits(a.result.counters, b.result.counters));
    EXPECT_TRUE(same_bits(a.drive.deformation, b.drive.deformation));
    EXPECT_EQ(a.drive.substeps, b.drive.substeps);
    EXPECT_EQ(a.state, b.state);
    EXPECT_EQ(a.rest(), b.rest());
    EXPECT_TRUE(same_bits(a.pending, b.pending));
    EXPECT_EQ(a.result.mean_overlap, b.result.mean_overlap);
    EXPECT_EQ(a.contacts, b.contacts);
    EXPECT_EQ(a.peak_force, b.peak_force);
    EXPECT_EQ(a.limit.num_contacts, b.limit.num_contacts);
    EXPECT_EQ(a.limit.peak_force, b.limit.peak_force);
    EXPECT_EQ(a.limit.pressure, b.limit.pressure);
  }
}

MacroStepOptions adaptive()
{
  MacroStepOptions macro;
  macro.adaptive = rve::AdaptiveSubsteps{2e-5, 1e-3, 40};
  return macro;
}

constexpr Motion SLOW = {0.002, 0.015, 1e9};

MacroStepOptions quiescent_steps()
{
  MacroStepOptions macro = adaptive();
  macro.quiescent_strain = 1e-4;
  return macro;
}

template <int D>
void expect_same_course(const rve::RveStateOf<D> &state, rve::Format format, const Motion &motion,
                        const MacroStepOptions &macro, double overlap_limit = 0.2,
                        mpm::Scheme scheme = mpm::Scheme::Musl)
{
  Block<D> here(state, motion, rve::Device::Cpu, format, macro, overlap_limit, scheme);
  Block<D> there(state, motion, DEVICE, format, macro, overlap_limit, scheme);
  int steps = 0, is_quiescent = 0;
  for (const int some : {1, 6, 1, 1, 12, 20}) {
    here.steps(some);
    there.steps(some);
    steps += some;
    expect_same(here, there, some != 6);
    if (testing::Test::HasFatalFailure()) return;
    if (some == 6) continue;
    for (int p = 0; p < here.scene.size(); ++p)
      is_quiescent += here.owner.point(p).rest() == rve::Rest::Quiescent;
  }
  if (macro.quiescent_strain > 0.0) {
    EXPECT_GT(is_quiescent, here.scene.size() / 4);
    EXPECT_LT(is_quiescent, 5 * here.scene.size());
  }
  EXPECT_EQ(here.owner.failures, there.owner.failures);
  const bool shall_fail = overlap_limit < 0.1;
  EXPECT_EQ(there.owner.failures > 0, shall_fail);
  // Hertz contacts stiffen under pressure. Packings of linear contacts stiffen when many contacts
  // close.
  const bool shall_stiffen = shall_fail || state.material.law == rve::ContactLaw::Hertz;
  EXPECT_EQ(there.owner.times_stiffened > 0, shall_stiffen);
  EXPECT_EQ(here.owner.times_stiffened > 0, shall_stiffen);
  if (DEVICE != rve::Device::Cuda) return;
  const int updates = scheme == mpm::Scheme::Usavg ? 2 * steps : steps;
  // If no RVE is quiescent, calls begin before the host has their plan. Calls with adaptive
  // substeps begin early only after their numbers of steps are known approximately.
  const int ahead = there.owner.on_device.early;
  if (macro.quiescent_strain > 0.0)
    EXPECT_EQ(ahead, 0);
  else if (macro.adaptive)
    EXPECT_GT(2 * ahead, updates);
  else
    EXPECT_EQ(ahead, updates);
  if (motion.turning * DT < rve::LARGEST_TURN) {
    EXPECT_EQ(there.owner.on_device.launched, updates);
  } else {
    EXPECT_LT(there.owner.on_device.launched, updates);
  }
  EXPECT_TRUE(!shall_fail || there.owner.times_unfinished > 0);
}

/// Multiplies all velocities by `share`.
template <int D> void slow_down(Block<D> &block, double share)
{
  block.solver.fetch(block.scene.view());
  for (double &v : block.scene.velocity) v *= share;
  block.solver.points_changed();
}

}    // namespace

class StepsOnDevice : public OnDevice {};

TEST_P(StepsOnDevice, MatchedSubstepsHaveTheBitsOfTheCpu)
{
  expect_same_course(packing_of_400(), GetParam(), {0.5}, {});
}

// An increment with a large rotation takes several segments, which the host plans. The device has
// begun the call of these RVEs but has not moved them.
TEST_P(StepsOnDevice, StepsPlannedByTheHostHaveTheBitsOfTheCpu)
{
  expect_same_course(packing_of_400(), GetParam(), {0.5, 0.2, 1e7, 1.001 * rve::LARGEST_TURN / DT},
                     {});
}

TEST_P(StepsOnDevice, AdaptiveSubstepsAndRotationsHaveTheBitsOfTheCpu)
{
  expect_same_course(packing_of_400(), GetParam(), {0.5}, adaptive());
}

TEST_P(StepsOnDevice, HalfTheStrainBeforeTheForcesHasTheBitsOfTheCpu)
{
  expect_same_course(packing_of_400(), GetParam(), {0.5}, adaptive(), 0.2, mpm::Scheme::Usavg);
}

TEST_P(StepsOnDevice, FailedRvesKeepTheBitsOfTheCpu)
{
  // The RVEs have no contacts at first and are too dense at the end.
  rve::RveState loose = packing_of_400();
  loose.cell = 1.02 * loose.cell;
  loose.pairs.clear();
  loose.forget_list();
  expect_same_course(loose, GetParam(), {8.0}, adaptive(), 0.05);
  // Kernels of the next step that were launched early are cancelled.
  expect_same_course(loose, GetParam(), {8.0}, {}, 0.05);
}

// RVEs become quiescent, rotate by more than contacts allow, advance after about ten steps, and are
// evaluated again.
TEST_P(StepsOnDevice, QuiescentRvesHaveTheBitsOfTheCpu)
{
  expect_same_course(packing_of_400(), GetParam(), SLOW, quiescent_steps());
  MacroStepOptions matched = quiescent_steps();
  matched.adaptive.reset();
  expect_same_course(packing_of_400(), GetParam(), SLOW, matched);
}

// Calls begin before the host has their plan while no RVE is quiescent. When some RVEs are
// evaluated or become quiescent, the calls that have begun have not moved them.
TEST_P(StepsOnDevice, RvesThatBecomeQuiescentHaveTheBitsOfTheCpu)
{
  const rve::RveState state = packing_of_400();
  const auto fast = [&](rve::Device device) {
    return std::make_unique<Block<2>>(state, Motion{0.5}, device, GetParam(), quiescent_steps(),
                                      0.2, mpm::Scheme::Musl);
  };
  const auto here = fast(rve::Device::Cpu), there = fast(DEVICE);
  here->steps(14);
  there->steps(14);
  slow_down(*here, 0.005);
  slow_down(*there, 0.005);
  const int ahead = there->owner.on_device.early;
  const auto count_of = [&](const auto &is_one) {
    int count = 0;
    for (int p = 0; p < here->scene.size(); ++p) count += is_one(here->owner.point(p).rest());
    return count;
  };
  here->steps(1);
  there->steps(1);
  expect_same(*here, *there, true);
  EXPECT_GT(count_of([](rve::Rest rest) { return rest != rve::Rest::Unknown; }), 0);
  if (DEVICE == rve::Device::Cuda) {
    EXPECT_GT(ahead, 0);
    EXPECT_EQ(there->owner.on_device.early, ahead + 1);
  }
  here->steps(40);
  there->steps(40);
  expect_same(*here, *there, true);
  EXPECT_GT(count_of([](rve::Rest rest) { return rest == rve::Rest::Quiescent; }), 0);
  if (DEVICE == rve::Device::Cuda) { EXPECT_EQ(there->owner.on_device.launched, 55); }
}

TEST_P(StepsOnDevice, SpheresInPlaneStrainHaveTheBitsOfTheCpu)
{
  rve::Material material = spheres_material();
  material.normal_stiffness = material.tangential_stiffness =
      1e4;    // stable with the time step of disks
  Spheres lattice = face_centred_cubic(material, 2, 0.005, 2e-5);
  expect_same_course<3>(lattice, GetParam(), {0.5}, adaptive());
  expect_same_course<3>(lattice, GetParam(), SLOW, quiescent_steps());
  lattice.material.law = rve::ContactLaw::Hertz;
  lattice.material.normal_stiffness = lattice.material.tangential_stiffness = 0.0;
  lattice.material.hertz_stiffness = 2e7;
  lattice.material.mindlin_stiffness = 1.7e7;
  expect_same_course<3>(lattice, GetParam(), {0.5}, {});
}

INSTANTIATE_TEST_SUITE_P(Formats, StepsOnDevice, testing::ValuesIn(ALL_FORMATS),
                         [](const auto &format) { return rve::to_string(format.param); });
