// SPDX-License-Identifier: GPL-2.0-only
// Frequencies of contact networks. A contact of two disks i and j couples six coordinates: (x, y,
// w) of each disk, where w = r theta is the rotation as a surface displacement. All coordinates are
// then lengths, and the rotational mass is I/r^2 = m/2. The normal, tangential and rolling
// stretches of a contact are
//     u_n = (u_j - u_i).n,    u_t = (u_j - u_i).t - (a_i/r_i) w_i - (a_j/r_j) w_j,
//     u_r = (R/r_j) w_j - (R/r_i) w_i,
// with the displacement u_i of disk i, the normal n, the tangent t, the lever arm a = r - overlap/2
// and the reduced radius R = r_i r_j / (r_i + r_j). Two spheres have twelve coordinates, and the
// rotational mass is 2 m/5. The normal stretch u_n is the same as for disks, u_t and u_r are
// vectors across n, and u_q is the twist about n. With across(v) = v - (v.n) n:
//     u_t = across(u_j - u_i) - ((a_i/r_i) w_i + (a_j/r_j) w_j) x n,
//     u_r = d x n,    u_q = d.n,    d = (R/r_j) w_j - (R/r_i) w_i.

#include "rve/engine/stability.h"

#include "rve/core/error.h"
#include "rve/engine/contact_laws.h"
#include "rve/engine/contact_network.h"
#include "rve/physics/grain_shape.h"
#include "rve/physics/integrator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

namespace rve {

namespace {

  // Elements of a contact: springs or dashpots. The energy of the springs and the power of the
  // dashpots are quadratic forms of the same stretches, so the same code works for both.
  enum class Kind { Springs, Dashpots };

  struct Moduli {
    std::vector<ContactModuli> of_contact;    // in the order of the contacts
    // Returns the moduli of a contact that can form between grains of two radii. Its overlap is the
    // larger of `coming_overlap` and the largest present overlap. If both are zero, it is
    // kGasOverlapShare times the mean radius.
    std::function<ContactModuli(double, double)> coming;
  };

  template <int D>
  Moduli moduli(const RveStateOf<D> &state, const std::vector<TouchingPairOf<D>> &contacts,
                Kind kind, double coming_overlap = 0.0)
  {
    return with_law<D>(state.material, [&](const auto &law) {
      const auto moduli_at = [law, kind](const ContactSite &site) {
        ContactModuli moduli = kind == Kind::Springs ? law.stiffness(site) : law.viscosity(site);
        // Where an attraction decreases with the distance, the normal stiffness is negative. A
        // negative stiffness can only lower frequencies, so it is replaced by zero.
        moduli.normal = std::max(moduli.normal, 0.0);
        return moduli;
      };
      Moduli all;
      double overlap = coming_overlap;
      for (const TouchingPairOf<D> &contact : contacts) {
        all.of_contact.push_back(moduli_at(site_of(state, contact)));
        overlap = std::max(overlap, contact.overlap);
      }
      if (overlap == 0.0)
        overlap = kGasOverlapShare *
            std::accumulate(state.radius.begin(), state.radius.end(), 0.0) / state.num_grains();
      all.coming = [moduli_at, overlap](double r_i, double r_j) {
        return moduli_at({overlap, r_i, r_j});
      };
      return all;
    });
  }

  // Derivative of a stretch with respect to (x, y, w)_first and (x, y, w)_second.
  using Stretch = std::array<double, 6>;

  Stretch normal_stretch(const TouchingPair &contact)
  {
    const auto &n = contact.normal;
    return {-n[0], -n[1], 0.0, n[0], n[1], 0.0};
  }

  Stretch tangential_stretch(const RveState &state, const TouchingPair &contact)
  {
    const Vec<double, 2> t{{-contact.normal[1], contact.normal[0]}};
    const double arm_first = 1.0 - 0.5 * contact.overlap / state.radius[contact.first];
    const double arm_second = 1.0 - 0.5 * contact.overlap / state.radius[contact.second];
    return {-t[0], -t[1], -arm_first, t[0], t[1], -arm_second};
  }

  Stretch rolling_stretch(const RveState &state, const TouchingPair &contact)
  {
    const double first = state.radius[contact.first], second = state.radius[contact.second];
    // The factors are R/r of each grain.
    return {0.0, 0.0, -second / (first + second), 0.0, 0.0, first / (first + second)};
  }

  template <int D> double grain_mass(const RveStateOf<D> &state, int i)
  {
    return times_power<D>(state.material.density * state.material.mass_depth *
                              GrainShape<D>::volume,
                          state.radius[i]);
  }

  std::size_t coordinate(const TouchingPair &contact, int k)
  {
    return k < 3 ? std::size_t(3) * contact.first + k : std::size_t(3) * contact.second + (k - 3);
  }

  // The operator M^-1/2 K M^-1/2 as a sum over contacts.
  template <int D> class NetworkOperator;

  template <> class NetworkOperator<2> {
   public:
    NetworkOperator(const RveState &state, const std::vector<TouchingPair> &_contacts,
                    const std::vector<ContactModuli> &_moduli) :
        contacts(_contacts),
        moduli(_moduli)
    {
      const bool rolls = std::any_of(moduli.begin(), moduli.end(),
                                     [](const ContactModuli &of) { return of.rolling > 0.0; });
      for (int i = 0; i < state.num_grains(); ++i) {
        const double m = grain_mass(state, i);
        for (const double mass : {m, m, 0.5 * m})
          inverse_root_mass.push_back(1.0 / std::sqrt(mass));
      }
      for (const TouchingPair &contact : contacts) {
        normal.push_back(normal_stretch(contact));
        tangential.push_back(tangential_stretch(state, contact));
        if (rolls) rolling.push_back(rolling_stretch(state, contact));
      }
    }

    std::size_t size() const { return inverse_root_mass.size(); }

    void apply(const std::vector<double> &x, std::vector<double> &y) const
    {
      std::fill(y.begin(), y.end(), 0.0);
      for (std::size_t c = 0; c < contacts.size(); ++c) {
        double u_n = 0.0, u_t = 0.0;
        for (int k = 0; k < 6; ++k) {
          const std::size_t dof = coordinate(contacts[c], k);
          const double u = inverse_root_mass[dof] * x[dof];
          u_n += normal[c][k] * u;
          u_t += tangential[c][k] * u;
        }
        const double f_n = moduli[c].normal * u_n;
        const double f_t = moduli[c].tangential * u_t;
        for (int k = 0; k < 6; ++k) {
          const std::size_t dof = coordinate(contacts[c], k);
          y[dof] += inverse_root_mass[dof] * (normal[c][k] * f_n + tangential[c][k] * f_t);
        }
        if (!rolling.empty()) apply_rolling(c, x, y);
      }
    }

   private:
    const std::vector<TouchingPair> &contacts;
    const std::vector<ContactModuli> &moduli;
    std::vector<double> inverse_root_mass;
    std::vector<Stretch> normal, tangential;
    std::vector<Stretch> rolling;    // empty without rolling resistance

    void apply_rolling(std::size_t c, const std::vector<double> &x, std::vector<double> &y) const
    {
      constexpr int ROTATIONS[] = {2, 5};
      double u_r = 0.0;
      for (const int k : ROTATIONS) {
        const std::size_t dof = coordinate(contacts[c], k);
        u_r += rolling[c][k] * inverse_root_mass[dof] * x[dof];
      }
      for (const int k : ROTATIONS) {
        const std::size_t dof = coordinate(contacts[c], k);
        y[dof] += inverse_root_mass[dof] * rolling[c][k] * moduli[c].rolling * u_r;
      }
    }
  };

  template <> class NetworkOperator<3> {
   public:
    NetworkOperator(const RveStateOf<3> &state, const std::vector<TouchingPairOf<3>> &_contacts,
                    const std::vector<ContactModuli> &_moduli) :
        contacts(_contacts),
        moduli(_moduli)
    {
      for (int i = 0; i < state.num_grains(); ++i) {
        const double m = grain_mass(state, i);
        inverse_root_mass.push_back(
            {1.0 / std::sqrt(m), 1.0 / std::sqrt(GrainShape<3>::inertia * m)});
      }
      for (const TouchingPairOf<3> &contact : contacts) {
        const double first = state.radius[contact.first], second = state.radius[contact.second];
        arms.push_back({LeverArms{1.0 - 0.5 * contact.overlap / first, second / (first + second)},
                        LeverArms{1.0 - 0.5 * contact.overlap / second, first / (first + second)}});
      }
    }

    std::size_t size() const { return 6 * inverse_root_mass.size(); }

    void apply(const std::vector<double> &x, std::vector<double> &y) const
    {
      std::fill(y.begin(), y.end(), 0.0);
      for (std::size_t c = 0; c < contacts.size(); ++c) {
        const Vec<double, 3> &n = contacts[c].normal;
        const Displacement one = displacement(x, contacts[c].first),
                           other = displacement(x, contacts[c].second);
        const auto &[of_one, of_other] = arms[c];

        const Vec<double, 3> approach = other.site - one.site;
        const Vec<double, 3> surface = of_one.contact * one.turn + of_other.contact * other.turn;
        const double along = dot(approach, n);
        const Vec<double, 3> shear = (approach - along * n) - cross(surface, n);
        const Vec<double, 3> turning = of_other.rolling * other.turn - of_one.rolling * one.turn;
        const double twist = dot(turning, n);

        const Vec<double, 3> force = (moduli[c].normal * along) * n + moduli[c].tangential * shear;
        const Vec<double, 3> moment = -moduli[c].tangential * cross(n, shear);
        const Vec<double, 3> resistance =
            moduli[c].rolling * (turning - twist * n) + (moduli[c].twisting * twist) * n;
        add(y, contacts[c].first, -1.0 * force,
            of_one.contact * moment - of_one.rolling * resistance);
        add(y, contacts[c].second, force,
            of_other.contact * moment + of_other.rolling * resistance);
      }
    }

   private:
    struct InverseRootMass {
      double translation, rotation;
    };
    // Lever arms over the radius: the distance to the contact, and the reduced radius.
    struct LeverArms {
      double contact, rolling;
    };
    struct Displacement {
      Vec<double, 3> site, turn;
    };

    const std::vector<TouchingPairOf<3>> &contacts;
    const std::vector<ContactModuli> &moduli;
    std::vector<InverseRootMass> inverse_root_mass;
    std::vector<std::array<LeverArms, 2>> arms;

    Displacement displacement(const std::vector<double> &x, int i) const
    {
      const double *of = &x[6 * static_cast<std::size_t>(i)];
      return {inverse_root_mass[i].translation * Vec<double, 3>{{of[0], of[1], of[2]}},
              inverse_root_mass[i].rotation * Vec<double, 3>{{of[3], of[4], of[5]}}};
    }

    void add(std::vector<double> &y, int i, const Vec<double, 3> &force,
             const Vec<double, 3> &moment) const
    {
      double *of = &y[6 * static_cast<std::size_t>(i)];
      for (int a = 0; a < 3; ++a) {
        of[a] += inverse_root_mass[i].translation * force[a];
        of[3 + a] += inverse_root_mass[i].rotation * moment[a];
      }
    }
  };

  // Returns the number of eigenvalues of a symmetric tridiagonal matrix below x (Sturm sequence).
  int eigenvalues_below(const std::vector<double> &diagonal, const std::vector<double> &off,
                        double x)
  {
    int count = 0;
    double pivot = 1.0;
    for (std::size_t k = 0; k < diagonal.size(); ++k) {
      const double coupling = k == 0 ? 0.0 : off[k - 1] * off[k - 1] / pivot;
      pivot = diagonal[k] - x - coupling;
      if (pivot == 0.0) pivot = -std::numeric_limits<double>::min();
      if (pivot < 0.0) ++count;
    }
    return count;
  }

  // Returns the largest eigenvalue of a symmetric tridiagonal matrix, by bisection to round-off.
  double largest_eigenvalue(const std::vector<double> &diagonal, const std::vector<double> &off)
  {
    const int n = static_cast<int>(diagonal.size());
    double low = diagonal[0], high = diagonal[0];
    for (int k = 0; k < n; ++k) {
      const double reach =
          (k > 0 ? std::fabs(off[k - 1]) : 0.0) + (k + 1 < n ? std::fabs(off[k]) : 0.0);
      low = std::max(low, diagonal[k]);
      high = std::max(high, diagonal[k] + reach);
    }
    // For numbers that are not finite the interval would never become small.
    require(std::isfinite(low) && std::isfinite(high),
            "the largest eigenvalue of the contact network lies between ", low, " and ", high,
            " [1/time^2]; it must be finite");
    while (true) {
      const double middle = 0.5 * (low + high);
      if (middle <= low || middle >= high) return high;
      (eigenvalues_below(diagonal, off, middle) == n ? high : low) = middle;
    }
  }

  double dot(const std::vector<double> &x, const std::vector<double> &y)
  {
    return std::inner_product(x.begin(), x.end(), y.begin(), 0.0);
  }

  // Lanczos' method with full reorthogonalisation, which is cheap for the small basis and makes
  // restarts unnecessary. A Ritz value approaches the eigenvalue from below, and its error falls
  // with the square of the residual. When the value changes by less than 1e-9 between successive
  // steps, the remaining error is much smaller than the margin of a time step.
  template <class Operator> double lanczos_largest_eigenvalue(const Operator &matrix)
  {
    constexpr double TOLERANCE = 1e-9;
    constexpr int STEADY_STEPS = 4;    // a single small change can be a plateau
    constexpr std::size_t MOST_STEPS = 300;

    const std::size_t n = matrix.size();
    std::vector<std::vector<double>> basis(1, std::vector<double>(n));
    // The start vector is pseudo-random, so that it is not orthogonal to a symmetric mode. It is
    // the same in every run.
    std::uint64_t pseudo_random = 0x9e3779b97f4a7c15u;
    for (double &x : basis[0]) {
      pseudo_random = pseudo_random * 6364136223846793005u + 1442695040888963407u;
      x = static_cast<double>(pseudo_random >> 11) * 0x1p-53 - 0.5;
    }
    const double start = 1.0 / std::sqrt(dot(basis[0], basis[0]));
    for (double &x : basis[0]) x *= start;

    std::vector<double> diagonal, off, next(n);
    double largest = 0.0;
    int steady = 0;
    for (std::size_t step = 0; step < std::min(n, MOST_STEPS); ++step) {
      matrix.apply(basis[step], next);
      diagonal.push_back(dot(basis[step], next));
      for (int pass = 0; pass < 2; ++pass)    // two passes are enough (Kahan)
        for (const auto &q : basis) {
          const double projection = dot(q, next);
          for (std::size_t k = 0; k < n; ++k) next[k] -= projection * q[k];
        }
      const double previous = largest;
      largest = largest_eigenvalue(diagonal, off);
      steady = largest - previous <= TOLERANCE * largest ? steady + 1 : 0;
      const double norm = std::sqrt(dot(next, next));
      // With a zero norm the basis spans an invariant subspace, and the value is exact.
      const bool invariant = norm <= 1e-14 * largest;
      if (steady >= STEADY_STEPS || invariant) break;
      off.push_back(norm);
      basis.push_back(next);
      for (double &x : basis.back()) x /= norm;
    }
    return largest;
  }

  template <int D>
  double network_eigenvalue(const RveStateOf<D> &state,
                            const std::vector<TouchingPairOf<D>> &contacts, const Moduli &moduli)
  {
    const auto &all = moduli.of_contact;
    if (std::all_of(all.begin(), all.end(),
                    [](const ContactModuli &of) { return of.largest() == 0.0; }))
      return 0.0;
    return lanczos_largest_eigenvalue(NetworkOperator<D>(state, contacts, all));
  }

  // Returns the largest row sum of |M^-1 K| with r theta / 4 as the coordinate of a rotation. Any
  // positive factor instead of 1/4 would also give a bound; with 1/4 the row sums of rotations and
  // translations are similar.
  double gershgorin_eigenvalue(const RveState &state, const std::vector<TouchingPair> &contacts,
                               const Moduli &moduli)
  {
    constexpr double ROTATION_UNIT = 0.25;
    std::vector<std::array<double, 9>> own_block(state.num_grains(), std::array<double, 9>{});
    std::vector<double> coupling(3 * state.radius.size(), 0.0);
    for (std::size_t c = 0; c < contacts.size(); ++c) {
      const TouchingPair &contact = contacts[c];
      const ContactModuli &modulus = moduli.of_contact[c];
      const Stretch normal = normal_stretch(contact);
      const Stretch tangential = tangential_stretch(state, contact);
      const Stretch rolling = rolling_stretch(state, contact);
      for (int row = 0; row < 6; ++row)
        for (int column = 0; column < 6; ++column) {
          const double row_unit = row % 3 == 2 ? ROTATION_UNIT : 1.0;
          const double column_unit = column % 3 == 2 ? ROTATION_UNIT : 1.0;
          const double k = (modulus.normal * normal[row] * normal[column] +
                            modulus.tangential * tangential[row] * tangential[column] +
                            modulus.rolling * rolling[row] * rolling[column]) *
              row_unit / column_unit;
          const int grain = row < 3 ? contact.first : contact.second;
          if (row / 3 == column / 3)
            own_block[grain][3 * (row % 3) + column % 3] += k;
          else
            coupling[coordinate(contact, row)] += std::fabs(k);
        }
    }
    double largest = 0.0;
    for (int i = 0; i < state.num_grains(); ++i)
      for (int row = 0; row < 3; ++row) {
        double sum = coupling[3 * i + row];
        for (int column = 0; column < 3; ++column) sum += std::fabs(own_block[i][3 * row + column]);
        const double mass = row < 2 ? grain_mass(state, i) : 0.5 * grain_mass(state, i);
        largest = std::max(largest, sum / mass);
      }
    return largest;
  }

  // Returns the largest eigenvalue of one contact between the smallest grain and any other, with
  // the radii as lever arms; 0 without resistance to rolling and twisting. Let g_t and g_r be the
  // derivatives of u_t and u_r, divided by the square roots of the masses. The result is the larger
  // eigenvalue of k_t g_t g_t^T + k_r g_r g_r^T, where
  //     g_t.g_t = (1 + c) (1/m_i + 1/m_j),    g_r.g_r = c ((R/r_i)^2/m_i + (R/r_j)^2/m_j)
  // and c = m r^2/I. For spheres this holds for both directions across the normal. The twisting of
  // spheres is decoupled; if its eigenvalue is larger, it is the result. All partners of the
  // smallest grain are tried, since it rolls fastest against a large partner.
  template <int D> double turning_pair_eigenvalue(const RveStateOf<D> &state, const Moduli &moduli)
  {
    constexpr double ROTATION = 1.0 / GrainShape<D>::inertia;
    if (state.num_grains() < 2) return 0.0;
    const auto smallest = std::min_element(state.radius.begin(), state.radius.end());
    const int i = static_cast<int>(smallest - state.radius.begin());
    const double r_i = state.radius[i], m_i = grain_mass(state, i);
    double largest = 0.0;
    for (int j = 0; j < state.num_grains(); ++j) {
      if (j == i) continue;
      const double r_j = state.radius[j], m_j = grain_mass(state, j);
      const ContactModuli modulus = moduli.coming(r_i, r_j);
      if (modulus.rolling == 0.0 && modulus.twisting == 0.0) continue;
      // The shares are R/r of both grains.
      const double share_i = r_j / (r_i + r_j), share_j = r_i / (r_i + r_j);
      const double turning = ROTATION * (share_i * share_i / m_i + share_j * share_j / m_j);
      const double tt = (1.0 + ROTATION) * modulus.tangential * (1.0 / m_i + 1.0 / m_j);
      const double rr = modulus.rolling * turning;
      const double tr = ROTATION * std::sqrt(modulus.tangential * modulus.rolling) *
          (share_i / m_i - share_j / m_j);
      largest = std::max(largest, 0.5 * (tt + rr) + std::hypot(0.5 * (tt - rr), tr));
      largest = std::max(largest, modulus.twisting * turning);
    }
    return largest;
  }

  // Returns the largest eigenvalue of one contact of the lightest grains, with the radii as lever
  // arms: from 1/m_i + 1/m_j along the normal, and from 1/m + r^2/I of each grain along the
  // tangent.
  template <int D> double pair_eigenvalue(const RveStateOf<D> &state, const Moduli &moduli)
  {
    double lightest = std::numeric_limits<double>::infinity(), second = lightest;
    double smallest = lightest, next = lightest;    // radii of the two smallest grains
    for (int i = 0; i < state.num_grains(); ++i) {
      const double m = grain_mass(state, i), r = state.radius[i];
      second = std::min(second, std::max(m, lightest));
      lightest = std::min(lightest, m);
      next = std::min(next, std::max(r, smallest));
      smallest = std::min(smallest, r);
    }
    const ContactModuli modulus = moduli.coming(smallest, state.num_grains() > 1 ? next : smallest);
    constexpr double ALONG = 1.0 + 1.0 / GrainShape<D>::inertia;
    const double of_lightest =
        (1.0 / lightest + 1.0 / second) * std::max(modulus.normal, ALONG * modulus.tangential);
    return std::max(of_lightest, turning_pair_eigenvalue(state, moduli));
  }

  template <int D, class Eigenvalue>
  double time_step(const RveStateOf<D> &state, Eigenvalue &&network, double coming_overlap = 0.0)
  {
    state.check_sizes();    // otherwise eigenvalues might not be finite
    const std::vector<TouchingPairOf<D>> contacts = find_contacts(state);
    const auto largest = [&](Kind kind) {
      const Moduli all = moduli(state, contacts, kind, coming_overlap);
      return std::max(network(state, contacts, all), pair_eigenvalue(state, all));
    };
    return leapfrog_bound(largest(Kind::Springs), largest(Kind::Dashpots),
                          state.material.local_damping);
  }

}    // namespace

template <int D> double largest_frequency(const RveStateOf<D> &state)
{
  const std::vector<TouchingPairOf<D>> contacts = find_contacts(state);
  return std::sqrt(network_eigenvalue(state, contacts, moduli(state, contacts, Kind::Springs)));
}

template <int D> double pair_frequency(const RveStateOf<D> &state, double coming_overlap)
{
  return std::sqrt(
      pair_eigenvalue(state, moduli(state, find_contacts(state), Kind::Springs, coming_overlap)));
}

template <int D> double stable_time_step(const RveStateOf<D> &state)
{
  return time_step(state, network_eigenvalue<D>);
}

double gershgorin_time_step(const RveState &state, double coming_overlap)
{
  return time_step(state, gershgorin_eigenvalue, coming_overlap);
}

template double largest_frequency(const RveStateOf<2> &);
template double largest_frequency(const RveStateOf<3> &);
template double pair_frequency(const RveStateOf<2> &, double);
template double pair_frequency(const RveStateOf<3> &, double);
template double stable_time_step(const RveStateOf<2> &);
template double stable_time_step(const RveStateOf<3> &);

}    // namespace rve
