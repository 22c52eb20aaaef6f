// SPDX-License-Identifier: GPL-2.0-only
#include "capi/words.h"

#include "rve/core/error.h"
#include "rve/core/suggestion.h"

#include <charconv>
#include <functional>
#include <map>
#include <sstream>
#include <utility>
#include <vector>

namespace capi {

namespace {

  /// A word and its value, or values.
  struct Entry {
    std::string word, value;
    std::vector<std::string> more = {};    ///< those behind the first one

    [[noreturn]] void refuse(const std::string &demand) const
    {
      throw rve::InputError(word + " is '" + value + "'; it must be " + demand);
    }
    double number(const char *demand = "a number") const
    {
      double x = 0.0;
      const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), x);
      if (error != std::errc() || end != value.data() + value.size()) refuse(demand);
      return x;
    }
    template <class Integer = int> Integer integer() const
    {
      Integer n = 0;
      const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), n);
      if (error != std::errc() || end != value.data() + value.size()) refuse("a whole number");
      return n;
    }
    template <class T> T choice(const std::vector<std::pair<const char *, T>> &choices) const
    {
      std::string demand;
      for (const auto &[name, result] : choices) {
        if (value == name) return result;
        demand += (demand.empty() ? "" : " or ") + std::string(name);
      }
      refuse(demand);
    }
    /// The word with one of the values behind the first.
    Entry part(std::size_t k) const { return {word, more[k]}; }
  };

  /// Words that have more than one value, and how many.
  using Lengths = std::map<std::string, std::size_t>;

  std::vector<Entry> entries(const std::string &text, const Lengths &lengths = {})
  {
    std::vector<Entry> all;
    std::istringstream stream(text);
    for (std::string word; stream >> word;) {
      Entry entry{word, ""};
      rve::require(static_cast<bool>(stream >> entry.value), word + " has no value");
      const auto length = lengths.find(word);
      for (std::size_t k = 1; length != lengths.end() && k < length->second; ++k)
        rve::require(static_cast<bool>(stream >> entry.more.emplace_back()), [&] {
          return word + " has " + std::to_string(k) + " of its " + std::to_string(length->second) +
              " values";
        });
      for (const Entry &other : all) rve::require(other.word != word, word + " is given twice");
      all.push_back(std::move(entry));
    }
    return all;
  }

  template <class Target>
  using Table = std::vector<std::pair<const char *, std::function<void(const Entry &, Target &)>>>;

  /// Whether the table has the word.
  template <class Target> bool take(const Table<Target> &table, const Entry &entry, Target &target)
  {
    for (const auto &[word, read] : table)
      if (entry.word == word) {
        read(entry, target);
        return true;
      }
    return false;
  }

  [[noreturn]] void refuse_unknown(const std::string &word, const rve::Words &known)
  {
    throw rve::InputError("there is no word '" + word + "'" +
                          rve::did_you_mean(word, known, "there are"));
  }

  rve::Format format_of(const Entry &e)
  {
    return e.choice<rve::Format>({{"fast", rve::Format::Fast},
                                  {"mixed", rve::Format::Mixed},
                                  {"double", rve::Format::Double},
                                  {"single", rve::Format::Single}});
  }

  rve::Device device_of(const Entry &e)
  {
    return e.choice<rve::Device>(
        {{"auto", rve::Device::Auto}, {"cpu", rve::Device::Cpu}, {"cuda", rve::Device::Cuda}});
  }

  const Table<rve::Options> OPTIONS = {
      {"format", [](const Entry &e, rve::Options &o) { o.format = format_of(e); }},
      {"arithmetic",
       [](const Entry &e, rve::Options &o) {
         o.arithmetic = e.choice<rve::Arithmetic>(
             {{"strict", rve::Arithmetic::Strict}, {"relaxed", rve::Arithmetic::Relaxed}});
       }},
      {"device", [](const Entry &e, rve::Options &o) { o.device = device_of(e); }},
      {"device_number",
       [](const Entry &e, rve::Options &o) {
         o.device_number = e.integer();
         if (o.device_number < 0) e.refuse("at least 0");
       }},
      {"threads", [](const Entry &e, rve::Options &o) { o.threads = e.integer(); }},
      {"block_size", [](const Entry &e, rve::Options &o) { o.block_size = e.integer(); }},
      {"skin", [](const Entry &e, rve::Options &o) { o.skin = e.number(); }},
      {"arms",
       [](const Entry &e, rve::Options &o) {
         o.arms =
             e.choice<rve::Arms>({{"contact", rve::Arms::Contact}, {"lammps", rve::Arms::Lammps}});
       }},
      {"overlap_limit", [](const Entry &e, rve::Options &o) { o.overlap_limit = e.number(); }},
      {"energy", [](const Entry &e, rve::Options &o) {
         o.track_energy = e.choice<bool>({{"yes", true}, {"no", false}});
       }}};

  const Table<Order> RECIPE = {
      {"shape",
       [](const Entry &e, Order &o) {
         o.dimension = e.choice<int>({{"disk", 2}, {"sphere", 3}});
       }},
      {"grains", [](const Entry &e, Order &o) { o.recipe.num_grains = e.integer(); }},
      {"seed", [](const Entry &e, Order &o) { o.recipe.seed = e.integer<std::uint64_t>(); }},
      {"radius",
       [](const Entry &e, Order &o) {
         e.choice<bool>({{"uniform", true}});
         o.recipe.radius_min = e.part(0).number();
         o.recipe.radius_max = e.part(1).number();
       }},
      {"radius_min", [](const Entry &e, Order &o) { o.recipe.radius_min = e.number(); }},
      {"radius_max", [](const Entry &e, Order &o) { o.recipe.radius_max = e.number(); }},
      {"pressure", [](const Entry &e, Order &o) { o.recipe.pressure = e.number(); }},
      {"k0",
       [](const Entry &e, Order &o) {
         o.recipe.at_rest = e.value == "rest";
         if (!o.recipe.at_rest) o.recipe.k0 = e.number("a number or rest");
       }},
      {"void_ratio", [](const Entry &e, Order &o) { o.recipe.void_ratio = e.number(); }},
      {"void_ratio_tolerance",
       [](const Entry &e, Order &o) { o.recipe.void_ratio_tolerance = e.number(); }},
      {"friction_prep",
       [](const Entry &e, Order &o) { o.recipe.preparation_friction = e.number(); }},
      {"damping_prep", [](const Entry &e, Order &o) { o.recipe.preparation_damping = e.number(); }},
      {"tolerance",
       [](const Entry &e, Order &o) {
         o.recipe.stress_tolerance = o.recipe.unbalanced_tolerance = e.number();
       }},
      {"contact",
       [](const Entry &e, Order &o) { o.recipe.material.law = rve::contact_law_of(e.value); }},
      {"device", [](const Entry &e, Order &o) { o.options.device = device_of(e); }},
      {"threads", [](const Entry &e, Order &o) { o.options.threads = e.integer(); }},
      {"format", [](const Entry &e, Order &o) { o.options.format = format_of(e); }}};

  template <class Target> void add_words(const Table<Target> &table, rve::Words &words)
  {
    for (const auto &row : table) words.emplace_back(row.first);
  }

}    // namespace

rve::Options read_options(const std::string &text)
{
  rve::Options options;
  for (const Entry &entry : entries(text)) {
    if (take(OPTIONS, entry, options)) continue;
    rve::Words known;
    add_words(OPTIONS, known);
    refuse_unknown(entry.word, known);
  }
  return options;
}

TangentOrder read_tangent_options(const std::string &text, rve::Format format)
{
  using Options = macro::TangentOptions;
  const std::vector<Entry> all = entries(text);
  auto kind = macro::TangentKind::Elastic;
  for (const Entry &entry : all)
    if (entry.word == "kind")
      kind = entry.choice<macro::TangentKind>(
          {{"elastic", macro::TangentKind::Elastic}, {"loading", macro::TangentKind::Loading}});
    else if (entry.word == "format")
      format = format_of(entry);
  const Table<Options> table = {
      {"kind", [](const Entry &, Options &) {}},
      {"format", [](const Entry &, Options &) {}},
      {"probe", [](const Entry &e, Options &o) { o.probe = e.number(); }},
      {"lead", [](const Entry &e, Options &o) { o.lead = e.number(); }},
      {"spread", [](const Entry &e, Options &o) { o.spread = e.number(); }},
      {"strain_steps", [](const Entry &e, Options &o) { o.strain_steps = e.integer(); }},
      {"lead_steps", [](const Entry &e, Options &o) { o.lead_steps = e.integer(); }},
      {"look_steps", [](const Entry &e, Options &o) { o.look_steps = e.integer(); }},
      {"most_steps", [](const Entry &e, Options &o) { o.most_steps = e.integer(); }},
      {"tolerance", [](const Entry &e, Options &o) { o.tolerance = e.number(); }},
      {"damping", [](const Entry &e, Options &o) { o.damping = e.number(); }}};
  Options options = Options::of(format, kind);
  for (const Entry &entry : all) {
    if (take(table, entry, options)) continue;
    rve::Words known;
    add_words(table, known);
    refuse_unknown(entry.word, known);
  }
  options.check("tangent");
  return {format, options};
}

Order read_recipe(const std::string &text)
{
  Order order;
  order.options.device = rve::Device::Cpu;
  order.options.threads = 1;
  const std::vector<Entry> all = entries(text, {{"radius", 3}});
  const auto has = [&](const std::string &word) {
    for (const Entry &entry : all)
      if (entry.word == word) return true;
    return false;
  };
  rve::Material &material = order.recipe.material;
  for (const Entry &entry : all) {
    if (take(RECIPE, entry, order)) continue;
    const rve::MaterialParameter *named = nullptr;
    rve::Words known;
    add_words(RECIPE, known);
    for (const rve::MaterialParameter &parameter : rve::MATERIAL_PARAMETERS) {
      known.emplace_back(parameter.keyword);
      if (entry.word == parameter.keyword) named = &parameter;
    }
    if (!named) refuse_unknown(entry.word, known);
    material.*named->member = entry.number();
  }
  for (const std::string bound : {"radius_min", "radius_max"})
    rve::require(!has("radius") || !has(bound), [&] {
      return "radius and " + bound + " exclude each other: radius uniform lo hi gives both bounds";
    });
  std::string missing;
  for (const std::string needed : {"grains", "radius_min", "radius_max", "density", "pressure"})
    if (!has(needed) && !(needed.rfind("radius", 0) == 0 && has("radius")))
      missing += (missing.empty() ? "" : ", ") + needed;
  if (material.law == rve::ContactLaw::Linear && !has("kn"))
    missing += (missing.empty() ? "" : ", ") + std::string("kn");
  rve::require(missing.empty(), "the recipe lacks " + missing);
  // the rest is as create_rve has it
  rve::require(!order.recipe.void_ratio || order.recipe.preparation_friction == 0.0, [&] {
    return "void_ratio finds friction_prep itself; friction_prep is " +
        rve::number(order.recipe.preparation_friction) + ", give one of them";
  });
  if (material.law == rve::ContactLaw::Linear && !has("kt"))
    material.tangential_stiffness = material.normal_stiffness;
  if (material.rolling_friction > 0.0 && !has("kr")) {
    rve::require(material.law == rve::ContactLaw::Linear, [&] {
      return "rolling_friction is " + rve::number(material.rolling_friction) +
          " [-] without a kr [force/length], which contact " + rve::word_of(material.law) +
          " does not say as kt does for hooke; it must be given, or 0";
    });
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
