// SPDX-License-Identifier: GPL-2.0-only
#include "field/fft.h"

#include "rve/core/error.h"

#include <fftw3.h>

namespace field {

struct RealFft::Plans {
  double *data = nullptr;
  fftw_plan forward = nullptr, backward = nullptr;

  Plans() = default;
  Plans(const Plans &) = delete;
  Plans &operator=(const Plans &) = delete;
  ~Plans()
  {
    if (forward) fftw_destroy_plan(forward);
    if (backward) fftw_destroy_plan(backward);
    if (data) fftw_free(data);
  }
};

RealFft::RealFft(const Size &points) :
    plans_(std::make_shared<Plans>()), num_rows_(total(points) / points[0]), row_length_(points[0])
{
  int sizes[AXES];    // FFTW's last axis runs fastest
  for (int a = 0; a < AXES; ++a) sizes[AXES - 1 - a] = static_cast<int>(points[a]);
  plans_->data = fftw_alloc_real(static_cast<std::size_t>(2 * half_length() * num_rows_));
  rve::require(plans_->data, "there is not enough memory for a Fourier transform of ",
               to_string(points), " points");
  auto *complex = reinterpret_cast<fftw_complex *>(plans_->data);
  plans_->forward = fftw_plan_dft_r2c(AXES, sizes, plans_->data, complex, FFTW_ESTIMATE);
  plans_->backward = fftw_plan_dft_c2r(AXES, sizes, complex, plans_->data, FFTW_ESTIMATE);
  rve::require(plans_->forward && plans_->backward, "FFTW cannot plan a transform of ",
               to_string(points), " points");
}

double *RealFft::row(std::int64_t row)
{
  return plans_->data + 2 * half_length() * row;
}

std::complex<double> *RealFft::spectrum(std::int64_t row)
{
  // fftw_complex and std::complex have the same layout (FFTW manual, section 4.1.1)
  return reinterpret_cast<std::complex<double> *>(this->row(row));
}

void RealFft::forward()
{
  fftw_execute(plans_->forward);
}

void RealFft::backward()
{
  fftw_execute(plans_->backward);
}

}    // namespace field
