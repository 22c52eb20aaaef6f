// SPDX-License-Identifier: GPL-2.0-only
// Files of RVEs: packing files and libraries of packings of this package, and an export that plain
// LAMMPS and OVITO read.

#pragma once

#include "rve/engine/packing_library.h"
#include "rve/engine/state.h"

#include <string>

namespace rve {

/// Reads a packing file. Throws InputError with path:line for anything missing, broken or out of
/// range. Contacts of the file become pairs of the state. The state has no list (list_cell is
/// zero), and the engine builds it.
///
/// The file is plain text with comments after `#` and one statement per line, in this order:
///   gpu_rve_packing 1            for disks; 2, followed by a line `dimension 2` or `dimension 3`,
///                                for disks or spheres
///   material                     followed by `contact_law word`, default hooke, and lines
///                                `name value`, the parameters of such a material; those of rolling
///                                resistance are optional, default 0. Spheres have no `thickness`,
///                                and `mass_scaling` (optional, default 1) instead of `mass_depth`
///   cell                         followed by the rows of H
///   deformation                  followed by the rows of F; optional, default 1
///   servo_velocity_gradient      followed by the rows of L; optional, default 0
///   largest_contact_force value  optional, default 0
///   grains N                     followed by N lines: id (1 to N, any order), radius, fractional
///                                coordinates as integers s 2^64, components of the peculiar
///                                velocity, spin
///   contacts M                   followed by M lines: two ids, and the numbers of PAIR_MEMORY or
///                                SPATIAL_PAIR_MEMORY in their order; the tangential force is
///                                required, missing numbers at the end of a line are 0
///   checksum digits              16 hexadecimal digits, or none (not checked), as in files
///                                that are written by hand
///   end
/// The checksum is the 64-bit FNV-1a hash of the preceding statements without comments. In the
/// hashed text the words of a statement are separated by single blanks, and each statement ends
/// with a line feed. Numbers are the shortest decimals that read back to the same double, so a file
/// stores a state exactly. The file has no run counters, energy bookkeeping or Verlet list, which
/// belong to a run (see serialize). Throws InputError also if the packing has the other dimension.
template <int D = 2> RveStateOf<D> read_packing(const std::string &path);

/// Returns the dimension of a packing file or of the first packing of a library: 2 for disks, 3 for
/// spheres. The function reads no more than necessary, and throws InputError with path:line if the
/// part that it reads is broken.
int dimension_of_packing(const std::string &path);

/// Writes a packing file, completely or not at all (OutputFile). Throws InputError if the state is
/// not sound or the file cannot be written.
template <int D> void write_packing(const std::string &path, const RveStateOf<D> &state);

/// Reads a library. A packing file is read as a library of one packing. The row of this packing has
/// only the number of grains and the void ratio. Throws InputError with path:line for anything
/// missing, broken or out of range, and if index and packings disagree.
///
/// A library is plain text like a packing file:
///   gpu_rve_library 1
///   packings N       followed by N lines of the index: number (0 to N-1, in order), seed, void
///                    ratio, preparation friction, overconsolidation ratio, pressure, number of
///                    grains
///   packing K        followed by a packing file; N times, K in order
///   checksum digits  as above, from `gpu_rve_library` on
///   end_library
template <int D = 2> PackingLibraryOf<D> read_library(const std::string &path);

/// Writes a library, completely or not at all. Throws InputError if the library or a packing is not
/// sound, or if the file cannot be written.
template <int D> void write_library(const std::string &path, const PackingLibraryOf<D> &library);

/// Writes a LAMMPS data file (atom_style sphere, triclinic, one atom type) and `<path>.contacts`;
/// the latter is omitted if the path is a device or a fifo. Throws InputError as write_packing().
///
/// LAMMPS requires cell vector a along +x, and b in the plane of x and y. So the packing is rotated
/// (positions, velocities, spins, forces). Then multiples of a are subtracted from b, and multiples
/// of a and b from c, until |xy| and |xz| are at most lx/2, |yz| at most ly/2. Ids are 1 to N in
/// the order of the state. Velocities are peculiar: add L x for a deforming cell.
///
/// For disks z runs from -largest radius to +largest radius, and the density column is mass / (4/3
/// pi r^3), so that LAMMPS computes the same mass. LAMMPS' moment of inertia is 2/5 m r^2 unless
/// `fix nve/sphere ... disc` is used; the engine's is m r^2/2.
///
/// Contact forces are the forces of the springs on the first grain, without dashpots: -f_n n + f_t
/// (-n_y, n_x) for disks, and -f_n n + f_t for spheres. If the state has rolling forces, a column
/// for disks contains the moment on the first grain divided by the reduced radius. For spheres
/// three columns contain the rolling force and one the twisting moment, as in PairOf<3>.
template <int D> void write_lammps_data(const std::string &path, const RveStateOf<D> &state);

}    // namespace rve
