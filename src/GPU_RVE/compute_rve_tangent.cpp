// SPDX-License-Identifier: GPL-2.0-only
/* ----------------------------------------------------------------------
   LAMMPS - Large-scale Atomic/Molecular Massively Parallel Simulator
   https://www.lammps.org/, Sandia National Laboratories
   LAMMPS development team: developers@lammps.org

   Copyright (2003) Sandia Corporation.  Under the terms of Contract
   DE-AC04-94AL85000 with Sandia Corporation, the U.S. Government retains
   certain rights in this software.  This software is distributed under
   the GNU General Public License.

   See the README file in the top-level LAMMPS directory.
------------------------------------------------------------------------- */

#include "compute_rve_tangent.h"

#include "atom.h"
#include "error.h"
#include "lammps/collective_error.h"
#include "lammps/rve_columns.h"
#include "lammps/rve_settings.h"
#include "macro/tangent_probes.h"
#include "rve/core/error.h"
#include "update.h"

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

using namespace LAMMPS_NS;

namespace {

/// The measured tangent of the RVE of an atom, and quantities derived from it.
template <int D> struct Probe {
  const macro::ProbedTangentOf<D> &probed;
  const macro::TangentNumbersOf<D> numbers;

  /// Returns the second-order work response : strain_rate for a strain of norm 1 [stress].
  double work() const
  {
    double sum = 0.0;
    for (int k = 0; k < D * D; ++k)
      sum += probed.response.component[k] * probed.strain_rate.component[k];
    return sum;
  }
};

using Quantity = ColumnOf<Probe>;

/// Returns all quantities: the components cijkl of the tangent in the plane, its other components,
/// and the quantities derived from the tangent.
std::vector<Quantity> all_quantities()
{
  struct Pair {
    const char *name;
    int a, b;
  };
  constexpr Pair PAIRS[] = {{"xx", 0, 0}, {"yy", 1, 1}, {"zz", 2, 2},
                            {"xy", 0, 1}, {"xz", 0, 2}, {"yz", 1, 2}};
  std::vector<Quantity> list;
  for (const bool in_plane : {true, false})
    for (const Pair &i : PAIRS)
      for (const Pair &k : PAIRS) {
        if ((std::max(i.b, k.b) < 2) != in_plane) continue;
        const auto component = [=](const auto &r) { return r.probed.tangent(i.a, i.b, k.a, k.b); };
        Quantity quantity{std::string("c") + i.name + k.name, component, component};
        if (!in_plane) quantity.of_disks = nullptr;
        list.push_back(quantity);
      }
  const auto add = [&](const char *name, auto of) { list.push_back({name, of, of}); };
  add("young", [](const auto &r) { return r.numbers.isotropic.young(); });
  add("poisson", [](const auto &r) { return r.numbers.isotropic.poisson(); });
  add("shear", [](const auto &r) { return r.numbers.isotropic.shear; });
  add("lambda", [](const auto &r) { return r.numbers.isotropic.lambda; });
  add("anisotropy", [](const auto &r) { return r.numbers.isotropic.anisotropy; });
  add("work2", [](const auto &r) { return r.work(); });
  add("work2_least", [](const auto &r) { return r.numbers.least_work; });
  add("acoustic", [](const auto &r) { return r.numbers.acoustic.determinant; });
  add("normal_x", [](const auto &r) { return r.numbers.acoustic.normal[0]; });
  add("normal_y", [](const auto &r) { return r.numbers.acoustic.normal[1]; });
  list.push_back(
      {"normal_z", nullptr, [](const Probe<3> &r) { return r.numbers.acoustic.normal[2]; }});
  add("measured", [](const auto &) { return 1.0; });
  add("unrest", [](const auto &r) { return r.probed.unrest; });
  add("nonlinearity", [](const auto &r) { return r.probed.nonlinearity; });
  add("contact_changes", [](const auto &r) { return double(r.probed.changed_contacts); });
  add("steps", [](const auto &r) { return double(r.probed.steps); });
  return list;
}

const std::vector<Quantity> QUANTITIES = all_quantities();

/// Settings of the probes. A setting that the script does not give has a default, which depends on
/// the kind and the number format.
struct Settings {
  std::string fix_id;    // empty for the only fix rve
  macro::TangentKind kind = macro::TangentKind::Elastic;
  rve::Format format = rve::Format::Double;
  std::optional<double> probe, lead, spread, tolerance, damping;
  std::optional<int> strain_steps, lead_steps, most_steps;

  macro::TangentOptions options() const
  {
    auto options = macro::TangentOptions::of(format, kind);
    options.probe = probe.value_or(options.probe);
    options.lead = lead.value_or(options.lead);
    options.spread = spread.value_or(options.spread);
    options.tolerance = tolerance.value_or(options.tolerance);
    options.damping = damping.value_or(options.damping);
    options.strain_steps = strain_steps.value_or(options.strain_steps);
    options.lead_steps = lead_steps.value_or(options.lead_steps);
    options.most_steps = most_steps.value_or(options.most_steps);
    return options;
  }
};

using Kind = macro::TangentKind;

const ScriptKeyword<Settings> KEYWORDS[] = {
    {"fix", "ID", [](ScriptArguments &words, Settings &s) { s.fix_id = words.next(); }},
    {"kind", "elastic | loading",
     into(one_of<Kind>({{"elastic", Kind::Elastic}, {"loading", Kind::Loading}}), &Settings::kind)},
    {"format", "fast | mixed | double | single",
     into(one_of(rve::FORMAT_CHOICES), &Settings::format)},
    {"probe", "size", into(any_number, &Settings::probe)},
    {"lead", "size", into(any_number, &Settings::lead)},
    {"spread", "share", into(any_number, &Settings::spread)},
    {"tolerance", "share", into(any_number, &Settings::tolerance)},
    {"damping", "alpha", into(any_number, &Settings::damping)},
    {"strain_steps", "N", into(integer(1), &Settings::strain_steps)},
    {"lead_steps", "N", into(integer(1), &Settings::lead_steps)},
    {"most_steps", "N", into(integer(1), &Settings::most_steps)}};

constexpr const char *STYLE = "compute rve/tangent";

}    // namespace

struct ComputeRveTangent::Impl {
  std::vector<const Quantity *> quantities;
  Settings settings;
  FixRve *fix = nullptr;
  ColumnValues values;

  /// Returns a row of quantities for each of the atoms, in their order. The row is zero if the
  /// tangent of an RVE cannot be measured.
  template <int D>
  std::vector<double> measure(const FixRve::ImplOf<D> &rves, const std::vector<int> &atoms) const
  {
    macro::TangentProbesOf<D> probes(rves.empty_engine(settings.format), settings.options());
    const auto tangents = probes.probe(
        static_cast<int>(atoms.size()), [&](int k) { return rves.state(atoms[k]); },
        [&](int k) { return rves.point(atoms[k]).rate_of_deformation(); });
    std::vector<double> all;
    for (const macro::ProbedTangentOf<D> &tangent : tangents) {
      const Probe<D> probe{tangent, {tangent.tangent, tangent.stress}};
      for (const Quantity *quantity : quantities)
        all.push_back(tangent.is_measured ? quantity->of(probe) : 0.0);
    }
    return all;
  }
  std::vector<double> measure(const std::vector<int> &atoms) const
  {
    return with_rves(*fix, [&](const auto &rves) { return measure(rves, atoms); });
  }
};

ComputeRveTangent::ComputeRveTangent(LAMMPS *lmp, int narg, char **arg) :
    Compute(lmp, narg, arg), impl(std::make_unique<Impl>())
{
  const std::string who = fmt::format("{} {}", STYLE, id);
  ScriptArguments words(lmp, who, narg, arg, 3);
  words.set_keywords(names_of(KEYWORDS));
  while (const Quantity *quantity = find_column(words.peek(), QUANTITIES)) {
    words.next();
    impl->quantities.push_back(quantity);
  }
  words.suggest(names_of(QUANTITIES));
  while (words.next_keyword()) words.read(KEYWORDS, impl->settings);
  if (impl->quantities.empty())
    words.refuse("at least one quantity must be given before the keywords");
  const Settings &settings = impl->settings;
  if (settings.kind == macro::TangentKind::Elastic)
    for (const char *keyword : {"lead", "lead_steps", "spread"})
      if (words.has(keyword))
        words.refuse(fmt::format("{} is for kind loading, but the kind is elastic", keyword));
  try {
    settings.options().check(who);
  } catch (const rve::InputError &problem) {    // thrown on all ranks alike
    error->all(FLERR, problem.what());
  }

  impl->values = ColumnValues(impl->quantities.size());
  peratom_flag = 1;
  size_peratom_cols = impl->values.num_columns();
}

ComputeRveTangent::~ComputeRveTangent() = default;

void ComputeRveTangent::init()
{
  impl->fix = fix_of_columns(lmp, STYLE, id, impl->settings.fix_id, impl->quantities);
  // if no engine can be made for the probed copies of RVEs, this ends with an error before the run
  collectively(lmp, fmt::format("{} {}", STYLE, id), [&] { impl->measure({}); });
}

void ComputeRveTangent::compute_peratom()
{
  invoked_peratom = update->ntimestep;
  impl->values.resize(atom->nmax, vector_atom, array_atom);
  const auto columns = impl->quantities.size();
  std::vector<int> atoms;
  for (int i = 0; i < atom->nlocal; i++) {
    std::fill_n(impl->values.row(i), columns, 0.0);
    if ((atom->mask[i] & groupbit) && impl->fix->rves().slot[i] >= 0) atoms.push_back(i);
  }
  const auto who = [&] { return fmt::format("{} {}, step {}", STYLE, id, update->ntimestep); };
  const std::vector<double> all = on_this_rank(lmp, who, [&] { return impl->measure(atoms); });
  for (std::size_t k = 0; k < atoms.size(); k++)
    std::copy_n(&all[k * columns], columns, impl->values.row(atoms[k]));
}

double ComputeRveTangent::memory_usage()
{
  return impl->values.bytes();
}
