// SPDX-License-Identifier: GPL-2.0-only
// The C interface. Its results are bitwise equal to those of the engine, trials change no state,
// and every error has a message.

#include "librve.h"

#include "rve/core/checksum.h"
#include "rve/engine/engine.h"
#include "rve/engine/packing_io.h"
#include "rve/engine/packing_library.h"
#include "rve/engine/stability.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace {

const std::string DISKS = std::string(RVE_PACKINGS_DIR) + "/A_h0075.rve";
const std::string SPHERES = std::string(RVE_PACKINGS_DIR) + "/S500.rve";
constexpr double DT_DISKS = 2e-5, DT_SPHERES = 2e-6;
const char *const OPTIONS = "format double device cpu threads 1";

using Packing = std::unique_ptr<rve_packing, void (*)(rve_packing *)>;
using Batch = std::unique_ptr<rve_batch, void (*)(rve_batch *)>;

Packing read(const std::string &file)
{
  rve_packing *packing = nullptr;
  EXPECT_EQ(rve_packing_read(file.c_str(), &packing), RVE_SUCCESS) << rve_error();
  return {packing, rve_packing_free};
}

Batch batch_of(const std::vector<const rve_packing *> &packings, const char *options = OPTIONS)
{
  rve_batch *batch = nullptr;
  EXPECT_EQ(rve_batch_create(packings.data(), packings.size(), options, &batch), RVE_SUCCESS)
      << rve_error();
  return {batch, rve_batch_free};
}

Batch batch_of(const std::string &file, std::size_t count, const char *options = OPTIONS)
{
  const Packing packing = read(file);
  return batch_of(std::vector<const rve_packing *>(count, packing.get()), options);
}

using Numbers = std::vector<double>;

/// Returns the identity plus 1e-4 times a nonsymmetric matrix that depends on k.
Numbers increment(int dimension, int k)
{
  Numbers f(dimension * dimension, 0.0);
  for (int a = 0; a < dimension; ++a)
    for (int b = 0; b < dimension; ++b)
      f[dimension * a + b] = (a == b) + 1e-4 * std::sin(1.0 + k + 2.0 * a + 5.0 * b);
  return f;
}

enum class Kind { Trial, Advance };

Numbers move(rve_batch *batch, Kind kind, const std::vector<std::size_t> &which, int k,
             std::vector<std::uint32_t> *statuses = nullptr)
{
  const int d = rve_batch_dimension(batch);
  Numbers increments;
  for (const std::size_t member : which) {
    const Numbers one = increment(d, k + static_cast<int>(member));
    increments.insert(increments.end(), one.begin(), one.end());
  }
  const Numbers dt(which.size(), d == 2 ? DT_DISKS : DT_SPHERES);
  const std::vector<std::int32_t> substeps(which.size(), 40);
  Numbers stresses(which.size() * d * d);
  std::vector<std::uint32_t> words(which.size());
  const auto call = kind == Kind::Trial ? rve_trial : rve_advance;
  EXPECT_EQ(call(batch, which.data(), which.size(), increments.data(), dt.data(), substeps.data(),
                 stresses.data(), words.data()),
            RVE_SUCCESS)
      << rve_error();
  if (statuses) *statuses = words;
  return stresses;
}

std::vector<char> saved(rve_batch *batch)
{
  std::size_t size = 0;
  EXPECT_EQ(rve_save(batch, nullptr, 0, &size), RVE_SUCCESS);
  std::vector<char> bytes(size);
  EXPECT_EQ(rve_save(batch, bytes.data(), bytes.size(), &size), RVE_SUCCESS) << rve_error();
  return bytes;
}

double quantity(rve_batch *batch, const char *name, std::size_t which)
{
  double value = 0.0;
  EXPECT_EQ(rve_quantity(batch, name, &which, 1, &value), RVE_SUCCESS) << rve_error();
  return value;
}

template <int D> void expect_the_bits_of_the_engine(const std::string &file)
{
  const Batch batch = batch_of(file, 1);
  rve::Options options;
  options.format = rve::Format::Double;
  options.device = rve::Device::Cpu;
  options.threads = 1;
  const auto state = rve::read_packing<D>(file);
  options.contacts = rve::contacts_of(state);
  const auto engine = rve::make_engine<D>(options);
  const int number = engine->add(state);
  for (int k = 0; k < 3; ++k) {
    const Numbers stress = move(batch.get(), Kind::Advance, {0}, k);
    rve::DriveOf<D> drive;
    drive.dt = D == 2 ? DT_DISKS : DT_SPHERES;
    drive.substeps = 40;
    const Numbers f = increment(D, k);
    std::copy(f.begin(), f.end(), drive.deformation.component);
    std::vector<rve::ResultOf<D>> results;
    engine->advance({number}, {drive}, results);
    EXPECT_EQ(0, std::memcmp(stress.data(), results[0].stress.component, sizeof(double) * D * D));
    EXPECT_EQ(quantity(batch.get(), "void_ratio", 0), results[0].void_ratio);
    EXPECT_EQ(quantity(batch.get(), "p", 0), results[0].mean_stress());
  }
  rve_packing *packing = nullptr;
  ASSERT_EQ(rve_batch_packing(batch.get(), 0, &packing), RVE_SUCCESS);
  const Packing owner(packing, rve_packing_free);
  const auto now = engine->state(number);
  Numbers velocity(D * rve_packing_grains(packing));
  ASSERT_EQ(rve_packing_array(packing, "velocity", velocity.data(), velocity.size()), RVE_SUCCESS);
  EXPECT_EQ(velocity, now.velocity);
}

}    // namespace

TEST(Librve, AdvancesDisksAndSpheresToTheBitsOfTheEngine)
{
  expect_the_bits_of_the_engine<2>(DISKS);
  expect_the_bits_of_the_engine<3>(SPHERES);
}

TEST(Librve, TrialsChangeNoState)
{
  for (const std::string &file : {DISKS, SPHERES}) {
    const Batch tried = batch_of(file, 2), plain = batch_of(file, 2);
    for (int k = 0; k < 3; ++k) {
      move(tried.get(), Kind::Trial, {0, 1}, 50 + k);
      const Numbers once = move(tried.get(), Kind::Trial, {0, 1}, k);
      move(tried.get(), Kind::Trial, {1}, 70 + k);
      const Numbers twice = move(tried.get(), Kind::Trial, {0, 1}, k);
      EXPECT_EQ(once, twice);
      EXPECT_EQ(twice, move(plain.get(), Kind::Advance, {0, 1}, k));
      ASSERT_EQ(rve_commit(tried.get()), RVE_SUCCESS);
      EXPECT_EQ(saved(tried.get()), saved(plain.get()));
    }
    // A trial changes the results, but not the state that rve_save returns. rve_revert discards it.
    const double before = quantity(plain.get(), "p", 0);
    const std::vector<char> state = saved(plain.get());
    move(plain.get(), Kind::Trial, {0}, 9);
    EXPECT_EQ(saved(plain.get()), state);
    EXPECT_NE(quantity(plain.get(), "p", 0), before);
    ASSERT_EQ(rve_revert(plain.get()), RVE_SUCCESS);
    EXPECT_EQ(quantity(plain.get(), "p", 0), before);
    EXPECT_EQ(saved(plain.get()), state);
  }
}

TEST(Librve, TrialsBeginFromTheStateOfAnAdvance)
{
  for (const std::string &file : {DISKS, SPHERES}) {
    const Batch batch = batch_of(file, 1), plain = batch_of(file, 1);
    move(batch.get(), Kind::Trial, {0}, 5);
    ASSERT_EQ(rve_revert(batch.get()), RVE_SUCCESS);
    EXPECT_EQ(move(batch.get(), Kind::Advance, {0}, 0), move(plain.get(), Kind::Advance, {0}, 0));

    move(batch.get(), Kind::Trial, {0}, 6);
    const Numbers again = move(batch.get(), Kind::Trial, {0}, 1);

    EXPECT_EQ(saved(batch.get()), saved(plain.get()));
    EXPECT_EQ(again, move(plain.get(), Kind::Advance, {0}, 1));
  }
}

TEST(Librve, ResultsDoNotDependOnTheBatch)
{
  const Packing packing = read(DISKS);
  const Batch four = batch_of({packing.get(), packing.get(), packing.get(), packing.get()},
                              "format mixed device cpu threads 2"),
              one = batch_of({packing.get()}, "format mixed device cpu threads 1");
  const Numbers all = move(four.get(), Kind::Advance, {3, 0, 2}, 0);
  // `all` has the stresses of the RVEs 3, 0 and 2. Those of RVE 0 begin at index 4.
  const Numbers alone = move(one.get(), Kind::Advance, {0}, 0);
  EXPECT_EQ(Numbers(all.begin() + 4, all.begin() + 8), alone);
  EXPECT_EQ(quantity(four.get(), "substeps", 1), 0.0);
}

TEST(Librve, RestoresWhatItSavedToTheBit)
{
  for (const std::string &file : {DISKS, SPHERES}) {
    const Batch batch = batch_of(file, 2);
    move(batch.get(), Kind::Advance, {0, 1}, 1);
    const std::vector<char> bytes = saved(batch.get());
    const Numbers went_on = move(batch.get(), Kind::Advance, {0, 1}, 2);
    const std::vector<char> later = saved(batch.get());

    const Batch other = batch_of(file, 2);
    ASSERT_EQ(rve_restore(other.get(), bytes.data(), bytes.size()), RVE_SUCCESS) << rve_error();
    EXPECT_EQ(move(other.get(), Kind::Advance, {0, 1}, 2), went_on);
    EXPECT_EQ(saved(other.get()), later);
  }
}

TEST(Librve, APackingAsBytesIsTheWholeState)
{
  for (const std::string &file : {DISKS, SPHERES}) {
    const Batch batch = batch_of(file, 1);
    move(batch.get(), Kind::Advance, {0}, 1);
    rve_packing *now = nullptr, *back = nullptr;
    ASSERT_EQ(rve_batch_packing(batch.get(), 0, &now), RVE_SUCCESS);
    const Packing owner(now, rve_packing_free);
    std::size_t size = 0;
    ASSERT_EQ(rve_packing_save(now, nullptr, 0, &size), RVE_SUCCESS);
    std::vector<char> bytes(size);
    ASSERT_EQ(rve_packing_save(now, bytes.data(), size, &size), RVE_SUCCESS) << rve_error();

    ASSERT_EQ(rve_packing_restore(bytes.data(), size, &back), RVE_SUCCESS) << rve_error();
    const Packing restored(back, rve_packing_free);
    const Batch other = batch_of(file, 1);
    ASSERT_EQ(rve_batch_set_packing(other.get(), 0, back), RVE_SUCCESS) << rve_error();

    EXPECT_EQ(saved(other.get()), saved(batch.get()));
    EXPECT_EQ(move(other.get(), Kind::Advance, {0}, 2), move(batch.get(), Kind::Advance, {0}, 2));
    const std::vector<char> two = saved(batch_of(file, 2).get());
    EXPECT_EQ(rve_packing_restore(two.data(), two.size(), &back), RVE_BAD_INPUT);
    EXPECT_STREQ(rve_error(), "the bytes have 2 saved RVEs; they must have one");
  }
}

namespace {

constexpr std::size_t CALLS = 10;
constexpr int STEPS_PER_CALL = 20;

/// Advances the RVEs of a batch along a path. Returns a table with one row before the path and one
/// after each call. A row has syy, sxx and def_yy of the first RVE, then those of the next RVEs.
Numbers follow(rve_batch *batch, const char *path, std::size_t calls = CALLS,
               std::vector<std::uint32_t> *statuses = nullptr)
{
  const std::size_t n = rve_batch_size(batch);
  Numbers table((calls + 1) * n * 3);
  std::vector<std::uint32_t> words(n);
  EXPECT_EQ(rve_follow_path(batch, nullptr, n, path, DT_DISKS, STEPS_PER_CALL, calls,
                            "syy sxx def_yy", table.data(), words.data()),
            RVE_SUCCESS)
      << rve_error();
  if (statuses) *statuses = words;
  return table;
}

}    // namespace

TEST(Librve, APathOfRatesIsAnAdvanceByTheirExponential)
{
  const Batch walked = batch_of(DISKS, 1), advanced = batch_of(DISKS, 1);
  const Numbers table = follow(walked.get(), "stage rate yy -0.5 until time > 1");
  const Numbers f = {1, 0, 0, std::exp(-0.5 * STEPS_PER_CALL * DT_DISKS)}, dt = {DT_DISKS};
  const std::int32_t steps = STEPS_PER_CALL;
  for (std::size_t call = 0; call < CALLS; ++call) {
    Numbers stress(4);
    ASSERT_EQ(rve_advance(advanced.get(), nullptr, 1, f.data(), dt.data(), &steps, stress.data(),
                          nullptr),
              RVE_SUCCESS);
    // The results are not bitwise equal: the path computes the matrix exponential by its series.
    EXPECT_NEAR(table[3 * (call + 1)], stress[3], 1e-9 * std::fabs(stress[3]));
  }
}

namespace {

/// Makes trials, advances, a path and tangents with a batch, saves and restores its RVEs in
/// between, and returns all results.
std::vector<Numbers> answers_of(const std::string &file, const std::string &options)
{
  const Batch batch = batch_of(file, 2, options.c_str());
  const int d = rve_batch_dimension(batch.get());
  std::vector<Numbers> answers;
  move(batch.get(), Kind::Trial, {0, 1}, 7);
  answers.push_back(move(batch.get(), Kind::Trial, {0, 1}, 1));
  EXPECT_EQ(rve_commit(batch.get()), RVE_SUCCESS);
  const std::vector<char> bytes = saved(batch.get());
  // The saved RVEs are also restored in a batch on CPU threads.
  const Batch on_cpu = batch_of(file, 2, OPTIONS);
  EXPECT_EQ(rve_restore(on_cpu.get(), bytes.data(), bytes.size()), RVE_SUCCESS) << rve_error();
  answers.push_back(move(on_cpu.get(), Kind::Advance, {0, 1}, 2));
  answers.push_back(move(batch.get(), Kind::Advance, {1}, 3));
  EXPECT_EQ(rve_restore(batch.get(), bytes.data(), bytes.size()), RVE_SUCCESS) << rve_error();
  answers.push_back(move(batch.get(), Kind::Advance, {0, 1}, 2));
  EXPECT_EQ(answers.back(), answers[1]);
  const std::size_t calls = 4;
  Numbers table((calls + 1) * 2 * 2), tangents(2 * (d == 2 ? 9 : 36));
  EXPECT_EQ(rve_follow_path(batch.get(), nullptr, 2,
                            "stage rate yy -0.1 stress xx -1e5 until time > 1",
                            d == 2 ? DT_DISKS : DT_SPHERES, STEPS_PER_CALL, calls, "syy void_ratio",
                            table.data(), nullptr),
            RVE_SUCCESS)
      << rve_error();
  answers.push_back(table);
  EXPECT_EQ(rve_tangents(batch.get(), nullptr, 2, "strain_steps 100 most_steps 500", nullptr,
                         tangents.data(), nullptr),
            RVE_SUCCESS)
      << rve_error();
  answers.push_back(tangents);
  return answers;
}

void expect_the_same_answers(const std::string &options)
{
  for (const std::string &file : {DISKS, SPHERES}) {
    const std::vector<Numbers> expected = answers_of(file, OPTIONS),
                               found = answers_of(file, options);
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t k = 0; k < found.size();
         ++k)    // NaN of a tangent that was not found counts as equal
      EXPECT_EQ(0,
                std::memcmp(found[k].data(), expected[k].data(), sizeof(double) * found[k].size()))
          << "answer " << k << " of " << file << " with " << options;
  }
}

}    // namespace

TEST(Librve, AnswersHaveTheSameBitsWithAnyNumberOfThreads)
{
  expect_the_same_answers("format double device cpu threads 2");
}

TEST(Librve, AnswersHaveTheSameBitsOnAGpu)
{
  const char *const options = "format double arithmetic strict device cuda";
  const Packing packing = read(DISKS);
  const rve_packing *const pointer = packing.get();
  rve_batch *batch = nullptr;
  const int code = rve_batch_create(&pointer, 1, options, &batch);
  const Batch owner(batch, rve_batch_free);
  if (code != RVE_SUCCESS) {
    const char *const required = std::getenv("GPU_RVE_REQUIRE_CUDA");
    ASSERT_TRUE(required == nullptr || std::string(required) != "1") << rve_error();
    GTEST_SKIP() << rve_error();
  }
  expect_the_same_answers(options);
}

TEST(Librve, PathHoldsAStressAndEndsAtItsCondition)
{
  const Batch batch = batch_of(DISKS, 2);
  const std::size_t calls = 60;
  const Numbers table = follow(batch.get(),
                               "path one stage rate yy -0.1 stress xx -1e5 until strain yy < -1e-3 "
                               "path two stage rate yy -0.1 rate xx 0 until time > 1",
                               calls);
  const double *last = &table[calls * 6];
  EXPECT_NEAR(last[1], -1e5, 2e3);    // amplitude of the servo's oscillation
  EXPECT_NEAR(last[2], std::exp(-1e-3), 0.1 * STEPS_PER_CALL * DT_DISKS);
  EXPECT_LT(last[3 + 1], -1.02e5);    // the sides of the other do not move
  EXPECT_EQ(Numbers(last, last + 3), Numbers(last - 6, last - 3));    // the first one has ended
  EXPECT_NE(last[3], last[3 - 6]);
}

TEST(Librve, InvalidPathChangesNothing)
{
  const Batch batch = batch_of(DISKS, 2);
  const std::vector<char> state = saved(batch.get());
  const Numbers untouched(100, 7.0);
  Numbers table = untouched;
  const auto expect = [&](const char *path, double dt, int steps, const char *names,
                          const std::string &text) {
    EXPECT_EQ(
        rve_follow_path(batch.get(), nullptr, 2, path, dt, steps, 2, names, table.data(), nullptr),
        RVE_BAD_INPUT);
    EXPECT_NE(std::string(rve_error()).find(text), std::string::npos) << rve_error();
    EXPECT_EQ(saved(batch.get()), state);
    EXPECT_EQ(table, untouched);
  };
  expect("stage rate yy v_x until time > 1", DT_DISKS, 1, "p", "the path has v_x");
  expect("stage rate yy 1 until time > 1", 0.0, 1, "p", "dt is 0 [time]; it must be positive");
  expect("stage rate yy 1 until time > 1", DT_DISKS, 0, "p", "substeps is 0");
  expect("stage rate yy 1 until time > 1", DT_DISKS, 1, "pea", "there is no");
  expect("stage rat yy 1", DT_DISKS, 1, "p", "path:1");
  // In one call, the second stage shears so much that the logarithm of the deformation is not
  // unique.
  expect("stage rate yy 0.1 until time > 1e-5 stage rate xy 1e9 until time > 1", DT_DISKS, 1, "p",
         "");
}

TEST(Librve, DamagedOrForeignBytesAreRefusedAndChangeNothing)
{
  const Batch batch = batch_of(DISKS, 2), spheres = batch_of(SPHERES, 2), one = batch_of(DISKS, 1);
  const std::vector<char> state = saved(batch.get());
  std::vector<char> damaged = state;
  damaged[damaged.size() / 2] ^= 1;
  EXPECT_EQ(rve_restore(batch.get(), damaged.data(), damaged.size()), RVE_BAD_INPUT);
  EXPECT_STREQ(rve_error(), "the saved RVEs are damaged");
  EXPECT_EQ(rve_restore(batch.get(), state.data(), 10), RVE_BAD_INPUT);
  EXPECT_EQ(rve_restore(spheres.get(), state.data(), state.size()), RVE_BAD_INPUT);
  EXPECT_STREQ(rve_error(), "the saved RVEs have dimension 2; the batch has dimension 3");
  EXPECT_EQ(rve_restore(one.get(), state.data(), state.size()), RVE_BAD_INPUT);
  EXPECT_STREQ(rve_error(), "there are 2 saved RVEs; the batch has 1");
  EXPECT_EQ(saved(batch.get()), state);
}

namespace {

std::uint64_t word_at(const std::vector<char> &bytes, std::size_t place)
{
  std::uint64_t word;
  std::memcpy(&word, bytes.data() + place, sizeof(word));
  return word;
}

void put_word(std::vector<char> &bytes, std::size_t place, std::uint64_t word)
{
  std::memcpy(bytes.data() + place, &word, sizeof(word));
}

// Byte positions in saved RVEs. The header has magic, dimension, number of RVEs, size and checksum.
// After the header come the size of the first record and the record itself.
constexpr std::size_t PLACE_OF_DIMENSION = 8, PLACE_OF_COUNT = 16, PLACE_OF_CHECKSUM = 32,
                      PLACE_OF_LENGTH = 40;

/// Returns the bytes as a release with interface 1.2 wrote them. In that version the checksum
/// covers only the records.
std::vector<char> first_version_of(std::vector<char> bytes)
{
  bytes[7] = '1';
  put_word(bytes, PLACE_OF_CHECKSUM,
           rve::checksum_of(bytes.data() + PLACE_OF_LENGTH, bytes.size() - PLACE_OF_LENGTH));
  return bytes;
}

}    // namespace

TEST(Librve, ADamagedHeaderOfSavedRvesIsRefused)
{
  const Batch one = batch_of(DISKS, 1), two = batch_of(DISKS, 2);
  const std::vector<char> state = saved(one.get()), before = saved(two.get());
  for (const std::size_t place : {PLACE_OF_DIMENSION, PLACE_OF_COUNT}) {
    std::vector<char> damaged = state;
    put_word(damaged, place, word_at(state, place) + 1);
    EXPECT_EQ(rve_restore(two.get(), damaged.data(), damaged.size()), RVE_BAD_INPUT);
    EXPECT_STREQ(rve_error(), "the saved RVEs are damaged");
  }
  // The following bytes have correct checksums, but a wrong count, length or dimension.
  const auto expect = [&](std::vector<char> bytes, const std::string &message) {
    bytes = first_version_of(bytes);
    rve_packing *packing = nullptr;
    EXPECT_EQ(rve_restore(two.get(), bytes.data(), bytes.size()), RVE_BAD_INPUT);
    EXPECT_NE(std::string(rve_error()).find(message), std::string::npos) << rve_error();
    EXPECT_EQ(rve_packing_restore(bytes.data(), bytes.size(), &packing), RVE_BAD_INPUT);
    EXPECT_EQ(packing, nullptr);
  };
  std::vector<char> bytes = state;
  put_word(bytes, PLACE_OF_COUNT, 2);
  expect(bytes, "the bytes end in RVE 1 of 2");
  for (const std::uint64_t length : {std::uint64_t(-1), std::uint64_t(1) << 40}) {
    bytes = before;
    put_word(bytes, PLACE_OF_LENGTH, length);
    expect(bytes, "the bytes end in RVE 0 of 2");
  }
  bytes = before;
  bytes.resize(bytes.size() + 3);
  put_word(bytes, 24, bytes.size());
  expect(bytes, "3 bytes are left over after 2 RVEs");
  bytes = state;
  put_word(bytes, PLACE_OF_DIMENSION, 4);
  expect(bytes, "their dimension is 4; it must be 2 or 3");
  EXPECT_EQ(saved(two.get()), before);
}

TEST(Librve, BytesOfTheFirstVersionAreRestored)
{
  const Batch batch = batch_of(DISKS, 2);
  const std::vector<char> state = saved(batch.get()), earlier = first_version_of(state);
  move(batch.get(), Kind::Advance, {0, 1}, 3);
  ASSERT_EQ(rve_restore(batch.get(), earlier.data(), earlier.size()), RVE_SUCCESS) << rve_error();
  EXPECT_EQ(saved(batch.get()), state);
}

TEST(Librve, ARefusedCallLeavesTheTrialBeforeIt)
{
  for (const std::string &file : {DISKS, SPHERES}) {
    const Batch batch = batch_of(file, 2), plain = batch_of(file, 2);
    const int d = rve_batch_dimension(batch.get());
    move(batch.get(), Kind::Trial, {0, 1}, 4);
    move(plain.get(), Kind::Advance, {0, 1}, 4);
    const double p = quantity(batch.get(), "p", 0);

    struct Call {
      Numbers increments, dt;
      std::vector<std::int32_t> substeps = {5, 5};
    };
    const Numbers f0 = increment(d, 0), f1 = increment(d, 1);
    Call good;
    good.increments = f0;
    good.increments.insert(good.increments.end(), f1.begin(), f1.end());
    good.dt.assign(2, d == 2 ? DT_DISKS : DT_SPHERES);
    std::vector<Call> refused(8, good);
    refused[0].dt[1] = -1.0;
    refused[1].dt[1] = std::nan("");
    refused[2].dt[1] = 1.0;
    refused[3].substeps[1] = -1;
    refused[4].increments.back() = std::nan("");
    refused[5].increments[d * d] = -1.0;
    refused[6].dt[0] = HUGE_VAL;
    refused[7].substeps[1] = 0;    // a deformation needs at least one step
    const auto expect_unchanged = [&](int code) {
      EXPECT_EQ(code, RVE_BAD_INPUT);
      EXPECT_EQ(quantity(batch.get(), "p", 0), p) << rve_error();
    };
    for (const Call &call : refused)
      for (const auto function : {rve_trial, rve_advance})
        expect_unchanged(function(batch.get(), nullptr, 2, call.increments.data(), call.dt.data(),
                                  call.substeps.data(), nullptr, nullptr));
    const std::size_t beyond[] = {0, 2};
    for (const std::size_t count : {1, 2, 3})
      expect_unchanged(rve_trial(batch.get(), count == 2 ? beyond : nullptr, count,
                                 good.increments.data(), good.dt.data(), good.substeps.data(),
                                 nullptr, nullptr));
    Numbers table(8);
    expect_unchanged(rve_follow_path(batch.get(), nullptr, 2, "stage rate yy -0.1 until time > 1",
                                     good.dt[0], 5, 1, "p", table.data(), nullptr));

    ASSERT_EQ(rve_commit(batch.get()), RVE_SUCCESS);
    EXPECT_EQ(saved(batch.get()), saved(plain.get()));
  }
}

TEST(Librve, AStepAboveTheStabilityBoundIsRefused)
{
  for (const std::string &file : {DISKS, SPHERES}) {
    const Batch batch = batch_of(file, 2);
    const std::vector<char> state = saved(batch.get());
    Numbers bounds(2);
    ASSERT_EQ(rve_time_steps(batch.get(), nullptr, 2, bounds.data()), RVE_SUCCESS);
    const int d = rve_batch_dimension(batch.get());
    Numbers increments(2 * d * d, 0.0);
    for (int k = 0; k < 2; ++k)
      for (int a = 0; a < d; ++a) increments[d * d * k + (d + 1) * a] = 1.0;
    const std::vector<std::int32_t> substeps = {1, 1};
    const auto call = [&](auto function, double share_of_second) {
      const Numbers dt = {0.9 * bounds[0], share_of_second * bounds[1]};
      return function(batch.get(), nullptr, 2, increments.data(), dt.data(), substeps.data(),
                      nullptr, nullptr);
    };
    // A dt of 1.7 bounds must be refused in the first call, after a valid trial, and in an advance.
    for (int k = 0; k < 2; ++k) {
      EXPECT_EQ(call(rve_trial, 1.7), RVE_BAD_INPUT);
      EXPECT_NE(std::string(rve_error()).find("dt of RVE 1 is "), std::string::npos) << rve_error();
      EXPECT_NE(std::string(rve_error()).find("at most the stability bound"), std::string::npos);
      EXPECT_EQ(call(rve_trial, 1.0), RVE_SUCCESS) << rve_error();
    }
    ASSERT_EQ(rve_revert(batch.get()), RVE_SUCCESS);
    EXPECT_EQ(call(rve_advance, 1.7), RVE_BAD_INPUT);
    EXPECT_EQ(saved(batch.get()), state);
    // Without steps, a call accepts any dt.
    const std::vector<std::int32_t> none = {0, 0};
    const Numbers dt(2, 1.0);
    EXPECT_EQ(rve_trial(batch.get(), nullptr, 2, increments.data(), dt.data(), none.data(), nullptr,
                        nullptr),
              RVE_SUCCESS)
        << rve_error();
    ASSERT_EQ(rve_revert(batch.get()), RVE_SUCCESS);
    // A path with too large a dt is refused as well.
    Numbers table(16, -7.0);
    EXPECT_EQ(rve_follow_path(batch.get(), nullptr, 2, "stage rate yy -0.1 until time > 1",
                              1.7 * bounds[0], 5, 3, "p", table.data(), nullptr),
              RVE_BAD_INPUT);
    EXPECT_NE(std::string(rve_error()).find("stability bound"), std::string::npos) << rve_error();
    EXPECT_EQ(table, Numbers(16, -7.0));
    EXPECT_EQ(saved(batch.get()), state);
  }
}

TEST(Librve, AStepThatGrowingStiffnessMakesTooLongIsRefused)
{
  // Under compression, the stiffness of Hertz contacts increases with their overlaps, while hardly
  // any contact is added.
  rve_packing *packing = nullptr;
  ASSERT_EQ(rve_packing_create("shape disk grains 60 seed 1 radius uniform 0.003 0.006 density "
                               "2650 pressure 1e3 thickness 0.075 contact hertz hertz_kn 5e9 "
                               "mindlin_kt 4e9 friction 0.5 damping 0.7",
                               &packing),
            RVE_SUCCESS)
      << rve_error();
  const Packing owner(packing, rve_packing_free);
  const Batch batch = batch_of({packing});
  double dt = 0.0;
  ASSERT_EQ(rve_time_steps(batch.get(), nullptr, 1, &dt), RVE_SUCCESS);
  const double f = std::exp(-5e-4);
  const Numbers increments = {f, 0, 0, f};
  const std::int32_t substeps = 200;
  dt *= 0.9;
  int code = RVE_SUCCESS, calls = 0;
  std::uint32_t status = 0;
  for (; calls < 40 && code == RVE_SUCCESS; ++calls) {
    code =
        rve_advance(batch.get(), nullptr, 1, increments.data(), &dt, &substeps, nullptr, &status);
    EXPECT_EQ(status, 0u) << rve_status_text(status);
  }
  EXPECT_EQ(code, RVE_BAD_INPUT);
  EXPECT_GT(calls, 1);
  EXPECT_NE(std::string(rve_error()).find("stability bound"), std::string::npos) << rve_error();
  double bound = 0.0;
  ASSERT_EQ(rve_time_steps(batch.get(), nullptr, 1, &bound), RVE_SUCCESS);
  EXPECT_LT(bound, dt);
}

TEST(Librve, MoreRowsThanMemoryCanHaveAreRefused)
{
  const Batch batch = batch_of(DISKS, 1);
  const std::vector<char> state = saved(batch.get());
  double table[4] = {-7.0, -7.0, -7.0, -7.0};
  const std::size_t most = std::numeric_limits<std::size_t>::max();
  for (const std::size_t calls : {most, most - 1, most / 8, most / 16 + 1}) {
    EXPECT_EQ(rve_follow_path(batch.get(), nullptr, 1, "stage rate yy -0.1 until time > 1",
                              DT_DISKS, 1, calls, "p q", table, nullptr),
              RVE_BAD_INPUT)
        << calls;
    EXPECT_EQ(table[0], -7.0);
  }
  std::vector<std::size_t> which(3, 0);
  EXPECT_EQ(rve_time_steps(batch.get(), which.data(), most, table), RVE_BAD_INPUT);
  EXPECT_EQ(saved(batch.get()), state);
}

TEST(Librve, APackingThatDriftsIsRefused)
{
  auto state = rve::read_packing<2>(DISKS);
  for (std::size_t k = 0; k < state.velocity.size(); ++k) state.velocity[k] += k % 2 ? -5.0 : 10.0;
  const std::string file = "test_librve_drift.rve";
  rve::write_packing(file, state);
  rve_packing *packing = nullptr;
  EXPECT_EQ(rve_packing_read(file.c_str(), &packing), RVE_BAD_INPUT);
  EXPECT_NE(std::string(rve_error()).find("has a mean velocity (10, -5) [length/time]"),
            std::string::npos)
      << rve_error();
  std::size_t count = 0;
  EXPECT_EQ(rve_library_read(file.c_str(), nullptr, 0, &count), RVE_BAD_INPUT);
  std::remove(file.c_str());
}

TEST(Librve, AFailureHasAStatusAndKeepsTheState)
{
  const Batch batch = batch_of(DISKS, 2);
  const std::vector<char> state = saved(batch.get());
  // In one step, RVE 0 is compressed to half of its width and height.
  const Numbers increments = {0.5, 0, 0, 0.5, 1, 0, 0, 1}, dt(2, DT_DISKS);
  const std::int32_t substeps[] = {1, 1};
  std::uint32_t statuses[2] = {0, 0};
  Numbers stresses(8);
  ASSERT_EQ(rve_trial(batch.get(), nullptr, 2, increments.data(), dt.data(), substeps,
                      stresses.data(), statuses),
            RVE_SUCCESS);
  EXPECT_NE(statuses[0] & rve_status_fatal(), 0u);
  EXPECT_EQ(statuses[1], 0u);
  EXPECT_STRNE(rve_status_text(statuses[0]), "ok");
  EXPECT_STREQ(rve_status_text(0), "ok");
  ASSERT_EQ(rve_revert(batch.get()), RVE_SUCCESS);
  EXPECT_EQ(saved(batch.get()), state);
}

TEST(Librve, BatchesUseTheirOwnThreads)
{
  const Batch one = batch_of(DISKS, 2), other = batch_of(DISKS, 2), alone = batch_of(DISKS, 2);
  const auto work = [](rve_batch *batch) {
    for (int k = 0; k < 5; ++k) move(batch, Kind::Advance, {0, 1}, k);
    double none = 0.0;
    EXPECT_EQ(rve_quantity(batch, "nothing", nullptr, 2, &none), RVE_BAD_INPUT);
  };
  std::thread first(work, one.get()), second(work, other.get());
  first.join();
  second.join();
  work(alone.get());
  EXPECT_EQ(saved(one.get()), saved(alone.get()));
  EXPECT_EQ(saved(other.get()), saved(alone.get()));
}

// Four threads create batches of two threads each, make trials, save and cause errors. No batch is
// allowed to affect another one, and each thread must read its own error.
TEST(Librve, ThreadsShareNothing)
{
  const char *const options = "format double device cpu threads 2";
  const auto work = [&](int number, std::vector<char> *bytes) {
    const Batch batch = batch_of(number % 2 == 0 ? DISKS : SPHERES, 2, options);
    const std::string wrong = "of_thread_" + std::to_string(number);
    for (int k = 0; k < 3; ++k) {
      move(batch.get(), Kind::Trial, {0, 1}, 10 * number + k);
      double none = 0.0;
      EXPECT_EQ(rve_quantity(batch.get(), wrong.c_str(), nullptr, 2, &none), RVE_BAD_INPUT);
      EXPECT_EQ(rve_commit(batch.get()), RVE_SUCCESS);
      const std::vector<char> now = saved(batch.get());
      EXPECT_EQ(rve_quantity(batch.get(), wrong.c_str(), nullptr, 2, &none), RVE_BAD_INPUT);
      EXPECT_NE(std::string(rve_error()).find("'" + wrong + "'"), std::string::npos) << rve_error();
      *bytes = now;
    }
  };
  std::vector<std::vector<char>> together(4), alone(4);
  std::vector<std::thread> threads;
  for (int k = 0; k < 4; ++k) threads.emplace_back(work, k, &together[k]);
  for (std::thread &thread : threads) thread.join();
  for (int k = 0; k < 4; ++k) work(k, &alone[k]);
  EXPECT_EQ(together, alone);
}

TEST(Librve, AffineStiffnessIsTheFirstStepFromRest)
{
  // The affine stiffness is the ratio of stress change to strain in one small step, in which the
  // grains follow the mean deformation.
  const Batch batch = batch_of(DISKS, 1);
  Numbers stiffness(4 * 3);
  ASSERT_EQ(rve_affine_stiffness(batch.get(), nullptr, 1, stiffness.data()), RVE_SUCCESS);
  const double s0 = quantity(batch.get(), "syy", 0), strain = 1e-8;
  const Numbers increments = {1.0, 0.0, 0.0, 1.0 + strain}, dt = {1e-9};
  const std::int32_t substeps = 1;
  Numbers stress(4);
  ASSERT_EQ(rve_trial(batch.get(), nullptr, 1, increments.data(), dt.data(), &substeps,
                      stress.data(), nullptr),
            RVE_SUCCESS);
  // The component relates the stress yy to the strain yy.
  EXPECT_NEAR((stress[3] - s0) / strain, stiffness[3 * 3 + 1], 1e-4 * stiffness[3 * 3 + 1]);
}

TEST(Librve, PreparesAPackingFromWords)
{
  rve_packing *packing = nullptr;
  ASSERT_EQ(
      rve_packing_create("shape disk grains 60 seed 3 radius_min 0.0025 radius_max 0.005 kn "
                         "1e6 friction 0.5 density 2650 damping 0.3 thickness 0.075 mass_depth "
                         "0.075 pressure 1e5",
                         &packing),
      RVE_SUCCESS)
      << rve_error();
  const Packing owner(packing, rve_packing_free);
  EXPECT_EQ(rve_packing_grains(packing), 60u);
  double kt = 0.0;
  ASSERT_EQ(rve_packing_parameter(packing, "kt", &kt), RVE_SUCCESS);
  EXPECT_EQ(kt, 1e6);
  const Batch batch = batch_of({packing});
  EXPECT_NEAR(quantity(batch.get(), "p", 0), 1e5, 1e3);
  EXPECT_NEAR(quantity(batch.get(), "void_ratio", 0), rve_packing_void_ratio(packing), 1e-12);
}

namespace {

Packing created(const std::string &recipe)
{
  rve_packing *packing = nullptr;
  EXPECT_EQ(rve_packing_create(recipe.c_str(), &packing), RVE_SUCCESS) << rve_error();
  return {packing, rve_packing_free};
}

Numbers array(const Packing &packing, const char *name, std::size_t count)
{
  Numbers values(count);
  EXPECT_EQ(rve_packing_array(packing.get(), name, values.data(), count), RVE_SUCCESS)
      << rve_error();
  return values;
}

const std::string GROUND =
    "grains 60 seed 3 radius uniform 0.0025 0.005 kn 1e6 friction 0.5 density 2650 damping 0.3 "
    "thickness 0.075 mass_depth 0.075 friction_prep 0.3 ";

std::string without(std::string words, const std::string &part)
{
  return words.erase(words.find(part), part.size());
}

double parameter(const Packing &packing, const char *keyword)
{
  double value = 0.0;
  EXPECT_EQ(rve_packing_parameter(packing.get(), keyword, &value), RVE_SUCCESS) << rve_error();
  return value;
}

}    // namespace

// The ratio of lateral to vertical stress is the earth pressure at rest, about 1 - sin(phi) (Jaky
// 1944). The angle of friction phi of the grains is about 25 degrees.
TEST(Librve, GrainsFindTheirEarthPressureAtRest)
{
  const Packing rest = created(GROUND + "pressure 20e3 k0 rest");
  // With `k0 rest` the preparation fixes the sides at this lower pressure. Only the height changes
  // up to 20e3.
  const Packing before = created(GROUND + "pressure 1e3");
  const Batch batch = batch_of({rest.get()});

  EXPECT_NEAR(quantity(batch.get(), "syy", 0), -20e3, 21.0);    // tolerance of the recipe, 1e-3
  EXPECT_NEAR(quantity(batch.get(), "sxx", 0) / quantity(batch.get(), "syy", 0), 0.55, 0.25);
  const Numbers cell = array(rest, "cell", 4), first = array(before, "cell", 4);
  EXPECT_EQ(cell[0], first[0]);
  EXPECT_LT(cell[3], first[3]);
}

TEST(Librve, ArgumentsOfAScriptGiveItsPacking)
{
  const Packing by_script = created(GROUND + "pressure 1e4");
  std::string bounds = GROUND;
  bounds.replace(bounds.find("radius uniform 0.0025 0.005"), 27,
                 "radius_min 0.0025 radius_max 0.005");
  const Packing by_bounds = created(bounds + "pressure 1e4 device cpu threads 2");
  EXPECT_EQ(array(by_script, "position", 120), array(by_bounds, "position", 120));

  const double wanted = rve_packing_void_ratio(by_script.get()) - 0.02;
  std::string looked_for = GROUND;
  looked_for.erase(looked_for.find("friction_prep 0.3 "));
  const Packing met = created(looked_for + "pressure 1e4 void_ratio " + std::to_string(wanted) +
                              " void_ratio_tolerance 0.005");
  EXPECT_NEAR(rve_packing_void_ratio(met.get()), wanted, 0.005);
}

// The stiffnesses are 4/3 E* and 8 G* of two equal bodies.
TEST(Librve, ContactsInTheWordsOfLammpsAreThoseOfSingleKeywords)
{
  const double E = 1e8, nu = 0.25;
  const std::string grains = "shape sphere grains 60 radius uniform 0.0025 0.005 density 2650 "
                             "damping 0.3 pressure 2e4 ";
  const Packing by_law = created(
      grains + "contact hertz/material 1e8 0 0.25 tangential mindlin NULL 0.5 0.4 tolerance 1e-2");
  EXPECT_NEAR(parameter(by_law, "hertz_kn"), 2.0 / 3.0 * E / (1.0 - nu * nu), 1e-14 * E);
  EXPECT_NEAR(parameter(by_law, "mindlin_kt"), 2.0 * E / ((2.0 - nu) * (1.0 + nu)), 1e-14 * E);
  EXPECT_EQ(parameter(by_law, "friction"), 0.4);

  std::size_t size = 0;
  const char *words = "hertz/material 1e8 0 0.25 tangential mindlin NULL 0.5 0.4";
  ASSERT_EQ(rve_contact_words(words, 3, nullptr, 0, &size), RVE_SUCCESS) << rve_error();
  std::string keywords(size, ' ');
  ASSERT_EQ(rve_contact_words(words, 3, keywords.data(), size, &size), RVE_SUCCESS) << rve_error();
  const Packing by_keywords = created(grains + keywords + " tolerance 1e-2");
  EXPECT_EQ(array(by_law, "position", 180), array(by_keywords, "position", 180));
}

TEST(Librve, PackingsHaveTheGradingOfTheirRecipe)
{
  const Packing packing = created(without(GROUND, "radius uniform 0.0025 0.005 ") +
                                  "pressure 1e4 grading 0.004 0 0.008 60 0.016 100");
  const Numbers radius = array(packing, "radius", 60);
  double below = 0.0, all = 0.0, diameter = 0.0;
  for (const double r : radius) {
    below += r < 0.004 ? r * r : 0.0;
    all += r * r;
  }
  EXPECT_NEAR(below / all, 0.6, 0.03);    // a grain of 8 mm has 2.5 % of the area
  ASSERT_EQ(rve_packing_diameter(packing.get(), 100.0, &diameter), RVE_SUCCESS);
  EXPECT_EQ(diameter, 2.0 * *std::max_element(radius.begin(), radius.end()));
  std::size_t needed = 0;
  ASSERT_EQ(rve_grains_needed("shape disk grading 1 0 1.0001 100", &needed), RVE_SUCCESS);
  EXPECT_NEAR(static_cast<double>(needed), 50.0, 1.0);    // 5 of 50 grains have a tenth of the mass
}

TEST(Librve, ReadsLibrariesAndImagesOfTheirPackings)
{
  rve::PackingLibrary library;
  for (const std::uint64_t seed : {1, 2}) {
    rve::RveState state = rve::read_packing(DISKS);
    state.radius[0] *= 1.0 - 1e-3 * static_cast<double>(seed);
    library.add({seed, state.void_ratio(), 0.0, 1.0, 0.0, state.num_grains()}, state);
  }
  const std::string file = testing::TempDir() + "test_librve.library";
  rve::write_library(file, library);

  std::size_t count = 0;
  ASSERT_EQ(rve_library_read(file.c_str(), nullptr, 0, &count), RVE_SUCCESS) << rve_error();
  ASSERT_EQ(count, 2u);
  rve_packing *pointers[2] = {nullptr, nullptr};
  EXPECT_EQ(rve_library_read(file.c_str(), pointers, 1, &count), RVE_BAD_INPUT);
  EXPECT_STREQ(rve_error(), "capacity is 1 packings; it must be at least 2");
  EXPECT_EQ(pointers[0], nullptr);
  ASSERT_EQ(rve_library_read(file.c_str(), pointers, 2, &count), RVE_SUCCESS) << rve_error();
  std::remove(file.c_str());
  const Packing first(pointers[0], rve_packing_free), second(pointers[1], rve_packing_free);
  EXPECT_EQ(rve_packing_void_ratio(first.get()), library.index[0].void_ratio);
  EXPECT_EQ(rve_packing_void_ratio(second.get()), library.index[1].void_ratio);
  ASSERT_EQ(rve_library_read(DISKS.c_str(), pointers, 2, &count), RVE_SUCCESS) << rve_error();
  const Packing alone(pointers[0], rve_packing_free);
  EXPECT_EQ(count, 1u);

  // Image 4 is mirrored along x. It has the same normal stresses and the opposite shear stress.
  rve_packing *seen = nullptr;
  EXPECT_EQ(rve_packing_image(alone.get(), 8, &seen), RVE_BAD_INPUT);
  EXPECT_NE(std::string(rve_error()).find("8"), std::string::npos) << rve_error();
  ASSERT_EQ(rve_packing_image(alone.get(), 4, &seen), RVE_SUCCESS) << rve_error();
  const Packing mirrored(seen, rve_packing_free);
  const Batch batch = batch_of({alone.get(), mirrored.get()});
  const double p = quantity(batch.get(), "p", 0);
  for (const char *name : {"sxx", "syy"})
    EXPECT_NEAR(quantity(batch.get(), name, 1), quantity(batch.get(), name, 0), 1e-9 * p);
  EXPECT_NE(quantity(batch.get(), "sxy", 0), 0.0);
  EXPECT_NEAR(quantity(batch.get(), "sxy", 1), -quantity(batch.get(), "sxy", 0), 1e-9 * p);
}

TEST(Librve, TangentsAreProbedInTheRequestedFormat)
{
  const Batch fast = batch_of(DISKS, 1, "format fast device cpu threads 1"),
              exact = batch_of(DISKS, 1, OPTIONS);
  const auto tangent = [](const Batch &batch, const char *options) {
    Numbers values(9);
    EXPECT_EQ(rve_tangents(batch.get(), nullptr, 1, options, nullptr, values.data(), nullptr),
              RVE_SUCCESS)
        << rve_error();
    return values;
  };
  const char *const words = "format double strain_steps 100 most_steps 500";
  EXPECT_EQ(tangent(exact, words), tangent(exact, "strain_steps 100 most_steps 500"));
  // The tangents of both batches differ because format fast rounds the grains of the state.
  const Numbers of_fast = tangent(fast, words), of_exact = tangent(exact, words);
  for (int k = 0; k < 9; ++k) EXPECT_NEAR(of_fast[k], of_exact[k], 0.02 * of_exact[0]);
}

TEST(Librve, ContactsGiveTheStressByLove)
{
  const Packing packing = read(SPHERES);
  std::size_t rows = 0;
  ASSERT_EQ(rve_packing_contacts(packing.get(), &rows), RVE_SUCCESS);
  const std::size_t columns = rve_contact_columns(3);
  Numbers table(rows * columns), cell(9);
  ASSERT_EQ(rve_packing_contact_table(packing.get(), table.data(), table.size()), RVE_SUCCESS);
  ASSERT_EQ(rve_packing_array(packing.get(), "cell", cell.data(), 9), RVE_SUCCESS);
  double sum = 0.0;
  for (std::size_t k = 0; k < rows; ++k) {
    const double *row = &table[k * columns];
    sum += row[7 + 2] * row[2 + 2];    // force_z branch_z
  }
  const double volume = cell[0] * cell[4] * cell[8];    // the cell has right angles
  const Batch batch = batch_of({packing.get()});
  EXPECT_NEAR(sum / volume, quantity(batch.get(), "szz", 0), 1e-9 * std::fabs(sum / volume));
}

TEST(Librve, WrongInputIsNamedAndThrowsNothing)
{
  const Packing disks = read(DISKS), spheres = read(SPHERES);
  rve_packing *packing = nullptr;
  rve_batch *none = nullptr;
  const Batch batch = batch_of({disks.get(), disks.get()});
  double value = 0.0;
  const auto expect = [](int code, const std::string &text) {
    EXPECT_EQ(code, RVE_BAD_INPUT);
    EXPECT_NE(std::string(rve_error()).find(text), std::string::npos) << rve_error();
  };
  expect(rve_packing_read("nowhere.rve", &packing), "nowhere.rve");
  expect(rve_packing_read(nullptr, &packing), "file is a null pointer");
  expect(rve_packing_read(DISKS.c_str(), nullptr), "packing is a null pointer");
  EXPECT_EQ(packing, nullptr);
  expect(rve_packing_create("shape disk grains 60", &packing),
         "the recipe lacks radius_min, radius_max, density, pressure, kn");
  expect(rve_packing_create("shape cube", &packing), "shape is 'cube'; it must be disk or sphere");
  expect(rve_packing_create("k0 lest", &packing), "k0 is 'lest'; it must be a number or rest");
  expect(rve_packing_create("radius uniform 1", &packing), "radius has 2 of its 3 values");
  expect(rve_packing_create("radius constant 1 2", &packing),
         "radius is 'constant'; it must be uniform");
  expect(rve_packing_create("radius uniform 1 x", &packing), "radius is 'x'; it must be a number");
  expect(rve_packing_create("radius lognormal 1 2", &packing), "radius has 3 of its 5 values");
  expect(rve_packing_create("grading 1 0 2", &packing),
         "grading has 3 numbers; it must have pairs");
  expect(rve_packing_create("grading 1 0 2 100 radius uniform 1 2", &packing),
         "grading and radius exclude each other");
  expect(rve_packing_create("contact hertz/material seed 1", &packing),
         "contact E is 'seed'; it must be a number");
  expect(rve_packing_create("contact hertz/material 1e8", &packing),
         "contact eta_n has no value; it must read: contact hooke k_n eta_n");
  expect(rve_packing_create("contact hooke 1 0 tangential linear_history 1 0 0.5 kn 1", &packing),
         "contact and kn exclude each other");
  std::size_t number = 0;
  expect(rve_grains_needed("shape disk grains 3", &number), "unknown keyword 'grains'");
  expect(rve_grains_needed("shape disk", &number), "radius or grading must be given");
  expect(
      rve_contact_words("hooke 1 0 tangential linear_history 1 0 0.5 kn", 2, nullptr, 0, &number),
      "found 'kn' after the words of contact");
  expect(rve_packing_create("radius uniform 1 2 radius_min 1", &packing),
         "radius and radius_min exclude each other");
  expect(rve_packing_create((GROUND + "pressure 1e4 void_ratio 0.2").c_str(), &packing),
         "preparation friction; friction_prep is 0.3");
  expect(rve_packing_create("shape sphere grains 60 radius uniform 1e-3 2e-3 density 2650 pressure "
                            "1e4 contact hertz hertz_kn 1e9 rolling_friction 0.1",
                            &packing),
         "rolling_friction is 0.1 [-] without a kr");
  expect(rve_packing_create("frition 0.5", &packing), "did you mean friction");
  expect(rve_packing_parameter(disks.get(), "k_twist", &value), "no parameter 'k_twist'");
  expect(rve_packing_set_parameter(disks.get(), "kn", -1.0), "normal stiffness is -1");
  EXPECT_EQ(rve_packing_parameter(disks.get(), "kn", &value), RVE_SUCCESS);
  EXPECT_GT(value, 0.0);
  expect(rve_packing_array(disks.get(), "radii", &value, 1), "no array 'radii'");
  expect(rve_packing_array(disks.get(), "radius", &value, 1), "count is 1; it must be 400");
  const rve_packing *mixed[] = {disks.get(), spheres.get()};
  expect(rve_batch_create(mixed, 2, nullptr, &none),
         "packing 0 has disks, but packing 1 has spheres");
  expect(rve_batch_create(mixed, 0, nullptr, &none), "count is 0");
  expect(rve_batch_create(mixed, 1, "format quad", &none),
         "format is 'quad'; it must be fast or mixed or double or single");
  expect(rve_batch_create(mixed, 1, "format", &none), "format has no value");
  expect(rve_batch_create(mixed, 1, "threads 1 threads 2", &none), "threads is given twice");
  EXPECT_EQ(none, nullptr);
  const Numbers increments = {1, 0, 0, 1}, dt = {-1.0}, good = {1e-6};
  const std::int32_t substeps = 1;
  const std::size_t beyond = 2, twice[] = {0, 0};
  expect(rve_trial(batch.get(), &beyond, 1, increments.data(), good.data(), &substeps, nullptr,
                   nullptr),
         "which[0] is 2; it must be below 2");
  expect(rve_time_steps(batch.get(), twice, 2, &value), "RVE 0 twice");
  expect(rve_time_steps(batch.get(), nullptr, 1, &value),
         "count is 1; it must be the number of RVEs, 2");
  const std::size_t first = 0;
  expect(
      rve_trial(batch.get(), &first, 1, increments.data(), dt.data(), &substeps, nullptr, nullptr),
      "-1");
  expect(rve_trial(batch.get(), &first, 1, nullptr, good.data(), &substeps, nullptr, nullptr),
         "increments is a null pointer");
  // An advance is refused while a trial is pending.
  move(batch.get(), Kind::Trial, {0}, 0);
  Numbers more = increments;
  expect(rve_advance(batch.get(), &first, 1, more.data(), good.data(), &substeps, nullptr, nullptr),
         "an RVE has a trial");
  std::size_t size = 0;
  char byte;
  expect(rve_save(batch.get(), &byte, 1, &size), "capacity is 1 bytes");
  expect(rve_commit(nullptr), "batch is a null pointer");
  rve_packing_free(nullptr);
  rve_batch_free(nullptr);
}

TEST(Librve, ABatchOnCpuThreadsTakesNoArraysOfADevice)
{
  const Batch batch = batch_of(DISKS, 1);
  const std::vector<char> state = saved(batch.get());
  const Numbers increments = {1, 0, 0, 1}, dt = {DT_DISKS};
  const std::int32_t substeps = 1;
  // The call must neither read nor write this invalid address.
  double *const array = reinterpret_cast<double *>(8);
  const auto expect = [](int code, const std::string &name) {
    EXPECT_EQ(code, RVE_BAD_INPUT);
    const std::string text =
        name + " must not be in the memory of a device: the batch is on 1 CPU ";
    EXPECT_EQ(std::string(rve_error()).find(text), 0u) << rve_error();
  };
  EXPECT_EQ(rve_batch_device_number(batch.get()), -1);
  EXPECT_EQ(rve_batch_device_number(nullptr), -1);
  for (const auto call : {rve_trial_device, rve_advance_device})
    expect(call(batch.get(), nullptr, 1, array, dt.data(), &substeps, array, nullptr),
           "increments");
  expect(rve_quantity_device(batch.get(), "p", nullptr, 1, array), "values");
  expect(rve_affine_stiffness_device(batch.get(), nullptr, 1, array), "stiffness");
  EXPECT_EQ(
      rve_trial_device(batch.get(), nullptr, 1, nullptr, dt.data(), &substeps, array, nullptr),
      RVE_BAD_INPUT);
  EXPECT_STREQ(rve_error(), "increments is a null pointer");
  EXPECT_EQ(saved(batch.get()), state);
}

TEST(Librve, QuantitiesAreThoseOfTheDimension)
{
  const auto has = [](int dimension, const std::string &name) {
    for (std::size_t k = 0; k < rve_num_quantities(dimension); ++k)
      if (name == rve_quantity_name(dimension, k)) return true;
    return false;
  };
  EXPECT_TRUE(has(2, "sxx") && has(3, "sxx") && has(3, "szz"));
  EXPECT_FALSE(has(2, "szz"));
  EXPECT_STREQ(rve_quantity_name(2, 1000), "");
  for (const int dimension : {-1, 0, 1, 4, 7}) {
    EXPECT_EQ(rve_num_quantities(dimension), 0u) << dimension;
    EXPECT_EQ(rve_quantity_name(dimension, 0), nullptr) << dimension;
  }
}

TEST(Librve, EveryQuantityHasANumber)
{
  for (const std::string &file : {DISKS, SPHERES}) {
    const Batch batch = batch_of(file, 2);
    move(batch.get(), Kind::Advance, {0, 1}, 1);
    const int d = rve_batch_dimension(batch.get());
    ASSERT_GT(rve_num_quantities(d), 0u);
    for (std::size_t k = 0; k < rve_num_quantities(d); ++k) {
      Numbers values(2, NAN);
      EXPECT_EQ(rve_quantity(batch.get(), rve_quantity_name(d, k), nullptr, 2, values.data()),
                RVE_SUCCESS)
          << rve_error();
      for (const double value : values)
        EXPECT_TRUE(std::isfinite(value)) << rve_quantity_name(d, k) << " of dimension " << d;
    }
  }
}

TEST(Librve, APackingFileReturnsWhatWasWritten)
{
  for (const std::string &file : {DISKS, SPHERES}) {
    const Batch batch = batch_of(file, 1);
    move(batch.get(), Kind::Advance, {0}, 1);
    rve_packing *now = nullptr;
    ASSERT_EQ(rve_batch_packing(batch.get(), 0, &now), RVE_SUCCESS);
    const Packing written(now, rve_packing_free);
    ASSERT_EQ(rve_packing_set_parameter(now, "friction", 0.3), RVE_SUCCESS) << rve_error();
    const std::string name = testing::TempDir() + "test_librve.rve";
    ASSERT_EQ(rve_packing_write(now, name.c_str()), RVE_SUCCESS) << rve_error();

    const Packing back = read(name);

    std::remove(name.c_str());
    const int d = rve_packing_dimension(now);
    const std::size_t n = rve_packing_grains(now), spins = d == 2 ? n : 3 * n;
    ASSERT_EQ(rve_packing_grains(back.get()), n);
    ASSERT_EQ(rve_packing_dimension(back.get()), d);
    const auto expect_same = [&](const char *values, std::size_t count) {
      EXPECT_EQ(array(back, values, count), array(written, values, count)) << values;
    };
    expect_same("cell", d * d);
    expect_same("radius", n);
    expect_same("position", d * n);
    expect_same("velocity", d * n);
    expect_same("spin", spins);
    double friction = 0.0;
    ASSERT_EQ(rve_packing_parameter(back.get(), "friction", &friction), RVE_SUCCESS);
    EXPECT_EQ(friction, 0.3);
    std::size_t contacts = 0, contacts_back = 0;
    ASSERT_EQ(rve_packing_contacts(now, &contacts), RVE_SUCCESS);
    ASSERT_EQ(rve_packing_contacts(back.get(), &contacts_back), RVE_SUCCESS);
    EXPECT_EQ(contacts_back, contacts);
    EXPECT_EQ(rve_packing_write(now, "nowhere/at.rve"), RVE_BAD_INPUT);
    EXPECT_NE(std::string(rve_error()).find("nowhere/at.rve"), std::string::npos) << rve_error();
  }
}
