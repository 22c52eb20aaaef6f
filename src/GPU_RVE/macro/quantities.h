// SPDX-License-Identifier: GPL-2.0-only
// What the answer of an RVE says, and what its contacts say, by name: the quantities of compute rve/atom and of the C interface.

#pragma once

#include "rve/core/error.h"
#include "rve/core/suggestion.h"
#include "rve/engine/contact_measures.h"
#include "rve/engine/engine.h"

#include <cmath>
#include <string>
#include <vector>

namespace macro {

// Strain of equations (26) and (27) from F: eps = (F + F^T)/2 - 1, in the sign of F (extension positive).
template <int D> double volumetric_strain(const rve::ResultOf<D> &r)
{
  return rve::trace(r.deformation) - D;
}

// n = 2
inline double deviatoric_strain(const rve::ResultOf<2> &r)
{
  const double half_difference = 0.5 * (r.deformation(0, 0) - r.deformation(1, 1));
  const double shear = 0.5 * (r.deformation(0, 1) + r.deformation(1, 0));
  return 2.0 * std::sqrt(half_difference * half_difference + shear * shear);
}

// n = 3: sqrt(2/3 e_ij e_ij)
inline double deviatoric_strain(const rve::ResultOf<3> &r)
{
  const rve::Tensor3 strain = 0.5 * (r.deformation + rve::transpose(r.deformation));
  const double mean = rve::trace(strain) / 3.0;
  double squares = 0.0;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) {
      const double part = strain(a, b) - (a == b ? mean : 0.0);
      squares += part * part;
    }
  return std::sqrt(squares * 2.0 / 3.0);
}

/// A number that is known when `Known` is: of disks, of spheres, or of both.
template <template <int> class Known> struct QuantityOf {
  const char *name;
  double (*of_disks)(const Known<2> &);
  double (*of_spheres)(const Known<3> &);

  bool is_of(int dimension) const { return dimension == 3 || of_disks; }
  double of(const Known<2> &known) const { return of_disks(known); }
  double of(const Known<3> &known) const { return of_spheres(known); }
};

/// Of the answer that every RVE has at the end of a step.
using Quantity = QuantityOf<rve::ResultOf>;
/// Of the contacts of its state, which are looked at when it is asked for.
using ContactQuantity = QuantityOf<rve::ContactMeasuresOf>;

namespace quantities {
  /// What becomes a quantity of either kind.
  template <class Of> struct OfBoth {
    const char *name;
    Of of;
    template <template <int> class Known> constexpr operator QuantityOf<Known>() const
    {
      return {name, of, of};
    }
  };
  template <class Of> constexpr OfBoth<Of> of_both(const char *name, Of of)
  {
    return {name, of};
  }
  constexpr Quantity of_spheres(const char *name, double (*of)(const rve::ResultOf<3> &))
  {
    return {name, nullptr, of};
  }
  constexpr ContactQuantity of_spheres(const char *name,
                                       double (*of)(const rve::ContactMeasuresOf<3> &))
  {
    return {name, nullptr, of};
  }

  // clang-format off
  inline constexpr Quantity ALL[] = {
      of_both("sxx", [](const auto &r) { return r.stress(0, 0); }),
      of_both("syy", [](const auto &r) { return r.stress(1, 1); }),
      of_both("sxy", [](const auto &r) { return r.stress(0, 1); }),
      of_both("syx", [](const auto &r) { return r.stress(1, 0); }),
      of_spheres("szz", [](const rve::ResultOf<3> &r) { return r.stress(2, 2); }),
      of_spheres("sxz", [](const rve::ResultOf<3> &r) { return r.stress(0, 2); }),
      of_spheres("szx", [](const rve::ResultOf<3> &r) { return r.stress(2, 0); }),
      of_spheres("syz", [](const rve::ResultOf<3> &r) { return r.stress(1, 2); }),
      of_spheres("szy", [](const rve::ResultOf<3> &r) { return r.stress(2, 1); }),
      of_both("p", [](const auto &r) { return r.mean_stress(); }),
      of_both("q", [](const auto &r) { return r.deviatoric_stress(); }),
      of_both("eps_v", [](const auto &r) { return volumetric_strain(r); }),
      of_both("eps_q", [](const auto &r) { return deviatoric_strain(r); }),
      of_both("void_ratio", [](const auto &r) { return r.void_ratio; }),
      of_both("coordination", [](const auto &r) { return r.coordination_number; }),
      of_both("coordination_mech", [](const auto &r) { return r.mechanical_coordination_number; }),
      of_both("fabric_xx", [](const auto &r) { return r.fabric(0, 0); }),
      of_both("fabric_yy", [](const auto &r) { return r.fabric(1, 1); }),
      of_both("fabric_xy", [](const auto &r) { return r.fabric(0, 1); }),
      of_spheres("fabric_zz", [](const rve::ResultOf<3> &r) { return r.fabric(2, 2); }),
      of_spheres("fabric_xz", [](const rve::ResultOf<3> &r) { return r.fabric(0, 2); }),
      of_spheres("fabric_yz", [](const rve::ResultOf<3> &r) { return r.fabric(1, 2); }),
      of_both("def_xx", [](const auto &r) { return r.deformation(0, 0); }),
      of_both("def_xy", [](const auto &r) { return r.deformation(0, 1); }),
      of_both("def_yx", [](const auto &r) { return r.deformation(1, 0); }),
      of_both("def_yy", [](const auto &r) { return r.deformation(1, 1); }),
      of_spheres("def_xz", [](const rve::ResultOf<3> &r) { return r.deformation(0, 2); }),
      of_spheres("def_yz", [](const rve::ResultOf<3> &r) { return r.deformation(1, 2); }),
      of_spheres("def_zx", [](const rve::ResultOf<3> &r) { return r.deformation(2, 0); }),
      of_spheres("def_zy", [](const rve::ResultOf<3> &r) { return r.deformation(2, 1); }),
      of_spheres("def_zz", [](const rve::ResultOf<3> &r) { return r.deformation(2, 2); }),
      of_both("cell_xx", [](const auto &r) { return r.cell(0, 0); }),
      of_both("cell_xy", [](const auto &r) { return r.cell(0, 1); }),
      of_both("cell_yx", [](const auto &r) { return r.cell(1, 0); }),
      of_both("cell_yy", [](const auto &r) { return r.cell(1, 1); }),
      of_spheres("cell_xz", [](const rve::ResultOf<3> &r) { return r.cell(0, 2); }),
      of_spheres("cell_yz", [](const rve::ResultOf<3> &r) { return r.cell(1, 2); }),
      of_spheres("cell_zx", [](const rve::ResultOf<3> &r) { return r.cell(2, 0); }),
      of_spheres("cell_zy", [](const rve::ResultOf<3> &r) { return r.cell(2, 1); }),
      of_spheres("cell_zz", [](const rve::ResultOf<3> &r) { return r.cell(2, 2); }),
      of_both("servo_xx", [](const auto &r) { return r.servo_velocity_gradient(0, 0); }),
      of_both("servo_yy", [](const auto &r) { return r.servo_velocity_gradient(1, 1); }),
      of_both("servo_xy", [](const auto &r) { return r.servo_velocity_gradient(0, 1); }),
      of_spheres("servo_zz", [](const rve::ResultOf<3> &r) { return r.servo_velocity_gradient(2, 2); }),
      of_spheres("servo_xz", [](const rve::ResultOf<3> &r) { return r.servo_velocity_gradient(0, 2); }),
      of_spheres("servo_yz", [](const rve::ResultOf<3> &r) { return r.servo_velocity_gradient(1, 2); }),
      of_both("sliding", [](const auto &r) { return r.sliding_fraction; }),
      of_both("unbalanced", [](const auto &r) { return r.unbalanced_ratio; }),
      of_both("kinetic", [](const auto &r) { return r.kinetic_energy; }),
      of_both("elastic", [](const auto &r) { return r.elastic_energy; }),
      of_both("work", [](const auto &r) { return r.energy.work; }),
      of_both("loss_friction", [](const auto &r) { return r.energy.friction; }),
      of_both("loss_damping", [](const auto &r) { return r.energy.local_damping; }),
      of_both("loss_viscous", [](const auto &r) { return r.energy.viscous; }),
      of_both("overlap", [](const auto &r) { return r.largest_overlap; }),
      of_both("overlap_mean", [](const auto &r) { return r.mean_overlap; }),
      of_both("force_max", [](const auto &r) { return r.largest_contact_force; }),
      of_both("grains", [](const auto &r) { return double(r.num_grains); }),
      of_both("contacts", [](const auto &r) { return double(r.num_contacts); }),
      of_both("pairs", [](const auto &r) { return double(r.num_pairs); }),
      of_both("rattlers", [](const auto &r) { return double(r.num_rattlers); }),
      of_both("substeps", [](const auto &r) { return double(r.counters.steps); }),
      of_both("rebuilds", [](const auto &r) { return double(r.counters.rebuilds); }),
      of_both("reductions", [](const auto &r) { return double(r.counters.lattice_reductions); }),
      of_both("repeats", [](const auto &r) { return double(r.counters.repeats); }),
      of_both("status", [](const auto &r) { return double(r.status); }),
  };

  inline constexpr ContactQuantity OF_CONTACTS[] = {
      of_both("contact_fabric_xx", [](const auto &c) { return c.contact(0, 0); }),
      of_both("contact_fabric_yy", [](const auto &c) { return c.contact(1, 1); }),
      of_both("contact_fabric_xy", [](const auto &c) { return c.contact(0, 1); }),
      of_spheres("contact_fabric_zz", [](const rve::ContactMeasuresOf<3> &c) { return c.contact(2, 2); }),
      of_spheres("contact_fabric_xz", [](const rve::ContactMeasuresOf<3> &c) { return c.contact(0, 2); }),
      of_spheres("contact_fabric_yz", [](const rve::ContactMeasuresOf<3> &c) { return c.contact(1, 2); }),
      of_both("branch_fabric_xx", [](const auto &c) { return c.branch(0, 0); }),
      of_both("branch_fabric_yy", [](const auto &c) { return c.branch(1, 1); }),
      of_both("branch_fabric_xy", [](const auto &c) { return c.branch(0, 1); }),
      of_spheres("branch_fabric_zz", [](const rve::ContactMeasuresOf<3> &c) { return c.branch(2, 2); }),
      of_spheres("branch_fabric_xz", [](const rve::ContactMeasuresOf<3> &c) { return c.branch(0, 2); }),
      of_spheres("branch_fabric_yz", [](const rve::ContactMeasuresOf<3> &c) { return c.branch(1, 2); }),
      of_both("fn_fabric_xx", [](const auto &c) { return c.normal_force(0, 0); }),
      of_both("fn_fabric_yy", [](const auto &c) { return c.normal_force(1, 1); }),
      of_both("fn_fabric_xy", [](const auto &c) { return c.normal_force(0, 1); }),
      of_spheres("fn_fabric_zz", [](const rve::ContactMeasuresOf<3> &c) { return c.normal_force(2, 2); }),
      of_spheres("fn_fabric_xz", [](const rve::ContactMeasuresOf<3> &c) { return c.normal_force(0, 2); }),
      of_spheres("fn_fabric_yz", [](const rve::ContactMeasuresOf<3> &c) { return c.normal_force(1, 2); }),
      of_both("ft_fabric_xx", [](const auto &c) { return c.tangential_force(0, 0); }),
      of_both("ft_fabric_yy", [](const auto &c) { return c.tangential_force(1, 1); }),
      of_both("ft_fabric_xy", [](const auto &c) { return c.tangential_force(0, 1); }),
      of_spheres("ft_fabric_zz", [](const rve::ContactMeasuresOf<3> &c) { return c.tangential_force(2, 2); }),
      of_spheres("ft_fabric_xz", [](const rve::ContactMeasuresOf<3> &c) { return c.tangential_force(0, 2); }),
      of_spheres("ft_fabric_yz", [](const rve::ContactMeasuresOf<3> &c) { return c.tangential_force(1, 2); }),
      of_both("branch_mean", [](const auto &c) { return c.mean_branch; }),
      of_both("fn_mean", [](const auto &c) { return c.mean_normal_force; }),
      of_both("strong", [](const auto &c) { return c.strong; }),
      of_both("sliding_strong", [](const auto &c) { return c.sliding_strong; }),
      of_both("sliding_weak", [](const auto &c) { return c.sliding_weak; }),
      of_both("elastic_normal", [](const auto &c) { return c.elastic_normal; }),
      of_both("elastic_tangential", [](const auto &c) { return c.elastic_tangential; }),
      of_both("elastic_rolling", [](const auto &c) { return c.elastic_rolling; }),
      of_spheres("elastic_twisting", [](const rve::ContactMeasuresOf<3> &c) { return c.elastic_twisting; }),
  };
  // clang-format on
}    // namespace quantities

/// Those of grains of this dimension, in the order of the tables.
inline const std::vector<const char *> &quantity_names(int dimension)
{
  const auto names_of = [](int d) {
    std::vector<const char *> names;
    const auto add = [&](const auto &table) {
      for (const auto &quantity : table)
        if (quantity.is_of(d)) names.push_back(quantity.name);
    };
    add(quantities::ALL);
    add(quantities::OF_CONTACTS);
    return names;
  };
  static const std::vector<const char *> of_disks = names_of(2), of_spheres = names_of(3);
  return dimension == 2 ? of_disks : of_spheres;
}

/// read(quantity) with the Quantity or ContactQuantity of that name. Throws InputError with those that there are if grains of this dimension have
/// none.
template <class Read>
void with_quantity_named(const std::string &name, int dimension, const Read &read)
{
  const auto find = [&](const auto &table) {
    for (const auto &quantity : table)
      if (name == quantity.name && quantity.is_of(dimension)) {
        read(quantity);
        return true;
      }
    return false;
  };
  if (find(quantities::ALL) || find(quantities::OF_CONTACTS)) return;
  const std::vector<const char *> &names = quantity_names(dimension);
  throw rve::InputError(
      "there is no quantity '" + name + "' of " + (dimension == 2 ? "disks" : "spheres") +
      rve::did_you_mean(name, rve::Words(names.begin(), names.end()), "there are"));
}

}    // namespace macro
