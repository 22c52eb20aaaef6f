// SPDX-License-Identifier: GPL-2.0-only
// Packings of the C interface: the state of one RVE, of disks or of spheres.

#pragma once

#include "capi/words.h"
#include "rve/engine/state.h"

#include <string>
#include <variant>
#include <vector>

namespace capi {

using AnyState = std::variant<rve::RveStateOf<2>, rve::RveStateOf<3>>;

inline int dimension_of(const AnyState &state)
{
  return state.index() == 0 ? 2 : 3;
}

/// Reads a packing file. Throws InputError if it is broken, or if the grains drift.
AnyState read_state(const std::string &file);

/// Reads all packings of a library, or the one of a packing file. Throws InputError as read_state().
std::vector<AnyState> read_states(const std::string &file);

/// Prepares a packing. Throws InputError if that fails.
AnyState prepare(const Order &order);

/// Numbers of the array that rve_packing_array() calls by this name. Throws InputError if there is none.
std::vector<double> array_named(const AnyState &state, const std::string &name);

/// Rows of rve_packing_contact_table().
std::vector<double> contact_table(const AnyState &state);

}    // namespace capi

struct rve_packing {
  capi::AnyState state;
};
