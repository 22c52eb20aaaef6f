// SPDX-License-Identifier: GPL-2.0-only
#include "rve/core/error.h"
#include "rve/engine/contact_network.h"
#include "rve/engine/drift.h"
#include "rve/engine/finite_strain.h"
#include "rve/engine/packing_io.h"
#include "support/files.h"
#include "support/messages.h"
#include "support/spheres.h"
#include "test_states.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <sys/stat.h>
#include <unistd.h>

using namespace rve;
using namespace rve_test;

namespace {

/// Writes `text` with `from` replaced by `to`, reads it as a packing and returns the error.
template <int D = 2>
std::string message_after(std::string text, const std::string &from, const std::string &to)
{
  const std::string path = temporary_path("broken.rve");
  text.replace(text.find(from), from.size(), to);
  std::ofstream(path) << text;
  const std::string message = message_of([&] { read_packing<D>(path); });
  return message.rfind(path, 0) == 0 ? message.substr(path.size()) : message;
}

const char *const TWO_GRAINS = "gpu_rve_packing 1\n"                           // line 1
                               "material\n"                                    // 2
                               "normal_stiffness 1e6\n"                        // 3
                               "tangential_stiffness 8e5\n"                    // 4
                               "friction 0.5\n"                                // 5
                               "density 2650\n"                                // 6
                               "local_damping 0.3\n"                           // 7
                               "normal_viscosity 0\n"                          // 8
                               "tangential_viscosity 0\n"                      // 9
                               "thickness 0.075\n"                             // 10
                               "mass_depth 1\n"                                // 11
                               "cell   # rows\n"                               // 12
                               "0.1 0.01\n"                                    // 13
                               "0 0.1\n"                                       // 14
                               "grains 2\n"                                    // 15
                               "2 0.004 9223372036854775808 0 0 0 0\n"         // 16
                               "1 0.005 0 18446744073709551615 1 -2 3e-1\n"    // 17
                               "contacts 1\n"                                  // 18
                               "1 2 -0.25\n"                                   // 19
                               "checksum none\n"                               // 20
                               "end\n";

const char *const TWO_SPHERES = "gpu_rve_packing 2\n"                                      // line 1
                                "dimension 3\n"                                            // 2
                                "material\n"                                               // 3
                                "normal_stiffness 1e6\n"                                   // 4
                                "tangential_stiffness 8e5\n"                               // 5
                                "friction 0.5\n"                                           // 6
                                "density 2650\n"                                           // 7
                                "local_damping 0.3\n"                                      // 8
                                "normal_viscosity 0\n"                                     // 9
                                "tangential_viscosity 0\n"                                 // 10
                                "cell\n"                                                   // 11
                                "0.1 0.01 0.02\n"                                          // 12
                                "0 0.1 0\n"                                                // 13
                                "0 0 0.2\n"                                                // 14
                                "grains 2\n"                                               // 15
                                "2 0.004 9223372036854775808 0 7 0 0 0 0 0 0\n"            // 16
                                "1 0.005 0 18446744073709551615 0 1 -2 3e-1 -4 5e3 6\n"    // 17
                                "contacts 1\n"                                             // 18
                                "1 2 -0.25 0.5 1\n"                                        // 19
                                "checksum none\n"                                          // 20
                                "end\n";

/// Checksum of TWO_GRAINS from an independent Python program. It is FNV-1a over the statements,
/// with one blank between words.
const char *const CHECKSUM_OF_TWO_GRAINS = "965fc029eee52717";

struct LammpsData {
  double lx = 0.0, ly = 0.0, xy = 0.0, xz = 0.0, yz = 0.0, zlo = 0.0, zhi = 0.0;
  std::vector<double> atoms;         // (N, 7) id type diameter density x y z
  std::vector<double> velocities;    // (N, 7) id vx vy vz wx wy wz
};

LammpsData read_lammps_data(const std::string &path)
{
  LammpsData data;
  std::ifstream file(path);
  std::string line;
  std::vector<double> *section = nullptr;
  while (std::getline(file, line)) {
    double a;
    if (line.find("xlo xhi") != std::string::npos)
      sscanf(line.c_str(), "%lf %lf", &a, &data.lx);
    else if (line.find("ylo yhi") != std::string::npos)
      sscanf(line.c_str(), "%lf %lf", &a, &data.ly);
    else if (line.find("zlo zhi") != std::string::npos)
      sscanf(line.c_str(), "%lf %lf", &data.zlo, &data.zhi);
    else if (line.find("xy xz yz") != std::string::npos)
      sscanf(line.c_str(), "%lf %lf %lf", &data.xy, &data.xz, &data.yz);
    else if (line.find("Atoms") == 0)
      section = &data.atoms;
    else if (line.find("Velocities") == 0)
      section = &data.velocities;
    else if (section) {
      std::istringstream words(line);
      for (double value; words >> value;) section->push_back(value);
    }
  }
  return data;
}

}    // namespace

TEST(PackingFile, StateIsRestoredToTheLastBit)
{
  const std::string path = temporary_path("state.rve");
  const RveState state = crowded_state(40, 7);

  write_packing(path, state);
  const RveState copy = read_packing(path);

  EXPECT_EQ(copy.radius, state.radius);
  EXPECT_EQ(copy.fractional, state.fractional);
  EXPECT_EQ(copy.velocity, state.velocity);
  EXPECT_EQ(copy.spin, state.spin);
  EXPECT_EQ(copy.largest_contact_force, state.largest_contact_force);
  ASSERT_EQ(copy.pairs.size(), state.pairs.size());
  for (std::size_t k = 0; k < state.pairs.size(); ++k) {
    EXPECT_EQ(copy.pairs[k].tangential_force, state.pairs[k].tangential_force);
    EXPECT_EQ(copy.pairs[k].rolling_force, state.pairs[k].rolling_force);
  }
  EXPECT_EQ(copy.material.law, state.material.law);
  for (const MaterialParameter &parameter : MATERIAL_PARAMETERS)
    EXPECT_EQ(copy.material.*parameter.member, state.material.*parameter.member) << parameter.name;
  for (int k = 0; k < 4; ++k) {
    EXPECT_EQ(copy.cell.component[k], state.cell.component[k]);
    EXPECT_EQ(copy.deformation.component[k], state.deformation.component[k]);
    EXPECT_EQ(copy.servo_velocity_gradient.component[k],
              state.servo_velocity_gradient.component[k]);
  }
  EXPECT_TRUE(copy.list_fractional.empty());
}

// A file of a packing without rolling resistance must not contain the parameters of rolling
// resistance.
TEST(PackingFile, OnlyPackingsWithRollingResistanceHaveItsParameters)
{
  const std::string path = temporary_path("rolling.rve");
  RveState state = crowded_state(40, 7);
  state.material.rolling_stiffness = state.material.rolling_friction = 0.0;
  for (Pair &pair : state.pairs) pair.rolling_force = 0.0;
  const auto text_of = [&] {
    write_packing(path, state);
    std::ifstream file(path);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };

  const std::string without = text_of();
  state.pairs[3].tangential_force = 0.0;    // the contact has only a rolling force
  state.pairs[3].rolling_force = 0.125;
  const std::string with_force = text_of();
  const RveState copy = read_packing(path);
  state.material.rolling_stiffness = 3.0;
  const std::string with_material = text_of();

  EXPECT_EQ(without.find("rolling"), std::string::npos);
  EXPECT_EQ(with_force.find("rolling_"), std::string::npos);
  EXPECT_EQ(copy.pairs[3].rolling_force, 0.125);
  EXPECT_NE(with_material.find("  rolling_stiffness 3    # [force/length]\n"
                               "  rolling_friction 0    # [-]\n"),
            std::string::npos);
  // Parameters that newer versions have added are written only if they are not zero.
  EXPECT_EQ(with_material.find("rolling_viscosity"), std::string::npos);
  state.material.rolling_viscosity = 0.5;
  EXPECT_NE(text_of().find("  rolling_viscosity 0.5    # [force time/length]\n"),
            std::string::npos);
  EXPECT_EQ(read_packing(path).material.rolling_viscosity, 0.5);
}

TEST(PackingFile, GrainsMayComeInAnyOrder)
{
  const std::string path = temporary_path("two.rve");
  std::ofstream(path) << TWO_GRAINS;

  const RveState state = read_packing(path);

  EXPECT_EQ(state.radius, (std::vector<double>{0.005, 0.004}));
  EXPECT_EQ(state.fractional[1], UINT64_MAX);
  EXPECT_EQ(state.fractional[2], std::uint64_t(1) << 63);
  EXPECT_EQ(state.velocity, (std::vector<double>{1.0, -2.0, 0.0, 0.0}));
  EXPECT_EQ(state.spin[0], 0.3);
  EXPECT_EQ(state.pairs[0].tangential_force, -0.25);
  EXPECT_EQ(state.pairs[0].rolling_force, 0.0);
  EXPECT_EQ(state.material.tangential_stiffness, 8e5);
  EXPECT_EQ(state.material.rolling_stiffness, 0.0);
  EXPECT_EQ(state.material.rolling_friction, 0.0);
}

TEST(PackingFile, MayNameTheContactLawBeforeItsParameters)
{
  const std::string path = temporary_path("two.rve"), two = TWO_GRAINS;
  std::string said = two;
  said.insert(said.find("normal_stiffness"), "contact_law hooke\n");
  std::ofstream(path) << said;

  const RveState state = read_packing(path);

  EXPECT_EQ(state.material.law, ContactLaw::Linear);
  EXPECT_EQ(state.material.normal_stiffness, 1e6);
  write_packing(path, state);
  std::stringstream written;
  written << std::ifstream(path).rdbuf();
  EXPECT_EQ(written.str().find("contact_law"), std::string::npos);    // it is the default
  EXPECT_EQ(message_after(said, "hooke", "hoke"),
            ":3: there is no contact law 'hoke'; did you mean hooke?");
  EXPECT_EQ(message_after(said, "hooke", "hooke 2"),
            ":3: 'contact_law hooke 2' has 3 words; expected 'contact_law word'");
  EXPECT_EQ(message_after(two, "friction 0.5", "friction 0.5\ncontact_law hooke"),
            ":6: contact_law is after another material value; it must be the first one");
}

TEST(PackingFile, BrokenFilesAreRefusedWithLineNumber)
{
  const std::string two = TWO_GRAINS;

  EXPECT_EQ(message_after(two, "gpu_rve_packing 1", "LAMMPS data"),
            ":1: found 'LAMMPS' where 'gpu_rve_packing' was expected");
  EXPECT_EQ(message_after(two, "packing 1", "packing 3"),
            ":1: version of the packing file is '3'; it must be an integer from 1 to 2");
  EXPECT_EQ(message_after(two, "stiffness 1e6", "stiffness -1e6"),
            ":3: normal_stiffness is -1000000 [force/length]; it must not be negative");
  EXPECT_EQ(message_after(two, "friction 0.5", "friction nan"),
            ":5: friction is nan; it must be finite");
  EXPECT_EQ(message_after(two, "friction 0.5", "friction 0,5"),
            ":5: friction is '0,5'; it must be a number");
  EXPECT_EQ(message_after(two, "friction 0.5", "density 1"), ":6: density is given twice");
  EXPECT_EQ(message_after(two, "mass_depth 1\n", ""),
            ":11: 'cell' is not a material value; still missing: mass_depth");
  EXPECT_EQ(message_after(two, "mass_depth 1\n", "mass_depth 1\nrolling_friction -1\n"),
            ":12: rolling_friction is -1 [-]; it must not be negative");
  EXPECT_EQ(message_after(two, "mass_depth 1\n", "mass_depth 1\nwarp 1\n"),
            ":12: 'warp' is not a material value; the material values are cell, normal_stiffness, "
            "tangential_stiffness, friction, density, local_damping, normal_viscosity, "
            "tangential_viscosity, thickness, mass_depth, rolling_stiffness, rolling_friction, "
            "rolling_viscosity");
  EXPECT_EQ(message_after(two, "friction 0.5", "frition 0.5"),
            ":5: 'frition' is not a material value; did you mean friction?");
  EXPECT_EQ(message_after(two, "grains 2", "deformaton\n1 0\n0 1\ngrains 2"),
            ":15: found 'deformaton' where 'grains' was expected; did you mean deformation?");
  EXPECT_EQ(message_after(two, "1 2 -0.25", "1 2 -0.25 much"),
            ":19: rolling force is 'much'; it must be a number");
  EXPECT_EQ(message_after(two, "0.1 0.01", "0.1"),
            ":13: '0.1' has 1 words; expected 'two numbers of cell'");
  EXPECT_EQ(message_after(two, "2 0.004", "2 -0.004"),
            ":16: radius is -0.004 [length]; it must be greater than 0");
  EXPECT_EQ(message_after(two, "1 0.005", "2 0.005"), ":17: grain 2 is given twice");
  EXPECT_EQ(message_after(two, "1 0.005", "3 0.005"),
            ":17: grain id is '3'; it must be an integer from 1 to 2");
  EXPECT_EQ(message_after(two, "18446744073709551615", "18446744073709551616"),
            ":17: fractional coordinate is '18446744073709551616'; it must be an integer from 0 to "
            "18446744073709551615");
  EXPECT_EQ(message_after(two, "1 -2 3e-1", "1 inf 3e-1"),
            ":17: peculiar velocity is inf; it must be finite");
  EXPECT_EQ(message_after(two, "grains 2", "grains 3"),
            ":18: 'contacts 1' has 2 words; expected 'id radius s_x*2^64 s_y*2^64 c_x c_y spin'");
  EXPECT_EQ(message_after(two, "1 2 -0.25", "1 1 -0.25"),
            ":19: contact connects grain 1 to itself");
  EXPECT_EQ(message_after(two, "end\n", ""), ":20: file ends where 'end' was expected");
  EXPECT_EQ(message_after(two, "0.1 0.01", "0.01 0.01").find(": cell width"), 0u);
}

TEST(PackingFile, SpheresAreRestoredToTheLastBit)
{
  const std::string path = temporary_path("spheres.rve");
  RveStateOf<3> state = crowded_spheres(60, 7);
  state.material.mass_depth = 4.0;
  state.servo_velocity_gradient(1, 2) = 0.125;
  state.deformation(0, 2) = 1.0 / 3.0;
  ASSERT_FALSE(state.pairs.empty());

  write_packing(path, state);
  const RveStateOf<3> copy = read_packing<3>(path);

  EXPECT_EQ(copy.radius, state.radius);
  EXPECT_EQ(copy.fractional, state.fractional);
  EXPECT_EQ(copy.velocity, state.velocity);
  EXPECT_EQ(copy.spin, state.spin);
  EXPECT_EQ(copy.largest_contact_force, state.largest_contact_force);
  ASSERT_EQ(copy.pairs.size(), state.pairs.size());
  for (std::size_t k = 0; k < state.pairs.size(); ++k) {
    EXPECT_EQ(copy.pairs[k].first, state.pairs[k].first);
    for (const RememberedNumber<3> &number : SPATIAL_PAIR_MEMORY)
      EXPECT_EQ(number.of(copy.pairs[k]), number.of(state.pairs[k])) << number.name;
  }
  for (const MaterialParameter &parameter : MATERIAL_PARAMETERS)
    EXPECT_EQ(copy.material.*parameter.member, state.material.*parameter.member) << parameter.name;
  for (int k = 0; k < 9; ++k) {
    EXPECT_EQ(copy.cell.component[k], state.cell.component[k]);
    EXPECT_EQ(copy.deformation.component[k], state.deformation.component[k]);
    EXPECT_EQ(copy.servo_velocity_gradient.component[k],
              state.servo_velocity_gradient.component[k]);
  }
}

TEST(PackingFile, HasItsDimension)
{
  const std::string path = temporary_path("two.rve"), disks = TWO_GRAINS, spheres = TWO_SPHERES;

  std::ofstream(path) << disks;
  EXPECT_EQ(dimension_of_packing(path), 2);
  std::ofstream(path) << spheres;
  EXPECT_EQ(dimension_of_packing(path), 3);
  const RveStateOf<3> state = read_packing<3>(path);
  EXPECT_EQ(state.velocity, (std::vector<double>{1.0, -2.0, 0.3, 0.0, 0.0, 0.0}));
  EXPECT_EQ(state.spin, (std::vector<double>{-4.0, 5e3, 6.0, 0.0, 0.0, 0.0}));
  EXPECT_EQ(state.fractional[5], 7u);
  EXPECT_EQ(state.cell(0, 2), 0.02);
  EXPECT_EQ(state.material.thickness, 1.0);
  EXPECT_EQ(state.material.mass_depth, 1.0);
  for (int a = 0; a < 3; ++a)
    EXPECT_EQ(state.pairs[0].tangential_force[a], (std::vector<double>{-0.25, 0.5, 1.0})[a]);

  EXPECT_EQ(message_after(spheres, "", ""),
            ":2: the packing has spheres (dimension 3); a packing of plane disks (dimension 2) was "
            "expected");
  EXPECT_EQ(message_after<3>(disks, "", ""),
            ":1: the packing has plane disks (dimension 2); a packing of spheres (dimension 3) was "
            "expected");
  // The dimension is optional for disks.
  EXPECT_EQ(message_after(disks, "packing 1", "packing 2\ndimension 2"), "no error");

  RveStateOf<3> thick = state;
  thick.material.thickness = 0.075;
  EXPECT_NE(message_of([&] { write_packing(path, thick); })
                .find("the thickness of spheres is 0.075 [length]; it must be 1, because spheres "
                      "have no thickness"),
            std::string::npos);
}

TEST(PackingFile, OfSpheresIsRefusedWithLineNumberWhereItIsBroken)
{
  const std::string two = TWO_SPHERES;

  EXPECT_EQ(message_after<3>(two, "", ""), "no error");
  EXPECT_EQ(message_after<3>(two, "dimension 3\n", ""),
            ":2: found 'material' where 'dimension' was expected");
  EXPECT_EQ(message_after<3>(two, "dimension 3", "dimension 4"),
            ":2: dimension of the packing is '4'; it must be an integer from 2 to 3");
  EXPECT_EQ(message_after<3>(two, "density 2650", "thickness 0.1"),
            ":7: 'thickness' is not a material value of spheres; the material values are cell, "
            "normal_stiffness, tangential_stiffness, friction, density, local_damping, "
            "normal_viscosity, tangential_viscosity, mass_scaling, rolling_stiffness, "
            "rolling_friction, twisting_stiffness, twisting_friction, rolling_viscosity, "
            "twisting_viscosity, objective_damping, twisting_marshall");
  EXPECT_EQ(message_after<3>(two, "density 2650", "density 2650\nmass_scaling -1"),
            ":8: mass_scaling is -1 [-]; it must not be negative");
  EXPECT_EQ(message_after<3>(two, "0 0.1 0\n", "0 0.1\n"),
            ":13: '0 0.1' has 2 words; expected 'three numbers of cell'");
  EXPECT_EQ(message_after<3>(two, "0 0 0.2\n", ""),
            ":14: 'grains 2' has 2 words; expected 'three numbers of cell'");
  EXPECT_EQ(message_after<3>(two, "0 0 0.2", "0 0 0.01").find(": cell width"), 0u);
  EXPECT_EQ(message_after<3>(two, " -4 5e3 6", " -4"),
            ":17: '1 0.005 0 18446744073709551615 0 1 -2 3e-1 -4' has 9 words; expected 'id radius "
            "s_x*2^64 s_y*2^64 s_z*2^64 c_x c_y c_z w_x w_y w_z'");
  EXPECT_EQ(message_after<3>(two, "5e3 6", "5e3 nan"), ":17: spin is nan; it must be finite");
  EXPECT_EQ(message_after<3>(two, "1 2 -0.25 0.5 1", "1 2 -0.25 0.5"),
            ":19: '1 2 -0.25 0.5' has 4 words; expected 'id id tangential_force_x "
            "tangential_force_y tangential_force_z'");
  EXPECT_EQ(message_after<3>(two, "0.5 1\nchecksum", "0.5 z\nchecksum"),
            ":19: z component of the tangential force is 'z'; it must be a number");
  EXPECT_EQ(
      message_after<3>(two, "checksum none", "checksum 0123456789abcdef")
          .find(":20: checksum is 0123456789abcdef, but the statements before it have checksum "),
      0u);
}

TEST(PackingFile, TextAfterTheEndIsRefused)
{
  const std::string two = TWO_GRAINS;

  EXPECT_EQ(message_after(two, "end\n", "end\n\ngpu_rve_packing 1\n"),
            ":23: found 'gpu_rve_packing' after 'end'; only blank lines and comments may follow");
  EXPECT_EQ(message_after(two, "end\n", "end\n \n# a comment\n"), "no error");
}

// The reader detects any changed digit, since FNV-1a detects every change of a single byte.
TEST(PackingFile, EveryChangedDigitIsFound)
{
  const std::string path = temporary_path("digits.rve");
  write_packing(path, crowded_state(16, 3));
  const std::string text = text_of(path);
  int digits = 0, changes = 0;
  bool in_comment = false;
  for (std::size_t k = 0; k < text.size(); ++k) {
    if (text[k] == '#' || text[k] == '\n') in_comment = text[k] == '#';
    if (in_comment || text[k] < '0' || text[k] > '9' || ++digits % 5 != 0) continue;
    std::string changed = text;
    changed[k] = static_cast<char>('0' + (text[k] - '0' + 1 + k % 9) % 10);
    std::ofstream(path) << changed;
    const std::string message = message_of([&] { read_packing(path); });
    EXPECT_EQ(message.rfind(path + ":", 0), 0u) << "byte " << k << ": " << message;
    ++changes;
  }
  EXPECT_GT(changes, 250);
}

TEST(PackingFile, ChecksumIsOfTheWords)
{
  const std::string none = "checksum none", sum = std::string("checksum ") + CHECKSUM_OF_TWO_GRAINS;
  std::string two = TWO_GRAINS;
  two.replace(two.find(none), none.size(), sum);

  EXPECT_EQ(message_after(two, "end\n", "end\n"), "no error");
  EXPECT_EQ(message_after(two, "material\n", "  material  # of both\n\n"), "no error");
  EXPECT_EQ(
      message_after(two, "0.004", "0.003"),
      ":20: checksum is " + std::string(CHECKSUM_OF_TWO_GRAINS) +
          ", but the statements before it have checksum 5f1acc47eb3f5c60: the file is damaged, or "
          "was changed by hand; to read it without this check, replace the checksum by 'checksum "
          "none'");
}

TEST(PackingFile, MissingChecksumMustBeDeclared)
{
  const std::string two = TWO_GRAINS;

  EXPECT_EQ(
      message_after(two, "checksum none\n", ""),
      ":20: there is no checksum before 'end': the file is damaged, or was written by hand or "
      "by an earlier version; to read it without this check, add the line 'checksum none' before "
      "'end'");
  EXPECT_EQ(message_after(two, "checksum none", "checksum nine"),
            ":20: checksum is 'nine'; it must be 16 hexadecimal digits, or none");
  EXPECT_EQ(message_after(two, "0.004", "0.003"), "no error");
}

TEST(PackingFile, PathThatIsNoFileIsRefusedWithTheReason)
{
  const std::string folder = testing::TempDir(), fifo = temporary_path("fifo");
  std::remove(fifo.c_str());
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  const auto message = [](const std::string &path) {
    return message_of([&] { read_packing(path); });
  };

  EXPECT_EQ(message("/nowhere/packing.rve"),
            "cannot open packing file /nowhere/packing.rve: No such file or directory");
  EXPECT_EQ(message(folder), "cannot open packing file " + folder + ": Is a directory");
  EXPECT_EQ(message(fifo),
            "cannot open packing file " + fifo +
                ": it is a fifo, a device or a socket; it must be a regular file");
  std::remove(fifo.c_str());
}

TEST(PackingFile, IsReadWithAByteOrderMarkAndRefusedIfItIsNotText)
{
  const std::string path = temporary_path("packing.rve");
  const RveState state = crowded_state(20, 3);
  write_packing(path, state);
  const std::string text = text_of(path);
  const auto message_with = [&](const std::string &other) {
    std::ofstream(path, std::ios::binary) << other;
    return message_of([&] { read_packing(path); });
  };
  std::string binary = text, old = text;
  binary[binary.find('\n') + 3] = '\0';
  for (char &letter : old)
    if (letter == '\n') letter = '\r';

  EXPECT_EQ(message_with("\xEF\xBB\xBF" + text), "no error");
  EXPECT_EQ(message_with(binary),
            path + ":2: the line has a byte 0; the file must be plain text, not binary or UTF-16");
  EXPECT_EQ(message_with(old),
            path + ":1: the line has a carriage return inside; lines must end with a line feed");
}

TEST(PackingFile, FailedWriteLeavesTheOldFile)
{
  const std::string path = temporary_path("kept.rve");
  write_packing(path, crowded_state(5, 1));
  const std::string before = text_of(path);
  RveState unsound = crowded_state(5, 2);
  unsound.radius[3] = std::nan("");

  EXPECT_THROW(write_packing(path, unsound), InputError);
  EXPECT_THROW(write_packing("/nowhere/packing.rve", crowded_state(5, 1)), InputError);

  EXPECT_EQ(text_of(path), before);
}

TEST(LammpsData, PositionsAreThePackingRotatedToTheXAxis)
{
  RveState state = crowded_state(30, 5);
  const double turn = 0.7;
  const Tensor2 rotation{{std::cos(turn), -std::sin(turn), std::sin(turn), std::cos(turn)}};
  state.cell = rotation * Tensor2{{1.5, 4.0, 0.0, 1.2}};    // tilt far beyond half a box
  const std::string path = temporary_path("data.lmp");

  write_lammps_data(path, state);
  const LammpsData data = read_lammps_data(path);

  EXPECT_NEAR(data.lx, 1.5, 1e-14);
  EXPECT_NEAR(data.ly, 1.2, 1e-14);
  EXPECT_NEAR(data.xy, -0.5, 1e-14);
  EXPECT_LT(data.zlo, 0.0);
  EXPECT_EQ(data.zhi, -data.zlo);
  ASSERT_EQ(data.atoms.size(), 7u * 30u);
  const std::vector<double> xy = state.positions();
  for (int i = 0; i < 30; ++i) {
    const double *atom = &data.atoms[7 * i], *velocity = &data.velocities[7 * i];
    EXPECT_EQ(atom[0], i + 1);
    EXPECT_EQ(atom[2], 2.0 * state.radius[i]);
    const double lammps_mass = atom[3] * 4.0 / 3.0 * M_PI * std::pow(state.radius[i], 3);
    const double mass = state.material.density * state.material.mass_depth * M_PI *
        state.radius[i] * state.radius[i];
    EXPECT_NEAR(lammps_mass, mass, 1e-14 * mass);

    // the same position modulo the lattice of LAMMPS' box
    const double x = rotation(0, 0) * xy[2 * i] + rotation(1, 0) * xy[2 * i + 1] - atom[4];
    const double y = rotation(0, 1) * xy[2 * i] + rotation(1, 1) * xy[2 * i + 1] - atom[5];
    const double s_y = y / data.ly, s_x = (x - data.xy * s_y) / data.lx;
    EXPECT_NEAR(s_y, std::round(s_y), 1e-13);
    EXPECT_NEAR(s_x, std::round(s_x), 1e-13);
    EXPECT_GE(atom[5], 0.0);
    EXPECT_LE(atom[5], data.ly);

    const double c_x = rotation(0, 0) * velocity[1] + rotation(0, 1) * velocity[2];
    EXPECT_NEAR(c_x, state.velocity[2 * i], 1e-15);
    EXPECT_EQ(velocity[6], state.spin[i]);
  }
}

TEST(LammpsData, ContactTableGivesLoveStressInTheRotatedFrame)
{
  RveState state = two_disks(1e-4);
  state.pairs.push_back(
      {1, 0, 7.0});    // the number does not change if the other grain owns the pair
  const std::string path = temporary_path("data.lmp");

  write_lammps_data(path, state);
  std::istringstream table(text_of(path + ".contacts"));
  std::string comment;
  std::getline(table, comment);
  std::getline(table, comment);
  double row[11];
  for (double &value : row) table >> value;

  EXPECT_TRUE(static_cast<bool>(table));
  EXPECT_EQ(row[0], 1.0);
  EXPECT_EQ(row[1], 2.0);
  EXPECT_NEAR(row[2], 0.6 * 0.0089, 1e-16);
  EXPECT_NEAR(row[4], 0.6, 1e-13);
  EXPECT_NEAR(row[6], 1e-4, 1e-16);
  EXPECT_NEAR(row[7], 100.0, 1e-10);
  EXPECT_EQ(row[8], 7.0);
  EXPECT_NEAR(row[9], -100.0 * 0.6 - 7.0 * 0.8, 1e-10);
  EXPECT_NEAR(row[10], -100.0 * 0.8 + 7.0 * 0.6, 1e-10);
}

TEST(LammpsData, SpheresAreRotatedAsAWhole)
{
  Spheres state = disordered_spheres(spheres_material(), 5, 3);
  SphereRig rig(state);
  rig.strain(Tensor3{{-30.0, 9.0, 3.0, -6.0, -24.0, 6.0, 1.5, 3.0, -36.0}}, 5e-6, 300);
  state = rig.state();
  // other vectors of the same lattice, tilted far beyond half a box
  const auto add = [&](int axis, int other, int multiple) {
    for (int k = 0; k < 3; ++k) state.cell(k, axis) += multiple * state.cell(k, other);
    for (int i = 0; i < state.num_grains(); ++i)
      state.fractional[3 * i + other] -=
          static_cast<std::uint64_t>(multiple) * state.fractional[3 * i + axis];
  };
  add(1, 0, 2);
  add(2, 1, -1);
  // The state is rotated.
  const Tensor3 turn = spatial_rotation(Vec<double, 3>{{0.4, -1.1, 0.7}});
  state.cell = turn * state.cell;
  for (std::vector<double> *vectors : {&state.velocity, &state.spin})
    for (std::size_t i = 0; i < vectors->size(); i += 3) {
      const Vec<double, 3> turned =
          turn * Vec<double, 3>{{(*vectors)[i], (*vectors)[i + 1], (*vectors)[i + 2]}};
      for (int a = 0; a < 3; ++a) (*vectors)[i + a] = turned[a];
    }
  for (PairOf<3> &pair : state.pairs) pair.tangential_force = turn * pair.tangential_force;
  const std::string path = temporary_path("spheres.lmp");

  write_lammps_data(path, state);
  const LammpsData data = read_lammps_data(path);

  const Tensor3 box{
      {data.lx, data.xy, data.xz, 0.0, data.ly, data.yz, 0.0, 0.0, data.zhi - data.zlo}};
  EXPECT_NEAR(determinant(box) / state.cell_volume(), 1.0, 1e-12);
  EXPECT_LE(std::fabs(data.xy), 0.5 * data.lx);
  EXPECT_LE(std::fabs(data.xz), 0.5 * data.lx);
  EXPECT_LE(std::fabs(data.yz), 0.5 * data.ly);
  ASSERT_EQ(data.atoms.size(), 7u * state.num_grains());
  // Both lattices agree except for a rotation.
  const Vec<double, 3> a = column(state.cell, 0), b = column(state.cell, 1);
  Tensor3 rotation;
  const auto set_row = [&](int row, const Vec<double, 3> &v) {
    for (int k = 0; k < 3; ++k) rotation(row, k) = v[k] / std::sqrt(dot(v, v));
  };
  set_row(0, a);
  set_row(1, cross(cross(a, b), a));
  set_row(2, cross(a, b));
  const Tensor3 to_box = inverse(box);
  const Tensor3 lattice = to_box * (rotation * state.cell);
  for (const double number : lattice.component) EXPECT_NEAR(number, std::round(number), 1e-12);

  const std::vector<double> x = state.positions();
  const auto vector_of = [](const std::vector<double> &numbers, std::size_t at) {
    return Vec<double, 3>{{numbers[at], numbers[at + 1], numbers[at + 2]}};
  };
  for (int i = 0; i < state.num_grains(); ++i) {
    EXPECT_EQ(data.atoms[7 * i + 2], 2.0 * state.radius[i]);
    EXPECT_EQ(data.atoms[7 * i + 3], 2650.0);
    const Vec<double, 3> apart =
        to_box * (rotation * vector_of(x, 3 * i) - vector_of(data.atoms, 7 * i + 4));
    const Vec<double, 3> c = rotation * vector_of(state.velocity, 3 * i),
                         w = rotation * vector_of(state.spin, 3 * i);
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(apart[k], std::round(apart[k]), 1e-12);
      EXPECT_NEAR(data.velocities[7 * i + 1 + k], c[k], 1e-15);
      EXPECT_NEAR(data.velocities[7 * i + 4 + k], w[k], 1e-13);
    }
  }

  // The forces and branch vectors in the table must add up to the rotated stress of the springs.
  std::istringstream table(text_of(path + ".contacts"));
  std::string line;
  std::getline(table, line);
  std::getline(table, line);
  Tensor3 stress = Tensor3::zero();
  double largest_tangential = 0.0;
  while (std::getline(table, line)) {
    std::istringstream words(line);
    double row[16];
    for (double &value : row) words >> value;
    ASSERT_TRUE(static_cast<bool>(words)) << line;
    stress = stress +
        dyad(Vec<double, 3>{{row[13], row[14], row[15]}}, Vec<double, 3>{{row[2], row[3], row[4]}});
    largest_tangential = std::fmax(largest_tangential, std::fabs(row[10]));
  }
  EXPECT_GT(largest_tangential, 0.0);
  const Tensor3 expected = rotation * spring_stress(state) * transpose(rotation);
  for (int k = 0; k < 9; ++k)
    EXPECT_NEAR(stress.component[k] / state.cell_volume(), expected.component[k],
                1e-11 * std::fabs(trace(expected)));
}

// write_rve to /dev/null must not make a file /dev/null.contacts.
TEST(LammpsData, ADeviceGetsNoContactTable)
{
  const std::string link = temporary_path("null");
  std::remove(link.c_str());
  ASSERT_EQ(symlink("/dev/null", link.c_str()), 0);

  write_lammps_data(link, two_disks(1e-4));

  EXPECT_FALSE(std::ifstream(link + ".contacts").is_open());
  std::remove(link.c_str());
}

TEST(LammpsData, ContactTableHasRollingForcesOnTheFirstGrain)
{
  RveState state = two_disks(1e-4);
  const auto last_column = [&](const rve::Pair &pair) {
    state.pairs = {pair};
    const std::string path = temporary_path("data.lmp");
    write_lammps_data(path, state);
    std::istringstream table(text_of(path + ".contacts"));
    std::string line, name, value;
    std::getline(table, line);
    std::getline(table, line);
    for (std::istringstream names(line); names >> name;) {}
    std::getline(table, line);
    for (std::istringstream values(line); values >> value;) {}
    return name + " " + value;
  };

  EXPECT_EQ(last_column({0, 1, 7.0, 2.5}), "f_r 2.5");
  EXPECT_EQ(last_column({1, 0, 7.0, 2.5}), "f_r -2.5");    // the other grain owns the pair
  EXPECT_EQ(last_column({0, 1, 7.0, 0.0}).substr(0, 7), "force_y");
}

TEST(ContactNetwork, BinsFindAllPairs)
{
  const RveState state =
      crowded_state(400, 9);    // cell about 1.5 wide, contact distance 0.2: bins are used
  RveState many = state;
  for (double &r : many.radius) r *= 0.2;
  std::vector<std::pair<int, int>> all_pairs;
  for (int i = 0; i < many.num_grains(); ++i)
    for (int j = i + 1; j < many.num_grains(); ++j) {
      const Vec<double, 2> branch = branch_vector(many, i, j);
      if (std::hypot(branch[0], branch[1]) < many.radius[i] + many.radius[j])
        all_pairs.push_back({i, j});
    }

  std::vector<std::pair<int, int>> found;
  for (const TouchingPair &contact : find_contacts(many))
    found.push_back({contact.first, contact.second});

  EXPECT_GT(found.size(), 50u);
  EXPECT_EQ(found, all_pairs);
}

TEST(Drift, IsTheMeanVelocityIfItDominatesTheMotion)
{
  RveState state = crowded_state(40, 7);
  EXPECT_EQ(describe_drift(drift_of(state)), "");    // fluctuations only
  const Vec<double, 2> more{{10.0, -5.0}};
  remove_drift(state, -1.0 * more);

  const Vec<double, 2> drift = drift_of(state);
  remove_drift(state, drift);

  EXPECT_NEAR(drift[0], 10.0, 0.5);
  EXPECT_NEAR(drift[1], -5.0, 0.5);
  double momentum[2] = {0.0, 0.0}, mass = 0.0;
  for (int i = 0; i < state.num_grains(); ++i) {
    const double m = state.radius[i] * state.radius[i];
    mass += m;
    for (int a = 0; a < 2; ++a) momentum[a] += m * state.velocity[2 * i + a];
  }
  for (const double p : momentum) EXPECT_NEAR(p / mass, 0.0, 1e-14);
  EXPECT_EQ(describe_drift(drift_of(state)), "");
}

TEST(Drift, IsZeroAtRestUpToRounding)
{
  RveState state = crowded_state(40, 7);
  std::fill(state.velocity.begin(), state.velocity.end(), 0.0);
  EXPECT_EQ(describe_drift(drift_of(state)), "");
  for (double &v : state.velocity) v = 1e-12;
  EXPECT_EQ(describe_drift(drift_of(state)), "");
}

TEST(Drift, OfEqualVelocitiesIsExact)
{
  RveState state = crowded_state(40, 7);
  for (std::size_t k = 0; k < state.velocity.size(); ++k) state.velocity[k] = k % 2 ? -5.1 : 10.3;
  remove_drift(state, drift_of(state));
  EXPECT_EQ(state.velocity, std::vector<double>(state.velocity.size(), 0.0));
}
