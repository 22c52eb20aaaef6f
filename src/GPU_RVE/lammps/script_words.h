// SPDX-License-Identifier: GPL-2.0-only
// The words of a command of a script: read one after the other, keywords by tables, with the errors
// that all commands have in common.

#pragma once

#include "rve/core/suggestion.h"
#include "rve/engine/options.h"

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace LAMMPS_NS {

class LAMMPS;
class ScriptWords;

/// A number of the script: constant, or an equal- or atom-style variable.
struct ScriptValue {
  double constant = 0.0;
  std::string variable;    ///< name without v_, empty for a constant
  bool per_atom = false;

  /// Looks the variable up; an error names it.
  void find(LAMMPS *lmp, const std::string &command, bool may_be_per_atom = true);

  /// Of a constant or an equal-style variable.
  double evaluate(LAMMPS *lmp) const;

  /// One value per local atom of the group.
  void evaluate(LAMMPS *lmp, int igroup, std::vector<double> &values) const;

 private:
  std::string owner;    // the command, for errors
  /// Index of the variable as it is now: LAMMPS renumbers variables when one before them is deleted
  /// or ends.
  int index(LAMMPS *lmp) const;
};

/// A keyword of a command: how its values are written, for messages, and what reads them into
/// `Target`.
template <class Target> struct ScriptKeyword {
  const char *name;
  const char *values;    ///< ends in "..." if there may be any number of them
  std::function<void(ScriptWords &, Target &)> read;
};

/// The word of a value.
template <class T, std::size_t N>
const char *word_of(const rve::Choice<T> (&choices)[N], const T &value)
{
  std::size_t k = 0;
  while (!(choices[k].value == value)) k++;
  return choices[k].word;
}

/// Names of the keywords of a table, whatever else its rows have.
template <class Table> rve::Words names_of(const Table &table)
{
  rve::Words names;
  for (const auto &row : table) names.emplace_back(row.name);
  return names;
}

/// A cursor over the words of a command. Errors end in error->all and call a value by its keyword
/// and `part`, as in "stress samples".
class ScriptWords {
 public:
  /// `command`: how errors call it. The words begin at arg[begin].
  ScriptWords(LAMMPS *lmp, std::string command, int narg, char **arg, int begin);

  // ---- keywords ----

  /// What next_keyword() knows, in the order of messages.
  void set_keywords(rve::Words keywords) { known = std::move(keywords); }
  void add_keywords(const rve::Words &keywords);

  /// Ends the keyword before, and takes the next one; false at the end of the command. Errors: an
  /// unknown keyword, and one that is given twice.
  bool next_keyword();
  const std::string &keyword() const { return current.keyword; }
  bool at_keyword() const;

  /// Reads the values of the keyword by its row of the table; false if it is in another one.
  template <class Table, class Target> bool read(const Table &table, Target &target)
  {
    for (const auto &row : table)
      if (keyword() == row.name) {
        set_form(row.values);
        row.read(*this, target);
        return true;
      }
    return false;
  }

  /// How the values of this keyword are written.
  void set_form(std::string values) { current.form = std::move(values); }

  /// What follows is about `subject`, not about the keyword alone, and only this must not be given
  /// twice; or it may.
  void about(const std::string &subject, bool may_repeat = false);

  /// These words would also be possible here, for the message that names similar ones.
  void suggest(const rve::Words &words) { suggested = words; }

  struct Given {
    std::string keyword;
    std::string subject;    ///< the keyword, or what about() said
    std::string values;     ///< that follow the subject
    std::string text;       ///< all words, from the keyword on
    std::string form = "value";
    bool may_repeat = false;
  };
  /// The keywords before this one.
  const std::vector<Given> &given() const { return before; }
  bool has(std::string_view keyword) const;

  // ---- values ----

  bool empty() const { return position >= narg; }
  /// The next word, or one behind it; "" behind the end.
  const char *peek(int ahead = 0) const
  {
    return position + ahead < narg ? arg[position + ahead] : "";
  }
  /// Takes the next word if it is this one.
  bool take(const char *word);
  bool starts_number() const;

  const char *next(const std::string &part = "");
  double number(const std::string &part = "");
  double positive(const std::string &part, const char *unit);
  double within(const std::string &part, const char *unit, double above, double most);
  std::vector<double> numbers();    ///< at least one
  int integer(const std::string &part, int least);
  long long whole(const std::string &part, long long least, long long most);
  bool logical(const std::string &part = "");
  ScriptValue value(const std::string &part = "");
  int groupbit(const std::string &part = "");

  /// Which of the choices it is.
  int choice(const std::string &part, const rve::Words &choices);
  template <class T, std::size_t N>
  T choice(const std::string &part, const rve::Choice<T> (&choices)[N])
  {
    rve::Words names;
    for (const rve::Choice<T> &some : choices) names.emplace_back(some.word);
    return choices[choice(part, names)].value;
  }

  /// Numbers beyond +-largest are errors from here on.
  void limit_numbers(double largest) { largest_number = largest; }

  LAMMPS *owner() const { return lmp; }

  /// An error of the command.
  [[noreturn]] void refuse(const std::string &message) const;

 private:
  LAMMPS *lmp;
  std::string command;
  int narg;
  char **arg;
  int position;
  double largest_number;

  rve::Words known, suggested;
  std::vector<Given> before;
  Given current;                   // its keyword is empty before the first one
  int first = 0, values_at = 0;    // word of the keyword, and of its values

  std::string label(const std::string &part) const;
  // what a message ends with: how the keyword must read, always or where a word may stand in place
  // of a number
  std::string form_in_words() const;
  std::string alternatives_in_words() const;
  double limited(const std::string &part, const char *word) const;
  std::string text_from(int begin) const;
  void end_keyword();
};

// ---- readers of one value, for rows of tables ----

inline double any_number(ScriptWords &words)
{
  return words.number();
}
inline ScriptValue any_value(ScriptWords &words)
{
  return words.value();
}
inline bool yes_or_no(ScriptWords &words)
{
  return words.logical();
}
inline auto positive(const char *unit)
{
  return [=](ScriptWords &words) { return words.positive("", unit); };
}
inline auto integer(int least)
{
  return [=](ScriptWords &words) { return words.integer("", least); };
}
template <class T, std::size_t N> auto one_of(const rve::Choice<T> (&choices)[N])
{
  return [choices](ScriptWords &words) { return words.choice("", choices); };
}

/// Has the value go where the pointers to members lead, the first one of which is a member of the
/// target of the table.
template <class Read, class... Members> auto into(const Read &read, Members... members)
{
  return [=](ScriptWords &words, auto &target) { (target.*....*members) = read(words); };
}

}    // namespace LAMMPS_NS
