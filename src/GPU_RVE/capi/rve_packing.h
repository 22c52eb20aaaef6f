// SPDX-License-Identifier: GPL-2.0-only
// Packings of the C interface. A packing is the state of one RVE of disks or of spheres.

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

/// Reads a packing file. Throws InputError if it cannot be read or is invalid, or if the grains
/// drift (rve::drift_of()).
AnyState read_state(const std::string &file);

/// Reads all packings of a library, or the packing of a packing file. Throws InputError in the same
/// cases as read_state().
std::vector<AnyState> read_states(const std::string &file);

/// Prepares a packing. Throws InputError if that fails.
AnyState prepare(const Order &order);

/// Returns the array of rve_packing_array() with this name. Throws InputError if no array has this
/// name.
std::vector<double> array_named(const AnyState &packing, const std::string &name);

/// Returns the table of rve_packing_contact_table().
std::vector<double> contact_table(const AnyState &packing);

}    // namespace capi

struct rve_packing {
  capi::AnyState state;
};
