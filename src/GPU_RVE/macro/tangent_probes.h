// SPDX-License-Identifier: GPL-2.0-only
// The tangent of an RVE from its grains: clones of it take small strains in all directions, come to rest, and answer with their stresses.
// Knows the engine, not where states come from.

#pragma once

#include "macro/tangent.h"
#include "rve/engine/engine.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace macro {

/// Which response is meant.
enum class TangentKind {
  /// Contacts stick and do not roll off, and strains of both signs give the same stiffness.
  Elastic,
  /// Contacts have their friction; that of strains close to the present direction of straining.
  Loading
};

/// Strains are given over the mean overlap of contacts (overlap over sum of radii), the strain that contacts already have: so they mean the same
/// for soft and for stiff grains.
struct TangentOptions {
  TangentKind kind = TangentKind::Elastic;
  double probe = 0.0;    ///< strain of a clone over the mean overlap [-]
  /// Loading: strain before the probes, along the present direction, over the mean overlap [-].
  double lead = 0.0;
  double spread = 0.1;       ///< loading: how far probes leave that direction, over their size [-]
  int strain_steps = 500;    ///< DEM steps in which a clone is strained by a probe
  int lead_steps = 10000;    ///< and by the lead
  int look_steps = 500;      ///< DEM steps between looks at how far the clones are from rest
  /// DEM steps in which clones may come to rest, then they are taken as they are.
  int most_steps = 50000;
  double tolerance = 1e-5;    ///< unbalanced forces at rest over what a probe changes forces by [-]
  double damping = 0.7;       ///< local damping of the clones [-]

  /// What rounding and nonlinearity together change least in a number format (doc: compute rve/tangent).
  static TangentOptions of(rve::Format format, TangentKind kind);
  /// Throws InputError unless all are in their ranges; `what` is in front of messages.
  void check(const std::string &what) const;
};

/// What the clones of an RVE have told.
template <int D> struct ProbedTangentOf {
  using Matrix = rve::Tensor<double, D>;

  std::uint32_t status = rve::status::Ok;    ///< of all clones together
  /// Not if a clone failed, or if a direction of straining is needed and there is none: all else is zero then.
  bool is_measured = false;
  TangentOf<D> tangent;
  Matrix stress = Matrix::zero();    ///< of the RVE at rest, where the tangent is measured [stress]
  /// The direction of straining that was asked for, of size 1; zero: none.
  Matrix strain_rate = Matrix::zero();
  /// Of the stress along that direction: C : strain_rate, or measured along it where contacts slide [stress]
  Matrix response = Matrix::zero();
  double unrest = 0.0;    ///< largest of the clones, as the tolerance [-]
  /// Elastic: what differs with the sign of a strain, over what both signs have in common. Loading: how far C : strain_rate is from
  /// `response` [-].
  double nonlinearity = 0.0;
  int changed_contacts = 0;    ///< most contacts that a probe gained or lost, net
  int steps = 0;               ///< DEM steps of a clone
};

/// Clones live in an engine of their own, from the beginning of a call to its end.
template <int D> class TangentProbesOf {
 public:
  using State = rve::RveStateOf<D>;
  using Matrix = rve::Tensor<double, D>;

  /// The engine has no RVEs.
  TangentProbesOf(std::unique_ptr<rve::EngineOf<D>> _engine, const TangentOptions &_options);

  /// Tangents of `count` RVEs: state(k) and strain_rate(k) say what they are and how they are strained at present, with any spin; for
  /// elastic tangents the rate may be zero. All clones are advanced together, of as many RVEs at a time as fit into the memory of the engine.
  /// The bits of a tangent are those of its RVE alone.
  std::vector<ProbedTangentOf<D>> probe(int count, const std::function<State(int)> &state,
                                        const std::function<Matrix(int)> &strain_rate);

 private:
  std::unique_ptr<rve::EngineOf<D>> engine;
  TangentOptions options;

  struct Group;    // the clones of an RVE

  void begin(Group &group, State state);
  void multiply(Group &group);
  void strain_along(std::vector<Group> &groups);
  void evaluate(Group &group) const;
  void drop(Group &group);
  void advance(const std::vector<Group *> &groups, int steps, bool strained);
  void come_to_rest(std::vector<Group> &groups);
  void strain_and_rest(std::vector<Group> &groups, int steps);
  void probe_portion(std::vector<Group> &groups);
};

}    // namespace macro
