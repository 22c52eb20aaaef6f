// Images of a packing: the same grains seen in a mirror or turned by right angles. They are as good a sample of the material as the
// packing itself, and their bias points elsewhere.

#ifndef RVE_ENGINE_PACKING_IMAGE_H
#define RVE_ENGINE_PACKING_IMAGE_H

#include "rve/engine/state.h"

namespace rve {

/// The symmetries of a square. Image k is Q = R^(k mod 4) M^(k / 4), with R the counter-clockwise turn by 90 degrees and M the mirror
/// that reverses x: 0 is the packing itself, 2 its turn by 180 degrees, 4 its mirror image, 6 the one that reverses y.
constexpr int NUM_IMAGES = 8;

/// Q of image `image` [-], orthogonal, components -1, 0 and 1. Throws InputError unless 0 <= image < NUM_IMAGES.
Tensor2 image_rotation(int image);

/// Q sigma Q^T, exactly. Throws InputError as image_rotation().
Tensor2 image_of(const Tensor2 &stress, int image);

/// The state with all positions x replaced by Q x, exactly: H and F become Q H Q^T and Q F Q^T, fractional coordinates Q s,
/// peculiar velocities Q c; spins and tangential forces, which have a sense of rotation, change their sign with a mirror.
/// So a cell that stands upright stays so, and responds to Q L Q^T with Q sigma Q^T. Throws InputError as image_rotation().
RveState image_of(const RveState &state, int image);

}    // namespace rve

#endif
