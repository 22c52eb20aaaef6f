// SPDX-License-Identifier: GPL-2.0-only
// Cache of compiled kernels on disk, for later runs and for the other ranks of this run.
//
// A file of the cache is code that a GPU runs in the name of the user. So the folder must belong to
// the user and be closed to others; another folder is not used, and obstacle() gives the reason. A
// file is written completely or not at all (OutputFile). A file contains its key and a checksum; if
// one of them does not match, the kernel is compiled again.

#pragma once

#include "cuda/nvrtc.h"

#include <string>

namespace rve {

class KernelCache {
 public:
  /// Returns the folder in GPU_RVE_KERNEL_CACHE; "" if that disables the cache. The default is
  /// gpu_rve/kernels in XDG_CACHE_HOME or in ~/.cache.
  static std::string chosen_folder();

  /// Makes the folder if it does not exist. "" means no cache.
  explicit KernelCache(std::string folder);

  /// Returns the reason why the cache is not used although requested, or why the last kernel was
  /// not stored; empty if there is none.
  const std::string &obstacle() const { return obstacle_; }

  /// Loads the kernel of a key, which is a text of everything that the code depends on. Returns
  /// false if there is no sound file.
  bool load(const std::string &key, DeviceCode &kernel);

  void store(const std::string &key, const DeviceCode &kernel);

  /// Lock on a key during its lifetime. Other objects with the same key wait, for at most
  /// `seconds`, since a process may hang and a file system may have no locks. Other keys are
  /// independent.
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

  /// Returns the name of the file for a key in the folder.
  static std::string file_name(const std::string &key);

 private:
  std::string folder_;    ///< empty: no cache
  std::string obstacle_;
};

}    // namespace rve
