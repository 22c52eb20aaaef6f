/* ----------------------------------------------------------------------
   LAMMPS - Large-scale Atomic/Molecular Massively Parallel Simulator
   https://www.lammps.org/, Sandia National Laboratories
   LAMMPS development team: developers@lammps.org

   Copyright (2003) Sandia Corporation.  Under the terms of Contract
   DE-AC04-94AL85000 with Sandia Corporation, the U.S. Government retains
   certain rights in this software.  This software is distributed under
   the GNU General Public License.

   See the README file in the top-level LAMMPS directory.
------------------------------------------------------------------------- */

#include "rve_points.h"

#include "rve/engine/packing.h"

#include <algorithm>
#include <cstring>
#include <type_traits>

using namespace LAMMPS_NS;

namespace {

// in front of the state's own image
struct ImageHead {
  std::uint64_t bytes;    // of the state's image
  std::uint64_t frozen;
  rve::Result result;
};
static_assert(std::is_trivially_copyable<ImageHead>::value, "the head is copied as bytes");
static_assert(sizeof(ImageHead) % sizeof(double) == 0, "the head is a whole number of doubles");

constexpr std::size_t HEAD = sizeof(ImageHead) / sizeof(double);

std::size_t doubles_for(std::size_t bytes)
{
  return (bytes + sizeof(double) - 1) / sizeof(double);
}

}    // namespace

RvePoints::Point &RvePoints::settle(int slot, const rve::RveState &state)
{
  if (slot >= static_cast<int>(points.size())) points.resize(slot + 1);
  image_sizes.assign(points.size(), 0);
  points[slot] = Point();
  points[slot].material = state.material;
  points[slot].servo_gain = rve::default_servo_gain(state);
  return points[slot];
}

std::vector<int> RvePoints::add(const std::vector<const rve::RveState *> &states)
{
  std::vector<int> slots;
  for (const rve::RveState *state : states) {
    slots.push_back(engine->add(*state));
    settle(slots.back(), *state);
  }
  std::vector<rve::Drive> at_rest(slots.size());
  for (auto &drive : at_rest) drive.dt = 1.0;    // no step is taken; a drive wants a positive one
  advance(slots, at_rest);
  return slots;
}

void RvePoints::remove(int slot)
{
  engine->remove(slot);
  points[slot] = Point();
  image_sizes[slot] = 0;
}

std::vector<int> RvePoints::advance(const std::vector<int> &slots,
                                    const std::vector<rve::Drive> &drives)
{
  std::vector<int> alive, failed;
  std::vector<rve::Drive> their_drives;
  for (std::size_t k = 0; k < slots.size(); ++k)
    if (!points[slots[k]].frozen) {
      alive.push_back(slots[k]);
      their_drives.push_back(drives[k]);
    }
  if (alive.empty()) return failed;
  image_sizes.assign(points.size(), 0);

  std::vector<rve::Result> results;
  engine->advance(alive, their_drives, results);
  for (std::size_t k = 0; k < alive.size(); ++k) {
    Point &point = points[alive[k]];
    if (results[k].status & rve::status::Fatal) {
      point.result.status = results[k].status;
      point.frozen = true;
      failed.push_back(alive[k]);
    } else {
      point.result = results[k];
    }
  }
  return failed;
}

std::vector<double> RvePoints::image(int slot) const
{
  const std::vector<char> state = rve::serialize(engine->state(slot));
  std::vector<double> image(HEAD + doubles_for(state.size()), 0.0);
  ImageHead head{};
  head.bytes = state.size();
  head.frozen = points[slot].frozen ? 1 : 0;
  head.result = points[slot].result;
  std::memcpy(image.data(), &head, sizeof(head));
  std::memcpy(image.data() + HEAD, state.data(), state.size());
  image_sizes[slot] = static_cast<int>(image.size());
  return image;
}

int RvePoints::add_image(const double *image)
{
  ImageHead head;
  std::memcpy(static_cast<void *>(&head), image, sizeof(head));
  const rve::RveState state =
      rve::deserialize(reinterpret_cast<const char *>(image + HEAD), head.bytes);
  const int slot = engine->add(state);
  Point &point = settle(slot, state);
  point.result = head.result;
  point.frozen = head.frozen != 0;
  return slot;
}

int RvePoints::image_size(int slot) const
{
  if (image_sizes[slot] == 0) image(slot);
  return image_sizes[slot];
}

int RvePoints::image_bound(int slot) const
{
  // per grain: radius, 2 coordinates, 2 velocities, spin, 2 list coordinates; per pair 16 bytes; the rest generously
  const rve::Result &result = points[slot].result;
  return static_cast<int>(HEAD) + 8 * result.num_grains + 2 * result.num_pairs + 256;
}
