// SPDX-License-Identifier: GPL-2.0-only
// Check that a record has no padding, for records that are copied as bytes into files and messages.
// Padding bytes are undefined, so files with padding would differ from run to run.

#pragma once

namespace rve {

/// Returns true if these members fill an object completely. The static_assert next to a record
/// passes each member once. It fails if a member is missing from its list or if an alignment leaves
/// padding.
template <class Record, class... Members>
constexpr bool has_no_padding(Members Record::*.../*members*/)
{
  return (sizeof(Members) + ...) == sizeof(Record);
}

}    // namespace rve
