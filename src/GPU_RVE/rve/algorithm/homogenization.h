// SPDX-License-Identifier: GPL-2.0-only
// From contacts to the numbers of a continuum: fabric, coordination, energies. On demand, on the configuration that the last
// forces belong to.

#pragma once

#include "rve/algorithm/contact_visit.h"
#include "rve/algorithm/stability_bound.h"

#include <utility>

namespace rve {
inline namespace RVE_ISA {

  /// Number e of an AffineStiffness: one on the diagonal, or both of a pair off it.
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

  /// Fills detail.stiffness, the AffineStiffness of engine/affine_stiffness.h, as sums of integers over the contacts.
  ///
  /// Their unit is 2^-40 K L^2: K the power of two above k_n and k_t where the largest grains overlap wholly, L the internal length, which
  /// branches and overlaps do not reach. A term is below 3 K L^2 + 2 |f_t| L. With forces cut at 8 K L, where a spring is stretched by
  /// more than four of the largest grains, that is less than 2^5 K L^2, and 2^17 terms stay within 62 bits. The unit does not depend on
  /// forces, and neither do the bits of the result depend on the force unit: they are the configuration's, whichever call asks for them.
  template <class Block, class Scene>
  RVE_COLD void sum_stiffness(Block block, const CallState<Scene> &call, int step_number,
                              DetailRecord<Scene::D> &detail)
  {
    using Item = typename Block::Item;
    const PlanOf<Scene> &plan = call.planned(step_number);
    const StepConstants<Scene> step = step_constants<Scene>(call.law, plan);
    const ImageHeader<Scene::D> &header = call.header;
    const double largest = header.largest_radius * call.units.per_length;
    const ContactModuli most = step.law.stiffness({2.0 * largest, largest, largest});
    const int bits = floor_log2(larger(most.normal, most.tangential)) + 1;    // of K, with L = 1
    const double per_unit = power_of_two(40 - bits), largest_force = power_of_two(bits + 3);
    const auto bounded = [&](double force) {
      const double cut = force < largest_force ? force : largest_force;
      return cut > -largest_force ? cut : -largest_force;
    };

    const double to_stress =
        call.units.force * call.units.length / per_unit / (plan.volume * header.material.thickness);
    if constexpr (Scene::D == 2) {
      const auto sums =
          block.template sum_items<kStiffness<2>>(call.num_grains, [&](Item i, std::int64_t *sum) {
            visit_contacts(
                call, step, i,
                [&](int, int, const auto &one, const auto &other, const auto &contact,
                    typename Scene::History history) {
                  const ContactPlace place = place_of(contact, one, other);
                  const ContactModuli moduli = step.law.stiffness(place);
                  const double nx = static_cast<double>(contact.normal[0]),
                               ny = static_cast<double>(contact.normal[1]);
                  const double l = per_unit * static_cast<double>(contact.distance);
                  const double k_l = moduli.normal * static_cast<double>(contact.distance);
                  const double f_n = bounded(step.law.spring_force(place));
                  const double f_t =
                      bounded(static_cast<double>(Scene::Law::tangential_force(history)));
                  const double turned =
                      moduli.tangential * static_cast<double>(contact.distance) - f_n;
                  // on the first grain, with t = (-n_y, n_x)
                  const double fx = -(f_n * nx) - f_t * ny, fy = f_t * nx - f_n * ny;
                  // l (df (x) n + f (x) (eps n - tr(eps) n)), with (eps n - tr(eps) n) = (sx, sy)
                  const auto add = [&](int e, double eps_nn, double eps_nt, double sx, double sy) {
                    const double along_n = k_l * eps_nn - f_t * eps_nt, along_t = turned * eps_nt;
                    const double dx = along_n * nx - along_t * ny, dy = along_n * ny + along_t * nx;
                    const double term[4] = {l * (dx * nx + fx * sx), l * (dx * ny + fx * sy),
                                            l * (dy * nx + fy * sx), l * (dy * ny + fy * sy)};
                    for (int c = 0; c < 4; ++c) {
                      std::int64_t units_of_term;
                      round_to(term[c], units_of_term);
                      sum[3 * c + e] = wrapping_sum(sum[3 * c + e], units_of_term);
                    }
                  };
                  add(0, nx * nx, -(nx * ny), 0.0, -ny);
                  add(1, ny * ny, nx * ny, -nx, 0.0);
                  add(2, 2.0 * (nx * ny), nx * nx - ny * ny, ny, nx);
                });
          });
      block.once([&] {
        for (int m = 0; m < kStiffness<2>; ++m)
          detail.stiffness[m] = to_stress * static_cast<double>(sums[m]);
      });
    } else {
      // a strain at a time: all sums together are too many for one collective
      constexpr int components = Scene::components, strains = Scene::strains;
      for (int e = 0; e < strains; ++e) {
        const Tensor<double, Scene::D> strain = unit_strain<Scene::D>(e);
        const auto sums =
            block.template sum_items<components>(call.num_grains, [&](Item i, std::int64_t *sum) {
              visit_contacts(call, step, i,
                             [&](int, int, const auto &one, const auto &other, const auto &contact,
                                 typename Scene::History history) {
                               const ContactPlace place = place_of(contact, one, other);
                               const ContactModuli moduli = step.law.stiffness(place);
                               const auto n = contact.normal.template as<double>();
                               const double l = static_cast<double>(contact.distance);
                               const double f_n = bounded(step.law.spring_force(place));
                               auto f_t = in_numbers<double>(Scene::Law::tangential_force(history));
                               for (int a = 0; a < Scene::D; ++a) f_t[a] = bounded(f_t[a]);
                               // dn = w and the branch's change are those of the strain alone: eps n = eps_nn n + w
                               const auto moved = strain * n;
                               const double along = dot(n, moved);
                               const auto w = moved - along * n;
                               const auto force = f_t - f_n * n;    // on the first grain
                               const auto change = (moduli.normal * l * along - dot(f_t, w)) * n +
                                   (moduli.tangential * l - f_n) * w;
                               const auto term =
                                   dyad(change, n) + dyad(force, moved - trace(strain) * n);
                               for (int c = 0; c < components; ++c) {
                                 std::int64_t units_of_term;
                                 round_to(per_unit * l * term.component[c], units_of_term);
                                 sum[c] = wrapping_sum(sum[c], units_of_term);
                               }
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
    // before the diagonal of row a there are a (a + 1)/2 components that are none
    ((C / D <= C % D ? f(C - C / D * (C / D + 1) / 2, C / D, C % D) : void()), ...);
  }

  /// f(m, a, b) for the components of a symmetric tensor: xx, xy, yy in the plane. No loop: what is indexed shall be in registers.
  template <int D, class F> RVE_INLINE void for_strains(F f)
  {
    for_strains_among<D>(f, std::make_index_sequence<Space<D>::components>());
  }

  /// Fills `detail` but for its progress. Sums over contacts are integers, so they do not depend on who owns a pair.
  /// The law is evaluated again, with the cell of step `step_number`, without advancing the history. The pairs are in call.pairs;
  /// work.scratch[3 N + i] holds the size of the force on grain i [internal force].
  template <class Block, class Scene>
  RVE_COLD void homogenize(Block block, const CallState<Scene> &call, int step_number,
                           DetailRecord<Scene::D> &detail)
  {
    if constexpr (Scene::books) {
      if (call.batch.extra_detail == kTimeStepDetail) {
        bound_time_step(block, call, step_number, detail);
        return;
      }
    }
    using Item = typename Block::Item;
    enum Sums {
      Fabric,
      Contacts = Fabric + Scene::strains,
      Sliding,
      Pairs,
      Force,
      Overlap,
      Elastic,
      kNumSums
    };
    const double unit = power_of_two(40);    // of fabric and overlap terms, which are at most 1
    const SharedView<Scene> shared = call.shared;
    const WorkspaceView<Scene> &work = call.work;
    const int num_grains = call.num_grains;
    const CallUnits units = call.units;
    StepConstants<Scene> step = step_constants<Scene>(call.law, call.planned(step_number));
    step.dt = typename Scene::Real(0);
    const double force_unit = units.force, energy_unit = units.force * units.length;

    block.for_each(num_grains, [&](Item i) { work.contact_count[i] = 0; });

    const auto sums =
        block.template sum_items<kNumSums>(num_grains, [&](Item i, std::int64_t *sum) {
          double most[2] = {0.0, 0.0};    // force, overlap / sum of radii
          for (int k = 0; k < Scene::owned_pairs; ++k)
            sum[Pairs] += call.pairs.partner[k * num_grains + i] != i ? 1 : 0;
          for (int m = i; m < call.num_extra; m += num_grains) ++sum[Pairs];
          visit_contacts(call, step, i,
                         [&](int first, int second, const auto &one, const auto &other,
                             const auto &contact, typename Scene::History history) {
                           const auto law = pair_force(step, contact, one, other, history);
                           block.add(&work.contact_count[first], 1);
                           block.add(&work.contact_count[second], 1);
                           const auto force = law.force.template as<double>();
                           const auto normal = contact.normal.template as<double>();
                           // of those that reach each other without touching none
                           const double overlap = larger(static_cast<double>(contact.overlap), 0.0);
                           const auto term = [&](int m, double x) {
                             std::int64_t units_of_x;
                             round_to(x, units_of_x);
                             sum[m] = wrapping_sum(sum[m], units_of_x);
                           };
                           for_strains<Scene::D>([&](int m, int a, int b) {
                             term(Fabric + m, unit * normal[a] * normal[b]);
                           });
                           sum[Contacts] += 1;
                           sum[Sliding] += law.sliding ? 1 : 0;
                           const double size = std::sqrt(dot(force, force));
                           const double ri = static_cast<double>(shared.radius[first]),
                                        rj = static_cast<double>(shared.radius[second]);
                           term(Force, units.contact_force * size);
                           term(Overlap, unit * (overlap / (ri + rj)));
                           most[0] = size > most[0] ? size : most[0];
                           most[1] = overlap / (ri + rj) > most[1] ? overlap / (ri + rj) : most[1];
                           term(Elastic,
                                units.contact_force * step.law.elastic_energy(contact, law));
                         });
          for (int k = 0; k < 2; ++k) work.scratch[k * num_grains + i] = most[k];
        });
    const double largest_contact_force = block.max_array(num_grains, work.scratch);
    const double largest_overlap = block.max_array(num_grains, work.scratch + num_grains);

    const auto grains = block.template sum_items<3>(num_grains, [&](Item i, std::int64_t *sum) {
      std::int64_t size;
      round_to(units.contact_force * work.scratch[3 * num_grains + i], size);
      sum[0] = wrapping_sum(sum[0], size);
      sum[1] += work.contact_count[i] < 2 ? 1 : 0;
      sum[2] += work.contact_count[i] == 1 ? 1 : 0;
    });
    block.for_each(num_grains, [&](Item i) {
      const double r = static_cast<double>(shared.radius[i]) * units.length;
      const auto spin = [&](int k) {
        return static_cast<double>(spin_component(shared.spin[i], k));
      };
      double ww = spin(0) * spin(0);
      for (int k = 1; k < Scene::spins; ++k) ww += spin(k) * spin(k);
      const auto c = units.length * shared.motion[i].velocity.template as<double>();
      const double mass = call.mass_of(r);
      // in the order of the RveState: the sum shall not depend on how the grains are stored
      work.scratch[call.number_of(i)] =
          0.5 * mass * (dot(c, c) + GrainShape<Scene::D>::inertia * r * r * ww);
    });
    const double kinetic_energy = block.sum_array(num_grains, work.scratch);

    block.once([&] {
      detail.num_grains = num_grains;
      detail.solid_volume = call.header.solid_volume;
      const double contacts = sums[Contacts] > 0 ? static_cast<double>(sums[Contacts]) : 1.0;
      for_strains<Scene::D>([&](int m, int a, int b) {
        detail.fabric[a * Scene::D + b] = detail.fabric[b * Scene::D + a] =
            static_cast<double>(sums[Fabric + m]) / unit / contacts;
      });
      detail.num_contacts = static_cast<std::int32_t>(sums[Contacts]);
      detail.num_sliding = static_cast<std::int32_t>(sums[Sliding]);
      detail.num_pairs = static_cast<std::int32_t>(sums[Pairs]);
      detail.num_rattlers = static_cast<std::int32_t>(grains[1]);
      detail.num_single = static_cast<std::int32_t>(grains[2]);
      detail.grain_force_sum = force_unit * (static_cast<double>(grains[0]) / units.contact_force);
      detail.contact_force_sum =
          force_unit * (static_cast<double>(sums[Force]) / units.contact_force);
      detail.largest_overlap = largest_overlap;
      detail.overlap_sum = static_cast<double>(sums[Overlap]) / unit;
      detail.kinetic_energy = kinetic_energy;
      detail.elastic_energy =
          energy_unit * (static_cast<double>(sums[Elastic]) / units.contact_force);
      detail.largest_contact_force = force_unit * largest_contact_force;
    });
    // from here, not from the steps: a call more there takes registers from them
    if (call.batch.extra_detail) sum_stiffness(block, call, step_number, detail);
  }

}    // namespace RVE_ISA
}    // namespace rve
