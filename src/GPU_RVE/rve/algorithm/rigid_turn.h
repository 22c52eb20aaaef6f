// Turns a whole RVE rigidly, as it lies in memory between calls.

#ifndef RVE_ALGORITHM_RIGID_TURN_H
#define RVE_ALGORITHM_RIGID_TURN_H

#include "rve/algorithm/system_view.h"

namespace rve {
inline namespace RVE_ISA {

  /// Cell, deformation and velocities follow; fractional coordinates and the list are the same in all axes, and in the
  /// plane spins and contact histories.
  template <class Block, class Scene>
  RVE_INLINE void turn_rigidly(Block &block, const ImageView<Scene> &image,
                               const Tensor<double, Scene::D> &rotation)
  {
    static_assert(Scene::D == 2, "in space spins and contact histories turn too");
    block.for_each(image.header->num_grains, [&](typename Block::Item i) {
      const auto turned = rotation * image.velocity[i].template as<double>();
      image.velocity[i] = turned.template as<typename Scene::Real>();
    });
    block.once([&] {
      ImageHeader<Scene::D> &header = *image.header;
      double *const of_columns[] = {header.cell, header.deformation, header.list_cell};
      for (double *tensor : of_columns)
        store_tensor(rotation * load_tensor<Scene::D>(tensor), tensor);
      double *const gradient = header.servo_velocity_gradient;
      store_tensor(rotation * load_tensor<Scene::D>(gradient) * transpose(rotation), gradient);
    });
  }

}    // namespace RVE_ISA
}    // namespace rve

#endif
