/* -*- c++ -*- ----------------------------------------------------------
   LAMMPS - Large-scale Atomic/Molecular Massively Parallel Simulator
   https://www.lammps.org/, Sandia National Laboratories
   LAMMPS development team: developers@lammps.org

   Copyright (2003) Sandia Corporation.  Under the terms of Contract
   DE-AC04-94AL85000 with Sandia Corporation, the U.S. Government retains
   certain rights in this software.  This software is distributed under
   the GNU General Public License.

   See the README file in the top-level LAMMPS directory.
------------------------------------------------------------------------- */

// The RVEs behind the atoms of one rank: what the engine holds, with the last answer of each, its failure flag and the byte image
// in which it travels between ranks and into restart files. Knows the engine, not LAMMPS.

#ifndef LMP_RVE_POINTS_H
#define LMP_RVE_POINTS_H

#include "rve/engine/engine.h"

#include <memory>
#include <vector>

namespace LAMMPS_NS {

class RvePoints {
 public:
  struct Point {
    rve::Result
        result;    ///< of the last advance that succeeded; its status is that of the last advance
    rve::Material material;
    double servo_gain = 0.0;    ///< default of its stress servo [1/(stress time^2)]
    bool frozen = false;        ///< failed once and is not advanced any more
  };

  explicit RvePoints(std::unique_ptr<rve::Engine> _engine) : engine(std::move(_engine)) {}

  /// Takes RVEs in and evaluates their stress; returns their slots.
  std::vector<int> add(const std::vector<const rve::RveState *> &states);
  void remove(int slot);

  /// Advances those that are not frozen; returns the slots that failed, which stay as they were and are frozen.
  std::vector<int> advance(const std::vector<int> &slots, const std::vector<rve::Drive> &drives);

  const Point &point(int slot) const { return points[slot]; }
  rve::RveState state(int slot) const { return engine->state(slot); }
  std::string description() const { return engine->description(); }
  int size() const { return engine->size(); }
  double bytes(int slot) const { return engine->bytes_per_rve(points[slot].result.num_grains); }

  /// Everything of one RVE as doubles, for LAMMPS' buffers.
  std::vector<double> image(int slot) const;
  int add_image(const double *image);
  /// Length of image(); remembered until the next advance.
  int image_size(int slot) const;
  /// At least the length of image(), without asking the engine.
  int image_bound(int slot) const;

 private:
  std::unique_ptr<rve::Engine> engine;
  std::vector<Point> points;               // by slot
  mutable std::vector<int> image_sizes;    // by slot; 0: not known

  Point &settle(int slot, const rve::RveState &state);
};

}    // namespace LAMMPS_NS

#endif
