// SPDX-License-Identifier: GPL-2.0-only
// Conversion of the records that the RVE kernel writes to the results of the engine.

#pragma once

#include "rve/algorithm/device_state.h"
#include "rve/core/status.h"
#include "rve/engine/engine.h"

namespace rve {

/// Returns true if a call has failed because of a full list or a force scale that is too fine. A
/// repetition with longer lists or a coarser force scale can succeed.
template <int D> RVE_HD bool must_repeat(const AnswerRecord<D> &answer)
{
  return (answer.status & (status::ListFull | status::ForceSaturated)) != 0;
}

/// Returns true if the answer is valid: the call has not failed and need not be repeated.
template <int D> RVE_HD bool is_sound(const AnswerRecord<D> &answer)
{
  return (answer.status & status::Fatal) == 0 && !must_repeat(answer);
}

/// Returns the ratio of the mean unbalanced force of a grain to the mean contact force [-].
template <int D> RVE_HD double unbalanced_ratio(const DetailRecord<D> &record)
{
  return record.contact_force_sum > 0.0 ? (record.grain_force_sum / record.num_grains) /
          (record.contact_force_sum / record.num_contacts)
                                        : 0.0;
}

/// Returns the mean over contacts of overlap / sum of radii [-].
template <int D> RVE_HD double mean_overlap(const DetailRecord<D> &record)
{
  return record.num_contacts > 0 ? record.overlap_sum / record.num_contacts : 0.0;
}

/// Returns the affine stiffness, which the call must have requested as an extra detail.
template <int D> RVE_HD AffineStiffnessOf<D> stiffness_of(const DetailRecord<D> &record)
{
  AffineStiffnessOf<D> stiffness;
  int m = 0;
  for (auto &row : stiffness.component)
    for (double &component : row) component = record.stiffness[m++];
  return stiffness;
}

/// Returns the diagnostic evaluation from details that contain the stiffness.
template <int D> RVE_HD EvaluationOf<D> to_evaluation(const DetailRecord<D> &record)
{
  return {unbalanced_ratio(record) <= QUIET_UNBALANCED_RATIO, mean_overlap(record),
          stiffness_of(record)};
}

/// Returns the details of an RVE whose call failed, from its header. The call has not changed the
/// RVE.
template <int D> DetailRecord<D> details_of(const StateHeader<D> &header)
{
  DetailRecord<D> record = DetailRecord<D>();
  record.num_grains = header.num_grains;
  record.solid_volume = header.solid_volume;
  record.progress = header;
  return record;
}

template <int D>
void to_result(const AnswerRecord<D> &answer, const DetailRecord<D> &record, ResultOf<D> &result)
{
  const StateProgress<D> &after = record.progress;
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
  // Contacts of grains with a single contact do not count (Thornton).
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

}    // namespace rve
