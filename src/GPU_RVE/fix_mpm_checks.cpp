// SPDX-License-Identifier: GPL-2.0-only

#include "fix_mpm_jobs.h"

#include "rve/core/checksum.h"
#include "rve/core/pi.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "neighbor.h"
#include "update.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

using namespace LAMMPS_NS;
using mpm::Face;

namespace {

// steps between two comparisons of the local damping force with reactions
constexpr int DAMPING_EVERY = 50;
// A warning is printed above this ratio of the local damping force to the largest reaction [-].
constexpr double DAMPING_WARN = 0.01;
// A cell is too full above this ratio of the volume of its points to its own volume [-].
constexpr double FULL = 1.3;

/// Shares of the volume of a cell that the boxes of points fill.
struct CellShare {
  std::int64_t id = 0;                  // number of the cell in the whole grid
  double by_new = 0.0, by_all = 0.0;    // shares of new points and of all points [-]
};
using CellShares = std::unordered_map<std::int64_t, CellShare>;

/// Sums the shares of each cell over all ranks. Each rank returns the sums of some cells: cell c
/// belongs to the rank whose number is c modulo the number of ranks. Collective.
std::vector<CellShare> summed_over_ranks(MPI_Comm world, const CellShares &own)
{
  int num_ranks;
  MPI_Comm_size(world, &num_ranks);
  std::vector<std::vector<CellShare>> to(num_ranks);
  for (const auto &[id, cell] : own) to[id % num_ranks].push_back(cell);
  std::vector<CellShare> sent, received;
  std::vector<int> counts, starts, from_counts(num_ranks), from_starts;
  for (const std::vector<CellShare> &cells : to) {
    starts.push_back((int) (sent.size() * sizeof(CellShare)));
    counts.push_back((int) (cells.size() * sizeof(CellShare)));
    sent.insert(sent.end(), cells.begin(), cells.end());
  }
  MPI_Alltoall(counts.data(), 1, MPI_INT, from_counts.data(), 1, MPI_INT, world);
  int bytes = 0;
  for (const int count : from_counts) {
    from_starts.push_back(bytes);
    bytes += count;
  }
  received.resize(bytes / sizeof(CellShare));
  MPI_Alltoallv(sent.data(), counts.data(), starts.data(), MPI_BYTE, received.data(),
                from_counts.data(), from_starts.data(), MPI_BYTE, world);
  // a stable sort keeps the order of ranks, so that sums have the same bits in each run
  std::stable_sort(received.begin(), received.end(),
                   [](const CellShare &a, const CellShare &b) { return a.id < b.id; });
  std::vector<CellShare> sums;
  for (const CellShare &cell : received) {
    if (sums.empty() || sums.back().id != cell.id) {
      sums.push_back(cell);
      continue;
    }
    sums.back().by_new += cell.by_new;
    sums.back().by_all += cell.by_all;
  }
  return sums;
}

/// Adds a share to the member `by` of each cell that the box of point i meets: the part of the
/// volume of the cell that the box fills. The box has the volume of the point. Its sides are
/// parallel to the axes and proportional to the initial sides times the diagonal of the deformation
/// gradient. The cross-section of a ring counts in axisymmetry.
template <int D>
void fill(const mpm::Grid<D> &grid, const mpm::PointView<D> &points, bool axisymmetric, int i,
          double CellShare::*by, CellShares &filled)
{
  const mpm::Tensor<D> &f = points.deformation_gradient[i];
  const mpm::Vec<D> &half_size = points.half_size[i];
  double boxed = 1.0;
  for (int a = 0; a < D; a++) boxed *= 2.0 * half_size[a] * std::fabs(f(a, a));
  if (axisymmetric) boxed *= 2.0 * rve::kPi * points.position[i][0];
  const double ratio = boxed > 0.0 ? points.volume[i] / boxed : 0.0;
  const double scale = D == 2 ? std::sqrt(ratio) : std::cbrt(ratio);
  mpm::NodeBox<D> cells;
  double low[D], high[D];
  for (int a = 0; a < D; a++) {
    const double extent = scale * half_size[a] * std::fabs(f(a, a));
    low[a] = grid.scaled(points.position[i][a] - extent, a);
    high[a] = grid.scaled(points.position[i][a] + extent, a);
    if (!(std::fabs(low[a]) < 1e7 && std::fabs(high[a]) < 1e7)) low[a] = high[a] = -2.0;
    cells.first[a] = std::max(0, (int) std::floor(low[a]));
    cells.end[a] = std::min(grid.cells(a), (int) std::floor(high[a]) + 1);
  }
  cells.for_each([&](const mpm::NodeIndex<D> &cell) {
    double share = 1.0;
    for (int a = D - 1; a >= 0; a--)
      share *= std::max(0.0, std::min(high[a], cell[a] + 1.0) - std::max(low[a], 1.0 * cell[a]));
    CellShare &of_cell = filled[grid.id(cell)];
    of_cell.id = grid.id(cell);
    of_cell.*by += share;
  });
}

}    // namespace

template <int D> std::uint64_t MpmChecks<D>::sum_of_positions() const
{
  std::uint64_t sum = 0;
  for (int i = 0; i < atom->nlocal; i++) {
    rve::Checksum one;
    one.add(&atom->tag[i], sizeof(tagint));
    one.add(atom->x[i], D * sizeof(double));
    sum += one.value();
  }
  MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_UINT64_T, MPI_SUM, world);
  return sum;
}

template <int D> typename MpmChecks<D>::Box MpmChecks<D>::box() const
{
  Box box;
  for (int a = 0; a < D; a++) {
    box[2 * a] = domain->boxlo[a];
    box[2 * a + 1] = domain->boxhi[a];
  }
  return box;
}

template <int D> void MpmChecks<D>::keep_positions()
{
  points_then = atom->natoms;
  positions_then = sum_of_positions();
  box_then = box();
}

template <int D> void MpmChecks<D>::check_positions() const
{
  if (points_then != atom->natoms || positions_then == sum_of_positions()) return;
  if (box() != box_then)
    error->all(FLERR,
               "fix mpm {}: points and simulation box have changed since the last run (for example "
               "by change_box with remap), but strains and stresses of the points have not; change "
               "the box without remap, or before the fix is defined",
               setup.fix->id);
  if (comm->me == 0)
    error->warning(FLERR,
                   "fix mpm {}: points have been moved since the last run; their displacements "
                   "include this motion, their strains and stresses do not",
                   setup.fix->id);
}

template <int D> void MpmChecks<D>::check_overlap()
{
  if (warned_overlap) return;
  bigint several[2] = {0, 0};    // points in the groups of several models, and of several bodies
  for (int i = 0; i < atom->nlocal; i++) {
    const auto count = [mask = atom->mask[i]](const auto &groups) {
      return std::count_if(groups.begin(), groups.end(),
                           [mask](const auto &some) { return (mask & some.groupbit) != 0; });
    };
    const auto bodies = count(setup.settings.bodies);
    if (bodies > 1) several[1]++;
    if (bodies == 0 && count(setup.settings.models) > 1) several[0]++;
  }
  MPI_Allreduce(MPI_IN_PLACE, several, 2, MPI_LMP_BIGINT, MPI_SUM, world);
  for (int k = 0; k < 2; k++)
    if (several[k] > 0 && comm->me == 0)
      error->warning(FLERR,
                     "fix mpm {}: {} points are in the groups of more than one {}; the last one in "
                     "the command applies",
                     setup.fix->id, several[k], k == 0 ? "model" : "rigid body");
  warned_overlap = several[0] + several[1] > 0;
}

template <int D>
void MpmChecks<D>::check_volume(const Points &points, const std::vector<int> &made, bool in_run)
{
  if (in_run && warned_full) return;
  warned_full = false;
  bigint total = made.size();
  MPI_Allreduce(MPI_IN_PLACE, &total, 1, MPI_LMP_BIGINT, MPI_SUM, world);
  if (total == 0) return;
  const mpm::Grid<D> &grid = setup.solver->grid();
  const bool axisymmetric = setup.settings.options.axisymmetric;
  CellShares filled;    // shares by points of this rank
  for (const int i : made) fill(grid, points, axisymmetric, i, &CellShare::by_new, filled);
  bigint deformable = 0;
  for (int i = 0; i < atom->nlocal; i++) {
    if (points.rigid_body[i] >= 0) continue;
    fill(grid, points, axisymmetric, i, &CellShare::by_all, filled);
    deformable++;
  }
  MPI_Allreduce(MPI_IN_PLACE, &deformable, 1, MPI_LMP_BIGINT, MPI_SUM, world);
  bigint found[2] = {0, 0}, &cells = found[0], &over = found[1];
  double fullest = 0.0;
  for (const CellShare &cell : summed_over_ranks(world, filled)) {
    if (!(cell.by_new > 1e-6)) continue;
    cells++;
    // skip a cell if new points fill at most FULL - 1 of it: then the older points alone fill it
    if (!(cell.by_all > FULL && cell.by_new > FULL - 1.0)) continue;
    over++;
    fullest = std::max(fullest, cell.by_all);
  }
  MPI_Allreduce(MPI_IN_PLACE, found, 2, MPI_LMP_BIGINT, MPI_SUM, world);
  MPI_Allreduce(MPI_IN_PLACE, &fullest, 1, MPI_DOUBLE, MPI_MAX, world);
  if (over == 0) return;
  const bool are_all_new = total == deformable;
  const double h = grid.cell_size();
  const char *const volume = D == 2 ? "area" : "volume";
  const std::string text =
      fmt::format("{} of {} cells with {}points, {} [distance] each, contain more than {} times "
                  "their {}, the fullest {:.3g} times. Mass and stiffness are too large by this "
                  "factor. Each new point has the {} {} [distance^{}]: give the correct value with "
                  "points_per_cell or volume, and check for points that were created twice{}",
                  over, cells, are_all_new ? "" : "new ",
                  D == 2 ? fmt::format("{} by {}", h, h) : fmt::format("{} by {} by {}", h, h, h),
                  FULL, volume, fullest, volume, setup.settings.initial_volume, D,
                  are_all_new ? "" : " or on top of existing ones");
  if (are_all_new && 2 * over > cells) error->all(FLERR, "fix mpm {}: {}", setup.fix->id, text);
  warned_full = in_run;
  if (comm->me == 0) error->warning(FLERR, "fix mpm {}: {}", setup.fix->id, text);
}

/// LAMMPS deletes atoms outside of the simulation box when it exchanges atoms. It is no error if
/// points leave the group of a body but still exist.
template <int D> void MpmChecks<D>::check_bodies(const Points &points, bool advance)
{
  const std::size_t bodies = setup.settings.bodies.size();
  if (bodies == 0 || (advance && neighbor->ago != 0)) return;
  std::vector<bigint> count(bodies + 1, 0);
  count[bodies] = atom->nlocal;
  for (int i = 0; i < atom->nlocal; i++)
    if (points.rigid_body[i] >= 0) count[points.rigid_body[i]]++;
  MPI_Allreduce(MPI_IN_PLACE, count.data(), (int) count.size(), MPI_LMP_BIGINT, MPI_SUM, world);
  for (std::size_t b = 0; b < bodies && count[bodies] < atom->natoms; b++) {
    if (!advance || body_points.size() <= b || count[b] >= body_points[b]) continue;
    const double *lo = domain->boxlo, *hi = domain->boxhi;
    std::string box;
    for (int a = 0; a < D; a++)
      box += fmt::format("{}{} from {} to {}", a == 0 ? "" : ", ", "xyz"[a], lo[a], hi[a]);
    error->all(
        FLERR,
        "fix mpm {}: step {}: rigid body {} has lost {} of its {} points, which left the "
        "simulation box, {} [length]; make the box large enough for the whole motion of the body",
        setup.fix->id, update->ntimestep, setup.settings.bodies[b].group, body_points[b] - count[b],
        body_points[b], box);
  }
  body_points.assign(count.begin(), count.end() - 1);
}

template <int D> void MpmChecks<D>::check_enclosed(const Points &points) const
{
  for (const int b : setup.turning) {
    bigint enclosed = setup.solver->rigid_bodies().num_enclosed(b, points);
    MPI_Allreduce(MPI_IN_PLACE, &enclosed, 1, MPI_LMP_BIGINT, MPI_SUM, world);
    if (enclosed > 0 && comm->me == 0)
      error->warning(FLERR,
                     "fix mpm {}: {} points that do not belong to the rigid body {} are inside its "
                     "form; place the body next to the material and to other bodies",
                     setup.fix->id, enclosed, setup.settings.bodies[b].group);
  }
}

template <int D> void MpmChecks<D>::report_parts()
{
  if (reported_parts) return;
  reported_parts = true;
  int extremes[2] = {setup.solver->held_nodes(), -setup.solver->held_nodes()};
  MPI_Allreduce(MPI_IN_PLACE, extremes, 2, MPI_INT, MPI_MAX, world);
  const int most = extremes[0], least = -extremes[1];
  if (comm->me != 0) return;
  const std::string each = least == most ? fmt::format("{}", most)
                                         : fmt::format("{} to {}", least, most);
  utils::logmesg(lmp, "fix mpm {}: {}{} of {:.0f} grid nodes are in memory\n", setup.fix->id,
                 comm->nprocs == 1 ? "" : "on each MPI rank ", each,
                 setup.solver->grid().all().count());
}

template <int D> void MpmChecks<D>::add_damping()
{
  const mpm::SolverOptions<D> &options = setup.settings.options;
  if (!(options.damping > 0.0) || update->ntimestep % DAMPING_EVERY != 0) return;
  const auto magnitude = [](const mpm::Vec<D> &force) {
    return D == 2 ? std::hypot(force[0], force[1]) : std::sqrt(dot(force, force));
  };
  double largest = 0.0;
  for (int b = 0; b < (int) setup.settings.bodies.size(); b++)
    largest = std::max(largest, magnitude(setup.solver->body_reaction(b)));
  for (int side = 0; side < mpm::FACES<D>; side++)
    if (options.sides[side] != mpm::SideKind::Free || options.dashpots[side].exist())
      largest = std::max(largest, magnitude(setup.solver->side_reaction(static_cast<Face>(side))));
  damping_sum += magnitude(setup.solver->damping_force());
  reaction_sum += largest;
}

template <int D> void MpmChecks<D>::report_damping(int last)
{
  if (comm->me != 0 || !(reaction_sum > 0.0)) return;
  const double share = damping_sum / reaction_sum;
  const std::string text =
      fmt::format("local damping {} amounts to {:.2g} % of the largest reaction on average over "
                  "this run; reactions on opposite sides of the material differ by this amount",
                  setup.settings.options.damping, 100.0 * share);
  // the warning is printed once; later runs only log the ratio
  if (share > DAMPING_WARN && !warned_damping) {
    warned_damping = true;
    error->warning(FLERR,
                   "fix mpm {}: {}. f_{}[{}] and f_{}[{}] are components of the damping force; use "
                   "less damping, or none",
                   setup.fix->id, text, setup.fix->id, last - 1, setup.fix->id, last);
  } else
    utils::logmesg(lmp, "fix mpm {}: {}\n", setup.fix->id, text);
}

template class LAMMPS_NS::MpmChecks<2>;
template class LAMMPS_NS::MpmChecks<3>;
