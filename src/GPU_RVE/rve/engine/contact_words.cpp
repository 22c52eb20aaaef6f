// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/contact_words.h"

#include "rve/core/error.h"
#include "rve/core/pi.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace rve {

void ContactWords::refuse(const std::string &message) const
{
  report(message);
  throw InputError(message);
}

int ContactWords::choice(const std::string &part, const Words &choices)
{
  const std::string word = next(part);
  std::string allowed;
  for (std::size_t k = 0; k < choices.size(); ++k) {
    if (choices[k] == word) return static_cast<int>(k);
    allowed += (k == 0 ? "" : k + 1 == choices.size() ? " or " : ", ") + std::string(choices[k]);
  }
  refuse(concat("contact ", part, " is '", word, "'; it must be ", allowed));
}

double ContactWords::positive(const std::string &part, const char *unit)
{
  const double value = number(part);
  if (!(value > 0.0) || std::isinf(value))
    refuse(concat("contact ", part, " is ", value, " ", unit, "; it must be greater than 0"));
  return value;
}

namespace {

  // ---- normal models ----

  /// Values of the keyword *contact*. Their syntax is that of pair_coeff with pair_style granular,
  /// without the two atom types.
  struct Contact {
    GivenMaterial &material;
    double eta_n = 0.0;    ///< damping of the normal model; its unit depends on the damping model
    std::optional<double> youngs = {};     ///< E of hertz/material and dmt [stress]
    std::optional<double> poisson = {};    ///< nu of hertz/material and dmt [-]
  };

  void read_hooke(ContactWords &words, Contact &contact)
  {
    contact.material[&Material::normal_stiffness] = words.number("hooke k_n");
    contact.eta_n = words.number("hooke eta_n");
  }

  void read_hertz(ContactWords &words, Contact &contact)
  {
    contact.material[&Material::hertz_stiffness] = words.number("hertz k_n");
    contact.eta_n = words.number("hertz eta_n");
  }

  void read_elastic_constants(ContactWords &words, Contact &contact)
  {
    contact.youngs = words.positive("E", "[stress]");
    contact.eta_n = words.number("eta_n");
    const double nu = words.number("nu");
    if (!(nu > -1.0 && nu <= 0.5))
      words.refuse(concat("contact nu is ", nu, " [-]; it must lie in (-1, 0.5]"));
    contact.poisson = nu;
    // 4/3 E* of two equal bodies
    contact.material[&Material::hertz_stiffness] =
        4.0 / 3.0 * *contact.youngs / (2.0 * (1.0 - nu * nu));
  }

  void read_dmt(ContactWords &words, Contact &contact)
  {
    read_elastic_constants(words, contact);
    contact.material[&Material::surface_energy] = words.number("cohesion");
  }

  struct NormalModel {
    const char *name;
    ContactLaw law;
    void (*read)(ContactWords &, Contact &);
  };

  constexpr NormalModel NORMAL_MODELS[] = {
      {"hooke", ContactLaw::Linear, read_hooke},
      {"hertz", ContactLaw::Hertz, read_hertz},
      {"hertz/material", ContactLaw::Hertz, read_elastic_constants},
      {"dmt", ContactLaw::Dmt, read_dmt}};

  // ---- tangential models ----

  void read_linear_tangential(ContactWords &words, Contact &contact)
  {
    const bool has_spring = words.choice<bool>(
        "tangential model", {{"linear_history", true}, {"linear_nohistory", false}});
    const double k_t = has_spring ? words.number("tangential k_t") : 0.0;
    const double gamma_t = words.number("tangential x_gammat") * contact.eta_n;
    const double friction = words.number("tangential mu");
    if (has_spring) {
      contact.material[&Material::tangential_stiffness] = k_t;
      contact.material[&Material::tangential_viscosity] = gamma_t;
      contact.material[&Material::friction] = friction;
    } else if (gamma_t * friction != 0.0) {
      words.refuse("contact tangential linear_nohistory (friction by a dashpot alone) is not "
                   "supported; use linear_history, or x_gammat 0 or mu 0");
    }
  }

  void read_mindlin(ContactWords &words, Contact &contact)
  {
    const double kept = words.choice<double>("tangential model",
                                             {{"mindlin", 1.0},
                                              {"mindlin/force", 0.0},
                                              {"mindlin_rescale", 3.0},
                                              {"mindlin_rescale/force", 2.0}});
    double k_t;
    if (words.peek() != "NULL") {
      k_t = words.number("tangential k_t");
    } else {
      words.next();
      if (!contact.youngs)
        words.refuse(
            "contact tangential k_t is NULL, which takes it from E and nu of hertz/material "
            "or dmt; with another normal model it must be a number [force/length^2]");
      // 8 G* of two equal bodies
      const double nu = *contact.poisson;
      k_t = 8.0 * *contact.youngs / (4.0 * (2.0 - nu) * (1.0 + nu));
    }
    contact.material[&Material::mindlin_stiffness] = k_t;
    contact.material[&Material::mindlin_damping] = words.number("tangential x_gammat");
    contact.material[&Material::friction] = words.number("tangential mu");
    contact.material[&Material::mindlin_displacement] = kept;
  }

  void read_tangential(ContactWords &words, Contact &contact)
  {
    return *contact.material.law == ContactLaw::Linear ? read_linear_tangential(words, contact)
                                                       : read_mindlin(words, contact);
  }

  // ---- damping models ----

  /// Returns c = -sqrt(5) ln e / sqrt(pi^2 + ln^2 e) [-]. A dashpot c sqrt(m k_n a) gives an impact
  /// the coefficient of restitution e.
  double damping_of_restitution(ContactWords &words, double e)
  {
    if (!(e > 0.0 && e <= 1.0))
      words.refuse(
          concat("contact coefficient of restitution is ", e, " [-]; it must lie in (0, 1]"));
    const double log_e = std::log(e);
    return std::sqrt(5.0) * std::fabs(log_e) / std::hypot(kPi, log_e);
  }

  void read_damping(ContactWords &words, Contact &contact)
  {
    GivenMaterial &material = contact.material;
    if (*material.law == ContactLaw::Linear) {
      words.choice<bool>("damping model", {{"velocity", true}});
      material[&Material::normal_viscosity] = contact.eta_n;
      return;
    }
    constexpr MaterialMember RESTITUTION = &Material::restitution_damping;
    const auto damping =
        words.choice<MaterialMember>("damping model",
                                     {{"viscoelastic", &Material::viscoelastic_damping},
                                      {"velocity", &Material::normal_viscosity},
                                      {"coeff_restitution", RESTITUTION}});
    if (damping == RESTITUTION && *material.law == ContactLaw::Dmt)
      words.refuse(
          "contact dmt does not support damping coeff_restitution (as in pair_style "
          "granular), because the energy loss of an impact also depends on the attraction; "
          "use another damping model");
    material[damping] = damping == RESTITUTION ? damping_of_restitution(words, contact.eta_n)
                                               : contact.eta_n;
  }

  /// Applies viscoelastic damping, which pair_style granular uses for contacts without a damping
  /// model. Hooke contacts do not support it; for them eta_n other than 0 is an error.
  void take_default_damping(ContactWords &words, Contact &contact)
  {
    if (*contact.material.law != ContactLaw::Linear)
      contact.material[&Material::viscoelastic_damping] = contact.eta_n;
    else if (contact.eta_n != 0.0)
      words.refuse(concat(
          "contact has eta_n ", contact.eta_n,
          " and no damping model; viscoelastic, the default of "
          "pair_style granular, is not supported for hooke: use damping velocity, or eta_n 0"));
  }

  // ---- rolling and twisting ----

  void read_rolling(ContactWords &words, Contact &contact)
  {
    if (!words.choice<bool>("rolling model", {{"sds", true}, {"none", false}})) return;
    contact.material[&Material::rolling_stiffness] = words.number("rolling k_roll");
    contact.material[&Material::rolling_viscosity] = words.number("rolling gamma_roll");
    contact.material[&Material::rolling_friction] = words.number("rolling mu_roll");
  }

  void read_twisting(ContactWords &words, Contact &contact)
  {
    enum class Twisting { None, Sds, Marshall };
    const auto twisting = words.choice<Twisting>(
        "twisting model",
        {{"sds", Twisting::Sds}, {"marshall", Twisting::Marshall}, {"none", Twisting::None}});
    if (twisting == Twisting::Marshall) contact.material[&Material::twisting_marshall] = 1.0;
    if (twisting != Twisting::Sds) return;
    contact.material[&Material::twisting_stiffness] = words.number("twisting k_twist");
    contact.material[&Material::twisting_viscosity] = words.number("twisting gamma_twist");
    contact.material[&Material::twisting_friction] = words.number("twisting mu_twist");
  }

  void read_reach(ContactWords &words, Contact &contact)
  {
    if (*contact.material.law != ContactLaw::Dmt)
      words.refuse(concat("contact ", word_of(*contact.material.law),
                          " has no reach, because only dmt has an attraction beyond contact"));
    contact.material[&Material::adhesion_reach] = words.number("reach");
  }

  struct Part {
    const char *name;
    void (*read)(ContactWords &, Contact &);
  };

  constexpr Part PARTS[] = {{"tangential", read_tangential},
                            {"damping", read_damping},
                            {"rolling", read_rolling},
                            {"twisting", read_twisting},
                            {"reach", read_reach}};

}    // namespace

/// Reads the values of *contact*. Contact parameters that the script does not give become 0.
void read_contact(ContactWords &words, GivenMaterial &material)
{
  words.set_form(
      "hooke k_n eta_n tangential linear_history k_t x_gammat mu [damping velocity] "
      "[rolling sds k_roll gamma_roll mu_roll] [twisting sds k_twist gamma_twist mu_twist "
      "or marshall], or hertz k_n "
      "eta_n hertz/material E eta_n nu or dmt E eta_n nu cohesion, tangential mindlin, "
      "mindlin/force, mindlin_rescale or mindlin_rescale/force k_t x_gammat mu [damping "
      "viscoelastic, velocity or coeff_restitution] [rolling sds k_roll gamma_roll "
      "mu_roll] [twisting sds k_twist gamma_twist mu_twist or marshall] [reach h]");
  for (const MaterialParameter &parameter : MATERIAL_PARAMETERS)
    if (parameter.of_contact()) material[parameter.member] = 0.0;
  Contact contact{material};
  Words models;
  for (const NormalModel &model : NORMAL_MODELS) models.emplace_back(model.name);
  const NormalModel &normal = NORMAL_MODELS[words.choice("normal model", models)];
  material.law = normal.law;
  normal.read(words, contact);

  Words given;
  const auto has = [&](std::string_view part) {
    return std::find(given.begin(), given.end(), part) != given.end();
  };
  while (!words.empty()) {
    const std::string word = words.peek();
    for (const std::string_view other : {"limit_damping", "cutoff", "heat"})
      if (word == other)
        words.refuse(concat("contact does not support ", words.next(),
                            "; of pair_style granular it supports "
                            "tangential, damping, rolling and twisting"));
    const auto part = std::find_if(std::begin(PARTS), std::end(PARTS),
                                   [&](const auto &row) { return word == row.name; });
    // damping with a number is the keyword of the local damping of grains, not a part of contact
    if (part == std::end(PARTS) || (word == "damping" && words.is_number(1))) break;
    words.next();
    if (has(word)) words.refuse(concat("contact has ", part->name, " twice; give it once"));
    given.emplace_back(part->name);
    part->read(words, contact);
  }
  if (!has("tangential"))
    words.refuse("contact has no tangential model; without tangential forces give tangential "
                 "linear_nohistory 0 0");
  if (!has("damping")) take_default_damping(words, contact);
}

}    // namespace rve
