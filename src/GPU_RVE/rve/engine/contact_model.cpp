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

template <int D> ContactModel contacts_of(const RveStateOf<D> &state)
{
  return {state.material.law, resists_rolling(state.material) || state.has_rolling_forces(), D};
}

template <int D>
ContactModel contacts_of(const std::vector<RveStateOf<D>> &states,
                         const std::function<std::string(int)> &name)
{
  const auto name_of = [&](std::size_t k) {
    return name ? name(static_cast<int>(k)) : "RVE " + std::to_string(k);
  };
  ContactModel all;
  all.dimension = D;
  for (std::size_t k = 0; k < states.size(); ++k) {
    const ContactModel one = contacts_of(states[k]);
    if (k == 0) all.law = one.law;
    require(one.law == all.law, [&] {
      return name_of(0) + " has contact law " + word_of(all.law) + ", and " + name_of(k) + " has " +
          word_of(one.law) + "; they must have the same";
    });
    all.rolling = all.rolling || one.rolling;
  }
  return all;
}

ContactLaw contact_law_of(const std::string &word)
{
  const Words words(std::begin(CONTACT_LAW_WORDS), std::end(CONTACT_LAW_WORDS));
  const auto found = std::find(words.begin(), words.end(), word);
  if (found == words.end())
    throw InputError("there is no contact law '" + word + "'" +
                     did_you_mean(word, words, "there are"));
  return static_cast<ContactLaw>(found - words.begin());
}

std::vector<MaterialMember> parameters_of(ContactLaw law, int dimension, bool later)
{
  std::vector<MaterialMember> members;
  for (const MaterialParameter &parameter : MATERIAL_PARAMETERS)
    if (parameter.is_of(law, dimension) && parameter.later == later)
      members.push_back(parameter.member);
  // records have them as they lie in memory
  static constexpr MaterialNumbers SOME{};
  std::sort(members.begin(), members.end(), [](MaterialMember a, MaterialMember b) {
    return std::less<const double *>()(&(SOME.*a), &(SOME.*b));
  });
  return members;
}

template ContactModel contacts_of(const RveStateOf<2> &);
template ContactModel contacts_of(const RveStateOf<3> &);
template ContactModel contacts_of(const std::vector<RveStateOf<3>> &,
                                  const std::function<std::string(int)> &);
template ContactModel contacts_of(const std::vector<RveStateOf<2>> &,
                                  const std::function<std::string(int)> &);

}    // namespace rve
