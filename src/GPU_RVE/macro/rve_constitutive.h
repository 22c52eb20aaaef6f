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

/// Who owns the RVEs of the points: fix rve. Points are local indices. D is the dimension of the RVEs.
template <int D> class RveOwner {
 public:
  using Clock = RveClock;

  virtual ~RveOwner() = default;
  virtual Clock clock(double dt) const = 0;
  virtual void advance(const std::vector<int> &atoms,
                       const std::vector<rve::DriveOf<D>> &drives) = 0;
  /// The same by increments alone, in fewer passes over the points, and perhaps not to its end: `atoms` and `increments` live until settle().
  /// False: nothing has happened, and it is for the other one.
  virtual bool begin_advance(const std::vector<int> &atoms, MacroIncrementsOf<D> &increments) = 0;
  /// Ends an advance that is under way.
  virtual void settle() = 0;
  virtual bool is_under_way() const = 0;
  /// Whether an advance of these would be one of the same RVEs as the last one on a device.
  virtual bool is_as_before(const std::vector<int> &atoms) = 0;
  /// The same where increments and stresses are on a device: RvePointsOf::plan_there() and on. `atoms` are the places of their points there.
  virtual bool plan_there(const std::vector<int> &atoms, bool is_as_before,
                          const rve::PointsOnDevice &there, MacroIncrementsOf<D> &increments) = 0;
  virtual bool can_advance_there() = 0;
  virtual void begin_advance_there() = 0;
  virtual void begin_advance_ahead() {}
  virtual bool stresses_are_there() const = 0;
  virtual const std::int32_t *unfinished_there() const { return nullptr; }
  virtual bool were_unfinished() const { return false; }
  /// mpm::Constitutive::meet()
  virtual void meet() = 0;
  virtual const rve::Tensor<double, D> &stress(int atom) const = 0;
  /// Complete, and safe to ask for from several threads after complete().
  virtual const typename RvePointsOf<D>::Point &point(int atom) const = 0;
  virtual void complete() = 0;
  /// For what is done for each point.
  virtual int threads() const = 0;
};

/// A continuum of D dimensions. RVEs of more, under a plane one, are in plane strain.
template <int D, int DimensionOfRves = D> class RveConstitutive : public mpm::Constitutive<D> {
  using Owner = RveOwner<DimensionOfRves>;
  using Drive = rve::DriveOf<DimensionOfRves>;

 public:
  explicit RveConstitutive(Owner &_owner) : owner(_owner) {}

  void update(int count, const int *point_index,
              const rve::Tensor<double, D> *deformation_increment, double dt,
              rve::Tensor<double, D> *stress, mpm::MemoryRows memory) override;
  bool begin_update(int count, const int *point_index,
                    const rve::Tensor<double, D> *deformation_increment, double dt,
                    rve::Tensor<double, D> *stress, mpm::MemoryRows memory) override;
  void expect_update(int count, const int *point_index) override;
  bool plan_update_there(int count, const int *point_index, const mpm::DeviceArrays<D> &arrays,
                         double dt, rve::Tensor<double, D> *stress) override;
  bool can_update_there() override { return owner.can_advance_there(); }
  void begin_update_there() override { owner.begin_advance_there(); }
  void begin_update_ahead() override { owner.begin_advance_ahead(); }
  bool stresses_are_there() const override { return owner.stresses_are_there(); }
  const std::int32_t *unfinished_there() const override { return owner.unfinished_there(); }
  bool were_unfinished() const override { return owner.were_unfinished(); }
  void bring_stresses() override;
  void settle() override { owner.settle(); }
  void meet() override { owner.meet(); }

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
  void begin_increments(int count, const int *point_index,
                        const rve::Tensor<double, D> *increment_of, double dt,
                        rve::Tensor<double, D> *stress_of);

  Owner &owner;
  // of update(), kept between calls; the first two while an advance is under way
  std::vector<int> atoms;
  std::shared_ptr<Increments> increments;
  bool is_as_before = false;    ///< the update that is expected
  std::vector<Drive> drives;
  double wave_share = 1.0;
};

}    // namespace macro
