// SPDX-License-Identifier: GPL-2.0-only
// Options of the solver, and functions for communication between ranks.

#pragma once

#include "cuda/device.h"
#include "mpm/boundary.h"
#include "mpm/grid.h"
#include "mpm/pore_water.h"
#include "mpm/shape_functions.h"
#include "rve/core/error.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace mpm {

/// Time of the update of stresses. Musl: at the end of the step from momenta that are extrapolated
/// again (Sulsky, Zhou & Schreyer 1995, Comput. Phys. Commun. 87, 236). Usavg: half of the
/// increment before the forces and half at the end (Nairn 2003, CMES 4, 649; Bardenhagen 2002, J.
/// Comput. Phys. 180, 383). Usavg conserves energy better and calls the constitutive model twice.
enum class Scheme { Musl, Usavg };

using rve::Device;

/// Options of a solver.
template <int D> struct SolverOptions {
  Vec<D> lo = Vec<D>::zero();    ///< domain [length]
  Vec<D> hi = Vec<D>::zero();
  double cell_size = 0.0;    ///< h [length]
  double thickness = 1.0;    ///< 2D: out-of-plane thickness of the points [length]
  /// 2D: x is the radius r and y the coordinate along the axis r = 0. Points are rings: masses,
  /// volumes and forces are those of a full turn. `thickness` has no effect.
  bool axisymmetric = false;
  ShapeFunction shape = ShapeFunction::Gimp;
  Scheme scheme = Scheme::Musl;
  double flip = 1.0;    ///< 1: points receive velocity increments (FLIP), 0: grid velocities (PIC)
  bool mean_dilation = false;    ///< volumetric parts of strain and stress are means over cells
  double damping = 0.0;          ///< Cundall's local damping of nodes, in [0, 1)
  PoreWater water;               ///< its volume in each point is in PointView::water
  std::array<SideKind, FACES<D>> sides{};       ///< in the order of Face; default free
  std::array<Dashpots, FACES<D>> dashpots{};    ///< in the order of Face; default none
  std::vector<RigidBodyOptions> rigid_bodies;
  /// Initial vertices of each body, used for the form Convex; the list may be shorter than
  /// rigid_bodies if the last bodies have other forms [length].
  std::vector<std::vector<Vec<D>>> rigid_body_vertices;
  std::vector<std::string> rigid_body_names;    ///< used in messages; the default is the index
  int threads = 1;                              ///< OpenMP threads; no influence on results
  Device device = Device::Cpu;                  ///< no influence on results
  int device_number = 0;                        ///< taken modulo the number of usable devices

  /// Number of bodies that can turn.
  int num_turning() const
  {
    int count = 0;
    for (const RigidBodyOptions &body : rigid_bodies) count += body.form != BodyForm::Face;
    return count;
  }
  /// True if a side has dashpots.
  bool absorbs() const
  {
    return std::any_of(dashpots.begin(), dashpots.end(),
                       [](const Dashpots &of_side) { return of_side.exist(); });
  }
  std::string name_of_body(int body) const
  {
    return "rigid body " +
        (body < static_cast<int>(rigid_body_names.size()) ? rigid_body_names[body]
                                                          : std::to_string(body));
  }
};

/// Numbers that this rank sends to another rank and receives from it.
struct Message {
  int rank;    ///< the other rank
  const std::int64_t *sent;
  std::size_t sent_count;
  std::int64_t *received;
  std::size_t received_count;
};

/// Functions for communication: sums and maxima in place over all ranks, and messages between pairs
/// of ranks. All ranks make the same calls, and both ends of a message have the same counts.
/// Messages without numbers are left out. The defaults are for one rank.
struct Communication {
  int ranks = 1;
  int rank = 0;    ///< index of this rank
  std::function<void(std::int64_t *data, std::size_t count)> sum_over_ranks = [](std::int64_t *,
                                                                                 std::size_t) {};
  std::function<void(double *data, std::size_t count)> max_over_ranks = [](double *, std::size_t) {
  };
  std::function<void(const std::vector<Message> &messages)> exchange =
      [](const std::vector<Message> &) {};
  /// Throws on all ranks if `problem` is not empty on at least one rank. The message is the text of
  /// the lowest of these ranks. Collective.
  std::function<void(const std::string &problem)> raise_on_all = [](const std::string &problem) {
    if (!problem.empty()) throw rve::InputError(problem);
  };
  /// Returns memory of `bytes` bytes that all ranks share, filled with zeros. Returns null on all
  /// ranks if that is impossible, for example on several computers. Collective.
  std::function<std::shared_ptr<void>(std::size_t bytes)> shared_memory = [](std::size_t) {
    return std::shared_ptr<void>();
  };
};

}    // namespace mpm
