// SPDX-License-Identifier: GPL-2.0-only
#include "cuda/kernel_cache.h"

#include "cuda/cuda_required.h"
#include "rve/core/checksum.h"
#include "rve/core/wall_time.h"

#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <sys/stat.h>
#include <system_error>
#include <thread>
#include <type_traits>
#include <unistd.h>

namespace rve {

namespace {

  constexpr mode_t FOR_NOBODY_ELSE = 0700;
  /// 256 MiB [bytes]; kernels have less than one.
  constexpr std::size_t LARGEST_FILE = std::size_t(256) << 20;

  /// At the beginning of a file; behind it key, name and code.
  struct FileHead {
    char mark[16];
    std::uint64_t key_size, name_size, code_size;
    std::uint64_t checksum;    ///< of what lies behind
  };
  static_assert(std::has_unique_object_representations_v<FileHead>, "it is copied as bytes");
  constexpr char MARK[16] = "GPU_RVE kernel\n";

  std::string reason_of(int error)
  {
    return std::generic_category().message(error);
  }

  class Descriptor {
   public:
    explicit Descriptor(int number_in) : number(number_in) {}
    ~Descriptor()
    {
      if (number >= 0) ::close(number);
    }
    Descriptor(const Descriptor &) = delete;
    Descriptor &operator=(const Descriptor &) = delete;
    /// Returns 0 or an error number.
    int close()
    {
      const int result = ::close(number);
      number = -1;
      return result == 0 ? 0 : errno;
    }
    int number;
  };

  /// Returns 0 or an error number.
  int read_all(int descriptor, char *to, std::size_t size)
  {
    while (size > 0) {
      const ssize_t count = ::read(descriptor, to, size);
      if (count < 0 && errno == EINTR) continue;
      if (count < 0) return errno;
      if (count == 0) return EIO;
      to += count;
      size -= static_cast<std::size_t>(count);
    }
    return 0;
  }

  int write_all(int descriptor, const char *from, std::size_t size)
  {
    while (size > 0) {
      const ssize_t count = ::write(descriptor, from, size);
      if (count < 0 && errno == EINTR) continue;
      if (count < 0) return errno;
      from += count;
      size -= static_cast<std::size_t>(count);
    }
    return 0;
  }

  /// What is wrong with an open file of the cache, "" if nothing is.
  std::string trouble_of_file(const struct stat &file)
  {
    if (!S_ISREG(file.st_mode)) return "is no file";
    if (file.st_uid != ::geteuid())
      return "belongs to the user with the number " + std::to_string(file.st_uid);
    if (file.st_mode & (S_IWGRP | S_IWOTH)) return "can be written by others";
    return "";
  }

  /// A folder and those above it.
  void make_folders(const std::string &folder)
  {
    for (std::size_t end = folder.find('/', 1); end != std::string::npos;
         end = folder.find('/', end + 1))
      ::mkdir(folder.substr(0, end).c_str(), FOR_NOBODY_ELSE);
    ::mkdir(folder.c_str(), FOR_NOBODY_ELSE);
  }

  std::string in_hexadecimal(std::uint64_t number)
  {
    std::string text;
    for (int shift = 60; shift >= 0; shift -= 4) text += "0123456789abcdef"[number >> shift & 15];
    return text;
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
          "'; it must be a folder whose name begins with /, or 0, false, no, off or empty");
    }
    if (!wanted) return "";
  }
  const auto absolute = [](const char *name) {
    const char *folder = std::getenv(name);
    return std::string(folder && folder[0] == '/' ? folder : "");    // others are to be ignored
  };
  const std::string xdg = absolute("XDG_CACHE_HOME"), home = absolute("HOME");
  if (!xdg.empty()) return xdg + "/gpu_rve/kernels";
  return home.empty() ? "" : home + "/.cache/gpu_rve/kernels";
}

KernelCache::KernelCache(const std::string &folder) : folder_(folder)
{
  while (folder_.size() > 1 && folder_.back() == '/') folder_.pop_back();
  if (folder_.empty()) return;
  make_folders(folder_);
  Descriptor open(::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
  const int error = errno;
  struct stat status;
  if (open.number < 0) {
    const bool is_link = ::lstat(folder_.c_str(), &status) == 0 && S_ISLNK(status.st_mode);
    refuse(is_link ? " is a symbolic link" : ": " + reason_of(error));
  } else if (::fstat(open.number, &status) != 0) {
    refuse(": " + reason_of(errno));
  } else if (status.st_uid != ::geteuid()) {
    refuse(" belongs to the user with the number " + std::to_string(status.st_uid));
  } else if ((status.st_mode & 0777) != FOR_NOBODY_ELSE) {
    refuse(" is open to others: chmod 700 " + folder_);
  } else {
    descriptor_ = open.number;
    open.number = -1;
  }
}

KernelCache::~KernelCache()
{
  if (descriptor_ >= 0) ::close(descriptor_);
}

bool KernelCache::refuse(const std::string &why)
{
  obstacle_ = folder_ + why;
  return false;
}

std::string KernelCache::file_name(const std::string &key)
{
  return in_hexadecimal(checksum_of(key.data(), key.size())) + ".kernel";
}

bool KernelCache::load(const std::string &key, DeviceCode &kernel)
{
  if (descriptor_ < 0) return false;
  const std::string name = file_name(key);
  // without waiting, should it be a fifo
  const Descriptor open(
      ::openat(descriptor_, name.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
  if (open.number < 0)
    return errno == ENOENT ? false : refuse("/" + name + ": " + reason_of(errno));
  struct stat status;
  if (::fstat(open.number, &status) != 0) return refuse("/" + name + ": " + reason_of(errno));
  const std::string trouble = trouble_of_file(status);
  if (!trouble.empty()) return refuse("/" + name + " " + trouble);

  FileHead head;
  const auto size = static_cast<std::size_t>(status.st_size);
  if (size < sizeof(head) || size > LARGEST_FILE) return refuse("/" + name + " is damaged");
  std::string text(size - sizeof(head), '\0');
  int error = read_all(open.number, reinterpret_cast<char *>(&head), sizeof(head));
  if (!error) error = read_all(open.number, &text[0], text.size());
  if (error) return refuse("/" + name + ": " + reason_of(error));
  if (std::memcmp(head.mark, MARK, sizeof(MARK)) != 0 || head.key_size > text.size() ||
      head.name_size > text.size() || head.code_size > text.size() ||
      head.key_size + head.name_size + head.code_size != text.size() ||
      head.checksum != checksum_of(text.data(), text.size()))
    return refuse("/" + name + " is damaged");
  // another one with the same hash
  if (text.compare(0, head.key_size, key) != 0) return false;
  kernel.kernel = text.substr(head.key_size, head.name_size);
  kernel.code = text.substr(head.key_size + head.name_size);
  return true;
}

void KernelCache::store(const std::string &key, const DeviceCode &kernel)
{
  if (descriptor_ < 0) return;
  obstacle_.clear();    // of what was there before
  const std::string text = key + kernel.kernel + kernel.code;
  FileHead head = {};
  std::memcpy(head.mark, MARK, sizeof(MARK));
  head.key_size = key.size();
  head.name_size = kernel.kernel.size();
  head.code_size = kernel.code.size();
  head.checksum = checksum_of(text.data(), text.size());

  const std::string name = file_name(key);
  // ranks on other machines may have the same number
  char machine[256] = "";
  ::gethostname(machine, sizeof(machine) - 1);
  const std::string part = name + ".part" + std::to_string(::getpid()) + machine;
  ::unlinkat(descriptor_, part.c_str(), 0);    // of a process that had this number and was killed
  Descriptor open(::openat(descriptor_, part.c_str(),
                           O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600));
  if (open.number < 0) {
    refuse("/" + part + ": " + reason_of(errno));
    return;
  }
  int error = write_all(open.number, reinterpret_cast<const char *>(&head), sizeof(head));
  if (!error) error = write_all(open.number, text.data(), text.size());
  const int closed = open.close();
  if (!error) error = closed;
  if (!error && ::renameat(descriptor_, part.c_str(), descriptor_, name.c_str()) != 0)
    error = errno;
  if (!error) return;
  ::unlinkat(descriptor_, part.c_str(), 0);
  refuse("/" + name + ": " + reason_of(error));
}

KernelCache::Turn::Turn(const KernelCache &cache, const std::string &key, double seconds) :
    descriptor_(-1)
{
  if (cache.descriptor_ < 0) return;
  descriptor_ = ::openat(cache.descriptor_, "lock",
                         O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0600);
  if (descriptor_ < 0) return;
  struct stat status;
  if (::fstat(descriptor_, &status) != 0 || !trouble_of_file(status).empty()) {
    ::close(descriptor_);
    descriptor_ = -1;
    return;
  }
  // a byte of the file for each kernel, at the place that the hash of its key says: the file stays empty, and there are no others to clear
  // away. The lock belongs to the descriptor, not to the process, so that threads wait for each other too.
  struct flock byte = {};
  byte.l_type = F_WRLCK;
  byte.l_whence = SEEK_SET;
  byte.l_start =
      static_cast<off_t>(checksum_of(key.data(), key.size()) >> 2);    // no place is below zero
  byte.l_len = 1;
  // asked for again and again: a wait in the kernel could not be ended
  const auto begin = WallClock::now();
  for (;;) {
    is_mine_ = ::fcntl(descriptor_, F_OFD_SETLK, &byte) == 0;
    if (is_mine_ || (errno != EAGAIN && errno != EACCES && errno != EINTR) ||
        seconds_since(begin) > seconds)
      return;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

/// Ends with the descriptor, also where the process is killed.
KernelCache::Turn::~Turn()
{
  if (descriptor_ >= 0) ::close(descriptor_);
}

}    // namespace rve
