// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/material_arguments.h"

#include "rve/core/error.h"
#include "rve/core/pi.h"
#include "utils.h"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

using namespace LAMMPS_NS;

namespace {

// ---- normal models ----

/// Values of the keyword *contact*. Their syntax is that of pair_coeff with pair_style granular,
/// without the two atom types.
struct Contact {
  MaterialArguments &material;
  double eta_n = 0.0;    ///< damping of the normal model; its unit depends on the damping model
  std::optional<double> youngs = {};     ///< E of hertz/material and dmt [stress]
  std::optional<double> poisson = {};    ///< nu of hertz/material and dmt [-]
};

void read_hooke(ScriptArguments &words, Contact &contact)
{
  contact.material[&rve::Material::normal_stiffness] = words.number("hooke k_n");
  contact.eta_n = words.number("hooke eta_n");
}

void read_hertz(ScriptArguments &words, Contact &contact)
{
  contact.material[&rve::Material::hertz_stiffness] = words.number("hertz k_n");
  contact.eta_n = words.number("hertz eta_n");
}

void read_elastic_constants(ScriptArguments &words, Contact &contact)
{
  contact.youngs = words.positive("E", "[stress]");
  contact.eta_n = words.number("eta_n");
  const double nu = words.number("nu");
  if (!(nu > -1.0 && nu <= 0.5))
    words.refuse(fmt::format("contact nu is {} [-]; it must lie in (-1, 0.5]", rve::number(nu)));
  contact.poisson = nu;
  // 4/3 E* of two equal bodies
  contact.material[&rve::Material::hertz_stiffness] =
      4.0 / 3.0 * *contact.youngs / (2.0 * (1.0 - nu * nu));
}

void read_dmt(ScriptArguments &words, Contact &contact)
{
  read_elastic_constants(words, contact);
  contact.material[&rve::Material::surface_energy] = words.number("cohesion");
}

struct NormalModel {
  const char *name;
  rve::ContactLaw law;
  void (*read)(ScriptArguments &, Contact &);
};

constexpr NormalModel NORMAL_MODELS[] = {
    {"hooke", rve::ContactLaw::Linear, read_hooke},
    {"hertz", rve::ContactLaw::Hertz, read_hertz},
    {"hertz/material", rve::ContactLaw::Hertz, read_elastic_constants},
    {"dmt", rve::ContactLaw::Dmt, read_dmt}};

// ---- tangential models ----

void read_linear_tangential(ScriptArguments &words, Contact &contact)
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
    words.refuse("contact tangential linear_nohistory (friction by a dashpot alone) is not "
                 "supported; use linear_history, or x_gammat 0 or mu 0");
  }
}

void read_mindlin(ScriptArguments &words, Contact &contact)
{
  const double kept = words.choice<double>("tangential model",
                                           {{"mindlin", 1.0},
                                            {"mindlin/force", 0.0},
                                            {"mindlin_rescale", 3.0},
                                            {"mindlin_rescale/force", 2.0}});
  double k_t;
  if (std::string_view(words.peek()) != "NULL") {
    k_t = words.number("tangential k_t");
  } else {
    words.next();
    if (!contact.youngs)
      words.refuse("contact tangential k_t is NULL, which takes it from E and nu of hertz/material "
                   "or dmt; with another normal model it must be a number [force/length^2]");
    // 8 G* of two equal bodies
    const double nu = *contact.poisson;
    k_t = 8.0 * *contact.youngs / (4.0 * (2.0 - nu) * (1.0 + nu));
  }
  contact.material[&rve::Material::mindlin_stiffness] = k_t;
  contact.material[&rve::Material::mindlin_damping] = words.number("tangential x_gammat");
  contact.material[&rve::Material::friction] = words.number("tangential mu");
  contact.material[&rve::Material::mindlin_displacement] = kept;
}

void read_tangential(ScriptArguments &words, Contact &contact)
{
  return *contact.material.law == rve::ContactLaw::Linear ? read_linear_tangential(words, contact)
                                                          : read_mindlin(words, contact);
}

// ---- damping models ----

/// Returns c = -sqrt(5) ln e / sqrt(pi^2 + ln^2 e) [-]. A dashpot c sqrt(m k_n a) gives an impact
/// the coefficient of restitution e.
double damping_of_restitution(ScriptArguments &words, double e)
{
  if (!(e > 0.0 && e <= 1.0))
    words.refuse(fmt::format("contact coefficient of restitution is {} [-]; it must lie in (0, 1]",
                             rve::number(e)));
  const double log_e = std::log(e);
  return std::sqrt(5.0) * std::fabs(log_e) / std::hypot(rve::kPi, log_e);
}

void read_damping(ScriptArguments &words, Contact &contact)
{
  MaterialArguments &material = contact.material;
  if (*material.law == rve::ContactLaw::Linear) {
    words.choice<bool>("damping model", {{"velocity", true}});
    material[&rve::Material::normal_viscosity] = contact.eta_n;
    return;
  }
  constexpr rve::MaterialMember RESTITUTION = &rve::Material::restitution_damping;
  const auto damping =
      words.choice<rve::MaterialMember>("damping model",
                                        {{"viscoelastic", &rve::Material::viscoelastic_damping},
                                         {"velocity", &rve::Material::normal_viscosity},
                                         {"coeff_restitution", RESTITUTION}});
  if (damping == RESTITUTION && *material.law == rve::ContactLaw::Dmt)
    words.refuse("contact dmt does not support damping coeff_restitution (as in pair_style "
                 "granular), because the energy loss of an impact also depends on the attraction; "
                 "use another damping model");
  material[damping] = damping == RESTITUTION ? damping_of_restitution(words, contact.eta_n)
                                             : contact.eta_n;
}

/// Applies viscoelastic damping, which pair_style granular uses for contacts without a damping
/// model. Hooke contacts do not support it; for them eta_n other than 0 is an error.
void take_default_damping(ScriptArguments &words, Contact &contact)
{
  if (*contact.material.law != rve::ContactLaw::Linear)
    contact.material[&rve::Material::viscoelastic_damping] = contact.eta_n;
  else if (contact.eta_n != 0.0)
    words.refuse(fmt::format(
        "contact has eta_n {} and no damping model; viscoelastic, the default of pair_style "
        "granular, is not supported for hooke: use damping velocity, or eta_n 0",
        rve::number(contact.eta_n)));
}

// ---- rolling and twisting ----

void read_rolling(ScriptArguments &words, Contact &contact)
{
  if (!words.choice<bool>("rolling model", {{"sds", true}, {"none", false}})) return;
  contact.material[&rve::Material::rolling_stiffness] = words.number("rolling k_roll");
  contact.material[&rve::Material::rolling_viscosity] = words.number("rolling gamma_roll");
  contact.material[&rve::Material::rolling_friction] = words.number("rolling mu_roll");
}

void read_twisting(ScriptArguments &words, Contact &contact)
{
  enum class Twisting { None, Sds, Marshall };
  const auto twisting = words.choice<Twisting>(
      "twisting model",
      {{"sds", Twisting::Sds}, {"marshall", Twisting::Marshall}, {"none", Twisting::None}});
  if (twisting == Twisting::Marshall) contact.material[&rve::Material::twisting_marshall] = 1.0;
  if (twisting != Twisting::Sds) return;
  contact.material[&rve::Material::twisting_stiffness] = words.number("twisting k_twist");
  contact.material[&rve::Material::twisting_viscosity] = words.number("twisting gamma_twist");
  contact.material[&rve::Material::twisting_friction] = words.number("twisting mu_twist");
}

void read_reach(ScriptArguments &words, Contact &contact)
{
  if (*contact.material.law != rve::ContactLaw::Dmt)
    words.refuse(
        fmt::format("contact {} has no reach, because only dmt has an attraction beyond contact",
                    rve::word_of(*contact.material.law)));
  contact.material[&rve::Material::adhesion_reach] = words.number("reach");
}

struct Part {
  const char *name;
  void (*read)(ScriptArguments &, Contact &);
};

constexpr Part PARTS[] = {{"tangential", read_tangential},
                          {"damping", read_damping},
                          {"rolling", read_rolling},
                          {"twisting", read_twisting},
                          {"reach", read_reach}};

/// Reads the values of *contact*. Contact parameters that the script does not give become 0.
void read_contact(ScriptArguments &words, MaterialArguments &material)
{
  words.set_form(
      "hooke k_n eta_n tangential linear_history k_t x_gammat mu [damping velocity] "
      "[rolling sds k_roll gamma_roll mu_roll] [twisting sds k_twist gamma_twist mu_twist "
      "or marshall], or hertz k_n "
      "eta_n hertz/material E eta_n nu or dmt E eta_n nu cohesion, tangential mindlin, "
      "mindlin/force, mindlin_rescale or mindlin_rescale/force k_t x_gammat mu [damping "
      "viscoelastic, velocity or coeff_restitution] [rolling sds k_roll gamma_roll "
      "mu_roll] [twisting sds k_twist gamma_twist mu_twist or marshall] [reach h]");
  for (const rve::MaterialParameter &parameter : rve::MATERIAL_PARAMETERS)
    if (parameter.of_contact()) material[parameter.member] = 0.0;
  Contact contact{material};
  const NormalModel &normal = NORMAL_MODELS[words.choice("normal model", names_of(NORMAL_MODELS))];
  material.law = normal.law;
  normal.read(words, contact);

  rve::Words given;
  const auto has = [&](std::string_view part) {
    return std::find(given.begin(), given.end(), part) != given.end();
  };
  while (!words.empty()) {
    const std::string_view word = words.peek();
    for (const std::string_view other : {"limit_damping", "cutoff", "heat"})
      if (word == other)
        words.refuse(fmt::format("contact does not support {}; of pair_style granular it supports "
                                 "tangential, damping, rolling and twisting",
                                 words.next()));
    const auto part = std::find_if(std::begin(PARTS), std::end(PARTS),
                                   [&](const auto &row) { return word == row.name; });
    // damping with a number is the keyword of the local damping of grains, not a part of contact
    if (part == std::end(PARTS) || (word == "damping" && utils::is_double(words.peek(1)))) break;
    words.next();
    if (has(word)) words.refuse(fmt::format("contact has {} twice; give it once", part->name));
    given.push_back(word);
    part->read(words, contact);
  }
  if (!has("tangential"))
    words.refuse("contact has no tangential model; without tangential forces give tangential "
                 "linear_nohistory 0 0");
  if (!has("damping")) take_default_damping(words, contact);
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

bool MaterialArguments::read(ScriptArguments &words)
{
  const bool is_contact = words.keyword() == "contact";
  for (const auto &parameter : rve::MATERIAL_PARAMETERS) {
    const char *keyword = parameter.keyword;
    const bool is_this = words.keyword() == keyword;
    if (parameter.of_contact() &&
        ((is_contact && words.has(keyword)) || (is_this && words.has("contact"))))
      words.refuse(fmt::format("contact and {} exclude each other, because contact also sets {}",
                               keyword, keyword));
    if (!is_this) continue;
    (*this)[parameter.member] = words.number();
    return true;
  }
  if (is_contact) read_contact(words, *this);
  return is_contact;
}

const std::optional<double> &MaterialArguments::operator[](rve::MaterialMember member) const
{
  std::size_t k = 0;
  while (rve::MATERIAL_PARAMETERS[k].member != member) ++k;
  return values[k];
}

std::optional<double> &MaterialArguments::operator[](rve::MaterialMember member)
{
  return const_cast<std::optional<double> &>(std::as_const(*this)[member]);
}

bool MaterialArguments::any() const
{
  return law.has_value() ||
      std::any_of(std::begin(values), std::end(values),
                  [](const auto &value) { return value.has_value(); });
}

void MaterialArguments::add(const MaterialArguments &later)
{
  if (later.law) law = later.law;
  for (std::size_t k = 0; k < std::size(values); ++k)
    if (later.values[k]) values[k] = later.values[k];
}

void MaterialArguments::apply(rve::Material &material) const
{
  if (law) material.law = *law;
  for (const auto &parameter : rve::MATERIAL_PARAMETERS)
    if ((*this)[parameter.member]) material.*parameter.member = *(*this)[parameter.member];
  const MaterialArguments &words = *this;
  if (words[&rve::Material::rolling_friction].value_or(0.0) > 0.0 &&
      !words[&rve::Material::rolling_stiffness] && material.rolling_stiffness == 0.0) {
    rve::require(material.law == rve::ContactLaw::Linear, [&] {
      return fmt::format(
          "rolling_friction is {} [-] without a kr [force/length], and the contact law {} has no "
          "kt to replace it; give kr, or rolling_friction 0",
          rve::number(material.rolling_friction), rve::word_of(material.law));
    });
    material.rolling_stiffness = material.tangential_stiffness;
  }
}

void LAMMPS_NS::change_material(rve::Material &material, const MaterialArguments &words,
                                double mass_scaling, double mass_scaling_before)
{
  words.apply(material);
  // mass scaling changes the inertia through the mass depth and leaves the density as it is
  if (words[&rve::Material::mass_depth])
    material.mass_depth *= mass_scaling;
  else if (mass_scaling != mass_scaling_before)
    material.mass_depth *= mass_scaling / mass_scaling_before;
}
