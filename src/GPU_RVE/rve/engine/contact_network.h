// The contacts of a state, found on the host in double precision: for file output, for the stability bound, and as a slow,
// plain reference. The engine has its own lists.

#ifndef RVE_ENGINE_CONTACT_NETWORK_H
#define RVE_ENGINE_CONTACT_NETWORK_H

#include "rve/core/spring_forces.h"
#include "rve/engine/state.h"

#include <vector>

namespace rve {

/// Two overlapping grains, first < second.
struct ContactGeometry {
  int first;
  int second;
  Vec<double, 2> branch;    ///< x_second - x_first, nearest image [length]
  Vec<double, 2> normal;    ///< unit, first to second
  double overlap;           ///< r_first + r_second - |branch| > 0 [length]
};

/// All contacts of the state, ordered by first, then second. O(N) where the cell is at least three contact distances wide,
/// O(N^2) below. Grains with coinciding centres are skipped: they have no normal.
std::vector<ContactGeometry> find_contacts(const RveState &state);

/// Forgets a largest contact force far above the forces of the contacts that are there, which a file may have and no run leaves: the
/// scale of forces would hold none of them. The engine then begins with one of its own.
void forget_absurd_force(RveState &state);

/// Histories of these contacts, as their first grains see them; zero where the state has none.
std::vector<SpringForces<double>> spring_forces(const RveState &state,
                                                const std::vector<ContactGeometry> &contacts);

/// Love's stress of the springs, dashpots excluded, tension positive [stress].
Tensor2 spring_stress(const RveState &state);

/// Branch vector from grain i to the nearest image of grain j, from the wrapping difference of fractional coordinates [length].
Vec<double, 2> branch_vector(const RveState &state, int i, int j);

}    // namespace rve

#endif
