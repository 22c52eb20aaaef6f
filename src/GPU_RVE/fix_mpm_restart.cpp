// SPDX-License-Identifier: GPL-2.0-only

#include "fix_mpm_restart.h"

#include "rve/core/checksum.h"

#include "error.h"
#include "lammps.h"
#include "utils.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <sstream>

using namespace LAMMPS_NS;

namespace {

// Beginning of a line of the head that names a law. The next line has the names of its state
// variables.
const std::string STATE_OF = "state of ";
// Line before the names of the numbers that a point with water stores. Without water there is none.
const std::string WATER_NUMBERS = "numbers of water";
// Line before the arguments of a fix_modify of a model. It appears only if fix_modify has changed a
// model.
const std::string MODIFIED = "fix_modify";

constexpr std::size_t HEAD_FIRST = 3;    // number of doubles before the step

}    // namespace

double LAMMPS_NS::mpm_checksum(const double *numbers, std::size_t count)
{
  const std::uint64_t sum = rve::checksum_of(numbers, count * sizeof(double));
  double bits;
  static_assert(sizeof(bits) == sizeof(sum));
  memcpy(&bits, &sum, sizeof(bits));
  return bits;
}

bool LAMMPS_NS::is_same_checksum(double a, double b)
{
  return memcmp(&a, &b, sizeof(a)) == 0;
}

/// The head consists of doubles: the version, the number of doubles, a checksum of these two, the
/// step, and the number of bodies. Each body has its displacement, its velocity, and the length and
/// numbers of its rotation record. Then come the length and lines of a text with the keywords of
/// the script, the state variables of each law and the numbers of the pore water. The last number
/// is a checksum of all numbers before it.
template <int D> void MpmRestartHead<D>::write(FILE *fp) const
{
  std::string text;
  for (const auto &[about, values] : words) text += about + "\n" + values + "\n";
  for (const auto &[law, names] : laws) text += STATE_OF + law + "\n" + names + "\n";
  if (!water.empty()) text += WATER_NUMBERS + "\n" + water + "\n";
  for (const std::string &model : modifications) text += MODIFIED + "\n" + model + "\n";
  std::vector<double> head(HEAD_FIRST);
  head.insert(head.end(), {step, (double) bodies.size()});
  for (const Body &body : bodies) {
    head.insert(head.end(), body.displacement.component, body.displacement.component + D);
    head.insert(head.end(), body.velocity.component, body.velocity.component + D);
    head.push_back((double) body.turning.size());
    head.insert(head.end(), body.turning.begin(), body.turning.end());
  }
  const std::size_t begin = head.size() + 1;
  head.push_back((double) text.size());
  head.resize(begin + (text.size() + sizeof(double) - 1) / sizeof(double), 0.0);
  memcpy(head.data() + begin, text.data(), text.size());
  head.push_back(0.0);    // replaced by the checksum below
  // the version is negative, because files without a version begin with the number of bodies
  head[0] = -MPM_RESTART_VERSION;
  head[1] = (double) head.size();
  head[2] = mpm_checksum(head.data(), 2);
  head.back() = mpm_checksum(head.data(), head.size() - 1);
  const int size = (int) (head.size() * sizeof(double));
  fwrite(&size, sizeof(int), 1, fp);
  fwrite(head.data(), sizeof(double), head.size(), fp);
}

/// Returns the numbers of a head. Errors end in error->all. They begin with `name`.
static std::vector<double> numbers_of_head(Error *error, const std::string &name, const char *buf)
{
  double version, first[HEAD_FIRST];    // copies, because `buf` can be unaligned
  memcpy(&version, buf, sizeof(version));
  if (version != -MPM_RESTART_VERSION) {
    // files of versions 1 and 2 begin with the number of bodies
    if (version == std::floor(version) && std::fabs(version) < 1000.0)
      error->all(FLERR,
                 "{}: the restart file has version {} of the data of this fix; this program reads "
                 "version {}",
                 name, version < 0.0 ? std::to_string((int) -version) : "1 or 2",
                 MPM_RESTART_VERSION);
    error->all(FLERR,
               "{}: the header of this fix in the restart file is damaged: it begins with {} "
               "instead of the version {}; use an earlier file",
               name, version, -MPM_RESTART_VERSION);
  }
  memcpy(first, buf, sizeof(first));
  std::vector<double> head;
  if (is_same_checksum(first[2], mpm_checksum(first, 2))) head.resize((std::size_t) first[1]);
  if (!head.empty()) memcpy(head.data(), buf, head.size() * sizeof(double));
  if (head.empty() || !is_same_checksum(head.back(), mpm_checksum(head.data(), head.size() - 1)))
    error->all(FLERR,
               "{}: the header of this fix in the restart file is damaged: its checksum does not "
               "match; use an earlier file",
               name);
  return head;
}

template <int D>
MpmRestartHead<D> MpmRestartHead<D>::read(LAMMPS *lmp, const std::string &name, const char *buf)
{
  const std::vector<double> numbers = numbers_of_head(lmp->error, name, buf);
  const double *next = numbers.data() + HEAD_FIRST;
  MpmRestartHead head;
  head.step = *next++;
  head.bodies.resize((std::size_t) *next++);
  for (Body &body : head.bodies) {
    for (mpm::Vec<D> *vector : {&body.displacement, &body.velocity}) {
      std::copy_n(next, D, vector->component);
      next += D;
    }
    const auto size = (std::size_t) *next++;
    body.turning.assign(next, next + size);
    next += size;
  }
  const auto length = (std::size_t) *next++;
  std::istringstream text(std::string(reinterpret_cast<const char *>(next), length));
  for (std::string about, values; std::getline(text, about) && std::getline(text, values);) {
    if (about.rfind(STATE_OF, 0) == 0)
      head.laws.emplace_back(about.substr(STATE_OF.size()), values);
    else if (about == WATER_NUMBERS)
      head.water = values;
    else if (about == MODIFIED)
      head.modifications.push_back(values);
    else
      head.words.emplace_back(about, values);
  }
  return head;
}

template struct LAMMPS_NS::MpmRestartHead<2>;
template struct LAMMPS_NS::MpmRestartHead<3>;

std::string LAMMPS_NS::mpm_differences(const MpmArguments &then, const MpmArguments &now,
                                       bool of_points)
{
  // true for keywords without influence on results
  const auto is_irrelevant = [](const std::string &about) {
    return about == "device" || about == "progress" || about == "cfl" || about == "wave_speed" ||
        about.rfind("column ", 0) == 0;
  };
  const auto is_of_points = [](const std::string &about) {
    return about == "volume" || about == "density" || about == "stress" || about == "insitu" ||
        utils::strmatch(about, "^\\S+ \\S+ density$");    // density of a model or body
  };
  // returns the values of a keyword; joins the values of several loads on the same points
  const auto values_of = [](const MpmArguments &words, const std::string &about) {
    std::string all;
    for (const auto &[other, values] : words)
      if (other == about) all += (all.empty() ? "" : ", ") + values;
    return all.empty() ? std::string("not given") : all;
  };
  // compares word by word, and numbers by their value
  const auto is_same = [](const std::string &one, const std::string &other) {
    const std::vector<std::string> a = utils::split_words(one), b = utils::split_words(other);
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto &x, const auto &y) {
      return utils::is_double(x) && utils::is_double(y) ? std::stod(x) == std::stod(y) : x == y;
    });
  };
  std::vector<std::string> keys;
  for (const MpmArguments *words : {&then, &now})
    for (const auto &one : *words)
      if (std::find(keys.begin(), keys.end(), one.first) == keys.end()) keys.push_back(one.first);
  std::vector<std::string> changes;
  for (const std::string &key : keys) {
    if (is_irrelevant(key) || is_of_points(key) != of_points) continue;
    const std::string before = values_of(then, key), after = values_of(now, key);
    if (!is_same(before, after)) changes.push_back(key + " " + before + " -> " + after);
  }
  return utils::join_words(changes, ", ");
}
