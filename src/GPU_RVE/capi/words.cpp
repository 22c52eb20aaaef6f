// SPDX-License-Identifier: GPL-2.0-only
#include "capi/words.h"

#include "rve/core/error.h"
#include "rve/core/suggestion.h"

#include <algorithm>
#include <charconv>
#include <functional>
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

  /// Row of a table of words: the word and the function that reads its value into `Target`.
  template <class Target> struct Row {
    const char *word;
    std::function<void(const Entry &, Target &)> read;
  };
  template <class Target> using Table = std::vector<Row<Target>>;

  /// Returns a row that stores the value in a member of the target, or in a member of that member:
  /// `first` and `members` are the chain of pointers to members.
  template <class Target, class T, class... Members>
  Row<Target> row(const char *word, T Target::*first, Members... members)
  {
    return {word,
            [=](const Entry &e, Target &target) { read(e, ((target.*first).*....*members)); }};
  }

  Table<rve::Options> options_table()
  {
    using Options = rve::Options;
    return {row("format", &Options::format),
            row("arithmetic", &Options::arithmetic),
            row("device", &Options::device),
            {"device_number",
             [](const Entry &e, Options &o) {
               read(e, o.device_number);
               if (o.device_number < 0) e.refuse("at least 0");
             }},
            row("threads", &Options::threads),
            row("block_size", &Options::block_size),
            row("skin", &Options::skin),
            row("arms", &Options::arms),
            row("overlap_limit", &Options::overlap_limit),
            row("energy", &Options::track_energy)};
  }

  Table<Order> recipe_table()
  {
    using Recipe = rve::PackingRecipe;
    const auto of_recipe = [](const char *word, auto member) {
      return row(word, &Order::recipe, member);
    };
    Table<Order> table = {
        {"shape", [](const Entry &e, Order &o) { o.dimension = e.choice(SHAPES); }},
        of_recipe("grains", &Recipe::num_grains),
        of_recipe("seed", &Recipe::seed),
        {"radius",
         [](const Entry &e, Order &o) {
           e.choice(DISTRIBUTIONS);
           read({e.word, e.more[0]}, o.recipe.radius_min);
           read({e.word, e.more[1]}, o.recipe.radius_max);
         }},
        of_recipe("radius_min", &Recipe::radius_min),
        of_recipe("radius_max", &Recipe::radius_max),
        of_recipe("pressure", &Recipe::pressure),
        {"k0",
         [](const Entry &e, Order &o) {
           o.recipe.at_rest = e.value == "rest";
           if (!o.recipe.at_rest) o.recipe.k0 = e.number<double>("a number or rest");
         }},
        of_recipe("void_ratio", &Recipe::void_ratio),
        of_recipe("void_ratio_tolerance", &Recipe::void_ratio_tolerance),
        of_recipe("friction_prep", &Recipe::preparation_friction),
        of_recipe("damping_prep", &Recipe::preparation_damping),
        {"tolerance",
         [](const Entry &e, Order &o) {
           read(e, o.recipe.stress_tolerance);
           o.recipe.unbalanced_tolerance = o.recipe.stress_tolerance;
         }},
        {"contact",
         [](const Entry &e, Order &o) { o.recipe.material.law = rve::contact_law_of(e.value); }},
        row("device", &Order::options, &rve::Options::device),
        row("threads", &Order::options, &rve::Options::threads),
        row("format", &Order::options, &rve::Options::format)};
    for (const rve::MaterialParameter &parameter : rve::MATERIAL_PARAMETERS)
      table.push_back(row(parameter.keyword, &Order::recipe, &Recipe::material, parameter.member));
    return table;
  }

  Table<TangentOrder> tangent_table()
  {
    using Options = macro::TangentOptions;
    const auto of_options = [](const char *word, auto member) {
      return row(word, &TangentOrder::options, member);
    };
    return {{"kind", [](const Entry &, TangentOrder &) {}},    // kind and format are read before
            {"format", [](const Entry &, TangentOrder &) {}},
            of_options("probe", &Options::probe),
            of_options("lead", &Options::lead),
            of_options("spread", &Options::spread),
            of_options("strain_steps", &Options::strain_steps),
            of_options("lead_steps", &Options::lead_steps),
            of_options("look_steps", &Options::look_steps),
            of_options("most_steps", &Options::most_steps),
            of_options("tolerance", &Options::tolerance),
            of_options("damping", &Options::damping)};
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

  /// Reads all entries by a table. Throws InputError if it does not have a word.
  template <class Target>
  void read_all(const std::vector<Entry> &all, const Table<Target> &table, Target &target)
  {
    for (const Entry &entry : all) {
      const auto found = std::find_if(table.begin(), table.end(),
                                      [&](const auto &one) { return entry.word == one.word; });
      if (found == table.end()) {
        rve::Words known;
        for (const auto &one : table) known.emplace_back(one.word);
        throw rve::InputError("there is no word '" + entry.word + "'" +
                              rve::did_you_mean(entry.word, known, "there are"));
      }
      found->read(entry, target);
    }
  }

}    // namespace

rve::Options read_options(const std::string &text)
{
  rve::Options options;
  read_all(entries(text), options_table(), options);
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
  read_all(all, tangent_table(), order);
  order.options.check("tangent");
  return order;
}

Order read_recipe(const std::string &text)
{
  Order order;
  order.options.device = rve::Device::Cpu;
  order.options.threads = 1;
  const std::vector<Entry> all = entries(text, "radius");
  read_all(all, recipe_table(), order);
  const auto has = [&](const std::string &word) {
    return std::any_of(all.begin(), all.end(), [&](const Entry &e) { return e.word == word; });
  };
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
               "void_ratio finds friction_prep itself; friction_prep is ",
               order.recipe.preparation_friction, ", give one of them");
  if (is_linear && !has("kt")) material.tangential_stiffness = material.normal_stiffness;
  if (material.rolling_friction > 0.0 && !has("kr")) {
    rve::require(is_linear, "rolling_friction is ", material.rolling_friction,
                 " [-] without a kr [force/length], which contact ", rve::word_of(material.law),
                 " does not say as kt does for hooke; it must be given, or 0");
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
  throw rve::InputError("there is no parameter '" + keyword + "' of such grains" +
                        rve::did_you_mean(keyword, known, "there are"));
}

}    // namespace capi
