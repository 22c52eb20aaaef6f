// SPDX-License-Identifier: GPL-2.0-only
// Tangent stiffness of a material, and quantities that follow from it: isotropic moduli,
// second-order work, and the acoustic determinant, which detects shear bands.

#pragma once

#include "rve/core/tensor.h"

namespace macro {

/// Isotropic tangent nearest to a tangent C in the norm sqrt(C_ijkl C_ijkl), and its distance from
/// C.
struct IsotropicPart {
  double lambda, shear;    ///< Lame's lambda, and mu = G [stress]
  double anisotropy;       ///< |C - isotropic part| / |isotropic part| [-]

  /// Young's modulus [stress]. A plane tangent is a tangent in plane strain. The result is 0 if
  /// lambda + shear is 0, as for an RVE without contacts.
  double young() const
  {
    const double sum = lambda + shear;
    return sum != 0.0 ? shear * (3.0 * lambda + 2.0 * shear) / sum : 0.0;
  }
  /// Poisson's ratio [-]; 0 if lambda + shear is 0.
  double poisson() const
  {
    const double sum = lambda + shear;
    return sum != 0.0 ? 0.5 * lambda / sum : 0.0;
  }
};

/// Tangent stiffness C, which gives the stress increment d sigma_ij = C_ijkl eps_kl of a small
/// strain eps. C has the minor symmetries, but not always the major symmetry. sigma is Cauchy's
/// stress, tension positive, and C gives its Jaumann rate. For a velocity gradient L = D + W with
/// the symmetric part D and the spin W:
///     d sigma/dt = C : D + W sigma - sigma W
template <int D> struct TangentOf {
  using Matrix = rve::Tensor<double, D>;
  static constexpr int size = rve::Space<D>::strains;

  /// Rows are stresses, columns engineering strains (2 eps_ab off the diagonal), in the order xx yy
  /// xy, or xx yy zz xy xz yz [stress].
  double component[size][size] = {};

  /// Index of the component ab among rows and columns.
  static constexpr int index(int a, int b)
  {
    if (a == b) return a;
    return a + b + (D == 2 ? 1 : 2);
  }
  double operator()(int i, int j, int k, int l) const
  {
    return component[index(i, j)][index(k, l)];
  }

  /// C : strain for a symmetric strain [stress].
  Matrix operator()(const Matrix &strain) const;

  /// lambda delta_ij delta_kl + mu (delta_ik delta_jl + delta_il delta_jk)
  static TangentOf isotropic(double lambda, double mu);
  IsotropicPart isotropic_part() const;

  /// sqrt(C_ijkl C_ijkl) [stress]
  double norm() const;
  /// Least second-order work eps : C : eps / (eps : eps) over all strains eps [stress]. It is the
  /// least eigenvalue of the symmetric part in Mandel's components. If it is not positive, a small
  /// increment of load can cause unlimited strain (Hill 1958, J. Mech. Phys. Solids 6, 236).
  double least_second_order_work() const;
  /// Largest modulus rho c^2 of plane waves over directions n and polarizations, without the terms
  /// of the stress [stress]. It is the largest eigenvalue of the symmetric part of n_j C_ijkl n_l.
  /// The tested directions are 2 to 6 degrees apart, so the modulus can be half a per cent too low.
  double wave_modulus() const;

  /// Tangent with the components f(component[r][c], other.component[r][c]).
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

/// Least determinant of the acoustic tensor over all directions. If it is not positive, a shear
/// band with this normal can form (Rice 1976, "The localization of plastic deformation", Proc. 14th
/// IUTAM Congress, 207).
template <int D> struct LeastAcousticOf {
  double determinant;            ///< [stress^D]
  rve::Vec<double, D> normal;    ///< normal of the band; its first nonzero component is positive
};

/// Tangent A of the nominal stress rate in the present configuration: P = A : L for a velocity
/// gradient L, where P = d sigma/dt + sigma tr(L) - sigma L^T. P_ij is the rate of the force
/// component i per area on an area whose initial normal is along j. A includes the terms of the
/// rotation of the stress.
template <int D> struct NominalTangentOf {
  double component[D][D][D][D];    ///< i, j, k, l [stress]

  NominalTangentOf(const TangentOf<D> &tangent, const rve::Tensor<double, D> &stress);

  /// Determinant of the acoustic tensor n_j A_ijkl n_l for a unit vector n [stress^D].
  double acoustic_determinant(const rve::Vec<double, D> &n) const;
  LeastAcousticOf<D> least_acoustic_determinant() const;

 private:
  LeastAcousticOf<D> downhill_from(LeastAcousticOf<D> best, double step) const;
};

/// Isotropic part, least second-order work and least acoustic determinant of a tangent at a stress.
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
