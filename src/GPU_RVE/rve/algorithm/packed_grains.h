// SPDX-License-Identifier: GPL-2.0-only
// PackedGrains gives the phases of a step access to packs of grains on a CPU with AVX2 (BlockSimd),
// and to the single grains that fill no pack. It has the functions of GrainItems
// (algorithm/grain_items.h): loads, stores and sums. The computations are written once, for numbers
// and for packs of numbers.

#pragma once

#include "rve/algorithm/call_state.h"
#include "rve/algorithm/grain_items.h"
#include "rve/core/pack_item.h"
#include "rve/core/pack_rows.h"

namespace rve {
inline namespace RVE_ISA {

  /// Number of grains in a pack of BlockSimd.
  constexpr int kPackedGrains = 8;

  /// The kernel configuration in the number format of an item: a pack of N grains, or one grain.
  template <class Config, class Item> struct ConfigOfItem {
    using type = Config;
  };
  template <class Config, int N> struct ConfigOfItem<Config, PackItem<N>> {
    using type = typename Config::template In<PackNumbers<typename Config::Numbers, N>>;
  };

  /// Histories of N grains in one slot, which are read and written like the history of one grain.
  template <class Config, int N> struct HistoryLanes {
    using Packed = typename ConfigOfItem<Config, PackItem<N>>::type;
    using History = typename Packed::History;

    typename Config::History *history;

    RVE_INLINE operator History() const
    {
      return load_records<History, typename Packed::Spring>(history);
    }
    RVE_INLINE void operator=(const History &x) const
    {
      store_records<typename Packed::Spring>(x, history);
    }
  };

  /// Force and torque on a grain in one row, so that a pair adds to its partner with one or two
  /// vector additions. A row has 3 sums in 4 numbers for disks, and 6 sums in 8 numbers for
  /// spheres.
  template <class Numbers, int D> struct alignas(4 * sizeof(typename Numbers::Sum)) ForceRow {
    typename Numbers::Sum sum[D == 2 ? 4 : 8];
  };

  template <class Block, class Config> class PackedGrains : public GrainItems<Block, Config> {
    static constexpr int D = Config::D;
    using One = GrainItems<Block, Config>;
    using Shared = SharedView<Config>;
    using Sum = typename Config::Sum;
    using Row = ForceRow<typename Config::Numbers, D>;
    using Sums = Vec<Sum, Config::freedoms>;
    template <int N> using Packed = PackNumbers<typename Config::Numbers, N>;
    template <int N> using View = GrainView<Packed<N>, D>;
    template <int N> using PackedSums = Vec<Pack<Sum, N>, Config::freedoms>;
    static_assert(!Config::has_bookkeeping, "energy bookkeeping visits one grain after the other");

    /// Sums of forces that packs add to partners and to their own grains, a row per grain. A move
    /// reads and clears all rows, so that they are zero after a segment of steps, which ends with a
    /// move.
    Row *rows;

   public:
    template <class Item> using ConfigOf = typename ConfigOfItem<Config, Item>::type;

    RVE_INLINE PackedGrains(Block &block, const Shared &shared, const WorkspaceView<Config> &work,
                            int n) :
        One(block, shared, work, n)
    {
      static_assert(sizeof(Row) < kScratch<D> * sizeof(double),
                    "a row per grain, and one to align the first one");
      const auto begin = reinterpret_cast<std::uintptr_t>(work.scratch);
      rows = reinterpret_cast<Row *>((begin + sizeof(Row) - 1) / sizeof(Row) * sizeof(Row));
    }

    // ---- single grains that fill no pack --------------------------------------------------------

    using One::add_to_partner;
    using One::clear_history;
    using One::for_each_grain;
    using One::for_parts;
    using One::for_slots;
    using One::history_of;
    using One::is_taken;
    using One::keep_forces;
    using One::largest_of;
    using One::load_with_forces;
    using One::publish_motion;
    using One::publish_spin;
    using One::response;
    using One::save;
    using One::save_with_forces;
    using One::view;
    using One::view_partner;

    RVE_INLINE void load(const Shared &shared, int i)
    {
      One::load(shared, i);
      rows[i] = Row();
    }

    /// Moves the forces on grain i from its row to the array of single grains, after a force
    /// evaluation that no move follows.
    RVE_INLINE void store_forces(int i, bool in_pack)
    {
      Sums sums;
      for (int k = 0; k < Config::freedoms; ++k) sums[k] = rows[i].sum[k];
      if (!in_pack)
        for (int k = 0; k < Config::freedoms; ++k) sums[k] = wrapping_sum(sums[k], this->own[i][k]);
      this->own.keep(i, sums);
    }

    RVE_INLINE Sums collect(Block &block, const Shared &shared, int i)
    {
      Sums sums = One::collect(block, shared, i);
      for (int k = 0; k < Config::freedoms; ++k) sums[k] = wrapping_sum(sums[k], rows[i].sum[k]);
      rows[i] = Row();
      return sums;
    }

    // ---- packs ----------------------------------------------------------------------------------

    template <int N> RVE_INLINE void load(const Shared &, PackItem<N> i)
    {
      for (int k = i.first; k < i.first + N; ++k) rows[k] = Row();
    }
    template <int N> RVE_INLINE void save(PackItem<N>) {}
    template <int N> RVE_INLINE void load_with_forces(PackItem<N>) {}

    template <int N> RVE_INLINE View<N> view(PackItem<N> i)
    {
      View<N> grains;
      load_seen([&](int lane) { return this->motion.array + i.first + lane; }, grains);
      if constexpr (D == 2) {
        grains.spin = load_records<Spin<typename Packed<N>::Real, D>, typename Packed<N>::Real>(
            this->spin.array + i.first);
        grains.radius = Packed<N>::Wide::load(this->radius.array + i.first);
      } else {
        grains.radius = load_each<typename Packed<N>::Wide>(
            [&](int lane) { return this->motion[i.first + lane].radius; });
      }
      return grains;
    }

    template <int N> RVE_INLINE View<N> view_partner(const Shared &shared, int k, PackItem<N> i)
    {
      const std::int32_t *partner = this->partners.slot[k].array + i.first;
      View<N> grains;
      load_seen([&](int lane) { return shared.motion + partner[lane]; }, grains);
      if constexpr (D == 2) grains.spin = gather<typename Config::Real, N>(shared.spin, partner);
      grains.radius = Packed<N>::Wide::load(this->partners.radius_in[k].array + i.first);
      return grains;
    }

    /// Returns whether one of the grains has a pair in slot k.
    template <int N> RVE_INLINE bool is_taken(int k, PackItem<N> i)
    {
      using Wide = typename Packed<N>::Wide;
      return any(Wide::load(this->partners.radius_in[k].array + i.first) > Wide(0));
    }

    template <int N>
    RVE_INLINE GrainResponse<Packed<N>, D> response(const Shared &shared, PackItem<N> i)
    {
      GrainResponse<Packed<N>, D> response;
      if constexpr (D == 2) {
        Vec<typename Packed<N>::Real, 2> units;
        load_row([&](int lane) { return shared.response + i.first + lane; }, units,
                 response.list_position);
        response.velocity_unit = units[0];
        response.spin_unit = units[1];
      } else {
        using Real = typename Packed<N>::Real;
        response.velocity_unit =
            load_each<Real>([&](int lane) { return this->motion[i.first + lane].velocity_unit; });
        response.spin_unit =
            load_each<Real>([&](int lane) { return this->motion[i.first + lane].spin_unit; });
        load_numbers([&](int lane) { return shared.list_position + i.first + lane; },
                     response.list_position);
      }
      return response;
    }

    template <int N> RVE_INLINE HistoryLanes<Config, N> history_of(int k, PackItem<N> i)
    {
      return {this->history[k].array + i.first};
    }

    template <int N> RVE_INLINE typename Packed<N>::Real largest_of(PackItem<N> i)
    {
      return Packed<N>::Real::load(this->largest_force.array + i.first);
    }

    /// Computes the geometry of several slots before act() is called for the first of them. The
    /// latency of roots and quotients of one pair passes while other pairs are computed.
    template <int N, class Step, class View, class Geometry, class Act, class IsTaken>
    RVE_INLINE void for_slots(PackItem<N>, Step step, View view, Geometry geometry, Act act,
                              IsTaken is_taken)
    {
      if constexpr (D == 2) {
        static_assert(D != 2 || Config::owned_pairs == 3, "variables, not arrays: registers");
        const auto first = view(0);
        const auto to_first = geometry(step(), first);
        const auto second = view(1);
        const auto to_second = geometry(step(), second);
        if (!is_taken(2)) {
          act(0, step(), first, to_first);
          act(1, step(), second, to_second);
          return;
        }
        const auto third = view(2);
        const auto to_third = geometry(step(), third);
        act(0, step(), first, to_first);
        act(1, step(), second, to_second);
        act(2, step(), third, to_third);
      } else {
        static_assert(D != 3 || Config::owned_pairs == 4,
                      "made where they are: what is copied is long");
        struct Slot {
          decltype(view(0)) other;
          decltype(geometry(step(), view(0))) contact;

          RVE_INLINE Slot(int k, Step &step, View &view, Geometry &geometry) :
              other(view(k)), contact(geometry(step(), other))
          {
          }
        };
        const Slot slot[] = {{0, step, view, geometry},
                             {1, step, view, geometry},
                             {2, step, view, geometry},
                             {3, step, view, geometry}};
        for (int k = 0; k < Config::owned_pairs; ++k)
          act(k, step(), slot[k].other, slot[k].contact);
      }
    }

    /// Calls f for parts of a pack that fill one register: 8 floats or 4 doubles.
    template <int N, class F> RVE_INLINE void for_parts(PackItem<N> i, F f)
    {
      constexpr int lanes = sizeof(typename Config::Real) == 4 ? 8 : 4;
      for (int part = 0; part < N; part += lanes) f(PackItem<lanes>{i.first + part});
    }
    template <int N, class F> RVE_INLINE void for_each_grain(PackItem<N> i, int end, F f)
    {
      for (int k = i.first; k < i.first + N && k < end; ++k) f(k);
    }

    template <int N>
    RVE_INLINE void add_to_partner(Block &, const Shared &, int k, PackItem<N> i,
                                   const PackedSums<N> &force)
    {
      const std::int32_t *partner = this->partners.slot[k].array + i.first;
      add_to_row([&](int lane) { return rows[partner[lane]].sum; }, force);
    }

    template <int N>
    RVE_INLINE void keep_forces(Block &, const Shared &, PackItem<N> i, const PackedSums<N> &force,
                                const typename Packed<N>::Real &largest)
    {
      add_to_row([&](int lane) { return rows[i.first + lane].sum; }, force);
      largest.store(this->largest_force.array + i.first);
    }

    template <int N> RVE_INLINE PackedSums<N> collect(Block &, const Shared &shared, PackItem<N> i)
    {
      PackedSums<N> sum;
      take_rows(rows[i.first].sum, sum);
      for (int k = 0; k < Config::freedoms; ++k)
        if (k < D || Config::has_friction) take_numbers(shared.force[k] + i.first, sum[k]);
      return sum;
    }

    template <int N>
    RVE_INLINE void publish_motion(PackItem<N> i, const Motion<Packed<N>, D> &motion)
    {
      if constexpr (D == 2) {
        store_row([&](int lane) { return this->motion.array + i.first + lane; }, motion.position,
                  motion.velocity);
      } else {
        store_numbers([&](int lane) { return &this->motion[i.first + lane].position; },
                      motion.position);
        store_numbers([&](int lane) { return &this->motion[i.first + lane].velocity; },
                      motion.velocity);
      }
    }

    template <int N>
    RVE_INLINE void publish_spin(PackItem<N> i, const Spin<typename Packed<N>::Real, D> &spin)
    {
      if constexpr (D == 2)
        store_records<typename Packed<N>::Real>(spin, this->spin.array + i.first);
      else
        store_numbers([&](int lane) { return &this->spin[i.first + lane]; }, spin);
    }

   private:
    /// Loads position and velocity, for spheres also the spin.
    template <class Row, class SomeView>
    static RVE_INLINE void load_seen(const Row &row, SomeView &grains)
    {
      if constexpr (D == 2) {
        load_row(row, grains.motion.position, grains.motion.velocity);
      } else {
        load_numbers([&](int lane) { return &row(lane)->position; }, grains.motion.position);
        load_numbers([&](int lane) { return &row(lane)->velocity; }, grains.motion.velocity);
        load_numbers([&](int lane) { return &row(lane)->spin; }, grains.spin);
      }
    }

    template <class PackOfNumbers, class Number>
    static RVE_INLINE PackOfNumbers load_each(Number number)
    {
      constexpr int count = PackOfNumbers::lanes;
      decltype(number(0)) each[count];
      for (int lane = 0; lane < count; ++lane) each[lane] = number(lane);
      return PackOfNumbers::load(each);
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
