// SPDX-License-Identifier: GPL-2.0-only
// The main program of tests.

#include "support/run_tests.h"

int main(int argc, char **argv)
{
  return rve_test::run_tests(argc, argv);
}
