// Around the kernels that advance RVEs, when increments and stresses of their points are on the device: what the increments become, in which order
// RVEs go, and where the answers belong. Pointers are of the device, but where something else is said.

#ifndef RVE_ENGINE_CUDA_INCREMENTS_CUH
#define RVE_ENGINE_CUDA_INCREMENTS_CUH

#include "rve/engine/cuda_kernels.h"
#include "rve/engine/device_calls.h"

#include <cstddef>

namespace rve {

/// RVEs are sorted by their costs into so many classes.
constexpr int kCostClasses = 256;

/// What plan and answers find, from zeros. The host is told what comes before the classes.
struct CallFindings {
  unsigned long long steps;    ///< of all RVEs
  int longest;                 ///< most DEM steps of one
  int refused;                 ///< RVEs that take more than an increment
  int questions;
  int unfinished;    ///< RVEs that have failed or must repeat the call
  int stiffened;     ///< RVEs with more contacts than their plan expects
  int unused;
  int class_size[kCostClasses], class_taken[kCostClasses];
};
constexpr std::size_t kToldFindings = offsetof(CallFindings, class_size);

/// More are for the host as a whole.
constexpr int kMostQuestions = 4096;

template <int D> struct QuestionRecord {
  int place, substeps;
  double pressure;
  double deformation[Space<D>::components];
};

template <int D> struct IncrementLaunch {
  PointsOnDevice points;
  const RveHandle *rves;    ///< (count)
  const int *point_of;      ///< (count)
  PlannedRve *planned;      ///< (count)
  int count;
  PlanOptions options;
  double most_cost;          ///< DEM steps times grains
  DriveRecord<D> *drives;    ///< (count)
  unsigned char *classes;    ///< (count), or null: all cost the same
  int *order;                ///< (count)
  CallFindings *findings;
  QuestionRecord<D> *questions;      ///< (kMostQuestions), of the host
  const AnswerRecord<D> *answers;    ///< (count)
  int *stiffened;                    ///< (MOST_STIFFENED) places, of the host
};

constexpr int kIncrementBlock = 128;

template <int D>
RVE_HD inline Tensor<double, D> increment_of_point(const IncrementLaunch<D> &launch, int place)
{
  const std::size_t point = launch.point_of[place];
  if (launch.points.dimension == D)
    return load_tensor<D>(launch.points.increment + Space<D>::components * point);
  return in_plane_strain<D>(load_tensor<2>(launch.points.increment + Space<2>::components * point));
}

template <int D>
__global__ void __launch_bounds__(kIncrementBlock) plan_increments(const IncrementLaunch<D> launch)
{
  __shared__ int longest, steps;
  __shared__ int sizes[kCostClasses];
  if (threadIdx.x == 0) longest = steps = 0;
  for (int c = threadIdx.x; c < kCostClasses; c += kIncrementBlock) sizes[c] = 0;
  __syncthreads();
  const int k = blockIdx.x * kIncrementBlock + threadIdx.x;
  if (k < launch.count) {
    const Tensor<double, D> f = increment_of_point(launch, k);
    int substeps;
    const PlanKind kind = plan_increment(f, launch.planned[k], launch.options, substeps);
    if (kind == PlanKind::Refused) atomicAdd(&launch.findings->refused, 1);
    if (kind == PlanKind::Question) {
      const int q = atomicAdd(&launch.findings->questions, 1);
      if (q < kMostQuestions) {
        QuestionRecord<D> question = {k, substeps, launch.planned[k].pressure, {}};
        store_tensor(f, question.deformation);
        launch.questions[q] = question;
      }
    }
    DriveRecord<D> drive = {launch.options.dt, substeps, 1, {}};
    store_tensor(f, drive.deformation);
    launch.drives[k] = drive;
    atomicMax(&longest, substeps);
    atomicAdd(&steps, substeps);
    if (launch.classes) {
      const double share =
          static_cast<double>(substeps) * launch.rves[k].num_grains / launch.most_cost;
      const int c = kCostClasses - 1 - static_cast<int>(share * (kCostClasses - 1));
      launch.classes[k] = static_cast<unsigned char>(c < 0 ? 0 : c);
      atomicAdd(&sizes[c < 0 ? 0 : c], 1);
    }
  }
  __syncthreads();
  if (threadIdx.x == 0) {
    atomicMax(&launch.findings->longest, longest);
    atomicAdd(&launch.findings->steps, static_cast<unsigned long long>(steps));
  }
  if (!launch.classes) return;
  for (int c = threadIdx.x; c < kCostClasses; c += kIncrementBlock)
    if (sizes[c] > 0) atomicAdd(&launch.findings->class_size[c], sizes[c]);
}

/// The most expensive ones first. Within a class the order is anybody's: no result depends on it.
template <int D>
__global__ void __launch_bounds__(kCostClasses) order_increments(const IncrementLaunch<D> launch)
{
  __shared__ int begin[kCostClasses];    // of the class behind
  const int me = threadIdx.x;
  begin[me] = launch.findings->class_size[me];
  __syncthreads();
  for (int distance = 1; distance < kCostClasses; distance *= 2) {
    const int before = me >= distance ? begin[me - distance] : 0;
    __syncthreads();
    begin[me] += before;
    __syncthreads();
  }
  const int k = blockIdx.x * kCostClasses + me;
  if (k >= launch.count) return;
  const int c = launch.classes[k];
  // the threads of a warp that have the same class take their places together
  const unsigned together = __match_any_sync(__activemask(), c);
  const int leader = __ffs(together) - 1, lane = me % 32;
  int first = 0;
  if (lane == leader) first = atomicAdd(&launch.findings->class_taken[c], __popc(together));
  first = __shfl_sync(together, first, leader);
  const int mine = __popc(together & ((1u << lane) - 1u));
  launch.order[(c > 0 ? begin[c - 1] : 0) + first + mine] = k;
}

/// What the host has decided otherwise.
template <int D> struct DecidedRecord {
  int place, unused;
  DriveRecord<D> drive;
};

template <int D>
__global__ void decide_increments(const DecidedRecord<D> *decided, int count,
                                  DriveRecord<D> *drives)
{
  const int m = blockIdx.x * blockDim.x + threadIdx.x;
  if (m < count) drives[decided[m].place] = decided[m].drive;
}

template <int D>
__global__ void __launch_bounds__(kIncrementBlock) take_answers(const IncrementLaunch<D> launch)
{
  const int k = blockIdx.x * kIncrementBlock + threadIdx.x;
  if (k >= launch.count) return;
  const AnswerRecord<D> answer = launch.answers[k];
  if (answer.status & (status::Fatal | status::ListFull | status::ForceSaturated)) {
    atomicAdd(&launch.findings->unfinished, 1);
    return;
  }
  const Tensor<double, D> stress = load_tensor<D>(answer.stress);
  launch.planned[k].pressure = -(1.0 / D) * trace(stress);
  launch.planned[k].status = answer.status;
  if (answer.num_contacts > launch.planned[k].most_contacts) {
    const int m = atomicAdd(&launch.findings->stiffened, 1);
    if (m < DeviceCallsOf<D>::MOST_STIFFENED) launch.stiffened[m] = k;
  }
  const std::size_t point = launch.point_of[k];
  if (launch.points.dimension == D)
    store_tensor(stress, launch.points.stress + Space<D>::components * point);
  else
    store_tensor(leading_components<2>(stress),
                 launch.points.stress + Space<2>::components * point);
}

}    // namespace rve

#endif
