// What calls answer, in the words of the engine's users.

#ifndef RVE_ENGINE_ANSWERS_H
#define RVE_ENGINE_ANSWERS_H

#include "rve/algorithm/image.h"
#include "rve/engine/engine.h"

namespace rve {

/// Whether a call did not succeed for a reason that the engine can mend.
bool must_repeat(const AnswerRecord<2> &answer);

void to_result(const AnswerRecord<2> &answer, const DetailRecord<2> &record, Result &result);
void to_result(const AnswerRecord<2> &answer, const DetailRecord<2> &record, ElasticResult &result);

/// Of an RVE whose call failed: as it was before.
DetailRecord<2> details_of(const ImageHeader<2> &header);

}    // namespace rve

#endif
