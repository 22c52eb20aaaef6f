// SPDX-License-Identifier: GPL-2.0-only
// Compiled kernels on disk, for the next run and for the other ranks of this one.
//
// A file of the cache is code that a GPU runs in the name of the user. So the folder must belong to the user and be closed to others,
// its files too, neither may be a symbolic link, and all of this is asked of what is open, not of a name. What is not so is not
// used, with a word why. A file is written whole or not at all. It holds the key that it was written for and a checksum; where one of
// them is not as it should be, the kernel is compiled again.

#pragma once

#include "cuda/nvrtc.h"

#include <string>

namespace rve {

class KernelCache {
 public:
  /// What GPU_RVE_KERNEL_CACHE says: a folder, or no, and then there is none (""). Without it gpu_rve/kernels in XDG_CACHE_HOME or in ~/.cache.
  static std::string chosen_folder();

  /// Makes the folder where there is none yet. "": no cache.
  explicit KernelCache(const std::string &folder);
  ~KernelCache();
  KernelCache(const KernelCache &) = delete;
  KernelCache &operator=(const KernelCache &) = delete;

  /// Why nothing is kept though it was asked for, or the last kernel was not; empty when all is well.
  const std::string &obstacle() const { return obstacle_; }

  /// Whether there is a sound file for the key: all that the code depends on, in words.
  bool load(const std::string &key, DeviceCode &kernel);

  void store(const std::string &key, const DeviceCode &kernel);

  /// While it lives, others that make one for the same key wait, at most for `seconds`: a process may hang, and a file system may know no
  /// locks. Those for other keys do not wait.
  class Turn {
   public:
    Turn(const KernelCache &cache, const std::string &key, double seconds = 300.0);
    ~Turn();
    Turn(const Turn &) = delete;
    Turn &operator=(const Turn &) = delete;
    bool is_mine() const { return is_mine_; }

   private:
    int descriptor_;
    bool is_mine_ = false;
  };

  /// Of the file for a key, in the folder.
  static std::string file_name(const std::string &key);

 private:
  std::string folder_, obstacle_;
  int descriptor_ = -1;    ///< of the folder: a name may lead elsewhere the next time

  bool refuse(const std::string &why);
};

}    // namespace rve
