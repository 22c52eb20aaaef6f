// SPDX-License-Identifier: GPL-2.0-only
// The hashes of states depend on each bit of a state. They do not depend on the order of its pairs
// and grains.

#include "rve/core/space.h"
#include "rve/engine/contact_laws.h"
#include "state_hash.h"
#include "support/packings.h"
#include "support/random.h"
#include "support/spheres.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <numeric>
#include <set>

using namespace rve;
using namespace rve_test;

namespace {

template <int D> std::uint64_t hash_of(const RveStateOf<D> &state)
{
  BitHash hash;
  golden::add_state(hash, state);
  return hash.value();
}

template <int D> std::uint64_t list_hash_of(const RveStateOf<D> &state)
{
  BitHash hash;
  golden::add_list(hash, state);
  return hash.value();
}

constexpr int GRAINS = 6;

/// Returns a state in which all numbers except some histories are random. Grains form a ring, with
/// pairs of neighbours and next neighbours. In every other pair the grains are exchanged. Every
/// third pair has no history.
template <int D> RveStateOf<D> full_state()
{
  Random random(3);
  const auto some = [&] {
    const double size = random.uniform(0.1, 1.0);
    return random.integer(0, 1) == 1 ? -size : size;
  };
  RveStateOf<D> state;
  state.material.law = ContactLaw::Dmt;
  for (const MaterialParameter &parameter : MATERIAL_PARAMETERS)
    state.material.*parameter.member = some();
  for (Tensor<double, D> *tensor :
       {&state.cell, &state.deformation, &state.list_cell, &state.servo_velocity_gradient})
    for (double &x : tensor->component) x = some();
  for (int i = 0; i < GRAINS; ++i) {
    state.radius.push_back(some());
    for (int a = 0; a < D; ++a) {
      state.fractional.push_back(random.bits());
      state.list_fractional.push_back(random.bits());
      state.velocity.push_back(some());
    }
    for (int k = 0; k < Space<D>::spins; ++k) state.spin.push_back(some());
    state.order.push_back(GRAINS - 1 - i);
  }
  for (int step = 1; step <= 2; ++step)
    for (int i = 0; i < GRAINS; ++i) {
      PairOf<D> pair{};
      pair.first = i;
      pair.second = (i + step) % GRAINS;
      if (i % 2 == 1) std::swap(pair.first, pair.second);
      if (i % 3 != 2)
        for (const RememberedNumber<D> &number : pair_memory<D>()) number.of(pair) = some();
      state.pairs.push_back(pair);
    }
  state.list_margin = some();
  state.largest_contact_force = some();
  return state;
}

/// Returns the pair with exchanged grains. The contact law of the material transforms the history
/// of the pair.
template <int D> PairOf<D> with_other_owner(const PairOf<D> &pair, const Material &material)
{
  PairOf<D> seen = pair;
  with_law<D>(material, [&](const auto &law) {
    law.to_pair(law.seen_from_partner(law.of_pair(pair)), seen);
  });
  std::swap(seen.first, seen.second);
  for (const RememberedNumber<D> &number : pair_memory<D>())
    number.of(seen) += 0.0;    // turns -0 into 0, as an engine does
  return seen;
}

/// Returns the state with another order of pairs and grains. About half of the pairs have exchanged
/// grains.
template <int D> RveStateOf<D> shuffled(RveStateOf<D> state, int seed)
{
  Random random(static_cast<std::uint64_t>(seed));
  const auto shuffle = [&](auto &values) {
    for (int k = static_cast<int>(values.size()) - 1; k > 0; --k)
      std::swap(values[k], values[random.integer(0, k)]);
  };
  shuffle(state.pairs);
  for (PairOf<D> &pair : state.pairs)
    if (random.integer(0, 1) == 1) pair = with_other_owner<D>(pair, state.material);
  state.order.resize(state.radius.size());
  std::iota(state.order.begin(), state.order.end(), 0);
  shuffle(state.order);
  return state;
}

template <class T> void flip(T &value, int bit)
{
  unsigned char bytes[sizeof(T)];
  std::memcpy(bytes, &value, sizeof(T));
  bytes[bit / 8] ^= static_cast<unsigned char>(1u << (bit % 8));
  std::memcpy(&value, bytes, sizeof(T));
}

/// Expects that each single flipped bit of the number changes the hash. Restores the number.
template <class T, class Hash>
void expect_each_bit_counts(T &value, const Hash &hash, const std::string &what)
{
  std::set<std::uint64_t> seen = {hash()};
  const int bits = 8 * static_cast<int>(sizeof(T));
  for (int bit = 0; bit < bits; ++bit) {
    flip(value, bit);
    EXPECT_TRUE(seen.insert(hash()).second) << what << ", bit " << bit;
    flip(value, bit);
  }
  EXPECT_EQ(seen.count(hash()), 1u);
}

template <class T, class Hash>
void expect_each_bit_counts(std::vector<T> &values, const Hash &hash, const std::string &what)
{
  ASSERT_FALSE(values.empty());
  for (T &value : values) expect_each_bit_counts(value, hash, what);
  const T last = values.back();
  const std::uint64_t before = hash();
  values.pop_back();
  EXPECT_NE(hash(), before) << what << ", without the last one";
  values.push_back(last);
}

template <class Dimension> class StateHash : public ::testing::Test {
};
using Dimensions = ::testing::Types<std::integral_constant<int, 2>, std::integral_constant<int, 3>>;
TYPED_TEST_SUITE(StateHash, Dimensions, );

}    // namespace

TYPED_TEST(StateHash, DoesNotDependOnTheOrderAndTheOwnersOfPairs)
{
  constexpr int D = TypeParam::value;
  const RveStateOf<D> state = full_state<D>();
  for (int seed = 1; seed <= 100; ++seed) {
    const RveStateOf<D> other = shuffled<D>(state, seed);
    EXPECT_EQ(hash_of(other), hash_of(state)) << seed;
    EXPECT_EQ(list_hash_of(other), list_hash_of(state)) << seed;
  }
}

TYPED_TEST(StateHash, DependsOnEachBitOfTheState)
{
  constexpr int D = TypeParam::value;
  RveStateOf<D> state = full_state<D>();
  const auto hash = [&] { return hash_of(state); };
  for (const MaterialParameter &parameter : MATERIAL_PARAMETERS) {
    expect_each_bit_counts(state.material.*parameter.member, hash, parameter.name);
    state.material.*parameter.member = 0.0;
    expect_each_bit_counts(state.material.*parameter.member, hash, parameter.name);
  }
  for (double &x : state.cell.component) expect_each_bit_counts(x, hash, "cell");
  for (double &x : state.deformation.component) expect_each_bit_counts(x, hash, "deformation");
  for (double &x : state.servo_velocity_gradient.component)
    expect_each_bit_counts(x, hash, "servo");
  expect_each_bit_counts(state.largest_contact_force, hash, "largest contact force");
  expect_each_bit_counts(state.radius, hash, "radius");
  expect_each_bit_counts(state.fractional, hash, "fractional coordinates");
  expect_each_bit_counts(state.velocity, hash, "velocity");
  expect_each_bit_counts(state.spin, hash, "spin");
  for (PairOf<D> &pair : state.pairs)    // also pairs without history
    for (const RememberedNumber<D> &number : pair_memory<D>())
      expect_each_bit_counts(number.of(pair), hash, number.name);
  const std::uint64_t before = hash();
  for (const ContactLaw law : {ContactLaw::Linear, ContactLaw::Hertz}) {
    state.material.law = law;
    EXPECT_NE(hash(), before);
  }
}

TYPED_TEST(StateHash, DependsOnTheGrainsOfEachHistory)
{
  constexpr int D = TypeParam::value;
  const RveStateOf<D> state = full_state<D>();
  std::set<std::uint64_t> seen = {hash_of(state)};
  int lost = 0;
  for (std::size_t k = 0; k < state.pairs.size(); ++k) {
    RveStateOf<D> other = state;
    other.pairs.erase(other.pairs.begin() + static_cast<std::ptrdiff_t>(k));
    if (!golden::remembers(state.pairs[k])) {
      EXPECT_EQ(hash_of(other), hash_of(state)) << "without pair " << k;
      continue;
    }
    EXPECT_TRUE(seen.insert(hash_of(other)).second) << "without pair " << k;
    ++lost;
    for (const bool is_first : {true, false})    // another grain replaces a grain of the pair
      for (int i = 0; i < GRAINS; ++i) {
        if (i == state.pairs[k].first || i == state.pairs[k].second) continue;
        other = state;
        (is_first ? other.pairs[k].first : other.pairs[k].second) = i;
        EXPECT_TRUE(seen.insert(hash_of(other)).second) << "pair " << k << " with grain " << i;
      }
    other = state;    // the grains are exchanged, but the history is not
    std::swap(other.pairs[k].first, other.pairs[k].second);
    EXPECT_TRUE(seen.insert(hash_of(other)).second) << "pair " << k << " with exchanged grains";
    for (std::size_t m = 0; m < k; ++m) {    // two pairs exchange their histories
      if (!golden::remembers(state.pairs[m])) continue;
      other = state;
      std::swap(other.pairs[m].first, other.pairs[k].first);
      std::swap(other.pairs[m].second, other.pairs[k].second);
      EXPECT_TRUE(seen.insert(hash_of(other)).second) << "pairs " << m << " and " << k;
    }
  }
  EXPECT_EQ(lost, 8);
}

TYPED_TEST(StateHash, HasASeparateHashOfTheList)
{
  constexpr int D = TypeParam::value;
  RveStateOf<D> state = full_state<D>();
  const std::uint64_t of_state = hash_of(state);
  const auto hash = [&] {
    EXPECT_EQ(hash_of(state), of_state);
    return list_hash_of(state);
  };
  expect_each_bit_counts(state.list_fractional, hash, "list coordinates");
  for (double &x : state.list_cell.component) expect_each_bit_counts(x, hash, "list cell");
  expect_each_bit_counts(state.list_margin, hash, "list margin");
  const std::uint64_t before = hash();
  for (std::size_t k = 0; k < state.pairs.size(); ++k) {
    RveStateOf<D> other = state;
    other.pairs.erase(other.pairs.begin() + static_cast<std::ptrdiff_t>(k));
    EXPECT_NE(list_hash_of(other), before);
  }
}

// ---- states that an engine computes ----

namespace {

Material rolling_material()
{
  Material m = spheres_material();
  m.law = ContactLaw::Hertz;
  m.normal_stiffness = m.tangential_stiffness = 0.0;
  m.hertz_stiffness = 2e9;
  m.mindlin_stiffness = 1.7e9;
  m.mindlin_displacement = 3.0;
  m.rolling_stiffness = 5e5;
  m.rolling_friction = 0.2;
  return m;
}

template <int D> RveStateOf<D> packing()
{
  Material m = rolling_material();
  if constexpr (D == 2) {
    RveState state = triangular_packing(m, 12, 12, 0.0037, 1);
    shake(state, 0.3, 2);
    return state;
  } else {
    m.twisting_stiffness = 3.0;
    m.twisting_friction = 3e-4;
    return disordered_spheres(m, 6, 1);
  }
}

template <int D> RveStateOf<D> moved(const RveStateOf<D> &state, double skin, int calls)
{
  Options options;
  options.contacts = contacts_of(state);
  options.device = Device::Cpu;
  options.format = Format::Mixed;
  options.skin = skin;
  options.threads = 1;
  const auto engine = make_engine<D>(options);
  const int rve = engine->add(state);
  Tensor<double, D> gradient = Tensor<double, D>::zero();
  for (int a = 0; a < D; ++a) gradient(a, a) = -4.0;
  gradient(0, 1) = 10.0;
  std::vector<ResultOf<D>> results;
  for (int call = 0; call < calls; ++call) {
    engine->advance({rve}, {DriveOf<D>::constant_velocity_gradient(gradient, 1e-5, 40)}, results);
    EXPECT_EQ(results[0].status & status::Fatal, 0u);
  }
  return engine->state(rve);
}

}    // namespace

TYPED_TEST(StateHash, DoesNotDependOnTheListsOfAnEngine)
{
  constexpr int D = TypeParam::value;
  const RveStateOf<D> start = moved<D>(packing<D>(), 0.0, 3);
  for (const RememberedNumber<D> &number : pair_memory<D>())
    EXPECT_GT(std::count_if(start.pairs.begin(), start.pairs.end(),
                            [&](const PairOf<D> &pair) { return number.of(pair) != 0.0; }),
              50)
        << number.what;

  const RveStateOf<D> end = moved<D>(start, 0.0, 3);
  EXPECT_NE(hash_of(end), hash_of(start));
  for (int seed = 1; seed <= 5; ++seed)
    EXPECT_EQ(hash_of(moved<D>(shuffled<D>(start, seed), 0.0, 3)), hash_of(end)) << seed;
  const RveStateOf<D> wide = moved<D>(start, 1e-3, 3);
  EXPECT_EQ(hash_of(wide), hash_of(end));
  EXPECT_NE(list_hash_of(wide), list_hash_of(end));
}
