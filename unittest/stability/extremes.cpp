// SPDX-License-Identifier: GPL-2.0-only
#include "stability/extremes.h"

#include "oracle/affine_stiffness.h"
#include "support/lattice.h"
#include "support/packings.h"
#include "support/rve_rig.h"
#include "support/spheres.h"

#include "rve/engine/contact_network.h"
#include "rve/engine/finite_strain.h"
#include "rve/engine/packing.h"
#include "rve/engine/stability.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace rve_test {

using namespace rve;

namespace {

  constexpr double RADIUS = 0.005;    // radius of grains in lattices [m]

  // Limit of the overlap divided by the smaller radius. It exceeds the default of 0.5, since the
  // scenes have overlaps of up to 0.3 diameters, which are 0.6 radii.
  constexpr double OVERLAP_LIMIT = 0.65;

  // ---- packings and lattices of disks and spheres -----------------------------------------------

  template <int D> Material grain_material()
  {
    return D == 2 ? paper_material() : spheres_material();
  }

  /// Returns 300 spheres as soft as the disks, with a mean overlap of half a per cent.
  RveStateOf<3> soft_spheres()
  {
    PackingRecipe recipe;
    recipe.material = spheres_material();
    recipe.material.normal_stiffness = recipe.material.tangential_stiffness = 1.5e5;
    recipe.pressure = 1e5;
    recipe.num_grains = 300;
    recipe.radius_min = 0.0025;
    recipe.radius_max = 0.005;
    Options options = sphere_options();
    const auto engine = make_engine<3>(options);
    return generate_packing(recipe, *engine);
  }

  /// Returns 400 disks or 300 spheres at rest at 100 kPa without tangential forces.
  template <int D> const RveStateOf<D> &packing()
  {
    static const RveStateOf<D> made = [] {
      if constexpr (D == 2)
        return paper_packing();
      else
        return soft_spheres();
    }();
    return made;
  }

  /// Returns 0.45 of the largest stable time step of packing() [s]. For disks this is the time step
  /// of the paper.
  template <int D> double time_step()
  {
    static const double step = D == 2 ? 5e-5 : 0.45 * stable_time_step(packing<D>());
    return step;
  }

  /// Returns the packing with halved radii and no contacts.
  template <int D> RveStateOf<D> gas()
  {
    RveStateOf<D> state = packing<D>();
    for (double &r : state.radius) r *= 0.5;
    return state;
  }

  /// Returns a triangular lattice of disks or a face-centred cubic lattice of spheres. `overlap` is
  /// the ratio of the overlap to the diameter.
  template <int D> RveStateOf<D> lattice(const Material &material, double overlap)
  {
    if constexpr (D == 2)
      return hexagonal_lattice(material, RADIUS, overlap * 2.0 * RADIUS);
    else
      return face_centred_cubic(material, 3, RADIUS, overlap * 2.0 * RADIUS);
  }

  template <int D> double exact_pressure(const Material &material, double overlap)
  {
    return D == 2 ? lattice_pressure(material, RADIUS, overlap * 2.0 * RADIUS)
                  : face_centred_pressure(material, RADIUS, overlap * 2.0 * RADIUS);
  }

  /// Returns the change of stress of a lattice under a small strain. The displacements of the
  /// grains are affine, since each grain is a centre of symmetry.
  Tensor2 stress_of_strain(const RveState &lattice, const Tensor2 &strain)
  {
    return affine_stiffness(lattice)(strain);
  }

  Tensor3 stress_of_strain(const Spheres &lattice, const Tensor3 &strain)
  {
    return SphereRig(lattice).stiffness().stiffness(strain);
  }

  template <int D> std::string words_for_lattice()
  {
    return D == 2 ? "a triangular lattice" : "a face-centred cubic lattice";
  }

  template <int D> void shake_grains(RveStateOf<D> &state, double speed, unsigned seed)
  {
    Random random(seed);
    constexpr int spins = Space<D>::spins;
    for (double &c : state.velocity) c = random.uniform(-speed, speed);
    for (int i = 0; i < spins * state.num_grains(); ++i)
      state.spin[i] = random.uniform(-speed, speed) / state.radius[i / spins];
  }

  template <int D> double mean_radius_of(const RveStateOf<D> &state)
  {
    double sum = 0.0;
    for (const double r : state.radius) sum += r;
    return sum / state.num_grains();
  }

  /// Returns a rotation by `angle`. In space, the axis of the rotation is oblique to the cell.
  template <int D> Tensor<double, D> turned(double angle)
  {
    if constexpr (D == 2)
      return plane_rotation(angle);
    else
      return spatial_rotation((angle / std::sqrt(14.0)) * Vec<double, 3>{{1.0, 2.0, 3.0}});
  }

  template <int D> void spin_all(RveStateOf<D> &state, double rate)
  {
    constexpr int spins = Space<D>::spins;
    for (int i = 0; i < spins * state.num_grains(); ++i)
      state.spin[i] = D == 2 ? rate : rate / std::sqrt(14.0) * (i % spins + 1);
  }

  // ---- drives -----------------------------------------------------------------------------------

  template <int D>
  DriveOf<D> straight(const Tensor<double, D> &deformation, double dt, int substeps)
  {
    DriveOf<D> drive;
    drive.dt = dt;
    drive.substeps = substeps;
    drive.deformation = deformation;
    return drive;
  }

  template <int D> DriveOf<D> hold(double dt, int substeps)
  {
    return straight(Tensor<double, D>::identity(), dt, substeps);
  }

  template <int D> Tensor<double, D> isotropic(double stretch)
  {
    return stretch * Tensor<double, D>::identity();
  }

  /// Returns the deformation gradient of an extension by `strain` along x and an equal compression
  /// along y.
  template <int D> Tensor<double, D> pure_shear(double strain)
  {
    auto deformation = Tensor<double, D>::identity();
    deformation(0, 0) += strain;
    deformation(1, 1) -= strain;
    return deformation;
  }

  template <int D> Tensor<double, D> simple_shear_by(double strain)
  {
    auto deformation = Tensor<double, D>::identity();
    deformation(0, 1) = strain;
    return deformation;
  }

  int share_of(double count, double length, int least)
  {
    return std::max(least, static_cast<int>(std::lround(count * length)));
  }

  // ---- contacts ---------------------------------------------------------------------------------

  /// Maps the grain numbers (low, high) of a pair to the tangential force on grain `low`.
  template <int D> using Histories = std::map<std::pair<int, int>, Vec<double, D>>;

  template <int D> Histories<D> histories_by_pair(const RveStateOf<D> &state)
  {
    Histories<D> all;
    for (const PairOf<D> &pair : state.pairs) {
      const bool in_order = pair.first < pair.second;
      const int low = in_order ? pair.first : pair.second,
                high = in_order ? pair.second : pair.first;
      if constexpr (D == 2) {
        const auto branch = branch_vector(state, low, high);
        const double length = std::hypot(branch[0], branch[1]);
        all[{low, high}] =
            (pair.tangential_force / length) * Vec<double, 2>{{-branch[1], branch[0]}};
      } else {
        all[{low, high}] = (in_order ? 1.0 : -1.0) * pair.tangential_force;
      }
    }
    return all;
  }

  template <int D>
  Vec<double, D> tangential_force(const Histories<D> &histories, const TouchingPairOf<D> &contact)
  {
    const auto found = histories.find({contact.first, contact.second});
    return found == histories.end() ? Vec<double, D>::zero() : found->second;
  }

  template <int D> double length_of(const Vec<double, D> &x)
  {
    return std::sqrt(dot(x, x));
  }

  /// Returns Love's stress. It finds the contacts on the host, without the engine's Verlet list.
  template <int D> Tensor<double, D> contact_stress(const RveStateOf<D> &state)
  {
    const Histories<D> histories = histories_by_pair(state);
    Tensor<double, D> sum = Tensor<double, D>::zero();
    for (const TouchingPairOf<D> &contact : find_contacts(state)) {
      const double f_n = state.material.normal_stiffness * contact.overlap;
      const Vec<double, D> force = tangential_force(histories, contact) - f_n * contact.normal;
      sum = sum + dyad(force, contact.branch);
    }
    return (1.0 / (state.cell_volume() * state.material.thickness)) * sum;
  }

  template <int D> double stress_error(const Trace<D> &trace, double pressure)
  {
    return norm(trace.last().stress - contact_stress(trace.end)) / pressure;
  }

  /// Returns the error of the final stress divided by the final pressure. If the packing has no
  /// contacts, the stress must be exactly zero.
  template <int D> double stress_error(const Trace<D> &trace)
  {
    const double pressure = trace.last().mean_stress();
    if (trace.last().num_contacts == 0) return norm(trace.last().stress) == 0.0 ? 0.0 : HUGE_VAL;
    return stress_error(trace, std::fabs(pressure));
  }

  const char *LOVE = "stress is the sum over contacts found anew";

  // ---- list of scenes ---------------------------------------------------------------------------

  template <int D> using Scenes = std::vector<Config<D>>;

  template <int D> void overlaps(Scenes<D> &scenes)
  {
    // The largest overlap of spheres is 0.25. At 0.3 their second neighbours would touch too.
    for (const double overlap : {1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, D == 2 ? 0.3 : 0.25}) {
      const RveStateOf<D> state = lattice<D>(grain_material<D>(), overlap);
      const double dt = 0.5 * stable_time_step(state);
      scenes.push_back({"overlap",
                        "overlap / diameter",
                        overlap,
                        "pressure of " + words_for_lattice<D>() + ", held for 1000 steps",
                        {1e-3, 1e-6, 1e-7},
                        state,
                        1,
                        [=](int) { return hold<D>(dt, 1000); },
                        [=](const Trace<D> &trace) {
                          const double exact = exact_pressure<D>(state.material, overlap);
                          return std::fabs(trace.last().mean_stress() / exact - 1.0);
                        },
                        {AdviceKind::SmallOverlap, AdviceKind::NoContacts}});
    }
  }

  template <int D> void stiffness_ratios(Scenes<D> &scenes)
  {
    for (const double ratio : {0.0, 0.1, 0.5, 1.0, 2.0}) {
      Material material = grain_material<D>();
      material.tangential_stiffness = ratio * material.normal_stiffness;
      material.friction = 10.0;    // no contact slides
      const RveStateOf<D> state = lattice<D>(material, 1e-3);
      const double dt = 0.5 * stable_time_step(state);
      const double strain = 2e-5;    // small, since terms of strain^2 are neglected
      scenes.push_back(
          {"stiffness ratio",
           "k_t / k_n",
           ratio,
           "stiffness of " + words_for_lattice<D>() + " in pure shear",
           {1e-2, D == 2 ? 1e-4 : 3e-4, 1e-4},    // 3e-4 of the change is 3e-6 of the pressure
           state,
           2,
           [=](int call) {
             return call ? hold<D>(dt, 2000) : straight(pure_shear<D>(strain), dt, 2000);
           },
           [=](const Trace<D> &trace) {
             const Tensor<double, D> expected =
                 stress_of_strain(state, pure_shear<D>(strain) - Tensor<double, D>::identity());
             return norm(trace.last().stress - trace.first().stress - expected) / norm(expected);
           }});
    }
  }

  template <int D> void frictions(Scenes<D> &scenes)
  {
    for (const double friction : {0.0, 0.1, 0.5, 1.0, 10.0}) {
      RveStateOf<D> state = packing<D>();
      state.material.friction = friction;
      scenes.push_back(
          {"friction",
           "friction coefficient",
           friction,
           "no contact is beyond Coulomb's cone, and " + std::string(LOVE),
           {1e-4, 1e-6, 1e-9},
           state,
           4,
           [](int) { return straight(simple_shear_by<D>(5e-3), time_step<D>(), 500); },
           [=](const Trace<D> &trace) {
             const Histories<D> history = histories_by_pair(trace.end);
             double mean = 0.0, excess = 0.0;
             const auto contacts = find_contacts(trace.end);
             for (const TouchingPairOf<D> &contact : contacts) {
               const double f_n = trace.end.material.normal_stiffness * contact.overlap;
               const double f_t = length_of(tangential_force(history, contact));
               mean += f_n / contacts.size();
               excess = std::max(excess, f_t - friction * f_n);
             }
             return std::max(excess / (std::max(friction, 1.0) * mean), stress_error(trace));
           }});
    }
  }

  template <int D> void size_ratios(Scenes<D> &scenes)
  {
    // The ratios for spheres are smaller than the ratios for disks. With larger ratios, too many
    // small spheres would touch the largest one.
    for (const double ratio : {1.0, 2.0, D == 2 ? 5.0 : 4.0, D == 2 ? 10.0 : 6.5}) {
      PackingRecipe recipe;
      recipe.material = grain_material<D>();
      recipe.pressure = 1e5;
      recipe.num_grains = 200;
      recipe.radius_max = 0.005;
      recipe.radius_min = 0.005 / ratio;
      const RveStateOf<D> state = loose_cloud<D>(recipe);
      const double solid = D == 2 ? 0.86 : 0.68;
      const double dt = 0.3 * stable_time_step(state);
      const double stretch =
          std::pow(state.solid_volume() / state.cell_volume() / solid, 1.0 / D / 20.0);
      scenes.push_back({"size ratio",
                        "largest / smallest radius",
                        ratio,
                        std::string(LOVE) + ", compressed from a cloud to solid fraction " +
                            (D == 2 ? "0.86" : "0.68"),
                        {1e-4, 1e-6, 1e-9},
                        state,
                        20,
                        [=](int) { return straight(isotropic<D>(stretch), dt, 500); },
                        [](const Trace<D> &trace) { return stress_error(trace); }});
    }
  }

  template <int D> void solid_fractions(Scenes<D> &scenes)
  {
    const std::vector<double> solids = D == 2
        ? std::vector<double>{0.3, 0.6, 0.8, 0.9, 1.0, 1.2, 1.6}
        : std::vector<double>{0.2, 0.4, 0.6, 0.7, 0.8, 1.0, 2.0};
    for (const double solid : solids) {
      const RveStateOf<D> state = gas<D>();
      const double now = state.solid_volume() / state.cell_volume();
      const double stretch = std::pow(now / solid, 1.0 / D / 50.0);
      Config<D> scene{"solid fraction",
                      "solid fraction",
                      solid,
                      std::string(LOVE) + ", compressed from a gas",
                      {1e-4, 1e-6, 1e-9},
                      state,
                      51,
                      [=](int call) {
                        return call < 50
                            ? straight(isotropic<D>(stretch), 0.5 * time_step<D>(), 100)
                            : hold<D>(0.5 * time_step<D>(), 1000);
                      },
                      [](const Trace<D> &trace) { return stress_error(trace); }};
      // In the last scene the engine must refuse a call, since small grains get into large ones.
      scene.must_refuse = scene.may_refuse = solid == solids.back();
      scenes.push_back(scene);
    }
  }

  template <int D> void time_steps(Scenes<D> &scenes)
  {
    RveStateOf<D> state = packing<D>();
    shake_grains(state, 0.1, 3);
    const double bound = stable_time_step(state);
    for (const double share : {1e-4, 1e-2, 0.3, 0.6, 0.9, 1.0, 1.1, 1.2}) {
      Config<D> scene{
          "time step",
          "time step / bound",
          share,
          "damped grains at random velocities gain no energy and, given time, come to rest",
          {1e-3, 1e-3, 1e-3},
          state,
          100,
          [=](int) { return hold<D>(share * bound, 100); },
          [=](const Trace<D> &trace) {
            const auto energy = [](const ResultOf<D> &r) {
              return r.kinetic_energy + r.elastic_energy;
            };
            double most = energy(trace.first());
            for (const ResultOf<D> &result : trace.results) most = std::max(most, energy(result));
            const double gain = (most - energy(trace.first())) / trace.first().kinetic_energy;
            // Grains need not come to rest with steps below a tenth of the bound. With a tenth of
            // the bound, a wave crosses the cell 20 times in the 10,000 steps; with shorter steps,
            // it crosses too few times.
            return share < 0.1 ? gain : std::max(gain, trace.last().unbalanced_ratio);
          },
          {AdviceKind::LongTimeStep}};
      scene.may_refuse = share > 1.0;
      scenes.push_back(scene);
    }
  }

  template <int D> void strain_rates(Scenes<D> &scenes, double length)
  {
    Material material = grain_material<D>();
    material.friction = 1.0;
    const RveStateOf<D> state = lattice<D>(material, 1e-2);
    const double dt = 0.5 * stable_time_step(state);
    for (const double rate : {1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0}) {
      const double rate_of_axis = rate / std::sqrt(2.0);    // norm of the strain rate: `rate`
      const int steps = static_cast<int>(std::clamp(
          2e-3 / (rate_of_axis * dt), 1.0, static_cast<double>(share_of(2e5, length, 2000))));
      Config<D> scene{"strain rate",
                      "strain rate [1/s]",
                      rate,
                      "sheared contacts add up further shear, k_t l strain each",
                      {2e-2, 1e-3, 1e-3},
                      state,
                      3,
                      [=](int call) {
                        if (call == 0) return straight(pure_shear<D>(1e-3), dt, 2000);
                        return call == 1
                            ? hold<D>(dt, 2000)
                            : straight(pure_shear<D>(rate_of_axis * steps * dt), dt, steps);
                      },
                      [=](const Trace<D> &trace) {
                        const Histories<D> before = histories_by_pair(trace.middle),
                                           after = histories_by_pair(trace.end);
                        const double strain = rate_of_axis * steps * dt;
                        const Tensor<double, D> eps =
                            pure_shear<D>(strain) - Tensor<double, D>::identity();
                        double error = 0.0, size = 0.0;
                        for (const TouchingPairOf<D> &contact : find_contacts(trace.middle)) {
                          const Vec<double, D> &n = contact.normal, stretched = eps * n;
                          const Vec<double, D> expected =
                              (material.tangential_stiffness * length_of(contact.branch)) *
                              (stretched - dot(n, stretched) * n);
                          // If the normal has single precision, the tangential force has a small
                          // component along the exact normal. This component is removed here.
                          const Vec<double, D> difference =
                              tangential_force(after, contact) - tangential_force(before, contact);
                          const Vec<double, D> change = difference - dot(n, difference) * n;
                          error += length_of(change - expected);
                          size += length_of(expected);
                        }
                        // The strain also rotates the normals, by up to 2e-3 rad. The resulting
                        // part of the error is subtracted.
                        return std::max(0.0, error / size - 4.0 * strain);
                      },
                      {AdviceKind::SlowStrain, AdviceKind::FastStrain}};
      scene.middle_call = 2;
      scenes.push_back(scene);
    }
  }

  template <int D> void static_hold(Scenes<D> &scenes, double length)
  {
    const int calls = share_of(2000, length, 1);
    scenes.push_back({"static hold",
                      "steps",
                      5000.0 * calls,
                      "pressure does not drift",
                      {1e-3, 1e-5, 1e-5},
                      packing<D>(),
                      calls,
                      [](int) { return hold<D>(time_step<D>(), 5000); },
                      [](const Trace<D> &trace) {
                        double worst = 0.0;
                        for (const ResultOf<D> &result : trace.results)
                          worst = std::max(
                              worst,
                              std::fabs(result.mean_stress() / trace.first().mean_stress() - 1.0));
                        return worst;
                      }});
  }

  template <int D> void simple_shear(Scenes<D> &scenes, double length)
  {
    // The shear rate is 0.2/s for disks and about 1/s for spheres. Both give an inertial number of
    // about 1e-3.
    const int calls = share_of(2000, length, 1);
    const double shear = D == 2 ? 5e-3 : 1e-3;    // strain per call; less for spheres to save time
    scenes.push_back({"simple shear",
                      "shear strain",
                      shear * calls,
                      std::string(LOVE) + "; F and area are exact",
                      {1e-4, 1e-6, 1e-9},
                      packing<D>(),
                      calls,
                      [=](int) { return straight(simple_shear_by<D>(shear), time_step<D>(), 500); },
                      [=](const Trace<D> &trace) {
                        const double f_xy = trace.last().deformation(0, 1) / (shear * calls) - 1.0;
                        const double area =
                            trace.end.cell_volume() / trace.start.cell_volume() - 1.0;
                        return std::max({stress_error(trace), std::fabs(f_xy), std::fabs(area)});
                      }});
  }

  template <int D> void compression_and_back(Scenes<D> &scenes)
  {
    const RveStateOf<D> state = packing<D>();
    const double dense = D == 2 ? 1.2 : 1.0, loose = D == 2 ? 0.5 : 0.4;
    const double solid = state.solid_volume() / state.cell_volume();
    const double down = std::pow(solid / dense, 1.0 / D / 25.0),
                 up = std::pow(dense / loose, 1.0 / D / 50.0);
    scenes.push_back(
        {"compression and back",
         "solid fraction",
         dense,
         std::string(LOVE) + ", then opened to " + (D == 2 ? "0.5" : "0.4") +
             "; no tension; the cell is exact",
         {1e-4, 1e-6, 1e-9},
         state,
         75,
         [=](int call) {
           return straight(isotropic<D>(call < 25 ? down : up), 0.5 * time_step<D>(), 200);
         },
         [=](const Trace<D> &trace) {
           double peak = 0.0, tension = 0.0;
           for (const ResultOf<D> &result : trace.results) {
             peak = std::max(peak, result.mean_stress());
             tension = std::max(tension, -result.mean_stress());
           }
           Trace<D> at_peak = trace;
           at_peak.end = trace.middle;
           at_peak.results.resize(26);
           const double area = trace.end.solid_volume() / trace.end.cell_volume() / loose - 1.0;
           return std::max(
               {stress_error(at_peak), stress_error(trace, peak), tension / peak, std::fabs(area)});
         },
         {},
         false,
         false,
         25});
  }

  // Errors of the stress in rotations, relative to the pressure: The cell moves along chords of its
  // circular path, which gives 1.7e-4 for disks and 6e-4 for spheres (doc/src/stability.rst). Spins
  // in single precision add less than 1e-6 per turn. The tangential forces of spheres are rotated
  // in each step. The steps of 8e-4 rad used here add 2e-6 per turn; steps of 8e-3 rad would add
  // 4e-4.
  template <int D> void rotations(Scenes<D> &scenes, double length)
  {
    const int steps_per_quarter = D == 2 ? 200 : 2000, quarters = 4 * share_of(1000, length, 1);
    const double rate = D == 2 ? 100.0
                               : 0.5 * M_PI / (steps_per_quarter * time_step<D>());    // [rad/s]
    const double dt = 0.5 * M_PI / rate / steps_per_quarter;
    const double added = D == 2 ? 0.0 : 5e-6 * quarters / 4;
    RveStateOf<D> state = packing<D>();
    spin_all(state, rate);
    scenes.push_back({"rotation",
                      "full turns",
                      quarters / 4.0,
                      "stress of a turning packing is that of the resting one",
                      {1e-3 + added, D == 2 ? 5e-4 : 1e-3 + added, D == 2 ? 2e-4 : 1e-3 + added},
                      state,
                      quarters,
                      [=](int) { return straight(turned<D>(0.5 * M_PI), dt, steps_per_quarter); },
                      [](const Trace<D> &trace) {
                        return norm(trace.last().stress - trace.first().stress) /
                            trace.first().mean_stress();
                      }});
  }

  template <int D> void cycles(Scenes<D> &scenes, double length)
  {
    // All contacts stick, so that a change of the stress after a cycle is an error of the
    // integrator.
    RveStateOf<D> state = packing<D>();
    state.material.friction = 10.0;
    const int count = share_of(10000, length, 20), settled = 10;
    const double shear = 1e-5;
    scenes.push_back({"cyclic loading",
                      "cycles",
                      static_cast<double>(count),
                      "elastic cycles of 1e-5 shear leave the stress as it was after the tenth",
                      {1e-3, 1e-5, 1e-5},
                      state,
                      4 * count,
                      [=](int call) {
                        const bool forth = call % 4 == 0 || call % 4 == 3;
                        return straight(simple_shear_by<D>(forth ? shear : -shear), time_step<D>(),
                                        25);
                      },
                      [=](const Trace<D> &trace) {
                        const ResultOf<D> &early = trace.results[4 * settled];
                        return norm(trace.last().stress - early.stress) / early.mean_stress();
                      }});
  }

  /// Converts the state to other units. `length`, `mass` and `time` are the sizes of the new units
  /// in old units.
  template <int D>
  RveStateOf<D> in_units(RveStateOf<D> state, double length, double mass, double time)
  {
    Material &m = state.material;
    m.normal_stiffness *= time * time / mass;
    m.tangential_stiffness *= time * time / mass;
    m.density *= length * length * length / mass;
    if (D == 2) {
      m.thickness /= length;
      m.mass_depth /= length;
    }
    state.cell = (1.0 / length) * state.cell;
    state.list_cell = (1.0 / length) * state.list_cell;
    for (double &r : state.radius) r /= length;
    for (PairOf<D> &pair : state.pairs)
      pair.tangential_force = (time * time / (mass * length)) * pair.tangential_force;
    state.largest_contact_force *= time * time / (mass * length);
    return state;    // velocities are zero in all units
  }

  template <int D> void sizes(Scenes<D> &scenes)
  {
    struct Units {
      double size, length, mass, time;
    };
    const RveStateOf<D> old = packing<D>();
    const double size = 2.0 * mean_radius_of(old);
    const Material &m = old.material;
    // In the first three cases the mean diameter is 1e-6, 1e-3 or 1 new units of length, and the
    // unit of mass is such that the density has its old value. In the last case the mean radius,
    // the mean mass of a grain and k_n are 1 in the new units.
    std::vector<Units> all;
    for (const double wanted : {1e-6, 1e-3, 1.0}) {
      const double length = size / wanted;
      all.push_back({wanted, length, length * length * length, 1.0});
    }
    const double mass = old.mass() / old.num_grains();
    all.push_back({2.0, 0.5 * size, mass, std::sqrt(mass / m.normal_stiffness)});
    for (const Units &units : all) {
      const auto drive = [](double dt) { return straight(simple_shear_by<D>(1e-3), dt, 500); };
      scenes.push_back(
          {"grain size and units",
           "mean diameter",
           units.size,
           units.time == 1.0
               ? "stress in the old units, after 0.2 % shear, is that of the old packing"
               : "the same with grain mass, radius and k_n for units",
           {1e-3, 1e-5, 1e-9},
           in_units(old, units.length, units.mass, units.time),
           2,
           [=](int) { return drive(time_step<D>() / units.time); },
           [=](const Trace<D> &trace) {
             Options options = cpu_options(trace.format);
             options.contacts = contacts_of(old);
             const auto engine = make_engine<D>(options);
             const int rve = engine->add(old);
             std::vector<ResultOf<D>> results;
             for (int call = 0; call < 2; ++call)
               engine->advance({rve}, {drive(time_step<D>())}, results);
             const Tensor<double, D> expected = results[0].stress;
             const double unit_of_stress = units.mass / (units.length * units.time * units.time);
             return norm(unit_of_stress * trace.last().stress - expected) /
                 results[0].mean_stress();
           }});
    }
  }

  // A collision begins and ends between two time steps, which changes its energy by a small random
  // amount. The relative error of the energy grows as the square root of the number of collisions,
  // from 1e-5 for a few collisions to 1e-3 for some ten thousand.
  template <int D> void few_grains(Scenes<D> &scenes, double length)
  {
    for (const int count : {2, 3, 10}) {
      Material material = grain_material<D>();
      material.local_damping = material.friction = 0.0;
      Random random(count);
      RveStateOf<D> state;
      state.material = material;
      std::vector<double> x;
      if constexpr (D == 2) {
        for (int i = 0; i < count; ++i) {
          state.radius.push_back(random.uniform(0.003, 0.005));
          x.insert(x.end(), {(i % 4 + 0.5) * 0.0125, (i / 4 + 0.5) * 0.0125});
        }
        state.cell = 0.05 * Tensor2::identity();
      } else {
        for (int i = 0; i < count; ++i) {
          state.radius.push_back(random.uniform(0.003, 0.005));
          x.insert(x.end(),
                   {(i % 2 + 0.5) * 0.0125, (i / 2 % 2 + 0.5) * 0.0125, (i / 4 + 0.5) * 0.0125});
        }
        state.cell = 0.025 * Tensor3::identity();
        state.cell(2, 2) = 0.0375;
      }
      state.velocity.assign(D * count, 0.0);
      state.spin.assign(Space<D>::spins * count, 0.0);
      state.set_positions(x);
      shake_grains(state, 1.0, count);
      std::fill(state.spin.begin(), state.spin.end(), 0.0);
      const double dt = 0.02 * stable_time_step(state);
      scenes.push_back(
          {"few grains",
           "grains",
           static_cast<double>(count),
           "a gas without friction and damping keeps energy and momentum",
           {1e-2, 1e-2, 1e-2},
           state,
           share_of(1000, length, 20),
           [=](int) { return hold<D>(dt, 1000); },
           [](const Trace<D> &trace) {
             const auto momentum = [](const RveStateOf<D> &s, int a) {
               double sum = 0.0;
               for (int i = 0; i < s.num_grains(); ++i)
                 sum += std::pow(s.radius[i], D) * s.velocity[D * i + a];
               return sum;
             };
             double size = 0.0;
             for (const double r : trace.start.radius) size += std::pow(r, D);
             const double energy = trace.first().kinetic_energy + trace.first().elastic_energy;
             double worst =
                 std::fabs(trace.last().kinetic_energy + trace.last().elastic_energy - energy) /
                 energy;
             for (int a = 0; a < D; ++a)
               worst = std::max(
                   worst, std::fabs(momentum(trace.end, a) - momentum(trace.start, a)) / size);
             return worst;
           }});
    }
  }

  template <int D> void large_steps(Scenes<D> &scenes)
  {
    const Tensor<double, D> deformations[] = {pure_shear<D>(0.3), simple_shear_by<D>(0.3),
                                              isotropic<D>(0.7)};
    const char *names[] = {"pure shear of 30 % in one call", "simple shear of 30 % in one call",
                           "compression of 30 % in one call"};
    for (int k = 0; k < 3; ++k)
      for (const int substeps : {1, 10, 100, 1000}) {
        const Tensor<double, D> deformation = deformations[k];
        Config<D> scene{names[k],
                        "substeps",
                        static_cast<double>(substeps),
                        std::string(LOVE) + ", or the RVE stays as it was",
                        {1e-4, 1e-6, 1e-9},
                        packing<D>(),
                        1,
                        [=](int) { return straight(deformation, 0.5 * time_step<D>(), substeps); },
                        [](const Trace<D> &trace) { return stress_error(trace); }};
        scene.may_refuse = true;
        scenes.push_back(scene);
      }
  }

  template <int D> void opening(Scenes<D> &scenes)
  {
    for (const double extension : {0.02, 0.05, 0.2}) {
      const double stretch = std::pow(1.0 + extension, 0.1);
      Config<D> scene{
          "opening and recompression",
          "extension of each axis",
          extension,
          "no stress when open; recompressed, " + std::string(LOVE),
          {1e-4, 1e-6, 1e-9},
          packing<D>(),
          31,
          [=](int call) {
            if (call >= 30) return hold<D>(time_step<D>(), 2000);
            return call < 10 ? straight(isotropic<D>(stretch), time_step<D>(), 500)
                : call < 20  ? hold<D>(time_step<D>(), 500)
                             : straight(isotropic<D>(1.0 / stretch), time_step<D>(), 500);
          },
          [](const Trace<D> &trace) {
            // In the open packing, collisions of moving grains are allowed to cause a pressure of
            // up to a thousandth of the initial pressure.
            const double open =
                std::max(0.0, norm(trace.results[20].stress) / trace.first().mean_stress() - 1e-3);
            return std::max(open, stress_error(trace, trace.first().mean_stress()));
          }};
      scenes.push_back(scene);
    }
  }

  // ---- verdicts ---------------------------------------------------------------------------------

  template <int D> struct Run {
    int number;    // number of the RVE in the engine
    double stable_dt;
    Trace<D> trace;
    std::vector<Advice> advice;    // first advice of each kind in Config::explained_by
    bool refused = false;
    bool untouched = true;    // false if the refused call changed the RVE
  };

  template <int D> void ask_for_advice(Run<D> &run, const Config<D> &scene, const DriveOf<D> &drive)
  {
    DriveRates motion;
    motion.dt = drive.dt;
    motion.stable_dt = run.stable_dt;
    motion.strain_rate = strain_size(drive.deformation) / (drive.substeps * drive.dt);
    motion.applied_strain = strain_size(run.trace.last().deformation);
    for (const Advice &advice :
         rve::advice(run.trace.format, run.trace.last(), scene.state.material, motion)) {
      const auto same_kind = [&](const Advice &other) { return other.kind == advice.kind; };
      const auto &kinds = scene.explained_by;
      if (std::find(kinds.begin(), kinds.end(), advice.kind) != kinds.end() &&
          std::none_of(run.advice.begin(), run.advice.end(), same_kind))
        run.advice.push_back(advice);
    }
  }

  template <int D> Finding<D> judge(const Config<D> &scene, const Run<D> &run)
  {
    const Trace<D> &trace = run.trace;
    Finding<D> finding{&scene,
                       trace.format,
                       Verdict::Silent,
                       std::numeric_limits<double>::quiet_NaN(),
                       "",
                       trace.last().counters.steps};
    if (run.refused) {
      finding.words = describe_status(trace.last().status);
      if (scene.may_refuse && run.untouched) finding.verdict = Verdict::Status;
      return finding;
    }
    finding.deviation = scene.deviation(trace);
    // The comparison is false for a deviation that is not a number.
    if (finding.deviation <= scene.limit[static_cast<int>(trace.format)] && !scene.must_refuse) {
      finding.verdict = Verdict::Holds;
    } else if (!run.advice.empty()) {
      finding.verdict = Verdict::Warned;
      finding.words = run.advice.front().message;
    }
    return finding;
  }

}    // namespace

const char *to_string(Verdict verdict)
{
  const char *words[] = {"holds", "status", "warned", "silent"};
  return words[static_cast<int>(verdict)];
}

template <int D> std::vector<Config<D>> extreme_scenes(double length)
{
  Scenes<D> scenes;
  overlaps(scenes);
  stiffness_ratios(scenes);
  frictions(scenes);
  size_ratios(scenes);
  solid_fractions(scenes);
  time_steps(scenes);
  strain_rates(scenes, length);
  static_hold(scenes, length);
  simple_shear(scenes, length);
  compression_and_back(scenes);
  rotations(scenes, length);
  cycles(scenes, length);
  sizes(scenes);
  few_grains(scenes, length);
  large_steps(scenes);
  opening(scenes);
  return scenes;
}

template <int D>
std::vector<Finding<D>> run_extremes(const std::vector<Config<D>> &scenes, Format format,
                                     Device device, std::string *engine_name)
{
  Options options;
  options.format = format;
  options.device = device;
  options.overlap_limit = OVERLAP_LIMIT;
  options.contacts.dimension = D;
  const auto engine = make_engine<D>(options);
  if (engine_name) *engine_name = engine->description();

  std::vector<Run<D>> runs(scenes.size());
  for (std::size_t k = 0; k < scenes.size(); ++k) {
    runs[k].number = engine->add(scenes[k].state);
    runs[k].stable_dt = stable_time_step(scenes[k].state);
    runs[k].trace.format = format;
    runs[k].trace.start = runs[k].trace.middle = engine->state(runs[k].number);
  }
  for (int call = -1;; ++call) {
    std::vector<std::size_t> active;
    std::vector<int> numbers;
    std::vector<DriveOf<D>> drives;
    for (std::size_t k = 0; k < scenes.size(); ++k) {
      if (call >= scenes[k].calls || runs[k].refused) continue;
      active.push_back(k);
      numbers.push_back(runs[k].number);
      drives.push_back(call < 0 ? hold<D>(1.0, 0) : scenes[k].drive(call));
    }
    if (active.empty()) break;
    std::vector<ResultOf<D>> results;
    engine->advance(numbers, drives, results);
    for (std::size_t m = 0; m < active.size(); ++m) {
      Run<D> &run = runs[active[m]];
      const Config<D> &scene = scenes[active[m]];
      run.refused = (results[m].status & status::Fatal) != 0;
      if (run.refused && call >= 0)
        run.untouched =
            components(engine->state(run.number).cell) == components(run.trace.last().cell) &&
            results[m].counters.steps == run.trace.last().counters.steps;
      run.trace.results.push_back(results[m]);
      if (run.refused) continue;
      if (call >= 0) ask_for_advice(run, scene, drives[m]);
      if (scene.middle_call > 0 && call == scene.middle_call - 1)
        run.trace.middle = engine->state(run.number);
    }
  }
  std::vector<Finding<D>> findings;
  for (std::size_t k = 0; k < scenes.size(); ++k) {
    runs[k].trace.end = engine->state(runs[k].number);
    findings.push_back(judge(scenes[k], runs[k]));
  }
  return findings;
}

template std::vector<Config<2>> extreme_scenes(double);
template std::vector<Config<3>> extreme_scenes(double);
template std::vector<Finding<2>> run_extremes(const std::vector<Config<2>> &, Format, Device,
                                              std::string *);
template std::vector<Finding<3>> run_extremes(const std::vector<Config<3>> &, Format, Device,
                                              std::string *);

}    // namespace rve_test
