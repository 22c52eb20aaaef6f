// SPDX-License-Identifier: GPL-2.0-only
#include "capi/words.h"

#include "rve/core/error.h"
#include "rve/core/suggestion.h"
#include "rve/engine/contact_words.h"
#include "rve/engine/grading.h"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <optional>
#include <sstream>
#include <type_traits>
#include <utility>
#include <vector>

namespace capi {

namespace {

  /// A word and its value or values.
  struct Entry {
    std::string word, value;
    std::vector<std::string> more = {};    ///< values after the first one
    /// Parameters of *contact* in the syntax of LAMMPS.
    std::optional<rve::GivenMaterial> contact = {};

    [[noreturn]] void refuse(const std::string &demand) const
    {
      throw rve::InputError(word + " is '" + value + "'; it must be " + demand);
    }
    template <class Number> Number number(const char *demand) const
    {
      Number x{};
      const char *last = value.data() + value.size();
      const auto [end, error] = std::from_chars(value.data(), last, x);
      if (error != std::errc() || end != last) refuse(demand);
      return x;
    }
    template <class T, std::size_t N> T choice(const rve::Choice<T> (&choices)[N]) const
    {
      std::string demand;
      for (const auto &[name, result] : choices) {
        if (value == name) return result;
        demand += (demand.empty() ? "" : " or ") + std::string(name);
      }
      refuse(demand);
    }
  };

  constexpr rve::Choice<bool> YES_NO[] = {{"yes", true}, {"no", false}};
  enum class Radii { Uniform, Lognormal, PowerLaw };
  constexpr rve::Choice<Radii> DISTRIBUTIONS[] = {
      {"uniform", Radii::Uniform}, {"lognormal", Radii::Lognormal}, {"power_law", Radii::PowerLaw}};
  /// Returns the number of numbers after the name of a distribution.
  int num_parameters(const std::string &distribution)
  {
    return distribution == "lognormal" ? 4 : distribution == "power_law" ? 3 : 2;
  }
  constexpr rve::Choice<int> SHAPES[] = {{"disk", 2}, {"sphere", 3}};
  constexpr rve::Choice<macro::TangentKind> KINDS[] = {{"elastic", macro::TangentKind::Elastic},
                                                       {"loading", macro::TangentKind::Loading}};

  /// Reads the value of a word according to the type of the variable that it sets.
  template <class T> void read(const Entry &e, T &x)
  {
    if constexpr (std::is_same_v<T, rve::Format>)
      x = e.choice(rve::FORMAT_CHOICES);
    else if constexpr (std::is_same_v<T, rve::Arithmetic>)
      x = e.choice(rve::ARITHMETIC_CHOICES);
    else if constexpr (std::is_same_v<T, rve::Device>)
      x = e.choice(rve::DEVICE_CHOICES);
    else if constexpr (std::is_same_v<T, rve::Arms>)
      x = e.choice(rve::ARM_CHOICES);
    else if constexpr (std::is_same_v<T, bool>)
      x = e.choice(YES_NO);
    else if constexpr (std::is_integral_v<T>)
      x = e.number<T>("a whole number");
    else
      x = e.number<double>("a number");
  }

  /// Compares the word of an entry with the known words, one after another.
  class Matcher {
   public:
    explicit Matcher(const Entry &one) : entry(one) {}

    /// Returns true if the entry has this word.
    bool is(const char *word)
    {
      known.emplace_back(word);
      if (entry.word != word) return false;
      found = true;
      return true;
    }
    /// Reads the value of the entry into `x` if the entry has this word.
    template <class T> void set(const char *word, T &x)
    {
      if (is(word)) read(entry, x);
    }
    /// Throws InputError with the known words if the entry has none of them.
    void require_known() const
    {
      if (!found)
        throw rve::InputError("unknown keyword '" + entry.word + "'" +
                              rve::did_you_mean(entry.word, known, "the keywords are"));
    }

   private:
    const Entry &entry;
    rve::Words known;
    bool found = false;
  };

  void set_option(const Entry &e, rve::Options &o)
  {
    Matcher m(e);
    m.set("format", o.format);
    m.set("arithmetic", o.arithmetic);
    m.set("device", o.device);
    m.set("device_number", o.device_number);
    m.set("threads", o.threads);
    m.set("block_size", o.block_size);
    m.set("skin", o.skin);
    m.set("arms", o.arms);
    m.set("overlap_limit", o.overlap_limit);
    m.set("energy", o.track_energy);
    m.require_known();
    if (o.device_number < 0) e.refuse("at least 0");
  }

  std::vector<double> numbers_of(const std::string &word, const std::vector<std::string> &values)
  {
    std::vector<double> numbers;
    for (const std::string &value : values) read(Entry{word, value}, numbers.emplace_back());
    return numbers;
  }

  void set_radii(const Entry &e, Order &o)
  {
    const Radii radii = e.choice(DISTRIBUTIONS);
    const std::vector<double> x = numbers_of(e.word, e.more);
    if (radii == Radii::Lognormal) {
      o.sizes = rve::LognormalRadii{x[0], x[1], x[2], x[3]};
    } else if (radii == Radii::PowerLaw) {
      o.sizes = rve::PowerLawRadii{x[0], x[1], x[2]};
    } else {
      o.recipe.radius_min = x[0];
      o.recipe.radius_max = x[1];
    }
  }

  void set_grading(const Entry &e, Order &o)
  {
    std::vector<double> x = numbers_of(e.word, e.more);
    double first = 0.0;
    read(Entry{e.word, e.value}, first);
    x.insert(x.begin(), first);
    rve::require(x.size() % 2 == 0, "grading has ", x.size(),
                 " numbers; it must have pairs of a diameter and the percent passing");
    rve::GradingCurve curve;
    for (std::size_t k = 0; k < x.size(); k += 2) curve.push_back({x[k], x[k + 1]});
    o.sizes = curve;
  }

  void set_contact(const Entry &e, rve::Material &material)
  {
    if (e.contact)
      e.contact->apply(material);
    else
      material.law = rve::contact_law_of(e.value);
  }

  void set_recipe(const Entry &e, Order &o)
  {
    rve::PackingRecipe &r = o.recipe;
    Matcher m(e);
    if (m.is("shape")) o.dimension = e.choice(SHAPES);
    m.set("grains", r.num_grains);
    m.set("seed", r.seed);
    if (m.is("radius")) set_radii(e, o);
    if (m.is("grading")) set_grading(e, o);
    m.set("radius_min", r.radius_min);
    m.set("radius_max", r.radius_max);
    m.set("pressure", r.pressure);
    if (m.is("k0")) {
      r.at_rest = e.value == "rest";
      if (!r.at_rest) r.k0 = e.number<double>("a number or rest");
    }
    m.set("void_ratio", r.void_ratio);
    m.set("void_ratio_tolerance", r.void_ratio_tolerance);
    m.set("friction_prep", r.preparation_friction);
    m.set("damping_prep", r.preparation_damping);
    m.set("tolerance", r.stress_tolerance);
    if (m.is("contact")) set_contact(e, r.material);
    m.set("device", o.options.device);
    m.set("threads", o.options.threads);
    m.set("format", o.options.format);
    for (const rve::MaterialParameter &parameter : rve::MATERIAL_PARAMETERS)
      m.set(parameter.keyword, r.material.*parameter.member);
    m.require_known();
  }

  /// The words kind and format are accepted but not read: read_tangent_options() reads them.
  void set_tangent_option(const Entry &e, macro::TangentOptions &o)
  {
    Matcher m(e);
    m.is("kind");
    m.is("format");
    m.set("probe", o.probe);
    m.set("lead", o.lead);
    m.set("spread", o.spread);
    m.set("strain_steps", o.strain_steps);
    m.set("lead_steps", o.lead_steps);
    m.set("look_steps", o.look_steps);
    m.set("most_steps", o.most_steps);
    m.set("tolerance", o.tolerance);
    m.set("damping", o.damping);
    m.require_known();
  }

  bool is_number(const std::string &word)
  {
    double x = 0.0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), x);
    return error == std::errc() && end == word.data() + word.size();
  }

  /// Cursor over the words of a text.
  class TextWords final : public rve::ContactWords {
   public:
    explicit TextWords(const std::string &text)
    {
      std::istringstream stream(text);
      for (std::string word; stream >> word;) words.push_back(word);
    }
    bool empty() const override { return position >= words.size(); }
    std::string peek(int ahead) const override
    {
      return position + ahead < words.size() ? words[position + ahead] : "";
    }
    bool is_number(int ahead) const override { return capi::is_number(peek(ahead)); }
    std::string next(const std::string &part) override
    {
      if (empty()) refuse(rve::concat("contact ", part, " has no value; it must read: ", form));
      return words[position++];
    }
    double number(const std::string &part) override
    {
      const std::string word = next(part);
      double value = 0.0;
      read(Entry{"contact " + part, word}, value);
      return value;
    }
    void set_form(const std::string &_form) override { form = "contact " + _form; }

   private:
    std::vector<std::string> words;
    std::size_t position = 0;
    std::string form;
  };

  /// Takes the values of a word. Most words have one value. *radius* and *grading* have several,
  /// and *contact* has several if its value belongs to the syntax of LAMMPS.
  Entry next_entry(TextWords &words)
  {
    Entry entry{words.next(""), ""};
    rve::require(!words.empty(), entry.word, " has no value");
    if (entry.word == "contact" && (words.is_number(1) || words.peek(0) == "hertz/material")) {
      entry.value = words.peek(0);
      rve::read_contact(words, entry.contact.emplace());
      return entry;
    }
    entry.value = words.next("");
    if (entry.word == "grading")
      while (words.is_number(0)) entry.more.push_back(words.next(""));
    const int count = entry.word == "radius" ? num_parameters(entry.value) : 0;
    for (int k = 0; k < count; ++k) {
      rve::require(!words.empty(), entry.word, " has ", k + 1, " of its ", count + 1, " values");
      entry.more.push_back(words.next(""));
    }
    return entry;
  }

  /// Splits a text into words with their values. Throws InputError if a value is missing or a word
  /// is given twice.
  std::vector<Entry> entries(const std::string &text)
  {
    std::vector<Entry> all;
    for (TextWords words(text); !words.empty();) {
      Entry entry = next_entry(words);
      for (const Entry &other : all)
        rve::require(other.word != entry.word, entry.word, " is given twice");
      all.push_back(std::move(entry));
    }
    return all;
  }

  /// Returns true if the entries have *contact* in the syntax of LAMMPS. Throws InputError if they
  /// also have a parameter that it sets.
  bool gives_contact(const std::vector<Entry> &all)
  {
    const bool given =
        std::any_of(all.begin(), all.end(), [](const Entry &e) { return e.contact.has_value(); });
    for (const rve::MaterialParameter &parameter : rve::MATERIAL_PARAMETERS)
      for (const Entry &e : all)
        rve::require(!given || !parameter.of_contact() || e.word != parameter.keyword,
                     "contact and ", e.word, " exclude each other, because contact also sets ",
                     e.word);
    return given;
  }

}    // namespace

rve::Options read_options(const std::string &text)
{
  rve::Options options;
  for (const Entry &entry : entries(text)) set_option(entry, options);
  return options;
}

TangentOrder read_tangent_options(const std::string &text, rve::Format format)
{
  const std::vector<Entry> all = entries(text);
  auto kind = macro::TangentKind::Elastic;
  for (const Entry &entry : all)
    if (entry.word == "kind")
      kind = entry.choice(KINDS);
    else if (entry.word == "format")
      read(entry, format);
  TangentOrder order{format, macro::TangentOptions::of(format, kind)};
  for (const Entry &entry : all) set_tangent_option(entry, order.options);
  order.options.check("tangent");
  return order;
}

Order read_recipe(const std::string &text)
{
  Order order;
  order.options.device = rve::Device::Cpu;
  order.options.threads = 1;
  const std::vector<Entry> all = entries(text);
  for (const Entry &entry : all) set_recipe(entry, order);
  const auto has = [&](const std::string &word) {
    return std::any_of(all.begin(), all.end(), [&](const Entry &e) { return e.word == word; });
  };
  if (has("tolerance")) order.recipe.unbalanced_tolerance = order.recipe.stress_tolerance;
  rve::Material &material = order.recipe.material;
  for (const std::string bound : {"radius_min", "radius_max"})
    rve::require(!has("radius") || !has(bound), "radius and ", bound,
                 " exclude each other: radius uniform lo hi gives both bounds");
  for (const std::string other : {"radius", "radius_min", "radius_max"})
    rve::require(!has("grading") || !has(other), "grading and ", other,
                 " exclude each other: both give sizes of grains");
  const bool is_linear = material.law == rve::ContactLaw::Linear;
  const bool contact = gives_contact(all);
  std::string missing;
  for (const std::string needed :
       {"grains", "radius_min", "radius_max", "density", "pressure", "kn"})
    if (!has(needed) && !((has("radius") || has("grading")) && needed.rfind("radius", 0) == 0) &&
        (needed != "kn" || (is_linear && !contact)))
      missing += (missing.empty() ? "" : ", ") + needed;
  rve::require(missing.empty(), "the recipe lacks ", missing);
  // the rules and defaults below are those of create_rve
  rve::require(!order.recipe.void_ratio || order.recipe.preparation_friction == 0.0,
               "void_ratio and friction_prep exclude each other: void_ratio determines the "
               "preparation friction; friction_prep is ",
               order.recipe.preparation_friction);
  if (is_linear && !contact && !has("kt"))
    material.tangential_stiffness = material.normal_stiffness;
  if (material.rolling_friction > 0.0 && !contact && !has("kr")) {
    rve::require(is_linear, "rolling_friction is ", material.rolling_friction,
                 " [-] without a kr [force/length], and contact ", rve::word_of(material.law),
                 " has no kt to replace it; give kr, or rolling_friction 0");
    material.rolling_stiffness = material.tangential_stiffness;
  }
  order.options.contacts = rve::contacts_of(material);
  order.options.contacts.dimension = order.dimension;
  if (order.sizes && order.dimension == 2)
    rve::set_sizes<2>(order.recipe, *order.sizes);
  else if (order.sizes)
    rve::set_sizes<3>(order.recipe, *order.sizes);
  return order;
}

int grains_needed(const std::string &sizes)
{
  Order order;
  for (const Entry &entry : entries(sizes)) {
    rve::require(entry.word == "shape" || entry.word == "radius" || entry.word == "grading",
                 "unknown keyword '", entry.word, "'; the keywords are shape, radius, grading");
    set_recipe(entry, order);
  }
  const rve::PackingRecipe &recipe = order.recipe;
  if (!order.sizes && recipe.radius_max > 0.0)    // uniform radii: the exponent is 0
    order.sizes = rve::PowerLawRadii{0.0, recipe.radius_min, recipe.radius_max};
  rve::require(order.sizes.has_value(), "radius or grading must be given");
  return rve::SizeDistribution(*order.sizes, order.dimension).grains_needed();
}

std::string contact_words(const std::string &contact, int dimension)
{
  rve::require(dimension == 2 || dimension == 3, "dimension is ", dimension, "; it must be 2 or 3");
  TextWords words(contact);
  rve::GivenMaterial given;
  rve::read_contact(words, given);
  rve::require(words.empty(), "found '", words.peek(0), "' after the words of contact");
  std::string text = std::string("contact ") + rve::word_of(*given.law);
  for (const rve::MaterialParameter &parameter : rve::MATERIAL_PARAMETERS) {
    const double value = given[parameter.member].value_or(0.0);
    if (!parameter.of_contact() || (value == 0.0 && !parameter.is_of(*given.law, dimension)))
      continue;
    char digits[32];
    std::snprintf(digits, sizeof(digits), "%.17g", value);
    text += std::string(" ") + parameter.keyword + " " + digits;
  }
  return text;
}

rve::MaterialMember parameter_named(const std::string &keyword, rve::ContactLaw law, int dimension)
{
  rve::Words known;
  for (const rve::MaterialParameter &parameter : rve::MATERIAL_PARAMETERS) {
    if (!parameter.is_of(law, dimension)) continue;
    if (keyword == parameter.keyword) return parameter.member;
    known.emplace_back(parameter.keyword);
  }
  throw rve::InputError("there is no parameter '" + keyword + "' of " +
                        (dimension == 2 ? "disks" : "spheres") + " with contact law " +
                        rve::word_of(law) +
                        rve::did_you_mean(keyword, known, "the parameters are"));
}

}    // namespace capi
