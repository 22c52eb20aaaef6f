// SPDX-License-Identifier: GPL-2.0-only
// Records that are copied as bytes, into files and messages, have no bytes between their members: nobody sets those, and files would differ from run to run.

#pragma once

namespace rve {

/// Whether these members are all that an object has. For a static_assert beside the record, with each member once; one that is forgotten, or an alignment
/// that leaves room, ends the compilation.
template <class Record, class... Members>
constexpr bool has_no_padding(Members Record::*.../*members*/)
{
  return (sizeof(Members) + ...) == sizeof(Record);
}

}    // namespace rve
