#include "sanitizer_batch.h"

#include "rve/engine/packing.h"

#include <algorithm>
#include <cstdio>
#include <stdexcept>
#include <string>

namespace bench {

namespace {

  using rve::Drive;
  using rve::Result;
  using rve::RveState;
  using rve::Tensor2;
  namespace status = rve::status;

  constexpr double TIME_STEP = 5e-5;    // [time]

  constexpr int FEW = 16;

  void expect(bool condition, const std::string &what)
  {
    if (!condition) throw std::runtime_error("the batch for the sanitizers: " + what);
  }

  Drive strained(double xx, double xy, double yy, int substeps)
  {
    Drive drive;
    drive.dt = TIME_STEP;
    drive.substeps = substeps;
    drive.deformation = Tensor2{{1.0 + xx, xy, 0.0, 1.0 + yy}};
    return drive;
  }

  Drive servo(const RveState &packing, int substeps)
  {
    Drive drive = strained(0.0, 0.0, 0.0, substeps);
    drive.controlled[0][0] = drive.controlled[1][1] = true;
    drive.stress_goal = -1e5 * Tensor2::identity();
    drive.velocity_gradient(0, 1) = 0.05;
    drive.servo_gain = rve::default_servo_gain(packing);
    return drive;
  }

  /// The same packing in a cell whose second vector leans by the whole first one: b' = b + a, s' = (s_0 - s_1, s_1).
  RveState leaning(RveState packing)
  {
    for (int a = 0; a < 2; ++a) packing.cell(a, 1) += packing.cell(a, 0);
    for (int i = 0; i < packing.num_grains(); ++i)
      packing.fractional[2 * i] -= packing.fractional[2 * i + 1];
    return packing;
  }

  /// The first call will find its forces much too large for the scale.
  RveState with_fine_force_scale(RveState packing)
  {
    packing.largest_contact_force = 1e-6;
    return packing;
  }

  RveState with_a_runaway(RveState packing)
  {
    const double width = packing.cell(0, 0);
    packing.velocity[0] = width / TIME_STEP;    // once through the cell in a step
    return packing;
  }

  /// Two disks apart in a square of four diameters.
  RveState two_disks(const RveState &packing)
  {
    RveState state;
    state.material = packing.material;
    const double r = packing.radius[0];
    state.radius = {r, r};
    state.cell = 8.0 * r * Tensor2::identity();
    state.velocity.assign(4, 0.0);
    state.spin.assign(2, 0.0);
    state.set_positions({2.0 * r, 4.0 * r, 6.0 * r, 4.0 * r});
    return state;
  }

  struct Visit {
    const char *what;
    RveState state;
    Drive drive;
    std::uint32_t expected;    ///< status
  };

  std::vector<Visit> visits(const RveState &packing, bool general)
  {
    std::vector<Visit> all = {
        {"shear with rebuilds", packing, strained(0.0, 0.03, 0.0, 30), status::Ok},
        {"a macro step with rotation", packing, strained(0.0, 0.04, 0.0, 5), status::Ok},
        {"lattice reduction", leaning(packing), strained(0.0, 1e-3, 0.0, 5), status::Ok},
        {"a force scale that is too fine", with_fine_force_scale(packing),
         strained(0.0, 1e-4, 0.0, 5), status::Ok},
        {"no step", packing, strained(0.0, 0.0, 0.0, 0), status::Ok},
        {"no contact", two_disks(packing), strained(0.0, 0.0, 0.0, 5), status::NoContacts},
        {"too large an overlap", packing, strained(0.0, 0.0, -0.6, 5), status::OverlapTooLarge},
        {"a grain that runs away", with_a_runaway(packing), strained(0.0, 0.0, 0.0, 5),
         status::Unstable},
        {"a cell that becomes too narrow", two_disks(packing), strained(0.0, 0.0, -0.7, 20),
         status::CellTooNarrow}};
    all[1].drive.deformation(1, 0) = -0.04;
    if (general) {
      RveState viscous = packing;
      viscous.material.normal_viscosity = viscous.material.tangential_viscosity = 1.0;
      all.push_back({"servo", packing, servo(packing, 20), status::Ok});
      all.push_back({"dashpots", viscous, strained(0.0, 1e-3, 0.0, 20), status::Ok});
    }
    if (packing.material.rolling_friction > 0.0) {
      RveState without = packing;    // in the same program
      without.material.rolling_friction = 0.0;
      all.push_back({"no resistance", without, strained(0.0, 1e-3, 0.0, 20), status::Ok});
    }
    return all;
  }

  void check(const Visit &visit, const Result &result)
  {
    const std::uint32_t seen = visit.expected == status::NoContacts ? result.status
                                                                    : result.status & status::Fatal;
    expect((seen & visit.expected) == visit.expected && (visit.expected || !seen),
           std::string(visit.what) + ": expected \"" + rve::describe_status(visit.expected) +
               "\", got \"" + rve::describe_status(result.status) + "\"");
  }

  /// All visits in one call, among ordinary RVEs so that there are `total`, with the long and with the short answer.
  void visit(rve::Options options, const RveState &packing, int total)
  {
    options.contacts = rve::contacts_of(packing);
    const auto engine = rve::make_engine(options);
    const std::vector<Visit> all = visits(packing, options.track_energy);
    std::vector<int> rves;
    std::vector<Drive> drives;
    for (const Visit &one : all) {
      rves.push_back(engine->add(one.state));
      drives.push_back(one.drive);
    }
    while (static_cast<int>(rves.size()) < total) {
      rves.push_back(engine->add(packing));
      drives.push_back(strained(0.0, 1e-4, 0.0, 1 + static_cast<int>(rves.size()) % 4));
    }
    std::vector<rve::Response> responses;
    engine->advance(rves, drives, responses);
    std::vector<Result> results;
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
      expect(results[k].status == status::Ok, "an ordinary RVE failed");
    if (packing.material.rolling_friction > 0.0) {
      const auto forces = engine->state(rves[0]).pairs;
      expect(std::any_of(forces.begin(), forces.end(),
                         [](const rve::Pair &pair) {
                           return pair.rolling_force != 0.0;
                         }),
             "no contact has a rolling force");
    }
    engine->add(engine->state(rves[0]));    // download and upload
    engine->remove(rves[1]);
  }

  /// A skin of a mean radius: more pairs than lists and workspaces are made for at first.
  void overflow(rve::Options options, const RveState &packing)
  {
    double sum = 0.0;
    for (const double r : packing.radius) sum += r;
    options.skin = 2.0 * sum / packing.num_grains();
    options.contacts = rve::contacts_of(packing);
    const auto engine = rve::make_engine(options);
    const std::vector<int> rves = {engine->add(packing), engine->add(packing),
                                   engine->add(packing)};
    std::vector<Result> results;
    engine->advance(rves, std::vector<Drive>(rves.size(), strained(0.0, 1e-3, 0.0, 5)), results);
    for (const Result &result : results) {
      expect(result.status == status::Ok,
             "lists that overflow: " + rve::describe_status(result.status));
      expect(result.counters.repeats > 0, "no list overflowed");
    }
  }

}    // namespace

void visit_all_paths(const rve::Options &options, const RveState &packing, int many,
                     const std::string &program)
{
  visit(options, packing, FEW);
  if (!options.track_energy) visit(options, packing, many);
  overflow(options, packing);
  std::printf("sanitize %s, block size %d, %s program: all paths taken\n",
              rve::to_string(options.format).c_str(), options.block_size, program.c_str());
  std::fflush(stdout);
}

}    // namespace bench
