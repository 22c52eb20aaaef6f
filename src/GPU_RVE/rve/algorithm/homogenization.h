// SPDX-License-Identifier: GPL-2.0-only
// Continuum quantities from contacts: fabric, coordination, energies, affine stiffness. They are
// computed on demand, for the configuration of the last forces.

#pragma once

#include "rve/algorithm/contact_visit.h"
#include "rve/algorithm/stability_bound.h"

#include <utility>

namespace rve {
inline namespace RVE_ISA {

  /// Returns unit strain e of an AffineStiffness: one diagonal component of 1, or two equal
  /// off-diagonal components of 1.
  template <int D> RVE_INLINE Tensor<double, D> unit_strain(int e)
  {
    auto strain = Tensor<double, D>::zero();
    if (e < D) {
      strain(e, e) = 1.0;
      return strain;
    }
    int shear = D;
    for (int a = 0; a < D; ++a)
      for (int b = a + 1; b < D; ++b, ++shear)
        if (shear == e) strain(a, b) = strain(b, a) = 1.0;
    return strain;
  }

  /// Unit of the sums of an affine stiffness.
  ///
  /// The unit is 2^-40 K L^2. K is the power of two above k_n and k_t of two of the largest grains
  /// whose overlap is their diameter. L is the internal length, which is above all branches and
  /// overlaps. A term is below 3 K L^2 + 2 |f_t| L. Forces are limited to 8 K L. For such a force a
  /// spring would be stretched by more than four diameters of the largest grain. A term is then
  /// below 2^5 K L^2, and 2^17 terms stay within 62 bits. The unit does not depend on forces. The
  /// bits of the result therefore depend only on the configuration, and not on the force unit of a
  /// call.
  struct StiffnessUnit {
    double per_unit, largest_force;

    template <class Config>
    RVE_INLINE StiffnessUnit(const CallState<Config> &call, const typename Config::Law &law)
    {
      const double largest = call.header.largest_radius * call.units.per_length;
      const ContactModuli most = law.stiffness({2.0 * largest, largest, largest});
      // exponent of K, with L = 1
      const int bits = floor_log2(larger(most.normal, most.tangential)) + 1;
      per_unit = power_of_two(40 - bits);
      largest_force = power_of_two(bits + 3);
    }
    RVE_INLINE double bounded(double force) const
    {
      const double cut = force < largest_force ? force : largest_force;
      return cut > -largest_force ? cut : -largest_force;
    }
  };

  /// Adds a number, rounded to an integer.
  RVE_INLINE void add_rounded(double x, std::int64_t &sum)
  {
    std::int64_t units;
    round_to(x, units);
    sum = wrapping_sum(sum, units);
  }

  /// Adds the terms of a contact of disks for all strains.
  template <class Config, class Contact>
  RVE_INLINE void add_stiffness_of_disks(const StepConstants<Config> &step,
                                         const StiffnessUnit &unit, const ContactSite &site,
                                         const Contact &contact, typename Config::History history,
                                         std::int64_t *sum)
  {
    const ContactModuli moduli = step.law.stiffness(site);
    const double nx = static_cast<double>(contact.normal[0]),
                 ny = static_cast<double>(contact.normal[1]);
    const double l = unit.per_unit * static_cast<double>(contact.distance);
    const double k_l = moduli.normal * static_cast<double>(contact.distance);
    const double f_n = unit.bounded(step.law.spring_force(site));
    const double f_t = unit.bounded(static_cast<double>(Config::Law::tangential_force(history)));
    const double turned = moduli.tangential * static_cast<double>(contact.distance) - f_n;
    // These are the components of the force on the first grain, with t = (-n_y, n_x).
    const double fx = -(f_n * nx) - f_t * ny, fy = f_t * nx - f_n * ny;
    // The term is l (df (x) n + f (x) (eps n - tr(eps) n)), with (eps n - tr(eps) n) = (sx, sy).
    const auto add = [&](int e, double eps_nn, double eps_nt, double sx, double sy) {
      const double along_n = k_l * eps_nn - f_t * eps_nt, along_t = turned * eps_nt;
      const double dx = along_n * nx - along_t * ny, dy = along_n * ny + along_t * nx;
      const double term[4] = {l * (dx * nx + fx * sx), l * (dx * ny + fx * sy),
                              l * (dy * nx + fy * sx), l * (dy * ny + fy * sy)};
      for (int c = 0; c < 4; ++c) add_rounded(term[c], sum[3 * c + e]);
    };
    add(0, nx * nx, -(nx * ny), 0.0, -ny);
    add(1, ny * ny, nx * ny, -nx, 0.0);
    add(2, 2.0 * (nx * ny), nx * nx - ny * ny, ny, nx);
  }

  /// Adds the terms of a contact of spheres for one strain.
  template <class Config, class Contact>
  RVE_INLINE void add_stiffness_of_spheres(const StepConstants<Config> &step,
                                           const StiffnessUnit &unit, const ContactSite &site,
                                           const Contact &contact, typename Config::History history,
                                           const Tensor<double, 3> &strain, std::int64_t *sum)
  {
    const ContactModuli moduli = step.law.stiffness(site);
    const auto n = contact.normal.template as<double>();
    const double l = static_cast<double>(contact.distance);
    const double f_n = unit.bounded(step.law.spring_force(site));
    auto f_t = in_numbers<double>(Config::Law::tangential_force(history));
    for (int a = 0; a < 3; ++a) f_t[a] = unit.bounded(f_t[a]);
    // The changes of the normal, dn = w, and of the branch follow from the strain alone: eps n =
    // eps_nn n + w.
    const auto moved = strain * n;
    const double along = dot(n, moved);
    const auto w = moved - along * n;
    const auto force = f_t - f_n * n;    // force on the first grain
    const auto change =
        (moduli.normal * l * along - dot(f_t, w)) * n + (moduli.tangential * l - f_n) * w;
    const auto term = dyad(change, n) + dyad(force, moved - trace(strain) * n);
    for (int c = 0; c < Config::components; ++c)
      add_rounded(unit.per_unit * l * term.component[c], sum[c]);
  }

  /// Fills detail.stiffness, the AffineStiffness of engine/affine_stiffness.h, by integer sums over
  /// the contacts.
  template <class Block, class Config>
  RVE_COLD void sum_stiffness(Block block, const CallState<Config> &call, int step_number,
                              DetailRecord<Config::D> &detail)
  {
    using Item = typename Block::Item;
    const PlanOf<Config> &plan = call.planned(step_number);
    const StepConstants<Config> step = step_constants<Config>(call.law, plan);
    const StiffnessUnit unit(call, step.law);
    const double to_stress = call.units.force * call.units.length / unit.per_unit /
        (plan.volume * call.header.material.thickness);
    if constexpr (Config::D == 2) {
      const auto sums = block.template sum_integers<kStiffness<2>>(
          call.num_grains, [&](Item i, std::int64_t *sum) {
            visit_contacts(call, step, i,
                           [&](int, int, const auto &one, const auto &other, const auto &contact,
                               typename Config::History history) {
                             add_stiffness_of_disks(step, unit, site_of(contact, one, other),
                                                    contact, history, sum);
                           });
          });
      block.once([&] {
        for (int m = 0; m < kStiffness<2>; ++m)
          detail.stiffness[m] = to_stress * static_cast<double>(sums[m]);
      });
    } else {
      // Each strain has its own collective, since all sums together are too many for one.
      constexpr int components = Config::components, strains = Config::strains;
      for (int e = 0; e < strains; ++e) {
        const Tensor<double, Config::D> strain = unit_strain<Config::D>(e);
        const auto sums = block.template sum_integers<components>(
            call.num_grains, [&](Item i, std::int64_t *sum) {
              visit_contacts(call, step, i,
                             [&](int, int, const auto &one, const auto &other, const auto &contact,
                                 typename Config::History history) {
                               add_stiffness_of_spheres(step, unit, site_of(contact, one, other),
                                                        contact, history, strain, sum);
                             });
            });
        block.once([&] {
          for (int c = 0; c < components; ++c)
            detail.stiffness[c * strains + e] = to_stress * static_cast<double>(sums[c]);
        });
      }
    }
  }

  template <int D, class F, std::size_t... C>
  RVE_INLINE void for_strains_among(F f, std::index_sequence<C...>)
  {
    // Up to the diagonal of row a, a (a + 1)/2 components are below the diagonal.
    ((C / D <= C % D ? f(C - C / D * (C / D + 1) / 2, C / D, C % D) : void()), ...);
  }

  /// Calls f(m, a, b) for the components of a symmetric tensor: xx, xy, yy in the plane. The
  /// function has no loop, so that numbers with the indices m, a and b can be in registers.
  template <int D, class F> RVE_INLINE void for_strains(F f)
  {
    for_strains_among<D>(f, std::make_index_sequence<Space<D>::components>());
  }

  /// Details of a configuration. Sums over contacts are integers, so that they do not depend on the
  /// owners of pairs.
  template <class Block, class Config> struct Homogenization {
    using Item = typename Block::Item;
    /// Indices of the sums over contacts.
    enum Sums {
      Fabric,
      Contacts = Fabric + Config::strains,
      Sliding,
      Pairs,
      ForceSize,
      Overlap,
      Elastic,
      kNumSums
    };
    /// Unit of fabric and overlap terms, which are at most 1
    static constexpr double kUnit = 0x1p40;

    /// Returns the sums over contacts. For each grain it stores the largest force and the largest
    /// ratio of overlap to sum of radii in work.scratch, both over the contacts that the grain
    /// visits. The number of contacts of each grain is stored in work.contact_count.
    static RVE_INLINE IntegerSums<kNumSums>
    sum_contacts(Block &block, const CallState<Config> &call, const StepConstants<Config> &step)
    {
      const WorkspaceView<Config> &work = call.work;
      const int n = call.num_grains;
      block.for_each(n, [&](Item i) { work.contact_count[i] = 0; });
      return block.template sum_integers<kNumSums>(n, [&](Item i, std::int64_t *sum) {
        double most[2] = {0.0, 0.0};
        for (int k = 0; k < Config::owned_pairs; ++k)
          sum[Pairs] += call.pairs.partner[k * n + i] != i ? 1 : 0;
        for (int m = i; m < call.num_extra; m += n) ++sum[Pairs];
        visit_contacts(call, step, i,
                       [&](int first, int second, const auto &one, const auto &other,
                           const auto &contact, typename Config::History history) {
                         block.add(&work.contact_count[first], 1);
                         block.add(&work.contact_count[second], 1);
                         add_contact(call, step, first, second, contact,
                                     pair_force(step, contact, one, other, history), sum, most);
                       });
        for (int k = 0; k < 2; ++k) work.scratch[k * n + i] = most[k];
      });
    }

    template <class Contact, class Force>
    static RVE_INLINE void add_contact(const CallState<Config> &call,
                                       const StepConstants<Config> &step, int first, int second,
                                       const Contact &contact, const Force &law, std::int64_t *sum,
                                       double (&most)[2])
    {
      const double contact_force = call.units.contact_force;
      const auto force = law.force.template as<double>();
      const auto normal = contact.normal.template as<double>();
      // Grains that act at a distance have no overlap.
      const double overlap = larger(static_cast<double>(contact.overlap), 0.0);
      for_strains<Config::D>([&](int m, int a, int b) {
        add_rounded(kUnit * normal[a] * normal[b], sum[Fabric + m]);
      });
      sum[Contacts] += 1;
      sum[Sliding] += law.sliding ? 1 : 0;
      const double size = std::sqrt(dot(force, force));
      const double ri = static_cast<double>(call.shared.radius[first]),
                   rj = static_cast<double>(call.shared.radius[second]);
      add_rounded(contact_force * size, sum[ForceSize]);
      add_rounded(kUnit * (overlap / (ri + rj)), sum[Overlap]);
      most[0] = size > most[0] ? size : most[0];
      most[1] = overlap / (ri + rj) > most[1] ? overlap / (ri + rj) : most[1];
      add_rounded(contact_force * step.law.elastic_energy(contact, law), sum[Elastic]);
    }

    /// Returns sums over grains: magnitude of the force, number of grains with fewer than two
    /// contacts, and number of grains with exactly one.
    static RVE_INLINE IntegerSums<3> sum_grains(Block &block, const CallState<Config> &call)
    {
      const WorkspaceView<Config> &work = call.work;
      const int n = call.num_grains;
      return block.template sum_integers<3>(n, [&](Item i, std::int64_t *sum) {
        add_rounded(call.units.contact_force * work.scratch[3 * n + i], sum[0]);
        sum[1] += work.contact_count[i] < 2 ? 1 : 0;
        sum[2] += work.contact_count[i] == 1 ? 1 : 0;
      });
    }

    /// Returns the kinetic energy, summed in the order of the RveState: the sum must not depend on
    /// the order in memory.
    static RVE_INLINE double kinetic_energy(Block &block, const CallState<Config> &call)
    {
      const SharedView<Config> shared = call.shared;
      const double length = call.units.length;
      block.for_each(call.num_grains, [&](Item i) {
        const double r = static_cast<double>(shared.radius[i]) * length;
        const auto spin = [&](int k) {
          return static_cast<double>(spin_component(shared.spin[i], k));
        };
        double ww = spin(0) * spin(0);
        for (int k = 1; k < Config::spins; ++k) ww += spin(k) * spin(k);
        const auto c = length * shared.motion[i].velocity.template as<double>();
        const double mass = call.mass_of(r);
        call.work.scratch[call.number_of(i)] =
            0.5 * mass * (dot(c, c) + GrainShape<Config::D>::inertia * r * r * ww);
      });
      return block.sum_array(call.num_grains, call.work.scratch);
    }

    static RVE_INLINE void write(Block &block, const CallState<Config> &call, int step_number,
                                 DetailRecord<Config::D> &detail)
    {
      StepConstants<Config> step = step_constants<Config>(call.law, call.planned(step_number));
      step.dt = typename Config::Real(0);
      const int n = call.num_grains;
      const CallUnits units = call.units;
      const double force_unit = units.force, energy_unit = units.force * units.length;
      const auto sums = sum_contacts(block, call, step);
      const double largest_contact_force = block.max_array(n, call.work.scratch);
      const double largest_overlap = block.max_array(n, call.work.scratch + n);
      const auto grains = sum_grains(block, call);
      const double energy = kinetic_energy(block, call);
      block.once([&] {
        detail.num_grains = n;
        detail.solid_volume = call.header.solid_volume;
        const double contacts = sums[Contacts] > 0 ? static_cast<double>(sums[Contacts]) : 1.0;
        for_strains<Config::D>([&](int m, int a, int b) {
          detail.fabric[a * Config::D + b] = detail.fabric[b * Config::D + a] =
              static_cast<double>(sums[Fabric + m]) / kUnit / contacts;
        });
        detail.num_contacts = static_cast<std::int32_t>(sums[Contacts]);
        detail.num_sliding = static_cast<std::int32_t>(sums[Sliding]);
        detail.num_pairs = static_cast<std::int32_t>(sums[Pairs]);
        detail.num_rattlers = static_cast<std::int32_t>(grains[1]);
        detail.num_single = static_cast<std::int32_t>(grains[2]);
        detail.grain_force_sum =
            force_unit * (static_cast<double>(grains[0]) / units.contact_force);
        detail.contact_force_sum =
            force_unit * (static_cast<double>(sums[ForceSize]) / units.contact_force);
        detail.largest_overlap = largest_overlap;
        detail.overlap_sum = static_cast<double>(sums[Overlap]) / kUnit;
        detail.kinetic_energy = energy;
        detail.elastic_energy =
            energy_unit * (static_cast<double>(sums[Elastic]) / units.contact_force);
        detail.largest_contact_force = force_unit * largest_contact_force;
      });
    }
  };

  /// Fills `detail` except for its progress. The law is evaluated again with the cell of step
  /// `step_number`, without advancing the history. The pairs are in call.pairs; work.scratch[3 N +
  /// i] has the magnitude of the force on grain i [internal force].
  template <class Block, class Config>
  RVE_COLD void homogenize(Block block, const CallState<Config> &call, int step_number,
                           DetailRecord<Config::D> &detail)
  {
    if constexpr (Config::has_bookkeeping) {
      if (call.batch.extra_detail == kTimeStepDetail) {
        bound_time_step(block, call, step_number, detail);
        return;
      }
    }
    Homogenization<Block, Config>::write(block, call, step_number, detail);
    // sum_stiffness() is called here, since a call inside the steps would take registers from them.
    if (call.batch.extra_detail) sum_stiffness(block, call, step_number, detail);
  }

}    // namespace RVE_ISA
}    // namespace rve
