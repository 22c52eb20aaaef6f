// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/mpm_settings.h"

#include "lammps/collective_error.h"
#include "lammps/progress.h"
#include "lammps/rank_resources.h"
#include "rve/core/error.h"
#include "rve/core/pi.h"
#include "rve/engine/advice.h"

#include "comm.h"
#include "domain.h"
#include "error.h"
#include "group.h"
#include "lammps.h"
#include "utils.h"

#include <algorithm>
#include <cmath>
#include <string_view>

using namespace LAMMPS_NS;

namespace {

// Largest number of points in a cell: 100 along each axis in the plane, 21 in space.
constexpr double MOST_POINTS_PER_CELL = 1e4;

// Upper limit of the Courant numbers of *cfl*. The estimate of the wave speed of RVEs is an upper
// bound, so that a script may allow numbers above 1.
constexpr double MAX_COURANT = 10.0;

/// State of the parser. The keywords *face* and *separation* refer to the load or body before them,
/// *density* to the model or body before it.
template <int D> struct ParseState {
  MpmSettings<D> &settings;
  mpm::SolverOptions<D> &options = settings.options;
  mpm::Face *face = nullptr;    ///< face of the last load or body; null before the first one
  std::string owner{};          ///< subject of the last load or body
  /// Subject and density of the last model or body; the pointer is null before the first one.
  std::string density_owner{};
  std::optional<double> *density = nullptr;
  /// For each body, the last keyword that requires the form *face*, and the last keyword that
  /// requires another form.
  std::vector<std::string> needs_face{}, needs_form{};
};

// Names of sides in the order of mpm::Face.
constexpr const char *SIDES[] = {"xlo", "xhi", "ylo", "yhi", "zlo", "zhi"};
constexpr const char *VELOCITIES[] = {"vx", "vy", "vz"};
constexpr const char *SPINS[] = {"wx", "wy", "wz"};    // a body in the plane has the last one only
constexpr const char *AXES[] = {"x", "y", "z"};
constexpr const char *TRACTIONS[] = {"tx", "ty", "tz"};

/// Returns the volume of a cell, in the plane its area [length^D].
template <int D> double volume_of_cell(const mpm::SolverOptions<D> &options)
{
  const double h = options.cell_size;
  return D == 2 ? h * h : h * h * h;
}

template <int D> mpm::Face read_side(ScriptArguments &words)
{
  return static_cast<mpm::Face>(words.choice("", rve::Words(SIDES, SIDES + mpm::FACES<D>)));
}

template <int D> void read_boundary(ScriptArguments &words, ParseState<D> &state)
{
  const std::string side = words.peek();
  const int index = (int) read_side<D>(words);
  mpm::SideKind &kind = state.options.sides[index];
  words.about("boundary " + side);
  const bool absorbs = std::string_view(words.peek()) == "absorbing";
  using Kind = mpm::SideKind;
  kind = words.choice<Kind>(side,
                            {{"free", Kind::Free},
                             {"roller", Kind::Roller},
                             {"fixed", Kind::Fixed},
                             {"absorbing", Kind::Free}});
  if (!absorbs) return;

  mpm::Dashpots &dashpots = state.options.dashpots[index];
  const std::string what = side + " absorbing";
  if (words.take("roller")) {
    kind = Kind::Roller;
    dashpots.tangential = words.positive(what + " cs", "[length/time]");
    return;
  }
  dashpots.normal = words.positive(what + " cp", "[length/time]");
  dashpots.tangential = words.number(what + " cs");
  if (!(dashpots.tangential >= 0.0 && dashpots.tangential < dashpots.normal))
    words.refuse(fmt::format("boundary {} cs is {} [length/time]; it must be at least 0 and below "
                             "cp, {}, because shear waves are slower than compression waves",
                             what, rve::number(dashpots.tangential), rve::number(dashpots.normal)));
}

template <int D> void read_model(ScriptArguments &words, ParseState<D> &state)
{
  state.settings.models.push_back(MpmModel<D>::read(words));
  state.density_owner = "model " + state.settings.models.back().group;
  state.density = &state.settings.models.back().density;
}

template <int D> void read_density(ScriptArguments &words, ParseState<D> &state)
{
  const std::string subject = state.density ? state.density_owner + " density" : "density";
  words.about(subject);
  double density = 0.0;
  if (!words.take("rve")) {
    density = words.number();
    if (!(density > 0.0))
      words.refuse(fmt::format("{} is {} [mass/length^3]; it must be greater than 0, or rve",
                               subject, rve::number(density)));
  }
  if (state.density)
    *state.density = density;
  else
    state.settings.density = density;
}

/// Applies a single *density* of the command to all points, wherever the keyword is in the command.
/// Returns the subject of the keyword, or "" if there are several densities or none.
template <int D> std::string share_density(const ScriptArguments &words, MpmSettings<D> &settings)
{
  std::string subject;
  for (const auto &given : words.given()) {
    if (given.keyword != "density") continue;
    if (!subject.empty()) return "";
    subject = given.subject;
  }
  const auto share = [&](auto &owners) {
    for (auto &owner : owners) {
      settings.density = owner.density.value_or(settings.density);
      owner.density.reset();
    }
  };
  share(settings.models);
  share(settings.bodies);
  return subject;
}

/// Reads *volume*, the volume of a point (in the plane its area), or the equivalent
/// *points_per_cell*.
template <int D> void read_volume(ScriptArguments &words, ParseState<D> &state)
{
  const bool is_share = words.keyword() == "points_per_cell";
  words.about("volume");
  const double given = words.number();
  const double cell = volume_of_cell(state.options), number = is_share ? given : cell / given;
  // the tolerance allows for rounding in the script
  if (!(number >= 1.0 - 1e-6 && number <= MOST_POINTS_PER_CELL * (1.0 + 1e-6)))
    words.refuse(is_share
                     ? fmt::format("points_per_cell is {} [-]; it must be from 1 to {}",
                                   rve::number(given), rve::number(MOST_POINTS_PER_CELL))
                     : fmt::format("volume is {} [length^{}]; it must be from {} to {} (the volume "
                                   "of a cell), because a cell has at most {} points",
                                   rve::number(given), D, rve::number(cell / MOST_POINTS_PER_CELL),
                                   rve::number(cell), rve::number(MOST_POINTS_PER_CELL)));
  state.settings.initial_volume = is_share ? cell / given : given;
}

template <int D> constexpr const char *rigid_form()
{
  return D == 2 ? "group-ID vx value vy value rough | smooth | friction mu"
                : "group-ID vx value vy value vz value rough | smooth | friction mu";
}

/// Reads a prescribed rate, or the word *free*.
template <int D>
void read_rate(ScriptArguments &words, ParseState<D> &state, int freedom, const char *part)
{
  if (words.take("free")) {
    state.options.rigid_bodies.back().free |= 1 << freedom;
    state.needs_form.back() = "free";
  } else {
    state.settings.bodies.back().rates[freedom] = words.value(part);
  }
}

template <int D> void read_rigid(ScriptArguments &words, ParseState<D> &state)
{
  MpmRigidBody<D> body;
  body.group = words.peek();
  body.groupbit = words.groupbit("group");
  state.owner = "rigid " + body.group;
  words.about(state.owner);
  state.settings.bodies.push_back(body);
  state.density_owner = state.owner;
  state.density = &state.settings.bodies.back().density;
  state.options.rigid_bodies.emplace_back();
  state.options.rigid_body_names.push_back(body.group);
  state.needs_face.emplace_back();
  state.needs_form.emplace_back();
  mpm::RigidBodyOptions &how = state.options.rigid_bodies.back();
  if (D == 3) how.face = mpm::Face::ZLo;
  for (int a = 0; a < D; a++) {
    if (!words.take(VELOCITIES[a]))
      words.refuse(fmt::format("rigid has '{}' instead of {}; it must read: rigid {}",
                               words.next(VELOCITIES[a]), VELOCITIES[a], rigid_form<D>()));
    read_rate(words, state, a, VELOCITIES[a]);
  }
  const bool has_friction = std::string_view(words.peek()) == "friction";
  how.rough =
      words.choice<bool>("contact", {{"smooth", false}, {"rough", true}, {"friction", false}});
  if (has_friction) {
    if (words.starts_number()) {
      how.friction = words.positive("friction", "[-]");
      if (how.friction > rve::LARGEST_USUAL_FRICTION && words.owner()->comm->me == 0)
        words.owner()->error->warning(
            FLERR,
            "{}: friction of {} is {} [-], above {}; if this is an angle in degrees, use its "
            "tangent",
            state.settings.name(), state.owner, rve::number(how.friction),
            rve::number(rve::LARGEST_USUAL_FRICTION));
    } else {
      state.settings.bodies.back().friction = words.value("friction");
      how.friction = 1.0;    // replaced when the variable is evaluated
    }
    state.needs_form.back() = "friction";
  }
  state.face = &how.face;
}

/// Returns the options of the last body. A keyword before the first body is an error.
template <int D> mpm::RigidBodyOptions &body_before(ScriptArguments &words, ParseState<D> &state)
{
  if (state.options.rigid_bodies.empty())
    words.refuse(words.keyword() + " must follow a rigid body");
  words.about(state.owner + " " + words.keyword());
  return state.options.rigid_bodies.back();
}

template <int D> void read_separation(ScriptArguments &words, ParseState<D> &state)
{
  body_before(words, state).separation = words.logical();
}

template <int D> void read_body_form(ScriptArguments &words, ParseState<D> &state)
{
  mpm::RigidBodyOptions &body = body_before(words, state);
  using Form = mpm::BodyForm;
  if constexpr (D == 2)
    body.form = words.choice<Form>(
        "",
        {{"face", Form::Face}, {"box", Form::Box}, {"ball", Form::Ball}, {"convex", Form::Convex}});
  else
    body.form = words.choice<Form>("",
                                   {{"face", Form::Face},
                                    {"box", Form::Box},
                                    {"ball", Form::Ball},
                                    {"cylinder", Form::Cylinder},
                                    {"convex", Form::Convex}});
  if (body.form != Form::Convex) return;
  auto &of_bodies = state.options.rigid_body_vertices;
  of_bodies.resize(state.options.rigid_bodies.size());
  of_bodies.back().resize(words.whole("convex", D + 1, mpm::MOST_VERTICES));
  int number = 0;
  for (mpm::Vec<D> &vertex : of_bodies.back()) {
    ++number;
    for (int a = 0; a < D; a++)
      vertex[a] = words.number(fmt::format("convex {}{}", AXES[a], number));
  }
}

template <int D> void read_spin(ScriptArguments &words, ParseState<D> &state)
{
  body_before(words, state);
  state.needs_form.back() = "spin";
  for (int k = D; k < mpm::FREEDOMS<D>; k++)
    read_rate(words, state, k, D == 2 ? SPINS[2] : SPINS[k - D]);
}

template <int D> void read_pivot(ScriptArguments &words, ParseState<D> &state)
{
  mpm::RigidBodyOptions &body = body_before(words, state);
  state.needs_form.back() = "pivot";
  body.has_pivot = true;
  for (int a = 0; a < D; a++) body.pivot[a] = words.number(AXES[a]);
}

/// Reads the rotation vector of a body in degrees and stores it in radians.
template <int D> void read_turned(ScriptArguments &words, ParseState<D> &state)
{
  constexpr double DEGREE = 3.14159265358979323846 / 180.0, MOST = 360.0;
  mpm::RigidBodyOptions &body = body_before(words, state);
  state.needs_form.back() = "turned";
  for (int k = 0; k < rve::Space<D>::spins; k++) {
    const double angle = words.number(D == 2 ? "angle" : AXES[k]);
    if (!(std::fabs(angle) <= MOST))
      words.refuse(fmt::format("{} turned is {} [degrees]; it must be from {} to {}", state.owner,
                               rve::number(angle), -MOST, MOST));
    body.turned[k] = DEGREE * angle;
  }
}

/// Ends with error->all if a body has a keyword that does not suit its form.
template <int D> void check_forms(LAMMPS *lmp, const ParseState<D> &state)
{
  for (std::size_t b = 0; b < state.options.rigid_bodies.size(); b++) {
    const bool has_face = state.options.rigid_bodies[b].form == mpm::BodyForm::Face;
    const std::string &misplaced = has_face ? state.needs_form[b] : state.needs_face[b];
    if (misplaced.empty()) continue;
    lmp->error->all(FLERR, "{}: rigid {}: {} is for a body of form {}", state.settings.name(),
                    state.settings.bodies[b].group, misplaced,
                    has_face ? (D == 2 ? "box, ball or convex" : "box, ball, cylinder or convex")
                             : "face");
  }
}

template <int D> void read_round(ScriptArguments &words, ParseState<D> &state)
{
  body_before(words, state).round = words.logical();
  state.needs_face.back() = "round";
}

/// Reads *traction* or *pressure*. Several loads can act on the same points.
template <int D> void read_load(ScriptArguments &words, ParseState<D> &state)
{
  const std::string keyword = words.keyword();
  MpmTraction<D> load;
  load.is_pressure = keyword == "pressure";
  load.id = words.peek();
  const LAMMPS *lmp = words.owner();
  const bool is_region = lmp->domain->get_region_by_id(load.id) && lmp->group->find(load.id) < 0;
  if (is_region) words.next();
  load.groupbit = is_region ? 0 : words.groupbit("group");
  words.about(fmt::format("{} {}", keyword, load.id), true);
  if (load.is_pressure)
    load.traction[0] = words.value("p");
  else
    for (int a = 0; a < D; a++) load.traction[a] = words.value(TRACTIONS[a]);
  state.settings.tractions.push_back(load);
  state.face = &state.settings.tractions.back().face;
  state.owner = fmt::format("{} {} number {}", keyword, load.id, state.settings.tractions.size());
}

template <int D> void read_face(ScriptArguments &words, ParseState<D> &state)
{
  if (!state.face) words.refuse("face must follow a traction, a pressure or a rigid body");
  words.about(state.owner + " face");
  *state.face = read_side<D>(words);
  if (!state.options.rigid_bodies.empty() && state.face == &state.options.rigid_bodies.back().face)
    state.needs_face.back() = "face";
}

/// Reads the components of *stress* in the order of LAMMPS.
template <int D> void read_stress(ScriptArguments &words, ParseState<D> &state)
{
  mpm::Tensor<D> &stress = state.settings.initial_stress;
  constexpr const char *names[] = {"sxx", "syy", "szz"};
  for (int a = 0; a < D; a++) stress(a, a) = words.number(names[a]);
  constexpr const char *shears[] = {"sxy", "sxz", "syz"};
  for (int a = 0, k = 0; a < D; a++)
    for (int b = a + 1; b < D; b++) stress(a, b) = stress(b, a) = words.number(shears[k++]);
}

constexpr const char *WATER_FORM = "group-ID undrained kw value density value porosity value | rve "
                                   "[cavitation value], or group-ID flows kw value conductivity "
                                   "value gravity value density value porosity value | rve "
                                   "[cavitation value] [drained side] ..., or group-ID submerged "
                                   "density value porosity value | rve";

/// Reads *water*. The words have a fixed order, because *density* is also a keyword of the command.
template <int D> void read_water(ScriptArguments &words, ParseState<D> &state)
{
  MpmWaterSettings &water = state.settings.water;
  mpm::PoreWater &of_solver = state.options.water;
  water.given = true;
  water.group = words.peek();
  water.groupbit = words.groupbit("group");
  const auto expect = [&](const char *part) {
    if (!words.take(part))
      words.refuse(fmt::format("water has '{}' instead of {}; it must read: water {}",
                               words.next(part), part, WATER_FORM));
  };
  using Kind = MpmWaterSettings::Kind;
  water.kind = words.take("submerged") ? Kind::Submerged
      : words.take("flows")            ? Kind::Flows
                                       : Kind::Undrained;
  if (water.kind == Kind::Undrained) expect("undrained");
  if (water.kind != Kind::Submerged) {
    expect("kw");
    of_solver.modulus = words.positive("kw", "[stress]");
  }
  if (water.flows()) {
    expect("conductivity");
    of_solver.mobility = words.positive("conductivity", "[length/time]");
    expect("gravity");
    of_solver.mobility /= words.positive("gravity", "[length/time^2]");
  }
  expect("density");
  water.density = words.positive("density", "[mass/length^3]");
  expect("porosity");
  water.takes_porosity_of_rves = words.take("rve");
  if (!water.takes_porosity_of_rves && words.starts_number())
    water.porosity.constant = words.within("porosity", "[-]", 0.0, 1.0);
  else if (!water.takes_porosity_of_rves)
    water.porosity = words.value("porosity");
  if (water.is_submerged()) return;
  if (words.take("cavitation")) {
    of_solver.cavitation = words.number("cavitation");
    if (!(of_solver.cavitation >= 0.0))
      words.refuse(fmt::format("water cavitation is {} [stress]; it must be at least 0, the "
                               "suction that the water bears",
                               rve::number(of_solver.cavitation)));
  }
  of_solver.mobility /= water.density;
  of_solver.density = water.density;
  while (water.flows() && words.take("drained"))
    water.drained_sides |= 1 << (int) read_side<D>(words);
}

/// Finds the sides that no water passes: those that hold or absorb the ground and are not drained.
template <int D> void close_sides(mpm::SolverOptions<D> &options, int drained)
{
  for (int side = 0; side < mpm::FACES<D>; side++)
    if (options.sides[side] != mpm::SideKind::Free || options.dashpots[side].exist())
      options.water.impervious |= 1 << side & ~drained;
}

constexpr const char *IN_SITU_FORM = "gravity g k0 value | rest [surcharge q] [surface height] "
                                     "[water_table height] [tolerance stress], or stress "
                                     "component ... [tolerance stress]";

/// Reads *insitu*. Its atom-style variables are evaluated later, when points are made.
template <int D> void read_in_situ(ScriptArguments &words, ParseState<D> &state)
{
  MpmInSitu<D> &s = state.settings.in_situ;
  s.given = true;
  rve::Words given;
  const auto take = [&](const char *part) {
    if (!words.take(part)) return false;
    if (std::find(given.begin(), given.end(), part) != given.end())
      words.refuse(fmt::format("insitu has {} twice; give it once", part));
    given.emplace_back(part);
    return true;
  };
  // stress is also a keyword of the command, so that it must be the first word here
  if (take("stress"))
    for (int k = 0; k < rve::Space<D>::strains; k++) s.components.push_back(words.value("stress"));
  while (!words.empty() && !words.at_keyword()) {
    if (take("gravity")) {
      s.gravity = words.positive("gravity", "[length/time^2]");
    } else if (take("k0")) {
      s.is_at_rest = words.take("rest");
      if (!s.is_at_rest) s.k0 = words.value("k0");
    } else if (take("surcharge")) {
      s.surcharge = words.value("surcharge");
    } else if (take("surface")) {
      s.surface = words.value("surface");
    } else if (take("water_table")) {
      s.water_table = words.value("water_table");
    } else if (take("tolerance")) {
      s.tolerance = words.positive("tolerance", "[stress]");
    } else {
      words.refuse(
          fmt::format("insitu has '{}'; it must read: insitu {}", words.next(), IN_SITU_FORM));
    }
  }
  const auto has = [&](std::string_view part) {
    return std::find(given.begin(), given.end(), part) != given.end();
  };
  const bool is_ground = has("gravity") || has("k0") || has("surface") || has("surcharge") ||
      has("water_table");
  if (s.is_by_components() ? is_ground : !(has("gravity") && has("k0")))
    words.refuse(fmt::format(
        "insitu needs gravity and k0, or stress alone; it must read: insitu {}", IN_SITU_FORM));
}

template <int D> void read_axisymmetric(ScriptArguments &words, ParseState<D> &state)
{
  state.options.axisymmetric = words.logical();
  if (D == 3 && state.options.axisymmetric)
    words.refuse(
        "axisymmetric is yes, but the model has three dimensions; use dimension 2, where x "
        "is the radius and y the axial coordinate");
}

template <int D> void read_cfl(ScriptArguments &words, ParseState<D> &state)
{
  MpmSettings<D> &s = state.settings;
  s.courant_warn = words.number("warn");
  s.courant_error = words.number("error");
  if (!(s.courant_warn > 0.0 && s.courant_error >= s.courant_warn &&
        s.courant_error <= MAX_COURANT))
    words.refuse(fmt::format("cfl is {} {}; it must be 0 < warn <= error <= {:g}, because steps "
                             "with larger Courant numbers are unstable",
                             rve::number(s.courant_warn), rve::number(s.courant_error),
                             MAX_COURANT));
}

template <int D> void read_wave_speed(ScriptArguments &words, ParseState<D> &state)
{
  const bool measures = words.choice<bool>("", {{"bound", false}, {"tangent", true}});
  state.settings.wave_tests = measures ? words.integer("tangent", 1) : 0;
  state.settings.wave_every = measures && words.take("every") ? words.integer("tangent every", 1)
                                                              : 0;
}

/// Returns the function of a keyword row that reads a value into a member of the solver's options.
template <int D, class Read, class T>
auto option(const Read &read, T mpm::SolverOptions<D>::*member)
{
  return [=](ScriptArguments &words, ParseState<D> &state) { state.options.*member = read(words); };
}

using mpm::Scheme;
using mpm::ShapeFunction;
using mpm::SolverOptions;

/// Keywords of the command. The last one exists in three dimensions only.
template <int D>
const ScriptKeyword<ParseState<D>> KEYWORDS[] = {
    {"domain", D == 2 ? "xlo xhi ylo yhi" : "xlo xhi ylo yhi zlo zhi",
     [](ScriptArguments &words, ParseState<D> &state) {
       for (int a = 0; a < D; a++) {
         state.options.lo[a] = words.number(SIDES[2 * a]);
         state.options.hi[a] = words.number(SIDES[2 * a + 1]);
       }
     }},
    {"shape", "linear | gimp | cpgimp",
     option(one_of<ShapeFunction>({{"linear", ShapeFunction::Linear},
                                   {"gimp", ShapeFunction::Gimp},
                                   {"cpgimp", ShapeFunction::Cpgimp}}),
            &SolverOptions<D>::shape)},
    {"dilation", "point | cell",
     option(one_of<bool>({{"point", false}, {"cell", true}}), &SolverOptions<D>::mean_dilation)},
    {"scheme", "musl | usavg",
     option(one_of<Scheme>({{"musl", Scheme::Musl}, {"usavg", Scheme::Usavg}}),
            &SolverOptions<D>::scheme)},
    {"axisymmetric", "yes | no", read_axisymmetric<D>},
    {"flip", "share", option(any_number, &SolverOptions<D>::flip)},
    {"damping", "value", option(any_number, &SolverOptions<D>::damping)},
    {"device", "auto | cpu | cuda", option(one_of(rve::DEVICE_CHOICES), &SolverOptions<D>::device)},
    {"boundary",
     D == 2 ? "xlo | xhi | ylo | yhi free | roller | fixed | absorbing cp cs"
            : "xlo | xhi | ylo | yhi | zlo | zhi free | roller | fixed | absorbing cp cs",
     read_boundary<D>},
    {"model", "group-ID rve fix-ID | law ...", read_model<D>},
    {"column", "name",
     [](ScriptArguments &words, ParseState<D> &state) {
       state.settings.columns.emplace_back(words.next());
       words.about("column " + state.settings.columns.back());
     }},
    {"density", "value | rve", read_density<D>},
    {"stress", D == 2 ? "sxx syy sxy" : "sxx syy szz sxy sxz syz", read_stress<D>},
    {"insitu", IN_SITU_FORM, read_in_situ<D>},
    {"water", WATER_FORM, read_water<D>},
    {"volume", "value", read_volume<D>},
    {"points_per_cell", "value", read_volume<D>},
    {"rigid", rigid_form<D>(), read_rigid<D>},
    {"separation", "yes | no", read_separation<D>},
    {"form",
     D == 2 ? "face | box | ball | convex N x1 y1 ... xN yN"
            : "face | box | ball | cylinder | convex N x1 y1 z1 ... xN yN zN",
     read_body_form<D>},
    {"spin", D == 2 ? "value | free" : "value | free value | free value | free", read_spin<D>},
    {"pivot", D == 2 ? "x y" : "x y z", read_pivot<D>},
    {"turned", D == 2 ? "angle" : "x y z", read_turned<D>},
    {"traction", D == 2 ? "ID tx ty" : "ID tx ty tz", read_load<D>},
    {"pressure", "ID p", read_load<D>},
    {"face", D == 2 ? "xlo | xhi | ylo | yhi" : "xlo | xhi | ylo | yhi | zlo | zhi", read_face<D>},
    {"cfl", "warn error", read_cfl<D>},
    {"wave_speed", "bound | tangent N [every M]", read_wave_speed<D>},
    {"progress", "seconds",
     [](ScriptArguments &words, ParseState<D> &state) {
       state.settings.progress_interval = read_progress(words);
     }},
    {"round", "yes | no", read_round<D>}};

}    // namespace

template <int D> MpmSettings<D> MpmSettings<D>::parse(LAMMPS *lmp, int narg, char **arg)
{
  MpmSettings settings;
  settings.id = arg[0];
  const std::string name = settings.name();
  ScriptArguments words(lmp, name, narg, arg, 3);
  words.limit_numbers(LARGEST_MPM_NUMBER);
  mpm::SolverOptions<D> &options = settings.options;
  settings.words.emplace_back("cell size", words.peek());
  options.cell_size = words.positive("cell size", "[length]");
  for (int a = 0; a < D; a++) {
    options.lo[a] = lmp->domain->boxlo[a];
    options.hi[a] = lmp->domain->boxhi[a];
  }
  settings.initial_volume = volume_of_cell(options);
  const RankResources share(lmp->world);
  options.threads = share.threads();
  options.device = mpm::Device::Auto;
  options.device_number = share.rank;

  rve::Words keywords = names_of(KEYWORDS<D>);
  if (D == 2) keywords.pop_back();
  words.set_keywords(std::move(keywords));
  collectively(lmp, name, [&] {
    ParseState<D> state{settings};
    while (words.next_keyword()) words.read(KEYWORDS<D>, state);
    if (settings.in_situ.given && words.has("stress"))
      lmp->error->all(FLERR, "{}: stress and insitu exclude each other", name);
    if (settings.in_situ.water_table && !settings.water.given)
      lmp->error->all(FLERR, "{}: insitu water_table needs the keyword water", name);
    if (settings.in_situ.water_table && settings.water.is_submerged())
      lmp->error->all(FLERR,
                      "{}: water submerged has no water_table, because its pressure is the excess "
                      "over that of still water above all points; give insitu without water_table",
                      name);
    if (settings.water.given && options.axisymmetric)
      lmp->error->all(FLERR,
                      "{}: water does not support axisymmetric yes; use a plane model or a quarter "
                      "in three dimensions",
                      name);
    if (settings.water.flows()) close_sides(options, settings.water.drained_sides);
    check_forms(lmp, state);
    if (options.axisymmetric)
      for (MpmModel<D> &model : settings.models) model.set_axisymmetric();
  });
  const std::string only_density = share_density(words, settings);
  // a user can think that this density applies to one model or body only
  const bool may_mislead = utils::strmatch(only_density, "^rigid ") ||
      (utils::strmatch(only_density, "^model ") && settings.models.size() > 1);
  if (may_mislead && lmp->comm->me == 0)
    utils::logmesg(lmp,
                   "{}: the density of {} is the only one and applies to all points, also to those "
                   "of other models and bodies\n",
                   name, only_density.substr(0, only_density.rfind(' ')));
  for (const auto &given : words.given())
    settings.words.emplace_back(given.subject == only_density ? "density" : given.subject,
                                given.keyword == "points_per_cell"
                                    ? fmt::format("{:.17g}", settings.initial_volume)
                                    : given.values);
  return settings;
}

template <int D> const char *MpmSettings<D>::name_of_side(int side)
{
  return SIDES[side];
}

template <int D> double MpmSettings<D>::width_of_point() const
{
  return D == 2 ? std::sqrt(initial_volume) : std::cbrt(initial_volume);
}

template <int D> double MpmSettings<D>::initial_volume_at(const double *x) const
{
  return options.axisymmetric ? 2.0 * rve::kPi * x[0] * initial_volume : initial_volume;
}

template <int D> void MpmSettings<D>::check_groups(LAMMPS *lmp) const
{
  // a new group can have the bit of a deleted group
  const auto check_group = [&](const char *keyword, const std::string &group, int bit) {
    const int found = lmp->group->find(group);
    if (found < 0)
      lmp->error->all(FLERR, "{}: {}: group {} has been deleted since the fix was defined", name(),
                      keyword, group);
    if (lmp->group->bitmask[found] != bit)
      lmp->error->all(FLERR,
                      "{}: {}: group {} has been deleted and redefined since the fix was defined; "
                      "define the fix after its groups",
                      name(), keyword, group);
  };
  for (const auto &body : bodies) check_group("rigid", body.group, body.groupbit);
  for (const auto &model : models) check_group("model", model.group, model.groupbit);
  if (water.given) check_group("water", water.group, water.groupbit);
  for (const auto &load : tractions)
    if (load.groupbit)
      check_group(load.keyword(), load.id, load.groupbit);
    else if (!lmp->domain->get_region_by_id(load.id))
      lmp->error->all(FLERR, "{}: {}: region {} does not exist", name(), load.keyword(), load.id);
}

template <int D> void MpmSettings<D>::find(LAMMPS *lmp)
{
  check_groups(lmp);
  for (const auto &load : tractions)
    if (load.groupbit && lmp->group->count(lmp->group->find(load.id)) == 0)
      lmp->error->all(FLERR, "{}: {}: group {} has no atoms", name(), load.keyword(), load.id);
  for (auto &body : bodies) {
    for (auto &rate : body.rates) rate.find(lmp, name(), false);
    body.friction.find(lmp, name(), false);
  }
  const std::string of_in_situ = name() + ": insitu";
  for (ScriptValue *value : {&in_situ.k0, &in_situ.surcharge}) value->find(lmp, of_in_situ);
  if (in_situ.surface) in_situ.surface->find(lmp, of_in_situ);
  if (in_situ.water_table) in_situ.water_table->find(lmp, of_in_situ);
  water.porosity.find(lmp, name() + ": water");
  for (ScriptValue &component : in_situ.components) component.find(lmp, of_in_situ);
  for (auto &load : tractions)
    for (auto &component : load.traction) component.find(lmp, name());
}

template struct LAMMPS_NS::MpmSettings<2>;
template struct LAMMPS_NS::MpmSettings<3>;
