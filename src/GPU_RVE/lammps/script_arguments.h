// SPDX-License-Identifier: GPL-2.0-only
// Parser of the arguments of a command: it reads words one after another, keywords by tables, and
// raises the errors that all commands share.

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
class ScriptArguments;

/// A number of the script: constant, or an equal- or atom-style variable.
struct ScriptValue {
  double constant = 0.0;
  std::string variable;    ///< name without v_, empty for a constant
  bool per_atom = false;

  /// Looks the variable up. Ends in error->all if it does not exist or has another style. The
  /// errors begin with `command`. Does nothing for a constant.
  void find(LAMMPS *lmp, const std::string &command, bool may_be_per_atom = true);

  /// Returns the value of a constant or an equal-style variable.
  double evaluate(LAMMPS *lmp) const;

  /// Fills `values` with one value per local atom. Atoms outside of the group get 0 from an
  /// atom-style variable.
  void evaluate(LAMMPS *lmp, int igroup, std::vector<double> &values) const;

 private:
  std::string owner;    ///< name of the command for error messages
  /// Returns the present index of the variable. LAMMPS renumbers variables when a variable before
  /// them is deleted or ends.
  int index(LAMMPS *lmp) const;
};

/// Row of a table of keywords: the keyword, the form of its values for messages, and the function
/// that reads the values into a `Target`.
template <class Target> struct ScriptKeyword {
  const char *name;
  const char *values;    ///< form of the values; "..." at the end allows any number of them
  std::function<void(ScriptArguments &, Target &)> read;
};

/// Returns the word of `value`, which must be among `choices`.
template <class T, std::size_t N>
const char *word_of(const rve::Choice<T> (&choices)[N], const T &value)
{
  std::size_t k = 0;
  while (!(choices[k].value == value)) k++;
  return choices[k].word;
}

/// Returns the members `name` of the rows of a table.
template <class Table> rve::Words names_of(const Table &table)
{
  rve::Words names;
  for (const auto &row : table) names.emplace_back(row.name);
  return names;
}

/// A cursor over the words of a command. Errors end in error->all. They name a value by its keyword
/// and its `part`, as in "stress samples".
class ScriptArguments {
 public:
  /// Errors begin with `command`. The words begin at arg[begin].
  ScriptArguments(LAMMPS *lmp, std::string command, int narg, char **arg, int begin);

  // ---- keywords ----

  /// Sets the keywords that next_keyword() accepts, in the order in which messages list them.
  void set_keywords(rve::Words keywords) { known = std::move(keywords); }
  void add_keywords(const rve::Words &keywords);

  /// Ends the present keyword and takes the next one. Returns false at the end of the command. An
  /// unknown keyword and a keyword that is given twice are errors.
  bool next_keyword();
  const std::string &keyword() const { return current.keyword; }
  /// Returns true if the next word is a keyword.
  bool at_keyword() const;

  /// Reads the values of the present keyword by its row of the table. Returns false if the table
  /// does not have the keyword.
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

  /// Sets the form of the values of the present keyword for messages.
  void set_form(std::string values) { current.form = std::move(values); }

  /// Sets the subject of the present keyword, for example "model upper" of the keyword model. Two
  /// keywords with the same subject are an error unless `may_repeat`.
  void about(const std::string &subject, bool may_repeat = false);

  /// Sets words that are also accepted here and that the message for an unknown keyword suggests.
  void suggest(const rve::Words &words) { suggested = words; }

  /// A keyword of the command and its words.
  struct Given {
    std::string keyword;
    std::string subject;    ///< the keyword, or the argument of about()
    std::string values;     ///< words after the subject
    std::string text;       ///< all words from the keyword on
    std::string form = "value";
    bool may_repeat = false;
  };
  /// Returns the keywords before the present one.
  const std::vector<Given> &given() const { return before; }
  /// Returns true if `keyword` is among the keywords before the present one.
  bool has(std::string_view keyword) const;

  // ---- values ----

  bool empty() const { return position >= narg; }
  /// Returns the word that is `ahead` words after the next word, or "" after the end of the
  /// command.
  const char *peek(int ahead = 0) const
  {
    return position + ahead < narg ? arg[position + ahead] : "";
  }
  /// Takes the next word if it equals `word`. Returns true if it did.
  bool take(const char *word);
  /// Returns true if the next word begins with a digit, a sign or a point.
  bool starts_number() const;

  // Each function below takes the next word, or several words, and returns the value. A missing
  // word or a value out of range is an error.
  const char *next(const std::string &part = "");
  double number(const std::string &part = "");
  double positive(const std::string &part, const char *unit);
  /// Returns a number greater than `above` and at most `most`.
  double within(const std::string &part, const char *unit, double above, double most);
  std::vector<double> numbers();    ///< returns at least one number
  int integer(const std::string &part, int least);
  /// Returns an integer from `least` to `most`.
  long long whole(const std::string &part, long long least, long long most);
  bool logical(const std::string &part = "");
  ScriptValue value(const std::string &part = "");
  int groupbit(const std::string &part = "");

  /// Returns the index of the next word among `choices`.
  int choice(const std::string &part, const rve::Words &choices);
  /// Returns the value of the next word among `choices`.
  template <class T, std::size_t N>
  T choice(const std::string &part, const rve::Choice<T> (&choices)[N])
  {
    rve::Words names;
    for (const rve::Choice<T> &some : choices) names.emplace_back(some.word);
    return choices[choice(part, names)].value;
  }

  /// Makes numbers beyond +-largest an error from now on.
  void limit_numbers(double largest) { largest_number = largest; }

  LAMMPS *owner() const { return lmp; }

  /// Ends in error->all with the command and the message.
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
  Given current;        ///< the keyword is empty before the first keyword
  int first = 0;        ///< index of the word of the present keyword
  int values_at = 0;    ///< index of the first value of the present keyword

  std::string label(const std::string &part) const;
  /// Returns the end of a message with the form of the present keyword.
  std::string form_in_words() const;
  /// Returns form_in_words() if the form has alternatives, else "".
  std::string alternatives_in_words() const;
  double limited(const std::string &part, const char *word) const;
  std::string text_from(int begin) const;
  void end_keyword();
};

// ---- functions that read one value, for rows of tables ----

inline double any_number(ScriptArguments &words)
{
  return words.number();
}
inline ScriptValue any_value(ScriptArguments &words)
{
  return words.value();
}
inline bool yes_or_no(ScriptArguments &words)
{
  return words.logical();
}
inline auto positive(const char *unit)
{
  return [=](ScriptArguments &words) { return words.positive("", unit); };
}
inline auto integer(int least)
{
  return [=](ScriptArguments &words) { return words.integer("", least); };
}
template <class T, std::size_t N> auto one_of(const rve::Choice<T> (&choices)[N])
{
  return [choices](ScriptArguments &words) { return words.choice("", choices); };
}

/// Returns a function for a row of a table. It stores the value of `read` in a member of the
/// target. `members` is a chain of pointers to members: target.*members[0].*members[1]...
template <class Read, class... Members> auto into(const Read &read, Members... members)
{
  return [=](ScriptArguments &words, auto &target) { (target.*....*members) = read(words); };
}

}    // namespace LAMMPS_NS
