// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/files.h"

#include "rve/core/error.h"

#include <cerrno>
#include <fcntl.h>
#include <filesystem>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>

namespace rve {

namespace {

  namespace fs = std::filesystem;

  std::string reason_of(int error)
  {
    return std::generic_category().message(error);
  }

  /// The file that a path means, which need not exist: the last of a chain of symbolic links. Returns 0 or an error number.
  int follow_links(const std::string &path, std::string &target)
  {
    constexpr int LONGEST_CHAIN = 40;    // Linux' own
    fs::path present = path;
    for (int k = 0; k < LONGEST_CHAIN; ++k) {
      std::error_code error;
      if (!fs::is_symlink(fs::symlink_status(present, error))) {
        target = present.string();
        return 0;
      }
      const fs::path next = fs::read_symlink(present, error);
      if (error) return error.value();
      present = next.is_absolute() ? next : present.parent_path() / next;
    }
    return ELOOP;
  }

  /// Name of a temporary file beside the target: no other process has it, on this machine or on another one with the same folder.
  std::string temporary_name(const std::string &target)
  {
    char machine[65] = "";
    ::gethostname(machine, sizeof(machine) - 1);
    return target + ".part" + std::to_string(::getpid()) + "." + machine;
  }

  /// Brings the content of a file to the disk. Returns 0 or an error number.
  int synchronise(int descriptor)
  {
    while (::fsync(descriptor) != 0) {
      if (errno == EINTR) continue;
      // some file systems have no such function
      return errno == EINVAL || errno == ENOSYS || errno == EOPNOTSUPP ? 0 : errno;
    }
    return 0;
  }

  /// Brings the names in the folder of a file to the disk, where the file system can do that.
  void synchronise_folder_of(const std::string &file)
  {
    const fs::path folder = fs::path(file).parent_path();
    const std::string name = folder.empty() ? "." : folder.string();
    const int descriptor = ::open(name.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor < 0) return;
    synchronise(descriptor);
    ::close(descriptor);
  }

  /// Returns 0 or an error number.
  int write_all(int descriptor, const std::string &text)
  {
    for (std::size_t done = 0; done < text.size();) {
      const ssize_t count = ::write(descriptor, text.data() + done, text.size() - done);
      if (count >= 0)
        done += static_cast<std::size_t>(count);
      else if (errno != EINTR)
        return errno;
    }
    return 0;
  }

}    // namespace

OutputFile::OutputFile(const std::string &_path) : path(_path)
{
  if (path.empty()) fail(ENOENT);
  if (const int error = follow_links(path, target)) fail(error);
  struct stat old;
  const bool exists = ::stat(target.c_str(), &old) == 0;
  if (!exists && errno != ENOENT) fail(errno);
  if (exists) {
    if (S_ISDIR(old.st_mode)) fail(EISDIR);
    // renaming needs no permission of the file, but who has write-protected it wants to keep it
    if (::access(target.c_str(), W_OK) != 0) fail(errno);
    regular = S_ISREG(old.st_mode);
    if (!regular) return;
  }

  const std::string name = temporary_name(target);
  ::unlink(name.c_str());    // of a process that had this number and was killed
  descriptor = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (descriptor < 0) fail(errno);
  temporary = name;
  if (!exists) return;
  // the owner first: a change of it takes bits of the mode away. Only root may give a file away: then it is the writer's.
  if (old.st_uid != ::geteuid() || old.st_gid != ::getegid())
    if (::fchown(descriptor, old.st_uid, old.st_gid) != 0) old.st_mode &= ~(S_ISUID | S_ISGID);
  if (::fchmod(descriptor, old.st_mode & 07777) != 0) fail(errno);
}

OutputFile::~OutputFile()
{
  if (descriptor >= 0) ::close(descriptor);
  if (!temporary.empty()) ::unlink(temporary.c_str());
}

void OutputFile::write(const std::string &text)
{
  if (!regular) {
    descriptor = ::open(target.c_str(), O_WRONLY | O_NOCTTY | O_CLOEXEC);
    if (descriptor < 0) fail(errno);
  }
  if (const int error = write_all(descriptor, text)) fail(error);
  if (regular)
    if (const int error = synchronise(descriptor)) fail(error);
  const int closed = ::close(descriptor);
  descriptor = -1;
  if (closed != 0) fail(errno);
  if (!regular) return;
  if (::rename(temporary.c_str(), target.c_str()) != 0) fail(errno);
  temporary.clear();
  synchronise_folder_of(target);
}

/// A constructor that throws has no destructor, so this cleans up.
void OutputFile::fail(int reason)
{
  if (descriptor >= 0) ::close(descriptor);
  descriptor = -1;
  if (!temporary.empty()) ::unlink(temporary.c_str());
  temporary.clear();
  throw InputError("cannot write file " + path + ": " + reason_of(reason));
}

void require_writable(const std::string &path)
{
  OutputFile probe(path);
}

void require_readable(const std::string &path, const std::string &what)
{
  const auto refuse = [&](const std::string &reason) {
    throw InputError("cannot open " + what + " " + path + ": " + reason);
  };
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::status_known(status) || !fs::exists(status))
    refuse(reason_of(error ? error.value() : ENOENT));
  if (fs::is_directory(status)) refuse(reason_of(EISDIR));
  if (!fs::is_regular_file(status))
    refuse("it is a fifo, a device or a socket; it must be a regular file");
  if (::access(path.c_str(), R_OK) != 0) refuse(reason_of(errno));
}

std::string plain_text(const std::string &text, const std::string &file)
{
  const std::string mark = "\xEF\xBB\xBF";
  std::string plain;
  plain.reserve(text.size());
  int line = 1;
  for (std::size_t k = text.compare(0, mark.size(), mark) == 0 ? mark.size() : 0; k < text.size();
       ++k) {
    char letter = text[k];
    if (letter == '\0')
      throw InputError(
          file + ":" + std::to_string(line) +
          ": the line has a byte 0; the file must be plain text, not binary or UTF-16");
    if (letter == '\r') {
      letter = '\n';
      if (k + 1 < text.size() && text[k + 1] == '\n') ++k;
    }
    if (letter == '\n') ++line;
    plain += letter;
  }
  return plain;
}

}    // namespace rve
