// SPDX-License-Identifier: GPL-2.0-only
// Contact model that all RVEs of a batch have in common. It is determined from the packings before
// the engine is created.

#pragma once

#include "rve/core/error.h"
#include "rve/physics/material.h"

#include <functional>
#include <string>
#include <vector>

namespace rve {

template <int D> struct RveStateOf;

/// Contact law and dimension of RVEs. `rolling` is true if pairs store rolling forces and twisting
/// moments. The memory layout of an RVE and its kernel variants follow from the contact model.
struct ContactModel {
  ContactLaw law = ContactLaw::Linear;
  bool rolling = false;
  int dimension = 2;    ///< dimension of the RVEs: disks or spheres

  /// Returns true if an engine with this contact model accepts RVEs that need the contact model
  /// `need`.
  bool serves(const ContactModel &need) const
  {
    return dimension == need.dimension && law == need.law && (rolling || !need.rolling);
  }
  bool operator==(const ContactModel &other) const
  {
    return dimension == other.dimension && law == other.law && rolling == other.rolling;
  }
};

/// Returns a text such as "contact law hooke with rolling resistance".
std::string to_string(const ContactModel &contacts);

/// Returns the contact model that an RVE needs. A state with rolling forces needs `rolling`, even
/// if its material has no rolling resistance.
ContactModel contacts_of(const Material &material);

template <int D> ContactModel contacts_of(const RveStateOf<D> &state)
{
  return {state.material.law, contacts_of(state.material).rolling || state.has_rolling_forces(), D};
}

/// Returns the smallest contact model that serves all of these RVEs. Throws InputError with the
/// names of two RVEs if their laws differ.
template <int D>
ContactModel contacts_of(const std::vector<RveStateOf<D>> &states,
                         const std::function<std::string(int)> &name = {})
{
  const auto name_of = [&](std::size_t k) {
    return name ? name(static_cast<int>(k)) : "RVE " + std::to_string(k);
  };
  ContactModel all;
  all.dimension = D;
  for (std::size_t k = 0; k < states.size(); ++k) {
    const ContactModel one = contacts_of(states[k]);
    if (k == 0) all.law = one.law;
    require(
        one.law == all.law, [&] { return name_of(0); }, " has contact law ", word_of(all.law),
        ", and ", [&] { return name_of(k); }, " has ", word_of(one.law),
        "; all must have the same contact law");
    all.rolling = all.rolling || one.rolling;
  }
  return all;
}

/// Returns the contact law with this name. Throws InputError with the known names if there is none.
ContactLaw contact_law_of(const std::string &word);

/// Returns the material parameters of a contact law for disks or spheres, in the order of restart
/// records. If `later` is true, they are the parameters that only newer records contain
/// (MaterialParameter::later). Otherwise they are the parameters that all records contain.
std::vector<MaterialMember> parameters_of(ContactLaw law, int dimension = 2, bool later = false);

}    // namespace rve
