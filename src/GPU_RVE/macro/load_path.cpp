// SPDX-License-Identifier: GPL-2.0-only
#include "macro/load_path.h"

#include "rve/core/error.h"

#include <algorithm>
#include <cmath>

namespace macro {

namespace {

  /// Relative tolerance of a time limit [-]. It covers rounding errors in sums of time steps.
  constexpr double ROUNDING_OF_TIME = 1e-9;

  /// Component c of the strain of a path. F is upper triangular, because L is.
  template <int D> double strain_component(const rve::Tensor<double, D> &f, int c)
  {
    const int a = rve::strain_row<D>(c), b = rve::strain_column<D>(c);
    return a == b ? std::log(f(a, a)) : f(a, b) / f(b, b);
  }

  template <int D>
  double strain_sum(const rve::ComponentSum<D> &sum, const rve::Tensor<double, D> &f)
  {
    double strain = 0.0;
    for (int c = 0; c < rve::Space<D>::strains; ++c)
      if (sum[c] != 0.0) strain += sum[c] * strain_component<D>(f, c);
    return strain;
  }

}    // namespace

template <int D> void LoadPathsOf<D>::check(const PathState<D> &state) const
{
  rve::require(state.path >= 0 && state.path < size(), "it is on path ", state.path + 1,
               ", but the number of paths is ", size());
  rve::require(state.stage >= 0 && state.stage < num_stages(state.path), "it is in stage ",
               state.stage + 1, " of its path, but the number of stages is ",
               num_stages(state.path));
}

template <int D>
void LoadPathsOf<D>::begin(PathState<D> &state, int path, const Matrix &deformation) const
{
  state = PathState<D>();
  state.path = path;
  state.begin = deformation;
  check(state);
}

template <int D>
rve::DriveOf<D> LoadPathsOf<D>::drive(const PathState<D> &state, const PathStep &step,
                                      const double *script, const Matrix &deformation) const
{
  check(state);
  const Stage &stage = paths[state.path].stages[state.stage];
  const rve::ServoModesOf<D> &control = *stage.control;
  const double duration = step.dt * step.substeps;
  const auto finite = [&](double value, const Condition &condition) {
    rve::require(std::isfinite(value), "the value of ", condition.text, " in stage ",
                 state.stage + 1, " of its path is ", value, "; it must be a finite number");
    return value;
  };
  if (!stage.reversed.empty()) {
    const double low = stage.low.at(state.time + duration, script),
                 high = stage.high.at(state.time + duration, script);
    rve::require(low < high && std::isfinite(low) && std::isfinite(high),
                 "the limits that reverse stage ", state.stage + 1, " of its path are ", low,
                 " and ", high,
                 "; they must be finite numbers, the first one below the second one");
  }

  Matrix gradient = Matrix::zero();
  for (std::size_t k = 0; k < stage.motion.size(); ++k) {
    const Condition &condition = stage.motion[k];
    double rate;
    if (condition.of == Of::Rate)
      rate = state.direction * condition.value.at(state.time + 0.5 * duration, script);
    else
      rate = (condition.value.at(state.time + duration, script) -
              strain_sum<D>(condition.sum, deformation * rve::inverse(state.begin))) /
          duration;
    gradient = gradient + finite(rate, condition) * control.unit_rates[k];
  }
  if (stage.stresses.empty())
    return rve::DriveOf<D>::constant_velocity_gradient(gradient, step.dt, step.substeps);

  rve::DriveOf<D> drive;
  drive.dt = step.dt;
  drive.substeps = step.substeps;
  drive.velocity_gradient = gradient;
  for (std::size_t k = 0; k < stage.stresses.size(); ++k) {
    const Condition &condition = stage.stresses[k];
    const double goal = condition.value.at(state.time + duration, script);
    drive.stress_goal = drive.stress_goal + finite(goal, condition) * control.unit_stresses[k];
  }
  drive.servo_gain = step.servo_gain;
  drive.servo_max_rate = step.servo_max_rate;
  drive.modes = control.modes.data();
  drive.num_modes = static_cast<int>(control.modes.size());
  drive.modes_begin = !state.steered;
  return drive;
}

template <int D>
double LoadPathsOf<D>::measured(const Measure &measure, const PathState<D> &state,
                                const rve::ResultOf<D> &result)
{
  switch (measure.of) {
    case Of::Strain:
      return strain_sum<D>(measure.sum, result.deformation * rve::inverse(state.begin));
    case Of::Stress:
      return rve::sum_of<D>(measure.sum, result.stress);
    case Of::Ratio:
      return result.deviatoric_stress() / result.mean_stress();
    case Of::VoidRatio:
      return result.void_ratio;
    case Of::Cycles:
      return state.cycles();
    default:
      return state.time;
  }
}

template <int D>
void LoadPathsOf<D>::follow(PathState<D> &state, const PathStep &step,
                            const rve::ResultOf<D> &result, const double *script) const
{
  const Stage &stage = paths[state.path].stages[state.stage];
  state.time += step.dt * step.substeps;
  state.steered = !stage.stresses.empty();
  if (!stage.reversed.empty()) {
    const double now = measured(stage.reversed.front(), state, result);
    const int limit = now <= stage.low.at(state.time, script) ? -1
        : now >= stage.high.at(state.time, script)            ? 1
                                                              : 0;
    if (limit != 0 && limit != state.limit) {
      state.limit = limit;
      state.direction = -state.direction;
      ++state.reversals;
    }
  }
  if (has_event(state, result)) next_stage(state, result.deformation);
}

template <int D>
bool LoadPathsOf<D>::has_event(const PathState<D> &state, const rve::ResultOf<D> &result) const
{
  const Stage &stage = paths[state.path].stages[state.stage];
  return std::any_of(stage.events.begin(), stage.events.end(), [&](const Event &event) {
    const double now = measured(event.measure, state, result);
    const double slack = event.measure.of == Of::Time ? ROUNDING_OF_TIME * event.limit : 0.0;
    return event.below ? now <= event.limit : now >= event.limit - slack;
  });
}

template <int D>
void LoadPathsOf<D>::resume(PathState<D> &state, const rve::ResultOf<D> &result) const
{
  check(state);
  if (!state.ended) return;
  state.ended = 0;
  if (has_event(state, result)) next_stage(state, result.deformation);
}

template <int D>
void LoadPathsOf<D>::next_stage(PathState<D> &state, const Matrix &deformation) const
{
  const Stage &stage = paths[state.path].stages[state.stage];
  const bool again = state.rounds + 1 < stage.times;
  const int next = again ? stage.back_to : state.stage + 1;
  if (next == num_stages(state.path)) {    // resume() needs the present `rounds`
    state.ended = 1;
    return;
  }
  if (stage.times > 1) state.rounds = again ? state.rounds + 1 : 0;
  state.stage = next;
  state.direction = 1;
  state.limit = state.reversals = 0;
  state.time = 0.0;
  state.begin = deformation;
}

template class LoadPathsOf<2>;
template class LoadPathsOf<3>;

}    // namespace macro
