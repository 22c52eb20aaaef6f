// SPDX-License-Identifier: GPL-2.0-only
// Pore water of fix mpm: the numbers that each point stores, their initial values, the columns of
// the output, and reports. Functions that are collective say so.

#pragma once

#include "fix_mpm_jobs.h"

#include <array>
#include <string>
#include <vector>

namespace LAMMPS_NS {

template <int D> class MpmWater : protected Pointers {
 public:
  using Points = mpm::PointView<D>;
  using Atoms = std::vector<int>;

  explicit MpmWater(const MpmSetup<D> &_setup) : Pointers(_setup.lmp), setup(_setup) {}

  // ---- numbers of points, in messages between ranks and in restart files ----

  /// Returns true if the script has the keyword water.
  bool exists() const { return settings().given; }
  /// Number of doubles that each point stores; 0 without water.
  int width() const { return exists() ? (int) NUMBERS : 0; }
  /// Returns the names of the numbers of a point, or "" without water.
  std::string names() const;
  void resize(int count);
  void clear(int i);
  void copy(int i, int j);
  /// Writes the numbers of a point and returns the end of the written numbers.
  double *pack(int i, double *buf) const;
  /// Reads the numbers of a point and returns the end of the read numbers.
  const double *unpack(int i, const double *buf);
  /// Sets the pointers of a view to the fields of the solver.
  void show(Points &points);
  /// Returns rows of body forces for the solver [force]. They are atom->f, or with submerged ground
  /// atom->f reduced by buoyancy. `mass` has the masses of the points. Valid until the next call.
  double *body_forces(const double *mass);

  // ---- initial values ----

  /// Finds the porosities of the new points `made`. Collective. The density and the pressure below
  /// need it, and it must be called again after RVEs have changed.
  void find_porosities(const Points &points, const Atoms &made);
  /// Returns the mass of the water that a new point gets, per volume of the point [mass/length^3].
  double density_at_start(int i) const
  {
    return is_wet(i) ? settings().density * porosity[i] : 0.0;
  }
  /// Returns the pore pressure of a new point [stress].
  double pressure_at_start(int i) const;
  /// Returns the density of the water that a new point displaces, if its weight is reduced by
  /// buoyancy; otherwise 0 [mass/length^3].
  double buoyancy_at_start(int i) const
  {
    return settings().is_submerged() && is_wet(i) ? settings().density : 0.0;
  }
  /// Fills the pores of the new points `made`, whose stresses are known. Collective.
  void begin(const Points &points, const Atoms &made);

  // ---- output ----

  enum Column { PORE_PRESSURE, POROSITY, R_U, WATER_VOLUME, COLUMNS };
  static constexpr const char *COLUMN_NAMES[COLUMNS] = {"pore_pressure", "porosity", "r_u",
                                                        "water_volume"};
  /// Returns the column with this name, or -1.
  static int column(const std::string &name);
  static const char *unit(int column)
  {
    return column == PORE_PRESSURE ? "stress" : column == WATER_VOLUME ? "length^3" : "";
  }
  double value(int column, const Points &points, int i) const;

  /// Logs the range of the water, and warns if the ground carries much of an undrained load. Does
  /// nothing if no points were filled since the last report. Collective.
  void report(const Points &points);
  /// Warns of points whose water cavitates. Collective.
  void report_cavitation(const Points &points) const;

 private:
  // WATER and GRAINS are volumes [length^3]. The others are values at the start, compression
  // positive [stress].
  enum { WATER, GRAINS, PRESSURE, VERTICAL, NUMBERS };

  const MpmSetup<D> &setup;
  std::array<std::vector<double>, NUMBERS> numbers;
  std::vector<double> porosity, table;    // per atom; only while points are created
  std::vector<double> forces;             // rows of three, of body_forces()
  bool is_new = false;

  const MpmWaterSettings &settings() const { return setup.settings.water; }
  /// Ends with an error if submerged ground would float. Collective.
  void check_buoyancy(const Points &points, const Atoms &made) const;
  /// Returns true if a new point gets water.
  bool is_wet(int i) const;
  mpm::PoreVolumes volumes(const Points &points, int i) const
  {
    return {numbers[WATER][i], numbers[GRAINS][i], points.volume[i]};
  }
  double pressure(const Points &points, int i) const
  {
    return mpm::pore_pressure(setup.settings.options.water, volumes(points, i));
  }
};

}    // namespace LAMMPS_NS
