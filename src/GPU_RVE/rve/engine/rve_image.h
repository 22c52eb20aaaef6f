// SPDX-License-Identifier: GPL-2.0-only
// The memory image of an RVE (algorithm/image.h), made from a state and read back.

#pragma once

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
template <int D>
StateImage build_image(Format format, const RveStateOf<D> &state, int extra_capacity,
                       Program memory);
/// The state that an image holds, exact.
template <int D = 2>
RveStateOf<D> read_image(Format format, const StateImage &image, Program memory);
/// Turns the RVE of an image rigidly.
template <int D>
void turn_image(Format format, StateImage &image, const Tensor<double, D> &rotation,
                Program memory);
template <int D>
std::size_t image_bytes(Format format, int num_grains, int extra_capacity, Program memory);
/// Extra pairs that an RVE gets room for at first; the list grows when it needs more.
template <int D> int initial_extra_capacity(int num_grains);

/// Gives an image another material, and what follows from it.
template <int D> void set_material_in(ImageHeader<D> &header, const Material &material);

}    // namespace rve
