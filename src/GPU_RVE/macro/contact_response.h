// How contacts of an RVE give way to pressure, and how its grains follow a rotation: what plans of macro steps ask of a material and a grain. Asked
// for thousands of points in every step, so that what does not change is computed once.

#ifndef MACRO_CONTACT_RESPONSE_H
#define MACRO_CONTACT_RESPONSE_H

#include "rve/engine/engine.h"

namespace macro {

/// Of the mean grain of an RVE.
template <int D> class ContactResponse {
 public:
  ContactResponse() = default;
  ContactResponse(const rve::Material &material, double grain_size);

  /// rve::contact_strain(). The material is that of the constructor.
  double contact_strain(double pressure, const rve::Material &material) const;

  /// Largest slip by a rotation by `angle` in `substeps` steps of dt, as an angle [rad]: the whole rotation, if the grains do not follow
  /// at all. Grains that all spin alike in a cell that does not turn go to and fro with w = sqrt(2 Z k_t/m), k_t at the overlap over diameter, and
  /// lag behind a rotation at a constant rate by that rate over w; the first step finds them at rest.
  double slip_of_rotation(double angle, int substeps, double dt, double contact_strain,
                          const rve::Material &material) const;

  /// That enters inertial numbers, of rve::inertial_density() [mass/length^3]
  double density() const { return density_; }
  /// rve::grain_size() [length]
  double grain_size() const { return grain_size_; }

 private:
  double grain_size_ = 0.0, density_ = 0.0;
  bool has_constant_moduli_ = false;
  // with constant moduli
  double depth_ = 0.0;        ///< that a pressure acts on, per diameter of a grain [length]
  double stiffness_ = 0.0;    ///< of the normal springs [force/length]
  double frequency_ = 0.0;    ///< w [1/time]

  double frequency_at(double contact_strain, const rve::Material &material) const;
};

}    // namespace macro

#endif
