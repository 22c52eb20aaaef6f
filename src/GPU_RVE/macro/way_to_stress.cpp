// SPDX-License-Identifier: GPL-2.0-only
#include "macro/way_to_stress.h"

namespace macro {

StressGoal StressGoal::at_rest(int vertical, double vertical_stress, double k0, bool lateral)
{
  StressGoal goal;
  for (int a = 0; a < 3; ++a) {
    goal.stress(a, a) = (a == vertical ? 1.0 : k0) * vertical_stress;
    for (int b = a; b < 3; ++b) goal.steered[a][b] = lateral || a != b || a == vertical;
  }
  return goal;
}

template <int D> StressGoal StressGoal::of(const rve::Tensor<double, D> &stress)
{
  StressGoal goal;
  for (int a = 0; a < D; ++a)
    for (int b = a; b < D; ++b) {
      goal.stress(a, b) = goal.stress(b, a) = stress(a, b);
      goal.steered[a][b] = true;
    }
  return goal;
}

template <int D> rve::DriveOf<D> WayToStress<D>::servo(const StressGoal &goal, int steps_per_call)
{
  rve::DriveOf<D> drive;
  drive.substeps = steps_per_call;
  for (int a = 0; a < D; ++a)
    for (int b = a; b < D; ++b) {
      drive.controlled[a][b] = goal.steered[a][b];
      drive.stress_goal(a, b) = goal.stress(a, b);
    }
  return drive;
}

template StressGoal StressGoal::of<2>(const rve::Tensor<double, 2> &);
template StressGoal StressGoal::of<3>(const rve::Tensor<double, 3> &);
template struct WayToStress<2>;
template struct WayToStress<3>;

}    // namespace macro
