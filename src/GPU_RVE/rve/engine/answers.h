// SPDX-License-Identifier: GPL-2.0-only
// What calls answer, in the words of the engine's users.

#pragma once

#include "rve/algorithm/image.h"
#include "rve/core/status.h"
#include "rve/engine/engine.h"

namespace rve {

/// Whether a call did not succeed for a reason that the engine can mend.
template <int D> RVE_HD bool must_repeat(const AnswerRecord<D> &answer)
{
  return (answer.status & (status::ListFull | status::ForceSaturated)) != 0;
}

/// Whether it is the answer to its drive.
template <int D> RVE_HD bool is_sound(const AnswerRecord<D> &answer)
{
  return (answer.status & status::Fatal) == 0 && !must_repeat(answer);
}

template <int D>
void to_result(const AnswerRecord<D> &answer, const DetailRecord<D> &record, ResultOf<D> &result);
template <int D>
void to_result(const AnswerRecord<D> &answer, const DetailRecord<D> &record,
               ElasticResultOf<D> &result);

/// Mean unbalanced force over mean contact force [-].
template <int D> RVE_HD double unbalanced_ratio(const DetailRecord<D> &record)
{
  return record.contact_force_sum > 0.0 ? (record.grain_force_sum / record.num_grains) /
          (record.contact_force_sum / record.num_contacts)
                                        : 0.0;
}

/// Over contacts, overlap / sum of radii [-].
template <int D> RVE_HD double mean_overlap(const DetailRecord<D> &record)
{
  return record.num_contacts > 0 ? record.overlap_sum / record.num_contacts : 0.0;
}

/// Of details that were asked for it.
template <int D> RVE_HD AffineStiffnessOf<D> stiffness_of(const DetailRecord<D> &record)
{
  AffineStiffnessOf<D> stiffness;
  int m = 0;
  for (auto &row : stiffness.component)
    for (double &component : row) component = record.stiffness[m++];
  return stiffness;
}

/// What a look at the end of DEM steps finds, whose details have the stiffness.
template <int D> RVE_HD LookOf<D> to_look(const DetailRecord<D> &record)
{
  return {unbalanced_ratio(record) <= QUIET_UNBALANCED_RATIO, mean_overlap(record),
          stiffness_of(record)};
}

/// Of an RVE whose call failed: as it was before.
template <int D> DetailRecord<D> details_of(const ImageHeader<D> &header);

}    // namespace rve
