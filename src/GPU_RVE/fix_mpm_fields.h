// SPDX-License-Identifier: GPL-2.0-only
// Data that fix mpm stores for each point between steps: the fields of the solver
// (mpm/point_fields.h) and two fields of the fix. Position and velocity are in atom->x and atom->v.

#pragma once

#include "fix_mpm_restart.h"
#include "mpm/point_fields.h"

#include <cstring>
#include <string>
#include <utility>
#include <vector>

namespace LAMMPS_NS {

template <int D> struct MpmFields : mpm::PointArrays<D> {
  static constexpr double NO_LAW = -1.0;

  std::vector<mpm::Vec<D>> reference;    // initial position [length]
  // Index in MemoryLayout of the constitutive law whose state variables the point stores, or
  // NO_LAW.
  std::vector<double> remembering;

  /// Data of a point in messages between ranks and in restart files. The state variables of the
  /// point come after this record. An initial volume of 0 means that the atom is not a material
  /// point yet.
  struct Record {
    mpm::Vec<D> reference = mpm::Vec<D>::zero();
    mpm::PointRecord<D> fields = mpm::new_point<D>();
    double remembering = NO_LAW;
  };
  static constexpr int DOUBLES = sizeof(Record) / sizeof(double);
  static_assert(MPM_RESTART_VERSION == 9 && DOUBLES == (D == 2 ? 21 : 37),
                "restart files change: raise their version");

  void resize_fields(int count)
  {
    this->resize(count);
    reference.resize(count);
    remembering.resize(count);
  }
  void set_point(int i, const Record &record)
  {
    reference[i] = record.reference;
    this->set_record(i, record.fields);
    remembering[i] = record.remembering;
  }
  Record point(int i) const { return {reference[i], this->record(i), remembering[i]}; }

  /// Writes the record of a point as DOUBLES numbers.
  void pack_point(int i, double *buf) const
  {
    const Record record = point(i);
    memcpy(buf, &record, sizeof(record));
  }
  /// Reads the record of a point from DOUBLES numbers.
  void unpack_point(int i, const double *buf)
  {
    Record record;
    memcpy(static_cast<void *>(&record), buf, sizeof(record));
    set_point(i, record);
  }

  /// Returns the stress of an axisymmetric point; the third axis is the hoop direction [stress].
  rve::Tensor3 with_hoop_stress(int i) const
  {
    rve::Tensor3 stress = rve::in_plane_strain<3>(this->stress[i]);
    if constexpr (D == 2) stress(2, 2) = this->hoop_stress[i];
    return stress;
  }
  /// Returns the deformation gradient of an axisymmetric point.
  rve::Tensor3 with_hoop_stretch(int i) const
  {
    const mpm::Tensor<D> &in_plane = this->deformation_gradient[i];
    rve::Tensor3 F = rve::in_plane_strain<3>(in_plane);
    if (D == 2) F(2, 2) = this->volume[i] / (this->initial_volume[i] * determinant(in_plane));
    return F;
  }

  /// Returns the scalar field with this name and its unit, or null if there is none.
  std::pair<const std::vector<double> *, std::string> number_field(const std::string &name) const
  {
    std::pair<const std::vector<double> *, std::string> found;
    mpm::PointArrays<D>::each(
        [&](const auto &field, const auto &column) {
          if constexpr (std::is_same_v<decltype(column), const std::vector<double> &>)
            if (name == field.name) found = {&column, field.unit};
        },
        *this);
    return found;
  }
};

}    // namespace LAMMPS_NS
