// SPDX-License-Identifier: GPL-2.0-only
// Parser of options and recipes of the C interface. They are texts of words and values as in a
// script, for example "format double threads 2".

#pragma once

#include "macro/tangent_probes.h"
#include "rve/engine/grading.h"
#include "rve/engine/options.h"
#include "rve/engine/packing.h"

#include <optional>
#include <string>

namespace capi {

/// Parses the options of a batch. Throws InputError, which names the wrong word.
rve::Options read_options(const std::string &text);

/// Parsed options of rve_tangents().
struct TangentOrder {
  rve::Format format;    ///< number format of the copies that are probed
  macro::TangentOptions options;
};
/// Parses the options of tangents by probing. Defaults suit the number format, which is `format`
/// unless the text gives one. Throws InputError, which names the wrong word.
TangentOrder read_tangent_options(const std::string &text, rve::Format format);

/// Parsed recipe of rve_packing_create().
struct Order {
  int dimension = 2;
  rve::PackingRecipe recipe;
  std::optional<rve::SizeChoice> sizes;    ///< without a value radii are uniform
  rve::Options options;                    ///< options of the engine that prepares the packing
};
/// Parses a recipe. Throws InputError, which names the wrong or missing words.
Order read_recipe(const std::string &text);

/// Returns rve::SizeDistribution::grains_needed() for the keywords shape, radius and grading of a
/// recipe. Throws InputError, which names the wrong word.
int grains_needed(const std::string &sizes);

/// Translates a contact law in the syntax of LAMMPS to the keywords of a recipe. Throws InputError,
/// which names the wrong word.
std::string contact_words(const std::string &contact, int dimension);

/// Returns the member of a material with this keyword for grains of this law and dimension. Throws
/// InputError, which lists the existing keywords, if there is no such member.
rve::MaterialMember parameter_named(const std::string &keyword, rve::ContactLaw law, int dimension);

}    // namespace capi
