// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/state_readers.h"

#include "fix_gravity.h"
#include "fix_mpm.h"
#include "fix_rve.h"

#include "fix.h"
#include "info.h"
#include "input.h"
#include "lammps.h"
#include "modify.h"
#include "output.h"
#include "update.h"
#include "variable.h"

#include <algorithm>
#include <cctype>
#include <cstring>
#include <set>
#include <string>

using namespace LAMMPS_NS;

namespace {

/// Returns true if the value of a word in a formula follows from time, positions and velocities
/// alone. Returns false for thermo keywords that are computes (ke, temp, press ...), for functions
/// of groups and regions, because their members can depend on variables, and for special functions
/// that read fixes or computes.
bool is_plain(const std::string &word)
{
  static const std::set<std::string> PLAIN = {
      // numbers and keywords of thermo_style
      "PI", "version", "yes", "no", "on", "off", "true", "false", "step", "elapsed", "elaplong",
      "dt", "time", "cpu", "atoms", "vol", "lx", "ly", "lz", "xlo", "xhi", "ylo", "yhi", "zlo",
      "zhi",
      // functions
      "sqrt", "exp", "ln", "log", "abs", "sign", "sin", "cos", "tan", "asin", "acos", "atan",
      "atan2", "random", "normal", "ceil", "floor", "round", "ternary", "ramp", "stagger",
      "logfreq", "logfreq2", "logfreq3", "stride", "stride2", "vdisplace", "swiggle", "cwiggle",
      // of atoms
      "id", "mass", "type", "x", "y", "z", "vx", "vy", "vz"};
  return PLAIN.count(word) > 0;
}

/// Returns the formula of a variable. LAMMPS gives it only in the text of `info variables`, as
/// "... def = formula", followed by the last value for an equal-style variable.
std::string formula_of(LAMMPS *lmp, int index)
{
  std::string info = Info(lmp).get_variable_info(index);
  // utils::trim uses regular expressions, which are too slow for a call in each step
  info.erase(info.find_last_not_of(" \t\r\n") + 1);
  const std::size_t begin = info.find("def =");
  if (begin == std::string::npos) return "unknown";
  const bool has_value = lmp->input->variable->equalstyle(index);
  return info.substr(begin + 5, has_value ? info.find_last_of(' ') - begin - 5 : std::string::npos);
}

/// Implements may_read_results(). `seen` has the variables whose search has begun or ended.
bool depends_on_results(LAMMPS *lmp, const std::string &name, std::set<std::string> &seen)
{
  if (!seen.insert(name).second) return false;    // LAMMPS rejects circular variables itself
  Variable *variables = lmp->input->variable;
  const int index = variables->find(name.c_str());
  if (index < 0) return true;
  if (variables->internalstyle(index)) return false;
  // a variable of another style can run Python code or read the next number of a file
  if (!variables->equalstyle(index) && !variables->atomstyle(index) &&
      !variables->vectorstyle(index))
    return true;
  const std::string formula = formula_of(lmp, index);
  const auto in_word = [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '.'; };
  for (auto end = formula.begin(); end != formula.end();) {
    const auto begin = std::find_if(end, formula.end(), in_word);
    end = std::find_if_not(begin, formula.end(), in_word);
    const std::string word(begin, end);
    // skip numbers, and the digits after the sign of an exponent
    if (word.empty() || std::isdigit((unsigned char) word[0]) || word[0] == '.') continue;
    if (word.compare(0, 2, "v_") == 0 ? depends_on_results(lmp, word.substr(2), seen)
                                      : !is_plain(word))
      return true;
  }
  return false;
}

/// Access to the variables of a fix gravity, which are protected members.
struct Gravity : FixGravity {
  static bool reads_results(const Fix *fix, LAMMPS *lmp)
  {
    const auto *gravity = dynamic_cast<const FixGravity *>(fix);
    if (!gravity) return true;    // another class whose style begins with gravity
    for (char *FixGravity::*variable :
         {&Gravity::mstr, &Gravity::vstr, &Gravity::pstr, &Gravity::tstr, &Gravity::xstr,
          &Gravity::ystr, &Gravity::zstr})
      if (gravity->*variable && may_read_results(lmp, gravity->*variable)) return true;
    return false;
  }
};

/// Returns true if a fix mpm, rve or gravity reads in each step a variable that can depend on
/// results. Apart from variables, these fixes need positions and masses of atoms only.
bool reads_by_variables(const Fix *fix, LAMMPS *lmp)
{
  if (const auto *mpm = dynamic_cast<const FixMpm *>(fix)) return mpm->reads_results();
  if (const auto *rve = dynamic_cast<const FixRve *>(fix)) return rve->reads_results();
  return Gravity::reads_results(fix, lmp);
}

}    // namespace

bool LAMMPS_NS::may_read_results(LAMMPS *lmp, const std::string &variable)
{
  std::set<std::string> seen;
  return depends_on_results(lmp, variable, seen);
}

bool LAMMPS_NS::state_may_be_read(LAMMPS *lmp)
{
  const bigint step = lmp->update->ntimestep;
  if (step == lmp->update->laststep || step == lmp->output->next) return true;
  for (const Fix *fix : lmp->modify->get_fix_list()) {
    // utils::strmatch would compile its pattern again in each step
    const auto begins = [fix](const char *word) {
      return std::strncmp(fix->style, word, std::strlen(word)) == 0;
    };
    if (std::strcmp(fix->style, "mpm") == 0 || std::strcmp(fix->style, "rve") == 0 ||
        begins("gravity")) {
      if (reads_by_variables(fix, lmp)) return true;
      continue;
    }
    // fix balance weighs atoms before it distributes them, at the start of a step
    if (begins("balance")) {
      if (fix->force_reneighbor && step + 1 >= fix->next_reneighbor) return true;
      continue;
    }
    const int hooks = lmp->modify->get_fix_mask(const_cast<Fix *>(fix)) & ~FixConst::POST_RUN;
    if (hooks == 0) continue;
    if (hooks != FixConst::END_OF_STEP || fix->nevery <= 0 || step % fix->nevery == 0) return true;
  }
  return false;
}
