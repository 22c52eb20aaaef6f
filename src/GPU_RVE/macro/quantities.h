// SPDX-License-Identifier: GPL-2.0-only
// Quantities of results and contacts of an RVE by name, for compute rve/atom and the C interface.

#pragma once

#include "rve/core/error.h"
#include "rve/core/suggestion.h"
#include "rve/engine/contact_measures.h"
#include "rve/engine/engine.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <sstream>
#include <string>
#include <vector>

namespace macro {

// Strains follow from eps = (F + F^T)/2 - 1 by equations (26) and (27) of the paper (see
// doc/src/theory_rve.rst). They are positive in extension. In equation (27), n = 2 for disks and n
// = 3 for spheres.
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

/// A quantity with its name, and the functions that compute it from the data `Known` of disks or of
/// spheres. A function is null if the quantity does not exist in its dimension.
template <template <int> class Known> struct QuantityOf {
  std::string name;
  std::function<double(const Known<2> &)> of_disks;
  std::function<double(const Known<3> &)> of_spheres;

  bool is_of(int dimension) const
  {
    return dimension == 2 ? of_disks != nullptr : of_spheres != nullptr;
  }
  double of(const Known<2> &known) const { return of_disks(known); }
  double of(const Known<3> &known) const { return of_spheres(known); }
};

/// Quantity of the result of an RVE at the end of a step.
using Quantity = QuantityOf<rve::ResultOf>;
/// Quantity of the contacts of an RVE. The contacts are evaluated only if such a quantity is
/// requested.
using ContactQuantity = QuantityOf<rve::ContactMeasuresOf>;

namespace quantities {
  template <template <int> class Known> struct Table : std::vector<QuantityOf<Known>> {
    template <class Of> void add(const char *name, Of of) { this->push_back({name, of, of}); }
    /// Adds components of a tensor. Components along z exist for spheres only.
    template <class Of> void add(const std::string &name, const char *components, Of of)
    {
      std::istringstream words(components);
      for (std::string word; words >> word;) {
        const int a = word[0] - 'x', b = word[1] - 'x';
        const auto component = [=](const auto &known) { return of(known)(a, b); };
        this->push_back({name + word, component, component});
        if (std::max(a, b) == 2) this->back().of_disks = nullptr;
      }
    }
  };

  inline const Table<rve::ResultOf> &all()
  {
    static const Table<rve::ResultOf> table = [] {
      Table<rve::ResultOf> t;
      t.add("s", "xx yy xy yx zz xz zx yz zy", [](const auto &r) { return r.stress; });
      t.add("p", [](const auto &r) { return r.mean_stress(); });
      t.add("q", [](const auto &r) { return r.deviatoric_stress(); });
      t.add("eps_v", [](const auto &r) { return volumetric_strain(r); });
      t.add("eps_q", [](const auto &r) { return deviatoric_strain(r); });
      t.add("void_ratio", [](const auto &r) { return r.void_ratio; });
      t.add("coordination", [](const auto &r) { return r.coordination_number; });
      t.add("coordination_mech", [](const auto &r) { return r.mechanical_coordination_number; });
      t.add("fabric_", "xx yy xy zz xz yz", [](const auto &r) { return r.fabric; });
      t.add("def_", "xx xy yx yy xz yz zx zy zz", [](const auto &r) { return r.deformation; });
      t.add("cell_", "xx xy yx yy xz yz zx zy zz", [](const auto &r) { return r.cell; });
      t.add("servo_", "xx yy xy zz xz yz", [](const auto &r) { return r.servo_velocity_gradient; });
      t.add("sliding", [](const auto &r) { return r.sliding_fraction; });
      t.add("unbalanced", [](const auto &r) { return r.unbalanced_ratio; });
      t.add("kinetic", [](const auto &r) { return r.kinetic_energy; });
      t.add("elastic", [](const auto &r) { return r.elastic_energy; });
      t.add("work", [](const auto &r) { return r.energy.work; });
      t.add("loss_friction", [](const auto &r) { return r.energy.friction; });
      t.add("loss_damping", [](const auto &r) { return r.energy.local_damping; });
      t.add("loss_viscous", [](const auto &r) { return r.energy.viscous; });
      t.add("overlap", [](const auto &r) { return r.largest_overlap; });
      t.add("overlap_mean", [](const auto &r) { return r.mean_overlap; });
      t.add("force_max", [](const auto &r) { return r.largest_contact_force; });
      t.add("grains", [](const auto &r) { return double(r.num_grains); });
      t.add("contacts", [](const auto &r) { return double(r.num_contacts); });
      t.add("pairs", [](const auto &r) { return double(r.num_pairs); });
      t.add("rattlers", [](const auto &r) { return double(r.num_rattlers); });
      t.add("substeps", [](const auto &r) { return double(r.counters.steps); });
      t.add("rebuilds", [](const auto &r) { return double(r.counters.rebuilds); });
      t.add("reductions", [](const auto &r) { return double(r.counters.lattice_reductions); });
      t.add("repeats", [](const auto &r) { return double(r.counters.repeats); });
      t.add("status", [](const auto &r) { return double(r.status); });
      return t;
    }();
    return table;
  }

  inline const Table<rve::ContactMeasuresOf> &of_contacts()
  {
    static const Table<rve::ContactMeasuresOf> table = [] {
      Table<rve::ContactMeasuresOf> t;
      t.add("contact_fabric_", "xx yy xy zz xz yz", [](const auto &c) { return c.contact; });
      t.add("branch_fabric_", "xx yy xy zz xz yz", [](const auto &c) { return c.branch; });
      t.add("fn_fabric_", "xx yy xy zz xz yz", [](const auto &c) { return c.normal_force; });
      t.add("ft_fabric_", "xx yy xy zz xz yz", [](const auto &c) { return c.tangential_force; });
      t.add("branch_mean", [](const auto &c) { return c.mean_branch; });
      t.add("fn_mean", [](const auto &c) { return c.mean_normal_force; });
      t.add("strong", [](const auto &c) { return c.strong; });
      t.add("sliding_strong", [](const auto &c) { return c.sliding_strong; });
      t.add("sliding_weak", [](const auto &c) { return c.sliding_weak; });
      t.add("elastic_normal", [](const auto &c) { return c.elastic_normal; });
      t.add("elastic_tangential", [](const auto &c) { return c.elastic_tangential; });
      t.add("elastic_rolling", [](const auto &c) { return c.elastic_rolling; });
      t.push_back({"elastic_twisting", nullptr,
                   [](const rve::ContactMeasuresOf<3> &c) { return c.elastic_twisting; }});
      return t;
    }();
    return table;
  }
}    // namespace quantities

/// Names of the quantities of a dimension, in the order of the tables.
inline const std::vector<const char *> &quantity_names(int dimension)
{
  const auto names_of = [](int d) {
    std::vector<const char *> names;
    const auto add = [&](const auto &table) {
      for (const auto &quantity : table)
        if (quantity.is_of(d)) names.push_back(quantity.name.c_str());
    };
    add(quantities::all());
    add(quantities::of_contacts());
    return names;
  };
  static const std::vector<const char *> of_disks = names_of(2), of_spheres = names_of(3);
  return dimension == 2 ? of_disks : of_spheres;
}

/// Calls read(quantity) with the Quantity or ContactQuantity of that name. Throws InputError with
/// the known names if the dimension has no such quantity.
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
  if (find(quantities::all()) || find(quantities::of_contacts())) return;
  const std::vector<const char *> &names = quantity_names(dimension);
  throw rve::InputError(
      "there is no quantity '" + name + "' of " + (dimension == 2 ? "disks" : "spheres") +
      rve::did_you_mean(name, rve::Words(names.begin(), names.end()), "the quantities are"));
}

}    // namespace macro
