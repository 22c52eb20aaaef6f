// SPDX-License-Identifier: GPL-2.0-only
#include "rve/core/suggestion.h"
#include "rve/engine/contact_model.h"
#include "rve/engine/dimension_words.h"
#include "rve/engine/files.h"
#include "rve/engine/packing_io.h"
#include "rve/engine/packing_text.h"

#include <cerrno>
#include <cmath>
#include <fstream>
#include <map>

namespace rve {

namespace {

  /// Reader of the statements of a text file with their line numbers.
  class StatementReader {
   public:
    explicit StatementReader(const std::string &_path) : path(_path)
    {
      require_readable(path, "packing file");
      file.open(path);
      require(file.is_open(), "cannot open packing file ", path, ": ", reason_of(errno));
    }

    /// Moves to the next statement. `expected` names it in the error message if the file ends
    /// before it.
    void next(const std::string &expected)
    {
      add_statement(words, of_packing);
      add_statement(words, of_file);
      if (!next_words()) fail("file ends where ", expected, " was expected");
    }

    /// Marks the present statement as the first one of a packing. The checksum of the packing
    /// begins here.
    void begin_packing() { of_packing = {}; }

    /// Moves to a line with a checksum and checks it. The checksum is that of the preceding
    /// statements of the packing or of the whole file.
    void read_checksum(bool whole_file, const std::string &last_statement)
    {
      next("'checksum'");
      if (word(0) == last_statement)
        fail("there is no checksum before '", last_statement,
             "': the file is damaged, or was written by hand or by an earlier version; to read it "
             "without this check, add the line 'checksum none' before '",
             last_statement, "'");
      require_keyword("checksum", 2, "checksum digits");
      if (word(1) == "none") return;
      const std::string found(word(1));
      if (found.size() != 16 || found.find_first_not_of("0123456789abcdef") != std::string::npos)
        fail("checksum is '", found, "'; it must be 16 hexadecimal digits, or none");
      const std::string expected = hexadecimal((whole_file ? of_file : of_packing).value());
      if (found != expected)
        fail("checksum is ", found, ", but the statements before it have checksum ", expected,
             ": the file is damaged, or was changed by hand; to read it without this check, "
             "replace the checksum by 'checksum none'");
    }

    /// Requires that the present statement is the last one.
    void require_end()
    {
      const std::string last(word(0));
      if (next_words())
        fail("found '", word(0), "' after '", last, "'; only blank lines and comments may follow");
    }

    const std::string_view &word(std::size_t k) const { return words[k]; }
    std::size_t num_words() const { return words.size(); }

    void require_words(std::size_t count, const std::string &form) const
    {
      if (words.size() != count)
        fail("'", text, "' has ", words.size(), " words; expected '", form, "'");
    }

    void require_keyword(const std::string &keyword, std::size_t count,
                         const std::string &form) const
    {
      if (word(0) != keyword) fail("found '", word(0), "' where '", keyword, "' was expected");
      require_words(count, form);
    }

    double finite_number(std::size_t k, const std::string &what) const
    {
      double value = 0.0;
      if (!convert(k, value)) fail(what, " is '", word(k), "'; it must be a number");
      if (!std::isfinite(value)) fail(what, " is ", value, "; it must be finite");
      return value;
    }

    template <class Integer>
    Integer integer(std::size_t k, const std::string &what, Integer least, Integer most) const
    {
      Integer value = 0;
      if (!convert(k, value) || value < least || value > most)
        fail(what, " is '", word(k), "'; it must be an integer from ", least, " to ", most);
      return value;
    }

    /// Throws InputError with the line and the text of these parts.
    template <class... Parts> [[noreturn]] void fail(const Parts &...parts) const
    {
      throw InputError(concat(path, ":", line, ": ", parts...));
    }

   private:
    std::string path;
    std::ifstream file;
    std::string text;
    std::vector<std::string_view> words;
    Checksum of_packing, of_file;    // checksums of the statements before the present one
    int line = 0;

    /// Moves to the next line with a statement; returns false at the end of the file.
    bool next_words()
    {
      do {
        if (!std::getline(file, text)) {
          words.clear();
          return false;
        }
        ++line;
        make_plain();
        split(text, words);
      } while (words.empty());
      return true;
    }

    /// Removes a byte-order mark and checks that the line is plain text. Lines are read one by one,
    /// since libraries can exceed the memory.
    void make_plain()
    {
      if (line == 1 && text.compare(0, 3, "\xEF\xBB\xBF") == 0) text.erase(0, 3);
      if (text.find('\0') != std::string::npos)
        fail("the line has a byte 0; the file must be plain text, not binary or UTF-16");
      const std::size_t carriage_return = text.find('\r');
      if (carriage_return != std::string::npos && carriage_return + 1 < text.size())
        fail("the line has a carriage return inside; lines must end with a line feed");
    }

    template <class T> bool convert(std::size_t k, T &value) const
    {
      const char *end = word(k).data() + word(k).size();
      const auto [stop, error] = std::from_chars(word(k).data(), end, value);
      return error == std::errc() && stop == end;
    }
  };

  /// Reads the material and moves to the first statement after it.
  template <int D> void read_material(StatementReader &reader, Material &material)
  {
    const std::vector<MaterialLine> lines = material_lines<D>();
    std::map<std::string, bool> seen;
    const auto missing = [&] {
      std::string names;
      for (const MaterialLine &e : lines)
        if (e.parameter->is_of(material.law, D) && !e.optional && !seen[e.name])
          names += std::string(names.empty() ? "" : ", ") + e.name;
      return names;
    };
    for (bool is_first = true;; is_first = false) {
      const bool complete = missing().empty();
      reader.next(complete ? "'cell'" : "a material value");
      const std::string name(reader.word(0));
      if (name == LAW_STATEMENT) {
        if (!is_first)
          reader.fail(name, " is after another material value; it must be the first one");
        reader.require_words(2, name + " word");
        try {
          material.law = contact_law_of(std::string(reader.word(1)));
        } catch (const InputError &problem) {
          reader.fail(problem.what());
        }
        continue;
      }
      const auto entry = std::find_if(lines.begin(), lines.end(),
                                      [&](const MaterialLine &e) { return name == e.name; });
      if (entry == lines.end()) {
        if (name == "cell" && complete) return;
        Words known = {"cell"};
        for (const MaterialLine &e : lines)
          if (e.parameter->is_of(material.law, D)) known.emplace_back(e.name);
        reader.fail("'", name, "' is not a material value",
                    D == 2 ? "" : std::string(" of ") + DimensionWords<D>::grains,
                    name == "cell" ? "; still missing: " + missing()
                                   : did_you_mean(name, known, "the material values are"));
      }
      if (!entry->parameter->is_of(material.law, D))
        reader.fail("contact law ", word_of(material.law), " has no material value ", name);
      if (seen[name]) reader.fail(name, " is given twice");
      seen[name] = true;
      reader.require_words(2, name + " value");
      const double value = reader.finite_number(1, name);
      if (value < 0.0)
        reader.fail(name, " is ", value, " ", entry->unit, "; it must not be negative");
      entry->of(material) = value;
    }
  }

  template <int D>
  void read_tensor(StatementReader &reader, const std::string &name, Tensor<double, D> &tensor)
  {
    for (int a = 0; a < D; ++a) {
      reader.next("row " + std::to_string(a + 1) + " of " + name);
      reader.require_words(D, std::string(DimensionWords<D>::number) + " numbers of " + name);
      for (int b = 0; b < D; ++b) tensor(a, b) = reader.finite_number(b, "a component of " + name);
    }
  }

  template <int D> void read_grains(StatementReader &reader, int num_grains, RveStateOf<D> &state)
  {
    constexpr int SPINS = Space<D>::spins;
    // Arrays grow with the lines, so that a damaged count gives an error message and not a huge
    // allocation.
    std::vector<bool> seen;
    for (int k = 0; k < num_grains; ++k) {
      reader.next("grain line " + std::to_string(k + 1) + " of " + std::to_string(num_grains));
      reader.require_words(2 + 2 * D + SPINS,
                           "id radius " + for_axes<D>("s_", "*2^64", " ") + " " +
                               for_axes<D>("c_", "", " ") + " " + DimensionWords<D>::spin);
      const int id = reader.integer<int>(0, "grain id", 1, num_grains);
      const std::size_t i = static_cast<std::size_t>(id) - 1;
      if (i >= seen.size()) {
        seen.resize(i + 1, false);
        state.radius.resize(i + 1);
        state.fractional.resize(D * (i + 1));
        state.velocity.resize(D * (i + 1));
        state.spin.resize(SPINS * (i + 1));
      }
      if (seen[i]) reader.fail("grain ", id, " is given twice");
      seen[i] = true;
      state.radius[i] = reader.finite_number(1, "radius");
      if (state.radius[i] <= 0.0)
        reader.fail("radius is ", state.radius[i], " [length]; it must be greater than 0");
      for (int a = 0; a < D; ++a) {
        state.fractional[D * i + a] =
            reader.integer<std::uint64_t>(2 + a, "fractional coordinate", 0, UINT64_MAX);
        state.velocity[D * i + a] = reader.finite_number(2 + D + a, "peculiar velocity");
      }
      for (int k = 0; k < SPINS; ++k)
        state.spin[SPINS * i + k] = reader.finite_number(2 + 2 * D + k, "spin");
    }
  }

  template <int D>
  void read_contacts(StatementReader &reader, int num_contacts, RveStateOf<D> &state)
  {
    constexpr int LEAST = least_remembered<D>();
    constexpr int MOST = static_cast<int>(std::size(pair_memory<D>()));
    for (int k = 0; k < num_contacts; ++k) {
      reader.next("contact line " + std::to_string(k + 1) + " of " + std::to_string(num_contacts));
      const int remembered = std::clamp(static_cast<int>(reader.num_words()) - 2, LEAST, MOST);
      std::string form = "id id";
      for (int m = 0; m < LEAST; ++m) form += std::string(" ") + pair_memory<D>()[m].name;
      reader.require_words(2 + remembered, form);
      PairOf<D> pair{};
      pair.first = reader.integer<std::int32_t>(0, "grain id", 1, state.num_grains()) - 1;
      pair.second = reader.integer<std::int32_t>(1, "grain id", 1, state.num_grains()) - 1;
      if (pair.first == pair.second)
        reader.fail("contact connects grain ", pair.first + 1, " to itself");
      for (int m = 0; m < remembered; ++m) {
        const RememberedNumber<D> &number = pair_memory<D>()[m];
        number.of(pair) = reader.finite_number(2 + m, number.what);
      }
      state.pairs.push_back(pair);
    }
  }

  /// Reads the dimension of a packing. The present statement of the reader is `gpu_rve_packing`.
  /// Reading ends at the last statement that the function needs.
  int read_dimension(StatementReader &reader)
  {
    reader.require_keyword("gpu_rve_packing", 2, "gpu_rve_packing version");
    const int version = reader.integer<int>(1, "version of the packing file", VERSION_OF_DISKS,
                                            VERSION_WITH_DIMENSION);
    if (version == VERSION_OF_DISKS) return 2;
    reader.next("'dimension'");
    reader.require_keyword("dimension", 2, "dimension 2 or 3");
    return reader.integer<int>(1, "dimension of the packing", 2, 3);
  }

  std::string grains_of(int dimension)
  {
    return std::string(dimension == 2 ? DimensionWords<2>::grains : DimensionWords<3>::grains) +
        " (dimension " + std::to_string(dimension) + ")";
  }

  /// Reads a packing up to its statement `end`. The present statement of the reader is
  /// `gpu_rve_packing`.
  template <int D> RveStateOf<D> read_packing_statements(StatementReader &reader)
  {
    RveStateOf<D> state;
    reader.begin_packing();
    const int dimension = read_dimension(reader);
    if (dimension != D)
      reader.fail("the packing has ", grains_of(dimension), "; a packing of ", grains_of(D),
                  " was expected");
    reader.next("'material'");
    reader.require_keyword("material", 1, "material");
    read_material<D>(reader, state.material);
    reader.require_keyword("cell", 1, "cell");
    read_tensor(reader, "cell", state.cell);
    reader.next("'grains'");
    const auto read_optional = [&](const std::string &name, Tensor<double, D> &tensor) {
      if (reader.word(0) != name) return;
      reader.require_words(1, name);
      read_tensor(reader, name, tensor);
      reader.next("'grains'");
    };
    read_optional("deformation", state.deformation);
    read_optional("servo_velocity_gradient", state.servo_velocity_gradient);
    if (reader.word(0) == "largest_contact_force") {
      reader.require_words(2, "largest_contact_force value");
      state.largest_contact_force = reader.finite_number(1, "largest contact force");
      reader.next("'grains'");
    }
    if (reader.word(0) != "grains")
      reader.fail("found '", reader.word(0), "' where 'grains' was expected",
                  did_you_mean(
                      reader.word(0),
                      {"deformation", "servo_velocity_gradient", "largest_contact_force", "grains"},
                      "the statements here are, in this order,"));
    reader.require_words(2, "grains N");
    const int num_grains = reader.integer<int>(1, "number of grains", 1, INT32_MAX / 4);
    read_grains(reader, num_grains, state);
    reader.next("'contacts'");
    reader.require_keyword("contacts", 2, "contacts M");
    const int num_contacts = reader.integer<int>(1, "number of contacts", 0, INT32_MAX / 4);
    read_contacts(reader, num_contacts, state);
    reader.read_checksum(false, "end");
    reader.next("'end'");
    reader.require_keyword("end", 1, "end");
    return state;
  }

  LibraryRow read_row(StatementReader &reader, int number_of_row)
  {
    reader.next("index line " + std::to_string(number_of_row) + " of the library");
    reader.require_words(7,
                         "number seed void_ratio friction overconsolidation_ratio pressure grains");
    reader.integer<int>(0, "number of the packing", number_of_row, number_of_row);
    LibraryRow row;
    row.seed = reader.integer<std::uint64_t>(1, "seed", 0, UINT64_MAX);
    row.void_ratio = reader.finite_number(2, "void ratio");
    row.preparation_friction = reader.finite_number(3, "preparation friction");
    row.overconsolidation_ratio = reader.finite_number(4, "overconsolidation ratio");
    row.pressure = reader.finite_number(5, "pressure");
    row.num_grains = reader.integer<int>(6, "number of grains", 1, INT32_MAX / 4);
    return row;
  }

}    // namespace

int dimension_of_packing(const std::string &path)
{
  StatementReader reader(path);
  reader.next("'gpu_rve_packing'");
  if (reader.word(0) == "gpu_rve_library")
    while (reader.word(0) != "gpu_rve_packing") reader.next("'gpu_rve_packing'");
  return read_dimension(reader);
}

template <int D> RveStateOf<D> read_packing(const std::string &path)
{
  StatementReader reader(path);
  reader.next("'gpu_rve_packing'");
  if (reader.word(0) == "gpu_rve_library")
    reader.fail("this is a library; a single packing was expected");
  RveStateOf<D> state = read_packing_statements<D>(reader);
  reader.require_end();
  check_for(path, state);
  return state;
}

template <int D> PackingLibraryOf<D> read_library(const std::string &path)
{
  StatementReader reader(path);
  reader.next("'gpu_rve_library' or 'gpu_rve_packing'");
  PackingLibraryOf<D> library;
  if (reader.word(0) != "gpu_rve_library") {
    RveStateOf<D> packing = read_packing_statements<D>(reader);
    reader.require_end();
    check_for(path, packing);
    LibraryRow row;
    row.void_ratio = packing.void_ratio();
    row.num_grains = packing.num_grains();
    library.add(row, std::move(packing));
    return library;
  }
  reader.require_words(2, "gpu_rve_library version");
  reader.integer<int>(1, "version of the library", LIBRARY_VERSION, LIBRARY_VERSION);
  reader.next("'packings'");
  reader.require_keyword("packings", 2, "packings N");
  const int count = reader.integer<int>(1, "number of packings of the library", 1, INT32_MAX / 4);
  for (int k = 0; k < count; ++k) library.index.push_back(read_row(reader, k));
  for (int k = 0; k < count; ++k) {
    reader.next("'packing " + std::to_string(k) + "'");
    reader.require_keyword("packing", 2, "packing " + std::to_string(k));
    reader.integer<int>(1, "number of the packing", k, k);
    reader.next("'gpu_rve_packing'");
    library.packings.push_back(read_packing_statements<D>(reader));
    check_for(path + ": packing " + std::to_string(k), library.packings.back());
  }
  reader.read_checksum(true, "end_library");
  reader.next("'end_library'");
  reader.require_keyword("end_library", 1, "end_library");
  reader.require_end();
  check_for(path, library);
  return library;
}

template RveStateOf<2> read_packing(const std::string &);
template RveStateOf<3> read_packing(const std::string &);
template PackingLibraryOf<2> read_library(const std::string &);
template PackingLibraryOf<3> read_library(const std::string &);

}    // namespace rve
