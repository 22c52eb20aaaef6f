// What an engine is told to do, as the block program reads it.

#ifndef RVE_ENGINE_DRIVE_RECORD_H
#define RVE_ENGINE_DRIVE_RECORD_H

#include "rve/algorithm/image.h"
#include "rve/engine/engine.h"

namespace rve {

/// Throws InputError, with value, unit and range, unless the drive makes sense.
void check(const Drive &drive);

/// Whether a drive needs a SteeringRecord<2>: for a servo, or to turn the RVE in several segments.
bool needs_steering(const Drive &drive);

/// Of a path in one segment.
DriveRecord<2> to_record(const Drive &drive);

/// The rest of a drive. Sets the number of segments in its record.
SteeringRecord<2> to_steering(const Drive &drive, DriveRecord<2> &record);

}    // namespace rve

#endif
