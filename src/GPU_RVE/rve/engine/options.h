// SPDX-License-Identifier: GPL-2.0-only
// Options that a user chooses once for a batch of RVEs. The engine selects kernels that were
// compiled for these options.

#pragma once

#include "cuda/device.h"
#include "rve/engine/contact_model.h"

#include <functional>
#include <string>

namespace rve {

/// Number format. `fast`: 32-bit positions and fp32. `mixed`: 64-bit positions, fp64 gap and
/// history, otherwise fp32. `double`: 64-bit positions, fp64. `single`: fp32 everywhere, as in the
/// paper, to study its errors; disks on CPUs only.
enum class Format { Fast, Mixed, Double, Single };

/// Lever arms of a contact. Contact: r - overlap/2 for surface velocity and torque (objective,
/// equation (11)). Lammps: r for the velocity, r - overlap/2 for the torque, as in `pair granular`;
/// not objective, for comparisons only.
enum class Arms { Contact, Lammps };

/// Arithmetic of the kernels. Strict: IEEE operations, with the same bits on CPU and GPU. Relaxed:
/// approximate roots and quotients and contracted operations, for `fast` and `mixed` on a GPU only.
enum class Arithmetic { Strict, Relaxed };

struct Options {
  ContactModel contacts;    ///< contact model for all RVEs (contacts_of)
  Format format = Format::Mixed;
  Arithmetic arithmetic = Arithmetic::Strict;
  Device device = Device::Auto;
  Arms arms = Arms::Contact;
  int threads = 0;    ///< CPU threads; 0: default of OpenMP (OMP_NUM_THREADS)
  /// Local rank, which selects the CUDA device. If there are more ranks than devices, several ranks
  /// use one device.
  int device_number = 0;
  int block_size = 0;    ///< CUDA threads per block; 0: chosen from the number of grains
  double skin = 0.0;     ///< skin of the Verlet list [length]; 0: a share of the mean radius
  /// Overlap over smaller radius above which an RVE fails [-], in (0, 1).
  double overlap_limit = 0.5;
  bool track_energy = false;    ///< fill EnergyTotals; costs a stress sum per step
  /// Function for lines about kernels that are compiled at run time; if empty, they go to stderr.
  std::function<void(const std::string &)> log = {};
};

/// Word in a script and the value that it selects.
template <class T> struct Choice {
  const char *word;
  T value;
};
constexpr Choice<Format> FORMAT_CHOICES[] = {{"fast", Format::Fast},
                                             {"mixed", Format::Mixed},
                                             {"double", Format::Double},
                                             {"single", Format::Single}};
constexpr Choice<Arithmetic> ARITHMETIC_CHOICES[] = {{"strict", Arithmetic::Strict},
                                                     {"relaxed", Arithmetic::Relaxed}};
constexpr Choice<Device> DEVICE_CHOICES[] = {
    {"auto", Device::Auto}, {"cpu", Device::Cpu}, {"cuda", Device::Cuda}};
constexpr Choice<Arms> ARM_CHOICES[] = {{"contact", Arms::Contact}, {"lammps", Arms::Lammps}};

/// Returns "fast", "mixed", "double" or "single".
std::string to_string(Format format);

}    // namespace rve
