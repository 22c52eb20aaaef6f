// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/script_arguments.h"

#include "atom.h"
#include "error.h"
#include "group.h"
#include "input.h"
#include "lammps.h"
#include "rve/core/error.h"
#include "utils.h"
#include "variable.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <limits>

using namespace LAMMPS_NS;

void ScriptValue::find(LAMMPS *lmp, const std::string &command, bool may_be_per_atom)
{
  if (variable.empty()) return;
  owner = command;
  Variable *variables = lmp->input->variable;
  const int found = variables->find(variable.c_str());
  if (found < 0) lmp->error->all(FLERR, "{}: variable {} does not exist", command, variable);
  per_atom = may_be_per_atom && variables->atomstyle(found);
  if (!per_atom && !variables->equalstyle(found))
    lmp->error->all(FLERR, "{}: variable {} must be of equal{} style", command, variable,
                    may_be_per_atom ? " or atom" : "");
}

int ScriptValue::index(LAMMPS *lmp) const
{
  Variable *variables = lmp->input->variable;
  const int found = variables->find(variable.c_str());
  if (found < 0 || !(per_atom ? variables->atomstyle(found) : variables->equalstyle(found)))
    lmp->error->all(
        FLERR,
        "{}: variable {} has been deleted or its style has changed since the setup of the run",
        owner, variable);
  return found;
}

double ScriptValue::evaluate(LAMMPS *lmp) const
{
  return variable.empty() ? constant : lmp->input->variable->compute_equal(index(lmp));
}

void ScriptValue::evaluate(LAMMPS *lmp, int igroup, std::vector<double> &values) const
{
  values.assign(lmp->atom->nlocal, constant);
  if (per_atom)
    lmp->input->variable->compute_atom(index(lmp), igroup, values.data(), 1, 0);
  else if (!variable.empty())
    std::fill(values.begin(), values.end(), evaluate(lmp));
}

ScriptArguments::ScriptArguments(LAMMPS *_lmp, std::string _command, int _narg, char **_arg,
                                 int begin) :
    lmp(_lmp),
    command(std::move(_command)), narg(_narg), arg(_arg), position(begin),
    largest_number(std::numeric_limits<double>::infinity())
{
}

// LAMMPS prints the command and marks the word that was read last.
void ScriptArguments::refuse(const std::string &message) const
{
  const Input *input = lmp->input;
  int marked = Error::NOPOINTER;
  for (int k = 0; k < input->narg; ++k)
    if (input->arg + k + 1 == arg + position) marked = k;
  lmp->error->all(FLERR, marked, "{}: {}", command, message);
}

// Returns the name of a value for messages: the keyword and the part, for example "stress samples"
// for the part "samples" of the keyword stress. Before the first keyword, the part is the name.
std::string ScriptArguments::label(const std::string &part) const
{
  return current.keyword + (current.keyword.empty() || part.empty() ? "" : " ") + part;
}

std::string ScriptArguments::text_from(int begin) const
{
  std::string text;
  for (int k = begin; k < position; ++k) text += (k > begin ? " " : "") + std::string(arg[k]);
  return text;
}

void ScriptArguments::add_keywords(const rve::Words &keywords)
{
  known.insert(known.end(), keywords.begin(), keywords.end());
}

bool ScriptArguments::at_keyword() const
{
  return std::find(known.begin(), known.end(), peek()) != known.end();
}

bool ScriptArguments::has(std::string_view keyword) const
{
  return std::any_of(before.begin(), before.end(),
                     [&](const Given &given) { return given.keyword == keyword; });
}

void ScriptArguments::about(const std::string &subject, bool may_repeat)
{
  current.subject = subject;
  current.may_repeat = may_repeat;
  values_at = position;
}

// Adds the present keyword to `before`. If `before` has a keyword with the same subject, this is an
// error unless the present keyword may repeat.
void ScriptArguments::end_keyword()
{
  if (current.keyword.empty()) return;
  current.values = text_from(values_at);
  current.text = text_from(first);
  const std::string &form = current.form;
  const bool is_list = form.size() > 3 && form.substr(form.size() - 3) == "...";
  for (const Given &given : before)
    if (given.subject == current.subject && !current.may_repeat)
      refuse(fmt::format("{} is given twice, as '{}' and as '{}'; give it once{}", current.subject,
                         given.text, current.text, is_list ? ", with all its values" : ""));
  before.push_back(current);
  current = Given();
}

bool ScriptArguments::next_keyword()
{
  end_keyword();
  if (empty()) return false;
  const bool is_known = at_keyword();
  first = position;
  const std::string word = arg[position++];
  if (!is_known) {
    suggested.insert(suggested.end(), known.begin(), known.end());
    refuse(rve::unknown_keyword(word, suggested, before.empty() ? "" : before.back().text));
  }
  suggested.clear();
  current.keyword = word;
  about(word);
  return true;
}

bool ScriptArguments::take(const char *word)
{
  if (strcmp(peek(), word) != 0) return false;
  ++position;
  return true;
}

bool ScriptArguments::starts_number() const
{
  const char first_char = peek()[0];
  return first_char &&
      (isdigit(static_cast<unsigned char>(first_char)) || strchr("+-.", first_char));
}

const char *ScriptArguments::next(const std::string &part)
{
  if (!empty()) return arg[position++];
  refuse(fmt::format("{} has no value; the command ends there{}", label(part), form_in_words()));
}

std::string ScriptArguments::form_in_words() const
{
  if (current.keyword.empty()) return "";
  return fmt::format("; it must read: {} {}", current.keyword, current.form);
}

std::string ScriptArguments::alternatives_in_words() const
{
  return current.form.find(" | ") == std::string::npos ? "" : form_in_words();
}

double ScriptArguments::limited(const std::string &part, const char *word) const
{
  const double value = utils::numeric(FLERR, word, false, lmp);
  if (!(std::fabs(value) <= largest_number))
    refuse(fmt::format("{} is {}; it must be from {} to {}", label(part), word,
                       rve::number(-largest_number), rve::number(largest_number)));
  return value;
}

double ScriptArguments::number(const std::string &part)
{
  const char *word = next(part);
  if (!utils::is_double(word))
    refuse(fmt::format("{} is '{}'; it must be a number{}", label(part), word,
                       alternatives_in_words()));
  return limited(part, word);
}

double ScriptArguments::positive(const std::string &part, const char *unit)
{
  const double value = number(part);
  if (!std::isfinite(value) || value <= 0.0)
    refuse(fmt::format("{} is {} {}; it must be greater than 0", label(part), rve::number(value),
                       unit));
  return value;
}

double ScriptArguments::within(const std::string &part, const char *unit, double above, double most)
{
  const double value = number(part);
  if (!(value > above && value <= most))
    refuse(fmt::format("{} is {} {}; it must be greater than {} and at most {}", label(part),
                       rve::number(value), unit, rve::number(above), rve::number(most)));
  return value;
}

std::vector<double> ScriptArguments::numbers()
{
  std::vector<double> list = {number()};
  while (utils::is_double(peek())) list.push_back(number());
  return list;
}

long long ScriptArguments::whole(const std::string &part, long long least, long long most)
{
  const char *word = next(part);
  if (!utils::is_integer(word))
    refuse(fmt::format("{} is '{}'; it must be a whole number{}", label(part), word,
                       alternatives_in_words()));
  const bigint value = utils::bnumeric(FLERR, word, false, lmp);
  if (value < least)
    refuse(fmt::format("{} is {}; it must be at least {}", label(part), value, least));
  if (value > most)
    refuse(fmt::format("{} is {}; it must be at most {}", label(part), value, most));
  return value;
}

int ScriptArguments::integer(const std::string &part, int least)
{
  return static_cast<int>(whole(part, least, std::numeric_limits<int>::max()));
}

bool ScriptArguments::logical(const std::string &part)
{
  return choice<bool>(part,
                      {{"yes", true},
                       {"no", false},
                       {"on", true},
                       {"off", false},
                       {"true", true},
                       {"false", false}});
}

ScriptValue ScriptArguments::value(const std::string &part)
{
  const char *word = next(part);
  ScriptValue value;
  if (strncmp(word, "v_", 2) == 0)
    value.variable = word + 2;
  else if (utils::is_double(word))
    value.constant = limited(part, word);
  else
    refuse(fmt::format(
        "{} is '{}'; it must be a number or v_name of a variable{}", label(part), word,
        lmp->input->variable->find(word) >= 0 ? fmt::format("; did you mean v_{}?", word) : ""));
  return value;
}

int ScriptArguments::groupbit(const std::string &part)
{
  const char *word = next(part);
  const int found = lmp->group->find(word);
  if (found < 0) {
    rve::Words groups;
    for (int g = 0; g < 32; ++g)    // LAMMPS has at most 32 groups
      if (lmp->group->names[g]) groups.emplace_back(lmp->group->names[g]);
    refuse(fmt::format("{} '{}' does not exist{}", label(part), word,
                       rve::did_you_mean(word, groups, "there are")));
  }
  return lmp->group->bitmask[found];
}

int ScriptArguments::choice(const std::string &part, const rve::Words &choices)
{
  const char *word = next(part);
  std::string allowed;
  for (std::size_t k = 0; k < choices.size(); ++k) {
    if (choices[k] == word) return static_cast<int>(k);
    allowed += (k == 0 ? "" : k + 1 == choices.size() ? " or " : ", ") + std::string(choices[k]);
  }
  refuse(fmt::format("{} is '{}'; it must be {}", label(part), word, allowed));
}
