// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/kernel_cache.h"

#include "cuda/cuda_required.h"
#include "rve/core/checksum.h"
#include "rve/engine/files.h"

#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>
#include <utility>

namespace rve {

namespace {

  namespace fs = std::filesystem;

  /// Returns a hash as 16 hexadecimal digits.
  std::string hash_of(const std::string &text)
  {
    char digits[17];
    std::snprintf(digits, sizeof(digits), "%016llx",
                  static_cast<unsigned long long>(checksum_of(text.data(), text.size())));
    return digits;
  }

  /// Returns the reason why a folder cannot hold code that runs in the name of the user; empty if
  /// it can.
  std::string obstacle_of_folder(const std::string &folder)
  {
    struct stat status;
    if (::stat(folder.c_str(), &status) != 0) return ": " + reason_of(errno);
    if (!S_ISDIR(status.st_mode)) return ": " + reason_of(ENOTDIR);
    if (status.st_uid != ::geteuid())
      return " belongs to the user with ID " + std::to_string(status.st_uid);
    if ((status.st_mode & 0777) != 0700)
      return " is accessible to other users; run chmod 700 " + folder;
    return "";
  }

}    // namespace

std::string KernelCache::chosen_folder()
{
  if (const char *chosen = std::getenv("GPU_RVE_KERNEL_CACHE")) {
    const std::string folder = chosen;
    if (folder[0] == '/') return folder;
    bool wanted = false;
    try {
      wanted = says_yes("", folder);
    } catch (const InputError &) {
      throw InputError(
          "GPU_RVE_KERNEL_CACHE in the environment is '" + folder +
          "'; it must be the absolute path of a folder, or 0, false, no, off or empty");
    }
    if (!wanted) return "";
  }
  for (const auto &[name, below] :
       {std::pair{"XDG_CACHE_HOME", ""}, std::pair{"HOME", "/.cache"}}) {
    const char *folder = std::getenv(name);    // relative folders are ignored
    if (folder && folder[0] == '/') return std::string(folder) + below + "/gpu_rve/kernels";
  }
  return "";
}

KernelCache::KernelCache(std::string folder)
{
  while (folder.size() > 1 && folder.back() == '/') folder.pop_back();
  if (folder.empty()) return;
  std::error_code error;
  fs::create_directories(fs::path(folder).parent_path(), error);
  ::mkdir(folder.c_str(), 0700);
  const std::string obstacle = obstacle_of_folder(folder);
  if (obstacle.empty())
    folder_ = folder;
  else
    obstacle_ = folder + obstacle;
}

std::string KernelCache::file_name(const std::string &key)
{
  return hash_of(key) + ".kernel";
}

// A file contains, in this order: the hash of all bytes after it, the key, a byte 0, the name of
// the kernel, a byte 0, the code.

bool KernelCache::load(const std::string &key, DeviceCode &kernel)
{
  if (folder_.empty()) return false;
  const std::string path = folder_ + "/" + file_name(key);
  std::error_code error;
  if (!fs::exists(path, error)) return false;
  std::ifstream file(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  constexpr std::size_t digits = 16;
  if (text.size() < digits || text.substr(0, digits) != hash_of(text.substr(digits))) {
    obstacle_ = path + " is damaged";
    return false;
  }
  const std::size_t name = digits + key.size() + 1, end = text.find('\0', name);
  // The file can belong to another key with the same hash.
  if (text.compare(digits, key.size() + 1, key + '\0') != 0 || end == std::string::npos)
    return false;
  kernel.kernel = text.substr(name, end - name);
  kernel.code = text.substr(end + 1);
  return true;
}

void KernelCache::store(const std::string &key, const DeviceCode &kernel)
{
  if (folder_.empty()) return;
  obstacle_.clear();    // obstacle of an earlier load
  const std::string text = key + '\0' + kernel.kernel + '\0' + kernel.code;
  try {
    OutputFile(folder_ + "/" + file_name(key)).write(hash_of(text) + text);
  } catch (const InputError &error) {
    obstacle_ = error.what();
  }
}

}    // namespace rve
