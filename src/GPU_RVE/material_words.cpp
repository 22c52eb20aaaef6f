/* ----------------------------------------------------------------------
   LAMMPS - Large-scale Atomic/Molecular Massively Parallel Simulator
   https://www.lammps.org/, Sandia National Laboratories
   LAMMPS development team: developers@lammps.org

   Copyright (2003) Sandia Corporation.  Under the terms of Contract
   DE-AC04-94AL85000 with Sandia Corporation, the U.S. Government retains
   certain rights in this software.  This software is distributed under
   the GNU General Public License.

   See the README file in the top-level LAMMPS directory.
------------------------------------------------------------------------- */

#include "material_words.h"

#include "rve/core/error.h"
#include "utils.h"

#include <algorithm>
#include <string_view>
#include <utility>

using namespace LAMMPS_NS;

namespace {

// ---- the contact law as a pair_coeff of pair_style granular has it, behind the types of atoms ----

struct Contact {
  MaterialWords &material;
  double eta_n;    ///< of the normal model
};

void read_tangential(ScriptWords &words, Contact &contact)
{
  const bool has_spring = words.choice<bool>(
      "tangential model", {{"linear_history", true}, {"linear_nohistory", false}});
  const double k_t = has_spring ? words.number("tangential k_t") : 0.0;
  const double gamma_t = words.number("tangential x_gammat") * contact.eta_n;
  const double friction = words.number("tangential mu");
  if (has_spring) {
    contact.material[&rve::Material::tangential_stiffness] = k_t;
    contact.material[&rve::Material::tangential_viscosity] = gamma_t;
    contact.material[&rve::Material::friction] = friction;
  } else if (gamma_t * friction != 0.0) {
    words.refuse("contact tangential linear_nohistory is friction by a dashpot alone, which does "
                 "not exist here; it must have x_gammat or mu 0, or be linear_history");
  }
}

void read_damping(ScriptWords &words, Contact &)
{
  words.choice<bool>("damping model", {{"velocity", true}});
}

void read_rolling(ScriptWords &words, Contact &contact)
{
  if (!words.choice<bool>("rolling model", {{"sds", true}, {"none", false}})) return;
  contact.material[&rve::Material::rolling_stiffness] = words.number("rolling k_roll");
  const double viscosity = words.number("rolling gamma_roll");
  if (viscosity != 0.0)
    words.refuse(fmt::format("contact rolling gamma_roll is {} [force time/length]; it must be 0: "
                             "rolling has no dashpot here",
                             rve::number(viscosity)));
  contact.material[&rve::Material::rolling_friction] = words.number("rolling mu_roll");
}

void read_twisting(ScriptWords &words, Contact &)
{
  words.choice<bool>("twisting model", {{"none", true}});
}

constexpr ScriptKeyword<Contact> PARTS[] = {
    {"tangential", "linear_history k_t x_gammat mu", read_tangential},
    {"damping", "velocity", read_damping},
    {"rolling", "sds k_roll 0 mu_roll", read_rolling},
    {"twisting", "none", read_twisting}};

/// Gives all that *contact* can say: what it does not say is 0.
void read_contact(ScriptWords &words, MaterialWords &material)
{
  words.set_form("hooke k_n eta_n tangential linear_history k_t x_gammat mu [damping velocity] "
                 "[rolling sds k_roll 0 mu_roll]");
  for (const rve::MaterialParameter &parameter : rve::MATERIAL_PARAMETERS)
    if (parameter.of_contact()) material[parameter.member] = 0.0;
  material.law = words.choice<rve::ContactLaw>(
      "normal model", {{rve::word_of(rve::ContactLaw::Linear), rve::ContactLaw::Linear}});
  material[&rve::Material::normal_stiffness] = words.number("hooke k_n");
  Contact contact{material, words.number("hooke eta_n")};
  material[&rve::Material::normal_viscosity] = contact.eta_n;

  rve::Words given;
  const auto has = [&](std::string_view part) {
    return std::find(given.begin(), given.end(), part) != given.end();
  };
  while (!words.empty()) {
    const std::string_view word = words.peek();
    for (const std::string_view other : {"limit_damping", "cutoff", "heat"})
      if (word == other)
        words.refuse(fmt::format("contact has no {}; of pair_style granular it has tangential, "
                                 "damping, rolling and twisting",
                                 words.next()));
    const auto part = std::find_if(std::begin(PARTS), std::end(PARTS), [&](const auto &row) {
      return word == row.name;
    });
    // damping with a number is the local damping of all grains, and no part of the law
    if (part == std::end(PARTS) || (word == "damping" && utils::is_double(words.peek(1)))) break;
    words.next();
    if (has(word)) words.refuse(fmt::format("contact has {} twice", part->name));
    given.push_back(word);
    part->read(words, contact);
  }
  if (!has("tangential"))
    words.refuse("contact has no tangential model; without tangential forces it is tangential "
                 "linear_nohistory 0 0");
  if (contact.eta_n != 0.0 && !has("damping"))
    words.refuse(fmt::format("contact has eta_n {} and no damping model, which is viscoelastic in "
                             "pair_style granular and does not exist here; it must have damping "
                             "velocity, or eta_n 0",
                             rve::number(contact.eta_n)));
}

}    // namespace

rve::Words LAMMPS_NS::material_keywords()
{
  rve::Words words;
  for (const rve::MaterialParameter &parameter : rve::MATERIAL_PARAMETERS)
    words.emplace_back(parameter.keyword);
  words.emplace_back("contact");
  return words;
}

bool MaterialWords::read(ScriptWords &words)
{
  const bool is_contact = words.keyword() == "contact";
  for (const auto &parameter : rve::MATERIAL_PARAMETERS) {
    const char *keyword = parameter.keyword;
    const bool is_this = words.keyword() == keyword;
    if (parameter.of_contact() &&
        ((is_contact && words.has(keyword)) || (is_this && words.has("contact"))))
      words.refuse(fmt::format("contact and {} exclude each other: contact gives {}, too", keyword,
                               keyword));
    if (!is_this) continue;
    (*this)[parameter.member] = words.number();
    return true;
  }
  if (is_contact) read_contact(words, *this);
  return is_contact;
}

const std::optional<double> &MaterialWords::operator[](MaterialMember member) const
{
  std::size_t k = 0;
  while (rve::MATERIAL_PARAMETERS[k].member != member) ++k;
  return values[k];
}

std::optional<double> &MaterialWords::operator[](MaterialMember member)
{
  return const_cast<std::optional<double> &>(std::as_const(*this)[member]);
}

bool MaterialWords::any() const
{
  return law.has_value() ||
      std::any_of(std::begin(values), std::end(values), [](const auto &value) {
           return value.has_value();
         });
}

void MaterialWords::add(const MaterialWords &later)
{
  if (later.law) law = later.law;
  for (std::size_t k = 0; k < std::size(values); ++k)
    if (later.values[k]) values[k] = later.values[k];
}

void MaterialWords::apply(rve::Material &material) const
{
  if (law) material.law = *law;
  for (const auto &parameter : rve::MATERIAL_PARAMETERS)
    if ((*this)[parameter.member]) material.*parameter.member = *(*this)[parameter.member];
  const MaterialWords &words = *this;
  if (words[&rve::Material::rolling_friction].value_or(0.0) > 0.0 &&
      !words[&rve::Material::rolling_stiffness] && material.rolling_stiffness == 0.0)
    material.rolling_stiffness = material.tangential_stiffness;
}

void LAMMPS_NS::change_material(rve::Material &material, const MaterialWords &words,
                                double mass_scaling, double mass_scaling_before)
{
  words.apply(material);
  // of inertia only: density stays
  if (words[&rve::Material::mass_depth])
    material.mass_depth *= mass_scaling;
  else if (mass_scaling != mass_scaling_before)
    material.mass_depth *= mass_scaling / mass_scaling_before;
}
