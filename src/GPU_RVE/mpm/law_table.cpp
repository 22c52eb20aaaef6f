#include "mpm/law_table.h"

#include "mpm/linear_elastic.h"
#include "mpm/mohr_coulomb.h"

namespace mpm {

std::vector<LawEntry> &law_table()
{
  static std::vector<LawEntry> table = {
      {"elastic",
       {"E", "nu"},
       [](const double *a) -> std::shared_ptr<Constitutive<2>> {
         return std::make_shared<LinearElastic<2>>(a[0], a[1]);
       }},
      {"mohr_coulomb",
       {"E", "nu", "c", "phi", "psi"},
       [](const double *a) -> std::shared_ptr<Constitutive<2>> {
         return std::make_shared<MohrCoulomb>(a[0], a[1], a[2], a[3], a[4]);
       }},
  };
  return table;
}

}    // namespace mpm
