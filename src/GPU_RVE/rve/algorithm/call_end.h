// SPDX-License-Identifier: GPL-2.0-only
// End of a call: checks of its result, and output.

#pragma once

#include "rve/algorithm/call_progress.h"
#include "rve/algorithm/force_units.h"

namespace rve {
inline namespace RVE_ISA {

  /// Checks the last forces and writes the results of a call.
  template <class Block, class Config> struct CallEnd {
    using Item = typename Block::Item;
    using Real = typename Config::Real;

    /// Returns true if the largest force shows that no grain has an error, as in nearly all calls.
    /// Otherwise the grains must be checked.
    static RVE_INLINE bool is_sound(const CallState<Config> &call)
    {
      return call.totals.largest < call.sound_force;
    }

    /// Returns the status of a call whose steps are done, without a check of single grains.
    static RVE_INLINE std::uint32_t check(const CallState<Config> &call)
    {
      std::uint32_t word = call.status;
      if (call.totals.sum[StressSums<Config::D>::over_limit] > 0) word |= status::OverlapTooLarge;
      if (call.totals.sum[StressSums<Config::D>::contacts] == 0) word |= status::NoContacts;
      if (call.num_extra > call.header.extra_capacity) word |= status::ListFull;
      if (!(call.end_per_volume > 0.0)) word |= status::NonFinite;
      return word;
    }

    /// Adds the errors of single grains to the status `word` and returns it. The grains are not
    /// checked if is_sound() excludes errors, or if `word` has a fatal error already.
    /// OverlapTooLarge does not prevent the check: a force beyond the range of the sums can cause
    /// overlaps that seem too large.
    static RVE_INLINE std::uint32_t
    with_errors_of_grains(Block &block, const CallState<Config> &call, std::uint32_t word)
    {
      if ((word & status::Fatal & ~status::OverlapTooLarge) != 0 || is_sound(call)) return word;
      return find_errors(block, call, word);
    }

    /// Checks each grain. If a force is beyond the range of the sums, the overlaps are wrong, too.
    /// The status is then ForceSaturated without OverlapTooLarge, and the call is repeated.
    static RVE_COLD std::uint32_t find_errors(Block block, const CallState<Config> &call,
                                              std::uint32_t word)
    {
      const SharedView<Config> &shared = call.shared;
      const Real limiting =
          static_cast<Real>(ForceUnits<Block, Config>::force_at_overlap_limit(call));
      // If no normal dashpot acts and only normal forces count, the largest force is the force of a
      // normal spring.
      const bool springs_only = !Config::Law::has_normal_dashpot(call.header.material) &&
          !(Config::has_bookkeeping && call.header.all_forces_count);
      if (block.any(call.num_grains,
                    [&](Item i) { return springs_only && shared.largest_force[i] > limiting; }))
        word |= status::OverlapTooLarge;
      if (block.any(call.num_grains, [&](Item i) {
            return !moves_soundly<Config::D>(shared.motion[i].velocity, shared.spin[i]);
          }))
        word |= status::NonFinite;
      if (ForceUnits<Block, Config>::is_saturated(block, call))
        word = (word | status::ForceSaturated) & ~status::OverlapTooLarge;
      return word;
    }

    /// Largest contact force of the call [force].
    static RVE_INLINE double peak_force(const CallState<Config> &call)
    {
      return call.units.force * static_cast<double>(call.totals.largest);
    }

    /// Number of parts of the output of a successful call, without its grains: one part for each
    /// word of its progress, one for each component of the stress, and one for all other results.
    static constexpr int kProgressWords = sizeof(StateProgress<Config::D>) / sizeof(std::int64_t);
    static constexpr int kResults = kProgressWords + Config::components + 1;

    /// Writes one of the kResults parts.
    static RVE_INLINE void write_result(const CallState<Config> &call, std::uint32_t word, int part,
                                        AnswerRecord<Config::D> &answer)
    {
      if (part < kProgressWords) {
        constexpr int of_largest_force =
            offsetof(StateProgress<Config::D>, largest_contact_force) / sizeof(std::int64_t);
        // An evaluation, that is a call without steps, must not change later calls. It sets the
        // force scale only if there is none yet.
        if (part != of_largest_force)
          copy_word<std::int64_t>(
              call.after, *static_cast<StateProgress<Config::D> *>(call.device_state.header), part);
        else if (call.drive.substeps > 0 || call.header.largest_contact_force == 0.0)
          call.device_state.header->largest_contact_force = peak_force(call);
      } else if (part < kProgressWords + Config::components) {
        const int k = part - kProgressWords;
        answer.stress[k] = stress_component(call, call.end_per_volume, k);
      } else {
        answer.status = word;
        answer.needed_extra = call.num_extra;
        answer.needed_pairs = call.needed_pairs;
        answer.expected_force = call.expected_force;
        answer.peak_force = peak_force(call);
        answer.num_contacts =
            static_cast<std::int32_t>(call.totals.sum[StressSums<Config::D>::contacts]);
      }
    }

    /// Writes the results of a failed call. One thread calls it.
    static RVE_COLD void write_failure(const CallState<Config> &call, std::uint32_t word,
                                       AnswerRecord<Config::D> &answer)
    {
      answer.status = word;
      answer.needed_extra = call.num_extra;
      answer.needed_pairs = call.needed_pairs;
      answer.expected_force = call.expected_force;
      answer.num_contacts = 0;
      answer.peak_force = 0.0;
      store_tensor(Tensor<double, Config::D>::zero(), answer.stress);
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
