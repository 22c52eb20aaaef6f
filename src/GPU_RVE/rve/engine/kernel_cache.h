// SPDX-License-Identifier: GPL-2.0-only
// Compiled kernels on disk, for the next run and for the other ranks of this one.
//
// A file of the cache is code that a GPU runs in the name of the user. So the folder must belong to the user and be closed to
// others; another folder is not used, with a word why. A file is written whole or not at all (OutputFile). It has the key that it was
// written for and a checksum; where one of them is not as it should be, the kernel is compiled again.

#pragma once

#include "cuda/nvrtc.h"

#include <string>

namespace rve {

class KernelCache {
 public:
  /// Folder that GPU_RVE_KERNEL_CACHE names; "" if it says no. Without it gpu_rve/kernels in XDG_CACHE_HOME or in ~/.cache.
  static std::string chosen_folder();

  /// Makes the folder where there is none yet. "": no cache.
  explicit KernelCache(std::string folder);

  /// Why nothing is kept though it was asked for, or the last kernel was not; empty when all is well.
  const std::string &obstacle() const { return obstacle_; }

  /// Whether there is a sound file for the key: all that the code depends on, in words.
  bool load(const std::string &key, DeviceCode &kernel);

  void store(const std::string &key, const DeviceCode &kernel);

  /// While it lives, others that make one for the same key wait, at most for `seconds`: a process may hang, and a file system may have no
  /// locks. Those for other keys do not wait.
  class Turn {
   public:
    Turn(const KernelCache &cache, const std::string &key, double seconds = 300.0);
    ~Turn();
    Turn(const Turn &) = delete;
    Turn &operator=(const Turn &) = delete;
    bool is_mine() const { return is_mine_; }

   private:
    int descriptor_ = -1;
    bool is_mine_ = false;
  };

  /// Name of the file for a key, in the folder.
  static std::string file_name(const std::string &key);

 private:
  std::string folder_;    ///< empty: none is used
  std::string obstacle_;
};

}    // namespace rve
