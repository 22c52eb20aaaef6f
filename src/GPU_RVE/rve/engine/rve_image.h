// The memory image of an RVE (algorithm/image.h), made from a state and read back.

#ifndef RVE_ENGINE_RVE_IMAGE_H
#define RVE_ENGINE_RVE_IMAGE_H

#include "rve/algorithm/image.h"
#include "rve/engine/options.h"
#include "rve/engine/programs.h"
#include "rve/engine/state.h"

#include <cstddef>
#include <vector>

namespace rve {

/// Memory image of a state (algorithm/image.h) in the number format of the engine.
struct StateImage {
  int num_grains = 0;
  int extra_capacity = 0;
  std::vector<char> bytes;
};

// `memory` is the program whose memory of an RVE it is (engine/program_choice.h), the same for all images of an engine.

/// Builds the image; its extra list holds at least `extra_capacity` pairs and all that the state brings. Rolling forces of the state
/// are in it if the program has them.
StateImage build_image(Format format, const RveState &state, int extra_capacity, Program memory);
/// The state that an image holds, exact.
RveState read_image(Format format, const StateImage &image, Program memory);
/// Turns the RVE of an image rigidly.
void turn_image(Format format, StateImage &image, const Tensor2 &rotation, Program memory);
std::size_t image_bytes(Format format, int num_grains, int extra_capacity, Program memory);
/// Extra pairs that an RVE gets room for at first; the list grows when it needs more.
int initial_extra_capacity(int num_grains);

/// Gives an image another material, and what follows from it.
void set_material_in(ImageHeader<2> &header, const Material &material);

}    // namespace rve

#endif
