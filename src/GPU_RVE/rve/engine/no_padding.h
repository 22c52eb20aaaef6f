// SPDX-License-Identifier: GPL-2.0-only
// Check that a record has no padding. It is for records that are copied as bytes into files and
// messages: padding bytes are undefined, so files would differ from run to run.

#pragma once

namespace rve {

/// Returns true if these members fill an object completely. A static_assert next to the record
/// lists each member once, and fails if one is missing or if an alignment leaves padding.
template <class Record, class... Members>
constexpr bool has_no_padding(Members Record::*.../*members*/)
{
  return (sizeof(Members) + ...) == sizeof(Record);
}

}    // namespace rve
