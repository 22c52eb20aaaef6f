// SPDX-License-Identifier: GPL-2.0-only
// Tests the cache of compiled kernels. All processes must find a stored kernel. A damaged file, or
// a folder in which other users have permission to write, must never be used.

#include "rve/core/error.h"
#include "rve/engine/kernel_cache.h"
#include "support/environment.h"
#include "support/files.h"
#include "support/messages.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

using namespace rve;
using namespace rve_test;

namespace {

namespace fs = std::filesystem;

const std::string KEY = "NVRTC 13.0\nsm_90\nrve::advance_many<rve::KernelVariant::Plain>\n";

DeviceCode some_kernel()
{
  std::string code = "code\n";
  for (int k = 0; k < 100000; ++k) code += static_cast<char>(k * k);
  return {"_ZN3rve12advance_many", code, ""};
}

class Folder : public testing::Test {
 protected:
  void SetUp() override
  {
    folder = temporary_path("cache");
    fs::remove_all(folder);
  }
  void TearDown() override { fs::remove_all(folder); }

  std::string file() const { return folder + "/" + KernelCache::file_name(KEY); }

  /// Stores the kernel in a new cache.
  void keep() const
  {
    KernelCache cache(folder);
    cache.store(KEY, some_kernel());
    ASSERT_EQ(cache.obstacle(), "");
  }

  /// Returns true if the cache finds the stored kernel. If it does not, `why` receives the message
  /// of the cache.
  bool finds(std::string *why = nullptr, const std::string &key = KEY) const
  {
    KernelCache cache(folder);
    DeviceCode kernel;
    const bool found = cache.load(key, kernel);
    if (found) {
      EXPECT_EQ(kernel.kernel, some_kernel().kernel);
      EXPECT_TRUE(kernel.code == some_kernel().code);
    }
    if (why) *why = cache.obstacle();
    return found;
  }

  /// Expects that the file is refused for this reason and that the kernel can be stored again.
  void expect_refused(const std::string &reason) const
  {
    std::string why;
    EXPECT_FALSE(finds(&why));
    EXPECT_NE(why.find(reason), std::string::npos) << why;
    EXPECT_EQ(why.find(file()), 0u) << why;
    keep();
    EXPECT_TRUE(finds());
  }

  /// Expects that nothing is read from the folder or written to it.
  void expect_folder_refused(const std::string &reason) const
  {
    KernelCache cache(folder);
    DeviceCode kernel;
    EXPECT_FALSE(cache.load(KEY, kernel));
    EXPECT_EQ(cache.obstacle().find(folder), 0u) << cache.obstacle();
    EXPECT_NE(cache.obstacle().find(reason), std::string::npos) << cache.obstacle();
    const std::string before = text_of(file());
    cache.store(KEY, {"other", "other", ""});
    EXPECT_EQ(text_of(file()), before);
  }

  std::vector<std::string> names() const
  {
    std::vector<std::string> found;
    for (const auto &entry : fs::directory_iterator(folder))
      found.push_back(entry.path().filename().string());
    return found;
  }

  std::string folder;
};

using KernelCacheFolder = Folder;
using KernelCacheFile = Folder;
using KernelCacheProcesses = Folder;

void write(const std::string &path, const std::string &text)
{
  std::ofstream(path, std::ios::binary) << text;
}

/// Runs `work` in several processes at once and returns true if it succeeds in all of them.
template <class Work> bool end_well(int processes, const Work &work)
{
  std::vector<pid_t> children;
  for (int k = 0; k < processes; ++k) {
    const pid_t child = fork();
    if (child == 0) _exit(work() ? 0 : 1);
    children.push_back(child);
  }
  bool well = true;
  for (const pid_t child : children) {
    int status = 0;
    const bool ended = child > 0 && waitpid(child, &status, 0) == child;
    well = ended && WIFEXITED(status) && WEXITSTATUS(status) == 0 && well;
  }
  return well;
}

}    // namespace

// ---- stored kernels ----

TEST_F(KernelCacheFile, IsFoundByItsKeyAndByNoOther)
{
  EXPECT_FALSE(finds());
  keep();
  EXPECT_TRUE(finds());
  EXPECT_FALSE(finds(nullptr, KEY + "-fmad=true\n"));
}

TEST_F(KernelCacheFolder, IsAccessibleToItsOwnerOnly)
{
  const mode_t before = umask(0);
  keep();
  umask(before);
  struct stat status;
  ASSERT_EQ(stat(folder.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0700u);
}

TEST_F(KernelCacheFile, FileOfAnotherKeyWithTheSameHashIsNotUsed)
{
  keep();
  const std::string other = "another key";
  fs::rename(file(), folder + "/" + KernelCache::file_name(other));
  EXPECT_FALSE(finds(nullptr, other));
}

TEST_F(KernelCacheFile, DamagedFileIsCompiledAgain)
{
  keep();
  const std::string sound = text_of(file());
  for (const std::size_t place :
       {std::size_t(0), std::size_t(17), std::size_t(24), std::size_t(32), std::size_t(40),
        std::size_t(60), sound.size() / 2, sound.size() - 1}) {
    std::string text = sound;
    text[place] = static_cast<char>(text[place] ^ 0x20);
    write(file(), text);
    expect_refused("is damaged");
  }
}

TEST_F(KernelCacheFile, TruncatedOrTooLongFileIsCompiledAgain)
{
  keep();
  const std::string sound = text_of(file());
  for (const std::size_t size :
       {std::size_t(0), std::size_t(7), std::size_t(48), std::size_t(100), sound.size() - 1}) {
    write(file(), sound.substr(0, size));
    expect_refused("is damaged");
  }
  write(file(), sound + "x");
  expect_refused("is damaged");
}

// ---- the folder ----

TEST_F(KernelCacheFolder, FolderOpenToOthersIsRefused)
{
  for (const mode_t mode : {0755, 0701, 0710, 0777, 0750, 0500}) {
    keep();
    ASSERT_EQ(chmod(folder.c_str(), mode), 0);
    expect_folder_refused("chmod 700 " + folder);
    ASSERT_EQ(chmod(folder.c_str(), 0700), 0);
  }
}

TEST_F(KernelCacheFolder, OfAnotherUserIsRefused)
{
  if (geteuid() != 0) GTEST_SKIP() << "only root gives folders away";
  keep();
  ASSERT_EQ(chown(folder.c_str(), 12345, 12345), 0);
  expect_folder_refused("belongs to the user with ID 12345");
}

TEST_F(KernelCacheFolder, FailureToCreateItIsReported)
{
  write(folder, "a file");
  expect_folder_refused("Not a directory");
  fs::remove(folder);
}

TEST_F(KernelCacheFolder, IsCreatedWithItsParents)
{
  KernelCache cache(folder + "/a/b/");
  EXPECT_EQ(cache.obstacle(), "");
  EXPECT_TRUE(fs::is_directory(folder + "/a/b"));
}

TEST(KernelCache, IsInTheFolderOfTheEnvironmentVariable)
{
  const auto chosen = [](const char *own, const char *xdg, const char *home) {
    const Environment a("GPU_RVE_KERNEL_CACHE", own), b("XDG_CACHE_HOME", xdg), c("HOME", home);
    return KernelCache::chosen_folder();
  };
  EXPECT_EQ(chosen("/scratch/me", "/xdg", "/home/me"), "/scratch/me");
  EXPECT_EQ(chosen("off", "/xdg", "/home/me"), "");
  EXPECT_EQ(chosen("0", "/xdg", "/home/me"), "");
  EXPECT_EQ(chosen("", "/xdg", "/home/me"), "");
  EXPECT_EQ(chosen("yes", "/xdg", "/home/me"), "/xdg/gpu_rve/kernels");
  EXPECT_EQ(chosen(nullptr, "/xdg", "/home/me"), "/xdg/gpu_rve/kernels");
  EXPECT_EQ(chosen(nullptr, "relative", "/home/me"), "/home/me/.cache/gpu_rve/kernels");
  EXPECT_EQ(chosen(nullptr, nullptr, "/home/me"), "/home/me/.cache/gpu_rve/kernels");
  EXPECT_EQ(chosen(nullptr, nullptr, nullptr), "");
  EXPECT_EQ(message_of([&] { chosen("cache", nullptr, nullptr); }),
            "GPU_RVE_KERNEL_CACHE in the environment is 'cache'; it must be the absolute path of a "
            "folder, or 0, false, no, off or empty");
}

TEST(KernelCache, SwitchedOffCacheStoresNothingWithoutAMessage)
{
  KernelCache cache("");
  cache.store(KEY, some_kernel());
  DeviceCode kernel;
  EXPECT_FALSE(cache.load(KEY, kernel));
  EXPECT_EQ(cache.obstacle(), "");
}

// ---- many processes -----------------------------------------------------------------------------

/// Several processes read and write at once. Each process must read a whole kernel or none, and no
/// temporary files remain.
TEST_F(KernelCacheProcesses, NeverReadAPartialFile)
{
  constexpr int rounds = 10;    // each round writes to the disk
  EXPECT_TRUE(end_well(8, [&] {
    KernelCache cache(folder);
    const DeviceCode sound = some_kernel();
    bool well = cache.obstacle().empty();
    for (int round = 0; round < rounds; ++round) {
      DeviceCode kernel;
      if (cache.load(KEY, kernel)) well = well && kernel.code == sound.code;
      cache.store(KEY, sound);
      well = well && cache.obstacle().empty();
    }
    return well;
  }));
  EXPECT_TRUE(finds());
  EXPECT_EQ(names().size(), 1u);
}
