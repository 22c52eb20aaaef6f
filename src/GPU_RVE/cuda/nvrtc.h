// SPDX-License-Identifier: GPL-2.0-only
// Run-time compiler of the CUDA Toolkit, libnvrtc. The library is loaded when it is first needed,
// so programs also run without it. Compilation needs no GPU.

#pragma once

#include <atomic>
#include <string>
#include <vector>

namespace rve {

/// Header file for the compiler: its name as in `#include`, and its text.
struct DeviceHeader {
  const char *name;
  const char *text;
};

struct DeviceCode {
  std::string kernel;    ///< mangled name of the kernel in `code`
  /// Binary for an architecture, or PTX that the driver compiles.
  std::string code;
  std::string text;    ///< PTX of the code, for inspection; the kernel cache does not store it
};

class Nvrtc {
 public:
  /// Loads the first available one of these libraries, with names as in dlopen.
  explicit Nvrtc(const std::vector<std::string> &libraries);
  ~Nvrtc();
  Nvrtc(const Nvrtc &) = delete;
  Nvrtc &operator=(const Nvrtc &) = delete;

  /// Returns the compiler of this machine: the library of the CUDA version of the build if it is
  /// installed, else the library of another version. The library is searched for once in a process.
  static const Nvrtc &of_this_machine();

  /// Returns the reason why there is no library, with a remedy; empty if there is one.
  const std::string &obstacle() const { return obstacle_; }

  /// Returns a text with the version of the compiler and the size of its file. The size differs
  /// between releases of the same version.
  const std::string &identity() const { return identity_; }

  /// Returns the value of the option --gpu-architecture for GPUs of this compute capability (10
  /// major + minor), such as "sm_90". If the compiler does not support these GPUs, the function
  /// returns the newest older architecture in the form that requests PTX, such as "compute_120";
  /// the driver compiles the PTX. Throws std::runtime_error if the compiler supports no
  /// architecture up to `capability`.
  std::string target_for(int capability) const;

  /// Returns true if the compiler has the option --Ofast-compile (CUDA 13 and newer).
  bool has_fast_compilation() const { return major_ >= 13; }

  /// Compiles the kernel with the C++ name `kernel`. Throws std::runtime_error with the message of
  /// the compiler, or if another thread sets `cancelled`. Several threads can compile at once.
  DeviceCode compile(const std::string &source, const std::vector<DeviceHeader> &headers,
                     const std::vector<std::string> &options, const std::string &kernel,
                     const std::atomic<bool> *cancelled = nullptr) const;

 private:
  struct Functions;
  Functions *functions_;
  std::string obstacle_, identity_;
  int major_ = 0;    ///< of the version
};

}    // namespace rve
