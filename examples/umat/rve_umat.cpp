// SPDX-License-Identifier: GPL-2.0-only
// An RVE of grains behind each integration point of a finite-element program that takes a UMAT: the user material subroutine of Abaqus/Standard,
// which OOFEM, CalculiX and other programs call as well. Knows librve.h and nothing else of GPU_RVE.
//
//   c++ -std=c++17 -O2 -shared -fPIC rve_umat.cpp -o librve_umat.so $(pkg-config --cflags --libs librve)
//
// Settings. The packing of the RVEs is the file NAME.rve, NAME that of the material, in the folder GPU_RVE_UMAT_PACKINGS (default: the present one);
// Abaqus gives NAME in capital letters. GPU_RVE_UMAT_OPTIONS are those of rve_batch_create() (default: "format double device cpu threads 1").
//
//   PROPS(1)  time of the RVEs for a unit of the host's time [-]: sets their strain rate
//   PROPS(2)  largest DEM time step [time]
//   PROPS(3)  strain of the probes of the consistent tangent DDSDDE [-]; 0: the affine stiffness, without probes
//   PROPS(4)  0: small strain, by DSTRAN; 1: finite strain, by DFGRD0 and DFGRD1
//
// State. A host keeps its state of a point in STATEV and may begin from it as often as it likes. Grains do not fit in there:
//
//   STATEV(1)  handle of the RVE, from 1 on; 0: there is none yet
//   STATEV(2)  number of the trial that made this state; 0: the packing as it was read
//   STATEV(3)  void ratio [-]; only if NSTATV is 3 or more
//
// The answer is a function of STATEV and of the increment, to the bit. An RVE keeps its committed state and, of each trial from it, the increment.
// A call with the number of one of those trials tells that the host has accepted it: it becomes the committed state, made again if it is not the
// last one. A host that goes back further is an error.
//
// Stresses are tension positive, in the order 11, 22, 33, 12, 13, 23; shear strains are engineering strains. Spheres want NTENS 6; disks have no
// stress out of the plane and want strains 33, 13, 23 that are zero (NTENS 4 or 6). An RVE that does not bear an increment asks for half of it by PNEWDT, and
// has NaN for a stress, so that a host that does not look at PNEWDT does not go on unaware.
#include "librve.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

namespace {

using Matrix = std::array<double, 9>;    // D x D numbers of it, rows one after another

// Place of the strain components 11, 22, 33, 12, 13, 23.
constexpr int ROW[6] = {0, 1, 2, 0, 0, 1}, COLUMN[6] = {0, 1, 2, 1, 2, 2};

void check(int code)
{
  if (code != RVE_SUCCESS) throw std::runtime_error(rve_error());
}

struct Settings {
  double time_ratio, largest_step, probe;
  bool finite_strain;

  Settings(const double *props, int count)
  {
    if (count != 4)
      throw std::runtime_error("NPROPS is " + std::to_string(count) + "; it must be 4");
    const auto positive = [&](int k, const char *name) {
      if (!(props[k] > 0.0) || !std::isfinite(props[k]))
        throw std::runtime_error("PROPS(" + std::to_string(k + 1) + "), " + name + ", is " +
                                 std::to_string(props[k]) + "; it must be positive");
      return props[k];
    };
    time_ratio = positive(0, "time of the RVEs for a unit of the host's time [-]");
    largest_step = positive(1, "largest DEM time step [time]");
    probe = props[2] == 0.0 ? 0.0 : positive(2, "strain of the probes [-]");
    if (props[3] != 0.0 && props[3] != 1.0)
      throw std::runtime_error("PROPS(4) is " + std::to_string(props[3]) +
                               "; it must be 0, small strain, or 1, finite strain");
    finite_strain = props[3] == 1.0;
  }
};

/// An increment of a point as librve takes it.
struct Trial {
  Matrix increment;
  double dt;
  int32_t substeps;
};

/// One RVE in a batch of its own: hosts ask for one point at a time.
class Point {
 public:
  explicit Point(const std::string &file)
  {
    rve_packing *packing = nullptr;
    check(rve_packing_read(file.c_str(), &packing));
    const char *options = std::getenv("GPU_RVE_UMAT_OPTIONS");
    const int code = rve_batch_create(
        &packing, 1, options ? options : "format double device cpu threads 1", &batch);
    rve_packing_free(packing);
    check(code);
    dimension = rve_batch_dimension(batch);
  }
  Point(const Point &) = delete;
  Point &operator=(const Point &) = delete;
  ~Point() { rve_batch_free(batch); }

  bool is_new() const { return committed == 0; }

  /// Goes to the state that trial `number` made, from where the next trial begins.
  void begin_from(long number)
  {
    if (number == committed) return;
    const auto found = trials.find(number);
    if (found == trials.end())
      throw std::runtime_error("the host goes back to trial " + std::to_string(number) +
                               " of this point; its RVE is at trial " + std::to_string(committed) +
                               " and keeps what was tried from there");
    if (number != present) move(found->second);
    check(rve_commit(batch));
    committed = number;
    trials.clear();
  }

  /// Tries an increment and remembers it; returns its number, or 0 if the RVE does not bear it.
  long attempt(const Trial &trial)
  {
    if (!move(trial)) return 0;
    trials[++count] = trial;
    return present = count;
  }
  /// Tries an increment for its stress alone.
  bool probe(const Trial &trial) { return move(trial); }

  double void_ratio()
  {
    double value = 0.0;
    check(rve_quantity(batch, "void_ratio", nullptr, 1, &value));
    return value;
  }

  rve_batch *batch = nullptr;
  int dimension = 0;
  Matrix stress{};

 private:
  long committed = 0, count = 0;
  long present = 0;                ///< the trial that the batch has, or 0
  std::map<long, Trial> trials;    ///< from the committed state

  bool move(const Trial &trial)
  {
    std::uint32_t status = 0;
    present = 0;
    check(rve_trial(batch, nullptr, 1, trial.increment.data(), &trial.dt, &trial.substeps,
                    stress.data(), &status));
    return (status & rve_status_fatal()) == 0;
  }
};

/// All points of this process. Hosts may work on different points in several threads.
class Points {
 public:
  Point &at(double handle)
  {
    const std::lock_guard<std::mutex> lock(mutex);
    if (!(handle >= 1.0 && handle <= static_cast<double>(all.size()) &&
          handle == std::floor(handle)))
      throw std::runtime_error("STATEV(1) is " + std::to_string(handle) + "; there are RVEs 1 to " +
                               std::to_string(all.size()) +
                               " in this process: results of an earlier run cannot be continued");
    return *all[static_cast<std::size_t>(handle) - 1];
  }

  /// For a point without an RVE: a new one, or, when a host tries its first increment again, the one it got before.
  double handle_of(int element, int point, const double *place, const std::string &file)
  {
    const std::lock_guard<std::mutex> lock(mutex);
    const Key key{element, point, place[0], place[1], place[2]};
    const auto found = first.find(key);
    if (found != first.end() && all[static_cast<std::size_t>(found->second) - 1]->is_new())
      return found->second;
    all.push_back(std::make_unique<Point>(file));
    return first[key] = static_cast<double>(all.size());
  }

 private:
  using Key =
      std::tuple<int, int, double, double, double>;    // some hosts do not number their points
  std::mutex mutex;
  std::vector<std::unique_ptr<Point>> all;
  std::map<Key, double> first;
};

Points &points()
{
  static Points all;
  return all;
}

std::string packing_file(const char *name)
{
  std::string material(name, strnlen(name, 80));    // Fortran's, with blanks behind it, or C's
  material.erase(material.find_last_not_of(' ') + 1);
  const char *folder = std::getenv("GPU_RVE_UMAT_PACKINGS");
  return std::string(folder ? folder : ".") + "/" + material + ".rve";
}

/// 1 + a strain of one unit in component k.
Matrix stretched(int dimension, int k, double size)
{
  Matrix f{};
  for (int i = 0; i < dimension; ++i) f[i * dimension + i] = 1.0;
  const double part = k < 3 ? size : 0.5 * size;
  f[ROW[k] * dimension + COLUMN[k]] += part;
  if (k >= 3) f[COLUMN[k] * dimension + ROW[k]] += part;
  return f;
}

Matrix product(int dimension, const Matrix &a, const Matrix &b)
{
  Matrix c{};
  for (int i = 0; i < dimension; ++i)
    for (int j = 0; j < dimension; ++j)
      for (int k = 0; k < dimension; ++k)
        c[i * dimension + j] += a[i * dimension + k] * b[k * dimension + j];
  return c;
}

/// F1 F0^-1 of Fortran's matrices, whose columns are one after another.
void relative_gradient(const double *f0, const double *f1, double g[3][3])
{
  const auto at = [&](int i, int j) {
    return f0[i % 3 + 3 * (j % 3)];
  };
  double cofactor[3][3], determinant = 0.0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      cofactor[i][j] = at(i + 1, j + 1) * at(i + 2, j + 2) - at(i + 1, j + 2) * at(i + 2, j + 1);
  for (int j = 0; j < 3; ++j) determinant += at(0, j) * cofactor[0][j];
  if (!(determinant > 0.0))
    throw std::runtime_error("the determinant of DFGRD0 is " + std::to_string(determinant) +
                             "; it must be positive");
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      g[i][j] = 0.0;
      for (int k = 0; k < 3; ++k) g[i][j] += f1[i + 3 * k] * cofactor[j][k] / determinant;
    }
}

/// The arguments of UMAT that matter here.
struct Call {
  double *stress, *statev, *ddsdde, *pnewdt;
  const double *dstran, *coords, *dfgrd0, *dfgrd1;
  double dtime;
  const char *cmname;
  int ndi, nshr, nstatv, element, point;
};

/// Components of stress and strain that grains of this dimension have.
std::vector<int> components(int dimension, int tensors)
{
  if (dimension == 2) return {0, 1, 3};
  std::vector<int> all;
  for (int k = 0; k < tensors; ++k) all.push_back(k);
  return all;
}

Trial trial_of(const Call &call, const Settings &settings, int dimension, int tensors)
{
  double g[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  if (settings.finite_strain)
    relative_gradient(call.dfgrd0, call.dfgrd1, g);
  else
    for (int k = 0; k < tensors; ++k) {
      const double part = k < 3 ? call.dstran[k] : 0.5 * call.dstran[k];
      g[ROW[k]][COLUMN[k]] += part;
      if (k >= 3) g[COLUMN[k]][ROW[k]] += part;
    }
  for (const auto &row : g)
    for (const double component : row)
      if (!std::isfinite(component))
        throw std::runtime_error("the increment is not a finite number");
  if (dimension == 2)
    for (int i = 0; i < 3; ++i)
      if (g[i][2] != (i == 2 ? 1.0 : 0.0) || g[2][i] != (i == 2 ? 1.0 : 0.0))
        throw std::runtime_error(
            "the packing is of disks, and the increment has a strain out of the plane 12");
  Trial trial{};
  for (int i = 0; i < dimension; ++i)
    for (int j = 0; j < dimension; ++j) trial.increment[i * dimension + j] = g[i][j];
  const double duration = settings.time_ratio * call.dtime;
  trial.substeps = static_cast<int32_t>(std::ceil(duration / settings.largest_step));
  // a host may ask for stress and tangent as they are, without time
  const bool rests = trial.increment == stretched(dimension, 0, 0.0);
  if (trial.substeps < 1 && !rests)
    throw std::runtime_error("DTIME is " + std::to_string(call.dtime) +
                             "; it must be positive where there is a strain");
  trial.dt = trial.substeps > 0 ? duration / trial.substeps : settings.largest_step;
  return trial;
}

/// The derivative of the stress of a trial by engineering strain, by differences (small strain), or of the Kirchhoff stress over J by the rate of
/// deformation, in a frame that turns with the grains (finite strain), as the manual of Abaqus has it. False if an RVE does not bear a probe.
bool consistent_tangent(Point &point, const Trial &trial, const Settings &settings,
                        const Matrix &stress, const std::vector<int> &which, int tensors,
                        double *tangent)
{
  const int d = point.dimension;
  for (const int column : which) {
    Trial probe = trial;
    const Matrix stretch = stretched(d, column, settings.probe);
    if (settings.finite_strain)
      probe.increment = product(d, stretch, trial.increment);
    else
      for (int k = 0; k < d * d; ++k)
        probe.increment[k] += stretch[k] - (k % (d + 1) == 0 ? 1.0 : 0.0);
    if (!point.probe(probe)) return false;
    for (const int row : which) {
      const int place = ROW[row] * d + COLUMN[row];
      const double volume = settings.finite_strain && column < 3 ? stress[place] : 0.0;
      tangent[row + tensors * column] =
          (point.stress[place] - stress[place]) / settings.probe + volume;
    }
  }
  return true;
}

void affine_tangent(Point &point, const std::vector<int> &which, int tensors, double *tangent)
{
  const int d = point.dimension, strains = d == 2 ? 3 : 6;
  const std::array<int, 6> place = d == 2 ? std::array<int, 6>{0, 1, -1, 2, -1, -1}
                                          : std::array<int, 6>{0, 1, 2, 3, 4, 5};
  std::vector<double> stiffness(static_cast<std::size_t>(d) * d * strains);
  check(rve_affine_stiffness(point.batch, nullptr, 1, stiffness.data()));
  for (const int row : which)
    for (const int column : which)    // a strain xy of librve is half of an engineering strain
      tangent[row + tensors * column] =
          stiffness[(ROW[row] * d + COLUMN[row]) * strains + place[column]] *
          (column < 3 ? 1.0 : 0.5);
}

void answer(const Call &call, const Settings &settings)
{
  if (call.nstatv < 2)
    throw std::runtime_error("NSTATV is " + std::to_string(call.nstatv) +
                             "; it must be at least 2");
  const int tensors = call.ndi + call.nshr;
  if (call.ndi != 3 || (call.nshr != 1 && call.nshr != 3))
    throw std::runtime_error("NDI is " + std::to_string(call.ndi) + " and NSHR " +
                             std::to_string(call.nshr) +
                             "; they must be 3 and 1, plane strain, or 3 and 3");
  double handle = call.statev[0];
  if (handle == 0.0)
    handle = points().handle_of(call.element, call.point, call.coords, packing_file(call.cmname));
  Point &point = points().at(handle);
  point.begin_from(static_cast<long>(call.statev[1]));
  if (point.dimension == 3 && tensors != 6)
    throw std::runtime_error("the packing is of spheres, and NTENS " + std::to_string(tensors) +
                             "; it must be 6");

  const Trial trial = trial_of(call, settings, point.dimension, tensors);
  const std::vector<int> which = components(point.dimension, tensors);
  std::vector<double> tangent(static_cast<std::size_t>(tensors) * tensors, 0.0);
  const long number = point.attempt(trial);
  const Matrix found = point.stress;
  const double void_ratio = point.void_ratio();
  const bool probes = settings.probe > 0.0 && trial.substeps > 0;
  if (number == 0 ||
      (probes &&
       !consistent_tangent(point, trial, settings, found, which, tensors, tangent.data()))) {
    *call.pnewdt = std::min(*call.pnewdt, 0.5);
    std::fill_n(call.stress, tensors, std::numeric_limits<double>::quiet_NaN());
    return;
  }
  if (!probes) affine_tangent(point, which, tensors, tangent.data());
  std::fill_n(call.stress, tensors, 0.0);
  for (const int k : which) call.stress[k] = found[ROW[k] * point.dimension + COLUMN[k]];
  std::copy(tangent.begin(), tangent.end(), call.ddsdde);
  call.statev[0] = handle;
  call.statev[1] = static_cast<double>(number);
  if (call.nstatv > 2) call.statev[2] = void_ratio;
}

}    // namespace

extern "C" RVE_API void umat_(double *stress, double *statev, double *ddsdde, double *, double *,
                              double *, double *, double *, double *, double *, const double *,
                              const double *dstran, const double *, const double *dtime,
                              const double *, const double *, const double *, const double *,
                              const char *cmname, const int *ndi, const int *nshr, const int *,
                              const int *nstatv, const double *props, const int *nprops,
                              const double *coords, const double *, double *pnewdt, const double *,
                              const double *dfgrd0, const double *dfgrd1, const int *noel,
                              const int *npt, const int *, const int *, const int *, const int *)
{
  try {
    answer({stress, statev, ddsdde, pnewdt, dstran, coords, dfgrd0, dfgrd1, *dtime, cmname, *ndi,
            *nshr, *nstatv, *noel, *npt},
           Settings(props, *nprops));
  } catch (const std::exception &e) {
    // a UMAT has no other way to tell its host
    std::fprintf(stderr, "rve_umat: element %d, point %d: %s\n", *noel, *npt, e.what());
    std::exit(1);
  }
}
