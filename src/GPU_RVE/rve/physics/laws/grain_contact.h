// The contact of two grains in D dimensions, and the spring along it.

#ifndef RVE_PHYSICS_LAWS_GRAIN_CONTACT_H
#define RVE_PHYSICS_LAWS_GRAIN_CONTACT_H

#include "rve/physics/laws/disk_contact.h"
#include "rve/physics/laws/sphere_contact.h"

#include <type_traits>

namespace rve {
inline namespace RVE_ISA {

  template <class Real, int D>
  using GrainContact = std::conditional_t<D == 2, DiskContact<Real>, SphereContact<Real>>;

  template <class Real, class Spring, bool Viscous, int D>
  using TangentialSpring = std::conditional_t<D == 2, LinearTangential<Real, Spring, Viscous>,
                                              VectorSpring<Real, Spring, Viscous>>;

}    // namespace RVE_ISA
}    // namespace rve

#endif
