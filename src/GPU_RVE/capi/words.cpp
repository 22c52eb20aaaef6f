// SPDX-License-Identifier: GPL-2.0-only
#include "capi/words.h"

#include "rve/core/error.h"
#include "rve/core/suggestion.h"

#include <algorithm>
#include <charconv>
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
  constexpr rve::Choice<bool> DISTRIBUTIONS[] = {{"uniform", true}};
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

  void set_recipe(const Entry &e, Order &o)
  {
    rve::PackingRecipe &r = o.recipe;
    Matcher m(e);
    if (m.is("shape")) o.dimension = e.choice(SHAPES);
    m.set("grains", r.num_grains);
    m.set("seed", r.seed);
    if (m.is("radius")) {
      e.choice(DISTRIBUTIONS);
      read({e.word, e.more[0]}, r.radius_min);
      read({e.word, e.more[1]}, r.radius_max);
    }
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
    if (m.is("contact")) r.material.law = rve::contact_law_of(e.value);
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

  /// Splits a text into words with one value each. The word `triple` has three values. Throws
  /// InputError if a value is missing or a word is given twice.
  std::vector<Entry> entries(const std::string &text, const std::string &triple = "")
  {
    std::vector<Entry> all;
    std::istringstream stream(text);
    for (std::string word; stream >> word;) {
      Entry entry{word, ""};
      rve::require(static_cast<bool>(stream >> entry.value), word, " has no value");
      for (int k = 1; word == triple && k < 3; ++k)
        rve::require(static_cast<bool>(stream >> entry.more.emplace_back()), word, " has ", k,
                     " of its 3 values");
      for (const Entry &other : all) rve::require(other.word != word, word, " is given twice");
      all.push_back(std::move(entry));
    }
    return all;
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
  const std::vector<Entry> all = entries(text, "radius");
  for (const Entry &entry : all) set_recipe(entry, order);
  const auto has = [&](const std::string &word) {
    return std::any_of(all.begin(), all.end(), [&](const Entry &e) { return e.word == word; });
  };
  if (has("tolerance")) order.recipe.unbalanced_tolerance = order.recipe.stress_tolerance;
  rve::Material &material = order.recipe.material;
  for (const std::string bound : {"radius_min", "radius_max"})
    rve::require(!has("radius") || !has(bound), "radius and ", bound,
                 " exclude each other: radius uniform lo hi gives both bounds");
  const bool is_linear = material.law == rve::ContactLaw::Linear;
  std::string missing;
  for (const std::string needed :
       {"grains", "radius_min", "radius_max", "density", "pressure", "kn"})
    if (!has(needed) && !(has("radius") && needed.rfind("radius", 0) == 0) &&
        (needed != "kn" || is_linear))
      missing += (missing.empty() ? "" : ", ") + needed;
  rve::require(missing.empty(), "the recipe lacks ", missing);
  // the rules and defaults below are those of create_rve
  rve::require(!order.recipe.void_ratio || order.recipe.preparation_friction == 0.0,
               "void_ratio and friction_prep exclude each other: void_ratio determines the "
               "preparation friction; friction_prep is ",
               order.recipe.preparation_friction);
  if (is_linear && !has("kt")) material.tangential_stiffness = material.normal_stiffness;
  if (material.rolling_friction > 0.0 && !has("kr")) {
    rve::require(is_linear, "rolling_friction is ", material.rolling_friction,
                 " [-] without a kr [force/length], and contact ", rve::word_of(material.law),
                 " has no kt to replace it; give kr, or rolling_friction 0");
    material.rolling_stiffness = material.tangential_stiffness;
  }
  order.options.contacts = rve::contacts_of(material);
  order.options.contacts.dimension = order.dimension;
  return order;
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
