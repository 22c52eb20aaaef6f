// SPDX-License-Identifier: GPL-2.0-only
// Measures the time to generate random fields, on several MPI ranks in three ways:
//   replicated   each rank generates the same field
//   one_rank     one rank generates the field and broadcasts it, as the command random_field does
//   distributed  all ranks share the work by a Fourier transform with distributed rows
// Grids are square. The correlation length is a tenth of an edge or 60 nodes, whichever is less, so
// that the torus needs no padding. The program adds its rows to the rows that the output file
// already has.
//
//   mpirun -np 2 bench_field <output.json> [nodes per edge ...]

#include "bench_report.h"
#include "field/circulant_embedding.h"
#include "field/normal_numbers.h"

#include <fftw3.h>
#include <mpi.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <complex>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

namespace {

int num_ranks, me;

/// Fourier transform of real numbers on a torus of m by m points. Each rank has some rows for the
/// transform along x and some columns for the transform along y.
class DistributedFft {
 public:
  explicit DistributedFft(int m) :
      m_(m), half_(m / 2 + 1), rows_(m / num_ranks), columns_((half_ + num_ranks - 1) / num_ranks),
      row_data_(2 * std::size_t(half_) * rows_), column_data_(std::size_t(columns_) * m),
      send_(std::size_t(rows_) * columns_ * num_ranks), receive_(send_.size())
  {
    auto *rows = reinterpret_cast<fftw_complex *>(row_data_.data());
    auto *columns = reinterpret_cast<fftw_complex *>(column_data_.data());
    plans_[0] = fftw_plan_many_dft_r2c(1, &m_, rows_, row_data_.data(), nullptr, 1, 2 * half_, rows,
                                       nullptr, 1, half_, FFTW_ESTIMATE);
    plans_[1] = fftw_plan_many_dft(1, &m_, columns_, columns, nullptr, 1, m_, columns, nullptr, 1,
                                   m_, FFTW_FORWARD, FFTW_ESTIMATE);
    plans_[2] = fftw_plan_many_dft(1, &m_, columns_, columns, nullptr, 1, m_, columns, nullptr, 1,
                                   m_, FFTW_BACKWARD, FFTW_ESTIMATE);
    plans_[3] = fftw_plan_many_dft_c2r(1, &m_, rows_, rows, nullptr, 1, half_, row_data_.data(),
                                       nullptr, 1, 2 * half_, FFTW_ESTIMATE);
  }
  ~DistributedFft()
  {
    for (auto plan : plans_) fftw_destroy_plan(plan);
  }
  DistributedFft(const DistributedFft &) = delete;

  int rows() const { return rows_; }
  double *row(int j) { return &row_data_[2 * std::size_t(half_) * j]; }
  std::vector<std::complex<double>> &columns() { return column_data_; }

  void forward()
  {
    fftw_execute(plans_[0]);
    transpose_rows([](std::complex<double> &packed, std::complex<double> &row) { packed = row; },
                   send_);
    exchange();
    transpose_columns(
        [](std::complex<double> &packed, std::complex<double> &column) { column = packed; },
        receive_);
    fftw_execute(plans_[1]);
  }

  void backward()
  {
    fftw_execute(plans_[2]);
    transpose_columns(
        [](std::complex<double> &packed, std::complex<double> &column) { packed = column; }, send_);
    exchange();
    transpose_rows([](std::complex<double> &packed, std::complex<double> &row) { row = packed; },
                   receive_);
    fftw_execute(plans_[3]);
  }

 private:
  using Packed = std::vector<std::complex<double>>;

  std::complex<double> &packed_at(Packed &packed, int rank, int j, int k)
  {
    return packed[(std::size_t(rank) * rows_ + j) * columns_ + k];
  }
  template <class Copy> void transpose_rows(const Copy &copy, Packed &packed)
  {
    for (int rank = 0; rank < num_ranks; ++rank)
      for (int j = 0; j < rows_; ++j) {
        auto *row = reinterpret_cast<std::complex<double> *>(this->row(j));
        for (int k = 0; k < std::min(columns_, half_ - rank * columns_); ++k)
          copy(packed_at(packed, rank, j, k), row[rank * columns_ + k]);
      }
  }
  template <class Copy> void transpose_columns(const Copy &copy, Packed &packed)
  {
    for (int rank = 0; rank < num_ranks; ++rank)
      for (int first = 0; first < rows_; first += 16)    // blocks, for the cache
        for (int k = 0; k < columns_; ++k)
          for (int j = first; j < std::min(first + 16, rows_); ++j)
            copy(packed_at(packed, rank, j, k),
                 column_data_[std::size_t(k) * m_ + rank * rows_ + j]);
  }
  void exchange()
  {
    MPI_Alltoall(send_.data(), 2 * rows_ * columns_, MPI_DOUBLE, receive_.data(),
                 2 * rows_ * columns_, MPI_DOUBLE, MPI_COMM_WORLD);
  }

  int m_, half_, rows_, columns_;
  std::vector<double> row_data_;
  Packed column_data_, send_, receive_;
  fftw_plan plans_[4];
};

/// Generates a field of exponential covariance as CirculantEmbedding does, without padding and
/// checks. Each rank draws its own noise.
std::vector<double> distributed_field(int nodes, double length)
{
  const int m = 2 * nodes;
  DistributedFft fft(m);
  for (int j = 0; j < fft.rows(); ++j) {
    const int row = me * fft.rows() + j;
    const double y = std::min(row, m - row);
    for (int i = 0; i <= m / 2; ++i)
      fft.row(j)[i] = std::exp(-std::sqrt(y * y + 1.0 * i * i) / length);
    for (int i = m / 2 + 1; i < m; ++i) fft.row(j)[i] = fft.row(j)[m - i];
  }
  fft.forward();
  std::vector<double> root;
  root.reserve(fft.columns().size());
  for (const auto &eigenvalue : fft.columns())
    root.push_back(std::sqrt(std::max(eigenvalue.real(), 0.0)) / (double(m) * m));
  field::NormalNumbers normal(me);
  for (int j = 0; j < fft.rows(); ++j) normal.fill(fft.row(j), m);
  fft.forward();
  for (std::size_t k = 0; k < root.size(); ++k) fft.columns()[k] *= root[k];
  fft.backward();

  std::vector<int> counts(num_ranks), offsets(num_ranks);
  for (int rank = 0, total = 0; rank < num_ranks; total += counts[rank++]) {
    counts[rank] = nodes * std::clamp(nodes - rank * fft.rows(), 0, fft.rows());
    offsets[rank] = total;
  }
  std::vector<double> mine, all(std::size_t(nodes) * nodes);
  mine.reserve(counts[me]);
  for (int j = 0; j < counts[me] / nodes; ++j)
    mine.insert(mine.end(), fft.row(j), fft.row(j) + nodes);
  MPI_Allgatherv(mine.data(), counts[me], MPI_DOUBLE, all.data(), counts.data(), offsets.data(),
                 MPI_DOUBLE, MPI_COMM_WORLD);
  return all;
}

/// Synchronises all ranks as random_field does; a waiting rank sleeps and frees its core.
void sleep_until_all_are_here()
{
  MPI_Request all;
  MPI_Ibarrier(MPI_COMM_WORLD, &all);
  for (int here = 0; !here;) {
    MPI_Test(&all, &here, MPI_STATUS_IGNORE);
    if (!here) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

/// Returns the least time of three runs [s].
template <class Work> double seconds(const Work &work)
{
  double best = HUGE_VAL;
  for (int repeat = 0; repeat < 3; ++repeat) {
    MPI_Barrier(MPI_COMM_WORLD);
    const double start = MPI_Wtime();
    work();
    MPI_Barrier(MPI_COMM_WORLD);
    best = std::min(best, MPI_Wtime() - start);
  }
  return best;
}

}    // namespace

int main(int argc, char **argv)
{
  MPI_Init(&argc, &argv);
  MPI_Comm_size(MPI_COMM_WORLD, &num_ranks);
  MPI_Comm_rank(MPI_COMM_WORLD, &me);
  if (argc < 2) {
    if (me == 0) std::fprintf(stderr, "usage: %s <output.json> [nodes per edge ...]\n", argv[0]);
    MPI_Abort(MPI_COMM_WORLD, 1);
  }
  std::vector<int> edges;
  for (int a = 2; a < argc; ++a) edges.push_back(std::atoi(argv[a]));
  if (edges.empty()) edges = {500, 1000, 3200};

  bench::Report report(argc, argv, argv[1]);
  if (me == 0) report.add_rows_of_file();
  report.set_machine(bench::processor_name());
  report.set_command("bench_field, and mpirun -np 2 bench_field");
  const auto record = [&](int nodes, const std::string &covariance, const char *way, double time) {
    if (me) return;
    std::printf("%d ranks, %d x %d nodes, %-12s %-11s %7.3f s\n", num_ranks, nodes, nodes,
                covariance.c_str(), way, time);
    std::fflush(stdout);
    report.add({{"scene", "random_field"},
                {"dim", 2},
                {"nodes", nodes * nodes},
                {"covariance", covariance},
                {"ranks", num_ranks},
                {"way", way}},
               "wall_s", time, "s");
  };
  for (const int nodes : edges) {
    const double length = std::min(0.1 * nodes, 60.0);
    const field::Anisotropy ellipse({length, length});
    field::Grid grid;
    grid.spacing = {1.0, 1.0};
    grid.nodes = {nodes, nodes};
    std::vector<double> values;
    const auto generate = [&](const field::Covariance &covariance) {
      field::CirculantEmbedding embedding(grid, covariance);
      values = embedding.sample(1);
    };
    const auto give = [&](const field::Covariance &covariance) {
      if (me == 0) generate(covariance);
      sleep_until_all_are_here();
      values.resize(field::total(grid.nodes));
      MPI_Bcast(values.data(), static_cast<int>(values.size()), MPI_DOUBLE, 0, MPI_COMM_WORLD);
    };
    const field::Covariance exponential{field::Exponential{}, ellipse};
    record(nodes, "exponential", "one_rank", seconds([&] { give(exponential); }));
    if (num_ranks > 1) {
      record(nodes, "exponential", "replicated", seconds([&] { generate(exponential); }));
      record(nodes, "exponential", "distributed",
             seconds([&] { values = distributed_field(nodes, length); }));
      continue;
    }
    for (const field::Covariance &other : {field::Covariance{field::Gaussian{}, ellipse},
                                           {field::Matern(1.5), ellipse},
                                           {field::Matern(0.8), ellipse}})
      record(nodes, other.name(), "one_rank", seconds([&] { give(other); }));
  }
  if (me == 0) report.write();
  MPI_Finalize();
  return 0;
}
