// SPDX-License-Identifier: GPL-2.0-only
// A constitutive law with state variables, which only this file defines. The state variables must
// be readable by name. They must stay bitwise equal in runs, on several ranks, with sorting and in
// restart files. The tests also run under mpirun.

#include "mpm/law_table.h"
#include "mpm/midpoint_increment.h"

#include "comm.h"
#include "modify.h"
#include "script.h"

#include <cstdio>
#include <gtest/gtest.h>
#include <set>
#include <string>

using namespace LAMMPS_NS;

namespace {

/// Linear elasticity with a cap on the mean stress in the plane. If the mean pressure exceeds the
/// preconsolidation pressure p_c, the material gets a plastic compression ε_p. p_c increases
/// linearly with ε_p. The shear modulus is multiplied by 1 - d/2 with the damage d = ε_p/(ε_p +
/// 1e-3).
class CappedElastic : public mpm::Constitutive<2> {
 public:
  enum { Preconsolidation, PlasticStrain, Damage, NUM_VARIABLES };

  CappedElastic(double lame_first, double shear_modulus, double hardening) :
      lame_first_(lame_first), shear_modulus_(shear_modulus), hardening_(hardening)
  {
  }

  mpm::StateVariables state_variables() const override
  {
    return {{"preconsolidation", "stress"}, {last_name(), ""}, {"damage", ""}};
  }
  void begin_memory(const rve::Tensor2 &stress, double *memory) const override
  {
    memory[Preconsolidation] = -0.55 * trace(stress);
  }
  void update(int count, const int *point_index, const rve::Tensor2 *increments, double /*dt*/,
              rve::Tensor2 *stress, mpm::MemoryRows memory) override
  {
    for (int k = 0; k < count; ++k) {
      const int p = point_index[k];
      double *state = memory[p];
      const mpm::MidpointIncrement<2> increment = mpm::midpoint_increment(increments[p]);
      stress[p] = mpm::elastic_stress(stress[p], increment, lame_first_,
                                      shear_modulus_ * (1.0 - 0.5 * state[Damage]));
      const double beyond = -0.5 * trace(stress[p]) - state[Preconsolidation];
      if (!(beyond > 0.0)) continue;
      const double flow = beyond / (lame_first_ + shear_modulus_ + hardening_);
      stress[p] = stress[p] + (flow * (lame_first_ + shear_modulus_)) * rve::Tensor2::identity();
      state[Preconsolidation] += flow * hardening_;
      state[PlasticStrain] += flow;
      state[Damage] = state[PlasticStrain] / (state[PlasticStrain] + 1e-3);
    }
  }
  bool takes_parts() const override { return true; }
  double p_wave_modulus(int /*point_index*/) const override
  {
    return lame_first_ + 2.0 * shear_modulus_;
  }

  /// Name of the second state variable. A test changes it to imitate another version of the law.
  static std::string &last_name()
  {
    static std::string name = "plastic_strain";
    return name;
  }

 private:
  double lame_first_, shear_modulus_, hardening_;
};

const bool is_in_table = [] {
  mpm::law_table<2>().push_back({"capped",
                                 {"lambda", "mu", "hardening"},
                                 [](const double *a) -> std::shared_ptr<mpm::Constitutive<2>> {
                                   return std::make_shared<CappedElastic>(a[0], a[1], a[2]);
                                 }});
  return true;
}();

const std::string SETTINGS = "pair_style none\ncomm_modify cutoff 1.0\nneighbor 0.5 bin\n"
                             "neigh_modify every 5 delay 0 check no\ntimestep 0.005\n";

/// Returns the fix mpm of ground into which a plate is pressed. The lower ground is elastic. The
/// upper ground is Mohr-Coulomb material on the left and capped material on the right.
std::string footing(const std::string &columns = "column preconsolidation column damage ")
{
  return "fix soil all mpm 1.0 model ground elastic 1.0e6 0.3 "
         "model left mohr_coulomb 1.0e6 0.3 1000 30 5 model right capped 5e5 4e5 2e5 density 2000 "
         "stress -20000 -20000 0 boundary xlo roller boundary xhi roller boundary ylo fixed "
         "damping 0.05 rigid plate vx 0 vy -0.5 rough " +
      columns + "\n";
}

std::string scene()
{
  return "units si\ndimension 2\nboundary f f p\natom_style sphere\natom_modify map array\n"
         "region box block 0 8 0 8 -0.1 0.1 units box\ncreate_box 2 box\n"
         "lattice sq 1.0 origin 0.5 0.5 0.0\nregion ground block 0 8 0 6 -0.05 0.05 units box\n"
         "create_atoms 1 region ground\nregion plate block 2 6 6 7 -0.05 0.05 units box\n"
         "create_atoms 2 region plate\nset group all diameter 1.0\n"
         "group ground type 1\ngroup plate type 2\n"
         "region left block 0 4 3 6 -0.05 0.05 units box\ngroup left region left\n"
         "region right block 4 8 3 6 -0.05 0.05 units box\ngroup right region right\n" +
      SETTINGS;
}

// The columns of the fix follow x, y, vx, vy.
constexpr int SZZ = 4 + 15, EPS_P = 4 + 16, PRECONSOLIDATION = 4 + 17, DAMAGE = 4 + 18;

class LawScript : public Script {
 public:
  using Script::Script;

  /// Returns the atom IDs of the points of this rank.
  std::set<tagint> mine() const { return {lmp->atom->tag, lmp->atom->tag + lmp->atom->nlocal}; }

  Rows points()
  {
    const Atom *atom = lmp->atom;
    const Fix *fix = lmp->modify->get_fix_by_id("soil");
    return rows_by_id(4 + fix->size_peratom_cols, [&](int i, std::vector<double> &list) {
      list.insert(list.end(), {atom->x[i][0], atom->x[i][1], atom->v[i][0], atom->v[i][1]});
      list.insert(list.end(), fix->array_atom[i], fix->array_atom[i] + fix->size_peratom_cols);
    });
  }
};

}    // namespace

TEST(LawWithMemory, IsReadByNameBesideOtherLaws)
{
  ASSERT_TRUE(is_in_table);
  LawScript script;
  script << scene() + footing() + "run 0\n";
  int capped = 0;
  for (const auto &[id, row] : script.points()) {
    if (row[PRECONSOLIDATION] == 0.0) continue;
    EXPECT_NEAR(row[PRECONSOLIDATION], 22000.0, 1e-9 * 22000.0) << "atom " << id;
    EXPECT_EQ(row[SZZ], 0.0) << "what it has no number for";
    ++capped;
  }
  EXPECT_EQ(capped, 12);

  script << "run 300\n";
  int damaged = 0, yielded = 0;
  for (const auto &[id, row] : script.points()) {
    const bool is_frictional = row[SZZ] != 0.0, is_damaged = row[DAMAGE] > 0.0;
    EXPECT_FALSE(is_frictional && is_damaged) << "atom " << id;
    EXPECT_EQ(is_damaged && row[EPS_P] == 0.0, false) << "of the same name: the column has it";
    damaged += is_damaged;
    yielded += is_frictional && row[EPS_P] > 0.0;
  }
  EXPECT_GT(damaged, 3);
  EXPECT_GT(yielded, 0);
}

TEST(LawWithMemory, RanksRunsAndSortingGiveTheSameBits)
{
  LawScript together, alone(MPI_COMM_SELF);
  together << "processors 1 * 1\n" + scene() + "atom_modify sort 7 1.0\n" + footing() + "run 0\n";
  const auto before = together.mine();
  together << "run 130\nrun 0\nrun 270\n";
  alone << scene() + "atom_modify sort 0 0\n" + footing() + "run 400\n";

  const auto points = together.points();
  EXPECT_EQ(points, alone.points());
  // A point with damage must have migrated from another rank.
  int migrated = 0;
  for (const tagint id : together.mine())
    migrated += !before.count(id) && points.at(id)[DAMAGE] > 0.0;
  MPI_Allreduce(MPI_IN_PLACE, &migrated, 1, MPI_INT, MPI_SUM, together.lmp->world);
  EXPECT_EQ(migrated > 0, together.lmp->comm->nprocs > 1);
}

TEST(LawWithMemory, RestartContinuesBitForBit)
{
  LawScript whole, first, second;
  whole << scene() + footing() + "run 400\n";
  first << scene() + footing() + "run 250\nwrite_restart test_law_with_memory.restart\n";
  second << "read_restart test_law_with_memory.restart\n" + SETTINGS + footing() + "run 150\n";

  EXPECT_EQ(whole.points(), second.points());
  MPI_Barrier(MPI_COMM_WORLD);
  std::remove("test_law_with_memory.restart");
}

TEST(LawWithMemory, RestartFilesKnowItByName)
{
  const std::string path =
      "test_law_names." + std::to_string(LawScript().lmp->comm->me) + ".restart";
  LawScript first(MPI_COMM_SELF);
  first << scene() + footing() + "run 300\nwrite_restart " + path + "\n";
  const std::string read = "read_restart " + path + "\n" + SETTINGS;

  // The other fix has the laws in another order and omits the columns.
  std::string other = footing("");
  const std::string right = "model right capped 5e5 4e5 2e5 ";
  other.erase(other.find(right), right.size());
  other.insert(other.find("model left"), right);
  LawScript again(MPI_COMM_SELF), plain(MPI_COMM_SELF);
  again << read + other.insert(other.size() - 1, "column damage") + "run 0\n";
  auto expected = first.points();
  for (auto &[id, row] : expected) row.erase(row.begin() + PRECONSOLIDATION);
  EXPECT_EQ(again.points(), expected);

  // Another law does not use these state variables. It starts from the present stress of the
  // points.
  std::string elastic = footing("");
  elastic.replace(elastic.find(right), right.size(), "model right mohr_coulomb 1e6 0.3 1e9 30 5 ");
  plain << read + elastic + "run 0\n";
  for (const auto &[id, row] : plain.points())
    if (expected.at(id)[PRECONSOLIDATION] > 0.0) {
      EXPECT_EQ(row[EPS_P], 0.0) << "atom " << id;
      EXPECT_EQ(row[SZZ], 0.5 * (row[4 + 3] + row[4 + 4])) << "atom " << id;
    }

  // In the file, the second state variable of this law has another name than now.
  CappedElastic::last_name() = "crushed";
  const std::string message = message_of(read + footing());
  CappedElastic::last_name() = "plastic_strain";
  std::remove(path.c_str());
  EXPECT_NE(
      message.find("law capped has the state variables 'preconsolidation plastic_strain damage' in "
                   "the restart file, but 'preconsolidation crushed damage' in this program"),
      std::string::npos)
      << message;
}

TEST(LawWithMemory, PointsThatChangeTheirLawReinitialise)
{
  // The points of group right change from the law capped to another law. Their damage must not be
  // taken for a state variable of the new law, such as σ_zz.
  LawScript script(MPI_COMM_SELF);
  script << scene() + footing() + "run 300\n";
  const auto before = script.points();
  script << "group right clear\nrun 0\n";
  for (const auto &[id, row] : script.points()) {
    EXPECT_EQ(row[DAMAGE], 0.0);
    EXPECT_EQ(row[EPS_P], before.at(id)[DAMAGE] > 0.0 ? 0.0 : before.at(id)[EPS_P]);
  }
}

TEST(LawWithMemory, WrongNamesAreErrors)
{
  const std::string start = scene();
  EXPECT_NE(message_of(start + footing("column damge"))
                .find("fix mpm soil: column: no model has the state variable 'damge'; did you mean "
                      "damage?"),
            std::string::npos);
  EXPECT_NE(
      message_of(start + "fix soil all mpm 1.0 model all elastic 1e6 0.3 column damage")
          .find("no model has the state variable 'damage'; the models have no state variables"),
      std::string::npos);
  EXPECT_NE(message_of(start + footing("column damage column damage"))
                .find("fix mpm soil: column damage is given twice"),
            std::string::npos);
  EXPECT_NE(message_of(start + "fix soil all mpm 1.0 model all capped 1 2")
                .find("it must read: model group-ID rve fix-ID | elastic E nu | mohr_coulomb E nu "
                      "c phi psi | drucker_prager E nu c phi psi | capped"),
            std::string::npos);
  EXPECT_NE(message_of(start + "fix soil all mpm 1.0 model all caped 1 2 3")
                .find("model law is 'caped'; it must be rve, elastic, mohr_coulomb, "
                      "drucker_prager or capped"),
            std::string::npos);
}
