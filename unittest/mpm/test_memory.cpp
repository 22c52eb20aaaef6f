// SPDX-License-Identifier: GPL-2.0-only
// Data of points: their fields, and rows with the state variables of laws. A law initialises and
// advances the state variables in place.

#include "mpm/law_table.h"
#include "mpm/memory_layout.h"
#include "mpm/points.h"

#include <gtest/gtest.h>
#include <set>

using rve::Tensor2;

TEST(LawTable, MakesLawsByTheirWords)
{
  std::set<std::string> words;
  for (const mpm::LawEntry<2> &entry : mpm::law_table<2>()) {
    EXPECT_TRUE(words.insert(entry.word).second) << entry.word << " is there twice";
    EXPECT_NE(entry.word, "rve") << "means grains in scripts";
    const std::set<std::string> names(entry.arguments.begin(), entry.arguments.end());
    EXPECT_EQ(names.size(), entry.arguments.size()) << entry.word;
  }
  for (const mpm::LawEntry<2> &entry : mpm::law_table<2>())
    if (entry.word == "elastic") {
      const double arguments[] = {1e6, 0.25};
      EXPECT_NEAR(entry.make(arguments)->p_wave_modulus(0), 1.2e6, 1e-3);
    }
}

TEST(LawTable, HasTheSameLawsInThePlaneAndInSpace)
{
  const auto &plane = mpm::law_table<2>();
  const auto &space = mpm::law_table<3>();
  ASSERT_EQ(plane.size(), space.size());
  for (std::size_t k = 0; k < plane.size(); ++k) {
    EXPECT_EQ(plane[k].word, space[k].word);
    EXPECT_EQ(plane[k].arguments, space[k].arguments);
    const double arguments[] = {1e6, 0.25, 1e3, 30.0, 10.0};
    const auto in_plane = plane[k].make(arguments);
    const auto in_space = space[k].make(arguments);
    EXPECT_EQ(in_plane->p_wave_modulus(0), in_space->p_wave_modulus(0)) << plane[k].word;
    for (const mpm::StateVariable &variable : in_space->state_variables())
      EXPECT_NE(variable.name, "out_of_plane_stress") << "there is no plane";
  }
}

TEST(MemoryLayout, RowsBeginWithTheStateVariablesOfTheLaw)
{
  mpm::MemoryLayout layout;
  EXPECT_EQ(layout.width(), 0);

  EXPECT_EQ(layout.add("elastic", {}), 0);
  EXPECT_EQ(layout.add("clay", {{"damage", ""}, {"preconsolidation", "stress"}}), 1);
  EXPECT_EQ(layout.add("sand", {{"preconsolidation", "stress"}}), 2);
  EXPECT_EQ(layout.add("clay", {{"damage", ""}, {"preconsolidation", "stress"}}), 1)
      << "another model of the same law";

  EXPECT_EQ(layout.num_laws(), 3);
  EXPECT_EQ(layout.width(), 2) << "of the widest";
  EXPECT_EQ(layout.find("sand"), 2);
  EXPECT_EQ(layout.find("rock"), -1);
  EXPECT_EQ(layout.place(1, "preconsolidation"), 1);
  EXPECT_EQ(layout.place(2, "preconsolidation"), 0);
  EXPECT_EQ(layout.place(2, "damage"), -1);
  EXPECT_EQ(layout.names(1), "damage preconsolidation");
  EXPECT_EQ(layout.names(0), "");
}

TEST(MemoryRows, LawWritesOnlyItsVariablesOfItsPoints)
{
  // A row has one number more than the law needs, and there are rows of other points. The law must
  // change neither.
  const double other = 17.0;
  for (const mpm::LawEntry<2> &entry : mpm::law_table<2>()) {
    if (entry.word != "mohr_coulomb") continue;
    const double arguments[] = {1e6, 0.3, 0.0, 30.0, 0.0};
    const auto law = entry.make(arguments);
    const int used = (int) law->state_variables().size(), width = used + 1;
    std::vector<double> memory(3 * width, other);
    Tensor2 stress[3];
    const Tensor2 sheared = Tensor2::identity() + Tensor2{{0.0, 0.01, 0.0, 0.0}};
    const Tensor2 increments[] = {sheared, sheared, sheared};
    for (Tensor2 &one : stress) one = Tensor2{{-1e3, 0.0, 0.0, -2e3}};
    const mpm::MemoryRows rows{memory.data(), width};
    const int point = 1;

    law->begin_memory(stress[point], rows[point]);
    EXPECT_EQ(rows[point][0], -1.5e3);
    law->update(1, &point, increments, 1.0, stress, rows);

    for (int k = 0; k < 3 * width; ++k) {
      const bool is_own = k / width == point && k % width < used;
      EXPECT_EQ(memory[k] == other, !is_own) << "number " << k;
    }
    EXPECT_GT(rows[point][1], 0.0) << "it flows";
    EXPECT_EQ(stress[0](0, 1), 0.0);
  }
}

TEST(PointFields, AreCopiedBetweenRecordsAndVisibleInAView)
{
  mpm::PointArrays<2> points;
  points.resize(2);
  mpm::PointRecord<2> point = mpm::new_point<2>();
  EXPECT_EQ(point.deformation_gradient(0, 0), 1.0);
  EXPECT_EQ(point.deformation_gradient(1, 0), 0.0);
  EXPECT_EQ(point.volume, 0.0);
  double number = 1.0;
  mpm::PointRecord<2>::each(
      [&](const auto &, auto &value) {
        auto *first = reinterpret_cast<double *>(&value);
        for (std::size_t k = 0; k < sizeof(value) / sizeof(double); ++k) first[k] = number++;
      },
      point);
  points.set_record(1, point);
  points.set_record(0, points.record(1));

  mpm::PointView<2> view;
  points.show(view);
  EXPECT_EQ(view.half_size[0][0], 1.0);
  EXPECT_EQ(view.mass[0], 3.0);
  EXPECT_EQ(view.volume[0], 5.0);
  EXPECT_EQ(view.velocity_gradient[0](1, 1), number - 2.0);
  EXPECT_EQ(view.hoop_stress[0], number - 1.0) << "each field has a row in the list";
  view.volume[0] = 7.0;
  EXPECT_EQ(points.record(0).volume, 7.0);
}

TEST(PointFields, HaveDifferentNames)
{
  std::set<std::string> names;
  mpm::PointRecord<3>::each(
      [&](const auto &field) { EXPECT_TRUE(names.insert(field.name).second) << field.name; });
}
