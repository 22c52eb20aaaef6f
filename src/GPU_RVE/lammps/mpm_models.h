// SPDX-License-Identifier: GPL-2.0-only
// The constitutive models of fix mpm in the words of a script, and what fix_modify changes of them.

#pragma once

#include "lammps/script_words.h"
#include "mpm/constitutive.h"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace LAMMPS_NS {

class LAMMPS;

/// Largest number that fix mpm takes: products of two, and sums of many, are still numbers.
constexpr double LARGEST_MPM_NUMBER = 1e30;

/// A constitutive model of the points of a group.
template <int D> struct MpmModel {
  std::string group;
  int groupbit;
  std::string word;                             ///< rve, or that of an analytic law
  std::string fix_rve;                          ///< whose RVEs are the model, or
  std::shared_ptr<mpm::Constitutive<D>> law;    ///< an analytic one
  std::vector<double> arguments;                ///< of the law, without strength_reduction
  double strength_reduction = 1.0;              ///< factor by which the strength is divided [-]
  bool is_modified = false;                     ///< by fix_modify
  std::optional<double> density;                ///< [mass/length^3]; 0 or none: of the RVEs

  /// Reads the values of the keyword *model*.
  static MpmModel read(ScriptWords &words);
  /// These models with what `fix_modify ID ...` says; errors end in error->all.
  static std::vector<MpmModel> modified(LAMMPS *lmp, std::vector<MpmModel> models, int narg,
                                        char **arg);
  /// Words of a fix_modify that gives a model that is defined by the fix what this one has, or "" if
  /// it has no other.
  std::string modification() const;
  /// "c 1000 -> 800, phi 30 -> 24.79" for the parameters of the law that were others before, or "".
  std::string changes_since(const MpmModel &before) const;
};

}    // namespace LAMMPS_NS
