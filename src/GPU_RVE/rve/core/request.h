// SPDX-License-Identifier: GPL-2.0-only
// Handle of an asynchronous advance of RVEs.
//
// The engine creates it, and RvePoints, fix rve, the constitutive law and the solver of the MPM
// pass it on unchanged. Each of these four has one function that begins a request and one that
// finishes it.

#pragma once

#include <cstdint>

namespace rve {

/// Location of the stresses of a finished advance. For several advances together, the largest of
/// their values is used.
enum class StressesAre {
  OnDevice,          ///< in the arrays of the device; the host did nothing
  OnDeviceByHost,    ///< in the arrays of the device; the host had to repeat some RVEs
  OnHost             ///< in the arrays of the host
};

/// A request of an engine. An engine has one request at a time, which is valid until the engine
/// begins the next request.
class Request {
 public:
  virtual ~Request() = default;

  /// Launches a planned call before the host has read the plan, if the host will most likely not be
  /// needed. If the host is needed nevertheless, launch() undoes the early launch. Returns true if
  /// it has launched the call.
  virtual bool launch_early() { return false; }
  /// Reads the plan and launches the call, unless launch_early() has launched it. The device must
  /// have been synchronised after the plan. Returns false if some RVEs need the host. No RVE has
  /// then moved, and the request is void.
  virtual bool launch() { return true; }
  /// Returns the address of a flag in device memory, or null if there is no flag. The flag is above
  /// zero if the call has ended and the host must repeat some RVEs. Kernels that are launched after
  /// the call read it.
  virtual const std::int32_t *needs_host() const { return nullptr; }
  /// Waits until the call has ended, and returns where its stresses are. A second fetch() returns
  /// the same value.
  StressesAre fetch()
  {
    if (is_running_) {
      is_running_ = false;
      stresses_are_ = wait();
    }
    return stresses_are_;
  }
  /// True from the launch until the results have been fetched.
  bool is_running() const { return is_running_; }

 protected:
  virtual StressesAre wait() = 0;
  void note_launch()
  {
    is_running_ = true;
    stresses_are_ = StressesAre::OnHost;
  }
  /// Marks a new request that is not launched yet.
  void note_plan() { is_running_ = false; }

 private:
  bool is_running_ = false;
  StressesAre stresses_are_ = StressesAre::OnHost;
};

}    // namespace rve
