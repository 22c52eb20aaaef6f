// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/contact_model.h"

#include "rve/core/error.h"
#include "rve/core/suggestion.h"
#include "rve/engine/state.h"

#include <algorithm>
#include <functional>
#include <iterator>

namespace rve {

std::string to_string(const ContactModel &contacts)
{
  return std::string("contact law ") + word_of(contacts.law) +
      (contacts.rolling ? " with rolling resistance" : "") +
      (contacts.dimension == 3 ? " of spheres" : "");
}

ContactModel contacts_of(const Material &material)
{
  return {material.law, resists_rolling(material)};
}

ContactLaw contact_law_of(const std::string &word)
{
  const Words words(std::begin(CONTACT_LAW_WORDS), std::end(CONTACT_LAW_WORDS));
  const auto found = std::find(words.begin(), words.end(), word);
  if (found == words.end())
    throw InputError("there is no contact law '" + word + "'" +
                     did_you_mean(word, words, "the contact laws are"));
  return static_cast<ContactLaw>(found - words.begin());
}

std::vector<MaterialMember> parameters_of(ContactLaw law, int dimension, bool later)
{
  std::vector<MaterialMember> members;
  for (const MaterialParameter &parameter : MATERIAL_PARAMETERS)
    if (parameter.is_of(law, dimension) && parameter.later == later)
      members.push_back(parameter.member);
  // Restart records contain the parameters in the order of the members of MaterialNumbers.
  static constexpr MaterialNumbers SOME{};
  std::sort(members.begin(), members.end(), [](MaterialMember a, MaterialMember b) {
    return std::less<const double *>()(&(SOME.*a), &(SOME.*b));
  });
  return members;
}

}    // namespace rve
