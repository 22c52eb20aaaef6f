// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/mpm_models.h"

#include "lammps/collective_error.h"
#include "mpm/axisymmetric_law.h"
#include "mpm/law_table.h"
#include "rve/core/error.h"

#include "utils.h"

#include <algorithm>

using namespace LAMMPS_NS;

namespace {

template <int D> const mpm::LawEntry<D> &entry_of(const MpmModel<D> &model)
{
  const auto &table = mpm::law_table<D>();
  return *std::find_if(table.begin(), table.end(),
                       [&](const mpm::LawEntry<D> &entry) { return entry.word == model.word; });
}

/// Makes the law of a model with these arguments. Axisymmetric laws are those in space with the
/// hoop direction as third axis. Throws rve::InputError for wrong arguments.
template <int D>
std::shared_ptr<mpm::Constitutive<D>> make_law(const MpmModel<D> &model, const double *arguments)
{
  if constexpr (D == 2)
    if (model.axisymmetric) {
      for (const mpm::LawEntry<3> &entry : mpm::law_table<3>())
        if (entry.word == model.word)
          return std::make_shared<mpm::AxisymmetricLaw>(entry.make(arguments));
      throw rve::InputError(fmt::format(
          "model {}: the law {} has no form in three dimensions, which axisymmetry needs",
          model.group, model.word));
    }
  return entry_of(model).make(arguments);
}

/// Returns the law arguments of a model after its strength reduction.
template <int D> std::vector<double> reduced_arguments(const MpmModel<D> &model)
{
  std::vector<double> arguments = model.arguments;
  if (model.strength_reduction != 1.0)
    entry_of(model).reduce_strength(arguments.data(), model.strength_reduction);
  return arguments;
}

template <int D> void read_parameters(ScriptArguments &words, MpmModel<D> &model)
{
  const mpm::LawEntry<D> &entry = entry_of(model);
  model.arguments.clear();
  model.strength_reduction = 1.0;
  for (const std::string &name : entry.arguments)
    model.arguments.push_back(words.number(entry.word + " " + name));
  model.law = make_law(model, model.arguments.data());
}

/// Reads the group of fix_modify and returns its model. A model of RVEs is an error.
template <int D>
MpmModel<D> &model_to_modify(ScriptArguments &words, std::vector<MpmModel<D>> &models)
{
  const std::string group = words.next("group");
  words.about(words.keyword() + " " + group);
  rve::Words groups;
  for (MpmModel<D> &model : models) {
    groups.emplace_back(model.group);
    if (model.group != group) continue;
    if (!model.law)
      words.refuse(fmt::format(
          "the model of group '{}' uses the RVEs of fix {}; change them with fix_modify {}", group,
          model.fix_rve, model.fix_rve));
    model.is_modified = true;
    return model;
  }
  words.refuse(fmt::format("the fix has no model of group '{}'{}", group,
                           rve::did_you_mean(group, groups, "groups with a model are")));
}

template <int D> void modify_model(ScriptArguments &words, std::vector<MpmModel<D>> &models)
{
  MpmModel<D> &model = model_to_modify(words, models);
  const std::string law = words.next("law");
  if (law != model.word)
    words.refuse(
        fmt::format("the model of group '{}' has the law {}; fix_modify changes parameters of this "
                    "law and cannot replace it by '{}'. Define the fix with a model of each law, "
                    "and change the groups of points to change their law",
                    model.group, model.word, law));
  words.set_form("group-ID " + law + " " + utils::join_words(entry_of(model).arguments, " "));
  read_parameters(words, model);
}

// Limits of the factor of *strength_reduction*. Usual factors of safety are near 1.
constexpr double LEAST_REDUCTION = 0.01, MOST_REDUCTION = 100.0;

template <int D> void modify_strength(ScriptArguments &words, std::vector<MpmModel<D>> &models)
{
  MpmModel<D> &model = model_to_modify(words, models);
  if (!entry_of(model).reduce_strength)
    words.refuse(
        fmt::format("the law of group '{}' is {}, which has no strength that could be reduced",
                    model.group, model.word));
  const double factor = words.number(model.group);
  if (!(factor >= LEAST_REDUCTION && factor <= MOST_REDUCTION))
    words.refuse(fmt::format("strength_reduction {} is {} [-]; it must be from {} to {}",
                             model.group, rve::number(factor), LEAST_REDUCTION, MOST_REDUCTION));
  model.strength_reduction = factor;
  model.law = make_law(model, reduced_arguments(model).data());
}

template <int D>
const ScriptKeyword<std::vector<MpmModel<D>>> KEYWORDS_OF_MODIFY[] = {
    {"model", "group-ID law ...", modify_model<D>},
    {"strength_reduction", "group-ID factor", modify_strength<D>}};

}    // namespace

template <int D> MpmModel<D> MpmModel<D>::read(ScriptArguments &words)
{
  std::string form = "group-ID rve fix-ID";    // or a law of the table
  rve::Words choices = {"rve"};
  for (const mpm::LawEntry<D> &entry : mpm::law_table<D>()) {
    form += " | " + entry.word + " " + utils::join_words(entry.arguments, " ");
    choices.emplace_back(entry.word);
  }
  words.set_form(form);
  MpmModel<D> model;
  model.group = words.peek();
  model.groupbit = words.groupbit("group");
  words.about("model " + model.group);
  const int choice = words.choice("law", choices);
  model.word = choices[choice];
  if (choice == 0)
    model.fix_rve = words.next("rve fix ID");
  else
    read_parameters(words, model);
  return model;
}

template <int D> void MpmModel<D>::set_axisymmetric()
{
  axisymmetric = true;
  if (law) law = make_law(*this, reduced_arguments(*this).data());
}

template <int D>
std::vector<MpmModel<D>> MpmModel<D>::modified(LAMMPS *lmp, std::vector<MpmModel> models,
                                               const std::string &fix_id, int narg, char **arg)
{
  const std::string command = "fix_modify " + fix_id;
  ScriptArguments words(lmp, command, narg, arg, 0);
  words.limit_numbers(LARGEST_MPM_NUMBER);
  words.set_keywords(names_of(KEYWORDS_OF_MODIFY<D>));
  collectively(lmp, command, [&] {
    while (words.next_keyword()) words.read(KEYWORDS_OF_MODIFY<D>, models);
  });
  return models;
}

template <int D> std::string MpmModel<D>::modification() const
{
  if (!is_modified) return "";
  std::string text = fmt::format("model {} {}", group, word);
  for (const double argument : arguments) text += fmt::format(" {:.17g}", argument);
  if (strength_reduction != 1.0)
    text += fmt::format(" strength_reduction {} {:.17g}", group, strength_reduction);
  return text;
}

template <int D> std::string MpmModel<D>::changes_since(const MpmModel &before) const
{
  if (!law) return "";
  const std::vector<double> then = reduced_arguments(before), now = reduced_arguments(*this);
  std::string text;
  for (std::size_t k = 0; k < now.size(); k++)
    if (then[k] != now[k])
      text += fmt::format("{}{} {} -> {}", text.empty() ? "" : ", ", entry_of(*this).arguments[k],
                          rve::number(then[k]), rve::number(now[k]));
  return text;
}

template struct LAMMPS_NS::MpmModel<2>;
template struct LAMMPS_NS::MpmModel<3>;
