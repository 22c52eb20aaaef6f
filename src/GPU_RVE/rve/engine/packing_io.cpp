// SPDX-License-Identifier: GPL-2.0-only
// Number conversion is by <charconv>: exact, and the same in every locale.

#include "rve/engine/packing_io.h"

#include "rve/core/checksum.h"
#include "rve/core/error.h"
#include "rve/core/pi.h"
#include "rve/core/suggestion.h"
#include "rve/engine/contact_model.h"
#include "rve/engine/contact_network.h"
#include "rve/engine/dimension_words.h"
#include "rve/engine/files.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>
#include <string_view>
#include <system_error>

namespace rve {

namespace {

  // of a packing of disks; from version 2 on a packing says its dimension
  constexpr int VERSION_OF_DISKS = 1, VERSION_WITH_DIMENSION = 2;
  constexpr int LIBRARY_VERSION = 1;
  const std::string LAW_STATEMENT = "contact_law";

  // ---- the material in a file ----

  /// A line of the material.
  struct MaterialLine {
    const char *name, *unit;
    bool optional;
    double otherwise;    // where the line is missing
    const MaterialParameter *parameter;
    double &of(Material &material) const { return material.*parameter->member; }
    double of(const Material &material) const { return material.*parameter->member; }
  };

  /// Spheres have no thickness, and no depth that their mass is counted for: what scales the mass is a number.
  template <int D> std::vector<MaterialLine> material_lines()
  {
    std::vector<MaterialLine> lines;
    for (const MaterialParameter &parameter : MATERIAL_PARAMETERS) {
      if (parameter.dimension != 0 && parameter.dimension != D) continue;
      if (D == 3 && parameter.member == &MaterialNumbers::thickness) continue;
      if (D == 3 && parameter.member == &MaterialNumbers::mass_depth)
        lines.push_back({"mass_scaling", "[-]", true, 1.0, &parameter});
      else
        lines.push_back({parameter.name, parameter.unit, parameter.optional, 0.0, &parameter});
    }
    return lines;
  }

  // ---- statements ----

  /// The words of a line; none if it is blank or a comment.
  void split(const std::string &line, std::vector<std::string_view> &words)
  {
    words.clear();
    const std::string_view statement = std::string_view(line).substr(0, line.find('#'));
    constexpr const char *BLANK = " \t\r";
    std::size_t begin = statement.find_first_not_of(BLANK);
    while (begin != std::string_view::npos) {
      const std::size_t end = std::min(statement.find_first_of(BLANK, begin), statement.size());
      words.push_back(statement.substr(begin, end - begin));
      begin = statement.find_first_not_of(BLANK, end);
    }
  }

  /// Of a statement as if it were written with one blank between two words: a file may get comments and another layout.
  void add_statement(const std::vector<std::string_view> &words, Checksum &checksum)
  {
    for (std::size_t k = 0; k < words.size(); ++k) {
      if (k > 0) checksum.add(" ", 1);
      checksum.add(words[k].data(), words[k].size());
    }
    if (!words.empty()) checksum.add("\n", 1);
  }

  /// As files have it: 16 hexadecimal digits.
  std::string hexadecimal(std::uint64_t value)
  {
    std::string digits(16, '0');
    for (int k = 15; k >= 0; --k, value >>= 4) digits[k] = "0123456789abcdef"[value & 15];
    return digits;
  }

  // ---- reading ----

  /// Statements of a text file with their line numbers.
  class StatementReader {
   public:
    explicit StatementReader(const std::string &_path) : path(_path)
    {
      require_readable(path, "packing file");
      file.open(path);
      require(file.is_open(),
              "cannot open packing file " + path + ": " + std::generic_category().message(errno));
    }

    /// Moves to the next statement; `expected` names it for the message at the end of the file.
    void next(const std::string &expected)
    {
      add_statement(words, of_packing);
      add_statement(words, of_file);
      if (!next_words()) fail("file ends where " + expected + " was expected");
    }

    /// The present statement begins a packing.
    void begin_packing() { of_packing = {}; }

    /// Moves to a line with the checksum of the statements before it: of the packing, or of the whole file.
    void read_checksum(bool whole_file, const std::string &last_statement)
    {
      next("'checksum'");
      if (word(0) == last_statement)
        fail("there is no checksum before '" + last_statement +
             "': the file is damaged, or was written by hand or by an earlier version; a line "
             "'checksum none' before it accepts it");
      require_keyword("checksum", 2, "checksum digits");
      if (word(1) == "none") return;
      const std::string found(word(1));
      if (found.size() != 16 || found.find_first_not_of("0123456789abcdef") != std::string::npos)
        fail("checksum is '" + found + "'; it must be 16 hexadecimal digits, or none");
      const std::string expected = hexadecimal((whole_file ? of_file : of_packing).value());
      if (found != expected)
        fail("checksum is " + found + ", that of the statements before it is " + expected +
             ": the file is damaged, or was changed by hand; 'checksum none' in its place accepts "
             "it");
    }

    /// The present statement is the last one.
    void require_end()
    {
      const std::string last(word(0));
      if (next_words())
        fail("found '" + std::string(word(0)) + "' behind '" + last +
             "'; only blank lines and comments may follow");
    }

    const std::string_view &word(std::size_t k) const { return words[k]; }
    std::size_t num_words() const { return words.size(); }

    void require_words(std::size_t count, const std::string &form) const
    {
      if (words.size() != count)
        fail("'" + text + "' has " + std::to_string(words.size()) + " words; expected '" + form +
             "'");
    }

    void require_keyword(const std::string &keyword, std::size_t count,
                         const std::string &form) const
    {
      if (word(0) != keyword)
        fail("found '" + std::string(word(0)) + "' where '" + keyword + "' was expected");
      require_words(count, form);
    }

    double finite_number(std::size_t k, const std::string &what) const
    {
      double value = 0.0;
      if (!convert(k, value))
        fail(what + " is '" + std::string(word(k)) + "'; it must be a number");
      if (!std::isfinite(value)) fail(what + " is " + number(value) + "; it must be finite");
      return value;
    }

    template <class Integer>
    Integer integer(std::size_t k, const std::string &what, Integer least, Integer most) const
    {
      Integer value = 0;
      if (!convert(k, value) || value < least || value > most)
        fail(what + " is '" + std::string(word(k)) + "'; it must be an integer from " +
             std::to_string(least) + " to " + std::to_string(most));
      return value;
    }

    [[noreturn]] void fail(const std::string &message) const
    {
      throw InputError(path + ":" + std::to_string(line) + ": " + message);
    }

   private:
    std::string path;
    std::ifstream file;
    std::string text;
    std::vector<std::string_view> words;
    Checksum of_packing, of_file;    // of the statements before the present one
    int line = 0;

    /// Whether there is a further statement.
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

    /// A line at a time: libraries may be larger than the memory.
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

  /// Ends at the first statement behind the material.
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
          reader.fail(name + " stands behind a material value; it must be the first of them");
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
        reader.fail("'" + name + "' is not a material value" +
                    (D == 2 ? "" : std::string(" of ") + DimensionWords<D>::grains) +
                    (name == "cell" ? "; still missing: " + missing()
                                    : did_you_mean(name, known, "these are")));
      }
      if (!entry->parameter->is_of(material.law, D))
        reader.fail("the contact law " + std::string(word_of(material.law)) + " has no " + name);
      if (seen[name]) reader.fail(name + " is given twice");
      seen[name] = true;
      reader.require_words(2, name + " value");
      const double value = reader.finite_number(1, name);
      if (value < 0.0)
        reader.fail(name + " is " + number(value) + " " + entry->unit +
                    "; it must not be negative");
      entry->of(material) = value;
    }
  }

  /// A word for each axis: "s_x*2^64 s_y*2^64".
  template <int D>
  std::string for_axes(const std::string &before, const std::string &after,
                       const std::string &between)
  {
    std::string words = before + "x" + after;
    for (int a = 1; a < D; ++a) words += between + before + "xyz"[a] + after;
    return words;
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
    // Grown as lines come: a damaged count must end in a message, not in an allocation.
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
      if (seen[i]) reader.fail("grain " + std::to_string(id) + " is given twice");
      seen[i] = true;
      state.radius[i] = reader.finite_number(1, "radius");
      if (state.radius[i] <= 0.0)
        reader.fail("radius is " + number(state.radius[i]) +
                    " [length]; it must be greater than 0");
      for (int a = 0; a < D; ++a) {
        state.fractional[D * i + a] =
            reader.integer<std::uint64_t>(2 + a, "fractional coordinate", 0, UINT64_MAX);
        state.velocity[D * i + a] = reader.finite_number(2 + D + a, "peculiar velocity");
      }
      for (int k = 0; k < SPINS; ++k)
        state.spin[SPINS * i + k] = reader.finite_number(2 + 2 * D + k, "spin");
    }
  }

  /// What pairs remember at least, in files: a tangential force.
  template <int D> constexpr int least_remembered()
  {
    return D == 2 ? 1 : D;
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
        reader.fail("contact joins grain " + std::to_string(pair.first + 1) + " to itself");
      for (int m = 0; m < remembered; ++m) {
        const RememberedNumber<D> &number = pair_memory<D>()[m];
        number.of(pair) = reader.finite_number(2 + m, number.what);
      }
      state.pairs.push_back(pair);
    }
  }

  /// Of a packing at whose statement `gpu_rve_packing` the reader is; ends at the last statement that says it.
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

  /// A packing from the statement `gpu_rve_packing`, to which the reader has moved, to `end`.
  template <int D> RveStateOf<D> read_packing_statements(StatementReader &reader)
  {
    RveStateOf<D> state;
    reader.begin_packing();
    const int dimension = read_dimension(reader);
    if (dimension != D)
      reader.fail("the packing is of " + grains_of(dimension) + "; one of " + grains_of(D) +
                  " was expected");
    reader.next("'material'");
    reader.require_keyword("material", 1, "material");
    read_material<D>(reader, state.material);
    reader.require_keyword("cell", 1, "cell");
    read_tensor(reader, "cell", state.cell);
    reader.next("'grains'");
    if (reader.word(0) == "deformation") {
      reader.require_words(1, "deformation");
      read_tensor(reader, "deformation", state.deformation);
      reader.next("'grains'");
    }
    if (reader.word(0) == "servo_velocity_gradient") {
      reader.require_words(1, "servo_velocity_gradient");
      read_tensor(reader, "servo_velocity_gradient", state.servo_velocity_gradient);
      reader.next("'grains'");
    }
    if (reader.word(0) == "largest_contact_force") {
      reader.require_words(2, "largest_contact_force value");
      state.largest_contact_force = reader.finite_number(1, "largest contact force");
      reader.next("'grains'");
    }
    if (reader.word(0) != "grains")
      reader.fail("found '" + std::string(reader.word(0)) + "' where 'grains' was expected" +
                  did_you_mean(
                      reader.word(0),
                      {"deformation", "servo_velocity_gradient", "largest_contact_force", "grains"},
                      "before it may stand, in this order,"));
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

  // ---- writing ----

  /// The shortest decimal that reads back to the same double.
  std::string exact(double value)
  {
    char text[32];
    const auto result = std::to_chars(text, text + sizeof(text), value);
    return std::string(text, result.ptr);
  }

  template <int D>
  void write_tensor(std::ostream &out, const char *name, const Tensor<double, D> &tensor)
  {
    out << name << "\n";
    for (int a = 0; a < D; ++a) {
      out << " ";
      for (int b = 0; b < D; ++b) out << " " << exact(tensor(a, b));
      out << "\n";
    }
  }

  /// The line that read_checksum() reads.
  std::string checksum_line(const std::string &statements)
  {
    Checksum checksum;
    std::istringstream in(statements);
    std::vector<std::string_view> words;
    for (std::string line; std::getline(in, line);) {
      split(line, words);
      add_statement(words, checksum);
    }
    return "checksum " + hexadecimal(checksum.value()) + "\n";
  }

  /// Comments on the numbers of a contact.
  template <int D> void describe_contacts(std::ostream &out, int remembered)
  {
    if constexpr (D == 2) {
      out << "\n# contacts with a tangential force: id, id, force on the first along (-n_y, n_x), "
             "n "
             "to the second [force]\n";
      if (remembered > 1)
        out << "# and rolling force: moment on the first over r_1 r_2 / (r_1 + r_2) [force]\n";
      if (remembered > 2)
        out << "# and contact radius: at which the tangential force was [length]\n";
    } else {
      out << "\n# contacts with a history: id, id";
      for (int m = 0; m < remembered; ++m)
        out << ", " << pair_memory<D>()[m].name << " " << pair_memory<D>()[m].unit;
      out << "; forces on the first\n";
    }
  }

  /// From `gpu_rve_packing` to `end`.
  template <int D> std::string packing_statements(const RveStateOf<D> &state)
  {
    constexpr int SPINS = Space<D>::spins;
    std::ostringstream out;
    out << "gpu_rve_packing ";
    if (D == 2)
      out << VERSION_OF_DISKS << "\n";
    else
      out << VERSION_WITH_DIMENSION << "\ndimension " << D << "\n";
    out << "\nmaterial\n";
    const ContactLaw law = state.material.law;
    if (law != ContactLaw::Linear) out << "  " << LAW_STATEMENT << " " << word_of(law) << "\n";
    const std::vector<MaterialLine> lines = material_lines<D>();
    const bool has_options = std::any_of(lines.begin(), lines.end(), [&](const MaterialLine &line) {
      return line.optional && line.of(state.material) != line.otherwise;
    });
    const auto is_written = [&](const MaterialLine &line) {
      if (line.parameter->later) return line.of(state.material) != line.otherwise;
      return has_options || !line.optional;
    };
    for (const MaterialLine &line : lines)
      if (line.parameter->is_of(law, D) && is_written(line))
        out << "  " << line.name << " " << exact(line.of(state.material)) << "    # " << line.unit
            << "\n";
    out << "\n# rows of H; its columns are the cell vectors [length]\n";
    write_tensor(out, "cell", state.cell);
    out << "# deformation gradient since the packing was made [-]\n";
    write_tensor(out, "deformation", state.deformation);
    out << "# velocity gradient of the stress servo [1/time]\n";
    write_tensor(out, "servo_velocity_gradient", state.servo_velocity_gradient);
    out << "# scale of the force integers [force]\n"
        << "largest_contact_force " << exact(state.largest_contact_force) << "\n\n"
        << "grains " << state.num_grains() << "\n# id, radius [length], "
        << for_axes<D>("s_", " 2^64", ", ") << " [-], peculiar velocity "
        << for_axes<D>("c_", "", ", ") << " [length/time], spin"
        << (D == 2 ? std::string() : " " + for_axes<D>("w_", "", ", ")) << " [1/time]\n";
    for (int i = 0; i < state.num_grains(); ++i) {
      out << i + 1 << " " << exact(state.radius[i]);
      for (int a = 0; a < D; ++a) out << " " << state.fractional[D * i + a];
      for (int a = 0; a < D; ++a) out << " " << exact(state.velocity[D * i + a]);
      for (int k = 0; k < SPINS; ++k) out << " " << exact(state.spin[SPINS * i + k]);
      out << "\n";
    }

    const auto has_history = [](const PairOf<D> &pair) {
      return std::any_of(std::begin(pair_memory<D>()), std::end(pair_memory<D>()),
                         [&](const RememberedNumber<D> &number) { return number.of(pair) != 0.0; });
    };
    const int remembered = std::max(remembered_numbers(state.pairs), least_remembered<D>());
    out << "\ncontacts " << std::count_if(state.pairs.begin(), state.pairs.end(), has_history);
    describe_contacts<D>(out, remembered);
    for (const PairOf<D> &pair : state.pairs) {
      if (!has_history(pair)) continue;
      out << pair.first + 1 << " " << pair.second + 1;
      for (int m = 0; m < remembered; ++m) out << " " << exact(pair_memory<D>()[m].of(pair));
      out << "\n";
    }
    const std::string statements = out.str();
    return statements + checksum_line(statements) + "end\n";
  }

  template <class Checked> void check_for(const std::string &path, const Checked &checked)
  {
    try {
      checked.check();
    } catch (const InputError &error) {
      throw InputError(path + ": " + error.what());
    }
  }

  // ---- LAMMPS' frame ----

  /// The packing seen from LAMMPS: a along +x, b in the plane of x and y, tilts of at most half an edge.
  template <int D> struct RestrictedFrame;

  template <> struct RestrictedFrame<2> {
    RveState state;         // positions and cell in the new frame
    double cosine, sine;    // v_lammps = (cosine v_x + sine v_y, -sine v_x + cosine v_y)

    explicit RestrictedFrame(const RveState &original) : state(original)
    {
      const Tensor2 &h = original.cell;
      const double lx = std::hypot(h(0, 0), h(1, 0));
      cosine = h(0, 0) / lx;
      sine = h(1, 0) / lx;
      const double xy = cosine * h(0, 1) + sine * h(1, 1);
      const double reduction = std::round(xy / lx);
      Tensor2 restricted;
      restricted(0, 0) = lx;
      restricted(0, 1) = xy - reduction * lx;
      restricted(1, 0) = 0.0;
      restricted(1, 1) = determinant(h) / lx;
      state.cell = restricted;
      // a s_x + b s_y = a (s_x + n s_y) + (b - n a) s_y, exact in wrapping integers
      const auto n = static_cast<std::uint64_t>(static_cast<std::int64_t>(reduction));
      for (std::size_t i = 0; i < state.radius.size(); ++i)
        state.fractional[2 * i] += n * state.fractional[2 * i + 1];
    }

    Vec<double, 2> rotate(double x, double y) const
    {
      return {{cosine * x + sine * y, cosine * y - sine * x}};
    }
  };

  template <> struct RestrictedFrame<3> {
    RveStateOf<3> state;    // all of it in the new frame
    Tensor3 rotation;       // v_lammps = rotation v

    explicit RestrictedFrame(const RveStateOf<3> &original) : state(original)
    {
      const Vec<double, 3> a = column(original.cell, 0), b = column(original.cell, 1);
      const Vec<double, 3> x = unit(a), z = unit(cross(a, b)), y = cross(z, x);
      for (int k = 0; k < 3; ++k) {
        rotation(0, k) = x[k];
        rotation(1, k) = y[k];
        rotation(2, k) = z[k];
      }
      state.cell = rotation * original.cell;
      for (int k = 0; k < 3; ++k)
        for (int row = k + 1; row < 3; ++row) state.cell(row, k) = 0.0;
      reduce(2, 1);
      reduce(1, 0);
      reduce(2, 0);
      turn(state.velocity);
      turn(state.spin);
      for (PairOf<3> &pair : state.pairs)
        for (const RememberedNumber<3> &number : SPATIAL_PAIR_MEMORY)
          if (number.component == 0) turn(&number.of(pair));
    }

   private:
    static Vec<double, 3> unit(const Vec<double, 3> &v) { return (1.0 / std::sqrt(dot(v, v))) * v; }

    // Takes multiples of vector `other` from vector `axis`, as in the plane.
    void reduce(int axis, int other)
    {
      const double multiple = std::round(state.cell(other, axis) / state.cell(other, other));
      for (int k = 0; k < 3; ++k) state.cell(k, axis) -= multiple * state.cell(k, other);
      const auto n = static_cast<std::uint64_t>(static_cast<std::int64_t>(multiple));
      for (std::size_t i = 0; i < state.radius.size(); ++i)
        state.fractional[3 * i + other] += n * state.fractional[3 * i + axis];
    }

    void turn(double *vector) const
    {
      const Vec<double, 3> turned = rotation * Vec<double, 3>{{vector[0], vector[1], vector[2]}};
      for (int k = 0; k < 3; ++k) vector[k] = turned[k];
    }
    void turn(std::vector<double> &vectors) const
    {
      for (std::size_t i = 0; i < vectors.size(); i += 3) turn(&vectors[i]);
    }
  };

  /// Head of a data file, up to the atoms.
  std::string lammps_head(int num_grains)
  {
    return "LAMMPS data file of one RVE (GPU_RVE), atom_style sphere; velocities are peculiar\n\n" +
        std::to_string(num_grains) + " atoms\n1 atom types\n\n";
  }

  std::string lammps_data(const RestrictedFrame<3> &frame)
  {
    const RveStateOf<3> &state = frame.state;
    const Tensor3 &h = state.cell;
    std::ostringstream out;
    out << lammps_head(state.num_grains());
    for (int a = 0; a < 3; ++a)
      out << "0 " << exact(h(a, a)) << " "
          << "xyz"[a] << "lo "
          << "xyz"[a] << "hi\n";
    out << exact(h(0, 1)) << " " << exact(h(0, 2)) << " " << exact(h(1, 2))
        << " xy xz yz\n\nAtoms # sphere\n\n";
    const std::vector<double> x = state.positions();
    const std::string density = exact(state.material.density * state.material.mass_depth);
    for (int i = 0; i < state.num_grains(); ++i) {
      out << i + 1 << " 1 " << exact(2.0 * state.radius[i]) << " " << density;
      for (int a = 0; a < 3; ++a) out << " " << exact(x[3 * i + a]);
      out << "\n";
    }
    out << "\nVelocities\n\n";
    for (int i = 0; i < state.num_grains(); ++i) {
      out << i + 1;
      for (const std::vector<double> *motion : {&state.velocity, &state.spin})
        for (int a = 0; a < 3; ++a) out << " " << exact((*motion)[3 * i + a]);
      out << "\n";
    }
    return out.str();
  }

  std::string contact_table(const RestrictedFrame<3> &frame)
  {
    const bool rolls = frame.state.has_rolling_forces();
    std::ostringstream out;
    out << "# contacts of one RVE (GPU_RVE); n from i to j, force on i = -f_n n + f_t";
    if (rolls)
      out << ", moment on i = r_i r_j / (r_i + r_j) n x f_r + m_t n beside that of the force";
    out << "\n# i j branch_x branch_y branch_z n_x n_y n_z overlap f_n f_t_x f_t_y f_t_z force_x "
           "force_y force_z"
        << (rolls ? " f_r_x f_r_y f_r_z m_t" : "") << "\n";
    for (const SpringContactOf<3> &contact : find_spring_contacts(frame.state)) {
      const auto &[first, second, branch, n, overlap] = contact.geometry;
      out << first + 1 << " " << second + 1;
      const auto add = [&](const Vec<double, 3> &vector) {
        for (int a = 0; a < 3; ++a) out << " " << exact(vector[a]);
      };
      add(branch);
      add(n);
      out << " " << exact(overlap) << " " << exact(contact.normal_force);
      add(contact.springs.tangential);
      add(contact.force_on_first);
      if (rolls) {
        add(contact.springs.rolling);
        out << " " << exact(contact.springs.twisting);
      }
      out << "\n";
    }
    return out.str();
  }

  std::string lammps_data(const RestrictedFrame<2> &frame)
  {
    const RveState &state = frame.state;
    const double half_slab = *std::max_element(state.radius.begin(), state.radius.end());
    const double mass_per_area = state.material.density * state.material.mass_depth;
    std::ostringstream out;
    out << lammps_head(state.num_grains()) << "0 " << exact(state.cell(0, 0)) << " xlo xhi\n"
        << "0 " << exact(state.cell(1, 1)) << " ylo yhi\n"
        << exact(-half_slab) << " " << exact(half_slab) << " zlo zhi\n"
        << exact(state.cell(0, 1)) << " 0 0 xy xz yz\n\nAtoms # sphere\n\n";
    const std::vector<double> xy = state.positions();
    for (int i = 0; i < state.num_grains(); ++i) {
      const double r = state.radius[i];
      const double density = mass_per_area * kPi * r * r / (4.0 / 3.0 * kPi * r * r * r);
      out << i + 1 << " 1 " << exact(2.0 * r) << " " << exact(density) << " " << exact(xy[2 * i])
          << " " << exact(xy[2 * i + 1]) << " 0\n";
    }
    out << "\nVelocities\n\n";
    for (int i = 0; i < state.num_grains(); ++i) {
      const Vec<double, 2> c = frame.rotate(state.velocity[2 * i], state.velocity[2 * i + 1]);
      out << i + 1 << " " << exact(c[0]) << " " << exact(c[1]) << " 0 0 0 " << exact(state.spin[i])
          << "\n";
    }
    return out.str();
  }

  std::string contact_table(const RestrictedFrame<2> &frame)
  {
    const RveState &state = frame.state;
    const bool rolls = state.has_rolling_forces();

    std::ostringstream out;
    out << "# contacts of one RVE (GPU_RVE); n from i to j, force on i = -f_n n + f_t (-n_y, n_x)";
    if (rolls) out << ", moment on i = f_r r_i r_j / (r_i + r_j) beside that of the force";
    out << "\n# i j branch_x branch_y n_x n_y overlap f_n f_t force_x force_y"
        << (rolls ? " f_r" : "") << "\n";
    for (const SpringContact &contact : find_spring_contacts(state)) {
      const auto &[first, second, branch, n, overlap] = contact.geometry;
      out << first + 1 << " " << second + 1;
      for (const double value :
           {branch[0], branch[1], n[0], n[1], overlap, contact.normal_force,
            contact.springs.tangential, contact.force_on_first[0], contact.force_on_first[1]})
        out << " " << exact(value);
      if (rolls) out << " " << exact(contact.springs.rolling);
      out << "\n";
    }
    return out.str();
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

template <int D> void write_packing(const std::string &path, const RveStateOf<D> &state)
{
  check_for(path, state);
  std::ostringstream out;
  out << "# Packing of one RVE (GPU_RVE): " << DimensionWords<D>::grains
      << " in a periodic cell, x = H s.\n"
      << "# Consistent units, those of the script that made it: [length], [mass], [time], force = "
         "mass length/time^2.\n";
  out << packing_statements(state);
  OutputFile(path).write(out.str());
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

template <int D> void write_library(const std::string &path, const PackingLibraryOf<D> &library)
{
  check_for(path, library);
  std::ostringstream out;
  out << "# Library of packings (GPU_RVE).\n"
      << "# Consistent units, those of the script that made it.\n"
      << "gpu_rve_library " << LIBRARY_VERSION << "\n\n"
      << "packings " << library.packings.size()
      << "\n# number, seed, void ratio [-], preparation friction [-], overconsolidation ratio [-], "
         "pressure [stress], grains\n";
  for (std::size_t k = 0; k < library.index.size(); ++k) {
    const LibraryRow &row = library.index[k];
    out << k << " " << row.seed << " " << exact(row.void_ratio) << " "
        << exact(row.preparation_friction) << " " << exact(row.overconsolidation_ratio) << " "
        << exact(row.pressure) << " " << row.num_grains << "\n";
  }
  for (std::size_t k = 0; k < library.packings.size(); ++k) {
    check_for(path + ": packing " + std::to_string(k), library.packings[k]);
    out << "\npacking " << k << "\n";
    out << packing_statements(library.packings[k]);
  }
  const std::string statements = out.str();
  OutputFile(path).write(statements + checksum_line(statements) + "end_library\n");
}

template <int D> void write_lammps_data(const std::string &path, const RveStateOf<D> &state)
{
  check_for(path, state);
  const RestrictedFrame<D> frame(state);
  OutputFile data(path);
  std::optional<OutputFile> contacts;
  if (data.is_regular()) contacts.emplace(path + ".contacts");
  data.write(lammps_data(frame));
  if (contacts) contacts->write(contact_table(frame));
}

template RveStateOf<2> read_packing(const std::string &);
template void write_packing(const std::string &, const RveStateOf<2> &);
template PackingLibraryOf<2> read_library(const std::string &);
template void write_library(const std::string &, const PackingLibraryOf<2> &);
template void write_lammps_data(const std::string &, const RveStateOf<2> &);

template RveStateOf<3> read_packing(const std::string &);
template void write_packing(const std::string &, const RveStateOf<3> &);
template PackingLibraryOf<3> read_library(const std::string &);
template void write_library(const std::string &, const PackingLibraryOf<3> &);
template void write_lammps_data(const std::string &, const RveStateOf<3> &);

}    // namespace rve
