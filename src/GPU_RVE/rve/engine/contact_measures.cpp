// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/contact_measures.h"

#include "rve/engine/contact_laws.h"
#include "rve/engine/contact_network.h"

#include <cmath>
#include <vector>

namespace rve {

namespace {

  double squared(double along)
  {
    return along * along;
  }
  double squared(const Vec<double, 3> &along)
  {
    return dot(along, along);
  }

  template <int D> Tensor<double, D> deviator(const Tensor<double, D> &x)
  {
    return x - trace(x) / D * Tensor<double, D>::identity();
  }

  // Coefficient of A in the mean of n_i n_j (1 + A_kl n_k n_l) over directions n. The coefficient
  // of the unit tensor is 1/D.
  template <int D> constexpr double SHARE = 2.0 / (D * (D + 2));

  // Coefficient of T in the mean of n_i (T_jk n_k - T_kl n_k n_l n_j) over directions n.
  template <int D> constexpr double SHARE_ACROSS = 1.0 / (D + 2);

  template <int D>
  void add_sliding(const std::vector<SpringContactOf<D>> &contacts, ContactMeasuresOf<D> &measures)
  {
    double sum = 0.0;
    for (const SpringContactOf<D> &contact : contacts) sum += contact.normal_force;
    const auto count = static_cast<double>(contacts.size());
    const double mean = sum / count;
    double strong = 0.0, strong_that_slide = 0.0, weak_that_slide = 0.0;
    for (const SpringContactOf<D> &contact : contacts) {
      const bool is_strong = contact.normal_force > mean;
      const bool slides = contact.mobilized_friction >= SLIDING;
      strong += is_strong;
      strong_that_slide += is_strong && slides;
      weak_that_slide += !is_strong && slides;
    }
    measures.strong = strong / count;
    if (strong > 0.0) measures.sliding_strong = strong_that_slide / strong;
    // Equal forces can all exceed their rounded mean, so that no contact is weak.
    if (strong < count) measures.sliding_weak = weak_that_slide / (count - strong);
  }

  template <int D>
  void add_fabric(const std::vector<SpringContactOf<D>> &contacts, ContactMeasuresOf<D> &measures)
  {
    using Matrix = Tensor<double, D>;
    const double share = 1.0 / static_cast<double>(contacts.size());
    Matrix normals = Matrix::zero();
    for (const SpringContactOf<D> &contact : contacts)
      normals = normals + share * dyad(contact.geometry.normal, contact.geometry.normal);
    measures.contact = 1.0 / SHARE<D> * deviator(normals);

    // The weights give all directions the same influence, whatever their number of contacts.
    Matrix branches = Matrix::zero(), normal_forces = Matrix::zero(),
           tangential_forces = Matrix::zero();
    for (const SpringContactOf<D> &contact : contacts) {
      const Vec<double, D> &n = contact.geometry.normal, &l = contact.geometry.branch;
      const Matrix weighted = share / (1.0 + dot(n, measures.contact * n)) * dyad(n, n);
      branches = branches + std::sqrt(dot(l, l)) * weighted;
      normal_forces = normal_forces + contact.normal_force * weighted;
      tangential_forces =
          tangential_forces + std::sqrt(squared(contact.springs.tangential)) * weighted;
    }
    measures.mean_branch = trace(branches);
    measures.mean_normal_force = trace(normal_forces);
    measures.branch = 1.0 / (SHARE<D> * measures.mean_branch) * deviator(branches);
    // The ratios are undefined without normal forces, as for grains that just touch.
    if (measures.mean_normal_force == 0.0) return;
    measures.normal_force = 1.0 / (SHARE<D> * measures.mean_normal_force) * deviator(normal_forces);
    measures.tangential_force =
        1.0 / (SHARE_ACROSS<D> * measures.mean_normal_force) * deviator(tangential_forces);
  }

  // Adds the energy of each kind of spring. The energy of a tangential, rolling or twisting spring
  // is the energy of a contact with this spring and the normal spring, less that of the normal
  // spring.
  template <int D> void add_energies(const RveStateOf<D> &state, ContactMeasuresOf<D> &measures)
  {
    const std::vector<TouchingPairOf<D>> contacts = find_contacts(state);
    const std::vector<PairOf<D>> pairs = remembered_pairs(state, contacts);
    with_law<D>(state.material, [&](const auto &law) {
      for (std::size_t k = 0; k < contacts.size(); ++k) {
        const TouchingPairOf<D> &touching = contacts[k];
        const double distance = std::sqrt(dot(touching.branch, touching.branch));
        const ContactGeometry<double, D> geometry{touching.branch, touching.normal, distance,
                                                  1.0 / distance, touching.overlap};
        GrainMotion<double, D> one{}, other{};
        one.radius = state.radius[touching.first];
        other.radius = state.radius[touching.second];
        const auto energy_of = [&](const PairOf<D> &pair) {
          return law.elastic_energy(geometry,
                                    evaluate(law, geometry, one, other, Tensor<double, D>::zero(),
                                             law.of_pair(pair), 0.0));
        };
        PairOf<D> bare{};
        bare.contact_radius = pairs[k].contact_radius;
        const double of_normal = energy_of(bare);
        const auto energy_beside_it = [&](auto PairOf<D>::*spring) {
          PairOf<D> stretched = bare;
          stretched.*spring = pairs[k].*spring;
          return energy_of(stretched) - of_normal;
        };
        measures.elastic_normal += of_normal;
        measures.elastic_tangential += energy_beside_it(&PairOf<D>::tangential_force);
        if constexpr (law.has_rolling) {
          measures.elastic_rolling += energy_beside_it(&PairOf<D>::rolling_force);
          if constexpr (D == 3)
            measures.elastic_twisting += energy_beside_it(&PairOf<D>::twisting_moment);
        }
      }
    });
  }

}    // namespace

template <int D> ContactMeasuresOf<D> contact_measures(const RveStateOf<D> &state)
{
  ContactMeasuresOf<D> measures;
  const std::vector<SpringContactOf<D>> contacts = find_spring_contacts(state);
  if (contacts.empty()) return measures;
  add_fabric(contacts, measures);
  add_sliding(contacts, measures);
  add_energies(state, measures);
  return measures;
}

template ContactMeasuresOf<2> contact_measures(const RveStateOf<2> &);
template ContactMeasuresOf<3> contact_measures(const RveStateOf<3> &);

}    // namespace rve
