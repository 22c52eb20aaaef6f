// SPDX-License-Identifier: GPL-2.0-only
// Settings for scripts without a pair style. Material points have no pair forces, but LAMMPS
// derives the settings of sorting and of communication from the cutoff of a pair style.

#pragma once

namespace LAMMPS_NS {

class LAMMPS;

/// Switches the sorting of atoms off, unless the script sets a bin size for it. Sets the
/// communication cutoff to the skin of the neighbor list, unless the script sets a cutoff. LAMMPS
/// would otherwise warn in every run. Does nothing with a pair style or a bond style. A fix calls
/// this function in its init().
void set_up_without_pairs(LAMMPS *lmp);

}    // namespace LAMMPS_NS
