// SPDX-License-Identifier: GPL-2.0-only
// Cache of compiled kernels on disk. Later runs find the kernels there. CUDA has no such cache for
// NVRTC: its own cache (CUDA_CACHE_PATH) holds only what the driver compiles from PTX.
//
// A file of the cache is code that a GPU runs in the name of the user. So the folder must belong to
// the user, and other users must have no access to it. A folder with another owner or mode is not
// used, and obstacle() gives the reason. A file is written completely or not at all (OutputFile).
// It contains the key of the kernel and a checksum; if one of them does not match, the kernel is
// compiled again.

#pragma once

#include "cuda/nvrtc.h"

#include <string>

namespace rve {

class KernelCache {
 public:
  /// Returns the folder in the environment variable GPU_RVE_KERNEL_CACHE; "" if the variable
  /// disables the cache. The default is gpu_rve/kernels in XDG_CACHE_HOME or in ~/.cache. Throws
  /// InputError if the variable is neither an absolute path nor a word such as 0, no or off.
  static std::string chosen_folder();

  /// Creates the folder if it does not exist. "" disables the cache.
  explicit KernelCache(std::string folder);

  /// Returns the last problem: the reason why the folder is not used, a damaged file, or the reason
  /// why the last kernel was not stored. Empty if there is no problem.
  const std::string &obstacle() const { return obstacle_; }

  /// Loads the kernel of a key. The key is a text that contains everything that the code depends
  /// on. Returns false if the cache has no valid file for the key.
  bool load(const std::string &key, DeviceCode &kernel);

  void store(const std::string &key, const DeviceCode &kernel);

  /// Returns the name of the file for a key in the folder.
  static std::string file_name(const std::string &key);

 private:
  std::string folder_;    ///< empty: no cache
  std::string obstacle_;
};

}    // namespace rve
