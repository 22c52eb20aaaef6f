// SPDX-License-Identifier: GPL-2.0-only
// Update of the stresses of points with several laws. The laws of this test count their calls.

#include "mpm/stress_update.h"

#include <gtest/gtest.h>

#include <vector>

using namespace mpm;
using rve::StressesAre;

namespace {

class FakeRequest final : public rve::Request {
 public:
  explicit FakeRequest(StressesAre _where) : where(_where) {}
  bool launch() override
  {
    if (accepts) note_launch();
    return accepts;
  }
  StressesAre where;
  bool accepts = true;

 private:
  StressesAre wait() override { return where; }
};

/// Law that stores which points it has updated on the host. For a device, plan() accepts any
/// points.
class CountingLaw final : public Constitutive<2> {
 public:
  void update(int count, const int *point_index, const Tensor<2> *, double, Tensor<2> *,
              MemoryRows) override
  {
    updated.assign(point_index, point_index + count);
    ++updates;
  }
  rve::Request *plan(int, const int *, const DeviceArrays<2> &, double, Tensor<2> *) override
  {
    return &request;
  }
  StressesAre finish(rve::Request &of) override { return of.fetch(); }
  void copy_stresses_to_host() override { ++copies; }
  double p_wave_modulus(int) const override { return 1.0; }

  std::vector<int> updated;
  int updates = 0, copies = 0;
  FakeRequest request{StressesAre::OnDevice};
};

struct Points {
  std::vector<int> model, body;
  PointView<2> view()
  {
    body.assign(model.size(), -1);
    PointView<2> points = {};
    points.count = static_cast<int>(model.size());
    points.model = model.data();
    points.rigid_body = body.data();
    return points;
  }
};

DeviceArrays<2> on_device()
{
  DeviceArrays<2> arrays;
  arrays.device = 0;
  return arrays;
}

}    // namespace

TEST(StressUpdate, LawOfSeveralModelsUpdatesOnce)
{
  CountingLaw shared, other;
  Points points{{0, 1, 2, 1, 0}, {}};
  StressUpdate<2> update;
  update.set_laws({&shared, &other, &shared});

  update.begin_step(points.view(), 1);
  EXPECT_FALSE(update.begin(nullptr, 1.0));

  EXPECT_EQ(shared.updates, 1);
  EXPECT_EQ(shared.updated, (std::vector<int>{0, 2, 4}));
  EXPECT_EQ(other.updated, (std::vector<int>{1, 3}));
}

TEST(StressUpdate, LeavesStressesOnTheDeviceIfAllLawsDo)
{
  CountingLaw one, other;
  Points points{{0, 1}, {}};
  StressUpdate<2> update;
  update.set_laws({&one, &other});
  update.begin_step(points.view(), 1);

  ASSERT_TRUE(update.plan(on_device(), 1.0));
  ASSERT_TRUE(update.launch());

  EXPECT_EQ(update.finish(), StressesAre::OnDevice);
  EXPECT_EQ(one.updates + other.updates + one.copies + other.copies, 0);
}

TEST(StressUpdate, BringsAllStressesToTheHostIfOneLawNeedsIt)
{
  CountingLaw one, other;
  other.request.where = StressesAre::OnHost;
  Points points{{0, 1}, {}};
  StressUpdate<2> update;
  update.set_laws({&one, &other});
  update.begin_step(points.view(), 1);

  ASSERT_TRUE(update.plan(on_device(), 1.0));
  ASSERT_TRUE(update.launch());

  EXPECT_EQ(update.finish(), StressesAre::OnHost);
  EXPECT_EQ(one.copies, 1);
  EXPECT_EQ(other.copies, 0);
}

/// If a device refuses the request of one law, the host updates this law but not the law that the
/// device already runs.
TEST(StressUpdate, HostUpdatesLawsThatTheDeviceRefuses)
{
  CountingLaw accepted, refused;
  refused.request.accepts = false;
  Points points{{0, 1, 1}, {}};
  StressUpdate<2> update;
  update.set_laws({&accepted, &refused});
  update.begin_step(points.view(), 1);

  ASSERT_TRUE(update.plan(on_device(), 1.0));
  EXPECT_FALSE(update.launch());
  EXPECT_TRUE(update.begin(nullptr, 1.0));

  EXPECT_EQ(accepted.updates, 0);
  EXPECT_EQ(refused.updated, (std::vector<int>{1, 2}));
}
