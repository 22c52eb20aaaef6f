// SPDX-License-Identifier: GPL-2.0-only
// Checks of prescribed motions, and their conversion to the records that the RVE kernel reads.

#pragma once

#include "rve/algorithm/device_state.h"
#include "rve/core/error.h"
#include "rve/engine/engine.h"
#include "rve/engine/finite_strain.h"
#include "rve/engine/increment_plan.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace rve {

/// Returns a list of tensor components such as "xx, xy and yy". If `below` is true, it contains the
/// components below the diagonal, otherwise all others.
template <int D> std::string components(bool below)
{
  std::string names;
  int left = Space<D>::strains - (below ? D : 0);
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b) {
      if ((b < a) != below) continue;
      names += {"xyz"[a], "xyz"[b]};
      if (--left > 0) names += left > 1 ? ", " : " and ";
    }
  return names;
}

/// Throws InputError with value, unit and range unless the prescribed motion is valid.
template <int D> void check(const DriveOf<D> &drive)
{
  require(drive.substeps >= 0, "substeps must be 0 or more, got ", drive.substeps);
  require(drive.substeps == 0 || (std::isfinite(drive.dt) && drive.dt > 0.0),
          "DEM time step must be positive and finite, got ", drive.dt, " [time]");
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < a; ++b)
      require(
          !drive.controlled[a][b], "the stress servo controls ",
          [] { return components<D>(false); }, "; component ", [] { return components<D>(true); },
          " cannot be controlled");
  require(drive.num_modes >= 0 && drive.num_modes <= Space<D>::strains &&
              (drive.num_modes == 0 || drive.modes),
          "number of servo modes must be 0 to ", Space<D>::strains, ", got ", drive.num_modes,
          drive.modes ? "" : " without their data");
  if (drive.has_servo()) {
    constexpr double smallest = 1e-30, largest = 1e30;    // derived numbers stay finite
    require(finite(drive.velocity_gradient),
            "velocity gradient has a component that is not a finite number [1/time]");
    require(finite(drive.stress_goal),
            "stress goal has a component that is not a finite number [stress]");
    require(drive.servo_gain >= smallest && drive.servo_gain <= largest,
            "servo gain must be positive, from 1e-30 to 1e30, got ", drive.servo_gain,
            " [1/(stress time^2)]");
    require(drive.servo_max_rate >= smallest && drive.servo_max_rate <= largest,
            "largest servo rate must be positive, from 1e-30 to 1e30, got ", drive.servo_max_rate,
            " [1/time]");
  } else {
    const Tensor<double, D> &f = drive.deformation;
    require(finite(f), "deformation increment has a component that is not a finite number");
    require(determinant(f) > 0.0, "determinant of the deformation increment must be positive, got ",
            determinant(f));
  }
}

/// Returns true if a prescribed motion needs a SteeringRecord: because it has a servo, or because
/// it rotates the RVE in several segments.
template <int D> bool needs_steering(const DriveOf<D> &drive)
{
  return drive.has_servo() || !turns_little(drive.deformation);
}

/// Returns true if F is so close to the identity that is_simple(F) must be true. Most increments
/// are. This test is faster than is_simple(), by two thirds on processors without fma. The sum of
/// each row of |F - 1| must be below a bound s. The diagonal of F is then dominant, so the
/// determinant is positive (Levy and Desplanques). The axial vector in turns_little() is then
/// shorter than D s, and the trace of F is above D (1 - s), so turns_little() is true.
template <int D> bool is_nearly_identity(const Tensor<double, D> &f)
{
  constexpr double small = 0.5 * LARGEST_TURN / (1.0 + LARGEST_TURN);
  bool is = true;
  for (int a = 0; a < D; ++a) {
    double row = 0.0;
    for (int b = 0; b < D; ++b) row += std::fabs(f(a, b) - (a == b ? 1.0 : 0.0));
    is &= row < small;
  }
  return is;
}

/// Returns true if the time step, the number of steps and the deformation are valid, and the path
/// has one segment. `AnyDrive` is an IncrementOf, or a DriveOf without a servo.
template <class AnyDrive> bool is_unsteered(const AnyDrive &drive)
{
  const bool has_time = drive.substeps == 0 ||
      (drive.substeps > 0 && std::isfinite(drive.dt) && drive.dt > 0.0);
  return has_time && (is_nearly_identity(drive.deformation) || is_simple(drive.deformation));
}

/// Returns true if check() would find no error and no SteeringRecord is needed. The test is quick,
/// and it is true for most prescribed motions.
template <int D> bool is_simple(const DriveOf<D> &drive)
{
  bool controls = drive.num_modes != 0;
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b) controls |= drive.controlled[a][b];
  return !controls && is_unsteered(drive);
}
template <int D> bool is_simple(const IncrementOf<D> &increment)
{
  return is_unsteered(increment);
}

/// Returns the record of a DriveOf or an IncrementOf whose path has one segment. The function is
/// fastest if the caller constructs the record in place (placement new).
template <int D, template <int> class AnyDrive> DriveRecord<D> to_record(const AnyDrive<D> &drive)
{
  DriveRecord<D> record = DriveRecord<D>();    // zeroes the padding too
  record.dt = drive.dt;
  record.substeps = drive.substeps;
  record.segments = 1;
  store_tensor(drive.deformation, record.deformation);
  return record;
}

/// Returns the number of segments of a path that rotates by this angle [rad]. A segment rotates by
/// at most LARGEST_TURN.
inline int path_segments(double angle)
{
  return std::max(1, static_cast<int>(std::ceil(std::fabs(angle) / LARGEST_TURN)));
}

/// Writes the path of the deformation F = R U into the records: the number of segments, the
/// rotation of a segment, and U - 1.
inline void split_path(const Tensor2 &f, DriveRecord<2> &record, SteeringRecord<2> &steering)
{
  const double angle = std::atan2(f(1, 0) - f(0, 1), f(0, 0) + f(1, 1));
  record.segments = path_segments(angle);
  store_tensor(plane_rotation(angle / record.segments), steering.rotation);
  store_tensor(plane_rotation(-angle) * f - Tensor2::identity(), steering.stretch);
}

inline void split_path(const Tensor3 &f, DriveRecord<3> &record, SteeringRecord<3> &steering)
{
  const PolarDecomposition polar(f);
  record.segments = path_segments(polar.angle);
  store_tensor(spatial_rotation((1.0 / record.segments) * polar.turn), steering.rotation);
  store_tensor(transpose(polar.rotation) * f - Tensor3::identity(), steering.stretch);
}

/// Returns the steering record of a prescribed motion. Without a servo it also sets the number of
/// segments in `record`.
template <int D> SteeringRecord<D> to_steering(const DriveOf<D> &drive, DriveRecord<D> &record)
{
  SteeringRecord<D> steering = SteeringRecord<D>();
  if (drive.has_servo()) {
    for (int a = 0; a < D; ++a)
      for (int b = 0; b < D; ++b) steering.controlled[D * a + b] = drive.controlled[a][b];
    store_tensor(drive.stress_goal, steering.stress_goal);
    store_tensor(drive.velocity_gradient, steering.velocity_gradient);
    steering.servo_gain = drive.servo_gain;
    steering.servo_max_rate = drive.servo_max_rate;
    return steering;
  }
  split_path(drive.deformation, record, steering);
  return steering;
}

/// Returns the servo modes of a prescribed motion in the form that the kernels read.
template <int D> SteeredModes<D> to_modes(const DriveOf<D> &drive)
{
  SteeredModes<D> modes = SteeredModes<D>();
  modes.count = drive.num_modes;
  modes.begin = drive.modes_begin;
  for (int k = 0; k < drive.num_modes; ++k) {
    const ServoModeOf<D> &from = drive.modes[k];
    SteeredMode<D> &to = modes.mode[k];
    store_tensor(from.rate, to.rate);
    store_tensor(from.dual, to.dual);
    store_tensor(from.stress, to.stress);
    to.goal = 0.0;
    for (int c = 0; c < Space<D>::components; ++c)
      to.goal += from.stress.component[c] * drive.stress_goal.component[c];
    to.gain = from.weight * drive.servo_gain;
    to.max_rate = drive.servo_max_rate;
  }
  return modes;
}

}    // namespace rve
