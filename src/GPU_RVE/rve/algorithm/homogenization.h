// From contacts to the numbers of a continuum: fabric, coordination, energies. On demand, on the configuration that the last
// forces belong to.

#ifndef RVE_ALGORITHM_HOMOGENIZATION_H
#define RVE_ALGORITHM_HOMOGENIZATION_H

#include "rve/algorithm/contact_forces.h"

namespace rve {
inline namespace RVE_ISA {

  /// A second look at all contacts, with the cell of step `step_number` and without advancing the history:
  /// visit(i, j, contact, force) from inside the phase that calls this for item i.
  template <bool General, class Format, class Visit>
  RVE_INLINE void visit_contacts(const CallState<Format> &call,
                                 const StepConstants<Format, General> &step, int i, Visit visit)
  {
    const SharedView<Format> &shared = call.shared;
    const int n = call.num_grains;
    const auto look = [&](int first, int second, typename Format::History history) {
      const GrainView<Format> one{shared.motion[first], shared.spin[first], shared.radius[first]};
      const GrainView<Format> other{shared.motion[second], shared.spin[second],
                                    shared.radius[second]};
      const auto contact = pair_geometry(step, one, other);
      if (contact.overlap > typename Format::Real(0))
        visit(first, second, contact, pair_force(step, contact, one, other, history));
    };
    for (int k = 0; k < kOwnedPairs; ++k) {
      const int j = call.pairs.partner[k * n + i];
      if (j != i) look(i, j, call.pairs.history[k * n + i]);
    }
    for (int m = i; m < call.num_extra; m += n)
      look(call.pairs.extra_first[m], call.pairs.extra_second[m], call.pairs.extra_history[m]);
  }

  /// Fills `detail` but for its header. Sums over contacts are integers, so they do not depend on who owns a pair.
  /// The law is evaluated again, with the cell of step `step_number`, without advancing the history. The pairs are in call.pairs;
  /// work.scratch[3 N + i] holds the size of the force on grain i [internal force].
  template <bool General, class Block, class Format>
  RVE_COLD void homogenize(Block block, const CallState<Format> &call, int step_number,
                           DetailRecord &detail)
  {
    using Item = typename Block::Item;
    enum Sums { Fxx, Fxy, Fyy, Contacts, Sliding, Pairs, Force, Overlap, Elastic, kNumSums };
    const double unit = power_of_two(40);    // of fabric and overlap terms, which are at most 1
    const SharedView<Format> shared = call.shared;
    const WorkspaceView<Format> &work = call.work;
    const int num_grains = call.num_grains;
    const CallUnits units = call.units;
    StepConstants<Format, General> step =
        step_constants<Format, General>(call, call.planned(step_number));
    step.dt = typename Format::Real(0);
    const double force_unit = units.force, energy_unit = units.force * units.length;

    block.for_each(num_grains, [&](Item i) {
      work.contact_count[i] = 0;
    });

    const auto sums =
        block.template sum_items<kNumSums>(num_grains, [&](Item i, std::int64_t *sum) {
          double most[2] = {0.0, 0.0};    // force, overlap / sum of radii
          for (int k = 0; k < kOwnedPairs; ++k)
            sum[Pairs] += call.pairs.partner[k * num_grains + i] != i ? 1 : 0;
          for (int m = i; m < call.num_extra; m += num_grains) ++sum[Pairs];
          visit_contacts<General>(
              call, step, i, [&](int first, int second, const auto &contact, const auto &law) {
                block.add(&work.contact_count[first], 1);
                block.add(&work.contact_count[second], 1);
                const auto force = law.force.template as<double>();
                const auto normal = contact.normal.template as<double>();
                const double overlap = static_cast<double>(contact.overlap);
                const auto term = [&](int m, double x) {
                  std::int64_t units_of_x;
                  round_to(x, units_of_x);
                  sum[m] += units_of_x;
                };
                term(Fxx, unit * normal[0] * normal[0]);
                term(Fxy, unit * normal[0] * normal[1]);
                term(Fyy, unit * normal[1] * normal[1]);
                sum[Contacts] += 1;
                sum[Sliding] += law.sliding ? 1 : 0;
                const double size = std::sqrt(dot(force, force));
                const double ri = static_cast<double>(shared.radius[first]),
                             rj = static_cast<double>(shared.radius[second]);
                term(Force, units.contact_force * size);
                term(Overlap, unit * (overlap / (ri + rj)));
                most[0] = size > most[0] ? size : most[0];
                most[1] = overlap / (ri + rj) > most[1] ? overlap / (ri + rj) : most[1];
                double elastic =
                    static_cast<double>(step.law.normal.elastic_energy(contact.overlap)) +
                    step.law.tangential.elastic_energy(law.spring);
                if constexpr (Format::has_rolling)
                  elastic += step.law.rolling.spring.elastic_energy(law.rolling);
                term(Elastic, units.contact_force * elastic);
              });
          for (int k = 0; k < 2; ++k) work.scratch[k * num_grains + i] = most[k];
        });
    const double largest_contact_force = block.max_array(num_grains, work.scratch);
    const double largest_overlap = block.max_array(num_grains, work.scratch + num_grains);

    const auto grains = block.template sum_items<3>(num_grains, [&](Item i, std::int64_t *sum) {
      std::int64_t size;
      round_to(units.contact_force * work.scratch[3 * num_grains + i], size);
      sum[0] += size;
      sum[1] += work.contact_count[i] < 2 ? 1 : 0;
      sum[2] += work.contact_count[i] == 1 ? 1 : 0;
    });
    block.for_each(num_grains, [&](Item i) {
      const double r = static_cast<double>(shared.radius[i]) * units.length,
                   w = static_cast<double>(shared.spin[i]);
      const auto c = units.length * shared.motion[i].velocity.template as<double>();
      const double mass = call.mass_of(r);
      // in the order of the RveState: the sum shall not depend on how the grains are stored
      work.scratch[call.image.number[i]] = 0.5 * mass * (dot(c, c) + 0.5 * r * r * (w * w));
    });
    const double kinetic_energy = block.sum_array(num_grains, work.scratch);

    block.once([&] {
      const double contacts = sums[Contacts] > 0 ? static_cast<double>(sums[Contacts]) : 1.0;
      detail.fabric[0] = static_cast<double>(sums[Fxx]) / unit / contacts;
      detail.fabric[1] = detail.fabric[2] = static_cast<double>(sums[Fxy]) / unit / contacts;
      detail.fabric[3] = static_cast<double>(sums[Fyy]) / unit / contacts;
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
  }

}    // namespace RVE_ISA
}    // namespace rve

#endif
