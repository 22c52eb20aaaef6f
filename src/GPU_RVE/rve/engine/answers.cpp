// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/answers.h"

namespace rve {

template <int D>
void to_result(const AnswerRecord<D> &answer, const DetailRecord<D> &record, ResultOf<D> &result)
{
  const ImageProgress<D> &after = record.progress;
  result = ResultOf<D>();
  result.status = answer.status;
  result.stress = load_tensor<D>(answer.stress);
  result.fabric = load_tensor<D>(record.fabric);
  result.cell = load_tensor<D>(after.cell);
  result.deformation = load_tensor<D>(after.deformation);
  result.servo_velocity_gradient = load_tensor<D>(after.servo_velocity_gradient);
  const int n = record.num_grains, contacts = record.num_contacts;
  result.num_grains = n;
  result.num_contacts = contacts;
  result.num_pairs = record.num_pairs;
  result.num_rattlers = record.num_rattlers;
  result.void_ratio = determinant(result.cell) / record.solid_volume - 1.0;
  result.coordination_number = 2.0 * contacts / n;
  // Thornton: contacts of grains with a single one do not count
  const int carrying = n - record.num_rattlers;
  result.mechanical_coordination_number =
      carrying > 0 ? (2.0 * contacts - record.num_single) / carrying : 0.0;
  result.sliding_fraction = contacts > 0 ? static_cast<double>(record.num_sliding) / contacts : 0.0;
  result.unbalanced_ratio = unbalanced_ratio(record);
  result.kinetic_energy = record.kinetic_energy;
  result.elastic_energy = record.elastic_energy;
  result.largest_overlap = record.largest_overlap;
  result.mean_overlap = mean_overlap(record);
  result.largest_contact_force = record.largest_contact_force;
  result.peak_force = answer.peak_force;
  result.counters = {after.steps, after.rebuilds, after.lattice_reductions, after.repeats};
  result.energy = {after.work, after.friction_loss, after.damping_loss, after.viscous_loss};
}

template <int D>
void to_result(const AnswerRecord<D> &answer, const DetailRecord<D> &record,
               ElasticResultOf<D> &result)
{
  to_result(answer, record, result.result);
  result.stiffness = stiffness_of(record);
}

template <int D> DetailRecord<D> details_of(const ImageHeader<D> &header)
{
  DetailRecord<D> record = DetailRecord<D>();
  record.num_grains = header.num_grains;
  record.solid_volume = header.solid_volume;
  record.progress = header;
  return record;
}

template void to_result(const AnswerRecord<2> &, const DetailRecord<2> &, ResultOf<2> &);
template void to_result(const AnswerRecord<2> &, const DetailRecord<2> &, ElasticResultOf<2> &);
template DetailRecord<2> details_of(const ImageHeader<2> &);

template void to_result(const AnswerRecord<3> &, const DetailRecord<3> &, ResultOf<3> &);
template void to_result(const AnswerRecord<3> &, const DetailRecord<3> &, ElasticResultOf<3> &);
template DetailRecord<3> details_of(const ImageHeader<3> &);

}    // namespace rve
