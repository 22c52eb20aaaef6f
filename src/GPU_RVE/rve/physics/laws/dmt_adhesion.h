// SPDX-License-Identifier: GPL-2.0-only
// Adhesion after Derjaguin, Muller and Toporov (1975), J. Colloid Interface Sci. 53, 314: a
// constant attraction in addition to Hertz' contact.
//
// The law is that of LAMMPS' `pair granular dmt`: f_n = k_n a d - f_a - gamma v_n with the
// attraction f_a = 4 pi w R, the surface energy w and the reduced radius R. hertz_mindlin.h has the
// other symbols. Friction is limited by mu |k_n a d + f_a|, since spring and attraction both press
// the grains together.
//
// In LAMMPS the attraction ends where the grains separate. Here it can act up to a distance h
// between the surfaces. It then decreases linearly to zero over this distance: for -h < d < 0 the
// force is f_n = -f_a (1 + d/h). This models van der Waals forces with a cutoff, or a film
// ("reversible adhesion": Luding 2008, Granular Matter 10, 235; Singh et al. 2014, Phys. Rev. E 90,
// 022202). Friction and dashpots do not act at a distance. Two approaching grains jump into
// contact. Two grains that are pulled apart separate at d = -h. The attraction at a distance adds
// f_a h/2 to the work of their separation.

#pragma once

#include "rve/core/pi.h"
#include "rve/physics/laws/hertz_mindlin.h"

namespace rve {
inline namespace RVE_ISA {

  template <class Real> struct AdhesionConstants {
    Real attraction;    ///< f_a / R [force/length]
    Real reach;         ///< h [length]
    Real per_reach;     ///< 1/h [1/length]; zero if h is zero
  };

  template <class Numbers, int D = 2>
  struct alignas(16) DmtConstants :
      HertzConstants<Numbers, D>,
      AdhesionConstants<typename Numbers::Real> {
    template <class Parameters>
    RVE_INLINE void set(const Parameters &parameters, const LawUnits &units, double arm)
    {
      using Real = typename Numbers::Real;
      using Of = MaterialNumbers;
      HertzConstants<Numbers, D>::set(parameters, units, arm);
      this->attraction = Real(4.0 * kPi * units.internal<&Of::surface_energy>(parameters));
      const double h = units.internal<&Of::adhesion_reach>(parameters);
      this->reach = Real(h);
      this->per_reach = Real(h > 0.0 ? 1.0 / h : 0.0);
    }
  };

  template <class Real, class Spring, int D>
  struct DmtContactForce : MindlinContactForce<Real, Spring, D> {
    Real pull;    ///< f_a [force]
  };

  template <class NumberFormat, int Dimension = 2>
  struct DmtAdhesion : HertzMindlin<NumberFormat, Dimension> {
    using Hertz = HertzMindlin<NumberFormat, Dimension>;
    static constexpr int D = Dimension;
    using Real = typename NumberFormat::Real;
    using History = typename Hertz::History;
    using Force = DmtContactForce<Real, typename NumberFormat::Spring, D>;
    using Constants = DmtConstants<typename NumberFormat::Scalar, D>;
    static constexpr ContactLaw contact_law = ContactLaw::Dmt;
    // Friction also acts where the normal force is zero because spring and attraction cancel.
    static constexpr bool bounds_tangential_forces = false;
    static constexpr bool has_reach = true;

    template <class OtherNumbers> using In = DmtAdhesion<OtherNumbers, D>;

    AdhesionConstants<Real> adhesion;

    RVE_INLINE void take(const Constants &given)
    {
      Hertz::take(given);
      adhesion = given;
    }

    template <class Parameters> static RVE_INLINE double reach(const Parameters &parameters)
    {
      return parameters.adhesion_reach;
    }
    template <class Contact> RVE_INLINE bool acts(const Contact &contact) const
    {
      return contact.overlap > -adhesion.reach;
    }

    RVE_INLINE Force answer(const ContactGeometry<Real, D> &contact, const GrainMotion<Real, D> &i,
                            const GrainMotion<Real, D> &j, const GrainContact<Real, D> &moving,
                            const History &history, Real dt) const
    {
      const bool touching = contact.overlap > Real(0);
      Force result;
      const Real overlap = touching ? contact.overlap : Real(0);
      const Real spring = this->press(overlap, i.radius, j.radius, result);
      result.pull = adhesion.attraction * reduced(i.radius, j.radius);
      if (!touching) result.viscosity = Real(0);
      const Real pull = touching ? result.pull : share_apart(contact.overlap) * result.pull;
      const Real normal_force = (spring - pull) - result.viscosity * moving.normal_velocity;
      this->shear(contact, moving, normal_force, touching ? spring + pull : Real(0), history, dt,
                  result);
      result.sliding = result.sliding && touching;
      return result;
    }

    RVE_INLINE double elastic_energy(const ContactGeometry<Real, D> &contact,
                                     const Force &force) const
    {
      const double of_reach = 0.5 * double(force.pull) * double(adhesion.reach);
      if (!(contact.overlap > Real(0))) {
        const double share = double(share_apart(contact.overlap));
        return -of_reach * share * share;
      }
      const double a = double(force.contact_radius);
      // The work of the attraction is f_a d, and R d = a^2.
      return Hertz::elastic_energy(contact, force) - double(adhesion.attraction) * a * a - of_reach;
    }

    RVE_INLINE double spring_force(const ContactSite &site) const
    {
      return Hertz::spring_force(site) - pull_at(site);
    }
    RVE_INLINE double force_scale(const ContactSite &site) const
    {
      return Hertz::spring_force(site) + pull_at(site);
    }
    static RVE_INLINE Real limiting_force(const Force &force) { return force.limiting_force; }
    RVE_INLINE double limiting_force(const ContactSite &site) const
    {
      return site.overlap > 0.0 ? force_scale(site) : 0.0;
    }
    /// An attraction that decreases with the distance has a negative stiffness.
    RVE_INLINE ContactModuli stiffness(const ContactSite &site) const
    {
      if (site.overlap > 0.0 || !(adhesion.reach > Real(0))) return Hertz::stiffness(site);
      return {-full_pull(site) * double(adhesion.per_reach), 0.0, 0.0};
    }
    RVE_INLINE ContactModuli viscosity(const ContactSite &site) const
    {
      if (site.overlap > 0.0 || !(adhesion.reach > Real(0))) return Hertz::viscosity(site);
      return {0.0, 0.0, 0.0};
    }

   private:
    /// Returns the share 1 + d/h of the attraction at a distance -d.
    template <class Number> RVE_INLINE Number share_apart(Number overlap) const
    {
      return Number(1) + overlap * Number(adhesion.per_reach);
    }
    RVE_INLINE double full_pull(const ContactSite &site) const
    {
      return double(adhesion.attraction) * reduced(site.radius_i, site.radius_j);
    }
    RVE_INLINE double pull_at(const ContactSite &site) const
    {
      return site.overlap > 0.0 ? full_pull(site)
                                : larger(share_apart(site.overlap), 0.0) * full_pull(site);
    }
  };

  /// Laws that kernels are compiled for, in addition to DmtAdhesion of disks.
  template <class Numbers> using RollingDmt = WithRolling<DmtAdhesion<Numbers>>;
  template <class Numbers> using SphereDmtAdhesion = DmtAdhesion<Numbers, 3>;
  template <class Numbers> using SphereRollingDmt = WithRolling<SphereDmtAdhesion<Numbers>>;

}    // namespace RVE_ISA
}    // namespace rve
