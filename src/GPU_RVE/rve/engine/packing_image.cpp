// Signed permutations of axes: no rounding anywhere, and minus zero is avoided.

#include "rve/engine/packing_image.h"

#include "rve/core/error.h"

#include <string>

namespace rve {

namespace {

  /// Axis a of the image is `sign[a]` times axis `from[a]` of the packing.
  struct AxisMap {
    int from[2];
    int sign[2];
  };

  // (x, y) -> (-y, x) turns the rows of R^(k mod 4); the mirror reverses what is taken from x
  AxisMap axis_map(int image)
  {
    require(image >= 0 && image < NUM_IMAGES,
            "image of a packing is " + std::to_string(image) + "; it must be from 0 to " +
                std::to_string(NUM_IMAGES - 1));
    constexpr AxisMap TURNS[4] = {
        {{0, 1}, {1, 1}}, {{1, 0}, {-1, 1}}, {{0, 1}, {-1, -1}}, {{1, 0}, {1, -1}}};
    AxisMap map = TURNS[image % 4];
    if (image >= 4)
      for (int a = 0; a < 2; ++a)
        if (map.from[a] == 0) map.sign[a] = -map.sign[a];
    return map;
  }

  double with_sign(int sign, double value)
  {
    return sign > 0 || value == 0.0 ? value : -value;
  }

  // the fraction 1 - s; unsigned numbers wrap as the cell does
  std::uint64_t with_sign(int sign, std::uint64_t fraction)
  {
    return sign > 0 ? fraction : std::uint64_t{0} - fraction;
  }

  template <class T> void map_vectors(const AxisMap &map, std::vector<T> &vectors)
  {
    for (std::size_t i = 0; i + 1 < vectors.size(); i += 2) {
      const T original[2] = {vectors[i], vectors[i + 1]};
      for (int a = 0; a < 2; ++a) vectors[i + a] = with_sign(map.sign[a], original[map.from[a]]);
    }
  }

  void map_tensor(const AxisMap &map, Tensor2 &tensor)
  {
    const Tensor2 original = tensor;
    for (int a = 0; a < 2; ++a)
      for (int b = 0; b < 2; ++b)
        tensor(a, b) = with_sign(map.sign[a] * map.sign[b], original(map.from[a], map.from[b]));
  }

}    // namespace

Tensor2 image_rotation(int image)
{
  const AxisMap map = axis_map(image);
  Tensor2 q = Tensor2::zero();
  for (int a = 0; a < 2; ++a) q(a, map.from[a]) = map.sign[a];
  return q;
}

Tensor2 image_of(const Tensor2 &stress, int image)
{
  Tensor2 result = stress;
  map_tensor(axis_map(image), result);
  return result;
}

RveState image_of(const RveState &state, int image)
{
  const AxisMap map = axis_map(image);
  RveState result = state;
  for (Tensor2 *tensor :
       {&result.cell, &result.deformation, &result.list_cell, &result.servo_velocity_gradient})
    map_tensor(map, *tensor);
  map_vectors(map, result.fractional);
  map_vectors(map, result.list_fractional);
  map_vectors(map, result.velocity);
  if (image >= NUM_IMAGES / 2) {
    for (double &spin : result.spin) spin = with_sign(-1, spin);
    for (Pair &pair : result.pairs) {
      for (const RememberedNumber<2> &number : PAIR_MEMORY)
        if (number.is_mirrored) number.of(pair) = with_sign(-1, number.of(pair));
    }
  }
  return result;
}

}    // namespace rve
