// The RVE engine as a material of the MPM solver: deformation increments in, Cauchy stresses out.

#ifndef MACRO_RVE_CONSTITUTIVE_H
#define MACRO_RVE_CONSTITUTIVE_H

#include "macro/rve_points.h"
#include "macro/tangent_probes.h"
#include "mpm/constitutive.h"

#include <functional>
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
  /// The same by increments alone, in fewer passes over the points. False: nothing has happened, and it is for the other one.
  virtual bool advance(const std::vector<int> &atoms, MacroIncrementsOf<D> &increments) = 0;
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

  Owner &owner;
  // of update(), kept between calls
  std::vector<int> atoms;
  std::vector<Drive> drives;
  double wave_share = 1.0;
};

}    // namespace macro

#endif
