// Adhesion after Derjaguin, Muller and Toporov (1975), J. Colloid Interface Sci. 53, 314: a constant attraction beside Hertz' contact.
//
// As LAMMPS' `pair granular dmt`: f_n = k_n a d - f_a - gamma v_n with f_a = 4 pi w R, w the surface energy and R the reduced radius, and
// friction that is a share of |k_n a d + f_a|, what the spring and the attraction press together. The attraction acts while grains touch
// and reaches no farther: two grains are pulled apart by f_a, at an overlap of zero.

#ifndef RVE_PHYSICS_LAWS_DMT_ADHESION_H
#define RVE_PHYSICS_LAWS_DMT_ADHESION_H

#include "rve/core/pi.h"
#include "rve/physics/laws/hertz_mindlin.h"

namespace rve {
inline namespace RVE_ISA {

  template <class Numbers, int D = 2> struct alignas(16) DmtConstants : HertzConstants<Numbers, D> {
    typename Numbers::Real attraction;    ///< f_a / R [force/length]

    template <class Parameters>
    RVE_INLINE void set(const Parameters &parameters, const LawUnits &units, double arm)
    {
      HertzConstants<Numbers, D>::set(parameters, units, arm);
      attraction = static_cast<typename Numbers::Real>(4.0 * kPi * parameters.surface_energy *
                                                       (units.length * units.per_force));
    }
  };

  template <class NumberFormat, int Dimension = 2>
  struct DmtAdhesion : HertzMindlin<NumberFormat, Dimension> {
    using Hertz = HertzMindlin<NumberFormat, Dimension>;
    static constexpr int D = Dimension;
    using Real = typename NumberFormat::Real;
    using History = typename Hertz::History;
    using Force = typename Hertz::Force;
    using Constants = DmtConstants<NumberFormat, D>;
    static constexpr ContactLaw contact_law = ContactLaw::Dmt;
    // where spring and attraction cancel, friction is there all the same
    static constexpr bool bounds_tangential_forces = false;

    template <class OtherNumbers> using In = DmtAdhesion<OtherNumbers, D>;

    Real attraction;    ///< f_a / R [force/length]

    template <class SomeConstants> RVE_INLINE void take(const SomeConstants &given)
    {
      Hertz::take(given);
      attraction = given.attraction;
    }

    RVE_INLINE Force evaluate(const ContactGeometry<Real, D> &contact,
                              const GrainMotion<Real, D> &i, const GrainMotion<Real, D> &j,
                              const Tensor<Real, D> &velocity_gradient, const History &history,
                              Real dt) const
    {
      return answer(contact, i, j, this->motion(contact, i, j, velocity_gradient, dt), history, dt);
    }

    RVE_INLINE Force answer(const ContactGeometry<Real, D> &contact, const GrainMotion<Real, D> &i,
                            const GrainMotion<Real, D> &j, const GrainContact<Real, D> &moving,
                            const History &history, Real dt) const
    {
      Force result;
      const Real spring = this->press(contact.overlap, i.radius, j.radius, result);
      const Real pull = attraction * reduced(i.radius, j.radius);
      const Real normal_force = (spring - pull) - result.viscosity * moving.normal_velocity;
      this->shear(contact, moving, normal_force, spring + pull, history, dt, result);
      return result;
    }

    RVE_INLINE double elastic_energy(const ContactGeometry<Real, D> &contact,
                                     const Force &force) const
    {
      const double a = static_cast<double>(force.contact_radius);
      // f_a d, with R d = a^2
      return Hertz::elastic_energy(contact, force) - static_cast<double>(attraction) * a * a;
    }

    RVE_INLINE double spring_force(const ContactPlace &place) const
    {
      return Hertz::spring_force(place) - pull_at(place);
    }
    RVE_INLINE double force_scale(const ContactPlace &place) const
    {
      return Hertz::spring_force(place) + pull_at(place);
    }
    using Hertz::limiting_force;
    RVE_INLINE double limiting_force(const ContactPlace &place) const { return force_scale(place); }

   private:
    RVE_INLINE double pull_at(const ContactPlace &place) const
    {
      return static_cast<double>(attraction) * reduced(place.radius_i, place.radius_j);
    }
  };

  /// The laws that programs have beside DmtAdhesion of disks.
  template <class Numbers> using RollingDmt = WithRolling<DmtAdhesion<Numbers>>;
  template <class Numbers> using SphereDmtAdhesion = DmtAdhesion<Numbers, 3>;
  template <class Numbers> using SphereRollingDmt = WithRolling<SphereDmtAdhesion<Numbers>>;

}    // namespace RVE_ISA
}    // namespace rve

#endif
