// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/material_arguments.h"

#include "rve/engine/contact_words.h"
#include "utils.h"

#include <string>

using namespace LAMMPS_NS;

namespace {

/// Words of *contact* in a script.
class ContactOfScript final : public rve::ContactWords {
 public:
  explicit ContactOfScript(ScriptArguments &_words) : words(_words) {}
  bool empty() const override { return words.empty(); }
  std::string peek(int ahead) const override { return words.peek(ahead); }
  bool is_number(int ahead) const override { return utils::is_double(words.peek(ahead)); }
  std::string next(const std::string &part) override { return words.next(part); }
  double number(const std::string &part) override { return words.number(part); }
  void set_form(const std::string &form) override { words.set_form(form); }

 private:
  void report(const std::string &message) const override { words.refuse(message); }

  ScriptArguments &words;
};

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
  if (is_contact) {
    ContactOfScript contact(words);
    rve::read_contact(contact, *this);
  }
  return is_contact;
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
