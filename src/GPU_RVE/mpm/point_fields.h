// SPDX-License-Identifier: GPL-2.0-only
// List of the fields of material points. It determines the pointers of a PointView, the arrays of a
// caller, the copies on a device, messages between ranks, records of restart files and columns of
// output. A new field needs a member of PointFields and a row in each().

#pragma once

#include "mpm/grid.h"

#include <cstddef>
#include <type_traits>
#include <vector>

namespace mpm {

/// Row of the list for a field of type T, which has members of type double only.
template <class T> struct PointField {
  using Value = T;
  const char *name;    ///< word for the field in scripts
  const char *unit;    ///< "stress", ..., or "" for a dimensionless number
};

/// Fields of points in the plane only.
template <int D, template <class> class Array> struct PlaneFields {
};
template <template <class> class Array> struct PlaneFields<2, Array> {
  Array<double> hoop_stress{};    ///< in axisymmetry; tension positive [stress]
};

/// Fields of material points. `Array<T>` holds one field of all points: a pointer, a vector or a
/// buffer. A step changes the fields that are not const.
template <int D, template <class> class Array> struct PointFields : PlaneFields<D, Array> {
  Array<const Vec<D>> half_size{};         ///< half size of the point's box [length]
  Array<const double> mass{};              ///< above 0 [mass]
  Array<const double> initial_volume{};    ///< volume at F = I [length³]
  /// In 2D the area times the thickness, or the volume of a ring [length³].
  Array<double> volume{};
  Array<Tensor<D>> deformation_gradient{};    ///< F
  Array<Tensor<D>> stress{};                  ///< Cauchy, tension positive [stress]
  Array<Tensor<D>> velocity_gradient{};       ///< L [1/time]

  /// Calls visit(row, field of each set...) for all fields in the order of the members. `row` is a
  /// PointField.
  template <class Visit, class... Sets>
  static constexpr void each(const Visit &visit, Sets &...sets)
  {
    visit(PointField<Vec<D>>{"half_size", "length"}, sets.half_size...);
    visit(PointField<double>{"mass", "mass"}, sets.mass...);
    visit(PointField<double>{"initial_volume", "length^3"}, sets.initial_volume...);
    visit(PointField<double>{"volume", "length^3"}, sets.volume...);
    visit(PointField<Tensor<D>>{"deformation_gradient", ""}, sets.deformation_gradient...);
    visit(PointField<Tensor<D>>{"stress", "stress"}, sets.stress...);
    visit(PointField<Tensor<D>>{"velocity_gradient", "1/time"}, sets.velocity_gradient...);
    if constexpr (D == 2) visit(PointField<double>{"hoop_stress", "stress"}, sets.hoop_stress...);
  }
};

template <class T> using Pointer = T *;
template <class T> using Column = std::vector<std::remove_const_t<T>>;
template <class T> using Single = std::remove_const_t<T>;

/// The fields of one point.
template <int D> using PointRecord = PointFields<D, Single>;

/// Returns the fields of a new point: F = I, zeros otherwise.
template <int D> PointRecord<D> new_point()
{
  PointRecord<D> point;
  point.deformation_gradient = Tensor<D>::identity();
  return point;
}

/// Arrays of the fields of a caller's points.
template <int D> struct PointArrays : PointFields<D, Column> {
  using Fields = PointFields<D, Column>;

  void resize(std::size_t count)
  {
    Fields::each([=](const auto &, auto &column) { column.resize(count); }, *this);
  }
  PointRecord<D> record(std::size_t i) const
  {
    PointRecord<D> point;
    Fields::each([=](const auto &, auto &value, auto &column) { value = column[i]; }, point, *this);
    return point;
  }
  void set_record(std::size_t i, const PointRecord<D> &point)
  {
    Fields::each([=](const auto &, auto &value, auto &column) { column[i] = value; }, point, *this);
  }
  /// Sets the pointers of a view to the fields.
  void show(PointFields<D, Pointer> &view)
  {
    Fields::each([](const auto &, auto &pointer, auto &column) { pointer = column.data(); }, view,
                 *this);
  }
};

/// Number of bytes of a point according to the rows of each().
template <int D> constexpr std::size_t listed_bytes()
{
  std::size_t bytes = 0;
  PointRecord<D>::each([&](auto field) { bytes += sizeof(typename decltype(field)::Value); });
  return bytes;
}
static_assert(listed_bytes<2>() == sizeof(PointRecord<2>) &&
                  listed_bytes<3>() == sizeof(PointRecord<3>),
              "a member of PointFields has no row in each(), or a row of another type");

}    // namespace mpm
