// SPDX-License-Identifier: GPL-2.0-only
#include "capi/rve_packing.h"

#include "rve/core/error.h"
#include "rve/engine/contact_network.h"
#include "rve/engine/drift.h"
#include "rve/engine/packing.h"
#include "rve/engine/packing_io.h"

#include <iterator>

namespace capi {

namespace {

  /// Throws InputError if the grains drift. The drift is not corrected, because there is no log
  /// that could report the correction.
  void require_no_drift(const AnyState &packing, const std::string &name)
  {
    const std::string drift = std::visit(
        [](const auto &state) { return rve::describe_drift(rve::drift_of(state)); }, packing);
    rve::require(drift.empty(), name, " has a ", drift,
                 ", which is most of the motion of its grains; it must be 0: subtract it from the "
                 "velocities");
  }

  template <int D> std::vector<AnyState> read_library_of(const std::string &file)
  {
    rve::PackingLibraryOf<D> library = rve::read_library<D>(file);
    return {std::make_move_iterator(library.packings.begin()),
            std::make_move_iterator(library.packings.end())};
  }

  template <int D> AnyState prepare_of(const Order &order)
  {
    return rve::generate_packing(order.recipe, *rve::make_engine<D>(order.options));
  }

}    // namespace

AnyState read_state(const std::string &file)
{
  AnyState packing;
  if (rve::dimension_of_packing(file) == 3)
    packing = rve::read_packing<3>(file);
  else
    packing = rve::read_packing<2>(file);
  require_no_drift(packing, file);
  return packing;
}

std::vector<AnyState> read_states(const std::string &file)
{
  std::vector<AnyState> packings = rve::dimension_of_packing(file) == 3 ? read_library_of<3>(file)
                                                                        : read_library_of<2>(file);
  for (std::size_t k = 0; k < packings.size(); ++k)
    require_no_drift(packings[k], file + ": packing " + std::to_string(k));
  return packings;
}

AnyState prepare(const Order &order)
{
  return order.dimension == 3 ? prepare_of<3>(order) : prepare_of<2>(order);
}

std::vector<double> array_named(const AnyState &packing, const std::string &name)
{
  const auto components = [](const auto &matrix) {
    return std::vector<double>(std::begin(matrix.component), std::end(matrix.component));
  };
  return std::visit(
      [&](const auto &state) {
        if (name == "cell") return components(state.cell);
        if (name == "deformation") return components(state.deformation);
        if (name == "radius") return state.radius;
        if (name == "position") return state.positions();
        if (name == "velocity") return state.velocity;
        if (name == "spin") return state.spin;
        throw rve::InputError(
            "there is no array '" + name +
            "'; the arrays are cell, deformation, radius, position, velocity, spin");
      },
      packing);
}

std::vector<double> contact_table(const AnyState &packing)
{
  std::vector<double> table;
  const auto append = [&](const auto &numbers) {
    table.insert(table.end(), std::begin(numbers), std::end(numbers));
  };
  const auto append_row = [&](const auto &contact) {
    table.push_back(contact.geometry.first);
    table.push_back(contact.geometry.second);
    append(contact.geometry.branch.component);
    table.push_back(contact.geometry.overlap);
    table.push_back(contact.normal_force);
    append(contact.force_on_first.component);
    table.push_back(contact.mobilized_friction >= rve::SLIDING ? 1.0 : 0.0);
  };
  std::visit(
      [&](const auto &state) {
        for (const auto &contact : rve::find_spring_contacts(state)) append_row(contact);
      },
      packing);
  return table;
}

}    // namespace capi
