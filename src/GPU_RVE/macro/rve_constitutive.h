// SPDX-License-Identifier: GPL-2.0-only
// Constitutive law of the MPM solver that uses RVEs: it maps deformation increments to Cauchy
// stresses.

#pragma once

#include "macro/rve_points.h"
#include "macro/tangent_probes.h"
#include "mpm/constitutive.h"

#include <functional>
#include <memory>
#include <vector>

namespace macro {

/// Time step and number of DEM steps of an increment.
struct RveClock {
  double dt;       ///< DEM time step [time]
  int substeps;    ///< DEM steps for the increment
};

/// Interface of fix rve, which owns the RVEs of the points. Points are given by the local indices
/// of their atoms. D is the dimension of the RVEs.
template <int D> class RveOwner {
 public:
  virtual ~RveOwner() = default;
  virtual RveClock clock(double dt) const = 0;
  /// Begins an advance of the RVEs of these atoms. Returns null if the advance is complete and
  /// `increments` has received the stresses. Otherwise `atoms` and `increments` must live until
  /// finish().
  virtual rve::Request *begin(const std::vector<int> &atoms, MacroIncrementsOf<D> &increments) = 0;
  /// Plans an advance on the device, as RvePointsOf::plan() does. `atoms` are also the indices of
  /// the points on the device.
  virtual rve::Request *plan(const std::vector<int> &atoms, bool is_as_before,
                             const rve::PointsOnDevice &there,
                             MacroIncrementsOf<D> &increments) = 0;
  /// Finishes the advance that is under way, if there is one.
  virtual void finish() = 0;
  /// True if these atoms have the same RVEs, in the same order, as in the last plan.
  virtual bool is_as_before(const std::vector<int> &atoms) = 0;
  /// See mpm::Constitutive::synchronise_ranks().
  virtual void synchronise_ranks() = 0;
  virtual const rve::Tensor<double, D> &stress(int atom) const = 0;
  /// Returns a point with complete results. Several threads may call the function after complete().
  virtual const typename RvePointsOf<D>::Point &point(int atom) const = 0;
  virtual void complete() = 0;
};

/// Constitutive law of a continuum of D dimensions. RVEs of spheres in a plane continuum are in
/// plane strain, or in axisymmetry if hoop components are set; their third axis is then the hoop
/// direction.
template <int D, int DimensionOfRves = D> class RveConstitutive : public mpm::Constitutive<D> {
  using Owner = RveOwner<DimensionOfRves>;

 public:
  explicit RveConstitutive(Owner &_owner) : owner(_owner) {}

  void update(int count, const int *point_index,
              const rve::Tensor<double, D> *deformation_increment, double dt,
              rve::Tensor<double, D> *stress, mpm::MemoryRows memory) override;
  rve::Request *begin(int count, const int *point_index,
                      const rve::Tensor<double, D> *deformation_increment, double dt,
                      rve::Tensor<double, D> *stress, mpm::MemoryRows memory) override;
  rve::Request *plan(int count, const int *point_index, const mpm::DeviceArrays<D> &arrays,
                     double dt, rve::Tensor<double, D> *stress) override;
  rve::StressesAre finish(rve::Request &request) override;
  void copy_stresses_to_host() override;
  void expect_update(int count, const int *point_index) override;
  void synchronise_ranks() override { owner.synchronise_ranks(); }
  bool takes_hoop() const override { return D == 2 && DimensionOfRves == 3; }
  void set_hoop(const mpm::HoopArrays &arrays) override { hoop = arrays; }

  void expect_questions() override { owner.complete(); }
  /// Estimate of the P-wave modulus [stress]: Voigt's upper bound times the factor that
  /// scale_waves() sets. The bound assumes that grains move with the mean field.
  double p_wave_modulus(int point_index) const override;

  /// Function that returns the state of the RVE of a point.
  using State = std::function<rve::RveStateOf<DimensionOfRves>(int point_index)>;
  /// Returns the largest ratio, over these points, of the wave modulus of the elastic tangent to
  /// Voigt's bound [-], or 0 if no tangent could be measured. Precondition: expect_questions() was
  /// called.
  double measured_wave_share(const std::vector<int> &points,
                             TangentProbesOf<DimensionOfRves> &probes, const State &state) const;
  void scale_waves(double share) { wave_share = share; }

 private:
  class Increments;
  void set_increments(int count, const int *point_index, const rve::Tensor<double, D> *increment_of,
                      double dt, rve::Tensor<double, D> *stress_of);

  Owner &owner;
  // arguments of the last update
  std::vector<int> atoms;
  std::shared_ptr<Increments> increments;
  mpm::HoopArrays hoop;         ///< of the next update
  bool is_as_before = false;    ///< the expected update has the same points as the last one
  double wave_share = 1.0;
};

}    // namespace macro
