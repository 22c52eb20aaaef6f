// SPDX-License-Identifier: GPL-2.0-only
// Images of packings. An image permutes the axes and changes signs. The results are exact and never
// minus zero.

#include "rve/engine/packing_image.h"

#include "rve/core/error.h"

namespace rve {

namespace {

  /// Map of axes: axis a of the image is `sign[a]` times axis `from[a]` of the packing.
  template <int D> struct AxisMap {
    int from[D];
    int sign[D];
    bool is_mirror;
  };

  // R maps (x, y) to (-y, x). Row k of the table is R^k. The mirror acts first and reverses the
  // components that come from x.
  AxisMap<2> plane_map(int image)
  {
    constexpr AxisMap<2> TURNS[4] = {{{0, 1}, {1, 1}, false},
                                     {{1, 0}, {-1, 1}, false},
                                     {{0, 1}, {-1, -1}, false},
                                     {{1, 0}, {1, -1}, false}};
    AxisMap<2> map = TURNS[image % 4];
    map.is_mirror = image >= 4;
    if (map.is_mirror)
      for (int a = 0; a < 2; ++a)
        if (map.from[a] == 0) map.sign[a] = -map.sign[a];
    return map;
  }

  template <int D> AxisMap<D> axis_map(int image)
  {
    require(image >= 0 && image < NUM_IMAGES_OF<D>, "image of a packing is ", image,
            "; it must be from 0 to ", NUM_IMAGES_OF<D> - 1);
    const AxisMap<2> plane = plane_map(image % NUM_IMAGES);
    if constexpr (D == 2) {
      return plane;
    } else {
      const bool reverses_z = image / 8 % 2 == 1;
      const int from[3] = {plane.from[0], plane.from[1], 2};
      const int sign[3] = {plane.sign[0], plane.sign[1], reverses_z ? -1 : 1};
      AxisMap<3> map;
      map.is_mirror = plane.is_mirror != reverses_z;
      const int turns = image / 16;
      for (int a = 0; a < 3; ++a) {
        map.from[(a + turns) % 3] = from[a];
        map.sign[(a + turns) % 3] = sign[a];
      }
      return map;
    }
  }

  double with_sign(int sign, double value)
  {
    return sign > 0 || value == 0.0 ? value : -value;
  }

  // For a negative sign the function returns the fraction 1 - s, since unsigned numbers wrap as the
  // periodic cell does.
  std::uint64_t with_sign(int sign, std::uint64_t fraction)
  {
    return sign > 0 ? fraction : std::uint64_t{0} - fraction;
  }

  /// Maps D successive components.
  template <int D, class T> void map_vector(const AxisMap<D> &map, T *vector)
  {
    T original[D];
    for (int a = 0; a < D; ++a) original[a] = vector[a];
    for (int a = 0; a < D; ++a) vector[a] = with_sign(map.sign[a], original[map.from[a]]);
  }

  template <int D, class T> void map_vectors(const AxisMap<D> &map, std::vector<T> &vectors)
  {
    for (std::size_t i = 0; i + D <= vectors.size(); i += D) map_vector(map, &vectors[i]);
  }

  template <int D> void map_tensor(const AxisMap<D> &map, Tensor<double, D> &tensor)
  {
    const Tensor<double, D> original = tensor;
    for (int a = 0; a < D; ++a)
      for (int b = 0; b < D; ++b)
        tensor(a, b) = with_sign(map.sign[a] * map.sign[b], original(map.from[a], map.from[b]));
  }

  template <int D> void map_history(const AxisMap<D> &map, PairOf<D> &pair)
  {
    for (const RememberedNumber<D> &number : pair_memory<D>())
      if (number.begins_vector)
        map_vector(map, &number.of(pair));
      else if (map.is_mirror && number.is_mirrored)
        number.of(pair) = with_sign(-1, number.of(pair));
  }

}    // namespace

template <int D> Tensor<double, D> image_rotation(int image)
{
  const AxisMap<D> map = axis_map<D>(image);
  Tensor<double, D> q = Tensor<double, D>::zero();
  for (int a = 0; a < D; ++a) q(a, map.from[a]) = map.sign[a];
  return q;
}

template <int D> Tensor<double, D> image_of(const Tensor<double, D> &stress, int image)
{
  Tensor<double, D> result = stress;
  map_tensor(axis_map<D>(image), result);
  return result;
}

template <int D> RveStateOf<D> image_of(const RveStateOf<D> &state, int image)
{
  const AxisMap<D> map = axis_map<D>(image);
  RveStateOf<D> result = state;
  for (Tensor<double, D> *tensor :
       {&result.cell, &result.deformation, &result.list_cell, &result.servo_velocity_gradient})
    map_tensor(map, *tensor);
  map_vectors(map, result.fractional);
  map_vectors(map, result.list_fractional);
  map_vectors(map, result.velocity);
  if (D == 3) map_vectors(map, result.spin);
  if (map.is_mirror)
    for (double &spin : result.spin) spin = with_sign(-1, spin);
  for (PairOf<D> &pair : result.pairs) map_history(map, pair);
  return result;
}

template Tensor<double, 2> image_rotation(int);
template Tensor<double, 2> image_of(const Tensor<double, 2> &, int);
template RveStateOf<2> image_of(const RveStateOf<2> &, int);
template Tensor<double, 3> image_rotation(int);
template Tensor<double, 3> image_of(const Tensor<double, 3> &, int);
template RveStateOf<3> image_of(const RveStateOf<3> &, int);

}    // namespace rve
