// SPDX-License-Identifier: GPL-2.0-only
// Memory that the ranks of one machine share. Each rank must read the numbers that the others
// write.

#include "lammps/rank_resources.h"

#include <algorithm>
#include <cstdint>
#include <gtest/gtest.h>
#include <mpi.h>

TEST(RankMemory, AllRanksReadTheNumbersOfOne)
{
  int rank = 0, ranks = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  const std::size_t count = 100000;
  const auto memory = LAMMPS_NS::memory_in_common(MPI_COMM_WORLD, count * sizeof(std::int64_t));
  ASSERT_TRUE(memory);
  const auto *begin = static_cast<const std::int64_t *>(memory.get());
  EXPECT_EQ(std::count(begin, begin + count, 0), static_cast<std::ptrdiff_t>(count));
  MPI_Barrier(MPI_COMM_WORLD);
  auto *words = static_cast<volatile std::int64_t *>(memory.get());
  const std::size_t last = count - 1;
  words[last - rank] = 100 + rank;
  MPI_Barrier(MPI_COMM_WORLD);
  for (int other = 0; other < ranks; ++other) EXPECT_EQ(words[last - other], 100 + other);
}
