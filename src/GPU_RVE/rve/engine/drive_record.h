// SPDX-License-Identifier: GPL-2.0-only
// What an engine is told to do, as the block program reads it.

#pragma once

#include "rve/algorithm/image.h"
#include "rve/engine/engine.h"

namespace rve {

/// Throws InputError, with value, unit and range, unless the drive makes sense.
template <int D> void check(const DriveOf<D> &drive);

/// Whether a drive needs a SteeringRecord<2>: for a servo, or to turn the RVE in several segments.
template <int D> bool needs_steering(const DriveOf<D> &drive);

/// Whether check() finds nothing, and nothing is to be steered: what most drives are, and quicker to see.
template <int D> bool is_simple(const DriveOf<D> &drive);
template <int D> bool is_simple(const IncrementOf<D> &increment);

/// Of a path in one segment. Quick where the record is made in its place (new), not elsewhere and copied.
template <int D> DriveRecord<D> to_record(const DriveOf<D> &drive);
template <int D> DriveRecord<D> to_record(const IncrementOf<D> &increment);

/// The rest of a drive. Sets the number of segments in its record.
template <int D> SteeringRecord<D> to_steering(const DriveOf<D> &drive, DriveRecord<D> &record);

/// What the modes of a drive are to the kernel.
template <int D> SteeredModes<D> to_modes(const DriveOf<D> &drive);

}    // namespace rve
