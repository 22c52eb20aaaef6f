// SPDX-License-Identifier: GPL-2.0-only
// Compares element tests of the paper with SudoDEM2D, point by point. The strain is at most one per
// cent, since the response becomes chaotic later. Data: unittest/data/sudodem_*.csv.

#include "support/rve_rig.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

using namespace rve;
using namespace rve_test;

namespace {

constexpr double DT = 5e-5;

struct Row {
  int step;
  Tensor2 stress;    ///< compression positive
  double void_ratio;
  int num_contacts;

  double mean_stress() const { return 0.5 * trace(stress); }
  double deviatoric_stress() const
  {
    Result result;
    result.stress = stress;
    return result.deviatoric_stress();
  }
};

std::vector<Row> read_curve(const std::string &test)
{
  std::ifstream file(std::string(RVE_TEST_DATA) + "/sudodem_A_h0075_" + test + ".csv");
  EXPECT_TRUE(file.good());
  std::vector<Row> rows;
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] < '0' || line[0] > '9') continue;
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream words(line);
    Row row;
    words >> row.step;
    for (double &component : row.stress.component) words >> component;
    words >> row.void_ratio >> row.num_contacts;
    EXPECT_FALSE(words.fail()) << line;
    rows.push_back(row);
  }
  EXPECT_EQ(rows.size(), 24u);
  return rows;
}

struct Deviation {
  double early, late;    ///< largest |difference of q/p| up to step 1000 and after it
  double pressure;       ///< largest relative difference of p
  double void_ratio;
};

/// Returns the deviation from the data. Row n of the data has the forces of step n in the cell (1 +
/// dt L)^(n-1) H, with the initial cell H. These are the forces of the engine after n - 1 steps.
Deviation compare(const std::string &test, Drive (*drive_for)(int substeps), Format format)
{
  RveRig rig(paper_packing(), cpu_options(format));
  Deviation deviation = {0.0, 0.0, 0.0, 0.0};
  int done = 0;
  for (const Row &row : read_curve(test)) {
    const Result &result = rig.advance(drive_for(row.step - 1 - done));
    done = row.step - 1;
    EXPECT_EQ(result.status, status::Ok);
    const double ratio = result.deviatoric_stress() / result.mean_stress() -
        row.deviatoric_stress() / row.mean_stress();
    double &most = row.step <= 1000 ? deviation.early : deviation.late;
    most = std::max(most, std::fabs(ratio));
    deviation.pressure =
        std::max(deviation.pressure, std::fabs(result.mean_stress() / row.mean_stress() - 1.0));
    deviation.void_ratio =
        std::max(deviation.void_ratio, std::fabs(result.void_ratio - row.void_ratio));
  }
  EXPECT_EQ(done, 3999);
  return deviation;
}

Drive uniaxial(int substeps)
{
  return Drive::constant_velocity_gradient(gradient(1, 1, -0.05), DT, substeps);
}
Drive shear(int substeps)
{
  return Drive::constant_velocity_gradient(gradient(0, 1, 0.05), DT, substeps);
}

Drive biaxial(int substeps)
{
  Drive drive;
  drive.dt = DT;
  drive.substeps = substeps;
  drive.velocity_gradient = gradient(1, 1, -0.05);
  drive.controlled[0][0] = true;
  drive.stress_goal(0, 0) = -1e5;
  drive.servo_gain = 1.0 / 47.952;    // 1/(total mass), the gain of SudoDEM
  return drive;
}

}    // namespace

TEST(ReferenceCurve, UniaxialCompressionFollowsSudoDem)
{
  const Deviation deviation = compare("uni", uniaxial, Format::Double);

  // The limit of the early difference is the O(dt) difference of the two integrators. The limit of
  // the late difference is the measured scatter of equivalent runs of SudoDEM2D.
  EXPECT_LT(deviation.early, 1e-5);
  EXPECT_LT(deviation.late, 3e-4);
  EXPECT_LT(deviation.pressure, 3e-4);
}

TEST(ReferenceCurve, SimpleShearFollowsSudoDem)
{
  const Deviation deviation = compare("shear", shear, Format::Double);

  EXPECT_LT(deviation.early, 1e-5);
  EXPECT_LT(deviation.late, 1.5e-3);
  EXPECT_LT(deviation.pressure, 1.5e-3);
}

TEST(ReferenceCurve, BiaxialCompressionFollowsSudoDem)
{
  const Deviation deviation = compare("biax", biaxial, Format::Double);

  EXPECT_LT(deviation.early, 1e-4);
  EXPECT_LT(deviation.late, 1.2e-3);
  EXPECT_LT(deviation.pressure, 1.5e-3);
  EXPECT_LT(deviation.void_ratio, 1e-5);
}

TEST(ReferenceCurve, MixedAndFastFollowItToo)
{
  for (const Format format : {Format::Mixed, Format::Fast}) {
    EXPECT_LT(compare("uni", uniaxial, format).late, 3e-4);
    EXPECT_LT(compare("shear", shear, format).late, 1.5e-3);
    EXPECT_LT(compare("biax", biaxial, format).late, 1.2e-3);
  }
}
