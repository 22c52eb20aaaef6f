// SPDX-License-Identifier: GPL-2.0-only
// Material points do not act on each other, so a script needs no pair style. What LAMMPS derives from its cutoff must then come from
// elsewhere, or LAMMPS warns of it in every run.

#pragma once

namespace LAMMPS_NS {

class LAMMPS;

/// Without a pair style, a bond style and a word of the script: atoms are not sorted, as they would not be after LAMMPS' warning, and the cutoff
/// of the communication is the skin of the neighbor list. From init() of a fix.
void settle_without_pairs(LAMMPS *lmp);

}    // namespace LAMMPS_NS
