// SPDX-License-Identifier: GPL-2.0-only
#include "rve/core/pi.h"
#include "rve/engine/contact_network.h"
#include "rve/engine/files.h"
#include "rve/engine/packing_io.h"
#include "rve/engine/packing_text.h"

#include <cmath>
#include <optional>
#include <sstream>

namespace rve {

namespace {

  /// Adds `multiple` times the fractional coordinate `from` of each grain to its coordinate `to`.
  /// The sum is exact, in wrapping integers.
  template <int D> void add_multiple(RveStateOf<D> &state, double multiple, int from, int to)
  {
    const auto n = static_cast<std::uint64_t>(static_cast<std::int64_t>(multiple));
    for (std::size_t i = 0; i < state.radius.size(); ++i)
      state.fractional[D * i + to] += n * state.fractional[D * i + from];
  }

  // in_lammps_frame() returns the packing in the axes of LAMMPS: a along +x, b in the plane of x
  // and y, and tilts of at most half an edge.

  RveState in_lammps_frame(RveState state)
  {
    const Tensor2 h = state.cell;
    const double lx = std::hypot(h(0, 0), h(1, 0));
    const double cosine = h(0, 0) / lx, sine = h(1, 0) / lx;
    const double xy = cosine * h(0, 1) + sine * h(1, 1);
    const double reduction = std::round(xy / lx);
    state.cell = Tensor2{{lx, xy - reduction * lx, 0.0, determinant(h) / lx}};
    // a s_x + b s_y = a (s_x + n s_y) + (b - n a) s_y with the integer n = reduction
    add_multiple(state, reduction, 1, 0);
    for (std::size_t i = 0; i < state.velocity.size(); i += 2) {
      const double x = state.velocity[i], y = state.velocity[i + 1];
      state.velocity[i] = cosine * x + sine * y;
      state.velocity[i + 1] = cosine * y - sine * x;
    }
    return state;
  }

  Vec<double, 3> unit(const Vec<double, 3> &v)
  {
    return (1.0 / std::sqrt(dot(v, v))) * v;
  }

  RveStateOf<3> in_lammps_frame(RveStateOf<3> state)
  {
    const Vec<double, 3> a = column(state.cell, 0), b = column(state.cell, 1);
    const Vec<double, 3> x = unit(a), z = unit(cross(a, b)), y = cross(z, x);
    const Tensor3 rotation{{x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2]}};
    const auto turn = [&](double *vector) {
      const Vec<double, 3> turned = rotation * Vec<double, 3>{{vector[0], vector[1], vector[2]}};
      std::copy_n(&turned[0], 3, vector);
    };
    state.cell = rotation * state.cell;
    for (int k = 0; k < 3; ++k)
      for (int row = k + 1; row < 3; ++row) state.cell(row, k) = 0.0;
    // reduce() subtracts the nearest whole multiple of cell vector `other` from cell vector `axis`.
    const auto reduce = [&](int axis, int other) {
      const double multiple = std::round(state.cell(other, axis) / state.cell(other, other));
      for (int k = 0; k < 3; ++k) state.cell(k, axis) -= multiple * state.cell(k, other);
      add_multiple(state, multiple, axis, other);
    };
    reduce(2, 1);
    reduce(1, 0);
    reduce(2, 0);
    for (std::size_t i = 0; i < state.velocity.size(); i += 3) {
      turn(&state.velocity[i]);
      turn(&state.spin[i]);
    }
    for (PairOf<3> &pair : state.pairs)
      for (const RememberedNumber<3> &number : SPATIAL_PAIR_MEMORY)
        if (number.begins_vector) turn(&number.of(pair));
    return state;
  }

  /// Returns the components as text, such as " 1 2 3".
  template <int D> std::string text_of(const Vec<double, D> &vector)
  {
    std::string text;
    for (int a = 0; a < D; ++a) text += " " + exact(vector[a]);
    return text;
  }
  std::string text_of(double value)
  {
    return " " + exact(value);
  }

  /// Returns the components of vector i of `vectors` as text; for disks the z component is 0.
  template <int D> std::string components(const std::vector<double> &vectors, int i)
  {
    std::string text;
    for (int a = 0; a < D; ++a) text += text_of(vectors[D * i + a]);
    return D == 2 ? text + " 0" : text;
  }

  template <int D> std::string lammps_data(const RveStateOf<D> &state)
  {
    const Tensor<double, D> &h = state.cell;
    std::ostringstream out;
    out << "LAMMPS data file of one RVE (GPU_RVE), atom_style sphere; velocities are peculiar\n\n"
        << state.num_grains() << " atoms\n1 atom types\n\n";
    for (int a = 0; a < D; ++a)
      out << "0 " << exact(h(a, a)) << " "
          << "xyz"[a] << "lo "
          << "xyz"[a] << "hi\n";
    if constexpr (D == 2) {
      const double half_slab = *std::max_element(state.radius.begin(), state.radius.end());
      out << exact(-half_slab) << " " << exact(half_slab) << " zlo zhi\n";
      out << exact(h(0, 1)) << " 0 0";
    } else {
      out << exact(h(0, 1)) << " " << exact(h(0, 2)) << " " << exact(h(1, 2));
    }
    out << " xy xz yz\n\nAtoms # sphere\n\n";
    const std::vector<double> x = state.positions();
    const double mass_per_volume = state.material.density * state.material.mass_depth;
    for (int i = 0; i < state.num_grains(); ++i) {
      const double r = state.radius[i];
      // LAMMPS computes the mass of a grain as that of a sphere.
      const double density = D == 2 ? mass_per_volume * kPi * r * r / (4.0 / 3.0 * kPi * r * r * r)
                                    : mass_per_volume;
      out << i + 1 << " 1 " << exact(2.0 * r) << " " << exact(density) << components<D>(x, i)
          << "\n";
    }
    out << "\nVelocities\n\n";
    for (int i = 0; i < state.num_grains(); ++i)
      out << i + 1 << components<D>(state.velocity, i)
          << (D == 2 ? " 0 0" + text_of(state.spin[i]) : components<3>(state.spin, i)) << "\n";
    return out.str();
  }

  /// Returns the comments at the beginning of a table of contacts.
  template <int D> std::string contact_head(bool rolls)
  {
    const std::string head =
        "# contacts of one RVE (GPU_RVE); n from i to j, force on i = -f_n n + f_t";
    if (D == 2)
      return head + " (-n_y, n_x)" +
          (rolls ? ", moment on i = f_r r_i r_j / (r_i + r_j) plus that of the force" : "") +
          "\n# i j branch_x branch_y n_x n_y overlap f_n f_t force_x force_y" +
          (rolls ? " f_r\n" : "\n");
    return head +
        (rolls ? ", moment on i = r_i r_j / (r_i + r_j) n x f_r + m_t n plus that of the force"
               : "") +
        "\n# i j branch_x branch_y branch_z n_x n_y n_z overlap f_n f_t_x f_t_y f_t_z force_x "
        "force_y force_z" +
        (rolls ? " f_r_x f_r_y f_r_z m_t\n" : "\n");
  }

  template <int D> std::string contact_table(const RveStateOf<D> &state)
  {
    const bool rolls = state.has_rolling_forces();
    std::ostringstream out;
    out << contact_head<D>(rolls);
    for (const SpringContactOf<D> &contact : find_spring_contacts(state)) {
      const auto &[first, second, branch, n, overlap] = contact.geometry;
      out << first + 1 << " " << second + 1 << text_of(branch) << text_of(n) << text_of(overlap)
          << text_of(contact.normal_force) << text_of(contact.springs.tangential)
          << text_of(contact.force_on_first);
      if (rolls) {
        out << text_of(contact.springs.rolling);
        if constexpr (D == 3) out << text_of(contact.springs.twisting);
      }
      out << "\n";
    }
    return out.str();
  }

}    // namespace

template <int D> void write_lammps_data(const std::string &path, const RveStateOf<D> &state)
{
  check_for(path, state);
  const RveStateOf<D> seen = in_lammps_frame(state);
  OutputFile data(path);
  std::optional<OutputFile> contacts;
  if (data.is_regular()) contacts.emplace(path + ".contacts");
  data.write(lammps_data(seen));
  if (contacts) contacts->write(contact_table(seen));
}

template void write_lammps_data(const std::string &, const RveStateOf<2> &);
template void write_lammps_data(const std::string &, const RveStateOf<3> &);

}    // namespace rve
