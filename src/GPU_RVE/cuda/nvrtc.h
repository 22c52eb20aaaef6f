// SPDX-License-Identifier: GPL-2.0-only
// The run-time compiler of the CUDA Toolkit, libnvrtc: looked for when it is needed, so that no program depends on it. Needs no GPU.

#pragma once

#include <string>
#include <vector>

namespace rve {

/// A header as `#include` names it, and its text.
struct DeviceHeader {
  const char *name;
  const char *text;
};

struct DeviceCode {
  std::string kernel;    ///< the name that it has in the code
  /// Of the machine, for an architecture, or text (PTX) that the driver compiles.
  std::string code;
  std::string text;    ///< (PTX) that the code was made of, to look at; not kept in a cache
};

class Nvrtc {
 public:
  /// The first of these libraries that can be loaded, by names as dlopen takes them.
  explicit Nvrtc(const std::vector<std::string> &libraries);
  ~Nvrtc();
  Nvrtc(const Nvrtc &) = delete;
  Nvrtc &operator=(const Nvrtc &) = delete;

  /// Of the CUDA Toolkit that the program was built with, and newer and older ones; found once.
  static const Nvrtc &of_this_machine();

  /// Why there is none, with a remedy; empty when there is one.
  const std::string &obstacle() const { return obstacle_; }

  /// Which compiler it is: version, and size of its file, in which releases of a version differ.
  const std::string &identity() const { return identity_; }

  /// "sm_90": what the options shall ask for, so that a card of this compute capability (10 major + minor) can run it. Where the card
  /// is newer than the compiler, "compute_120", say: the newest text that its driver can compile. Throws std::runtime_error where
  /// there is neither.
  std::string target_for(int capability) const;

  /// Compiles the kernel that `kernel` names in C++. Throws std::runtime_error with the words of the compiler.
  DeviceCode compile(const std::string &source, const std::vector<DeviceHeader> &headers,
                     const std::vector<std::string> &options, const std::string &kernel) const;

 private:
  struct Functions;
  Functions *functions_;
  std::string obstacle_, identity_;
};

}    // namespace rve
