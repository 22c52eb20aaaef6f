// Turns a whole RVE rigidly, as it lies in memory between calls.

#ifndef RVE_ALGORITHM_RIGID_TURN_H
#define RVE_ALGORITHM_RIGID_TURN_H

#include "rve/algorithm/system_view.h"

namespace rve {
inline namespace RVE_ISA {

  RVE_INLINE Tensor2 tensor_of(const double *component)
  {
    return Tensor2{{component[0], component[1], component[2], component[3]}};
  }

  /// Cell, deformation and velocities follow; fractional coordinates, spins, contact histories and the list are the same in all axes.
  template <class Block, class Scene>
  RVE_INLINE void turn_image(Block &block, const ImageView<Scene> &image, const Tensor2 &rotation)
  {
    block.for_each(image.header->num_grains, [&](typename Block::Item i) {
      const Vec<double, 2> turned = rotation * image.velocity[i].template as<double>();
      image.velocity[i] = turned.template as<typename Scene::Real>();
    });
    block.once([&] {
      ImageHeader &header = *image.header;
      for (double *columns : {header.cell, header.deformation, header.list_cell}) {
        const Tensor2 turned = rotation * tensor_of(columns);
        for (int k = 0; k < 4; ++k) columns[k] = turned.component[k];
      }
      const Tensor2 gradient =
          rotation * tensor_of(header.servo_velocity_gradient) * transpose(rotation);
      for (int k = 0; k < 4; ++k) header.servo_velocity_gradient[k] = gradient.component[k];
    });
  }

}    // namespace RVE_ISA
}    // namespace rve

#endif
