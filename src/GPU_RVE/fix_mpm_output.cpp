// SPDX-License-Identifier: GPL-2.0-only
// Per-atom output of fix mpm.

#include "fix_mpm_impl.h"

#include "mpm/measures.h"
#include "rve/core/threads.h"

#include "atom.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;

template <int D>
template <class Matrix>
void FixMpm::ImplOf<D>::fill_measures(double *row, const Matrix &sigma, const Matrix &F)
{
  const int axes = (int) rve::trace(Matrix::identity());
  row[P] = -trace(sigma) / axes;
  row[Q] = mpm::deviatoric_stress(sigma);
  row[EPS_V] = trace(F) - axes;
  row[EPS_Q] = mpm::deviatoric_strain(F);
}

template <int D> void FixMpm::ImplOf<D>::fill_output()
{
  fetch_points();
  const mpm::PointView<D> view = points();
  const rve::LightWork work(atom->nlocal, settings.options.threads);
#pragma omp parallel for num_threads(work.team)
  for (int i = 0; i < atom->nlocal; i++) {
    double *row = fix->array_atom[i];
    const Tensor &sigma = stress[i];
    const Tensor &F = deformation_gradient[i];
    Vec moved;
    for (int a = 0; a < D; a++) row[UX + a] = moved[a] = atom->x[i][a] - reference[i][a];
    row[U] = D == 2 ? std::hypot(moved[0], moved[1]) : std::sqrt(dot(moved, moved));
    double *shear = row + SXX + D;
    for (int a = 0; a < D; a++) {
      row[SXX + a] = sigma(a, a);
      for (int b = a + 1; b < D; b++) *shear++ = 0.5 * (sigma(a, b) + sigma(b, a));
    }
    if (settings.options.axisymmetric)
      fill_measures(row, this->with_hoop_stress(i), this->with_hoop_stretch(i));
    else
      fill_measures(row, sigma, F);
    row[RHO] = mass[i] / volume[i];
    std::copy_n(F.component, D * D, row + FXX);
    const bool remembers = body[i] < 0 && remembering[i] != NO_LAW;
    for (std::size_t k = 0; k < state_columns.size(); k++) {
      const int place = remembers ? index_of_law[(int) remembering[i]][k] : -1;
      if (place >= 0)
        row[STATE + k] = memory_of(i)[place];
      else if (water_columns[k] >= 0)
        row[STATE + k] = water.value(water_columns[k], view, i);
      else
        row[STATE + k] = field_columns[k] ? (*field_columns[k])[i] : 0.0;
    }
  }
  output_is_old = false;
}

template void FixMpm::ImplOf<2>::fill_output();
template void FixMpm::ImplOf<3>::fill_output();
