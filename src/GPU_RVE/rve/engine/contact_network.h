// The contacts of a state, found on the host in double precision: for file output, for the stability bound, and as a slow,
// plain reference. The engine has its own lists.

#ifndef RVE_ENGINE_CONTACT_NETWORK_H
#define RVE_ENGINE_CONTACT_NETWORK_H

#include "rve/engine/state.h"
#include "rve/physics/laws/law.h"

#include <vector>

namespace rve {

/// Two overlapping grains, first < second.
struct TouchingPair {
  int first;
  int second;
  Vec<double, 2> branch;    ///< x_second - x_first, nearest image [length]
  Vec<double, 2> normal;    ///< unit, first to second
  double overlap;           ///< r_first + r_second - |branch| > 0 [length]
};

ContactPlace place_of(const RveState &state, const TouchingPair &contact);

/// All contacts of the state, ordered by first, then second. O(N) where the cell is at least three contact distances wide,
/// O(N^2) below. Grains with coinciding centres are skipped: they have no normal.
std::vector<TouchingPair> find_contacts(const RveState &state);

/// Forgets a largest contact force far above the forces of the contacts that are there, which a file may have and no run leaves: the
/// scale of forces would hold none of them. The engine then begins with one of its own.
void forget_absurd_force(RveState &state);

/// Forces of springs that pairs remember, as the first grain sees them.
struct SpringForces {
  double
      tangential;    ///< on the first grain along t = (-n_y, n_x), n from first to second [force]
  double rolling;    ///< moment on the first grain over the reduced radius [force]
};

/// Those of these contacts; zero where the state has none.
std::vector<SpringForces> spring_forces(const RveState &state,
                                        const std::vector<TouchingPair> &contacts);

/// A contact with what its springs say; dashpots are not in it.
struct SpringContact {
  TouchingPair geometry;
  int image[2];           ///< x_second + H image is the image that the branch reaches
  double normal_force;    ///< of the springs, repulsion positive [force]
  SpringForces springs;
  Vec<double, 2> force_on_first;    ///< -f_n n + f_t t, t = (-n_y, n_x) [force]
  double
      mobilized_friction;    ///< |f_t| over what friction allows, 1 where it slides; 1 without friction [-]
};

/// All contacts of the state, in the order of find_contacts().
std::vector<SpringContact> find_spring_contacts(const RveState &state);

/// Mobilized friction from which a contact is said to slide [-]. A run compares forces in the number format of its engine; here the
/// normal force follows in double precision from positions, and differs by less than 1e-3 of itself in format fast.
constexpr double SLIDING = 0.999;

/// Love's stress of the springs, dashpots excluded, tension positive [stress].
Tensor2 spring_stress(const RveState &state);

/// Branch vector from grain i to the nearest image of grain j, from the wrapping difference of fractional coordinates [length].
Vec<double, 2> branch_vector(const RveState &state, int i, int j);

}    // namespace rve

#endif
