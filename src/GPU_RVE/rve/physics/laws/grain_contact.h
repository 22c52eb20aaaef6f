// SPDX-License-Identifier: GPL-2.0-only
// Contact of two grains in D dimensions, and its tangential spring.

#pragma once

#include "rve/physics/laws/disk_contact.h"
#include "rve/physics/laws/sphere_contact.h"

#include "rve/core/tensor.h"

#include <type_traits>

namespace rve {
inline namespace RVE_ISA {

  template <class Real, int D>
  using GrainContact = std::conditional_t<D == 2, DiskContact<Real>, SphereContact<Real>>;

  /// Returns the motion of two grains at their contact in a step of dt.
  template <class Law, class Real, int D>
  RVE_INLINE GrainContact<Real, D>
  motion_at_contact(const Law &law, const ContactGeometry<Real, D> &contact,
                    const GrainMotion<Real, D> &i, const GrainMotion<Real, D> &j,
                    const Tensor<Real, D> &velocity_gradient, typename Law::Real dt)
  {
    return GrainContact<Real, D>::template of<Law::is_damped>(contact, i, j, velocity_gradient,
                                                              Real(law.constants.velocity_arm), dt);
  }

  /// Returns the force of a contact in a step of dt.
  template <class Law, class Real, int D>
  RVE_INLINE typename Law::Force
  evaluate(const Law &law, const ContactGeometry<Real, D> &contact, const GrainMotion<Real, D> &i,
           const GrainMotion<Real, D> &j, const Tensor<Real, D> &velocity_gradient,
           const typename Law::History &history, typename Law::Real dt)
  {
    return law.answer(contact, i, j, motion_at_contact(law, contact, i, j, velocity_gradient, dt),
                      history, dt);
  }

  template <class Real, class Spring, bool Viscous, int D>
  using TangentialSpring = std::conditional_t<D == 2, LinearTangential<Real, Spring, Viscous>,
                                              VectorSpring<Real, Spring, Viscous>>;

  /// Returns a tangential quantity as the other grain of the contact sees it. In space the vector
  /// changes sign. In the plane the direction t changes sign as well, so that the number along it
  /// stays.
  template <class Number> RVE_INLINE Number along_from_partner(Number along)
  {
    return along;
  }
  template <class Number> RVE_INLINE Vec<Number, 3> along_from_partner(const Vec<Number, 3> &along)
  {
    return Number(-1) * along;
  }

  /// Returns a tangential force after the rotation of its contact.
  template <class Number> RVE_INLINE Number sum_of_turned(const Number &turned)
  {
    return turned;
  }
  template <class Real, class Number>
  RVE_INLINE Vec<Number, 3> sum_of_turned(const TurnedForce<Real, Number> &turned)
  {
    return turned.sum();
  }

  /// Returns a tangential vector after a rigid rotation of the RVE, in space.
  template <class Number>
  RVE_INLINE Vec<Number, 3> along_turned(const Vec<Number, 3> &along, const Tensor3 &rotation)
  {
    return in_numbers<Number>(rotation * in_numbers<double>(along));
  }

}    // namespace RVE_ISA
}    // namespace rve
