// SPDX-License-Identifier: GPL-2.0-only
// Tests how output files are written: existing links, devices and permissions are kept, and an
// error message gives the reason if a file cannot be written.

#include "rve/core/error.h"
#include "rve/engine/files.h"
#include "support/files.h"
#include "support/messages.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <thread>
#include <unistd.h>

using namespace rve;
using namespace rve_test;
namespace fs = std::filesystem;

namespace {

/// Returns an empty folder for a test.
fs::path new_folder()
{
  const fs::path folder = temporary_path("folder");
  fs::remove_all(folder);
  fs::create_directory(folder);
  return folder;
}

std::size_t num_entries(const fs::path &folder)
{
  return static_cast<std::size_t>(
      std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

std::string message_of_writing(const fs::path &path)
{
  return message_of([&] { OutputFile(path.string()).write("text\n"); });
}

}    // namespace

TEST(OutputFile, WritesANewFileAndReplacesAnOldOne)
{
  const fs::path folder = new_folder(), path = folder / "file";

  OutputFile(path.string()).write("first");
  OutputFile(path.string()).write("second");

  EXPECT_EQ(text_of(path.string()), "second");
  EXPECT_EQ(num_entries(folder), 1u);
}

TEST(OutputFile, KeepsTheOldFileUntilTheNewOneIsComplete)
{
  const fs::path folder = new_folder(), path = folder / "file";
  std::ofstream(path) << "old";

  {
    OutputFile never_written(path.string());
    EXPECT_EQ(text_of(path.string()), "old");
  }

  EXPECT_EQ(text_of(path.string()), "old");
  EXPECT_EQ(num_entries(folder), 1u);
}

TEST(OutputFile, TheTemporaryFileHasTheNameOfTheMachine)
{
  const fs::path folder = new_folder(), path = folder / "file";
  char machine[65] = "";
  ASSERT_EQ(gethostname(machine, sizeof(machine) - 1), 0);

  OutputFile file(path.string());

  const std::string name = "file.part" + std::to_string(getpid()) + "." + machine;
  EXPECT_TRUE(fs::exists(folder / name));
  file.write("text");
  EXPECT_EQ(num_entries(folder), 1u);
}

TEST(OutputFile, AFileThatIsReplacedKeepsItsMode)
{
  const fs::path path = new_folder() / "file";
  std::ofstream(path) << "old";
  fs::permissions(path, fs::perms(0640));

  OutputFile(path.string()).write("new");

  EXPECT_EQ(fs::status(path).permissions(), fs::perms(0640));
}

TEST(OutputFile, ALinkStaysAndItsFileIsWritten)
{
  const fs::path folder = new_folder();
  fs::create_directory(folder / "data");
  fs::create_symlink("data/file", folder / "link");
  fs::create_symlink("link", folder / "link_to_link");
  fs::create_symlink("itself", folder / "itself");

  OutputFile((folder / "link_to_link").string()).write("text");    // data/file does not exist yet
  OutputFile((folder / "link").string()).write("more");

  EXPECT_TRUE(fs::is_symlink(folder / "link"));
  EXPECT_TRUE(fs::is_symlink(folder / "link_to_link"));
  EXPECT_EQ(text_of((folder / "data" / "file").string()), "more");
  EXPECT_EQ(num_entries(folder / "data"), 1u);
  EXPECT_NE(message_of_writing(folder / "itself").find("Too many levels of symbolic links"),
            std::string::npos);
}

TEST(OutputFile, AFifoStaysAndItsReaderGetsTheText)
{
  const fs::path folder = new_folder(), path = folder / "fifo";
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
  require_writable(path.string());    // returns without waiting for a reader
  std::string read;
  std::thread reader([&] { read = text_of(path.string()); });

  OutputFile(path.string()).write("text");
  reader.join();

  EXPECT_TRUE(fs::is_fifo(path));
  EXPECT_EQ(read, "text");
  EXPECT_EQ(num_entries(folder), 1u);
}

TEST(OutputFile, ADeviceBehindALinkIsWrittenInto)
{
  const fs::path folder = new_folder(), link = folder / "null";
  fs::create_symlink("/dev/null", link);

  OutputFile(link.string()).write("text");

  EXPECT_TRUE(fs::is_symlink(link));
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

// A write must not replace /dev/null by a regular file, even if root runs the program.
TEST(OutputFile, ADeviceStaysADevice)
{
  const fs::path path = new_folder() / "null";
  if (mknod(path.c_str(), S_IFCHR | 0666, makedev(1, 3)) != 0 || !std::ofstream(path).is_open())
    GTEST_SKIP() << "only root makes devices, and not everywhere";

  OutputFile(path.string()).write("text");

  EXPECT_TRUE(fs::is_character_file(path));
}

TEST(OutputFile, ErrorsHaveReasons)
{
  const fs::path folder = new_folder();
  std::ofstream(folder / "file") << "";

  EXPECT_EQ(message_of_writing(folder / "none" / "x"),
            "cannot write file " + (folder / "none" / "x").string() +
                ": No such file or directory");
  EXPECT_EQ(message_of_writing(folder / "file" / "x"),
            "cannot write file " + (folder / "file" / "x").string() + ": Not a directory");
  EXPECT_EQ(message_of_writing(folder),
            "cannot write file " + folder.string() + ": Is a directory");
  EXPECT_EQ(message_of_writing(""), "cannot write file : No such file or directory");
  if (fs::exists("/dev/full")) {
    EXPECT_EQ(message_of_writing("/dev/full"),
              "cannot write file /dev/full: No space left on device");
  }
}

TEST(OutputFile, AWriteProtectedFileIsKept)
{
  if (geteuid() == 0) GTEST_SKIP() << "root writes everywhere";
  const fs::path path = new_folder() / "file";
  std::ofstream(path) << "old";
  fs::permissions(path, fs::perms(0444));

  EXPECT_EQ(message_of_writing(path), "cannot write file " + path.string() + ": Permission denied");
  EXPECT_EQ(text_of(path.string()), "old");
}

TEST(RequireWritable, ChecksBeforeThereIsAnythingToWrite)
{
  const fs::path folder = new_folder();

  require_writable((folder / "file").string());

  EXPECT_EQ(num_entries(folder), 0u);
  EXPECT_EQ(message_of([&] { require_writable((folder / "none" / "x").string()); }),
            "cannot write file " + (folder / "none" / "x").string() +
                ": No such file or directory");
}
