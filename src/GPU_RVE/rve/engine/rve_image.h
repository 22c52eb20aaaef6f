// The memory image of an RVE (algorithm/image.h), made from a state and read back.

#ifndef RVE_ENGINE_RVE_IMAGE_H
#define RVE_ENGINE_RVE_IMAGE_H

#include "rve/algorithm/image.h"
#include "rve/engine/options.h"
#include "rve/engine/state.h"

#include <cstddef>
#include <vector>

namespace rve {

/// Memory image of a state (algorithm/image.h) in the number format of the engine.
struct StateImage {
  int num_grains = 0;
  int extra_capacity = 0;
  bool rolling = false;    ///< laid out for Program::Rolling: pairs have rolling forces
  std::vector<char> bytes;
};

/// Builds the image; its extra list holds at least `extra_capacity` pairs and all that the state brings. Rolling forces of the state
/// are in it if it is `rolling`.
StateImage build_image(Format format, const RveState &state, int extra_capacity,
                       bool rolling = false);
/// The state that an image holds, exact.
RveState read_image(Format format, const StateImage &image);
/// Turns the RVE of an image rigidly.
void turn_image(Format format, StateImage &image, const Tensor2 &rotation);
std::size_t image_bytes(Format format, int num_grains, int extra_capacity, bool rolling = false);
/// Extra pairs that an RVE gets room for at first; the list grows when it needs more.
int initial_extra_capacity(int num_grains);

/// Gives an image another material, and what follows from it.
void set_material_in(ImageHeader &header, const Material &material);

}    // namespace rve

#endif
