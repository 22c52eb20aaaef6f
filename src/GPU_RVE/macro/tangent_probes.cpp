// SPDX-License-Identifier: GPL-2.0-only
#include "macro/tangent_probes.h"

#include "rve/core/error.h"
#include "rve/engine/finite_strain.h"
#include "rve/engine/servo_modes.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace macro {

namespace {

  /// Ratio of the time step to the stability bound [-]. Contacts can stiffen while a clone is
  /// strained.
  constexpr double TIME_STEP_SHARE = 0.8;

  /// If the unbalanced forces have not halved after this number of checks, they count as rounding
  /// errors.
  constexpr int CHECKS_WITHOUT_PROGRESS = 4;

  /// Share of the free memory for clones.
  constexpr double MEMORY_SHARE = 0.5;

  /// Coefficient of friction that prevents all sliding [-]. It is small enough for normal and
  /// tangential forces to have digits in common.
  constexpr double STICKING = 1e8;

  /// Strain k of Mandel's orthonormal basis of symmetric tensors, in the order of TangentOf.
  template <int D> rve::Tensor<double, D> basis_strain(int k)
  {
    const int a = rve::strain_row<D>(k), b = rve::strain_column<D>(k);
    auto strain = rve::Tensor<double, D>::zero();
    strain(a, b) = strain(b, a) = a == b ? 1.0 : std::sqrt(0.5);
    return strain;
  }

  template <int D> rve::Tensor<double, D> symmetric_part(const rve::Tensor<double, D> &a)
  {
    return 0.5 * (a + rve::transpose(a));
  }

  /// Material with all nonzero coefficients of friction set to STICKING.
  rve::Material sticking(rve::Material material)
  {
    for (double *coefficient :
         {&material.friction, &material.rolling_friction, &material.twisting_friction})
      if (*coefficient > 0.0) *coefficient = STICKING;
    return material;
  }

}    // namespace

TangentOptions TangentOptions::of(rve::Format format, TangentKind kind)
{
  TangentOptions options;
  options.kind = kind;
  if (kind == TangentKind::Loading) {
    options.probe = 2e-2;
    options.lead = 0.1;
    options.strain_steps = 1000;
    return options;
  }
  options.probe = format == rve::Format::Double ? 1e-4 : format == rve::Format::Mixed ? 1e-3 : 1e-2;
  return options;
}

void TangentOptions::check(const std::string &what) const
{
  const auto require = [&](bool holds, const char *name, double value, const char *range) {
    rve::require(holds, [&] {
      return what + ": " + name + " is " + rve::number(value) + "; it must be " + range;
    });
  };
  require(probe > 0.0 && probe <= 0.5, "probe", probe,
          "above 0 and at most 0.5 [-], of the mean overlap");
  require(lead >= 0.0 && lead <= 10.0, "lead", lead,
          "at least 0 and at most 10 [-], of the mean overlap");
  require(spread > 0.0 && spread <= 0.5, "spread", spread, "above 0 and at most 0.5 [-]");
  require(strain_steps > 0, "strain_steps", strain_steps, "at least 1 DEM step");
  require(lead_steps > 0, "lead_steps", lead_steps, "at least 1 DEM step");
  require(look_steps > 0, "look_steps", look_steps, "at least 1 DEM step");
  require(most_steps > 0, "most_steps", most_steps, "at least 1 DEM step");
  require(tolerance > 0.0 && tolerance < 1.0, "tolerance", tolerance, "above 0 and below 1 [-]");
  require(damping >= 0.0 && damping < 1.0, "damping", damping, "at least 0 and below 1 [-]");
}

template <int D> struct TangentProbesOf<D>::Group {
  ProbedTangentOf<D> answer;
  double dt = 0.0;                ///< [time]
  std::vector<int> numbers;       ///< numbers of clones in the engine; empty: the group has failed
  std::vector<Matrix> strains;    ///< strains of these clones
  std::vector<rve::ResultOf<D>> results;    ///< last results of these clones
  int contacts = 0;                         ///< number of contacts of the RVE at rest
  double overlap = 0.0;    ///< mean overlap over the sum of radii of the RVE at rest [-]
  double step = 0.0;       ///< strains +step and -step give a column of the tangent [-]
  double least_unrest = 0.0;
  int checks = 0;    ///< number of checks since unrest was halved

  bool has_failed() const { return numbers.empty(); }
};

template <int D>
TangentProbesOf<D>::TangentProbesOf(std::unique_ptr<rve::EngineOf<D>> _engine,
                                    const TangentOptions &_options) :
    engine(std::move(_engine)),
    options(_options)
{
  options.check("tangent");
}

/// Advances the clones of groups by `steps` DEM steps, strained by Group::strains if `strained`.
template <int D>
void TangentProbesOf<D>::advance(const std::vector<Group *> &groups, int steps, bool strained)
{
  std::vector<int> numbers;
  std::vector<rve::DriveOf<D>> drives;
  for (const Group *group : groups)
    for (std::size_t k = 0; k < group->numbers.size(); ++k) {
      const Matrix rate = strained ? (1.0 / (steps * group->dt)) * group->strains[k]
                                   : Matrix::zero();
      numbers.push_back(group->numbers[k]);
      drives.push_back(rve::DriveOf<D>::constant_velocity_gradient(rate, group->dt, steps));
    }
  if (numbers.empty()) return;
  std::vector<rve::ResultOf<D>> results;
  engine->advance(numbers, drives, results);
  auto result = results.begin();
  for (Group *group : groups) {
    group->results.assign(result, result + group->numbers.size());
    result += group->numbers.size();
    group->answer.steps += steps;
    for (const auto &one : group->results) group->answer.status |= one.status;
    if (group->answer.status & rve::status::Fatal) drop(*group);
  }
}

template <int D> void TangentProbesOf<D>::drop(Group &group)
{
  for (const int number : group.numbers) engine->remove(number);
  group.numbers.clear();
}

/// Advances groups until the clones of every group are at rest or have made `most_steps` DEM steps.
/// The number of steps of a group does not depend on the other groups.
template <int D> void TangentProbesOf<D>::come_to_rest(std::vector<Group> &groups)
{
  std::vector<Group *> moving;
  for (Group &group : groups) {
    group.least_unrest = std::numeric_limits<double>::infinity();
    group.checks = 0;
    if (!group.has_failed()) moving.push_back(&group);
  }
  for (int steps = 0; steps < options.most_steps && !moving.empty(); steps += options.look_steps) {
    advance(moving, options.look_steps, false);
    const auto is_done = [&](Group *group) {
      if (group->has_failed()) return true;
      double unrest = 0.0;
      for (const auto &result : group->results)
        unrest = std::max(unrest, result.unbalanced_ratio / options.probe);
      group->answer.unrest = unrest;
      ++group->checks;
      if (unrest < 0.5 * group->least_unrest) {
        group->least_unrest = unrest;
        group->checks = 0;
      }
      return unrest <= options.tolerance || group->checks >= CHECKS_WITHOUT_PROGRESS;
    };
    moving.erase(std::remove_if(moving.begin(), moving.end(), is_done), moving.end());
  }
}

template <int D> void TangentProbesOf<D>::strain_and_rest(std::vector<Group> &groups, int steps)
{
  std::vector<Group *> all;
  for (Group &group : groups)
    if (!group.has_failed()) all.push_back(&group);
  advance(all, steps, true);
  come_to_rest(groups);
}

/// Adds one clone of the RVE. The clone has zero velocities, because the velocities of the RVE
/// belong to its straining.
template <int D> void TangentProbesOf<D>::begin(Group &group, State state)
{
  state.material.local_damping = options.damping;
  std::fill(state.velocity.begin(), state.velocity.end(), 0.0);
  std::fill(state.spin.begin(), state.spin.end(), 0.0);
  group.numbers = {engine->add(state)};
  std::vector<double> bounds;
  engine->bound_time_steps(group.numbers, std::numeric_limits<double>::max(), bounds);
  group.dt = bounds[0] > 0.0 ? TIME_STEP_SHARE * bounds[0] : 1.0;
}

/// Replaces the clone at rest by one clone for each strain.
template <int D> void TangentProbesOf<D>::multiply(Group &group)
{
  if (group.has_failed()) return;
  const rve::ResultOf<D> &result = group.results[0];
  group.answer.stress = symmetric_part(result.stress);
  group.contacts = result.num_contacts;
  group.overlap = result.mean_overlap;
  State state = engine->state(group.numbers[0]);
  drop(group);
  const double size = options.probe * group.overlap;
  const bool is_elastic = options.kind == TangentKind::Elastic;
  if (is_elastic) state.material = sticking(state.material);
  const Matrix middle = is_elastic ? Matrix::zero() : size * group.answer.strain_rate;
  group.step = is_elastic ? size : options.spread * size;
  group.strains.clear();
  for (int k = 0; k < rve::Space<D>::strains; ++k)
    for (const double sign : {1.0, -1.0})
      group.strains.push_back(middle + (sign * group.step) * basis_strain<D>(k));
  if (!is_elastic) group.strains.push_back(middle);
  for (std::size_t k = 0; k < group.strains.size(); ++k)
    group.numbers.push_back(engine->add(state));
}

template <int D> void TangentProbesOf<D>::evaluate(Group &group) const
{
  if (group.has_failed()) return;
  ProbedTangentOf<D> &answer = group.answer;
  answer.is_measured = true;
  if (!(group.step > 0.0)) return;    // without contacts there is no stiffness
  const bool is_elastic = options.kind == TangentKind::Elastic;
  for (const auto &result : group.results)
    answer.changed_contacts =
        std::max(answer.changed_contacts, std::abs(result.num_contacts - group.contacts));
  const auto stress = [&](std::size_t k) { return symmetric_part(group.results[k].stress); };
  for (int k = 0; k < rve::Space<D>::strains; ++k) {
    const Matrix difference = stress(2 * k) - stress(2 * k + 1);
    // a basis strain off the diagonal has the engineering strain sqrt(2)
    const double per_strain = 0.5 / group.step / (k < D ? 1.0 : std::sqrt(2.0));
    for (int a = 0; a < D; ++a)
      for (int b = a; b < D; ++b)
        answer.tangent.component[TangentOf<D>::index(a, b)][k] = per_strain * difference(a, b);
    const double size = rve::norm(difference);
    if (is_elastic && size > 0.0)
      answer.nonlinearity =
          std::max(answer.nonlinearity,
                   rve::norm(stress(2 * k) + stress(2 * k + 1) - 2.0 * answer.stress) / size);
  }
  if (!std::isfinite(answer.tangent.norm())) {
    answer = {};
    return;
  }
  answer.response = answer.tangent(answer.strain_rate);
  if (is_elastic) return;
  const Matrix along =
      (1.0 / (options.probe * group.overlap)) * (stress(group.results.size() - 1) - answer.stress);
  const double size = rve::norm(along);
  if (size > 0.0) answer.nonlinearity = rve::norm(answer.response - along) / size;
  answer.response = along;
}

/// Strains clones along the present direction of straining. Contacts that slid in the RVE left the
/// limit of friction while the clone came to rest. This strain brings them back to the limit.
template <int D> void TangentProbesOf<D>::strain_along(std::vector<Group> &groups)
{
  for (Group &group : groups)
    if (!group.has_failed())
      group.strains = {(options.lead * group.results[0].mean_overlap) * group.answer.strain_rate};
  strain_and_rest(groups, options.lead_steps);
}

template <int D> void TangentProbesOf<D>::probe_portion(std::vector<Group> &groups)
{
  come_to_rest(groups);
  if (options.kind == TangentKind::Loading && options.lead > 0.0) strain_along(groups);
  for (Group &group : groups) multiply(group);
  strain_and_rest(groups, options.strain_steps);
  for (Group &group : groups) {
    evaluate(group);
    drop(group);
  }
}

template <int D>
std::vector<ProbedTangentOf<D>>
TangentProbesOf<D>::probe(int count, const std::function<State(int)> &state,
                          const std::function<Matrix(int)> &strain_rate)
{
  std::vector<ProbedTangentOf<D>> answers;
  std::vector<Group> groups;
  const rve::Memory memory = engine->memory();
  double bytes = 0.0;
  const auto finish = [&] {
    probe_portion(groups);
    for (const Group &group : groups) answers.push_back(group.answer);
    groups.clear();
    bytes = 0.0;
  };
  for (int k = 0; k < count; ++k) {
    const State one = state(k);
    const double needed = (2.0 * rve::Space<D>::strains + 1.0) *
        static_cast<double>(engine->bytes_per_rve(one.num_grains()));
    if (memory.is_known && !groups.empty() &&
        bytes + needed > MEMORY_SHARE * static_cast<double>(memory.free))
      finish();
    bytes += needed;
    groups.emplace_back();
    const Matrix rate = symmetric_part(strain_rate(k));
    const double size = rve::norm(rate);
    if (size > 0.0) groups.back().answer.strain_rate = (1.0 / size) * rate;
    if (size > 0.0 || options.kind == TangentKind::Elastic) begin(groups.back(), one);
  }
  finish();
  return answers;
}

template class TangentProbesOf<2>;
template class TangentProbesOf<3>;

}    // namespace macro
