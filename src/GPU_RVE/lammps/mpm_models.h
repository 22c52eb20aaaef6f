// SPDX-License-Identifier: GPL-2.0-only
// Constitutive models of fix mpm: the keyword *model* and the changes by fix_modify.

#pragma once

#include "lammps/script_arguments.h"
#include "mpm/constitutive.h"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace LAMMPS_NS {

class LAMMPS;

/// Largest number that fix mpm accepts. Products of two such numbers, and sums of many, are finite.
constexpr double LARGEST_MPM_NUMBER = 1e30;

/// A constitutive model of the points of a group.
template <int D> struct MpmModel {
  std::string group;
  int groupbit;
  std::string word;       ///< rve, or the name of an analytic law
  std::string fix_rve;    ///< ID of the fix rve whose RVEs are the model; empty for an analytic law
  std::shared_ptr<mpm::Constitutive<D>> law;    ///< analytic law; null for RVEs
  std::vector<double> arguments;                ///< arguments of the law before strength reduction
  double strength_reduction = 1.0;              ///< factor by which the strength is divided [-]
  bool is_modified = false;                     ///< true after a change by fix_modify
  bool axisymmetric = false;                    ///< the law is an axisymmetric one
  /// Density [mass/length^3]. 0: the density of the RVEs. No value: MpmSettings::density.
  std::optional<double> density;

  /// Reads the values of the keyword *model*. An error ends in error->all.
  static MpmModel read(ScriptArguments &words);
  /// Replaces the law by its axisymmetric form. Throws rve::InputError if there is none.
  void set_axisymmetric();
  /// Returns `models` with the changes of `fix_modify ID ...`, whose words after the ID are `arg`.
  /// An error ends in error->all.
  static std::vector<MpmModel> modified(LAMMPS *lmp, std::vector<MpmModel> models,
                                        const std::string &fix_id, int narg, char **arg);
  /// Returns the arguments of a fix_modify that changes the model of the fix command into this one,
  /// or "" if fix_modify has not changed the model.
  std::string modification() const;
  /// Returns the parameters of the law that differ from `before`, for example
  /// "c 1000 -> 800, phi 30 -> 24.79", or "".
  std::string changes_since(const MpmModel &before) const;
};

}    // namespace LAMMPS_NS
