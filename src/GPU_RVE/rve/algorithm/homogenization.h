// From contacts to the numbers of a continuum: Love stress, fabric, coordination, energies. Once per call, on the
// configuration that the last forces belong to.

#ifndef RVE_ALGORITHM_HOMOGENIZATION_H
#define RVE_ALGORITHM_HOMOGENIZATION_H

#include "rve/algorithm/contact_forces.h"

namespace rve {
inline namespace RVE_ISA {

  /// Fills `result` but for its status. Sums over contacts are integers, so they do not depend on who owns a pair.
  /// `step.dt` must be zero: the law is evaluated again without advancing the history.
  template <class Block, class States, class Format, bool Viscous>
  RVE_HD void homogenize(Block &block, States &state, const SharedView<Format> &shared,
                         const WorkspaceView<Format> &work, int num_grains, int num_extra,
                         const StepConstants<Format, Viscous> &step,
                         const ForceScale<Format> &scale, double volume, double density,
                         double mass_depth, ResultRecord &result)
  {
    using Item = typename Block::Item;
    using History = typename Format::History;
    enum Sums {
      Sxx,
      Sxy,
      Syx,
      Syy,
      Fxx,
      Fxy,
      Fyy,
      Contacts,
      Sliding,
      Pairs,
      Force,
      Overlap,
      Elastic,
      kNumSums
    };
    const double unit = power_of_two(40);    // of fabric and overlap terms, which are at most 1

    block.for_each(num_grains, [&](Item i) {
      work.contact_count[i] = 0;
    });

    const auto add_contact = [&](int i, int j, History history, std::int64_t *sum, double *most) {
      if (i == j) return;
      ++sum[Pairs];
      PairForce<Format> pair;
      if (!evaluate_pair(shared, step, i, j, history, pair)) return;
      block.add(&work.contact_count[i], 1);
      block.add(&work.contact_count[j], 1);
      const auto force = pair.force.force.template as<double>();
      const auto branch = pair.contact.branch.template as<double>();
      const auto normal = pair.contact.normal.template as<double>();
      const auto stress = love_term(force, branch);
      const double overlap = static_cast<double>(pair.contact.overlap);
      const auto term = [&](int m, double x) {
        std::int64_t units;
        round_to(x, units);
        sum[m] += units;
      };
      for (int k = 0; k < 4; ++k) term(Sxx + k, scale.stress * stress.component[k]);
      term(Fxx, unit * normal[0] * normal[0]);
      term(Fxy, unit * normal[0] * normal[1]);
      term(Fyy, unit * normal[1] * normal[1]);
      sum[Contacts] += 1;
      sum[Sliding] += pair.force.sliding ? 1 : 0;
      const double size = std::sqrt(dot(force, force));
      const double ri = static_cast<double>(shared.radius[i]),
                   rj = static_cast<double>(shared.radius[j]);
      term(Force, scale.contact_force * size);
      term(Overlap, unit * (overlap / (ri + rj)));
      most[0] = size > most[0] ? size : most[0];
      most[1] = overlap / (ri + rj) > most[1] ? overlap / (ri + rj) : most[1];
      const double small = overlap / (ri < rj ? ri : rj);
      most[2] = small > most[2] ? small : most[2];
      term(Elastic,
           scale.energy *
               (static_cast<double>(step.law.normal.elastic_energy(pair.contact.overlap)) +
                step.law.tangential.elastic_energy(pair.force.spring)));
    };
    const auto sums =
        block.template sum_integers<kNumSums>(num_grains, [&](Item i, std::int64_t *sum) {
          double most[3] = {0.0, 0.0,
                            0.0};    // force, overlap / sum of radii, overlap / smaller radius
          for (int k = 0; k < kOwnedPairs; ++k)
            add_contact(i, state[i].partner[k], state[i].history[k], sum, most);
          for (int m = i; m < num_extra; m += num_grains)
            add_contact(work.extra_first[m], work.extra_second[m], work.extra_history[m], sum,
                        most);
          for (int k = 0; k < 3; ++k) work.scratch[k * num_grains + i] = most[k];
        });

    result.largest_contact_force = block.max_array(num_grains, work.scratch);
    result.largest_overlap = block.max_array(num_grains, work.scratch + num_grains);
    result.smallest_radius_overlap = block.max_array(num_grains, work.scratch + 2 * num_grains);

    const auto grains = block.template sum_integers<3>(num_grains, [&](Item i, std::int64_t *sum) {
      const double fx = static_cast<double>(state[i].force[0] + shared.force[i][0]) *
          static_cast<double>(scale.inverse_force);
      const double fy = static_cast<double>(state[i].force[1] + shared.force[i][1]) *
          static_cast<double>(scale.inverse_force);
      std::int64_t units;
      round_to(scale.contact_force * std::sqrt(fx * fx + fy * fy), units);
      sum[0] += units;
      sum[1] += work.contact_count[i] < 2 ? 1 : 0;
      sum[2] += work.contact_count[i] == 1 ? 1 : 0;
    });
    block.for_each(num_grains, [&](Item i) {
      const double r = static_cast<double>(shared.radius[i]),
                   w = static_cast<double>(shared.spin[i]);
      const auto c = shared.velocity[i].template as<double>();
      const double mass = density * 3.14159265358979323846 * r * r * mass_depth;
      work.scratch[i] = 0.5 * mass * (dot(c, c) + 0.5 * r * r * (w * w));
    });
    result.kinetic_energy = block.sum_array(num_grains, work.scratch);

    const double contacts = sums[Contacts] > 0 ? static_cast<double>(sums[Contacts]) : 1.0;
    for (int k = 0; k < 4; ++k)
      result.stress[k] = static_cast<double>(sums[Sxx + k]) / scale.stress / volume;
    result.fabric[0] = static_cast<double>(sums[Fxx]) / unit / contacts;
    result.fabric[1] = result.fabric[2] = static_cast<double>(sums[Fxy]) / unit / contacts;
    result.fabric[3] = static_cast<double>(sums[Fyy]) / unit / contacts;
    result.num_contacts = static_cast<std::int32_t>(sums[Contacts]);
    result.num_sliding = static_cast<std::int32_t>(sums[Sliding]);
    result.num_pairs = static_cast<std::int32_t>(sums[Pairs]);
    result.contact_force_sum = static_cast<double>(sums[Force]) / scale.contact_force;
    result.overlap_sum = static_cast<double>(sums[Overlap]) / unit;
    result.elastic_energy = static_cast<double>(sums[Elastic]) / scale.energy;
    result.grain_force_sum = static_cast<double>(grains[0]) / scale.contact_force;
    result.num_rattlers = static_cast<std::int32_t>(grains[1]);
    result.num_single = static_cast<std::int32_t>(grains[2]);
  }

}    // namespace RVE_ISA
}    // namespace rve

#endif
