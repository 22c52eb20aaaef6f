// SPDX-License-Identifier: GPL-2.0-only
// Rigid rotation of a stored RVE.

#pragma once

#include "rve/algorithm/system_view.h"

namespace rve {
inline namespace RVE_ISA {

  /// Rotates the stored state of an RVE: cell, deformation and velocities, in space also spins and
  /// contact histories. Fractional coordinates and the list are the same in all axes; so are spins
  /// and contact histories in the plane.
  template <class Block, class Scene>
  RVE_INLINE void turn_rigidly(Block &block, const ImageView<Scene> &image,
                               const Tensor<double, Scene::D> &rotation)
  {
    const int n = image.header->num_grains, num_extra = image.header->num_extra;
    block.for_each(n, [&](typename Block::Item i) {
      const auto turned = rotation * image.velocity[i].template as<double>();
      image.velocity[i] = turned.template as<typename Scene::Real>();
      if constexpr (Scene::D == 3) {
        using Law = typename Scene::Law;
        const auto spin = rotation * image.spin[i].template as<double>();
        image.spin[i] = spin.template as<typename Scene::Real>();
        for (int k = 0; k < Scene::owned_pairs; ++k)
          image.history[k * n + i] = Law::turned(image.history[k * n + i], rotation);
        for (int m = i; m < num_extra; m += n)
          image.extra_history[m] = Law::turned(image.extra_history[m], rotation);
      }
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
