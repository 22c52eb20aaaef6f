#include "rve/engine/drive_record.h"

#include "rve/core/error.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace rve {

namespace {
  /// Segments of a macro increment that rotates by `angle`: at most 0.01 rad each, so that the chord through the rotation
  /// loses at most 2.5e-5 of the area on its way.
  constexpr double LARGEST_TURN = 0.01;
  int path_segments(double angle)
  {
    return std::max(1, static_cast<int>(std::ceil(std::fabs(angle) / LARGEST_TURN)));
  }

  /// Of the settings of a servo: what follows from them are numbers.
  constexpr double SMALLEST = 1e-30, LARGEST = 1e30;

}    // namespace

void check(const Drive &drive)
{
  require(drive.substeps >= 0, [&] {
    return "substeps must be 0 or more, got " + std::to_string(drive.substeps);
  });
  require(drive.substeps == 0 || (std::isfinite(drive.dt) && drive.dt > 0.0), [&] {
    return "DEM time step must be positive and finite, got " + number(drive.dt) + " [time]";
  });
  require(!drive.controlled[1][0],
          "the stress servo controls xx, xy and yy; component yx cannot be controlled");
  if (drive.has_servo()) {
    require(finite(drive.velocity_gradient),
            "velocity gradient has a component that is not a finite number [1/time]");
    require(finite(drive.stress_goal),
            "stress goal has a component that is not a finite number [stress]");
    require(drive.servo_gain >= SMALLEST && drive.servo_gain <= LARGEST, [&] {
      return "servo gain must be positive, from 1e-30 to 1e30, got " + number(drive.servo_gain) +
          " [1/(stress time^2)]";
    });
    require(drive.servo_max_rate >= SMALLEST && drive.servo_max_rate <= LARGEST, [&] {
      return "largest servo rate must be positive, from 1e-30 to 1e30, got " +
          number(drive.servo_max_rate) + " [1/time]";
    });
  } else {
    const Tensor2 &f = drive.deformation;
    require(finite(f), "deformation increment has a component that is not a finite number");
    require(determinant(f) > 0.0, [&] {
      return "deformation increment must keep a positive area, its determinant is " +
          number(determinant(f));
    });
  }
}

bool needs_steering(const Drive &drive)
{
  const Tensor2 &f = drive.deformation;
  const double twice_cosine = f(0, 0) + f(1, 1), twice_sine = f(1, 0) - f(0, 1);
  return drive.has_servo() || !(std::fabs(twice_sine) < LARGEST_TURN * twice_cosine);
}

DriveRecord<2> to_record(const Drive &drive)
{
  DriveRecord<2> record;
  record.dt = drive.dt;
  record.substeps = drive.substeps;
  record.segments = 1;
  store_tensor(drive.deformation, record.deformation);
  return record;
}

SteeringRecord<2> to_steering(const Drive &drive, DriveRecord<2> &record)
{
  SteeringRecord<2> steering = SteeringRecord<2>();
  if (drive.has_servo()) {
    for (int a = 0; a < 2; ++a)
      for (int b = 0; b < 2; ++b) steering.controlled[2 * a + b] = drive.controlled[a][b];
    store_tensor(drive.stress_goal, steering.stress_goal);
    store_tensor(drive.velocity_gradient, steering.velocity_gradient);
    steering.servo_gain = drive.servo_gain;
    steering.servo_max_rate = drive.servo_max_rate;
    return steering;
  }
  // polar decomposition F = R U in the plane
  const Tensor2 &f = drive.deformation;
  const double angle = std::atan2(f(1, 0) - f(0, 1), f(0, 0) + f(1, 1));
  record.segments = path_segments(angle);
  Tensor2 rotation = Tensor2::identity(), back;
  const double part = angle / record.segments;
  rotation(0, 0) = rotation(1, 1) = std::cos(part);
  rotation(1, 0) = std::sin(part);
  rotation(0, 1) = -rotation(1, 0);
  back(0, 0) = back(1, 1) = std::cos(angle);
  back(0, 1) = std::sin(angle);
  back(1, 0) = -back(0, 1);
  store_tensor(rotation, steering.rotation);
  store_tensor(back * f - Tensor2::identity(), steering.stretch);
  return steering;
}

}    // namespace rve
