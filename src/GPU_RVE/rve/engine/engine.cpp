// SPDX-License-Identifier: GPL-2.0-only
// Functions of engine.h that do not depend on a backend.

#include "rve/engine/engine.h"

#include "rve/core/error.h"
#include "rve/engine/finite_strain.h"

#include <cmath>
#include <utility>

namespace rve {

namespace {

  /// Returns the angular velocity of a constant velocity gradient [rad/time].
  double turn_of(const Tensor2 &velocity_gradient)
  {
    return 0.5 * (velocity_gradient(1, 0) - velocity_gradient(0, 1));
  }

  double turn_of(const Tensor3 &velocity_gradient)
  {
    const Vec<double, 3> twice_spin = axial_vector(velocity_gradient);
    return 0.5 * std::sqrt(dot(twice_spin, twice_spin));
  }

  double deviatoric_size(const Tensor3 &stress)
  {
    const double mean = trace(stress) / 3.0;
    double squares = 0.0;
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) {
        const double part = a == b ? stress(a, b) - mean : stress(a, b);
        squares += part * part;
      }
    return std::sqrt(1.5 * squares);
  }

  double deviatoric_size(const Tensor2 &stress)
  {
    const double half_difference = 0.5 * (stress(0, 0) - stress(1, 1));
    // In the plane s'_00 = -s'_11. The stress can be unsymmetric, so the square of each shear
    // component enters.
    return std::sqrt(half_difference * half_difference +
                     0.5 * (stress(0, 1) * stress(0, 1) + stress(1, 0) * stress(1, 0)));
  }

  constexpr std::pair<std::uint32_t, const char *> STATUS_WORDS[] = {
      {status::ListFull, "contact list full"},
      {status::ForceSaturated, "contact force exceeds the integer range"},
      {status::OverlapTooLarge, "overlap too large"},
      {status::NonFinite, "motion or force not finite"},
      {status::Unstable, "time step unstable"},
      {status::CellTooNarrow, "cell too narrow"},
      {status::NoContacts, "no contacts"}};

  constexpr std::pair<std::uint32_t, const char *> REMEDIES[] = {
      {status::CellTooNarrow,
       "half of the cell width must exceed the largest contact distance plus the skin: use a "
       "packing with more grains or a smaller ratio of largest to smallest radius, or a smaller "
       "skin"},
      {status::Unstable, "use a shorter DEM time step"},
      {status::OverlapTooLarge, "use a shorter DEM time step, a lower strain rate or a larger kn"},
      {status::ForceSaturated, "use a shorter DEM time step, or a smaller strain per call"},
      {status::NonFinite,
       "check for a prescribed motion that is not a finite number, or use a shorter DEM time "
       "step"}};

}    // namespace

std::string describe_status(std::uint32_t status)
{
  if (status == status::Ok) return "ok";
  std::string words;
  std::uint32_t unknown = status;
  for (const auto &[bit, word] : STATUS_WORDS) {
    if (!(status & bit)) continue;
    words += (words.empty() ? "" : ", ") + std::string(word);
    unknown &= ~bit;
  }
  if (unknown)
    words += (words.empty() ? "" : ", ") + std::string("unknown status ") + std::to_string(unknown);
  return words;
}

std::string remedy_of_status(std::uint32_t status)
{
  for (const auto &[bit, remedy] : REMEDIES)
    if (status & bit) return std::string("; ") + remedy;
  return "";
}

template <int D>
DriveOf<D> DriveOf<D>::constant_velocity_gradient(const Matrix &velocity_gradient, double dt,
                                                  int substeps)
{
  // The engine receives only the deformation increment, which is the same for rotations by pi and
  // -pi.
  const double turn = turn_of(velocity_gradient) * substeps * dt;
  require(!(std::fabs(turn) > 3.0), "an RVE must rotate by at most 3 rad in one call, got ", turn,
          " rad: use a smaller timestep or fewer substeps");
  DriveOf drive;
  drive.dt = dt;
  drive.substeps = substeps;
  drive.velocity_gradient = velocity_gradient;
  drive.deformation = exponential((substeps * dt) * velocity_gradient);
  return drive;
}

template <int D> double ResultOf<D>::deviatoric_stress() const
{
  return deviatoric_size(stress);
}

std::string to_string(Format format)
{
  for (const auto &[word, value] : FORMAT_CHOICES)
    if (value == format) return word;
  throw InputError(concat("number format ", static_cast<int>(format), " does not exist"));
}

template struct DriveOf<2>;
template struct DriveOf<3>;
template struct ResultOf<2>;
template struct ResultOf<3>;

}    // namespace rve
