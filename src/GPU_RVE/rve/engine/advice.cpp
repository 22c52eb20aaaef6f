// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/advice.h"

#include "rve/core/error.h"
#include "rve/core/pi.h"
#include "rve/engine/contact_laws.h"
#include "rve/engine/finite_strain.h"
#include "rve/engine/substeps.h"
#include "rve/physics/solid_cell.h"

#include <algorithm>
#include <cmath>

namespace rve {

namespace {

  constexpr double STRESS_ERROR = 1e-3;

  // Smallest increment of a single-precision tangential force in a DEM step, in units in the last
  // place of the force. The rounding error of an addition is half a unit, which is less than 1 % of
  // 64 units.
  constexpr double UNITS_PER_STEP = 64.0;

  /// Returns true if tangential forces are stored in fp32.
  bool is_fp32(Format format)
  {
    return format == Format::Fast || format == Format::Single;
  }

  template <int D> double longest_edge(const Tensor<double, D> &h)
  {
    double longest = 0.0;
    for (int b = 0; b < D; ++b) {
      double squares = 0.0;
      for (int a = 0; a < D; ++a) squares += h(a, b) * h(a, b);
      longest = std::max(longest, std::sqrt(squares));
    }
    return longest;
  }

}    // namespace

double Advice::severity() const
{
  const bool is_lower_limit = kind == AdviceKind::SmallOverlap || kind == AdviceKind::SlowStrain ||
      kind == AdviceKind::SmallCell;
  return is_lower_limit ? limit / value : value / limit;
}

double smallest_overlap(Format format, double grains_along_edge)
{
  switch (format) {
    case Format::Single:
      // The rounding error of positions dominates. It grows with the size of the cell.
      return grains_along_edge * 0x1p-24 / STRESS_ERROR;
    case Format::Fast:
      return 0x1p-24 / STRESS_ERROR;
    default:
      return 0x1p-53 / STRESS_ERROR;
  }
}

std::vector<Advice> advice_on_friction(const Material &material)
{
  std::vector<Advice> list;
  const auto check_coefficient = [&](double friction, const char *what) {
    if (!(friction > LARGEST_USUAL_FRICTION)) return;
    const double degree = kPi / 180.0;
    list.push_back(
        {AdviceKind::LargeFriction, friction, LARGEST_USUAL_FRICTION,
         std::string("the ") + what + " is " + rounded(friction) + " [-], above " +
             rounded(LARGEST_USUAL_FRICTION) +
             (friction < 90.0 ? "; if the value is an angle in degrees, use its tangent, " +
                      rounded(std::tan(friction * degree))
                              : "; contacts then hardly ever slide")});
  };
  check_coefficient(material.friction, "friction coefficient");
  if (resists_rolling(material))
    check_coefficient(material.rolling_friction, "rolling friction coefficient");
  return list;
}

template <int D>
double stress_out_of_reach(const ResultOf<D> &result, const DriveOf<D> &drive, double mode_error)
{
  double most = 0.0;
  if (drive.num_modes > 0) {    // the largest component of a mode equals its amplitude
    const Tensor<double, D> steered = result.servo_velocity_gradient - drive.velocity_gradient;
    for (const double rate : steered.component) most = std::max(most, std::fabs(rate));
    return most < (1.0 - 1e-9) * drive.servo_max_rate ? 0.0 : mode_error;
  }
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b) {
      if (!drive.controlled[a][b] ||
          std::fabs(result.servo_velocity_gradient(a, b)) < drive.servo_max_rate)
        continue;
      const double now = 0.5 * (result.stress(a, b) + result.stress(b, a));
      most = std::max(most, std::fabs(drive.stress_goal(a, b) - now));
    }
  return most;
}

template <int D>
std::vector<Advice> advice_on_servo(const ResultOf<D> &result, const DriveOf<D> &drive,
                                    double before, double mode_error)
{
  constexpr double NO_NEARER = 0.999;
  const double now = stress_out_of_reach(result, drive, mode_error);
  if (!(before > 0.0) || !(now >= NO_NEARER * before)) return {};
  return {{AdviceKind::GoalOutOfReach, now, NO_NEARER * before,
           "the stress servo is at its largest strain rate, " + rounded(drive.servo_max_rate) +
               " [1/time], but the stress stays " + rounded(now) +
               " [stress] away from its goal; use a goal that the grains can carry (no tension), "
               "or a larger servo_max_rate"}};
}

std::vector<Advice> advice_on_energy(const EnergyTerms &before, const EnergyTerms &now)
{
  // Tolerance for the rounding error of the stored energy, relative to that energy [-].
  constexpr double ROUNDING = 1e-5;
  const double gap = std::fabs(now.constant() - before.constant());
  const double turnover = std::fabs(now.supplied - before.supplied) +
      std::fabs(now.lost - before.lost) + std::max(before.kinetic, now.kinetic) +
      ROUNDING / ENERGY_BALANCE_GAP * std::max(before.stored, now.stored);
  if (!(gap > ENERGY_BALANCE_GAP * turnover)) return {};
  return {{AdviceKind::OpenBalance, gap / turnover, ENERGY_BALANCE_GAP,
           "the error of the energy balance is " + rounded(gap / turnover) +
               " of the energy supplied and dissipated in this run, above " +
               rounded(ENERGY_BALANCE_GAP) +
               ": the DEM time step is too long for the collisions or dashpots, and the "
               "dissipation is wrong; use a shorter DEM time step, for example dt auto 0.1"}};
}

template <int D>
std::vector<Advice> advice(Format format, const ResultOf<D> &result, const Material &material,
                           const DriveRates &motion)
{
  std::vector<Advice> list;
  const bool in_contact = result.num_contacts > 0;
  const std::string stiffness = material.law == ContactLaw::Linear ? "kn" : "stiffness";
  const double overlap = result.mean_overlap;
  const double smallest = smallest_overlap(format, longest_edge(result.cell) / grain_size(result));
  if (in_contact && overlap < smallest)
    list.push_back(
        {AdviceKind::SmallOverlap, overlap, smallest,
         "the mean overlap is " + rounded(overlap) + " of the sum of radii, below " +
             rounded(smallest) + ", the smallest overlap that format " + to_string(format) +
             " resolves within 0.1 %; " +
             (is_fp32(format) ? "use format mixed or double"
                              : "use a smaller " + stiffness + " or a higher pressure")});

  if (in_contact && overlap > LARGEST_MEAN_OVERLAP)
    list.push_back({AdviceKind::LargeOverlap, overlap, LARGEST_MEAN_OVERLAP,
                    "the mean overlap is " + rounded(overlap) + " of the sum of radii, above " +
                        rounded(LARGEST_MEAN_OVERLAP) + ": such overlaps of " +
                        (D == 2 ? "disks" : "spheres") +
                        " cause errors of the same size in contact stiffness and void ratio (" +
                        rounded(result.void_ratio) + " [-]); use a larger " + stiffness +
                        (D == 2 ? ", a smaller thickness" : "") + " or a lower pressure"});

  if (result.status & status::NoContacts)
    list.push_back({AdviceKind::NoContacts, 1.0, 1.0,
                    "the packing has no contacts (void ratio " + rounded(result.void_ratio) +
                        " [-]), and its stress is zero; if the packing must carry load, compress "
                        "it or strain it less"});

  const double radius = 0.5 * grain_size(result);
  const ContactSite site{2.0 * radius * overlap, radius, radius};
  double spring_force = 0.0, tangential_stiffness = 0.0;
  with_law<D>(material, [&](const auto &law) {
    spring_force = law.spring_force(site);
    tangential_stiffness = law.stiffness(site).tangential;
  });
  if (is_fp32(format) && in_contact && motion.strain_rate > 0.0 && motion.dt > 0.0 &&
      tangential_stiffness > 0.0) {
    // A sliding contact carries the tangential force mu f_n. A DEM step adds k_t d times the strain
    // of the step.
    const double limit = UNITS_PER_STEP * 0x1p-24 * material.friction * spring_force /
        (tangential_stiffness * 2.0 * radius) / motion.dt;
    if (motion.strain_rate < limit)
      list.push_back({AdviceKind::SlowStrain, motion.strain_rate, limit,
                      "the strain rate is " + rounded(motion.strain_rate) + " [1/time], below " +
                          rounded(limit) + " [1/time]: format " + to_string(format) +
                          " rounds the increments of tangential forces by more than 1 %; use "
                          "format mixed, or fewer substeps"});
  }

  if (in_contact && result.mean_stress() > 0.0) {
    const double inertia = inertial_number(result, material, motion.strain_rate);
    if (inertia > QUASI_STATIC_INERTIAL_NUMBER)
      list.push_back({AdviceKind::FastStrain, inertia, QUASI_STATIC_INERTIAL_NUMBER,
                      "the inertial number is " + rounded(inertia) + ", above " +
                          rounded(QUASI_STATIC_INERTIAL_NUMBER) +
                          ", the limit of quasi-static deformation: the stress depends on the "
                          "strain rate; use a lower strain rate, more substeps or a smaller grain "
                          "mass"});
  }

  if (motion.dt > 0.0 && motion.stable_dt > 0.0 && motion.dt > TIME_STEP_SHARE * motion.stable_dt)
    list.push_back({AdviceKind::LongTimeStep, motion.dt, TIME_STEP_SHARE * motion.stable_dt,
                    "the DEM time step is " + rounded(motion.dt) + " [time], above " +
                        rounded(TIME_STEP_SHARE) + " of the stability bound, " +
                        rounded(motion.stable_dt) + " [time]; use a shorter dt, or dt auto"});

  const double grains = smallest_width(result.cell) / grain_size(result);
  if (motion.applied_strain > SHEAR_BAND_STRAIN && grains < SHEAR_BAND_GRAINS<D>)
    list.push_back({AdviceKind::SmallCell, grains, SHEAR_BAND_GRAINS<D>,
                    "the cell is " + rounded(grains) + " grains wide, below " +
                        rounded(SHEAR_BAND_GRAINS<D>) +
                        ", the width of a shear band: after the peak, the stress depends on the "
                        "size of the cell; use more grains"});
  return list;
}

template std::vector<Advice> advice(Format, const ResultOf<2> &, const Material &,
                                    const DriveRates &);
template std::vector<Advice> advice(Format, const ResultOf<3> &, const Material &,
                                    const DriveRates &);
template double stress_out_of_reach(const ResultOf<2> &, const DriveOf<2> &, double);
template double stress_out_of_reach(const ResultOf<3> &, const DriveOf<3> &, double);
template std::vector<Advice> advice_on_servo(const ResultOf<2> &, const DriveOf<2> &, double,
                                             double);
template std::vector<Advice> advice_on_servo(const ResultOf<3> &, const DriveOf<3> &, double,
                                             double);

}    // namespace rve
