// SPDX-License-Identifier: GPL-2.0-only
// The main program of tests with LAMMPS. It initialises MPI before the first test and finalises it
// after the last one.

#include "support/run_tests.h"

#include <mpi.h>

int main(int argc, char **argv)
{
  MPI_Init(&argc, &argv);
  const int result = rve_test::run_tests(argc, argv);
  MPI_Finalize();
  return result;
}
