// SPDX-License-Identifier: GPL-2.0-only
#include "sanitizer_batch.h"

#include "rve/engine/packing.h"

#include <algorithm>
#include <cstdio>
#include <stdexcept>
#include <string>

namespace bench {

namespace {

  using rve::DriveOf;
  using rve::ResultOf;
  using rve::RveStateOf;
  namespace status = rve::status;

  constexpr int FEW = 16;

  void expect(bool condition, const std::string &what)
  {
    if (!condition) throw std::runtime_error("the batch for the sanitizers: " + what);
  }

  /// Components of the strain increment of a call [-].
  struct Strain {
    double xx, xy, yy;
  };

  template <int D> DriveOf<D> strained(double time_step, const Strain &strain, int substeps)
  {
    DriveOf<D> drive;
    drive.dt = time_step;
    drive.substeps = substeps;
    drive.deformation(0, 0) += strain.xx;
    drive.deformation(0, 1) += strain.xy;
    drive.deformation(1, 1) += strain.yy;
    return drive;
  }

  template <int D> DriveOf<D> servo(const RveStateOf<D> &packing, double time_step, int substeps)
  {
    DriveOf<D> drive = strained<D>(time_step, {}, substeps);
    for (int a = 0; a < D; ++a) {
      drive.controlled[a][a] = true;
      drive.stress_goal(a, a) = -1e5;
    }
    drive.velocity_gradient(0, 1) = 0.05;
    drive.servo_gain = rve::default_servo_gain(packing);
    return drive;
  }

  /// Returns the same packing in another periodic cell. The second cell vector is b' = b + a, where
  /// a and b are the first two vectors. The fractional coordinates are s' = (s_0 - s_1, s_1).
  template <int D> RveStateOf<D> leaning(RveStateOf<D> packing)
  {
    for (int a = 0; a < D; ++a) packing.cell(a, 1) += packing.cell(a, 0);
    for (int i = 0; i < packing.num_grains(); ++i)
      packing.fractional[D * i] -= packing.fractional[D * i + 1];
    return packing;
  }

  /// Returns the packing with a force scale that is much too fine for its forces.
  template <int D> RveStateOf<D> with_fine_force_scale(RveStateOf<D> packing)
  {
    packing.largest_contact_force = 1e-6;
    return packing;
  }

  template <int D> RveStateOf<D> with_a_runaway(RveStateOf<D> packing, double time_step)
  {
    // in one step, the grain moves as far as the cell is wide
    packing.velocity[0] = packing.cell(0, 0) / time_step;
    return packing;
  }

  /// Returns two grains without contact in a square or cube of four diameters.
  template <int D> RveStateOf<D> two_grains(const RveStateOf<D> &packing)
  {
    RveStateOf<D> state;
    state.material = packing.material;
    const double r = packing.radius[0];
    state.radius = {r, r};
    state.cell = 8.0 * r * rve::Tensor<double, D>::identity();
    state.velocity.assign(2 * D, 0.0);
    state.spin.assign(2 * rve::Space<D>::spins, 0.0);
    std::vector<double> x(2 * D, 4.0 * r);
    x[0] = 2.0 * r;
    x[D] = 6.0 * r;
    state.set_positions(x);
    return state;
  }

  /// An RVE that takes one path of the engine, and the status that it must return.
  template <int D> struct Visit {
    const char *what;
    RveStateOf<D> state;
    DriveOf<D> drive;
    std::uint32_t expected;    ///< status
  };

  template <int D>
  std::vector<Visit<D>> visits(const RveStateOf<D> &packing, double dt, bool general, bool steered)
  {
    const auto small = strained<D>(dt, {0.0, 1e-3, 0.0}, 20);
    // The cell of few spheres is only a few grains wide. If the whole strain were along one axis,
    // the cell would become too narrow, so both x and y are compressed.
    const Strain crush = D == 2 ? Strain{0.0, 0.0, -0.6} : Strain{-0.4, 0.0, -0.4};
    std::vector<Visit<D>> all = {
        {"shear with rebuilds", packing, strained<D>(dt, {0.0, 0.03, 0.0}, 30), status::Ok},
        {"a macro step with rotation", packing, strained<D>(dt, {0.0, 0.04, 0.0}, 5), status::Ok},
        {"lattice reduction", leaning(packing), strained<D>(dt, {0.0, 1e-3, 0.0}, 5), status::Ok},
        {"a force scale that is too fine", with_fine_force_scale(packing),
         strained<D>(dt, {0.0, 1e-4, 0.0}, 5), status::Ok},
        {"no step", packing, strained<D>(dt, {}, 0), status::Ok},
        {"no contact", two_grains(packing), strained<D>(dt, {}, 5), status::NoContacts},
        {"too large an overlap", packing, strained<D>(dt, crush, 5), status::OverlapTooLarge},
        {"a grain that runs away", with_a_runaway(packing, dt), strained<D>(dt, {}, 5),
         status::Unstable},
        {"a cell that becomes too narrow", two_grains(packing),
         strained<D>(dt, {0.0, 0.0, -0.7}, 20), status::CellTooNarrow}};
    all[1].drive.deformation(1, 0) = -0.04;
    if (general || steered) all.push_back({"servo", packing, servo(packing, dt, 20), status::Ok});
    if (general) {
      RveStateOf<D> viscous = packing;
      viscous.material.normal_viscosity = 1.0;
      if (packing.material.law == rve::ContactLaw::Linear)
        viscous.material.tangential_viscosity = 1.0;
      all.push_back({"dashpots", viscous, small, status::Ok});
    }
    if (packing.material.rolling_friction > 0.0) {
      RveStateOf<D> without = packing;    // runs in the same kernel variant
      without.material.rolling_friction = 0.0;
      all.push_back({"no resistance", without, small, status::Ok});
    }
    return all;
  }

  template <int D> void check(const Visit<D> &visit, const ResultOf<D> &result)
  {
    const std::uint32_t seen = visit.expected == status::NoContacts ? result.status
                                                                    : result.status & status::Fatal;
    expect((seen & visit.expected) == visit.expected && (visit.expected || !seen),
           std::string(visit.what) + ": expected \"" + rve::describe_status(visit.expected) +
               "\", got \"" + rve::describe_status(result.status) + "\"");
  }

  bool has_rolled(const rve::Pair &pair)
  {
    return pair.rolling_force != 0.0;
  }

  bool has_rolled(const rve::PairOf<3> &pair)
  {
    return dot(pair.rolling_force, pair.rolling_force) > 0.0 && pair.twisting_moment != 0.0;
  }

  /// Advances the RVEs of all visits together, in two successive calls. The first call returns
  /// ResponseOf<D>, the short result, and the second returns ResultOf<D>. Other RVEs are added
  /// until a call has `total` RVEs. With `light_company`, they are pairs of grains; otherwise they
  /// are packings.
  template <int D>
  void visit(rve::Options options, const RveStateOf<D> &packing, double time_step, int total,
             bool light_company, bool steered)
  {
    options.contacts = rve::contacts_of(packing);
    const auto engine = rve::make_engine<D>(options);
    const std::vector<Visit<D>> all = visits(packing, time_step, options.track_energy, steered);
    std::vector<int> rves;
    std::vector<DriveOf<D>> drives;
    for (const Visit<D> &one : all) {
      rves.push_back(engine->add(one.state));
      drives.push_back(one.drive);
    }
    while (static_cast<int>(rves.size()) < total) {
      rves.push_back(engine->add(light_company ? two_grains(packing) : packing));
      drives.push_back(
          strained<D>(time_step, {0.0, 1e-4, 0.0}, 1 + static_cast<int>(rves.size()) % 4));
    }
    std::vector<rve::ResponseOf<D>> responses;
    engine->advance(rves, drives, responses);
    std::vector<ResultOf<D>> results;
    engine->advance(rves, drives, results);
    for (std::size_t k = 0; k < all.size(); ++k) {
      check(all[k], results[k]);
      expect(all[k].expected != status::Ok || results[k].status == responses[k].status,
             std::string(all[k].what) + ": the two calls differ in status");
    }
    expect(results[0].counters.rebuilds > 1, "no rebuild in a call");
    expect(results[2].counters.lattice_reductions > 0, "no lattice reduction");
    expect(results[3].counters.repeats > 0, "no call was repeated for its force scale");
    for (std::size_t k = all.size(); k < rves.size(); ++k)
      expect(results[k].status == (light_company ? status::NoContacts : status::Ok),
             "an ordinary RVE failed");
    if (packing.material.rolling_friction > 0.0) {
      const auto forces = engine->state(rves[0]).pairs;
      expect(std::any_of(forces.begin(), forces.end(),
                         [](const rve::PairOf<D> &pair) { return has_rolled(pair); }),
             "no contact has a rolling force");
    }
    engine->add(engine->state(rves[0]));    // tests download and upload
    engine->remove(rves[1]);
  }

  /// Runs RVEs whose skin is the mean diameter. Their neighbor lists are longer than the capacity
  /// that is allocated first. The device memory of each block for what does not fit in shared
  /// memory is also too small.
  template <int D>
  void overflow(rve::Options options, const RveStateOf<D> &packing, double time_step)
  {
    double sum = 0.0;
    for (const double r : packing.radius) sum += r;
    options.skin = 2.0 * sum / packing.num_grains();
    options.contacts = rve::contacts_of(packing);
    const auto engine = rve::make_engine<D>(options);
    const std::vector<int> rves = {engine->add(packing), engine->add(packing),
                                   engine->add(packing)};
    std::vector<ResultOf<D>> results;
    engine->advance(
        rves, std::vector<DriveOf<D>>(rves.size(), strained<D>(time_step, {0.0, 1e-3, 0.0}, 5)),
        results);
    for (const ResultOf<D> &result : results) {
      expect(result.status == status::Ok,
             "lists that overflow: " + rve::describe_status(result.status));
      expect(result.counters.repeats > 0, "no list overflowed");
    }
  }

}    // namespace

template <int D>
void visit_all_paths(const rve::Options &options, const RveStateOf<D> &packing, double time_step,
                     const Company &company, const std::string &variant)
{
  const bool steered = variant == "steered";
  if (company.few) visit(options, packing, time_step, FEW, company.is_light, steered);
  if (company.many > 0) visit(options, packing, time_step, company.many, company.is_light, steered);
  overflow(options, packing, time_step);
  std::printf("sanitize %s, block size %d, %s program%s: all paths taken\n",
              rve::to_string(options.format).c_str(), options.block_size, variant.c_str(),
              D == 3 ? " of spheres" : "");
  std::fflush(stdout);
}

template void visit_all_paths(const rve::Options &, const RveStateOf<2> &, double, const Company &,
                              const std::string &);
template void visit_all_paths(const rve::Options &, const RveStateOf<3> &, double, const Company &,
                              const std::string &);

}    // namespace bench
