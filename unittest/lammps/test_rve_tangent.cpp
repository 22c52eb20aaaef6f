// SPDX-License-Identifier: GPL-2.0-only
// compute rve/tangent. Each atom must get the tangent of its own RVE on any rank, the run must not
// change, and wrong input must be refused.

#include "grains_script.h"
#include "macro/tangent_probes.h"
#include "oracle/lattice_tangents.h"
#include "oracle/tangent_algebra.h"
#include "rve/engine/packing_io.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

using namespace grains_script;

namespace {

const std::string COLUMNS = "cxxxx cxxyy cxyxy cyyxy young poisson shear anisotropy work2 "
                            "work2_least acoustic normal_x normal_y measured nonlinearity "
                            "lambda unrest steps contact_changes ";

const std::string SCENE =
    FOUR_ATOMS + SHEAR + "group two id 1 3\ncompute c two rve/tangent " + COLUMNS + "\nrun 20";

class TangentScript : public Script {
 public:
  using Script::Script;

  Rows of(const std::string &id)
  {
    LAMMPS_NS::Compute *c = lmp->modify->get_compute_by_id(id);
    c->compute_peratom();
    const int columns = c->size_peratom_cols;
    return rows_by_id(columns, [&](int i, std::vector<double> &list) {
      list.insert(list.end(), c->array_atom[i], c->array_atom[i] + columns);
    });
  }
};

template <int D> macro::ProbedTangentOf<D> tangent_of(const std::string &path)
{
  const rve::RveStateOf<D> state = rve::read_packing<D>(path);
  rve::Options options;
  options.format = rve::Format::Double;
  options.device = rve::Device::Cpu;
  options.contacts = rve::contacts_of(state);
  macro::TangentProbesOf<D> probes(
      rve::make_engine<D>(options),
      macro::TangentOptions::of(rve::Format::Double, macro::TangentKind::Elastic));
  return probes.probe(
      1, [&](int) { return state; }, [](int) { return rve::Tensor<double, D>::zero(); })[0];
}

}    // namespace

TEST(RveTangent, IsThatOfTheRveOfEachAtomAndOfNoOther)
{
  // The group of the compute has two of the four atoms. In the run all four have had different
  // strain rates.
  TangentScript script(MPI_COMM_SELF);
  script << SCENE;
  const std::string path = file_of_rank("state.rve");
  script << "write_rve grains atom 3 file " + path + " format rve";

  const auto rows = script.of("c");

  const macro::ProbedTangentOf<2> expected = tangent_of<2>(path);
  const auto &tangent = expected.tangent;
  const std::vector<double> &row = rows.at(3);
  EXPECT_EQ(row[0], tangent(0, 0, 0, 0));
  EXPECT_EQ(row[1], tangent(0, 0, 1, 1));
  EXPECT_EQ(row[2], tangent(0, 1, 0, 1));
  EXPECT_EQ(row[3], tangent(1, 1, 0, 1));
  const macro::IsotropicPart part = tangent.isotropic_part();
  EXPECT_EQ(row[4], part.young());
  EXPECT_EQ(row[5], part.poisson());
  EXPECT_EQ(row[6], part.shear);
  EXPECT_EQ(row[7], part.anisotropy);
  // The second-order work is evaluated for the strain rate D of atom 3: yy -0.15 and xy 0.1. The
  // compute takes D from the stretch of a step. This D has a relative error of the strain of a
  // step, 1e-4.
  const rve::Tensor2 rate{{0.0, 0.05, 0.05, -0.15}};
  EXPECT_NEAR(row[8], rve_test::second_order_work(tangent, rate), 1e-5 * row[8]);
  EXPECT_EQ(row[9], tangent.least_second_order_work());
  const auto acoustic =
      macro::NominalTangentOf<2>(tangent, expected.stress).least_acoustic_determinant();
  EXPECT_EQ(row[10], acoustic.determinant);
  EXPECT_EQ(row[11], acoustic.normal[0]);
  EXPECT_EQ(row[12], acoustic.normal[1]);
  EXPECT_EQ(row[13], 1.0);
  EXPECT_EQ(row[14], expected.nonlinearity);
  EXPECT_EQ(row[15], part.lambda);
  EXPECT_EQ(row[16], expected.unrest);
  EXPECT_LT(row[16], 1e-5);    // the default tolerance of the compute
  EXPECT_EQ(row[17], expected.steps);
  EXPECT_GE(row[17], 500.0);    // one probe strain takes at least 500 DEM steps
  EXPECT_EQ(row[18], expected.changed_contacts);

  EXPECT_NE(rows.at(1), row);
  EXPECT_EQ(rows.at(2), std::vector<double>(row.size(), 0.0));
}

TEST(RveTangent, HasTheSameBitsOnAnyNumberOfRanks)
{
  TangentScript all, alone(MPI_COMM_SELF);
  all << SCENE;
  alone << SCENE;
  EXPECT_EQ(all.of("c"), alone.of("c"));
}

TEST(RveTangent, OfSpheresHasAllComponents)
{
  const rve::Material material = rve_test::of_spheres(rve_test::linear_springs());
  const std::string path = file_of_rank("cubic.rve");
  rve::write_packing(path,
                     rve_test::face_centred_cubic(material, 2, rve_test::LATTICE_RADIUS,
                                                  rve_test::LATTICE_OVERLAP));
  TangentScript script(MPI_COMM_SELF);
  script << FOUR_ATOMS + "fix grains all rve " + path +
          " threads 1 dt auto drive velocity_gradient zz 0.0\n"
          "compute c all rve/tangent czzzz cyyzz cyzyz cxxyz normal_z measured\nrun 0";
  const std::vector<double> row = script.of("c").at(2);
  const auto cubic = rve_test::of_face_centred_cubes(rve_test::springs_of(material));
  const double tolerance = 1e-8 * cubic.norm();
  EXPECT_NEAR(row[0], cubic(2, 2, 2, 2), tolerance);
  EXPECT_NEAR(row[1], cubic(1, 1, 2, 2), tolerance);
  EXPECT_NEAR(row[2], cubic(1, 2, 1, 2), tolerance);
  EXPECT_NEAR(row[3], 0.0, tolerance);
  // In a cubic lattice several directions are equivalent. The compute returns any one of them, so
  // only the range of its z component is checked.
  EXPECT_LE(std::fabs(row[4]), 1.0);
  EXPECT_EQ(row[5], 1.0);
}

TEST(RveTangent, OfSpheresIsThatOfTheRveOfEachAtom)
{
  // Four components of the strain differ from zero, so that no two directions of the lattice stay
  // equivalent.
  const std::string lattice = file_of_rank("sheared.rve"), path = file_of_rank("state.rve");
  rve::write_packing(lattice,
                     rve_test::face_centred_cubic(rve_test::of_spheres(rve_test::linear_springs()),
                                                  2, rve_test::LATTICE_RADIUS,
                                                  rve_test::LATTICE_OVERLAP));
  TangentScript script(MPI_COMM_SELF);
  script << FOUR_ATOMS + "fix grains all rve " + lattice +
          " threads 1 dt auto drive velocity_gradient xx -0.02 zz v_rate xy 0.005 xz 0.01\n"
          "compute c all rve/tangent czzzz cyyxz normal_x normal_y normal_z acoustic lambda shear "
          "unrest steps contact_changes work2_least nonlinearity\nrun 20\n"
          "write_rve grains atom 3 file " +
          path + " format rve";
  const std::vector<double> row = script.of("c").at(3);

  const auto expected = tangent_of<3>(path);
  const auto part = expected.tangent.isotropic_part();
  const auto acoustic =
      macro::NominalTangentOf<3>(expected.tangent, expected.stress).least_acoustic_determinant();
  EXPECT_EQ(
      row,
      (std::vector<double>{expected.tangent(2, 2, 2, 2), expected.tangent(1, 1, 0, 2),
                           acoustic.normal[0], acoustic.normal[1], acoustic.normal[2],
                           acoustic.determinant, part.lambda, part.shear, expected.unrest,
                           double(expected.steps), double(expected.changed_contacts),
                           expected.tangent.least_second_order_work(), expected.nonlinearity}));
  EXPECT_NEAR(row[2] * row[2] + row[3] * row[3] + row[4] * row[4], 1.0, 1e-12);
  EXPECT_NE(row[1], 0.0);
}

TEST(RveTangent, DoesNotChangeTheRun)
{
  const auto state_after = [](const std::string &look) {
    GrainsScript script;
    script << FOUR_ATOMS + SHEAR + look + "run 10";
    return script.state(2);
  };
  EXPECT_EQ(state_after("compute c all rve/tangent shear\ncompute m all reduce max "
                        "c_c\nthermo_style custom step c_m\nthermo 5\n"),
            state_after(""));
}

TEST(RveTangent, AlongLoadingIsSofterAndNeedsADirection)
{
  TangentScript script;
  script << FOUR_ATOMS + SHEAR +
          "group one id 4\ncompute e one rve/tangent work2 measured\n"
          "compute l one rve/tangent work2 measured kind loading";
  script << "run 0";
  EXPECT_EQ(script.of("l").at(4), (std::vector<double>{0.0, 0.0}));
  script << "run 60";
  const std::vector<double> elastic = script.of("e").at(4), loading = script.of("l").at(4);
  EXPECT_EQ(loading[1], 1.0);
  EXPECT_LT(loading[0], 0.9 * elastic[0]);
}

TEST(RveTangent, InvalidInputIsNamed)
{
  const auto refused = [](const std::string &words) {
    return message_of(FOUR_ATOMS + SHEAR + "compute c all rve/tangent " + words + "\nrun 0");
  };
  EXPECT_IN("compute rve/tangent c: at least one quantity must be given", refused("fix grains"));
  EXPECT_IN("compute rve/tangent c: unknown keyword 'cxxxw'", refused("cxxxx cxxxw"));
  EXPECT_IN("did you mean shear?", refused("cxxxx sheer"));
  EXPECT_IN("compute rve/tangent c: kind is 'plastic'; it must be elastic or loading",
            refused("shear kind plastic"));
  EXPECT_IN(
      "compute rve/tangent c: probe is 2; it must be above 0 and at most 0.5 [-], of the mean "
      "overlap",
      refused("shear probe 2"));
  EXPECT_IN("compute rve/tangent c: lead is for kind loading, but the kind is elastic",
            refused("shear lead 0.1"));
  EXPECT_IN("compute rve/tangent c: probe is given twice", refused("shear probe 0.1 probe 0.2"));
  EXPECT_IN("compute rve/tangent c: strain_steps is 0; it must be at least 1",
            refused("shear strain_steps 0"));
  EXPECT_IN("compute rve/tangent c: czzzz is for spheres only, but the RVEs of fix grains consist "
            "of disks",
            refused("czzzz"));
  EXPECT_IN("compute rve/tangent c: no fix of style rve is defined",
            message_of(FOUR_ATOMS + "compute c all rve/tangent shear\nrun 0"));
}
