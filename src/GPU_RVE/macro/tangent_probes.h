// SPDX-License-Identifier: GPL-2.0-only
// Measures the tangent stiffness of an RVE by probes. Each clone of the RVE is strained slightly by
// a strain of its own and comes to rest. The stresses of the clones give the tangent.

#pragma once

#include "macro/tangent.h"
#include "rve/engine/engine.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace macro {

enum class TangentKind {
  /// Contacts do not slide, and do not roll where they have rolling resistance. Strains of both
  /// signs give the same stiffness.
  Elastic,
  /// Contacts keep the friction of the material. The stiffness applies to strains close to the
  /// present direction of straining.
  Loading
};

/// Strains are given relative to the mean overlap of contacts (overlap over sum of radii), so that
/// the same values apply to soft and stiff grains.
struct TangentOptions {
  TangentKind kind = TangentKind::Elastic;
  double probe = 0.0;    ///< ratio of the strain of a clone to the mean overlap [-]
  /// Loading only: a strain along the present direction precedes the probes. This is the ratio of
  /// the strain to the mean overlap [-].
  double lead = 0.0;
  /// Loading only: relative deviation of the strain of a probe from the present direction [-].
  double spread = 0.1;
  int strain_steps = 500;    ///< DEM steps in which a probe is strained
  int lead_steps = 10000;    ///< DEM steps of the strain `lead`
  int look_steps = 500;      ///< DEM steps between checks whether clones are at rest
  /// Most DEM steps in which clones come to rest. Clones that still move after them are used as
  /// they are.
  int most_steps = 50000;
  double tolerance = 1e-5;    ///< unbalanced force ratio at rest, divided by `probe` [-]
  double damping = 0.7;       ///< local damping of clones [-]

  /// Options with the least error by rounding and nonlinearity in a number format
  /// (doc/src/dev_numerics.rst).
  static TangentOptions of(rve::Format format, TangentKind kind);
  /// Throws InputError if an option is out of range. `what` is the start of the message.
  void check(const std::string &what) const;
};

/// Tangent of an RVE by its clones.
template <int D> struct ProbedTangentOf {
  using Matrix = rve::Tensor<double, D>;

  std::uint32_t status = rve::status::Ok;    ///< status bits of all clones
  /// False if a clone failed, if the tangent is not finite, or if a loading tangent has no
  /// direction of straining. `tangent` and `response` are zero then.
  bool is_measured = false;
  TangentOf<D> tangent;
  Matrix stress =
      Matrix::zero();    ///< stress of the RVE at rest, where the tangent is measured [stress]
  /// Given direction of straining with norm 1; zero: none.
  Matrix strain_rate = Matrix::zero();
  /// Change of stress per strain along this direction: C : strain_rate for an elastic tangent,
  /// measured for a loading tangent [stress].
  Matrix response = Matrix::zero();
  double unrest =
      0.0;    ///< largest unbalanced force ratio of a clone, divided by TangentOptions::probe [-]
  /// Elastic: ratio of the even to the odd part of the stress change, as a function of the strain;
  /// the largest over all strains [-]. Loading: relative difference between C : strain_rate and
  /// `response` [-].
  double nonlinearity = 0.0;
  int changed_contacts = 0;    ///< largest net change of the number of contacts by a probe
  int steps = 0;               ///< DEM steps of a clone
};

/// Measures tangents. The clones are in an engine of their own and are removed at the end of a
/// call.
template <int D> class TangentProbesOf {
 public:
  using State = rve::RveStateOf<D>;
  using Matrix = rve::Tensor<double, D>;

  /// The engine must be empty.
  TangentProbesOf(std::unique_ptr<rve::EngineOf<D>> _engine, const TangentOptions &_options);

  /// Tangents of `count` RVEs. RVE k has the state state(k) and the present velocity gradient
  /// strain_rate(k), whose spin is ignored. The gradient may be zero for elastic tangents. The
  /// clones of as many RVEs as fit into the memory of the engine are advanced together. The bits of
  /// a tangent do not depend on other RVEs.
  std::vector<ProbedTangentOf<D>> probe(int count, const std::function<State(int)> &state,
                                        const std::function<Matrix(int)> &strain_rate);

 private:
  std::unique_ptr<rve::EngineOf<D>> engine;
  TangentOptions options;

  struct Group;    ///< clones of an RVE

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
