// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/given_material.h"

#include "rve/core/error.h"

#include <algorithm>
#include <utility>

namespace rve {

const std::optional<double> &GivenMaterial::operator[](MaterialMember member) const
{
  std::size_t k = 0;
  while (MATERIAL_PARAMETERS[k].member != member) ++k;
  return values[k];
}

std::optional<double> &GivenMaterial::operator[](MaterialMember member)
{
  return const_cast<std::optional<double> &>(std::as_const(*this)[member]);
}

bool GivenMaterial::any() const
{
  return law.has_value() ||
      std::any_of(std::begin(values), std::end(values),
                  [](const auto &value) { return value.has_value(); });
}

void GivenMaterial::add(const GivenMaterial &later)
{
  if (later.law) law = later.law;
  for (std::size_t k = 0; k < std::size(values); ++k)
    if (later.values[k]) values[k] = later.values[k];
}

void GivenMaterial::apply(Material &material) const
{
  if (law) material.law = *law;
  for (const auto &parameter : MATERIAL_PARAMETERS)
    if ((*this)[parameter.member]) material.*parameter.member = *(*this)[parameter.member];
  const GivenMaterial &given = *this;
  if (given[&Material::rolling_friction].value_or(0.0) > 0.0 &&
      !given[&Material::rolling_stiffness] && material.rolling_stiffness == 0.0) {
    require(material.law == ContactLaw::Linear, "rolling_friction is ", material.rolling_friction,
            " [-] without a kr [force/length], and the contact law ", word_of(material.law),
            " has no kt to replace it; give kr, or rolling_friction 0");
    material.rolling_stiffness = material.tangential_stiffness;
  }
}

}    // namespace rve
