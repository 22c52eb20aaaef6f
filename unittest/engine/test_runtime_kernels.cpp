// SPDX-License-Identifier: GPL-2.0-only
// Tests kernels that are compiled at run time. All kernel variants of the table must compile on a
// machine without a GPU, and the cache must find a compiled kernel again. The tests are skipped
// without libnvrtc.

#include "rve/engine/kernel_text.h"
#include "rve/engine/runtime_kernels.h"
#include "support/environment.h"
#include "support/files.h"
#include "support/messages.h"

#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <functional>
#include <iterator>
#include <string>
#include <vector>

using namespace rve;
using namespace rve_test;

namespace {

constexpr int NEWER_THAN_THE_COMPILER =
    999;    ///< GPUs of this capability get text (PTX), which compiles fast

struct Line {
  KernelVariant variant;
  Format format;
  Arithmetic arithmetic;
};

/// Returns every kernel variant in one number format, and one variant in all formats. This
/// selection suffices, since the code of contact laws does not depend on the code of number
/// formats.
std::vector<Line> lines_to_compile()
{
  const Line formats[] = {{KernelVariant::General, Format::Fast, Arithmetic::Strict},
                          {KernelVariant::General, Format::Fast, Arithmetic::Relaxed},
                          {KernelVariant::General, Format::Mixed, Arithmetic::Strict},
                          {KernelVariant::General, Format::Mixed, Arithmetic::Relaxed},
                          {KernelVariant::General, Format::Double, Arithmetic::Strict}};
  std::vector<Line> lines(std::begin(formats), std::end(formats));
  for (int k = 0; k < kNumVariants; ++k) {
    Line line = formats[k % std::size(formats)];
    line.variant = static_cast<KernelVariant>(k);
    if (line.variant != KernelVariant::General) lines.push_back(line);
  }
  return lines;
}

std::string name_of(const testing::TestParamInfo<Line> &info)
{
  std::string name =
      to_string(KernelName{"", info.param.variant, info.param.format, Arithmetic::Strict});
  name = name.substr(name.rfind("KernelVariant::") + 9);
  std::string letters;
  for (const char c : name.substr(0, name.size() - 1))
    if (c != ',' && c != ' ' && c != ':') letters += c;
  return letters + (info.param.arithmetic == Arithmetic::Relaxed ? "Relaxed" : "Strict");
}

void skip_without_compiler()
{
  if (!Nvrtc::of_this_machine().obstacle().empty())
    GTEST_SKIP() << Nvrtc::of_this_machine().obstacle();
}

class RuntimeKernelsOfLine : public testing::TestWithParam<Line> {
 protected:
  void SetUp() override { skip_without_compiler(); }
};
INSTANTIATE_TEST_SUITE_P(Programs, RuntimeKernelsOfLine, testing::ValuesIn(lines_to_compile()),
                         name_of);

class RuntimeKernels : public testing::Test {
 protected:
  void SetUp() override { skip_without_compiler(); }

  DeviceCode compile(const KernelName &name, int capability, KernelCache &cache)
  {
    return compiled_kernel(name, capability, Nvrtc::of_this_machine(), cache,
                           [this](const std::string &line) { log.push_back(line); });
  }
  std::vector<std::string> log;
};

void expect_compiled(const char *kernel, const Line &line)
{
  KernelCache none("");
  const DeviceCode compiled =
      compiled_kernel({kernel, line.variant, line.format, line.arithmetic}, NEWER_THAN_THE_COMPILER,
                      Nvrtc::of_this_machine(), none, [](const std::string &) {});
  EXPECT_NE(compiled.code.find(".entry " + compiled.kernel), std::string::npos) << compiled.kernel;
  const bool relaxed = compiled.kernel.find("7relaxed") != std::string::npos;
  EXPECT_EQ(relaxed, line.arithmetic == Arithmetic::Relaxed);
  if (relaxed) return;
  // The compiler is allowed to fuse operations that have no rounding mode.
  for (const char *loose :
       {"\tadd.f32", "\tmul.f32", "\tadd.f64", "\tmul.f64", "sqrt.approx.f32", "div.approx.f32"})
    EXPECT_EQ(compiled.code.find(loose), std::string::npos) << loose;
}

const KernelName SMALL{"prepare_calls", KernelVariant::General, Format::Fast, Arithmetic::Strict};

}    // namespace

TEST_P(RuntimeKernelsOfLine, AreCompiledFromTheTextInTheProgram)
{
  expect_compiled("advance_few", GetParam());
  expect_compiled("prepare_calls", GetParam());
}

TEST_F(RuntimeKernels, ExistForBlocksOfAllSizes)
{
  for (const char *kernel : {"advance_many", "advance_large", "advance_in_memory"})
    expect_compiled(kernel, {KernelVariant::Plain, Format::Fast, Arithmetic::Strict});
  for (const char *kernel : {"advance_largest", "advance_in_memory"})
    expect_compiled(kernel, {KernelVariant::PlainSpheres, Format::Fast, Arithmetic::Strict});
}

TEST_F(RuntimeKernels, AreCompiledOnceAndFoundTheNextTime)
{
  const std::string folder = temporary_path("cache");
  std::filesystem::remove_all(folder);
  KernelCache cache(folder);
  const DeviceCode first = compile(SMALL, 90, cache);
  ASSERT_EQ(log.size(), 1u);
  EXPECT_EQ(log[0].find("compiled rve::prepare_calls<rve::KernelVariant::General, "
                        "rve::FastNumbers> for sm_90 in "),
            0u)
      << log[0];
  EXPECT_EQ(first.code.substr(1, 3), "ELF");

  KernelCache next(folder);
  const DeviceCode second = compile(SMALL, 90, next);
  EXPECT_EQ(log.size(), 1u);
  EXPECT_TRUE(first.code == second.code);
  EXPECT_EQ(first.kernel, second.kernel);

  // Other devices and other arithmetic have other kernels.
  compile(SMALL, 80, next);
  KernelName relaxed = SMALL;
  relaxed.arithmetic = Arithmetic::Relaxed;
  compile(relaxed, 90, next);
  EXPECT_EQ(log.size(), 3u);
  std::filesystem::remove_all(folder);
}

/// Reduced kernels have a key of their own and the same arithmetic: no fused operations.
TEST_F(RuntimeKernels, WithReducedOptimizationAreOthersInTheCache)
{
  if (!Nvrtc::of_this_machine().has_fast_compilation()) GTEST_SKIP() << "needs CUDA 13";
  const std::string folder = temporary_path("cache");
  std::filesystem::remove_all(folder);
  KernelCache cache(folder);
  const auto reduced = [&] {
    return compiled_kernel(
        SMALL, NEWER_THAN_THE_COMPILER, Nvrtc::of_this_machine(), cache,
        [this](const std::string &line) { log.push_back(line); }, Optimization::Reduced);
  };
  const DeviceCode first = reduced(), full = compile(SMALL, NEWER_THAN_THE_COMPILER, cache),
                   again = reduced();
  ASSERT_EQ(log.size(), 2u);
  EXPECT_NE(log[0].find(" without some optimizations in "), std::string::npos) << log[0];
  EXPECT_EQ(log[1].find(" without some optimizations"), std::string::npos) << log[1];
  EXPECT_FALSE(first.code == full.code);
  EXPECT_TRUE(first.code == again.code);
  for (const char *fused : {"\tfma.rn.f32", "\tadd.f32", "\tmul.f64"})
    EXPECT_EQ(first.code.find(fused) != std::string::npos,
              full.code.find(fused) != std::string::npos)
        << fused;
  std::filesystem::remove_all(folder);
}

/// A run can end while a kernel is compiled in the background.
TEST_F(RuntimeKernels, CompilationCanBeCancelled)
{
  const std::atomic<bool> cancelled{true};
  KernelCache none("");
  const std::string message = message_of<std::runtime_error>([&] {
    compiled_kernel(
        SMALL, 90, Nvrtc::of_this_machine(), none, [](const std::string &) {}, Optimization::Full,
        &cancelled);
  });
  EXPECT_NE(message.find("NVRTC"), std::string::npos) << message;
}

TEST_F(RuntimeKernels, FailureToStoreThemIsReported)
{
  const std::string folder = temporary_path("cache");
  std::filesystem::remove_all(folder);
  std::filesystem::create_directory(folder);
  std::filesystem::permissions(folder, std::filesystem::perms(0755));
  KernelCache cache(folder);
  EXPECT_FALSE(compile(SMALL, NEWER_THAN_THE_COMPILER, cache).code.empty());
  ASSERT_EQ(log.size(), 2u);
  EXPECT_EQ(log[0],
            "the cache of compiled kernels cannot be read: " + folder +
                " is accessible to other users; run chmod 700 " + folder);
  EXPECT_NE(log[1].find(", but could not store it in the cache: " + folder), std::string::npos)
      << log[1];
  std::filesystem::remove_all(folder);
}

TEST_F(RuntimeKernels, LogTheCompilationToTheCaller)
{
  const Environment no_cache("GPU_RVE_KERNEL_CACHE", "off");
  KernelName other = SMALL;
  other.format = Format::Mixed;
  try {
    runtime_kernel(other, NEWER_THAN_THE_COMPILER,
                   [this](const std::string &line) { log.push_back(line); });
  } catch (const std::exception &) {
    // The kernel cannot be loaded without a GPU or on an older GPU.
  }
  ASSERT_FALSE(log.empty());
  EXPECT_EQ(log.back().find(
                "compiled rve::prepare_calls<rve::KernelVariant::General, rve::MixedNumbers>"),
            0u)
      << log.back();
}

TEST_F(RuntimeKernels, MissingKernelsReportTheMessageOfTheCompiler)
{
  KernelCache none("");
  const std::string message = message_of<std::runtime_error>([&] {
    compile({"advance_nobody", KernelVariant::Plain, Format::Fast, Arithmetic::Strict}, 90, none);
  });
  EXPECT_NE(message.find(
                "cannot compile rve::advance_nobody<rve::KernelVariant::Plain, rve::FastNumbers>"),
            std::string::npos)
      << message;
}

TEST(RuntimeCompiler, MissingCompilerIsReportedWithARemedy)
{
  const Nvrtc nvrtc({"libnvrtc-nowhere.so", "/nowhere/libnvrtc.so"});
  EXPECT_NE(nvrtc.obstacle().find("(tried libnvrtc-nowhere.so, /nowhere/libnvrtc.so): install it"),
            std::string::npos)
      << nvrtc.obstacle();
  EXPECT_NE(nvrtc.obstacle().find("LD_LIBRARY_PATH"), std::string::npos);
}

TEST(RuntimeCompiler, OtherLibraryIsNotUsed)
{
  EXPECT_NE(Nvrtc({"libm.so.6"}).obstacle(), "");
}
