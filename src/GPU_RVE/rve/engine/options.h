// SPDX-License-Identifier: GPL-2.0-only
// What a user chooses once for a batch. The engines turn it into types, once, when they are made.

#pragma once

#include "cuda/device.h"
#include "rve/engine/contact_model.h"

#include <functional>
#include <string>

namespace rve {

/// Number format: `fast` 32-bit positions and fp32; `mixed` 64-bit positions, fp64 gap and history, fp32 rest;
/// `double` 64-bit positions, fp64; `single` fp32 everywhere, as the paper, for the study of what it loses, of disks on CPUs.
enum class Format { Fast, Mixed, Double, Single };

/// Lever arms of a contact. Contact: r - overlap/2 for surface velocity and torque (objective, equation (11)).
/// Lammps: r for the velocity, r - overlap/2 for the torque, as `pair granular`; not objective, for cross-checks only.
enum class Arms { Contact, Lammps };

/// Strict: IEEE operations, the same bits on CPU and GPU. Relaxed: approximate root and quotient and contracted operations, for
/// `fast` and `mixed` on a GPU only.
enum class Arithmetic { Strict, Relaxed };

struct Options {
  ContactModel contacts;    ///< of the RVEs: what they need together (contacts_of)
  Format format = Format::Mixed;
  Arithmetic arithmetic = Arithmetic::Strict;
  Device device = Device::Auto;
  Arms arms = Arms::Contact;
  int threads = 0;    ///< CPU threads; 0: as OpenMP decides (OMP_NUM_THREADS)
  /// CUDA device, the local rank; beyond the last one it begins with the first again.
  int device_number = 0;
  int block_size = 0;    ///< CUDA threads per block; 0: chosen from the number of grains
  double skin = 0.0;     ///< of the Verlet list [length]; 0: a share of the mean radius
  /// Overlap / smaller radius beyond which an RVE fails [-], in (0, 1).
  double overlap_limit = 0.5;
  bool track_energy = false;    ///< fill EnergyLedger; costs a stress sum per step
  /// Takes lines about kernels that are compiled at run time; without it they go to the standard error.
  std::function<void(const std::string &)> log = {};
};

/// A word of users, and the value that it stands for.
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

/// "fast", "mixed", "double" or "single".
std::string to_string(Format format);

}    // namespace rve
