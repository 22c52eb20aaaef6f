// SPDX-License-Identifier: GPL-2.0-only
// Files that are written whole or not at all, and refused for reading where they are no files. Errors say why, in the words of the
// operating system.

#pragma once

#include <cstdio>
#include <string>

namespace rve {

/// A file to write. The constructor finds out whether it can be written, before there is anything to write:
///   a regular file, or none yet    the text goes into a temporary file beside it, which then takes its name; the mode of a file that
///                                  was there stays, and its owner where that is permitted
///   a symbolic link                the same with the file that it leads to; the link stays
///   a device or a fifo             the text goes straight into it; a fifo waits for its reader
///   a directory                    is refused
/// Where write() was not called, or failed, nothing has changed. After a loss of power a regular file is the old one or the new one, whole: its
/// content is on the disk before it takes the name.
class OutputFile {
 public:
  /// Throws InputError with the reason if it cannot be written.
  explicit OutputFile(const std::string &path);
  ~OutputFile();
  OutputFile(const OutputFile &) = delete;
  OutputFile &operator=(const OutputFile &) = delete;

  /// Whether the text stays as a file that others can stand beside; not so of a device or a fifo.
  bool is_regular() const { return regular; }

  /// Once. Throws InputError with the reason, a full disk for example.
  void write(const std::string &text);

 private:
  std::string path;      // as given, for messages
  std::string target;    // behind symbolic links
  // beside the target; empty: the target is a device or a fifo, or has been written
  std::string temporary;
  std::FILE *stream = nullptr;
  bool regular = true;

  void discard();
  [[noreturn]] void fail(int reason);
};

/// Words of the operating system for an error number.
std::string reason_of(int error);

/// Throws InputError with the reason unless a file can be written there.
void require_writable(const std::string &path);

/// Throws InputError with the reason unless there is a regular file that can be read: a fifo would wait for its writer, and a device
/// need not have an end. `what` names it, "packing file".
void require_readable(const std::string &path, const std::string &what);

/// Returns the text of a file with a line feed at the end of each line, whichever system wrote it (CR, CR LF), and without a byte-order
/// mark. Throws InputError, which begins with `file` and the line, if a byte is 0, as in binary files and in UTF-16.
std::string plain_text(const std::string &text, const std::string &file);

}    // namespace rve
