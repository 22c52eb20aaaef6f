// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/contact_network.h"

#include "rve/engine/contact_laws.h"
#include "rve/engine/grain_bins.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace rve {

namespace {

  double length(double along_tangent)
  {
    return std::fabs(along_tangent);
  }
  double length(const Vec<double, 2> &v)
  {
    return std::hypot(v[0], v[1]);
  }
  double length(const Vec<double, 3> &v)
  {
    return std::hypot(v[0], v[1], v[2]);
  }

  // Returns the periodic image of the second grain that is nearest to the first one, along one
  // axis: -1, 0 or 1.
  int image_of_second(std::uint64_t first, std::uint64_t second)
  {
    const auto difference = static_cast<std::int64_t>(second - first);
    if (difference >= 0) return second < first ? 1 : 0;
    return second > first ? -1 : 0;
  }

  template <int D>
  void add_if_acting(const RveStateOf<D> &state, double reach, int i, int j,
                     std::vector<TouchingPairOf<D>> &contacts)
  {
    const Vec<double, D> branch = branch_vector(state, i, j);
    const double sum_of_radii = state.radius[i] + state.radius[j];
    double squares = branch[0] * branch[0];
    for (int a = 1; a < D; ++a) squares += branch[a] * branch[a];
    // Most grains of neighbouring bins are far apart. Their squared distance shows this without a
    // root. The factor 1.001 leaves close cases to the exact test below.
    if (squares > 1.001 * (sum_of_radii + reach) * (sum_of_radii + reach)) return;
    const double distance = length(branch);
    const double overlap = sum_of_radii - distance;
    if (overlap > -reach && distance > 0.0)
      contacts.push_back({i, j, branch, (1.0 / distance) * branch, overlap});
  }

  Vec<double, 2> tangential_vector(double along_tangent, const Vec<double, 2> &n)
  {
    return along_tangent * Vec<double, 2>{{-n[1], n[0]}};
  }
  Vec<double, 3> tangential_vector(const Vec<double, 3> &force, const Vec<double, 3> &)
  {
    return force;
  }

}    // namespace

template <int D> Vec<double, D> branch_vector(const RveStateOf<D> &state, int i, int j)
{
  Vec<double, D> difference;
  for (int a = 0; a < D; ++a) {
    const std::uint64_t wrapped = state.fractional[D * j + a] - state.fractional[D * i + a];
    difference[a] = static_cast<double>(static_cast<std::int64_t>(wrapped)) * 0x1p-64;
  }
  return state.cell * difference;
}

template <int D> ContactSite site_of(const RveStateOf<D> &state, const TouchingPairOf<D> &contact)
{
  return {contact.overlap, state.radius[contact.first], state.radius[contact.second]};
}

template <int D> void forget_absurd_force(RveStateOf<D> &state)
{
  // Collisions or dashpots can make forces during a call larger than the forces at its end. A
  // factor of 2^10 is allowed for this. Without contacts the limit is the force of two of the
  // largest grains at an overlap as large as their radius.
  constexpr double SURPRISE = 1024.0;
  const double radius = *std::max_element(state.radius.begin(), state.radius.end());
  const ContactSite deepest{radius, radius, radius};
  double fastest = 0.0;
  for (const double component : state.velocity) fastest = std::max(fastest, std::fabs(component));
  double largest = with_law<D>(state.material, [&](const auto &law) {
    double of_springs = 0.0;
    for (const TouchingPairOf<D> &contact : find_contacts(state))
      of_springs = std::max(of_springs, law.force_scale(site_of(state, contact)));
    if (of_springs == 0.0) of_springs = law.force_scale(deepest) / SURPRISE;
    return std::max(of_springs, 2.0 * law.viscosity(deepest).normal * fastest);
  });
  for (const PairOf<D> &pair : state.pairs)
    largest = std::max({largest, length(pair.tangential_force), length(pair.rolling_force)});
  if (state.largest_contact_force > SURPRISE * largest) state.largest_contact_force = 0.0;
}

template <int D> std::vector<TouchingPairOf<D>> find_contacts(const RveStateOf<D> &state)
{
  std::vector<TouchingPairOf<D>> contacts;
  if (state.radius.empty()) return contacts;
  const double reach = reach_of(state.material);
  const double contact_distance =
      2.0 * *std::max_element(state.radius.begin(), state.radius.end()) + reach;
  GrainBins<D> bins(state.cell, contact_distance);
  for (int i = 0; i < state.num_grains(); ++i) bins.add(state, i);
  for (int i = 0; i < state.num_grains(); ++i) {
    const std::size_t begin = contacts.size();
    bins.any_near(state, i, [&](int j) {
      if (j > i) add_if_acting(state, reach, i, j, contacts);
      return false;
    });
    std::sort(
        contacts.begin() + begin, contacts.end(),
        [](const TouchingPairOf<D> &x, const TouchingPairOf<D> &y) { return x.second < y.second; });
  }
  return contacts;
}

template <int D>
std::vector<PairOf<D>> remembered_pairs(const RveStateOf<D> &state,
                                        const std::vector<TouchingPairOf<D>> &contacts)
{
  // In `known` each pair has the lower grain number first, and pairs are sorted.
  std::vector<PairOf<D>> known;
  with_law<D>(state.material, [&](const auto &law) {
    for (const PairOf<D> &pair : state.pairs) {
      PairOf<D> seen = pair;
      if (pair.first > pair.second) {
        law.to_pair(law.seen_from_partner(law.of_pair(pair)), seen);
        std::swap(seen.first, seen.second);
      }
      known.push_back(seen);
    }
  });
  const auto is_before = [](const auto &x, const auto &y) {
    return x.first != y.first ? x.first < y.first : x.second < y.second;
  };
  std::sort(known.begin(), known.end(), is_before);
  std::vector<PairOf<D>> pairs;
  pairs.reserve(contacts.size());
  for (const TouchingPairOf<D> &contact : contacts) {
    const auto at = std::lower_bound(known.begin(), known.end(), contact, is_before);
    const bool found = at != known.end() && !is_before(contact, *at);
    pairs.push_back(found ? *at : PairOf<D>{});
  }
  return pairs;
}

template <int D>
std::vector<SpringForcesOf<D>> spring_forces(const RveStateOf<D> &state,
                                             const std::vector<TouchingPairOf<D>> &contacts)
{
  std::vector<SpringForcesOf<D>> forces;
  for (const PairOf<D> &pair : remembered_pairs(state, contacts)) {
    forces.push_back({pair.tangential_force, pair.rolling_force});
    if constexpr (D == 3) forces.back().twisting = pair.twisting_moment;
  }
  return forces;
}

template <int D> std::vector<SpringContactOf<D>> find_spring_contacts(const RveStateOf<D> &state)
{
  const std::vector<TouchingPairOf<D>> geometries = find_contacts(state);
  const std::vector<SpringForcesOf<D>> springs = spring_forces(state, geometries);
  std::vector<SpringContactOf<D>> contacts;
  contacts.reserve(geometries.size());
  with_law<D>(state.material, [&](const auto &law) {
    for (std::size_t k = 0; k < geometries.size(); ++k) {
      const ContactSite site = site_of(state, geometries[k]);
      SpringContactOf<D> contact{geometries[k], {}, law.spring_force(site), springs[k], {}, 1.0};
      if constexpr (D == 3 && law.has_rolling) contact.springs.twisting *= law.twisting_share(site);
      for (int a = 0; a < D; ++a)
        contact.image[a] = image_of_second(state.fractional[D * contact.geometry.first + a],
                                           state.fractional[D * contact.geometry.second + a]);
      const Vec<double, D> &n = contact.geometry.normal;
      contact.force_on_first =
          tangential_vector(contact.springs.tangential, n) - contact.normal_force * n;
      const double limit = state.material.friction * law.limiting_force(site);
      if (limit > 0.0) contact.mobilized_friction = length(contact.springs.tangential) / limit;
      contacts.push_back(contact);
    }
  });
  return contacts;
}

template <int D> Tensor<double, D> spring_stress(const RveStateOf<D> &state)
{
  Tensor<double, D> sum = Tensor<double, D>::zero();
  for (const SpringContactOf<D> &contact : find_spring_contacts(state))
    sum = sum + dyad(contact.force_on_first, contact.geometry.branch);
  return 1.0 / (state.cell_volume() * state.material.thickness) * sum;
}

#define RVE_CONTACT_NETWORK(D)                                                                   \
  template ContactSite site_of(const RveStateOf<D> &, const TouchingPairOf<D> &);                \
  template std::vector<TouchingPairOf<D>> find_contacts(const RveStateOf<D> &);                  \
  template void forget_absurd_force(RveStateOf<D> &);                                            \
  template std::vector<PairOf<D>> remembered_pairs(const RveStateOf<D> &,                        \
                                                   const std::vector<TouchingPairOf<D>> &);      \
  template std::vector<SpringForcesOf<D>> spring_forces(const RveStateOf<D> &,                   \
                                                        const std::vector<TouchingPairOf<D>> &); \
  template std::vector<SpringContactOf<D>> find_spring_contacts(const RveStateOf<D> &);          \
  template Tensor<double, D> spring_stress(const RveStateOf<D> &);                               \
  template Vec<double, D> branch_vector(const RveStateOf<D> &, int, int);
RVE_CONTACT_NETWORK(2)
RVE_CONTACT_NETWORK(3)
#undef RVE_CONTACT_NETWORK

}    // namespace rve
