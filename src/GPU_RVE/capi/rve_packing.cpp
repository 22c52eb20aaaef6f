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

  /// Throws InputError if the grains drift. There is no log in which a correction could be reported.
  template <int D> void require_no_drift(const rve::RveStateOf<D> &state, const std::string &whose)
  {
    const std::string drift = rve::describe_drift(rve::drift_of(state));
    rve::require(drift.empty(), whose, " has a ", drift,
                 ", which is most of the motion of its grains; it must be 0: subtract it from the "
                 "velocities");
  }

  template <int D> AnyState read_state_of(const std::string &file)
  {
    rve::RveStateOf<D> state = rve::read_packing<D>(file);
    require_no_drift(state, file);
    return state;
  }

  template <int D> std::vector<AnyState> read_states_of(const std::string &file)
  {
    rve::PackingLibraryOf<D> library = rve::read_library<D>(file);
    for (std::size_t k = 0; k < library.packings.size(); ++k)
      require_no_drift(library.packings[k], file + ": packing " + std::to_string(k));
    return {std::make_move_iterator(library.packings.begin()),
            std::make_move_iterator(library.packings.end())};
  }

  template <int D> AnyState prepare_of(const Order &order)
  {
    return rve::generate_packing(order.recipe, *rve::make_engine<D>(order.options));
  }

  template <int D> std::vector<double> components(const rve::Tensor<double, D> &matrix)
  {
    return {std::begin(matrix.component), std::end(matrix.component)};
  }

  template <int D>
  std::vector<double> array_of(const rve::RveStateOf<D> &state, const std::string &name)
  {
    if (name == "cell") return components(state.cell);
    if (name == "deformation") return components(state.deformation);
    if (name == "radius") return state.radius;
    if (name == "position") return state.positions();
    if (name == "velocity") return state.velocity;
    if (name == "spin") return state.spin;
    throw rve::InputError("there is no array '" + name +
                          "'; there are cell, deformation, radius, position, velocity, spin");
  }

  template <int D> std::vector<double> contact_rows(const rve::RveStateOf<D> &state)
  {
    std::vector<double> table;
    for (const rve::SpringContactOf<D> &contact : rve::find_spring_contacts(state)) {
      table.push_back(contact.geometry.first);
      table.push_back(contact.geometry.second);
      for (int a = 0; a < D; ++a) table.push_back(contact.geometry.branch[a]);
      table.push_back(contact.geometry.overlap);
      table.push_back(contact.normal_force);
      for (int a = 0; a < D; ++a) table.push_back(contact.force_on_first[a]);
      table.push_back(contact.mobilized_friction >= rve::SLIDING ? 1.0 : 0.0);
    }
    return table;
  }

}    // namespace

AnyState read_state(const std::string &file)
{
  return rve::dimension_of_packing(file) == 3 ? read_state_of<3>(file) : read_state_of<2>(file);
}

std::vector<AnyState> read_states(const std::string &file)
{
  return rve::dimension_of_packing(file) == 3 ? read_states_of<3>(file) : read_states_of<2>(file);
}

AnyState prepare(const Order &order)
{
  return order.dimension == 3 ? prepare_of<3>(order) : prepare_of<2>(order);
}

std::vector<double> array_named(const AnyState &state, const std::string &name)
{
  return std::visit([&](const auto &one) { return array_of(one, name); }, state);
}

std::vector<double> contact_table(const AnyState &state)
{
  return std::visit([](const auto &one) { return contact_rows(one); }, state);
}

}    // namespace capi
