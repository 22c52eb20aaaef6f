// SPDX-License-Identifier: GPL-2.0-only
// Shared parts of the tests of fix rve: a box with four atoms that have the same packing, and
// scripts with one fix rve whose ID is grains.

#pragma once

#include "script.h"
#include "support/files.h"

#include <gtest/gtest.h>

#include <sstream>
#include <string>

#define EXPECT_IN(part, whole) EXPECT_PRED_FORMAT2(::testing::IsSubstring, part, whole)

namespace grains_script {

inline const std::string PACKING = EXAMPLE_PACKINGS "/A_h0075.rve";

/// A script with a fix rve whose ID is grains.
class GrainsScript : public Script {
 public:
  double fix_value(int n) { return Script::fix_value("grains", n); }

  double per_atom(const std::string &compute, int i)
  {
    LAMMPS_NS::Compute *c = lmp->modify->get_compute_by_id(compute);
    c->compute_peratom();
    return c->vector_atom[i];
  }

  std::string state(int atom)
  {
    const std::string path = rve_test::temporary_path("state.rve");
    *this << "write_rve grains atom " + std::to_string(atom) + " file " + path + " format rve";
    return rve_test::text_of(path);
  }
};

inline const std::string BOX = R"(units si
dimension 2
boundary p p p
atom_style atomic
region box block 0 4 0 4 -0.5 0.5
create_box 1 box
mass 1 1.0
timestep 1e-3
thermo_modify norm no
)";

inline const std::string FOUR_ATOMS = BOX + R"(create_atoms 1 single 0.5 0.5 0
create_atoms 1 single 2.5 0.5 0
create_atoms 1 single 0.5 2.5 0
create_atoms 1 single 2.5 2.5 0
variable rate atom -0.05*id
)";

inline const std::string FIX = "fix grains all rve " + PACKING + " threads 1 ";
inline const std::string SHEAR = FIX + "dt 1e-4 drive velocity_gradient yy v_rate xy 0.1\n";

/// Returns the file of a packing of 16 disks at 20 kPa. The first rank makes the file for all
/// ranks.
inline std::string few_grains()
{
  static const std::string file = [] {
    const std::string path = rve_test::temporary_path("few.rve");
    int rank;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    if (rank == 0)
      Script(MPI_COMM_SELF) << BOX + "create_rve " + path +
              " grains 16 seed 5 radius uniform 0.004 0.005 kn 1e6 friction 0.5 damping 0.3 "
              "density 2650 pressure 2e4 thickness 0.075\n";
    MPI_Barrier(MPI_COMM_WORLD);
    return path;
  }();
  return file;
}

/// Runs the lines and returns their log. All ranks must call it. One rank writes the log. The first
/// barrier lets the other ranks read it only after it is closed. The second barrier delays the next
/// log until all ranks have read this one.
inline std::string log_of(const std::string &lines)
{
  const std::string path = rve_test::temporary_path("log");
  Script script;
  script << "log " + path + "\n" + lines + "\nlog none";
  MPI_Barrier(MPI_COMM_WORLD);
  const std::string text = rve_test::text_of(path);
  MPI_Barrier(MPI_COMM_WORLD);
  return text;
}

/// Returns the word that follows `word` in a packing file, or an empty string if `word` is missing.
inline std::string value_in(const std::string &packing, const std::string &word)
{
  std::istringstream words(packing);
  for (std::string text; words >> text;)
    if (text == word && words >> text) return text;
  return "";
}

}    // namespace grains_script
