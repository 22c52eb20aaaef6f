// Stress servo: steers components of the velocity gradient until the stress meets its goal.

#ifndef RVE_ALGORITHM_STRESS_SERVO_H
#define RVE_ALGORITHM_STRESS_SERVO_H

#include "rve/core/tensor.h"

#include <cmath>

namespace rve {
inline namespace RVE_ISA {

  /// New value of a controlled component of L [1/time]: L + (1 - g s) gain dt (goal - stress), g = 0.25 and s the sign of
  /// L (goal - stress), which lets the rate grow more slowly than it falls (the controller of SudoDEM's and YADE's periodic
  /// triaxial test). Stress tension positive.
  RVE_INLINE double steer_rate(double rate, double stress, double goal, double gain, double dt,
                               double max_rate)
  {
    const double growth_damping = 0.25;
    const double error = goal - stress;
    const double direction = rate * error;
    const double sign = direction > 0.0 ? 1.0 : (direction < 0.0 ? -1.0 : 0.0);
    const double steered = rate + (1.0 - growth_damping * sign) * gain * dt * error;
    return steered > max_rate ? max_rate : (steered < -max_rate ? -max_rate : steered);
  }

}    // namespace RVE_ISA
}    // namespace rve

#endif
