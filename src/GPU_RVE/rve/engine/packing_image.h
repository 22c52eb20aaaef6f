// SPDX-License-Identifier: GPL-2.0-only
// Images of a packing: the same grains seen in a mirror or turned by right angles. They are as good a sample of the material as the
// packing itself, and their bias points elsewhere.

#pragma once

#include "rve/engine/state.h"

namespace rve {

/// The symmetries of a square and of a cube. Image k of disks is Q = R^(k mod 4) M^(k / 4), with R the counter-clockwise turn by 90
/// degrees and M the mirror that reverses x: 0 is the packing itself, 2 its turn by 180 degrees, 4 its mirror image, 6 the one that
/// reverses y.
///
/// Image k of spheres is C^(k / 16) Z^(k / 8 mod 2) Q, with Q image k mod 8 of disks in the plane of x and y, Z the mirror that
/// reverses z, and C the turn by 120 degrees that puts x in the place of y, y in that of z, and z in that of x. So images 0 to 15
/// keep the direction of z, along which the stress of a packing may be another one.
template <int D> constexpr int NUM_IMAGES_OF = D == 2 ? 8 : 48;
constexpr int NUM_IMAGES = NUM_IMAGES_OF<2>;

/// Q of image `image` [-], orthogonal, components -1, 0 and 1. Throws InputError unless 0 <= image < NUM_IMAGES_OF<D>.
template <int D = 2> Tensor<double, D> image_rotation(int image);

/// Q sigma Q^T, exactly. Throws InputError as image_rotation().
template <int D> Tensor<double, D> image_of(const Tensor<double, D> &stress, int image);

/// The state with all positions x replaced by Q x, exactly: H and F become Q H Q^T and Q F Q^T, fractional coordinates Q s,
/// peculiar velocities Q c, forces that pairs of spheres remember Q f. What has a sense of rotation, spins and tangential forces of disks, changes its sign
/// with a mirror; so do twisting moments, and spins of spheres become det(Q) Q w.
/// So a cell that stands upright stays so, and responds to Q L Q^T with Q sigma Q^T. Throws InputError as image_rotation().
template <int D> RveStateOf<D> image_of(const RveStateOf<D> &state, int image);

}    // namespace rve
