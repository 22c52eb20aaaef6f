// SPDX-License-Identifier: GPL-2.0-only
// Files that are written completely or not at all, and checks of files that are read. Error
// messages contain the reason that the operating system gives.

#pragma once

#include <cstdio>
#include <string>

namespace rve {

/// File for output. The constructor checks that the file can be written; write() is called later.
///   - For a regular or new file the text goes into a temporary file in the same folder. This file
///     then gets the name, and replaces an old file. It keeps the mode of the old file, and the
///     owner if the operating system permits that.
///   - A symbolic link stays, and its target is written in the same way.
///   - The text goes directly into a device or a fifo. A fifo waits for its reader.
///   - A directory is refused.
/// A regular file does not change if write() is not called or fails. After a power loss it is the
/// complete old or the complete new file, since the new content is on the disk before the temporary
/// file gets the name.
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

/// Throws InputError with the reason unless this is a regular file that can be read. Reading a fifo
/// would wait for its writer, and a device can be endless. `what` names the kind of file in the
/// message, such as "packing file".
void require_readable(const std::string &path, const std::string &what);

/// Returns the text of a file without its byte-order mark, with LF instead of every CR and CR LF.
/// Throws InputError if a byte is 0, as in binary files and in UTF-16. The message begins with
/// `file` and the line number.
std::string plain_text(const std::string &text, const std::string &file);

}    // namespace rve
