// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/formulas.h"

#include "info.h"
#include "input.h"
#include "lammps.h"
#include "variable.h"

#include <cctype>
#include <set>

using namespace LAMMPS_NS;

namespace {

/// Words of formulas that follow from time, positions and velocities. Not among them: thermo keywords that are computes (ke, temp, press ...),
/// functions of groups and regions, whose members may follow from variables, and special functions of fixes and computes.
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

class Formulas {
 public:
  explicit Formulas(LAMMPS *lmp) : lmp_(lmp), variables_(lmp->input->variable) {}

  bool may_read_results(const std::string &name)
  {
    if (!seen_.insert(name).second) return false;    // LAMMPS refuses circles
    const int index = variables_->find(name.c_str());
    if (index < 0) return true;
    if (variables_->internalstyle(index)) return false;
    const bool is_formula = variables_->equalstyle(index) || variables_->atomstyle(index) ||
        variables_->vectorstyle(index);
    // neither python, nor numbers from a file that a step may read on
    if (!is_formula) return true;
    return reads(text(index));
  }

 private:
  /// The formula itself. LAMMPS shows it to nobody but readers of `info variables`: "... def = formula", where the last value follows if
  /// the variable has one.
  std::string text(int index)
  {
    std::string info = Info(lmp_).get_variable_info(index);
    // utils::trim looks for patterns, and this is asked in each step
    info.erase(info.find_last_not_of(" \t\r\n") + 1);
    const std::size_t begin = info.find("def =");
    if (begin == std::string::npos) return "unknown";
    const bool has_value = variables_->equalstyle(index);
    return info.substr(begin + 5,
                       has_value ? info.find_last_of(' ') - begin - 5 : std::string::npos);
  }

  bool reads(const std::string &formula)
  {
    const auto in_word = [](char c) { return std::isalnum((unsigned char) c) || c == '_'; };
    std::size_t k = 0;
    while (k < formula.size()) {
      const std::size_t begin = k;
      if (std::isdigit((unsigned char) formula[k]) || formula[k] == '.') {
        // a number with its exponent; the sign in an exponent ends it, and the digits behind are another
        while (k < formula.size() && (in_word(formula[k]) || formula[k] == '.')) ++k;
        continue;
      }
      while (k < formula.size() && in_word(formula[k])) ++k;
      if (k == begin) {
        ++k;
        continue;
      }
      const std::string word = formula.substr(begin, k - begin);
      if (word.compare(0, 2, "v_") == 0 ? may_read_results(word.substr(2)) : !is_plain(word))
        return true;
    }
    return false;
  }

  LAMMPS *lmp_;
  Variable *variables_;
  std::set<std::string> seen_;
};

}    // namespace

bool LAMMPS_NS::may_read_results(LAMMPS *lmp, const std::string &variable)
{
  return Formulas(lmp).may_read_results(variable);
}
