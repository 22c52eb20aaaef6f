// Pointers into the memory of one RVE: its image between calls, and the workspace of the block that advances it.
// Views own nothing and are passed by value.

#ifndef RVE_ALGORITHM_SYSTEM_VIEW_H
#define RVE_ALGORITHM_SYSTEM_VIEW_H

#include "rve/algorithm/image.h"
#include "rve/core/fixed_point.h"

#include <cstddef>
#include <cstdint>

namespace rve {
inline namespace RVE_ISA {

  /// Hands out aligned arrays from one piece of memory; with a null base it only measures.
  class Carver {
   public:
    RVE_INLINE explicit Carver(char *memory) : base(memory), used(0) {}

    template <class T> RVE_INLINE T *take(std::size_t count)
    {
      used = (used + 15) / 16 * 16;
      T *array = base ? reinterpret_cast<T *>(base + used) : nullptr;
      used += count * sizeof(T);
      return array;
    }

    RVE_INLINE std::size_t size() const { return (used + 15) / 16 * 16; }

   private:
    char *base;
    std::size_t used;
  };

  /// Image of an RVE: what lives between calls. Arrays of N grains; owned pairs as [slot * N + grain].
  template <class Format> struct ImageView {
    ImageHeader *header;
    Vec<typename Format::Coordinate, 2> *position;
    Vec<typename Format::Coordinate, 2> *list_position;    ///< positions when the list was built
    Vec<typename Format::Real, 2> *velocity;
    typename Format::Real *spin;
    typename Format::Wide *radius;
    std::int32_t *partner;    ///< own number: slot is free
    typename Format::History *history;
    std::int32_t *extra_first, *extra_second;
    typename Format::History *extra_history;
  };

  template <class Format>
  RVE_INLINE ImageView<Format> carve_image(char *memory, int num_grains, int extra_capacity,
                                           std::size_t *size = nullptr)
  {
    Carver carver(memory);
    ImageView<Format> view;
    view.header = carver.take<ImageHeader>(1);
    view.position = carver.take<Vec<typename Format::Coordinate, 2>>(num_grains);
    view.list_position = carver.take<Vec<typename Format::Coordinate, 2>>(num_grains);
    view.velocity = carver.take<Vec<typename Format::Real, 2>>(num_grains);
    view.spin = carver.take<typename Format::Real>(num_grains);
    view.radius = carver.take<typename Format::Wide>(num_grains);
    view.partner = carver.take<std::int32_t>(kOwnedPairs * num_grains);
    view.history = carver.take<typename Format::History>(kOwnedPairs * num_grains);
    view.extra_first = carver.take<std::int32_t>(extra_capacity);
    view.extra_second = carver.take<std::int32_t>(extra_capacity);
    view.extra_history = carver.take<typename Format::History>(extra_capacity);
    if (size) *size = carver.size();
    return view;
  }

  /// What partners read of a grain while forces are computed, and what they add to it: on chip on the GPU.
  template <class Format> struct SharedView {
    Vec<typename Format::Coordinate, 2> *position;
    Vec<typename Format::Real, 2> *velocity;
    typename Format::Real *spin;
    typename Format::Wide *radius;
    Vec<typename Format::Sum, 2> *force;    ///< from partners that own the pair [force units]
    typename Format::Sum *torque;           ///< [torque units]
  };

  template <class Format>
  RVE_INLINE SharedView<Format> carve_shared(char *memory, int num_grains,
                                             std::size_t *size = nullptr)
  {
    Carver carver(memory);
    SharedView<Format> view;
    view.position = carver.take<Vec<typename Format::Coordinate, 2>>(num_grains);
    view.velocity = carver.take<Vec<typename Format::Real, 2>>(num_grains);
    view.spin = carver.take<typename Format::Real>(num_grains);
    view.radius = carver.take<typename Format::Wide>(num_grains);
    view.force = carver.take<Vec<typename Format::Sum, 2>>(num_grains);
    view.torque = carver.take<typename Format::Sum>(num_grains);
    if (size) *size = carver.size();
    return view;
  }

  /// Arrays of doubles over grains in a workspace.
  constexpr int kScratch = 4;

  /// Room to build a list in, and for what is needed rarely. One per block, not per RVE.
  template <class Format> struct WorkspaceView {
    int pair_capacity;               ///< of the rows
    int cell_capacity;               ///< of the search grid
    std::int32_t *cell_start;        ///< (cell_capacity + 1)
    std::int32_t *cell_fill;         ///< (cell_capacity)
    std::int32_t *cell_of;           ///< (N)
    std::int32_t *cell_grain;        ///< (N)
    std::int32_t *row_start;         ///< (N + 1) pairs by their first owner
    std::int32_t *row_partner;       ///< (pair_capacity)
    std::int32_t *row_given;         ///< (pair_capacity) 1: given away to the partner
    std::int32_t *load;              ///< (N) pairs owned now
    std::int32_t *proposal;          ///< (N) entry of the own row that is offered, or -1
    std::int32_t *accepted;          ///< (N) grain whose offer is taken
    std::int32_t *received;          ///< (kOwnedPairs, N) grains that gave a pair
    std::int32_t *received_count;    ///< (N)
    std::int32_t *excess_start;      ///< (N + 1)
    std::int32_t *old_partner;       ///< (kOwnedPairs, N)
    typename Format::History *old_history;
    std::int32_t *old_extra_first, *old_extra_second;    ///< (pair_capacity)
    typename Format::History *old_extra_history;
    std::int32_t *contact_count;    ///< (N)
    double *damping;                ///< (N) work of local damping in this call [force length]
    double *scratch;                ///< (kScratch, N) terms of sums and maxima over grains
    Vec<typename Format::Coordinate, 2> *list_position;    ///< (N)
    std::int32_t *extra_first, *extra_second;    ///< (pair_capacity) extra pairs of this call
    typename Format::History *extra_history;
  };

  template <class Format>
  RVE_INLINE WorkspaceView<Format> carve_workspace(char *memory, int num_grains, int pair_capacity,
                                                   std::size_t *size = nullptr)
  {
    Carver carver(memory);
    WorkspaceView<Format> view;
    view.pair_capacity = pair_capacity;
    view.cell_capacity = num_grains + 64;
    view.cell_start = carver.take<std::int32_t>(view.cell_capacity + 1);
    view.cell_fill = carver.take<std::int32_t>(view.cell_capacity);
    view.cell_of = carver.take<std::int32_t>(num_grains);
    view.cell_grain = carver.take<std::int32_t>(num_grains);
    view.row_start = carver.take<std::int32_t>(num_grains + 1);
    view.row_partner = carver.take<std::int32_t>(pair_capacity);
    view.row_given = carver.take<std::int32_t>(pair_capacity);
    view.load = carver.take<std::int32_t>(num_grains);
    view.proposal = carver.take<std::int32_t>(num_grains);
    view.accepted = carver.take<std::int32_t>(num_grains);
    view.received = carver.take<std::int32_t>(kOwnedPairs * num_grains);
    view.received_count = carver.take<std::int32_t>(num_grains);
    view.excess_start = carver.take<std::int32_t>(num_grains + 1);
    view.old_partner = carver.take<std::int32_t>(kOwnedPairs * num_grains);
    view.old_history = carver.take<typename Format::History>(kOwnedPairs * num_grains);
    view.old_extra_first = carver.take<std::int32_t>(pair_capacity);
    view.old_extra_second = carver.take<std::int32_t>(pair_capacity);
    view.old_extra_history = carver.take<typename Format::History>(pair_capacity);
    view.contact_count = carver.take<std::int32_t>(num_grains);
    view.damping = carver.take<double>(num_grains);
    view.scratch = carver.take<double>(static_cast<std::size_t>(kScratch) * num_grains);
    view.list_position = carver.take<Vec<typename Format::Coordinate, 2>>(num_grains);
    view.extra_first = carver.take<std::int32_t>(pair_capacity);
    view.extra_second = carver.take<std::int32_t>(pair_capacity);
    view.extra_history = carver.take<typename Format::History>(pair_capacity);
    if (size) *size = carver.size();
    return view;
  }

  /// What is private to a grain while its RVE is advanced: its owned pairs and the force from them. Registers on a GPU.
  template <class Format> struct GrainState {
    Vec<typename Format::Sum, 2> force;     ///< from owned pairs [force units]
    typename Format::Sum torque;            ///< [torque units]
    typename Format::Real velocity_unit;    ///< dt/m: velocity that one force unit gives in a step
    typename Format::Real spin_unit;        ///< dt/I: spin that one torque unit gives in a step
    std::int32_t partner[kOwnedPairs];      ///< own index: slot is free
    typename Format::History history[kOwnedPairs];
    std::int32_t trouble;    ///< bits of the status word
  };

}    // namespace RVE_ISA
}    // namespace rve

#endif
