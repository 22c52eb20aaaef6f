// SPDX-License-Identifier: GPL-2.0-only
// Words and values of the C interface: recipes and options are texts as in a script, "format double threads 2".

#pragma once

#include "macro/tangent_probes.h"
#include "rve/engine/options.h"
#include "rve/engine/packing.h"

#include <string>

namespace capi {

/// Throws InputError with the word that is wrong.
rve::Options read_options(const std::string &text);

struct TangentOrder {
  rve::Format format;    ///< of the copies that are probed
  macro::TangentOptions options;
};
/// Of tangents by probing, with defaults for the number format, which is `format` unless the words say otherwise.
TangentOrder read_tangent_options(const std::string &text, rve::Format format);

struct Order {
  int dimension = 2;
  rve::PackingRecipe recipe;
  rve::Options options;    ///< of the engine that prepares the packing
};
/// Throws InputError with the word that is wrong, or those that are missing.
Order read_recipe(const std::string &text);

/// The member of a material that a keyword names, for grains of this dimension; throws InputError with those that there are.
rve::MaterialMember parameter_named(const std::string &keyword, rve::ContactLaw law, int dimension);

}    // namespace capi
