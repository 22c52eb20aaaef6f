// SPDX-License-Identifier: GPL-2.0-only
// LAMMPS scripts in tests. They run line by line on a communicator; tests read properties of the
// atoms and the final error.

#pragma once

#include "atom.h"
#include "compute.h"
#include "exceptions.h"
#include "fix.h"
#include "input.h"
#include "lammps.h"
#include "modify.h"
#include "support/files.h"

#include <map>
#include <memory>
#include <mpi.h>
#include <sstream>
#include <string>
#include <vector>

/// Returns a path under `name` that differs between ranks.
inline std::string file_of_rank(const std::string &name)
{
  int rank;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  return rve_test::temporary_path(std::to_string(rank) + "." + name);
}

/// A LAMMPS without screen output that runs lines on a communicator. It writes a log if `log` is a
/// file name.
class Script {
 public:
  explicit Script(MPI_Comm comm = MPI_COMM_WORLD, const std::string &log = "none")
  {
    std::vector<std::string> words = {"lmp", "-log", log, "-screen", "none", "-nocite"};
    std::vector<char *> argv;
    for (auto &word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    lmp = std::make_unique<LAMMPS_NS::LAMMPS>((int) words.size(), argv.data(), comm);
  }

  Script &operator<<(const std::string &lines)
  {
    std::istringstream stream(lines);
    for (std::string line; std::getline(stream, line);)
      if (line.find_first_not_of(" \t") != std::string::npos) lmp->input->one(line);
    return *this;
  }

  using Values = std::map<LAMMPS_NS::tagint, double>;

  using Rows = std::map<LAMMPS_NS::tagint, std::vector<double>>;

  /// Gathers one row per atom from all ranks. Every rank gets all rows, by atom ID. append(i, list)
  /// must append the `width` values of local atom i to the list.
  template <class Append> Rows rows_by_id(int width, const Append &append)
  {
    const LAMMPS_NS::Atom *atom = lmp->atom;
    std::vector<double> mine;
    for (int i = 0; i < atom->nlocal; ++i) {
      mine.push_back((double) atom->tag[i]);
      append(i, mine);
    }
    int size, count = (int) mine.size();
    MPI_Comm_size(lmp->world, &size);
    std::vector<int> counts(size), offsets(size, 0);
    MPI_Allgather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, lmp->world);
    for (int r = 1; r < size; ++r) offsets[r] = offsets[r - 1] + counts[r - 1];
    std::vector<double> all(offsets[size - 1] + counts[size - 1]);
    MPI_Allgatherv(mine.data(), count, MPI_DOUBLE, all.data(), counts.data(), offsets.data(),
                   MPI_DOUBLE, lmp->world);
    Rows rows;
    for (auto row = all.begin(); row != all.end(); row += 1 + width)
      rows[(LAMMPS_NS::tagint) *row] = {row + 1, row + 1 + width};
    return rows;
  }

  /// Returns the custom property d_name of the atoms of all ranks, by atom ID, on every rank.
  Values property(const char *name)
  {
    int is_double, columns;
    return by_id(lmp->atom->dvector[lmp->atom->find_custom(name, is_double, columns)]);
  }

  /// Evaluates a per-atom compute with one value per atom. Returns the values of all atoms, by atom
  /// ID, on every rank.
  Values compute(const std::string &id)
  {
    LAMMPS_NS::Compute *compute = lmp->modify->get_compute_by_id(id);
    compute->compute_peratom();
    return by_id(compute->vector_atom);
  }

  /// Returns entry `n` of the vector of a fix; `n` counts from 1.
  double fix_value(const std::string &id, int n)
  {
    return lmp->modify->get_fix_by_id(id)->compute_vector(n - 1);
  }

  std::unique_ptr<LAMMPS_NS::LAMMPS> lmp;

 private:
  Values by_id(const double *of_local_atoms)
  {
    Values values;
    const Rows rows =
        rows_by_id(1, [=](int i, std::vector<double> &list) { list.push_back(of_local_atoms[i]); });
    for (const auto &[id, row] : rows) values[id] = row[0];
    return values;
  }
};

/// Returns the error message of the lines, or an empty string if they run. Each rank runs its own
/// LAMMPS. If all ranks ran one LAMMPS, an error on one rank would leave the other ranks waiting.
inline std::string message_of(const std::string &lines)
{
  Script script(MPI_COMM_SELF);
  try {
    script << lines;
  } catch (const LAMMPS_NS::LAMMPSException &problem) {
    return problem.what();
  }
  return "";
}
