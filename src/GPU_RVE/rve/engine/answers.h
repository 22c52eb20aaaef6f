// What calls answer, in the words of the engine's users.

#ifndef RVE_ENGINE_ANSWERS_H
#define RVE_ENGINE_ANSWERS_H

#include "rve/algorithm/image.h"
#include "rve/engine/engine.h"

namespace rve {

/// Whether a call did not succeed for a reason that the engine can mend.
template <int D> bool must_repeat(const AnswerRecord<D> &answer);

template <int D>
void to_result(const AnswerRecord<D> &answer, const DetailRecord<D> &record, ResultOf<D> &result);
template <int D>
void to_result(const AnswerRecord<D> &answer, const DetailRecord<D> &record,
               ElasticResultOf<D> &result);

/// Of an RVE whose call failed: as it was before.
template <int D> DetailRecord<D> details_of(const ImageHeader<D> &header);

}    // namespace rve

#endif
