// What calls answer, in the words of the engine's users.

#ifndef RVE_ENGINE_ANSWERS_H
#define RVE_ENGINE_ANSWERS_H

#include "rve/algorithm/image.h"
#include "rve/engine/engine.h"

namespace rve {

/// Whether a call did not succeed for a reason that the engine can mend.
bool must_repeat(const AnswerRecord &answer);

void to_result(const AnswerRecord &answer, const DetailRecord &record, Result &result);
void to_result(const AnswerRecord &answer, const DetailRecord &record, ElasticResult &result);

/// Of an RVE whose call failed: as it was before.
DetailRecord details_of(const ImageHeader &header);

}    // namespace rve

#endif
