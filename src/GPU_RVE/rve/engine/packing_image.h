// SPDX-License-Identifier: GPL-2.0-only
// Images of a packing: mirrored and rotated versions of it that map the coordinate axes to each
// other. An image is an equivalent sample of the material whose anisotropy has other directions.

#pragma once

#include "rve/engine/state.h"

namespace rve {

/// Number of images: the number of symmetries of a square for disks and of a cube for spheres.
/// Image k of disks is Q = R^(k mod 4) M^(k / 4), with the counter-clockwise rotation R by 90
/// degrees and the mirror M that reverses x. Image 0 is the packing itself, image 2 its rotation by
/// 180 degrees, image 4 its mirror image with x reversed, image 6 its mirror image with y reversed.
///
/// Image k of spheres is C^(k / 16) Z^(k / 8 mod 2) Q. Q is image k mod 8 of disks in the plane of
/// x and y. Z is the mirror that reverses z. C is the rotation by 120 degrees that maps x to y, y
/// to z, and z to x. Images 0 to 15 keep the z axis, along which the stress of a packing can differ
/// from the stress along x and y.
template <int D> constexpr int NUM_IMAGES_OF = D == 2 ? 8 : 48;
constexpr int NUM_IMAGES = NUM_IMAGES_OF<2>;

/// Returns the orthogonal tensor Q of an image [-]. Its components are -1, 0 and 1. Throws
/// InputError unless 0 <= image < NUM_IMAGES_OF<D>.
template <int D = 2> Tensor<double, D> image_rotation(int image);

/// Returns Q sigma Q^T, exactly. Throws InputError as image_rotation().
template <int D> Tensor<double, D> image_of(const Tensor<double, D> &stress, int image);

/// Returns the state with all positions x replaced by Q x, exactly: H and F become Q H Q^T and Q F
/// Q^T, fractional coordinates Q s, peculiar velocities Q c, stored forces of pairs of spheres Q f.
/// Quantities with a sense of rotation (spins and tangential forces of disks, twisting moments)
/// change their sign with a mirror; spins of spheres become det(Q) Q w. A cell with edges along the
/// axes keeps them along the axes. If the packing responds to the velocity gradient L with the
/// stress sigma, its image responds to Q L Q^T with Q sigma Q^T. Throws InputError as
/// image_rotation().
template <int D> RveStateOf<D> image_of(const RveStateOf<D> &state, int image);

}    // namespace rve
