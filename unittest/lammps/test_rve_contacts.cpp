// SPDX-License-Identifier: GPL-2.0-only
// compute rve/contact/local and dump rve/grain. Their contacts and grains must agree with compute
// rve/atom, whichever rank has the atom. Errors of both styles are also tested.

#include "comm.h"
#include "grains_script.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>

using namespace grains_script;

namespace {

constexpr double THICKNESS = 0.075;    // thickness of the packing's disks [m]

const std::string LOOK =
    "group look id 3\n"
    "compute s all rve/atom sxx syy sxy syx cell_xx cell_xy cell_yx cell_yy contacts sliding "
    "grains\n"
    "compute c look rve/contact/local atom id1 id2 force_x force_y branch_x branch_y fn ft "
    "normal_x normal_y sliding image_x image_y overlap\n";
enum {
  Atom,
  Id1,
  Id2,
  ForceX,
  ForceY,
  BranchX,
  BranchY,
  Fn,
  Ft,
  NormalX,
  NormalY,
  Sliding,
  ImageX,
  ImageY
};

/// A frame of a text dump.
struct Frame {
  std::map<std::string, std::size_t> column;
  std::vector<std::vector<double>> rows;
  std::vector<double> box;    // numbers of the three lines of BOX BOUNDS

  double operator()(std::size_t row, const std::string &name) const
  {
    return rows.at(row).at(column.at(name));
  }
};

std::vector<double> numbers_of(const std::string &line)
{
  std::istringstream words(line);
  std::vector<double> numbers;
  for (double number; words >> number;) numbers.push_back(number);
  return numbers;
}

Frame last_frame(const std::string &path)
{
  Frame frame;
  std::ifstream dump(path);
  for (std::string line; std::getline(dump, line);) {
    if (line == "ITEM: TIMESTEP") frame = Frame();
    if (line.rfind("ITEM: BOX BOUNDS abc origin", 0) == 0)
      for (int k = 0; k < 3 && std::getline(dump, line); ++k)
        for (const double number : numbers_of(line)) frame.box.push_back(number);
    if (line.rfind("ITEM: ATOMS ", 0) == 0) {
      std::istringstream names(line.substr(12));
      for (std::string name; names >> name;) {
        const std::size_t next = frame.column.size();
        frame.column[name] = next;
      }
    } else if (!frame.column.empty() && line.rfind("ITEM", 0) != 0) {
      frame.rows.push_back(numbers_of(line));
    }
  }
  return frame;
}

class ContactsScript : public Script {
 public:
  /// Returns the columns of compute s for atom 3, on every rank.
  std::vector<double> answer()
  {
    LAMMPS_NS::Compute *s = lmp->modify->get_compute_by_id("s");
    s->compute_peratom();
    return rows_by_id(s->size_peratom_cols,
                      [&](int i, std::vector<double> &list) {
                        list.insert(list.end(), s->array_atom[i],
                                    s->array_atom[i] + s->size_peratom_cols);
                      })
        .at(3);
  }

  /// Returns the rows of compute c on this rank.
  std::vector<std::vector<double>> contacts()
  {
    LAMMPS_NS::Compute *c = lmp->modify->get_compute_by_id("c");
    c->compute_local();
    std::vector<std::vector<double>> rows;
    for (int k = 0; k < c->size_local_rows; ++k)
      rows.emplace_back(c->array_local[k], c->array_local[k] + c->size_local_cols);
    return rows;
  }

  double sum(double mine)
  {
    double all;
    MPI_Allreduce(&mine, &all, 1, MPI_DOUBLE, MPI_SUM, lmp->world);
    return all;
  }
};

/// Checks the contacts of compute rve/contact/local. Love's sum over them must be the stress of the
/// RVE. Their number and the fraction of sliding contacts must agree with compute rve/atom.
void expect_contacts_of_the_rve(ContactsScript &script)
{
  const auto rows = script.contacts();
  const auto says = script.answer();
  double stress[4] = {}, sliding = 0.0;
  for (const auto &row : rows) {
    stress[0] += row[ForceX] * row[BranchX];
    stress[1] += row[ForceY] * row[BranchY];
    stress[2] += row[ForceX] * row[BranchY];
    stress[3] += row[ForceY] * row[BranchX];
    sliding += row[Sliding];
    EXPECT_EQ(row[Atom], 3.0);
    // The components of the force on the first grain follow from its normal and tangential parts.
    EXPECT_NEAR(row[ForceX], -row[Fn] * row[NormalX] - row[Ft] * row[NormalY], 1e-9 * row[Fn]);
    EXPECT_NEAR(row[ForceY], -row[Fn] * row[NormalY] + row[Ft] * row[NormalX], 1e-9 * row[Fn]);
  }
  const double area = says[4] * says[7] - says[5] * says[6];
  const double scale = std::fabs(says[0]) + std::fabs(says[1]);
  // Format double rounds forces to 1e-9 of the largest force.
  for (int k = 0; k < 4; ++k)
    EXPECT_NEAR(script.sum(stress[k]) / (area * THICKNESS), says[k], 1e-8 * scale) << k;
  EXPECT_EQ(script.sum((double) rows.size()), says[8]);
  // The two fractions differ by the contacts that stick and have more than 0.999 of their limit.
  EXPECT_NEAR(script.sum(sliding) / says[8], says[9], 0.01);
  EXPECT_GT(script.sum(sliding), 20.0);    // the strain makes some contacts slide
}

const std::string SHEARED =
    FOUR_ATOMS + FIX + "format double dt 1e-4 drive velocity_gradient yy v_rate xy 0.1 yx 0.05\n";

}    // namespace

TEST(RveContacts, LoveSumOverThemIsTheStressOfTheRve)
{
  ContactsScript script;
  script << SHEARED + LOOK + "run 50";

  expect_contacts_of_the_rve(script);
}

// In the plane, the contact fabric tensor is C = 4 (<n n> - 1/2), with the contact normal n and the
// mean <> over contacts. The normal, tangential and rolling elastic energies add up to the total
// elastic energy.
TEST(RveContacts, HaveTheFabricAndTheEnergyOfTheResult)
{
  ContactsScript script;
  script << SHEARED +
          "compute s all rve/atom contact_fabric_xx contact_fabric_xy fabric_xx fabric_xy "
          "elastic_normal elastic_tangential elastic_rolling elastic branch_mean fn_mean\n"
          "run 50";
  const auto says = script.answer();

  // Format double sums these quantities as integers, which rounds them.
  EXPECT_NEAR(says[0], 4.0 * (says[2] - 0.5), 1e-9);
  EXPECT_NEAR(says[1], 4.0 * says[3], 1e-9);
  EXPECT_GT(std::fabs(says[1]), 1e-3);
  EXPECT_GT(says[5], 0.01 * says[7]);
  EXPECT_NEAR(says[4] + says[5] + says[6], says[7], 1e-7 * says[7]);
  // Radii are between 2.5 and 5 mm, so the mean length of branch vectors is between 5 and 10 mm.
  EXPECT_NEAR(says[8], 7.5e-3, 2.5e-3);
  EXPECT_GT(says[9], 0.0);
}

// The atom migrates between ranks if there are several.
TEST(RveContacts, FollowTheirAtom)
{
  ContactsScript script;
  script << "processors * 1 1\n" + SHEARED + LOOK + "run 50";
  const std::size_t before = script.contacts().size();
  script << "displace_atoms all move 2.0 0 0 units box\nrun 0";

  expect_contacts_of_the_rve(script);

  if (script.lmp->comm->nprocs == 2) { EXPECT_EQ(before > 0, script.contacts().empty()); }
}

TEST(RveContacts, OfAGroupAreThoseOfAllItsRves)
{
  ContactsScript script;
  script << SHEARED +
          "group look id 2 3\n"
          "compute c look rve/contact/local atom\n"
          "compute n look rve/atom contacts\n"
          "compute all_n look reduce sum c_n\n"
          "compute mean look reduce ave c_c inputs local\nrun 20";
  LAMMPS_NS::Compute *c = script.lmp->modify->get_compute_by_id("c");
  c->compute_local();
  double mine[2] = {}, of_atom[2];
  for (int k = 0; k < c->size_local_rows; ++k) mine[c->vector_local[k] == 2.0 ? 0 : 1] += 1.0;
  MPI_Allreduce(mine, of_atom, 2, MPI_DOUBLE, MPI_SUM, script.lmp->world);
  LAMMPS_NS::Compute *mean = script.lmp->modify->get_compute_by_id("mean");

  const auto says = script.compute("n");
  EXPECT_EQ(of_atom[0], says.at(2));
  EXPECT_EQ(of_atom[1], says.at(3));
  EXPECT_NEAR(mean->compute_scalar(),
              (2.0 * of_atom[0] + 3.0 * of_atom[1]) / (of_atom[0] + of_atom[1]), 1e-12);
}

// The dump has the positions of the grains, and the compute has their contacts. The branch vectors
// of the contacts must follow from these positions.
TEST(RveGrains, DumpedGrainsTouchAtTheContacts)
{
  const std::string path = "test_rve_contacts.grains";
  ContactsScript script;
  script << SHEARED + LOOK + "dump g look rve/grain 10 " + path +
          " id type x y z radius vx vy omegaz fx fy contacts\n"
          "dump_modify g format float %.17g sort id time yes colname 7 u\nrun 50";
  const auto rows = script.contacts();
  const auto says = script.answer();
  script << "undump g";
  MPI_Barrier(script.lmp->world);
  const Frame frame = last_frame(path);

  ASSERT_EQ(frame.rows.size(), (std::size_t) says[10]);
  ASSERT_EQ(frame.box.size(), 12u);
  EXPECT_EQ(frame.box[0], says[4]);    // the columns of the cell matrix H are the cell vectors
  EXPECT_EQ(frame.box[1], says[6]);
  EXPECT_EQ(frame.box[4], says[5]);
  EXPECT_EQ(frame.box[5], says[7]);
  EXPECT_EQ(frame.column.count("u"), 1u);
  EXPECT_EQ(frame.column.count("vx"), 0u);
  std::vector<int> contacts(frame.rows.size(), 0);
  std::vector<double> force(frame.rows.size(), 0.0);
  for (const auto &row : rows) {
    const auto first = (std::size_t) row[Id1] - 1, second = (std::size_t) row[Id2] - 1;
    const double x =
        frame(second, "x") - frame(first, "x") + row[ImageX] * says[4] + row[ImageY] * says[5];
    const double y =
        frame(second, "y") - frame(first, "y") + row[ImageX] * says[6] + row[ImageY] * says[7];
    EXPECT_NEAR(x, row[BranchX], 1e-15);
    EXPECT_NEAR(y, row[BranchY], 1e-15);
    EXPECT_NEAR(frame(first, "radius") + frame(second, "radius") - std::hypot(x, y), row[14],
                1e-15);
    ++contacts[first];
    ++contacts[second];
    force[first] += row[ForceX];
    force[second] -= row[ForceX];
  }
  if (!rows.empty())    // only the rank that has the RVE
    for (std::size_t i = 0; i < frame.rows.size(); ++i) {
      EXPECT_EQ(frame(i, "id"), i + 1.0);
      EXPECT_EQ(frame(i, "contacts"), contacts[i]);
      EXPECT_NEAR(frame(i, "fx"), force[i], 1e-9);
    }
  MPI_Barrier(script.lmp->world);
  if (script.lmp->comm->me == 0) std::remove(path.c_str());
}

TEST(RveGrains, OneFrameIsWrittenWithoutARun)
{
  const std::string path = file_of_rank("grains");
  Script script(MPI_COMM_SELF);
  script << SHEARED +
          "pair_style none\ncomm_modify cutoff 1.0\ngroup look id 3\nwrite_dump look rve/grain " +
          path + " id x y radius modify format float %.17g";

  EXPECT_EQ(last_frame(path).rows.size(), 400u);
}

TEST(RveContacts, InvalidInputIsNamed)
{
  const std::string scene = SHEARED + "group look id 7\ngroup two id 1 2\n";
  EXPECT_IN("compute rve/contact/local c: there is no quantity 'force'",
            message_of(scene + "compute c all rve/contact/local id1 force"));
  EXPECT_IN("compute rve/contact/local c: at least one quantity must be given",
            message_of(scene + "compute c all rve/contact/local fix grains"));
  EXPECT_IN("compute rve/contact/local c: fix is given twice",
            message_of(scene + "compute c all rve/contact/local fix a fix b"));
  EXPECT_IN("compute rve/contact/local c: no fix of style rve is defined",
            message_of(FOUR_ATOMS + "compute c all rve/contact/local fn\nrun 0"));
  EXPECT_IN("compute rve/contact/local c: no atom of group look has an RVE of fix grains; use",
            message_of(scene +
                       "compute c look rve/contact/local fn\ndump c all local 1 none c_c\nrun 0"));
  EXPECT_IN("dump rve/grain g: there is no column 'spin'",
            message_of(scene + "dump g two rve/grain 1 none id spin"));
  EXPECT_IN("dump rve/grain g: 0 atoms of group look have an RVE of fix grains; there must be "
            "exactly one",
            message_of(scene + "dump g look rve/grain 1 none id x y\nrun 0"));
  EXPECT_IN(
      "dump rve/grain g: 2 atoms of group two have an RVE of fix grains; there must be exactly one",
      message_of(scene + "dump g two rve/grain 1 none id x y\nrun 0"));
  EXPECT_IN("dump rve/grain g: file none.bin would be binary; use a text file",
            message_of(scene + "dump g two rve/grain 1 none.bin id x y"));
  EXPECT_IN("dump_modify g: thresh is not supported by dump rve/grain",
            message_of(scene + "dump g two rve/grain 1 none id x y\ndump_modify g thresh x > 0"));
  EXPECT_IN("dump rve/grain g: fix other does not exist",
            message_of(scene + "dump g two rve/grain 1 none id x fix other\nrun 0"));
  std::remove("none");
}
