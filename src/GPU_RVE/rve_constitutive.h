/* -*- c++ -*- ----------------------------------------------------------
   LAMMPS - Large-scale Atomic/Molecular Massively Parallel Simulator
   https://www.lammps.org/, Sandia National Laboratories
   LAMMPS development team: developers@lammps.org

   Copyright (2003) Sandia Corporation.  Under the terms of Contract
   DE-AC04-94AL85000 with Sandia Corporation, the U.S. Government retains
   certain rights in this software.  This software is distributed under
   the GNU General Public License.

   See the README file in the top-level LAMMPS directory.
------------------------------------------------------------------------- */

// The RVE engine as a material of the MPM solver: deformation increments in, Cauchy stresses out.

#ifndef LMP_RVE_CONSTITUTIVE_H
#define LMP_RVE_CONSTITUTIVE_H

#include "mpm/constitutive.h"
#include "rve_points.h"

#include <vector>

namespace LAMMPS_NS {

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

class RveConstitutive : public mpm::Constitutive {
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

}    // namespace LAMMPS_NS

#endif
