// SPDX-License-Identifier: GPL-2.0-only

#include "fix_mpm_jobs.h"

#include "fix_mpm_restart.h"

#include "comm.h"
#include "error.h"
#include "modify.h"

#include <utility>

using namespace LAMMPS_NS;

template <int D> void MpmSetup<D>::find_models()
{
  settings.find(lmp);
  laws.clear();
  grains.clear();
  for (const MpmModel<D> &model : settings.models) {
    grains.push_back(nullptr);
    if (!model.law) {
      auto *found = lmp->modify->get_fix_by_id(model.fix_rve);
      if (!found)
        lmp->error->all(FLERR, "fix mpm {}: model {}: fix {} does not exist", fix->id, model.group,
                        model.fix_rve);
      grains.back() = dynamic_cast<FixRve *>(found);
      if (!grains.back())
        lmp->error->all(FLERR, "fix mpm {}: model {}: fix {} has style {}; it must be rve", fix->id,
                        model.group, model.fix_rve, found->style);
      if (settings.options.axisymmetric && grains.back()->rves().dimension == 2)
        lmp->error->all(FLERR,
                        "fix mpm {}: model {}: the RVEs of fix {} are disks, which have no hoop "
                        "strain and no hoop stress; axisymmetric yes needs RVEs of spheres",
                        fix->id, model.group, model.fix_rve);
    }
    laws.push_back(model.law ? model.law.get() : grains.back()->template constitutive<D>());
  }
  solver->set_models(laws);
}

template <int D> void MpmSetup<D>::check_sources() const
{
  for (std::size_t k = 0; k < grains.size(); k++) {
    if (!grains[k]) continue;
    const std::string &name = settings.models[k].fix_rve;
    const Fix *const found = lmp->modify->get_fix_by_id(name);
    if (found != grains[k] || !grains[k]->rves().is_material)
      lmp->error->all(
          FLERR,
          "fix mpm {}: model {}: fix {} has been deleted or redefined since the last run; run "
          "without pre no",
          fix->id, settings.models[k].group, name);
  }
}

template <int D>
void MpmSetup<D>::change_models(const std::vector<MpmModel<D>> &wanted, const std::string &when)
{
  const std::vector<MpmModel<D>> before = std::exchange(settings.models, wanted);
  for (std::size_t k = 0; k < wanted.size(); k++) {
    if (k < laws.size() && wanted[k].law) laws[k] = wanted[k].law.get();
    const std::string changes = wanted[k].changes_since(before[k]);
    if (lmp->comm->me == 0 && !changes.empty())
      utils::logmesg(lmp, "fix mpm {}: {}, model {} {} has {}\n", fix->id, when, wanted[k].group,
                     wanted[k].word, changes);
  }
  if (!laws.empty()) solver->set_models(laws);
}

template <int D>
void MpmSetup<D>::continue_modification(const MpmArguments &then, const std::string &words)
{
  std::vector<std::string> list = utils::split_words(words);
  const std::string about = "model " + list.at(1);
  const auto of_model = [&](const MpmArguments &all) {
    MpmArguments one;
    for (const auto &entry : all)
      if (entry.first == about) one.push_back(entry);
    return one;
  };
  const MpmArguments now = of_model(settings.words);
  if (now.empty() || !mpm_differences(of_model(then), now, false).empty()) {
    if (lmp->comm->me == 0)
      lmp->error->warning(FLERR,
                          "fix mpm {}: {} differs from that of the run before, so that these "
                          "changes by fix_modify are not applied: {}",
                          fix->id, about, words);
    return;
  }
  std::vector<char *> arg;
  for (std::string &word : list) arg.push_back(word.data());
  change_models(MpmModel<D>::modified(lmp, settings.models, fix->id, (int) arg.size(), arg.data()),
                "as set by fix_modify before");
}

template struct LAMMPS_NS::MpmSetup<2>;
template struct LAMMPS_NS::MpmSetup<3>;
