// The RVE engine as a material of the MPM solver: deformation increments in, Cauchy stresses out.

#ifndef MACRO_RVE_CONSTITUTIVE_H
#define MACRO_RVE_CONSTITUTIVE_H

#include "macro/rve_points.h"
#include "mpm/constitutive.h"

#include <vector>

namespace macro {

/// Who owns the RVEs of the points: fix rve. Points are local indices.
class RveOwner {
 public:
  struct Clock {
    double dt;       ///< DEM time step [time]
    int substeps;    ///< DEM steps for the increment
  };

  virtual ~RveOwner() = default;
  virtual Clock clock(double dt) const = 0;
  virtual void advance(const std::vector<int> &atoms, const std::vector<rve::Drive> &drives) = 0;
  virtual const rve::Tensor2 &stress(int atom) const = 0;
  /// Complete, and safe to ask for from several threads after complete().
  virtual const RvePoints::Point &point(int atom) const = 0;
  virtual void complete() = 0;
  /// For what is done for each point.
  virtual int threads() const = 0;
};

class RveConstitutive : public mpm::Constitutive<2> {
 public:
  explicit RveConstitutive(RveOwner &_owner) : owner(_owner) {}

  void update(int count, const int *point_index, const rve::Tensor2 *deformation_increment,
              double dt, rve::Tensor2 *stress, mpm::MemoryRows memory) override;

  void expect_questions() override { owner.complete(); }
  double p_wave_modulus(int point_index) const override;

 private:
  RveOwner &owner;
  // of update(), kept between calls
  std::vector<int> atoms;
  std::vector<rve::Drive> drives;
};

}    // namespace macro

#endif
