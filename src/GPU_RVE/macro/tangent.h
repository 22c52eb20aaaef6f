// SPDX-License-Identifier: GPL-2.0-only
// What a tangent stiffness says of a material: moduli, second-order work, and whether a shear band may form. Numbers in, numbers out: no RVE.

#pragma once

#include "rve/core/tensor.h"

#include <array>

namespace macro {

/// The isotropic tangent that is nearest in sqrt(C_ijkl C_ijkl), and how far away it is.
struct IsotropicPart {
  double lambda, shear;    ///< Lame's lambda, and mu = G [stress]
  double anisotropy;       ///< |C - isotropic part| / |isotropic part| [-]

  /// E and nu of the solid, of plane tangents of that in plane strain [stress], [-]. 0 where lambda + shear is 0, as without contacts:
  /// there are none.
  double young() const
  {
    const double sum = lambda + shear;
    return sum != 0.0 ? shear * (3.0 * lambda + 2.0 * shear) / sum : 0.0;
  }
  double poisson() const
  {
    const double sum = lambda + shear;
    return sum != 0.0 ? 0.5 * lambda / sum : 0.0;
  }
};

/// C of d sigma_ij = C_ijkl eps_kl, symmetric in ij and in kl, not always in their exchange. sigma is Cauchy's stress, tension positive, its
/// rate Jaumann's: for a velocity gradient L = D + W
///     d sigma/dt = C : D + W sigma - sigma W.
template <int D> struct TangentOf {
  using Matrix = rve::Tensor<double, D>;
  static constexpr int size = rve::Space<D>::strains;

  /// Rows of the stress, columns of the engineering strain (2 eps_ab off the diagonal): xx yy xy, or xx yy zz xy xz yz [stress]
  double component[size][size] = {};

  /// Place of ab among rows and columns.
  static constexpr int place(int a, int b)
  {
    if (a == b) return a;
    return a + b + (D == 2 ? 1 : 2);
  }
  double operator()(int i, int j, int k, int l) const
  {
    return component[place(i, j)][place(k, l)];
  }

  /// C : strain, of a symmetric strain [stress].
  Matrix operator()(const Matrix &strain) const;

  /// lambda delta_ij delta_kl + mu (delta_ik delta_jl + delta_il delta_jk)
  static TangentOf isotropic(double lambda, double mu);
  IsotropicPart isotropic_part() const;

  /// sqrt(C_ijkl C_ijkl) [stress]
  double norm() const;
  /// Least value over all strains of eps : C : eps / (eps : eps), the second-order work along a strain per squared size of it: the least eigenvalue
  /// of the symmetric part, in Mandel's components [stress]. Where it is not positive, an increment of load may grow without an end (Hill
  /// 1958, J. Mech. Phys. Solids 6, 236).
  double least_second_order_work() const;
  /// Largest modulus rho c^2 of plane waves, over directions and polarizations, without the terms of the stress: largest eigenvalue of the
  /// symmetric part of n_j C_ijkl n_l over directions 2 to 6 degrees apart, so up to half a per cent low [stress].
  double wave_modulus() const;

  /// f(C_rc, D_rc) for all components of two tangents.
  template <class F> TangentOf combined(const TangentOf &other, const F &f) const
  {
    TangentOf result;
    for (int r = 0; r < size; ++r)
      for (int c = 0; c < size; ++c)
        result.component[r][c] = f(component[r][c], other.component[r][c]);
    return result;
  }
};

template <int D> TangentOf<D> operator+(const TangentOf<D> &x, const TangentOf<D> &y)
{
  return x.combined(y, [](double a, double b) { return a + b; });
}
template <int D> TangentOf<D> operator*(double factor, const TangentOf<D> &x)
{
  return x.combined(x, [factor](double a, double) { return factor * a; });
}

/// Least determinant of the acoustic tensor over all directions. Where it is not positive, a band of strain with that normal may form (Rice 1976, "The
/// localization of plastic deformation", Proc. 14th IUTAM Congress, 207).
template <int D> struct LeastAcousticOf {
  double determinant;            ///< [stress^D]
  rve::Vec<double, D> normal;    ///< of the band; its first component that is not zero is positive
};

/// A of the rate of nominal stress, P = A : L, in the present configuration: P = d sigma/dt + sigma tr(L) - sigma L^T, with the transpose as
/// P_ij = rate of the force along i on an area that had its normal along j. It has the terms by which the stress turns.
template <int D> struct NominalTangentOf {
  double component[D][D][D][D];    ///< i, j, k, l [stress]

  NominalTangentOf(const TangentOf<D> &tangent, const rve::Tensor<double, D> &stress);

  /// det(n_j A_ijkl n_l), of the acoustic tensor [stress^D]. n: a unit vector.
  double acoustic_determinant(const rve::Vec<double, D> &n) const;
  LeastAcousticOf<D> least_acoustic_determinant() const;

 private:
  LeastAcousticOf<D> downhill_from(LeastAcousticOf<D> best, double step) const;
};

/// All of it, for a tangent at a stress.
template <int D> struct TangentNumbersOf {
  IsotropicPart isotropic;
  double least_work;    ///< [stress]
  LeastAcousticOf<D> acoustic;

  TangentNumbersOf(const TangentOf<D> &tangent, const rve::Tensor<double, D> &stress) :
      isotropic(tangent.isotropic_part()), least_work(tangent.least_second_order_work()),
      acoustic(NominalTangentOf<D>(tangent, stress).least_acoustic_determinant())
  {
  }
};

}    // namespace macro
