// SPDX-License-Identifier: GPL-2.0-only
// Errors that all ranks raise together with the same text, even if only one rank found the problem.

#pragma once

#include "error.h"
#include "exceptions.h"
#include "lammps.h"
#include "lmptype.h"

#include <array>
#include <exception>
#include <mpi.h>
#include <string>
#include <type_traits>
#include <utility>

namespace LAMMPS_NS {

/// Collects the atoms of all ranks that have a problem. The error names the atom with the lowest
/// ID.
class CollectiveError {
 public:
  /// Three numbers of an atom for the message.
  using Values = std::array<double, 3>;

  void add(tagint id, const Values &values)
  {
    count_++;
    if (count_ > 1 && id > lowest_) return;
    lowest_ = id;
    values_ = values;
  }

  /// Ends with error->all if any rank has added an atom. The text is
  /// message(number of atoms, lowest ID, values of that atom). Collective.
  template <class Message> void raise_if_any(LAMMPS *lmp, const Message &message)
  {
    bigint count, mine = count_;
    MPI_Allreduce(&mine, &count, 1, MPI_LMP_BIGINT, MPI_SUM, lmp->world);
    if (!count) return;
    const tagint own = count_ ? lowest_ : MAXTAGINT;
    tagint lowest;
    MPI_Allreduce(&own, &lowest, 1, MPI_LMP_TAGINT, MPI_MIN, lmp->world);
    if (own != lowest) values_ = {0.0, 0.0, 0.0};
    Values values;
    MPI_Allreduce(values_.data(), values.data(), 3, MPI_DOUBLE, MPI_SUM, lmp->world);
    lmp->error->all(FLERR, message(count, lowest, values));
  }

 private:
  bigint count_ = 0;
  tagint lowest_ = 0;
  Values values_{0.0, 0.0, 0.0};
};

/// Returns the message of the lowest rank that has one, or an empty text. The result is the same on
/// all ranks. Collective.
std::string first_message(LAMMPS *lmp, std::string message);

/// Ends with error->all if any rank has a message. All ranks use the message of the lowest rank
/// that has one. Collective.
void error_if_any(LAMMPS *lmp, std::string message);

/// Returns the text of an exception for an error message. It is never empty. For std::bad_alloc it
/// reports a lack of memory.
std::string problem_of(const std::exception &exception);

/// Runs `body` on each rank. If it throws on any rank, all ranks end with error->all: "who: " and
/// the problem of the lowest rank that failed. Collective, but `body` must not communicate, because
/// a rank that has failed would not take part. Exceptions of LAMMPS pass through, because
/// error->all in `body` has ended all ranks.
template <class Body> void collectively(LAMMPS *lmp, const std::string &who, const Body &body)
{
  std::string message;
  try {
    body();
  } catch (const LAMMPSException &) {
    throw;
  } catch (const std::exception &problem) {
    message = who + ": " + problem_of(problem);
  }
  error_if_any(lmp, std::move(message));
}

/// Returns body(). If it throws on this rank, the rank ends with error->one: who() + ": " and the
/// problem. LAMMPS then aborts all ranks. This is for work within a run, where the other ranks may
/// already wait in a collective call.
template <class Who, class Body>
std::invoke_result_t<const Body &> on_this_rank(LAMMPS *lmp, const Who &who, const Body &body)
{
  try {
    return body();
  } catch (const LAMMPSException &) {
    throw;
  } catch (const std::exception &problem) {
    lmp->error->one(FLERR, who() + ": " + problem_of(problem));
  }
}

}    // namespace LAMMPS_NS
