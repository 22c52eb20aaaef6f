// SPDX-License-Identifier: GPL-2.0-only
// Files that are written completely or not at all, and checks of files that are read. Error
// messages give the reason in the words of the operating system.

#pragma once

#include <cstdio>
#include <string>

namespace rve {

/// File for output. The constructor checks that the file can be written, before there is any text:
///   - The text of a regular or new file goes into a temporary file in the same folder, which then
///     takes its name. The mode of an old file stays, and its owner where that is permitted.
///   - A symbolic link stays, and its target is written in the same way.
///   - The text goes directly into a device or a fifo. A fifo waits for its reader.
///   - A directory is refused.
/// Nothing changes if write() is not called or fails. After a power loss a regular file is the
/// complete old or new one, since its content is on the disk before it takes the name.
class OutputFile {
 public:
  /// Throws InputError with the reason if the file cannot be written.
  explicit OutputFile(const std::string &path);
  ~OutputFile();
  OutputFile(const OutputFile &) = delete;
  OutputFile &operator=(const OutputFile &) = delete;

  /// Returns true if the text becomes a regular file, which can have companion files; false for a
  /// device or a fifo.
  bool is_regular() const { return regular; }

  /// Writes the text; called once. Throws InputError with the reason, such as a full disk.
  void write(const std::string &text);

 private:
  std::string path;      // as given, for messages
  std::string target;    // after resolution of symbolic links
  // Temporary file in the folder of the target; empty for a device or a fifo, and after write().
  std::string temporary;
  std::FILE *stream = nullptr;
  bool regular = true;

  void discard();
  [[noreturn]] void fail(int reason);
};

/// Returns the text of the operating system for an error number.
std::string reason_of(int error);

/// Throws InputError with the reason unless this file can be written.
void require_writable(const std::string &path);

/// Throws InputError with the reason unless this is a regular file that can be read. A fifo would
/// wait for its writer, and a device may be endless. `what` names the file in the message, as
/// "packing file".
void require_readable(const std::string &path, const std::string &what);

/// Returns the text of a file without its byte-order mark and with each line end (LF, CR or CR LF)
/// as a line feed. Throws InputError if a byte is 0, as in binary files and in UTF-16. The message
/// begins with `file` and the line.
std::string plain_text(const std::string &text, const std::string &file);

}    // namespace rve
