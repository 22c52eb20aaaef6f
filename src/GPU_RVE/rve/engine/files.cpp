// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/files.h"

#include "rve/core/error.h"

#include <cerrno>
#include <fcntl.h>
#include <filesystem>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>
#include <utility>

namespace rve {

namespace {

  namespace fs = std::filesystem;

  /// Returns the name of a temporary file next to the target. No other process uses this name: it
  /// contains the process ID and the name of the machine.
  std::string temporary_name(const std::string &target)
  {
    char machine[65] = "";
    ::gethostname(machine, sizeof(machine) - 1);
    return target + ".part" + std::to_string(::getpid()) + "." + machine;
  }

  /// Writes the content of a file, or the names in a folder, to the disk. Returns false and sets
  /// errno if that fails.
  bool synchronise(int descriptor)
  {
    // Some file systems do not support this function.
    return ::fsync(descriptor) == 0 || errno == EINVAL || errno == ENOSYS || errno == EOPNOTSUPP;
  }

  /// Writes the name of a file to the disk, if the file system supports that.
  void synchronise_name_of(const std::string &file)
  {
    const fs::path folder = fs::path(file).parent_path();
    const int descriptor =
        ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor < 0) return;
    synchronise(descriptor);
    ::close(descriptor);
  }

}    // namespace

std::string reason_of(int error)
{
  return std::generic_category().message(error);
}

OutputFile::OutputFile(const std::string &_path) : path(_path), target(_path)
{
  if (path.empty()) fail(ENOENT);
  constexpr int LONGEST_CHAIN = 40;    // limit of Linux for symbolic links
  std::error_code error;
  for (int k = 0; fs::is_symlink(fs::symlink_status(target, error)); ++k) {
    if (k == LONGEST_CHAIN) fail(ELOOP);
    target = fs::path(target).parent_path() / fs::read_symlink(target, error);
    if (error) fail(error.value());
  }
  struct stat old;
  const bool exists = ::stat(target.c_str(), &old) == 0;
  if (!exists && errno != ENOENT) fail(errno);
  if (exists) {
    if (S_ISDIR(old.st_mode)) fail(EISDIR);
    // Renaming needs no write permission of the old file, but a write-protected file must not be
    // replaced.
    if (::access(target.c_str(), W_OK) != 0) fail(errno);
    regular = S_ISREG(old.st_mode);
    if (!regular) return;
  }

  const std::string name = temporary_name(target);
  ::unlink(name.c_str());    // a killed process with this process ID can have left such a file
  const int descriptor = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (descriptor < 0) fail(errno);
  temporary = name;
  stream = ::fdopen(descriptor, "w");
  if (!exists) return;
  // The owner is set before the mode, since a change of the owner clears bits of the mode. Only
  // root can give a file to another user; otherwise the file belongs to the writer.
  if (old.st_uid != ::geteuid() || old.st_gid != ::getegid())
    if (::fchown(descriptor, old.st_uid, old.st_gid) != 0) old.st_mode &= ~(S_ISUID | S_ISGID);
  if (::fchmod(descriptor, old.st_mode & 07777) != 0) fail(errno);
}

OutputFile::~OutputFile()
{
  discard();
}

void OutputFile::discard()
{
  if (stream) std::fclose(stream);
  stream = nullptr;
  if (!temporary.empty()) ::unlink(temporary.c_str());
  temporary.clear();
}

void OutputFile::write(const std::string &text)
{
  if (!regular) stream = std::fopen(target.c_str(), "we");
  if (!stream || std::fwrite(text.data(), 1, text.size(), stream) != text.size() ||
      std::fflush(stream) != 0 || (regular && !synchronise(::fileno(stream))))
    fail(errno);
  if (std::fclose(std::exchange(stream, nullptr)) != 0) fail(errno);
  if (!regular) return;
  if (::rename(temporary.c_str(), target.c_str()) != 0) fail(errno);
  temporary.clear();
  synchronise_name_of(target);
}

/// Removes the temporary file first, since the destructor does not run if the constructor throws.
void OutputFile::fail(int reason)
{
  discard();
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
          concat(file, ":", line,
                 ": the line has a byte 0; the file must be plain text, not binary or UTF-16"));
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
