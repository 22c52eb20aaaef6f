// SPDX-License-Identifier: GPL-2.0-only
// Lower bound of the stable time step of an RVE, computed in the kernel. The bound is a few percent
// below stable_time_step() (engine/stability.h). It is cheap enough to check thousands of RVEs, of
// which few then need the exact result.
//
// In the plane, the vector u_i has the two displacements and the rotation of grain i, scaled by the
// roots of the masses. A contact couples u_i and u_j by a 3x3 matrix C, and
//     2 u_i.C u_j <= g u_i.|C| u_i + (1/g) u_j.|C^T| u_j,    |C| = (C C^T)^1/2, for any g > 0.
// M^-1/2 K M^-1/2, with masses M and stiffness K, is therefore below a matrix with one 3x3 block
// per grain. The largest eigenvalue of the blocks is a bound for any weights w of the grains, where
// a contact has g = w_j/w_i. The first sweep has w = 1/m, which gives the eigenvalue of a single
// contact exactly. In the following sweeps, grains with larger eigenvalues get larger weights, so
// that their partners carry larger shares of their contacts. Each sweep gives a bound. After some
// sweeps all grains of the fastest mode have the same eigenvalue, the eigenvalue of the mode. The
// bound stays above the eigenvalue of the mode where contacts form odd rings, since the inequality
// assumes signs of the motion that are impossible there.
//
// In space there are no weights. The energy of a contact is at most twice the sum of two energies:
// its energy if only the first grain moves, and its energy if only the second grain moves. The
// largest eigenvalue of the network is therefore at most twice the largest eigenvalue of a grain
// that moves alone. Such a grain has a block T for its translation and a block R for its rotation.
// Its eigenvalue is at most the sum of the largest eigenvalues of T and R; for a single contact it
// is exactly this sum. The largest eigenvalue of a symmetric 3x3 matrix A is at most q + 2 p with q
// = tr(A)/3 and p^2 = tr((A - q I)^2)/6.

#pragma once

#include "rve/algorithm/contact_visit.h"
#include "rve/algorithm/force_units.h"
#include "rve/physics/integrator.h"

namespace rve {
inline namespace RVE_ISA {

  /// Returns the largest eigenvalue of the positive semidefinite matrix (xx, yy, ww, xy, xw, yw).
  /// Newton's method decreases monotonically to the largest root of the characteristic polynomial,
  /// so that no iterate is below it.
  RVE_INLINE double largest_eigenvalue(const double (&a)[6])
  {
    const double trace = a[0] + a[1] + a[2];
    const double minors =
        (a[0] * a[1] - a[3] * a[3]) + (a[0] * a[2] - a[4] * a[4]) + (a[1] * a[2] - a[5] * a[5]);
    const double determinant = a[0] * (a[1] * a[2] - a[5] * a[5]) -
        a[3] * (a[3] * a[2] - a[5] * a[4]) + a[4] * (a[3] * a[5] - a[1] * a[4]);
    double x = trace;
    for (int k = 0; k < 30; ++k) {
      const double value = ((x - trace) * x + minors) * x - determinant;
      const double slope = (3.0 * x - 2.0 * trace) * x + minors;
      if (!(value > 0.0) || !(slope > 0.0)) break;
      const double next = x - value / slope;
      if (!(next < x)) break;
      x = next;
    }
    return x;
  }

  /// Springs or dashpots: both are quadratic forms of the same displacements.
  enum class ModuliKind { Springs, Dashpots };

  /// Returns the moduli of a contact in units of the script, at a site whose lengths have the unit
  /// `length`. A spring whose pull decreases with its length raises no frequency and counts as
  /// zero.
  template <class Law>
  RVE_INLINE ContactModuli moduli_at(const Law &law, ModuliKind kind, double length,
                                     const ContactSite &site)
  {
    const ContactSite there{length * site.overlap, length * site.radius_i, length * site.radius_j};
    ContactModuli moduli = kind == ModuliKind::Springs ? law.stiffness(there)
                                                       : law.viscosity(there);
    if constexpr (Law::has_reach) moduli.normal = larger(moduli.normal, 0.0);
    return moduli;
  }

  /// Arrays over grains for the search of a bound.
  struct BoundArrays {
    std::int64_t *block;    ///< (6, N), in space (12, N)
    double *weight, *value;
  };

  /// Bound of the largest eigenvalue of M^-1 K, for the contacts of the RVE and for one contact
  /// that can form. K is the matrix of the springs or of the dashpots (`kind`). The unit of the
  /// bound is `largest` divided by the mass of a grain whose radius is one internal length.
  /// `largest` is at least as large as any modulus of K.
  template <class Block, class Config> struct EigenvalueBound {
    using Item = typename Block::Item;
    using ScriptLaw = typename Config::Law::template In<DoubleNumbers>;

    Block &block;
    const CallState<Config> &call;
    StepConstants<Config> step;
    ScriptLaw law;
    ModuliKind kind;
    double largest;
    BoundArrays arrays;

    RVE_INLINE ContactModuli relative_moduli(const ContactSite &site) const
    {
      const ContactModuli moduli = moduli_at(law, kind, call.units.length, site);
      return {moduli.normal / largest, moduli.tangential / largest, moduli.rolling / largest,
              moduli.twisting / largest};
    }

    RVE_INLINE double radius(int i) const { return static_cast<double>(call.shared.radius[i]); }

    /// Returns the assumed overlap of a contact that can form at any time [internal length]. It is
    /// the overlap of the deepest contact, or the estimate for a packing without contacts.
    RVE_INLINE double coming_overlap() const
    {
      if constexpr (Config::Law::has_constant_moduli) return 0.0;
      block.for_each(call.num_grains, [&](Item i) {
        double most = 0.0;
        visit_contacts(call, step, i,
                       [&](int, int, const auto &, const auto &, const auto &contact,
                           typename Config::History) {
                         most = larger(most, static_cast<double>(contact.overlap));
                       });
        arrays.value[i] = most;
      });
      const double deepest = block.max_array(call.num_grains, arrays.value);
      return deepest > 0.0 ? deepest
                           : kGasOverlapShare * call.header.mean_radius * call.units.per_length;
    }

    /// Adds the contacts to the blocks of their grains.
    RVE_INLINE void add_contacts() const
    {
      block.for_each(call.num_grains, [&](Item item) {
        visit_contacts(call, step, item,
                       [&](int first, int second, const auto &one, const auto &other,
                           const auto &contact, typename Config::History) {
                         add_contact(first, second, contact,
                                     relative_moduli(site_of(contact, one, other)));
                       });
      });
    }

    // ---- in the plane ---------------------------------------------------------------------------

    /// Returns the bound in the plane. The sweeps stop when it is below `sufficient`.
    RVE_INLINE double in_plane(double sufficient) const
    {
      // More sweeps gain little: in dense and loose packings the time step is three percent below
      // the exact result after six sweeps, and one percent after 16.
      constexpr int kSweeps = 16;
      // Lower limit of the ratio of an eigenvalue to the largest one in a change of weights.
      constexpr double kLeastShare = 0.05;
      const int n = call.num_grains;
      block.for_each(n, [&](Item i) {
        const double r = radius(i);
        arrays.weight[i] = arrays.value[i] = 1.0 / (r * r);
        for (int k = 0; k < 6; ++k) Block::begin_sum(arrays.block + k * n, n, i);
      });
      const double of_pair = of_lightest_disks();
      double least = 0.0;
      for (int sweep = 0; sweep < kSweeps; ++sweep) {
        const double most = sweep_over_disks();
        const double bound = larger(most, of_pair);
        least = sweep == 0 ? bound : smaller(least, bound);
        if (least <= sufficient || most <= of_pair) break;
        block.for_each(n, [&](Item i) {
          const double relative = arrays.value[i] / most;
          arrays.weight[i] =
              arrays.weight[i] * std::sqrt(relative > kLeastShare ? relative : kLeastShare);
        });
      }
      return least;
    }

    /// Returns the bound for a contact between the two lightest grains, and for the lightest grain
    /// that rolls on any other. arrays.value must contain 1/r^2.
    RVE_INLINE double of_lightest_disks() const
    {
      const int n = call.num_grains;
      const double lightest = block.max_array(n, arrays.value);
      const auto as_light = block.template sum_integers<1>(
          n, [&](Item i, std::int64_t *sum) { sum[0] += arrays.value[i] == lightest ? 1 : 0; });
      double second = lightest;
      if (as_light[0] == 1) {
        block.for_each(n, [&](Item i) {
          if (arrays.value[i] == lightest) arrays.value[i] = 0.0;
        });
        second = block.max_array(n, arrays.value);
      }
      const ContactModuli coming =
          relative_moduli({coming_overlap(), 1.0 / std::sqrt(lightest), 1.0 / std::sqrt(second)});
      return larger(coming.normal * (lightest + second),
                    3.0 * coming.tangential * (lightest + second) +
                        2.0 * coming.rolling * lightest);
    }

    /// Returns the largest eigenvalue of the blocks of all grains, with the current weights.
    RVE_INLINE double sweep_over_disks() const
    {
      const int n = call.num_grains;
      add_contacts();
      block.for_each(n, [&](Item i) {
        double a[6];
        for (int k = 0; k < 6; ++k)
          a[k] = kDiskUnit * static_cast<double>(block.collect(arrays.block + k * n, n, i));
        const double r = radius(i);
        arrays.value[i] = largest_eigenvalue(a) / (r * r);
      });
      return block.max_array(n, arrays.value);
    }

    /// The sum of 256 terms below 2^18 is below 2^55 units, the range of a sum.
    static constexpr double kDiskUnit = 0x1p-29, kLargestRatio = 0x1p14;

    template <class Real>
    RVE_INLINE void add_contact(int first, int second, const ContactGeometry<Real, 2> &contact,
                                const ContactModuli &moduli) const
    {
      constexpr double kRoot2 = 1.4142135623730951;
      const double nx = static_cast<double>(contact.normal[0]),
                   ny = static_cast<double>(contact.normal[1]);
      const double overlap = static_cast<double>(contact.overlap);
      const int grain[2] = {first, second};
      const double r[2] = {radius(first), radius(second)};
      // Factors of the rotation of a grain in the displacement along the contact (arm) and in the
      // rolling displacement (share). Both contain the root of 2, since the mass of the rotation is
      // m/2.
      double arm[2], share[2];
      for (int side = 0; side < 2; ++side) {
        arm[side] = kRoot2 * (1.0 - 0.5 * (overlap / r[side]));
        share[side] = kRoot2 * (r[1 - side] / (r[0] + r[1]));
      }
      // These are the components of C for motion along the contact and for rotations; along the
      // normal C is -k_n. det C = -k_t k_r share share.
      const double k_n = moduli.normal, k_t = moduli.tangential, k_r = moduli.rolling;
      const double across[2] = {k_t * arm[1], k_t * arm[0]},
                   turning = k_t * (arm[0] * arm[1]) - k_r * (share[0] * share[1]);
      const double determinant = k_t * (k_r * (share[0] * share[1]));
      const double size =
          std::sqrt((k_t * k_t + turning * turning) +
                    (across[0] * across[0] + across[1] * across[1]) + 2.0 * determinant);
      const double per_size = size > 0.0 ? 1.0 / size : 0.0;
      const int n = call.num_grains;
      for (int side = 0; side < 2; ++side) {
        const double sign = side == 0 ? 1.0 : -1.0;
        double ratio = arrays.weight[grain[1 - side]] / arrays.weight[grain[side]];
        ratio = ratio < kLargestRatio ? ratio : kLargestRatio;
        ratio = ratio * kLargestRatio > 1.0 ? ratio : 1.0 / kLargestRatio;
        const double g = ratio * per_size, mine = across[side], other = across[1 - side];
        const double along = k_n + ratio * k_n;
        const double tt = k_t + g * (k_t * k_t + mine * mine + determinant);
        const double tw = k_t * arm[side] + g * (k_t * other + mine * turning);
        const double ww = k_t * (arm[side] * arm[side]) + k_r * (share[side] * share[side]) +
            g * (other * other + turning * turning + determinant);
        const double term[6] = {along * (nx * nx) + tt * (ny * ny),
                                along * (ny * ny) + tt * (nx * nx),
                                ww,
                                (along - tt) * (nx * ny),
                                -tw * (sign * ny),
                                tw * (sign * nx)};
        for (int k = 0; k < 6; ++k) {
          std::int64_t units;
          round_to(term[k] / kDiskUnit, units);
          block.accumulate(arrays.block + k * n, n, grain[side], units);
        }
      }
    }

    // ---- in space -------------------------------------------------------------------------------

    static constexpr double kSphereUnit = 0x1p-40, kInertia = GrainShape<Config::D>::inertia;

    RVE_INLINE double in_space() const
    {
      const int n = call.num_grains;
      const double of_pair = of_lightest_spheres();
      add_contacts();
      block.for_each(n, [&](Item i) {
        double sum[2];
        for (int part = 0; part < 2; ++part) {
          double a[6];
          for (int k = 0; k < 6; ++k)
            a[k] = kSphereUnit *
                static_cast<double>(block.collect(arrays.block + (6 * part + k) * n, n, i));
          // The components are xx, xy, xz, yy, yz, zz.
          const double q = (a[0] + a[3] + a[5]) * (1.0 / 3.0);
          const double x = a[0] - q, y = a[3] - q, z = a[5] - q;
          const double squares =
              (x * x + y * y + z * z) + 2.0 * (a[1] * a[1] + a[2] * a[2] + a[4] * a[4]);
          sum[part] = q + 2.0 * std::sqrt(squares * (1.0 / 6.0));
        }
        arrays.value[i] = 2.0 * (sum[0] + sum[1] / kInertia) * inverse_mass(radius(i));
      });
      return larger(block.max_array(n, arrays.value), of_pair);
    }

    /// Returns the mass of a grain of radius one divided by the mass of a grain of radius r.
    static RVE_INLINE double inverse_mass(double r) { return 1.0 / times_power<Config::D>(1.0, r); }

    /// Returns the bound for a contact of two of the lightest grains: for motion along the normal,
    /// and for tangential motion with lever arms of one radius. Rolling is fastest on a large
    /// partner, where only the light grain rotates. In twisting both grains rotate. The function
    /// also clears the sums.
    RVE_INLINE double of_lightest_spheres() const
    {
      const int n = call.num_grains;
      const double coming_deep = coming_overlap();
      block.for_each(n, [&](Item i) {
        arrays.value[i] = inverse_mass(radius(i));
        for (int k = 0; k < 12; ++k) Block::begin_sum(arrays.block + k * n, n, i);
      });
      const double lightest = block.max_array(n, arrays.value);
      block.for_each(n, [&](Item i) { arrays.value[i] = 1.0 / radius(i); });
      const double smallest = 1.0 / block.max_array(n, arrays.value);
      const ContactModuli coming = relative_moduli({coming_deep, smallest, smallest});
      const double turning =
          larger(2.0 * (1.0 + 1.0 / kInertia) * coming.tangential + coming.rolling / kInertia,
                 0.5 / kInertia * coming.twisting);
      return lightest * larger(2.0 * coming.normal, turning);
    }

    template <class Real>
    RVE_INLINE void add_contact(int first, int second, const ContactGeometry<Real, 3> &contact,
                                const ContactModuli &moduli) const
    {
      const auto normal = contact.normal.template as<double>();
      const double overlap = static_cast<double>(contact.overlap);
      const int grain[2] = {first, second}, n = call.num_grains;
      for (int side = 0; side < 2; ++side) {
        const double r = radius(grain[side]), other_r = radius(grain[1 - side]);
        // Rotations are expressed as surface displacements: lever arm and reduced radius are
        // divided by the radius.
        const double arm = 1.0 - 0.5 * (overlap / r), share = other_r / (r + other_r);
        const double turning = arm * arm * moduli.tangential + share * share * moduli.rolling;
        const double twisting = share * share * moduli.twisting;
        int k = 0;
        for (int a = 0; a < 3; ++a)
          for (int b = a; b < 3; ++b, ++k) {
            const double nn = normal[a] * normal[b], across = (a == b ? 1.0 : 0.0) - nn;
            std::int64_t translation, rotation;
            round_to((moduli.normal * nn + moduli.tangential * across) / kSphereUnit, translation);
            round_to((turning * across + twisting * nn) / kSphereUnit, rotation);
            block.accumulate(arrays.block + k * n, n, grain[side], translation);
            block.accumulate(arrays.block + (6 + k) * n, n, grain[side], rotation);
          }
      }
    }
  };

  /// Returns the bound of the largest eigenvalue. In the plane the bound is not improved further
  /// once it is below `sufficient`.
  template <class Block, class Config>
  RVE_COLD double bound_eigenvalue(Block block, const CallState<Config> &call, int step_number,
                                   ModuliKind kind, double largest, BoundArrays arrays,
                                   double sufficient)
  {
    const EigenvalueBound<Block, Config> bound{
        block,
        call,
        step_constants<Config>(call.law, call.planned(step_number)),
        law_of_script(call),
        kind,
        largest,
        arrays};
    if constexpr (Config::D == 2)
      return bound.in_plane(sufficient);
    else
      return bound.in_space();
  }

  /// Stores a lower bound of the stable time step as the first number of detail.stiffness. In the
  /// plane the bound is not improved further once it is above the dt of the prescribed motion.
  template <class Block, class Config>
  RVE_COLD void bound_time_step(Block block, const CallState<Config> &call, int step_number,
                                DetailRecord<Config::D> &detail)
  {
    const StateHeader<Config::D> &header = call.header;
    const int n = call.num_grains;
    Carver spare(spare_of(call.work));
    BoundArrays arrays;
    spare.take(arrays.block, (Config::D == 2 ? 6 : 12) * n);
    take_each(spare, n, arrays.weight, arrays.value);
    const double length = call.units.length;
    const double per_mass = 1.0 / times_power<Config::D>(call.mass_factor, length);
    const double gain = 1.0 + header.material.local_damping, enough = call.drive.dt;
    // The margin covers the rounding of directions to the number format.
    constexpr double kMargin = 1.0 + 1e-5;
    const auto eigenvalue = [&](ModuliKind kind, double sufficient) {
      // Moduli grow with overlaps and radii, so that the largest one belongs to two of the largest
      // grains whose overlap is their diameter.
      const double radius = header.largest_radius;
      const double largest =
          moduli_at(law_of_script(call), kind, 1.0, {2.0 * radius, radius, radius}).largest();
      if (!(largest > 0.0)) return 0.0;
      const double unit = kMargin * (largest * per_mass);
      return unit *
          bound_eigenvalue(block, call, step_number, kind, largest, arrays, sufficient / unit);
    };
    const double dashpot_rate = eigenvalue(ModuliKind::Dashpots, 0.0);
    // By leapfrog_bound(), a step `enough` is stable if 4/enough >= b + sqrt(b^2 + 4 gain w^2),
    // with w^2 = frequency_squared.
    const double rate = 4.0 / enough, b = gain * dashpot_rate;
    const double sufficient = rate > b ? rate * (rate - 2.0 * b) / (4.0 * gain) : 0.0;
    const double frequency_squared = eigenvalue(ModuliKind::Springs, sufficient);
    block.once([&] {
      detail.stiffness[0] =
          leapfrog_bound(frequency_squared, dashpot_rate, header.material.local_damping);
    });
  }

}    // namespace RVE_ISA
}    // namespace rve
