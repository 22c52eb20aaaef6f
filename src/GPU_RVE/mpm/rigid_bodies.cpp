// SPDX-License-Identifier: GPL-2.0-only
#include "mpm/rigid_bodies.h"

#include "mpm/point_sums.h"
#include "rve/core/error.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mpm {

using rve::require;

namespace {

  /// Returns the rotation by a rotation vector [radian] from Rodrigues' formula. In 2D the angle is
  /// the first component.
  template <int D> Tensor<D> rotation_by(const double *vector)
  {
    constexpr int SPINS = rve::Space<D>::spins;
    double square = 0.0;
    for (int k = 0; k < SPINS; ++k) square += vector[k] * vector[k];
    const double angle = std::sqrt(square);
    if (!(angle > 0.0)) return Tensor<D>::identity();
    double rates[FREEDOMS<D>] = {};
    for (int k = 0; k < SPINS; ++k) rates[D + k] = vector[k] / angle;
    const Tensor<D> spin = spin_tensor<D>(rates);
    return Tensor<D>::identity() + std::sin(angle) * spin + (1.0 - std::cos(angle)) * (spin * spin);
  }

  /// Returns `count` sums over the points that `takes` accepts, as sum_over_points() does.
  template <int D, class Takes, class Value>
  std::vector<double> sums(const PointView<D> &points, const Communication &communication,
                           int count, const Takes &takes, const Value &value)
  {
    const auto check = [](double largest, std::int64_t terms) {
      require(largest * static_cast<double>(terms) < 1e300,
              "a point of a rigid body has a position, mass, velocity or force that is too large");
    };
    return sum_over_points(points, communication, count, takes, value, check).sums;
  }

  /// Transforms the inertia matrix from the axes of a body (`own`) to the axes of space (`world`).
  /// `turn` is the orientation of the body.
  template <int D> void turn_inertia(const Tensor<D> &turn, const double *own, double *world)
  {
    constexpr int S = FREEDOMS<D>;
    double full[S][S] = {};
    for (int i = 0; i < S; ++i)
      for (int j = 0; j < S; ++j) {
        if (i < D && j < D) full[i][j] = turn(i, j);
        if (i >= D && j >= D) full[i][j] = D == 2 ? 1.0 : turn(i - D, j - D);
      }
    for (int i = 0; i < S; ++i)
      for (int j = 0; j < S; ++j) {
        double sum = 0.0;
        for (int k = 0; k < S; ++k)
          for (int l = 0; l < S; ++l) sum += full[i][k] * own[S * k + l] * full[j][l];
        world[S * i + j] = sum;
      }
  }

  /// Returns the distance [length] by which a face must move outwards to be two cells beyond a side
  /// of the grid. `distance` is the distance of the face from the centre. The result is 0 unless
  /// the face is parallel to the side, and either on the side or less than two cells beyond it.
  template <int D>
  double beyond_side(const SolverOptions<D> &options, const Vec<D> &centre, const Vec<D> &normal,
                     double distance)
  {
    const double cell = options.cell_size, near = POSITION_TOLERANCE * cell;
    for (int a = 0; a < D; ++a) {
      if (!(std::abs(normal[a]) > 1.0 - 1e-9)) continue;
      const double face = centre[a] + normal[a] * distance;
      const double beyond = normal[a] < 0.0 ? options.lo[a] - face : face - options.hi[a];
      if (beyond > -near && beyond < 2.0 * cell) return 2.0 * cell - beyond;
    }
    return 0.0;
  }

}    // namespace

template <int D> RigidBodies<D>::RigidBodies(const SolverOptions<D> &options) : options_(options)
{
  for (int b = 0; b < static_cast<int>(options.rigid_bodies.size()); ++b) {
    const RigidBodyOptions &body = options.rigid_bodies[b];
    const auto refuse_unless = [&](bool is_right, const auto &...what) {
      require(is_right, options.name_of_body(b), " ", what...);
    };
    index_.push_back(body.form == BodyForm::Face ? -1 : static_cast<int>(bodies_.size()));
    refuse_unless(body.friction >= 0.0 && std::isfinite(body.friction),
                  "must have a coefficient of friction of at least 0, got ", body.friction);
    refuse_unless(!(body.rough && body.friction > 0.0),
                  "is rough and has a coefficient of friction; only one of the two is allowed");
    refuse_unless(D == 3 || body.form != BodyForm::Cylinder,
                  "is a cylinder, which requires three dimensions");
    if (options.axisymmetric) check_symmetry(b);
    if (body.form == BodyForm::Face) {
      refuse_unless(body.free == 0 && !(body.friction > 0.0) && !body.has_pivot,
                    "presses with one face, which supports no forces, friction or rotation: use "
                    "another form");
      continue;
    }
    bodies_.push_back(b);
    hulls_.push_back(body.form == BodyForm::Convex ? hull_of(b) : ConvexHull<D>());
  }
  states_.resize(bodies_.size());
  prescribed_.assign(bodies_.size(), {});
}

/// Requires a body that an axisymmetric model allows: a ring or disk that moves along the axis.
template <int D> void RigidBodies<D>::check_symmetry(int body) const
{
  const RigidBodyOptions &options = options_.rigid_bodies[body];
  const std::string name = options_.name_of_body(body);
  require(options.form != BodyForm::Ball, name,
          " is a ball; an axisymmetric body has the form face, box or convex");
  constexpr int ALONG_AXIS = 1 << 1;
  require((options.free & ~ALONG_AXIS) == 0, name,
          " is free to move along x or to turn; an axisymmetric body moves along y only");
  require(options.turned[0] == 0.0, name,
          " is turned, which is not axisymmetric; give its vertices in their final place");
  if (body >= static_cast<int>(options_.rigid_body_vertices.size())) return;
  for (const Vec<D> &vertex : options_.rigid_body_vertices[body])
    require(vertex[0] >= 0.0, name, " has a vertex at the radius ", vertex[0],
            " [length]; an axisymmetric body is given by its half at x >= 0");
}

/// Returns the hull in the axes of the body.
template <int D> ConvexHull<D> RigidBodies<D>::hull_of(int body) const
{
  std::vector<Vec<D>> vertices;
  if (body < static_cast<int>(options_.rigid_body_vertices.size()))
    vertices = options_.rigid_body_vertices[body];
  const Tensor<D> to_body = transpose(rotation_by<D>(options_.rigid_bodies[body].turned));
  for (Vec<D> &vertex : vertices) vertex = to_body * vertex;
  const ConvexHull<D> hull = convex_hull(vertices, options_.name_of_body(body));
  const double cell = options_.cell_size, width = hull.least_width();
  require(width >= (1.0 - 1e-6) * cell, options_.name_of_body(body),
          " must be at least one cell wide from each face to the opposite vertex, ", cell,
          " [length], got ", width, " [length]");
  return hull;
}

template <int D> void RigidBodies<D>::set_rates(int body, const double *rates)
{
  for (int k = 0; k < S; ++k)
    require(std::isfinite(rates[k]), k < D ? "velocity" : "spin", " of ",
            options_.name_of_body(body), " must be finite, got ", rates[k],
            k < D ? " [length/time]" : " [1/time]");
  for (int k = 0; options_.axisymmetric && k < S; ++k)
    require(k == 1 || rates[k] == 0.0, k < D ? "velocity along x" : "spin", " of ",
            options_.name_of_body(body),
            " must be 0, because an axisymmetric body moves along the axis only, got ", rates[k],
            k < D ? " [length/time]" : " [1/time]");
  std::copy_n(rates, S, prescribed_.at(index_.at(body)).begin());
}

/// Finds the half sizes and the centre of a body. They follow from the boxes of its points, or for
/// the form Convex from its vertices. The centre is relative to the origin of the coordinates.
template <int D>
void RigidBodies<D>::fit_form(int k, const PointView<D> &points, const Communication &communication)
{
  const int b = bodies_[k];
  State &body = states_[k];
  const Tensor<D> to_body = transpose(body.orientation);
  double extent[2 * D];
  std::fill_n(extent, 2 * D, -std::numeric_limits<double>::infinity());
  for (int p = 0; p < points.count; ++p) {
    if (points.rigid_body[p] != b) continue;
    const Vec<D> place = to_body * first_of<D>(points.position[p]);
    for (int a = 0; a < D; ++a) {
      extent[a] = std::max(extent[a], points.half_size[p][a] - place[a]);
      extent[D + a] = std::max(extent[D + a], points.half_size[p][a] + place[a]);
    }
  }
  communication.max_over_ranks(extent, 2 * D);
  Vec<D> middle;
  for (int a = 0; a < D; ++a) {
    require(std::isfinite(extent[a]), options_.name_of_body(b), " has no points");
    middle[a] = 0.5 * (extent[D + a] - extent[a]);
    body.half[a] = 0.5 * (extent[D + a] + extent[a]);
  }
  if (options_.rigid_bodies[b].form == BodyForm::Convex) {
    middle = hulls_[k].middle;
    body.half = hulls_[k].half;
  }
  const double cell = options_.cell_size;
  for (int a = 0; a < D; ++a)
    require(2.0 * body.half[a] >= (1.0 - 1e-6) * cell, options_.name_of_body(b),
            " must be at least one cell wide, ", cell, " [length], got ", 2.0 * body.half[a],
            " [length]");
  body.centre = body.orientation * middle;
}

/// Sets the origin to the pivot, or without a pivot to the centre of mass. Then expresses the
/// centre of the form and the centre of mass relative to the origin, in the axes of the body.
template <int D>
void RigidBodies<D>::place_origin(int k, const PointView<D> &points,
                                  const Communication &communication)
{
  const int b = bodies_[k];
  const RigidBodyOptions &options = options_.rigid_bodies[b];
  State &body = states_[k];
  const auto is_own = [&](int p) { return points.rigid_body[p] == b; };
  const Tensor<D> to_body = transpose(body.orientation);
  const Vec<D> middle = body.centre;
  const double allowed = 0.5 * options_.cell_size;
  const std::vector<double> moments = sums(points, communication, 1 + D, is_own, [&](int p, int q) {
    return q == 0 ? points.mass[p] : points.mass[p] * (points.position[p][q - 1] - middle[q - 1]);
  });
  Vec<D> mass_centre = middle;
  if (moments[0] > 0.0)
    for (int a = 0; a < D; ++a) mass_centre[a] += moments[1 + a] / moments[0];
  for (const auto &side : hulls_[k].sides) {
    const double outside =
        dot(side.plane.normal, to_body * (mass_centre - middle)) - side.plane.distance;
    require(outside <= allowed, options_.name_of_body(b), " has points whose center of mass, ",
            in_words<D>(mass_centre.component, " "), ", is ", outside,
            " [length] outside of its vertices; it must be at most half a cell, ", allowed,
            " [length]");
  }
  require(options.free == 0 || moments[0] > 0.0, options_.name_of_body(b),
          " moves under forces, so its points must have mass");
  body.origin = mass_centre;
  if (options.has_pivot) std::copy_n(options.pivot, D, body.origin.component);
  body.centre = to_body * (middle - body.origin);
  body.mass_centre = to_body * (mass_centre - body.origin);
}

/// Finds the inertia of the points and their boxes about the origin, and the initial rates.
template <int D>
void RigidBodies<D>::find_inertia(int k, const PointView<D> &points,
                                  const Communication &communication)
{
  const int b = bodies_[k];
  const RigidBodyOptions &options = options_.rigid_bodies[b];
  State &body = states_[k];
  const auto is_own = [&](int p) { return points.rigid_body[p] == b; };
  const Tensor<D> to_body = transpose(body.orientation);
  const auto arm = [&](int p) { return to_body * (first_of<D>(points.position[p]) - body.origin); };
  // a point's own box adds m/3 (l² + l'²) about an axis, with the half sizes l, l' across the axis
  const auto own_inertia = [&](int p, int i, int j) {
    if (i != j || i < D) return 0.0;
    double sum = 0.0;
    for (int a = 0; a < D; ++a)
      if (D == 2 || a != i - D) sum += points.half_size[p][a] * points.half_size[p][a];
    return sum / 3.0;
  };
  const std::vector<double> of_places =
      sums(points, communication, S * S, is_own, [&](int p, int q) {
        return points.mass[p] * dot(unit_motion(q / S, arm(p)), unit_motion(q % S, arm(p)));
      });
  const std::vector<double> of_boxes =
      sums(points, communication, S * S, is_own,
           [&](int p, int q) { return points.mass[p] * own_inertia(p, q / S, q % S); });
  for (int q = 0; q < S * S; ++q) body.inertia[q] = of_places[q] + of_boxes[q];

  std::copy(prescribed_[k].begin(), prescribed_[k].end(), body.rates);
  if (options.free == 0) return;
  const std::vector<double> momentum = sums(points, communication, S, is_own, [&](int p, int q) {
    const Vec<D> world_arm = first_of<D>(points.position[p]) - body.origin;
    return points.mass[p] * dot(first_of<D>(points.velocity[p]), unit_motion(q, world_arm));
  });
  // the momentum of points does not include the inertia of their boxes; a small part of this
  // inertia makes the matrix regular for points on one line
  constexpr double SMALL_PART = 1e-9;
  double own[S * S], world[S * S];
  for (int q = 0; q < S * S; ++q) own[q] = of_places[q] + SMALL_PART * of_boxes[q];
  turn_inertia(body.orientation, own, world);
  solve_free<D>(world, momentum.data(), options.free, body.rates);
}

template <int D>
std::vector<RigidBodyStep<D>> &RigidBodies<D>::steps(const PointView<D> &points, double dt,
                                                     const Communication &communication)
{
  steps_.assign(bodies_.size(), {});
  for (int k = 0; k < static_cast<int>(bodies_.size()); ++k) {
    State &body = states_[k];
    const RigidBodyOptions &options = options_.rigid_bodies[bodies_[k]];
    if (!body.is_made) {
      body.orientation = rotation_by<D>(options.turned);
      fit_form(k, points, communication);
      place_origin(k, points, communication);
      find_inertia(k, points, communication);
      body.is_made = true;
    }
    RigidBodyStep<D> &step = steps_[k];
    step.body = bodies_[k];
    step.free = options.free;
    step.is_new = body.has_moved ? 0 : 1;
    step.shape.form = options.form;
    step.shape.half = body.half;
    step.shape.orientation = body.orientation;
    step.shape.centre = body.origin + body.orientation * body.centre;
    step.origin = body.origin;
    const double cell = options_.cell_size;
    if (options.form == BodyForm::Convex)
      set_half_spaces(k, step.shape);
    else
      widen_at_sides(step.shape);
    step.reach = std::sqrt(dot(body.centre, body.centre)) + 2.0 * step.shape.radius() + 2.0 * cell;
    // each line through the bounding box along an axis has at most two contacts on the surface, and
    // each node inside has one
    const double across = 2.0 * step.shape.radius() / cell + 3.0;
    double terms = 1.0;
    for (int a = 0; a < D; ++a) terms *= std::min(across, 1e4);
    step.terms = static_cast<std::int64_t>((2.0 * D + 1.0) * terms);
    std::copy_n(body.rates, S, step.before);
    for (int i = 0; i < S; ++i)
      step.now[i] = options.free >> i & 1 ? body.rates[i] : prescribed_[k][i];
    turn_inertia(body.orientation, body.inertia, step.inertia);
  }
  add_forces(points, dt, communication);
  return steps_;
}

template <int D> int RigidBodies<D>::num_enclosed(int body, const PointView<D> &points) const
{
  if (state(body).has_moved) return 0;
  const RigidShape<D> &shape = steps_.at(index_.at(body)).shape;
  const double least = 1e-6 * options_.cell_size;
  int count = 0;
  for (int p = 0; p < points.count; ++p) {
    typename RigidShape<D>::Crossing crossing;
    if (points.rigid_body[p] != body &&
        shape.cross(first_of<D>(points.position[p]), 0, 0.0, crossing) &&
        crossing.place[0] < -least && crossing.place[1] > least)
      ++count;
  }
  return count;
}

/// Moves flat faces that are on a side of the grid, or less than two cells beyond it, to two cells
/// beyond the side, since the body continues there.
template <int D> void RigidBodies<D>::widen_at_sides(RigidShape<D> &shape) const
{
  const int first = shape.form == BodyForm::Box ? 0 : shape.form == BodyForm::Cylinder ? 2 : D;
  for (int b = first; b < D; ++b)
    for (const double end : {-1.0, 1.0}) {
      const Vec<D> normal = end * column(shape.orientation, b);
      const double more = 0.5 * beyond_side(options_, shape.centre, normal, shape.half[b]);
      if (more == 0.0) continue;
      shape.half[b] += more;
      shape.centre = shape.centre + more * normal;
    }
}

/// Sets the half spaces of the form Convex, with extensions beyond sides of the grid as in
/// widen_at_sides().
template <int D> void RigidBodies<D>::set_half_spaces(int k, RigidShape<D> &shape) const
{
  ConvexHull<D> hull = hulls_[k];
  for (std::size_t side = 0; side < hulls_[k].sides.size(); ++side) {
    const HalfSpace<D> &plane = hull.sides[side].plane;
    const double more =
        beyond_side(options_, shape.centre, shape.orientation * plane.normal, plane.distance);
    if (more != 0.0) hull.extend(side, more);
  }
  require(hull.sides.size() <= MOST_HALF_SPACES, options_.name_of_body(bodies_[k]),
          " must have at most ", MOST_HALF_SPACES,
          " faces, including those of its extension beyond sides of the grid, got ",
          hull.sides.size());
  shape.half = hull.half;
  shape.num_half_spaces = static_cast<int>(hull.sides.size());
  for (int n = 0; n < shape.num_half_spaces; ++n) shape.half_space[n] = hull.sides[n].plane;
}

/// Finds the momentum of the bodies that forces drive, and their rates u without contact. The
/// equation of motion about an origin that moves with the body is
///   M du/dt = Q - (m ω × (ω × c), ω × I ω)
/// with the inertia matrix M, the forces and torques Q, the mass m, the spin ω, the moments of
/// inertia I, and the centre of mass c relative to the origin.
template <int D>
void RigidBodies<D>::add_forces(const PointView<D> &points, double dt,
                                const Communication &communication)
{
  std::vector<int> free;
  for (std::size_t k = 0; k < bodies_.size(); ++k)
    if (steps_[k].free != 0) free.push_back(static_cast<int>(k));
  if (free.empty()) return;
  const int count = S * static_cast<int>(free.size());
  const auto takes = [&](int p) {
    return points.rigid_body[p] >= 0 && index_[points.rigid_body[p]] >= 0 &&
        steps_[index_[points.rigid_body[p]]].free != 0;
  };
  const std::vector<double> forces = sums(points, communication, count, takes, [&](int p, int q) {
    const RigidBodyStep<D> &step = steps_[free[q / S]];
    if (points.rigid_body[p] != step.body) return 0.0;
    return dot(first_of<D>(points.body_force[p]),
               unit_motion(q % S, first_of<D>(points.position[p]) - step.origin));
  });
  for (std::size_t n = 0; n < free.size(); ++n) {
    RigidBodyStep<D> &step = steps_[free[n]];
    const State &body = states_[free[n]];
    double spin_only[S] = {}, momentum[S] = {};
    std::copy(step.before + D, step.before + S, spin_only + D);
    const Vec<D> c = body.orientation * body.mass_centre;
    const Vec<D> centripetal = velocity_at(spin_only, velocity_at(spin_only, c));
    for (int i = 0; i < S; ++i)
      for (int j = 0; j < S; ++j) {
        step.impulse[i] += step.inertia[S * i + j] * step.before[j];
        if (i >= D) momentum[i] += step.inertia[S * i + j] * spin_only[j];
      }
    for (int i = 0; i < S; ++i) {
      double bias = 0.0;
      if (i < D) {
        bias = step.inertia[0] * centripetal[i];
      } else if constexpr (D == 3) {
        const int next = D + (i - D + 1) % 3, last = D + (i - D + 2) % 3;
        bias = spin_only[next] * momentum[last] - spin_only[last] * momentum[next];
      }
      step.impulse[i] += dt * (forces[S * n + i] - bias);
    }
    solve_free<D>(step.inertia, step.impulse, step.free, step.now);
  }
}

template <int D> void RigidBodies<D>::advance(double dt)
{
  for (std::size_t k = 0; k < bodies_.size(); ++k) {
    const RigidBodyStep<D> &step = steps_[k];
    State &body = states_[k];
    for (int a = 0; a < D; ++a) body.origin[a] += dt * step.now[a];
    body.orientation = turn_of<D>(step.now, dt) * body.orientation;
    for (int i = D; i < S; ++i) body.turned[i - D] += dt * step.now[i];
    std::copy_n(step.now, S, body.rates);
    body.has_moved = true;
  }
}

/// Calls visit(numbers, count) for each group of numbers that follows the first two numbers in the
/// record of a body.
template <int D>
template <class Body, class Visit>
void RigidBodies<D>::each_number(Body &body, const Visit &visit)
{
  for (auto *vector : {&body.origin, &body.centre, &body.half, &body.mass_centre})
    visit(vector->component, D);
  visit(body.orientation.component, D * D);
  visit(body.rates, S);
  visit(body.turned, rve::Space<D>::spins);
  visit(body.inertia, S * S);
}

template <int D> std::vector<double> RigidBodies<D>::record(int number) const
{
  const State &body = state(number);
  std::vector<double> all = {body.is_made ? 1.0 : 0.0, body.has_moved ? 1.0 : 0.0};
  each_number(body,
              [&](const double *from, int count) { all.insert(all.end(), from, from + count); });
  return all;
}

template <int D> void RigidBodies<D>::set_record(int number, const double *record)
{
  State &body = states_.at(index_.at(number));
  body.is_made = *record++ != 0.0;
  body.has_moved = *record++ != 0.0;
  each_number(body, [&](double *to, int count) {
    std::copy_n(record, count, to);
    record += count;
  });
}

template class RigidBodies<2>;
template class RigidBodies<3>;

}    // namespace mpm
