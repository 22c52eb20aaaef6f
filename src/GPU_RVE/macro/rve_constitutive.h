// SPDX-License-Identifier: GPL-2.0-only
// The RVE engine as a material of the MPM solver: deformation increments in, Cauchy stresses out.

#pragma once

#include "macro/rve_points.h"
#include "macro/tangent_probes.h"
#include "mpm/constitutive.h"

#include <functional>
#include <memory>
#include <vector>

namespace macro {

/// What an increment is for RVEs.
struct RveClock {
  double dt;       ///< DEM time step [time]
  int substeps;    ///< DEM steps for the increment
};

/// The owner of the RVEs of the points, which is fix rve. Points are local indices. D is the
/// dimension of the RVEs.
template <int D> class RveOwner {
 public:
  using Clock = RveClock;

  virtual ~RveOwner() = default;
  virtual Clock clock(double dt) const = 0;
  /// Begins an advance of the RVEs of these atoms. Null: all increments have taken their stresses.
  /// Otherwise `atoms` and `increments` live until finish().
  virtual rve::Request *begin(const std::vector<int> &atoms, MacroIncrementsOf<D> &increments) = 0;
  /// RvePointsOf::plan(); `atoms` are also the indices of the points on the device.
  virtual rve::Request *plan(const std::vector<int> &atoms, bool is_as_before,
                             const rve::PointsOnDevice &there,
                             MacroIncrementsOf<D> &increments) = 0;
  /// Ends the advance that is under way, if there is one.
  virtual void finish() = 0;
  /// True if an advance of these atoms would be one of the same RVEs as the last plan.
  virtual bool is_as_before(const std::vector<int> &atoms) = 0;
  /// mpm::Constitutive::synchronise_ranks()
  virtual void synchronise_ranks() = 0;
  virtual const rve::Tensor<double, D> &stress(int atom) const = 0;
  /// With complete results; safe to be called from several threads after complete().
  virtual const typename RvePointsOf<D>::Point &point(int atom) const = 0;
  virtual void complete() = 0;
};

/// A continuum of D dimensions. RVEs of more, under a plane one, are in plane strain.
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

  void expect_questions() override { owner.complete(); }
  /// The bound that grains which move with the mean field give, times the share of scale_waves().
  double p_wave_modulus(int point_index) const override;

  /// Of the RVE of a point.
  using State = std::function<rve::RveStateOf<DimensionOfRves>(int point_index)>;
  /// Largest modulus of waves that elastic tangents of these points have, over that bound of the point [-]; 0 if none could be measured. After
  /// expect_questions().
  double measured_wave_share(const std::vector<int> &points,
                             TangentProbesOf<DimensionOfRves> &probes, const State &state) const;
  void scale_waves(double share) { wave_share = share; }

 private:
  class Increments;
  void set_increments(int count, const int *point_index, const rve::Tensor<double, D> *increment_of,
                      double dt, rve::Tensor<double, D> *stress_of);

  Owner &owner;
  // of the last update
  std::vector<int> atoms;
  std::shared_ptr<Increments> increments;
  bool is_as_before = false;    ///< the update that is expected has the same points
  double wave_share = 1.0;
};

}    // namespace macro
