// SPDX-License-Identifier: GPL-2.0-only
// Pointers into the memory of one RVE: its stored state, and the workspace of the block that
// advances it. Views do not own memory and are passed by value.

#pragma once

#include "rve/algorithm/device_state.h"
#include "rve/algorithm/kernel_traits.h"
#include "rve/core/fixed_point.h"

#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace rve {
inline namespace RVE_ISA {

  /// Assigns aligned arrays in one block of memory.
  class Carver {
   public:
    RVE_INLINE explicit Carver(char *memory) : base(memory), used(0) {}

    template <class T> RVE_INLINE void take(T *&array, std::size_t count)
    {
      used = (used + 15) / 16 * 16;
      array = reinterpret_cast<T *>(base + used);
      used += count * sizeof(T);
    }

   private:
    char *base;
    std::size_t used;
  };

  /// Assigns arrays on the chip while they fit, and all other arrays in memory. The most frequently
  /// used arrays must therefore be taken first.
  class ChipFirst {
   public:
    RVE_INLINE ChipFirst(char *chip, std::size_t chip_size, char *memory) :
        on_chip(chip), in_memory(memory), left(chip_size)
    {
    }

    template <class T> RVE_INLINE void take(T *&array, std::size_t count)
    {
      const std::size_t size = (count * sizeof(T) + 15) / 16 * 16;
      if (size > left) {
        in_memory.take(array, count);
      } else {
        left -= size;
        on_chip.take(array, count);
      }
    }

   private:
    Carver on_chip, in_memory;
    std::size_t left;
  };

  /// Computes the size of the arrays of a Carver.
  class Measure {
   public:
    template <class T> RVE_INLINE void take(T *&array, std::size_t count)
    {
      used = (used + 15) / 16 * 16 + count * sizeof(T);
      array = nullptr;
    }

    RVE_INLINE std::size_t size() const { return (used + 15) / 16 * 16; }

   private:
    std::size_t used = 0;
  };

  /// Takes arrays of `count` elements each, in this order.
  template <class Carving, class... T>
  RVE_INLINE void take_each(Carving &carver, std::size_t count, T *&...array)
  {
    (carver.take(array, count), ...);
  }

  /// Pairs of an RVE as arrays. The pair that a grain owns in a slot has the index slot * N +
  /// grain. Extra pairs are in arrays of their own.
  template <class Config> struct PairView {
    std::int32_t *partner;    ///< in a free slot the index of the grain itself
    typename Config::History *history;
    std::int32_t *extra_first, *extra_second;
    typename Config::History *extra_history;
  };

  /// Stored header and grains of an RVE. Arrays have N grains.
  template <class Config> struct StoredGrainsView {
    StateHeader<Config::D> *header;
    Vec<typename Config::Coordinate, Config::D> *position;
    /// Leading bits of the positions when the list was built.
    Vec<std::uint32_t, Config::D> *list_position;
    Vec<typename Config::Real, Config::D> *velocity;
    Spin<typename Config::Real, Config::D> *spin;
    typename Config::Wide *radius;
    std::int32_t *number;    ///< number of the grain in the RveState
  };

  /// Stored state of an RVE.
  template <class Config> struct DeviceStateView : StoredGrainsView<Config>, PairView<Config> {
  };

  template <class Config, class Carving>
  RVE_INLINE DeviceStateView<Config> lay_out_image(Carving &carver, int num_grains,
                                                   int extra_capacity)
  {
    DeviceStateView<Config> view;
    carver.take(view.header, 1);
    take_each(carver, num_grains, view.position, view.list_position, view.velocity, view.spin,
              view.radius, view.number);
    take_each(carver, Config::owned_pairs * num_grains, view.partner, view.history);
    take_each(carver, extra_capacity, view.extra_first, view.extra_second, view.extra_history);
    return view;
  }

  template <class Config>
  RVE_INLINE DeviceStateView<Config> carve_device_state(char *memory, int num_grains,
                                                        int extra_capacity)
  {
    Carver carver(memory);
    return lay_out_image<Config>(carver, num_grains, extra_capacity);
  }

  template <class Config>
  RVE_INLINE std::size_t device_state_size(int num_grains, int extra_capacity)
  {
    Measure measure;
    lay_out_image<Config>(measure, num_grains, extra_capacity);
    return measure.size();
  }

  /// Alignment of records: 16 bytes are read at a time; packs of numbers need more.
  template <class Number>
  constexpr std::size_t kRecordAlignment = alignof(Number) > 16 ? alignof(Number) : 16;

  /// Alignment of Motion in the plane. It is the alignment of the coordinates if kRecordAlignment
  /// would leave a gap after each record. With a gap the positions of `mixed` would occupy half of
  /// the banks of a GPU's shared memory.
  template <class Numbers>
  constexpr std::size_t kMotionAlignment =
      (sizeof(typename Numbers::Coordinate) + sizeof(typename Numbers::Real)) % 8 == 0
      ? kRecordAlignment<typename Numbers::Coordinate>
      : alignof(typename Numbers::Coordinate);

  /// Position of a grain, and velocity relative to the mean field. In the plane, partners read this
  /// struct; in space, they read SpherePieces or its parts.
  template <class Numbers, int D>
  struct alignas(D == 2 ? kMotionAlignment<Numbers>
                        : alignof(typename Numbers::Coordinate)) Motion {
    Vec<typename Numbers::Coordinate, D> position;    ///< fractions of the cell
    Vec<typename Numbers::Real, D> velocity;          ///< peculiar [internal length/time]
  };
  template <class Config> using MotionOf = Motion<typename Config::Numbers, Config::D>;

  /// Padding of sixteen bytes, or none.
  template <bool Some> struct Spare {
  };
  template <> struct Spare<true> {
    std::uint32_t unused[4];
  };

  /// Used bytes of a SphereRecord.
  template <class Numbers>
  constexpr std::size_t kUsedOfSphere = 3 * sizeof(typename Numbers::Coordinate) +
      sizeof(typename Numbers::Wide) + 8 * sizeof(typename Numbers::Real);

  /// Data of a sphere that its partners read, and its response to forces. The data are read and
  /// written in pieces of 16 bytes. Position and radius come first, since they show whether two
  /// spheres touch.
  template <class Numbers> struct alignas(16) SpherePieces {
    Vec<typename Numbers::Coordinate, 3> position;      ///< as in Motion
    typename Numbers::Wide radius;                      ///< [internal length]
    Vec<typename Numbers::Real, 3> velocity;            ///< as in Motion
    Vec<typename Numbers::Real, 3> spin;                ///< [1/time]
    typename Numbers::Real velocity_unit, spin_unit;    ///< as in GrainResponse

    RVE_INLINE operator Motion<Numbers, 3>() const { return {position, velocity}; }
    RVE_INLINE void operator=(const Motion<Numbers, 3> &motion)
    {
      position = motion.position;
      velocity = motion.velocity;
    }
  };

  /// Record of a sphere with an odd number of pieces: consecutive spheres then use all banks of a
  /// GPU's shared memory.
  template <class Numbers>
  struct alignas(16) SphereRecord :
      SpherePieces<Numbers>,
      Spare<kUsedOfSphere<Numbers> / 16 % 2 == 0> {
    using SpherePieces<Numbers>::operator=;
  };

  /// Pieces of a sphere with InMemory, in two arrays: the data that show whether two spheres touch,
  /// and the other data.
  template <class Numbers> struct alignas(16) SpherePlace {
    Vec<typename Numbers::Coordinate, 3> position;
    typename Numbers::Wide radius;
  };
  template <class Numbers> struct alignas(16) SphereCourse {
    Vec<typename Numbers::Real, 3> velocity;
    Spin<typename Numbers::Real, 3> spin;
    typename Numbers::Real velocity_unit, spin_unit;
  };
  /// References to the data of one sphere.
  template <class Numbers> struct SphereInParts {
    Vec<typename Numbers::Coordinate, 3> &position;
    Vec<typename Numbers::Real, 3> &velocity;
    typename Numbers::Real &velocity_unit, &spin_unit;

    RVE_INLINE operator Motion<Numbers, 3>() const { return {position, velocity}; }
    RVE_INLINE void operator=(const Motion<Numbers, 3> &motion) const
    {
      position = motion.position;
      velocity = motion.velocity;
    }
  };
  template <class Numbers> struct SpheresInParts {
    SpherePlace<Numbers> *place;
    SphereCourse<Numbers> *course;

    RVE_INLINE SphereInParts<Numbers> operator[](int i) const
    {
      return {place[i].position, course[i].velocity, course[i].velocity_unit, course[i].spin_unit};
    }
  };

  /// One member of all records of an array, indexed like an array.
  template <class T, std::size_t Stride> class MemberArray {
    char *first;

   public:
    MemberArray() = default;
    RVE_INLINE explicit MemberArray(T &of_first) : first(reinterpret_cast<char *>(&of_first)) {}
    RVE_INLINE T &operator[](int i) const { return *reinterpret_cast<T *>(first + i * Stride); }
  };

  /// Distance in bytes between the published data of consecutive grains in space. In the plane each
  /// member has its own array.
  template <class Config, class T>
  constexpr std::size_t kSeenStride = !Config::in_memory
      ? sizeof(SphereRecord<typename Config::Numbers>)
      : (std::is_same_v<T, Spin<typename Config::Real, 3>>
             ? sizeof(SphereCourse<typename Config::Numbers>)
             : sizeof(SpherePlace<typename Config::Numbers>));
  template <class Config, class T>
  using SeenArray = std::conditional_t<Config::D == 2, T *, MemberArray<T, kSeenStride<Config, T>>>;
  template <class Config>
  using SeenMotion =
      std::conditional_t<Config::D == 2, MotionOf<Config>, SphereRecord<typename Config::Numbers>>;
  /// Motion of all grains, and for spheres the other data of their records.
  template <class Config>
  using SeenMotions =
      std::conditional_t<Config::in_memory, SpheresInParts<typename Config::Numbers>,
                         SeenMotion<Config> *>;

  /// Returns whether no component of velocity and spin is NaN.
  template <int D, class Real>
  RVE_INLINE bool moves_soundly(const Vec<Real, D> &velocity, const Spin<Real, D> &spin)
  {
    bool sound = true;
    for (int a = 0; a < D; ++a) sound = sound && velocity[a] == velocity[a];
    for (int k = 0; k < Space<D>::spins; ++k)
      sound = sound && spin_component(spin, k) == spin_component(spin, k);
    return sound;
  }

  /// Response of a grain to forces, and its position when the list was built. Only the thread of
  /// the grain reads these data, once per step, so that they are not kept in registers.
  template <class Numbers, int D>
  struct alignas(D == 2 ? kRecordAlignment<typename Numbers::Real>
                        : alignof(typename Numbers::Real)) GrainResponse {
    typename Numbers::Real velocity_unit;    ///< dt/m: velocity that one force unit gives in a step
    typename Numbers::Real spin_unit;        ///< dt/I: spin that one torque unit gives in a step
    /// Leading bits of the position when the list was built.
    Vec<typename Numbers::Leading::Coordinate, D> list_position;
  };
  template <class Config>
  using GrainResponseOf = GrainResponse<typename Config::Numbers, Config::D>;

  /// Additional data with InMemory.
  template <bool InMemory> struct PairWords {
  };
  template <> struct PairWords<true> {
    std::int32_t *partner_word;    ///< (Config::owned_pairs, N) as in PassingPairs
  };

  /// Data of the steps, on chip on a GPU.
  template <class Config> struct SharedView : PairWords<Config::in_memory> {
    SeenMotions<Config> motion;
    SeenArray<Config, Spin<typename Config::Real, Config::D>> spin;
    SeenArray<Config, typename Config::Wide> radius;    ///< [internal length]
    /// Components of force and torque from partners that own the pair.
    typename Config::Sum *force[Config::freedoms];
    Vec<typename Config::Sum, Config::freedoms> *own;    ///< force and torque from owned pairs
    typename Config::Real
        *largest_force;    ///< largest force that counts, over the owned contacts in this call
    /// In the plane only. In space the records of spheres contain these numbers, except for
    /// `list_position`.
    GrainResponseOf<Config> *response;
    /// In space only.
    Vec<typename Config::Leading::Coordinate, Config::D> *list_position;
    std::int32_t *partner;    ///< (Config::owned_pairs, N) as in PairView
    /// (Config::owned_pairs, N) A free slot has a negative radius (radius_of_partner()), so that it
    /// has no contact. The array is unused if the radii of partners are in registers.
    typename Config::Wide *partner_radius;
    typename Config::History *history;    ///< (Config::owned_pairs, N)
    /// With streams_history or InMemory: (numbers of a History, Config::owned_pairs, capacity)
    /// history during steps.
    typename Config::Spring *passing;
    int capacity;    ///< in grains
  };

  /// Returns the position of grain i when the list was built.
  template <class Config>
  RVE_INLINE Vec<typename Config::Leading::Coordinate, Config::D> &
  list_position_of(const SharedView<Config> &shared, int i)
  {
    if constexpr (Config::D == 2)
      return shared.response[i].list_position;
    else
      return shared.list_position[i];
  }

  template <class Config>
  RVE_INLINE GrainResponseOf<Config> response_of(const SharedView<Config> &shared, int i)
  {
    if constexpr (Config::D == 2)
      return shared.response[i];
    else
      return {shared.motion[i].velocity_unit, shared.motion[i].spin_unit, shared.list_position[i]};
  }

  template <class Config>
  RVE_INLINE void set_response(const SharedView<Config> &shared, int i,
                               const GrainResponseOf<Config> &response)
  {
    if constexpr (Config::D == 2) {
      shared.response[i] = response;
    } else {
      shared.motion[i].velocity_unit = response.velocity_unit;
      shared.motion[i].spin_unit = response.spin_unit;
      shared.list_position[i] = response.list_position;
    }
  }

  /// Radius with which a grain has no contacts: radii are below 1/2, and laws reach at most one
  /// [internal length].
  template <class Config>
  constexpr typename Config::Wide kRadiusWithoutContact = typename Config::Wide(-1024);

  /// Returns the radius for the slot of grain i that holds partner j.
  template <class Config>
  RVE_INLINE typename Config::Wide radius_of_partner(const SharedView<Config> &shared, int i, int j)
  {
    const auto no_contact =
        Config::Law::has_reach ? kRadiusWithoutContact<Config> : -shared.radius[i];
    return j == i ? no_contact : shared.radius[j];
  }

  /// Assigns the arrays of a SharedView. The arrays that profit most from memory on chip come
  /// first: sums that many threads add to, then data that partners read at scattered addresses,
  /// then data that consecutive threads read at consecutive addresses. If `capacity` (in grains) is
  /// a compile-time constant, the addresses on chip are constants too.
  ///
  /// With in_registers the radii of partners need no array. In space there is then a hidden grain
  /// without contacts (PackedPartners), and `beside` assigns the arrays that steps do not access,
  /// and streamed histories.
  template <class Config, class OnChip, class Beside>
  RVE_INLINE SharedView<Config> lay_out_shared(OnChip &chip, Beside &beside, int capacity,
                                               int num_grains, bool in_registers)
  {
    const int seen = capacity + (in_registers && Config::D == 3 ? 1 : 0);
    SharedView<Config> view;
    for (int k = 0; k < Config::freedoms; ++k) chip.take(view.force[k], capacity);
    if constexpr (Config::in_memory) {
      take_each(chip, seen, view.motion.place, view.motion.course);
    } else {
      chip.take(view.motion, seen);
    }
    if constexpr (Config::D == 2) {
      chip.take(view.spin, seen);
      chip.take(view.response, capacity);
      chip.take(view.radius, seen);
      view.list_position = nullptr;
    } else {
      view.response = nullptr;
      chip.take(view.list_position, capacity);
      using SpinArray = SeenArray<Config, Spin<typename Config::Real, Config::D>>;
      using RadiusArray = SeenArray<Config, typename Config::Wide>;
      // A Measure assigns no memory, so that records have no address.
      constexpr bool there = !std::is_same_v<OnChip, Measure>;
      if constexpr (there && Config::in_memory) {
        view.spin = SpinArray(view.motion.course->spin);
        view.radius = RadiusArray(view.motion.place->radius);
      } else if constexpr (there) {
        view.spin = SpinArray(view.motion->spin);
        view.radius = RadiusArray(view.motion->radius);
      }
    }
    view.own = nullptr;
    if (!Config::in_memory) beside.take(view.own, num_grains);
    beside.take(view.largest_force, num_grains);
    beside.take(view.partner, Config::owned_pairs * num_grains);
    if constexpr (Config::in_memory)
      beside.take(view.partner_word, Config::owned_pairs * num_grains);
    view.passing = nullptr;
    if (Config::in_memory || (kHasLongHistory<Config> && in_registers))
      beside.take(view.passing,
                  sizeof(typename Config::History) / sizeof(typename Config::Spring) *
                      Config::owned_pairs * capacity);
    beside.take(view.history, Config::owned_pairs * num_grains);
    view.partner_radius = nullptr;
    if (!in_registers && !Config::in_memory)
      beside.take(view.partner_radius, Config::owned_pairs * num_grains);
    view.capacity = capacity;
    return view;
  }

  template <class Config>
  RVE_INLINE SharedView<Config> carve_shared(char *memory, int num_grains, bool in_registers)
  {
    Carver carver(memory);
    return lay_out_shared<Config>(carver, carver, num_grains, num_grains, in_registers);
  }

  /// Assigns the arrays of a block with registers for `capacity` grains.
  template <class Config>
  RVE_INLINE SharedView<Config> carve_shared_beside(char *chip, int capacity, char *memory,
                                                    int num_grains)
  {
    Carver on_chip(chip), beside(memory);
    return lay_out_shared<Config>(on_chip, beside, capacity, num_grains, true);
  }

  template <class Config>
  RVE_INLINE SharedView<Config> carve_shared(char *chip, std::size_t chip_size, char *memory,
                                             int num_grains)
  {
    ChipFirst carver(chip, chip_size, memory);
    return lay_out_shared<Config>(carver, carver, num_grains, num_grains, false);
  }

  template <class Config> RVE_INLINE std::size_t shared_size(int num_grains, bool in_registers)
  {
    Measure measure;
    lay_out_shared<Config>(measure, measure, num_grains, num_grains, in_registers);
    return measure.size();
  }

  /// Returns the view of a block, for rarely executed code. If the addresses of arrays on chip are
  /// known at compile time, the view has these constants.
  template <class Block, class Config>
  RVE_INLINE SharedView<Config> at_known_addresses(const SharedView<Config> &shared)
  {
    if constexpr (Block::kCapacity == 0) {
      return shared;
    } else if constexpr (Config::D == 2) {
      return carve_shared<Config>(Block::chip(), Block::kCapacity, true);
    } else {
      SharedView<Config> view =
          carve_shared_beside<Config>(Block::chip(), Block::kCapacity, nullptr, 0);
      view.own = shared.own;
      view.largest_force = shared.largest_force;
      view.partner = shared.partner;
      view.passing = shared.passing;
      view.history = shared.history;
      return view;
    }
  }

  /// Bytes of carve_shared_beside() on chip and in other memory.
  struct DividedSize {
    std::size_t on_chip, beside;
  };
  template <class Config> RVE_INLINE DividedSize divided_size(int capacity, int num_grains)
  {
    Measure on_chip, beside;
    lay_out_shared<Config>(on_chip, beside, capacity, num_grains, true);
    return {on_chip.size(), beside.size()};
  }

  /// Numbers of pairs that a grain owns: the number of pairs in its row (PairRow), and the number
  /// of pairs received from other grains. Both are packed into one integer.
  struct PairCount {
    std::int32_t packed;
    static constexpr int kReceivedBits = 4;

    static RVE_INLINE PairCount of_row(int count) { return {count << kReceivedBits}; }
    RVE_INLINE int in_row() const { return packed >> kReceivedBits; }
    RVE_INLINE int received() const { return packed & ((1 << kReceivedBits) - 1); }
    RVE_INLINE int owned() const { return in_row() + received(); }
    RVE_INLINE PairCount with_one_more_received() const { return {packed + 1}; }
    RVE_INLINE PairCount with_one_less_in_row() const { return {packed - (1 << kReceivedBits)}; }
  };

  /// Number of double arrays over grains in a workspace. During steps the first arrays hold the
  /// force rows of packs of grains (packed_grains.h).
  template <int D> constexpr int kScratch = D == 2 ? 8 : 14;

  /// Memory to build a list in, and for rare code. It belongs to a block, not to an RVE.
  template <class Config> struct WorkspaceView {
    int pair_capacity;           ///< capacity of row_partner, in pairs
    int cell_capacity;           ///< capacity of the search grid
    std::int32_t *cell_start;    ///< (cell_capacity + 1)
    std::int32_t *cell_of;       ///< (N)
    std::int32_t *cell_grain;    ///< (N)
    // The arrays are ordered by index in the grid until the owners of pairs are known (build_list).
    PairCount *count;                ///< (N) pairs owned now
    std::int32_t *row_start;         ///< (N) first pair of a grain, if rows are long
    std::int32_t *row_partner;       ///< (pair_capacity) partners of these pairs
    std::int32_t *load;              ///< (N) number by which grains are ordered
    std::int32_t *proposal;          ///< (N) index of the offered pair in the own row, or -1
    std::int32_t *accepted;          ///< (N) accepted grain plus an offset per round
    std::int32_t *overloaded;        ///< (N) grains with too many pairs
    std::int32_t *num_overloaded;    ///< (2) length of `overloaded`, even and odd rounds
    std::int32_t *received;          ///< (Config::owned_pairs, N) grains that gave a pair
    std::int32_t *excess_start;      ///< (N)
    std::int32_t *contact_count;     ///< (N)
    std::int32_t *number;            ///< (N) as in the stored state, for an RVE with a new list
    /// (N) Energy lost in this call, indexed by the number of the grain: by local damping of the
    /// grain [force length], by friction of its pairs and by dashpots of its pairs [internal].
    double *damping, *friction, *viscous;
    double *scratch;           ///< (kScratch<D>, N) terms of sums and maxima over grains
    PairView<Config> fresh;    ///< the list that is being built
    std::int32_t *extra_first, *extra_second;    ///< (pair_capacity) extra pairs of this call
    typename Config::History *extra_history;
  };

  /// Returns the largest number of cells of a search grid for `num_grains` grains.
  RVE_INLINE constexpr int cell_capacity(int num_grains)
  {
    return num_grains + 64;
  }

  template <class Config, class Carving>
  RVE_INLINE WorkspaceView<Config> lay_out_workspace(Carving &carver, int num_grains,
                                                     int pair_capacity)
  {
    WorkspaceView<Config> view;
    view.pair_capacity = pair_capacity;
    view.cell_capacity = cell_capacity(num_grains);
    const std::size_t owned_pairs = Config::owned_pairs * num_grains;
    carver.take(view.cell_start, view.cell_capacity + 1);
    take_each(carver, num_grains, view.cell_of, view.cell_grain, view.count, view.row_start);
    carver.take(view.row_partner, pair_capacity);
    take_each(carver, num_grains, view.load, view.proposal, view.accepted, view.overloaded);
    carver.take(view.num_overloaded, 2);
    carver.take(view.received, owned_pairs);
    take_each(carver, num_grains, view.excess_start, view.contact_count, view.number, view.damping,
              view.friction, view.viscous);
    carver.take(view.scratch, static_cast<std::size_t>(kScratch<Config::D>) * num_grains);
    PairView<Config> &fresh = view.fresh;
    take_each(carver, owned_pairs, fresh.partner, fresh.history);
    take_each(carver, pair_capacity, fresh.extra_first, fresh.extra_second, fresh.extra_history,
              view.extra_first, view.extra_second, view.extra_history);
    return view;
  }

  template <class Config>
  RVE_INLINE WorkspaceView<Config> carve_workspace(char *memory, int num_grains, int pair_capacity)
  {
    Carver carver(memory);
    return lay_out_workspace<Config>(carver, num_grains, pair_capacity);
  }

  /// Borrowed memory: arrays are moved to it while they fit, and otherwise stay where they are.
  class BorrowedMemory {
   public:
    RVE_INLINE BorrowedMemory(void *first, std::size_t size_in) :
        next(static_cast<char *>(first)), left(size_in)
    {
    }
    template <class T> RVE_INLINE void take(T *&array, std::size_t count)
    {
      const std::size_t size = (count * sizeof(T) + 15) / 16 * 16;
      if (size > left) return;
      array = reinterpret_cast<T *>(next);
      next += size;
      left -= size;
    }

   private:
    char *next;
    std::size_t left;
  };

  /// Moves the arrays of list building to memory on chip, for at most `capacity` grains. They take
  /// the place of data that are not used during list building: the sums of forces, the forces of
  /// disks from their own pairs, and the plans. The sums must be cleared afterwards (clear_sums).
  template <class Config, class Plan>
  RVE_INLINE void build_on_chip(WorkspaceView<Config> &work, const SharedView<Config> &shared,
                                Plan &plan, int capacity)
  {
    BorrowedMemory sums(shared.force[0],
                        Config::freedoms * capacity * sizeof(typename Config::Sum));
    take_each(sums, capacity, work.accepted, work.count, work.overloaded);
    // In space `own` is in memory.
    BorrowedMemory own(shared.own, Config::D == 2 ? capacity * sizeof(*shared.own) : 0);
    BorrowedMemory &memory = Config::D == 2 ? own : sums;
    memory.take(work.num_overloaded, 2);
    memory.take(work.cell_start, cell_capacity(capacity) + 1);
    memory.take(work.cell_grain, capacity);
    BorrowedMemory plans(&plan, sizeof(plan));
    take_each(plans, capacity, work.proposal, work.cell_of);
    work.load = work.accepted;    // used after all pairs have owners
  }

  template <class Block, class Config>
  RVE_INLINE void clear_sums(const SharedView<Config> &shared, int i)
  {
    for (int k = 0; k < Config::freedoms; ++k)
      Block::begin_sum(shared.force[k], shared.capacity, i);
  }

  /// Capacity after a workspace for rarely requested results, in numbers of 8 bytes per grain.
  template <int D> constexpr int kSpare = D == 2 ? 8 : 14;

  template <class Config> RVE_INLINE char *spare_of(const WorkspaceView<Config> &work)
  {
    const auto end = reinterpret_cast<std::uintptr_t>(work.extra_history + work.pair_capacity);
    return reinterpret_cast<char *>((end + 15) / 16 * 16);
  }

  template <class Config> RVE_INLINE std::size_t workspace_size(int num_grains, int pair_capacity)
  {
    Measure measure;
    lay_out_workspace<Config>(measure, num_grains, pair_capacity);
    double *spare;
    measure.take(spare, static_cast<std::size_t>(kSpare<Config::D>) * num_grains + 4);
    return measure.size();
  }

}    // namespace RVE_ISA
}    // namespace rve
