// SPDX-License-Identifier: GPL-2.0-only
// What the contacts of a batch have in common. It is known when the packings are read, before there is an engine for them.

#pragma once

#include "rve/core/error.h"
#include "rve/physics/material.h"

#include <functional>
#include <string>
#include <vector>

namespace rve {

template <int D> struct RveStateOf;

/// The contact law, and whether pairs remember rolling forces and twisting moments: from these follow the memory of an RVE and the programs that advance it.
struct ContactModel {
  ContactLaw law = ContactLaw::Linear;
  bool rolling = false;
  int dimension = 2;    ///< of the RVEs: disks or spheres

  /// Whether an engine of this model takes RVEs that need that one.
  bool serves(const ContactModel &need) const
  {
    return dimension == need.dimension && law == need.law && (rolling || !need.rolling);
  }
  bool operator==(const ContactModel &other) const
  {
    return dimension == other.dimension && law == other.law && rolling == other.rolling;
  }
  bool operator!=(const ContactModel &other) const { return !(*this == other); }
};

/// "contact law hooke with rolling resistance"
std::string to_string(const ContactModel &contacts);

/// What an RVE needs. With rolling forces, it needs them remembered whatever its material.
ContactModel contacts_of(const Material &material);

template <int D> ContactModel contacts_of(const RveStateOf<D> &state)
{
  return {state.material.law, contacts_of(state.material).rolling || state.has_rolling_forces(), D};
}

/// What several RVEs need together. Throws InputError, with the names of two of them, if their laws differ.
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
        "; they must have the same");
    all.rolling = all.rolling || one.rolling;
  }
  return all;
}

/// The law of that word; throws InputError, with those there are, if there is none.
ContactLaw contact_law_of(const std::string &word);

/// The numbers that a material of its law has, of disks or of spheres, in the order of restart records: those that all records have, or the
/// later ones.
std::vector<MaterialMember> parameters_of(ContactLaw law, int dimension = 2, bool later = false);

}    // namespace rve
