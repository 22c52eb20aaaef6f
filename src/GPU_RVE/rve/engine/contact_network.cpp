#include "rve/engine/contact_network.h"

#include "rve/engine/contact_laws.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace rve {

namespace {

  constexpr double TWO_TO_64 = 18446744073709551616.0;

  // Grains binned by fractional coordinate; a bin is at least one largest contact distance wide.
  struct Bins {
    int count[2];
    std::vector<std::vector<int>> grains;

    Bins(const RveState &state, double contact_distance)
    {
      constexpr int MOST_BINS =
          1024;    // per axis: more would be empty for any N a cell of this kind holds
      for (int a = 0; a < 2; ++a) {
        const double width =
            state.cell_volume() / std::hypot(state.cell(0, 1 - a), state.cell(1, 1 - a));
        count[a] =
            static_cast<int>(std::min<double>(MOST_BINS, std::floor(width / contact_distance)));
        count[a] = std::max(count[a], 1);
      }
      grains.resize(static_cast<std::size_t>(count[0]) * count[1]);
      for (int i = 0; i < state.num_grains(); ++i)
        grains[index(coordinate(state, i, 0), coordinate(state, i, 1))].push_back(i);
    }

    int coordinate(const RveState &state, int i, int a) const
    {
      return static_cast<int>(((state.fractional[2 * i + a] >> 32) * count[a]) >> 32);
    }

    std::size_t index(int x, int y) const
    {
      const int wrapped_x = (x + count[0]) % count[0];
      const int wrapped_y = (y + count[1]) % count[1];
      return static_cast<std::size_t>(wrapped_y) * count[0] + wrapped_x;
    }

    // Below three bins an axis would show the same bin on both sides.
    bool usable() const { return count[0] >= 3 && count[1] >= 3; }
  };

  // The periodic image of a second grain that is nearest to the first one, along one axis.
  int image_of_second(std::uint64_t first, std::uint64_t second)
  {
    const auto difference = static_cast<std::int64_t>(second - first);
    if (difference >= 0) return second < first ? 1 : 0;
    return second > first ? -1 : 0;
  }

  void add_if_touching(const RveState &state, int i, int j, std::vector<TouchingPair> &contacts)
  {
    const Vec<double, 2> branch = branch_vector(state, i, j);
    const double reach = state.radius[i] + state.radius[j];
    // most grains of a bin are far apart, which needs no root; the margin leaves the last digits to the root
    if (branch[0] * branch[0] + branch[1] * branch[1] > 1.001 * reach * reach) return;
    const double distance = std::hypot(branch[0], branch[1]);
    const double overlap = reach - distance;
    if (overlap > 0.0 && distance > 0.0)
      contacts.push_back({i, j, branch, (1.0 / distance) * branch, overlap});
  }

}    // namespace

Vec<double, 2> branch_vector(const RveState &state, int i, int j)
{
  Vec<double, 2> difference;
  for (int a = 0; a < 2; ++a) {
    const std::uint64_t wrapped = state.fractional[2 * j + a] - state.fractional[2 * i + a];
    difference[a] = static_cast<double>(static_cast<std::int64_t>(wrapped)) / TWO_TO_64;
  }
  return state.cell * difference;
}

ContactPlace place_of(const RveState &state, const TouchingPair &contact)
{
  return {contact.overlap, state.radius[contact.first], state.radius[contact.second]};
}

void forget_absurd_force(RveState &state)
{
  // A call may have seen larger forces than its end: a collision, a dashpot. Ten bits of the sums are left for that, and without
  // contacts all that two of the largest grains can bear.
  constexpr double SURPRISE = 1024.0;
  const double radius = *std::max_element(state.radius.begin(), state.radius.end());
  const ContactPlace deepest{radius, radius, radius};
  double fastest = 0.0;
  for (const double component : state.velocity) fastest = std::max(fastest, std::fabs(component));
  double largest = with_law(state.material, [&](const auto &law) {
    double of_springs = 0.0;
    for (const TouchingPair &contact : find_contacts(state))
      of_springs = std::max(of_springs, law.force_scale(place_of(state, contact)));
    if (of_springs == 0.0) of_springs = law.force_scale(deepest) / SURPRISE;
    return std::max(of_springs, 2.0 * law.viscosity(deepest).normal * fastest);
  });
  for (const Pair &pair : state.pairs)
    largest = std::max({largest, std::fabs(pair.tangential_force), std::fabs(pair.rolling_force)});
  if (state.largest_contact_force > SURPRISE * largest) state.largest_contact_force = 0.0;
}

std::vector<TouchingPair> find_contacts(const RveState &state)
{
  std::vector<TouchingPair> contacts;
  if (state.radius.empty()) return contacts;
  const double contact_distance = 2.0 * *std::max_element(state.radius.begin(), state.radius.end());
  const Bins bins(state, contact_distance);
  for (int i = 0; i < state.num_grains(); ++i) {
    if (!bins.usable()) {
      for (int j = i + 1; j < state.num_grains(); ++j) add_if_touching(state, i, j, contacts);
      continue;
    }
    const std::size_t begin = contacts.size();
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx)
        for (const int j : bins.grains[bins.index(bins.coordinate(state, i, 0) + dx,
                                                  bins.coordinate(state, i, 1) + dy)])
          if (j > i) add_if_touching(state, i, j, contacts);
    std::sort(contacts.begin() + begin, contacts.end(),
              [](const TouchingPair &x, const TouchingPair &y) {
                return x.second < y.second;
              });
  }
  return contacts;
}

std::vector<SpringForces> spring_forces(const RveState &state,
                                        const std::vector<TouchingPair> &contacts)
{
  std::map<std::pair<int, int>, SpringForces> history;
  with_law(state.material, [&](const auto &law) {
    for (const Pair &pair : state.pairs) {
      Pair seen = pair;
      if (pair.first > pair.second) law.to_pair(law.seen_from_partner(law.of_pair(pair)), seen);
      history[std::minmax(pair.first, pair.second)] = {seen.tangential_force, seen.rolling_force};
    }
  });
  std::vector<SpringForces> forces;
  for (const TouchingPair &contact : contacts) {
    const auto entry = history.find({contact.first, contact.second});
    forces.push_back(entry == history.end() ? SpringForces{0.0, 0.0} : entry->second);
  }
  return forces;
}

std::vector<SpringContact> find_spring_contacts(const RveState &state)
{
  const std::vector<TouchingPair> geometries = find_contacts(state);
  const std::vector<SpringForces> springs = spring_forces(state, geometries);
  std::vector<double> normal_force, limiting_force;
  with_law(state.material, [&](const auto &law) {
    for (const TouchingPair &geometry : geometries) {
      normal_force.push_back(law.spring_force(place_of(state, geometry)));
      limiting_force.push_back(law.limiting_force(place_of(state, geometry)));
    }
  });
  std::vector<SpringContact> contacts;
  contacts.reserve(geometries.size());
  for (std::size_t k = 0; k < geometries.size(); ++k) {
    SpringContact contact{geometries[k], {0, 0},           normal_force[k],
                          springs[k],    Vec<double, 2>{}, 1.0};
    for (int a = 0; a < 2; ++a)
      contact.image[a] = image_of_second(state.fractional[2 * contact.geometry.first + a],
                                         state.fractional[2 * contact.geometry.second + a]);
    const Vec<double, 2> &n = contact.geometry.normal, along{{-n[1], n[0]}};
    contact.force_on_first = contact.springs.tangential * along - contact.normal_force * n;
    const double limit = state.material.friction * limiting_force[k];
    if (limit > 0.0) contact.mobilized_friction = std::fabs(contact.springs.tangential) / limit;
    contacts.push_back(contact);
  }
  return contacts;
}

Tensor2 spring_stress(const RveState &state)
{
  Tensor2 sum = Tensor2::zero();
  for (const SpringContact &contact : find_spring_contacts(state))
    sum = sum + dyad(contact.force_on_first, contact.geometry.branch);
  return 1.0 / (state.cell_volume() * state.material.thickness) * sum;
}

}    // namespace rve
