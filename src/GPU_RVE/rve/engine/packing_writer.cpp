// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/dimension_words.h"
#include "rve/engine/files.h"
#include "rve/engine/packing_io.h"
#include "rve/engine/packing_text.h"

#include <sstream>

namespace rve {

namespace {

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

  /// Returns the line with the checksum of the statements (StatementReader::read_checksum).
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

  /// Writes comment lines that explain the first `remembered` numbers in the history of a contact.
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

  /// Returns the text of a packing from the statement `gpu_rve_packing` to the statement `end`.
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

}    // namespace

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

template void write_packing(const std::string &, const RveStateOf<2> &);
template void write_packing(const std::string &, const RveStateOf<3> &);
template void write_library(const std::string &, const PackingLibraryOf<2> &);
template void write_library(const std::string &, const PackingLibraryOf<3> &);

}    // namespace rve
