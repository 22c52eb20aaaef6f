// SPDX-License-Identifier: GPL-2.0-only
#include "mpm/law_table.h"

#include "mpm/drucker_prager.h"
#include "mpm/linear_elastic.h"
#include "mpm/mohr_coulomb.h"

namespace mpm {

template <int D> std::vector<LawEntry<D>> &law_table()
{
  static std::vector<LawEntry<D>> table = {
      {"elastic",
       {"E", "nu"},
       [](const double *a) -> std::shared_ptr<Constitutive<D>> {
         return std::make_shared<LinearElastic<D>>(a[0], a[1]);
       }},
      {"mohr_coulomb",
       {"E", "nu", "c", "phi", "psi"},
       [](const double *a) -> std::shared_ptr<Constitutive<D>> {
         return std::make_shared<MohrCoulomb<D>>(a[0], a[1], a[2], a[3], a[4]);
       },
       reduce_cohesion_and_friction},
      {"drucker_prager",
       {"E", "nu", "c", "phi", "psi"},
       [](const double *a) -> std::shared_ptr<Constitutive<D>> {
         return std::make_shared<DruckerPrager<D>>(a[0], a[1], a[2], a[3], a[4]);
       },
       reduce_cohesion_and_friction},
  };
  return table;
}

template std::vector<LawEntry<2>> &law_table<2>();
template std::vector<LawEntry<3>> &law_table<3>();

}    // namespace mpm
