// SPDX-License-Identifier: GPL-2.0-only
// Kernels that run before and after the RVE kernel if increments and stresses are in device memory.
// They plan the increments, order the RVEs and distribute the answers. Pointers are device pointers
// unless a comment says otherwise.

#pragma once

#include "rve/block/block_cuda.cuh"
#include "rve/engine/answers.h"
#include "rve/engine/cuda_kernels.h"
#include "rve/engine/device_calls.h"

#include <cstddef>

namespace rve {

/// Number of classes by which RVEs are sorted by cost. The last class has the quiescent RVEs.
constexpr int kCostClasses = 256, kQuiescentClass = kCostClasses - 1;

/// Counts and maxima over the RVEs of a call. They are zero before the plan; the kernels of the
/// plan and then those of the answers increase them. The host receives the members before
/// class_size.
struct CallFindings {
  unsigned long long steps;    ///< sum of DEM steps over RVEs
  int longest;                 ///< largest number of DEM steps
  int refused;                 ///< RVEs that need a DriveOf (PlanKind::Refused)
  int turned;                  ///< RVEs that are turned rigidly first
  int unfinished;              ///< RVEs that have failed or must repeat the call
  int stiffened;               ///< RVEs that exceed PlannedRve::limit
  int num_quiescent;           ///< RVEs without DEM steps
  int evaluations;             ///< RVEs with a diagnostic evaluation
  int held;                    ///< positive: an RVE is refused, quiescent or evaluated
  int class_size[kCostClasses], class_taken[kCostClasses];
};
constexpr std::size_t kHostFindings = offsetof(CallFindings, class_size);

/// Largest number of unfinished RVEs whose calls the host repeats while the results of the other
/// RVEs stay on the device. With more, the host processes the results of the whole call.
constexpr int kMostUnfinished = 64;

/// Rotation of an RVE.
template <int D> struct TurnRecord {
  RveHandle rve;
  double rotation[Space<D>::components];
};

template <int D> struct IncrementLaunch {
  PointsOnDevice points;
  const RveHandle *rves;    ///< (count)
  const int *point_of;      ///< (count)
  PlannedRve *planned;      ///< (count)
  int count;
  PlanOptions options;
  double most_cost;                       ///< largest possible cost: DEM steps times grains
  DriveRecord<D> *drives;                 ///< (count)
  const DriveRecord<D> *drives_before;    ///< (count) of the previous call
  /// (count) Rest, deferred deformation and index of details (LaunchRecord) of each RVE. All three
  /// are null if no RVE is or can become quiescent.
  Rest *rest;
  QuiescentStateOf<D> *quiescent_states;
  int *detail_of;
  DetailRecord<D> *details;
  unsigned char *classes;    ///< (count), or null: all cost the same
  int *order;                ///< (count)
  CallFindings *findings;
  TurnRecord<D> *turns;                     ///< (count), used up to findings->turned
  AnswerRecord<D> *answers;                 ///< (count)
  const AnswerRecord<D> *answers_before;    ///< (count) of the previous call
  const int *hold;    ///< *hold > 0: kernels distribute no answers; null: no effect
  int *stiffened;     ///< (MOST_STIFFENED) indices in host memory
  int *unfinished;    ///< (kMostUnfinished) indices in host memory
};

constexpr int kIncrementBlock = 128;

template <int D>
RVE_HD inline Tensor<double, D> increment_of_point(const IncrementLaunch<D> &launch, int index)
{
  const std::size_t point = launch.point_of[index];
  if (launch.points.dimension == D)
    return load_tensor<D>(launch.points.increment + Space<D>::components * point);
  Tensor<double, D> increment =
      in_plane_strain<D>(load_tensor<2>(launch.points.increment + Space<2>::components * point));
  if constexpr (D == 3)
    if (launch.points.hoop_increment) increment(2, 2) = launch.points.hoop_increment[point];
  return increment;
}

template <int D>
__global__ void __launch_bounds__(kIncrementBlock) plan_increments(const IncrementLaunch<D> launch)
{
  __shared__ int longest, steps, num_quiescent, held;
  __shared__ int sizes[kCostClasses];
  if (threadIdx.x == 0) longest = steps = num_quiescent = held = 0;
  for (int c = threadIdx.x; c < kCostClasses; c += kIncrementBlock) sizes[c] = 0;
  __syncthreads();
  const int k = blockIdx.x * kIncrementBlock + threadIdx.x;
  if (k < launch.count) {
    const Tensor<double, D> f = increment_of_point(launch, k);
    const Rest rest = launch.rest ? launch.rest[k] : Rest::Unknown;
    const IncrementPlan<D> plan =
        plan_increment(f, launch.planned[k], rest, launch.quiescent_states + k, launch.options);
    const bool is_quiescent = plan.kind == PlanKind::Quiescent;
    if (plan.kind == PlanKind::Refused) atomicAdd(&launch.findings->refused, 1);
    if (plan.kind == PlanKind::Turned) {
      TurnRecord<D> &turn = launch.turns[atomicAdd(&launch.findings->turned, 1)];
      turn.rve = launch.rves[k];
      store_tensor(plan.rotation, turn.rotation);
    }
    if (launch.rest)
      launch.detail_of[k] = plan.is_evaluated ? atomicAdd(&launch.findings->evaluations, 1) : -1;
    DriveRecord<D> drive = {launch.options.dt, plan.substeps, 1, {}};
    store_tensor(plan.deformation, drive.deformation);
    launch.drives[k] = drive;
    if (is_quiescent) atomicAdd(&num_quiescent, 1);
    if (is_quiescent || plan.is_evaluated || plan.kind == PlanKind::Refused) atomicOr(&held, 1);
    atomicMax(&longest, plan.substeps);
    atomicAdd(&steps, plan.substeps);
    if (launch.classes) {
      const double cost = plan.substeps + (plan.is_evaluated ? EVALUATION_IN_STEPS : 0.0);
      const double share = std::fmin(cost * launch.rves[k].num_grains / launch.most_cost, 1.0);
      const int c = is_quiescent
          ? kQuiescentClass
          : kQuiescentClass - 1 - static_cast<int>(share * (kQuiescentClass - 1));
      launch.classes[k] = static_cast<unsigned char>(c);
      atomicAdd(&sizes[c], 1);
    }
  }
  __syncthreads();
  if (threadIdx.x == 0) {
    atomicMax(&launch.findings->longest, longest);
    atomicAdd(&launch.findings->steps, static_cast<unsigned long long>(steps));
    if (num_quiescent > 0) atomicAdd(&launch.findings->num_quiescent, num_quiescent);
    if (held) atomicOr(&launch.findings->held, 1);
  }
  if (!launch.classes) return;
  for (int c = threadIdx.x; c < kCostClasses; c += kIncrementBlock)
    if (sizes[c] > 0) atomicAdd(&launch.findings->class_size[c], sizes[c]);
}

/// Orders RVEs, most expensive class first. The order within a class is arbitrary, and no result
/// depends on it.
template <int D>
__global__ void __launch_bounds__(kCostClasses) order_increments(const IncrementLaunch<D> launch)
{
  __shared__ int begin[kCostClasses];    // begin[c]: where class c ends and c + 1 begins
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
  // Threads of a warp with the same class reserve their positions together.
  const unsigned together = __match_any_sync(__activemask(), c);
  const int leader = __ffs(together) - 1, lane = me % 32;
  int first = 0;
  if (lane == leader) first = atomicAdd(&launch.findings->class_taken[c], __popc(together));
  first = __shfl_sync(together, first, leader);
  const int mine = __popc(together & ((1u << lane) - 1u));
  launch.order[(c > 0 ? begin[c - 1] : 0) + first + mine] = k;
}

template <int D>
RVE_DEVICE void give_stress(const IncrementLaunch<D> &launch, int index,
                            const Tensor<double, D> &stress)
{
  const std::size_t point = launch.point_of[index];
  if (launch.points.dimension == D) {
    store_tensor(stress, launch.points.stress + Space<D>::components * point);
    return;
  }
  store_tensor(leading_components<2>(stress), launch.points.stress + Space<2>::components * point);
  if constexpr (D == 3)
    if (launch.points.hoop_stress) launch.points.hoop_stress[point] = stress(2, 2);
}

/// Defers the increment of a quiescent RVE. The RVE keeps the answer of its last DEM steps, and its
/// stress follows from the deferred deformation.
template <int D> RVE_DEVICE void defer(const IncrementLaunch<D> &launch, int index)
{
  QuiescentStateOf<D> &quiescent = launch.quiescent_states[index];
  quiescent.pending = load_tensor<D>(launch.drives[index].deformation);
  launch.rest[index] = Rest::Quiescent;
  launch.drives[index] = launch.drives_before[index];
  launch.answers[index] = launch.answers_before[index];
  give_stress(launch, index, quiescent.stress_after(quiescent.pending));
}

/// Returns the state of rest of an RVE after DEM steps that ended with this stress. Without an
/// evaluation it is Rest::Unknown. With an evaluation the function also sets the quiescent state.
template <int D>
RVE_DEVICE Rest rest_after(const IncrementLaunch<D> &launch, int index,
                           const Tensor<double, D> &stress)
{
  const int mine = launch.detail_of[index];
  if (mine < 0) return Rest::Unknown;
  const EvaluationOf<D> evaluation = to_evaluation(launch.details[mine]);
  launch.quiescent_states[index] = {Tensor<double, D>::identity(), stress, evaluation.stiffness,
                                    evaluation.mean_overlap};
  return evaluation.is_at_rest ? Rest::Rests : Rest::Moves;
}

template <int D> RVE_DEVICE void take_answer(const IncrementLaunch<D> &launch, int k)
{
  const AnswerRecord<D> answer = launch.answers[k];
  if (!is_sound(answer)) {
    const int m = atomicAdd(&launch.findings->unfinished, 1);
    if (m < kMostUnfinished) launch.unfinished[m] = k;
    if (launch.rest) launch.rest[k] = Rest::Unknown;
    return;
  }
  const Tensor<double, D> stress = load_tensor<D>(answer.stress);
  launch.planned[k].pressure = -(1.0 / D) * trace(stress);
  launch.planned[k].status = answer.status;
  if (launch.rest) launch.rest[k] = rest_after(launch, k, stress);
  const StiffnessMeasures now = {answer.num_contacts, answer.peak_force,
                                 launch.planned[k].pressure};
  if (launch.planned[k].limit.is_exceeded(now)) {
    const int m = atomicAdd(&launch.findings->stiffened, 1);
    if (m < DeviceCallsOf<D>::MOST_STIFFENED) launch.stiffened[m] = k;
  }
  give_stress(launch, k, stress);
}

__global__ inline void set_limits(const NewLimit *limits, int count, PlannedRve *planned)
{
  const int m = blockIdx.x * blockDim.x + threadIdx.x;
  if (m < count) planned[limits[m].index].limit = limits[m].limit;
}

template <int D>
__global__ void __launch_bounds__(kIncrementBlock) take_answers(const IncrementLaunch<D> launch)
{
  const int k = blockIdx.x * kIncrementBlock + threadIdx.x;
  if (k >= launch.count || (launch.hold && *launch.hold > 0)) return;
  if (launch.rest && launch.drives[k].substeps == 0)
    defer(launch, k);
  else
    take_answer(launch, k);
}

/// Final answer of an RVE whose call has been repeated.
template <int D> struct RepeatedRecord {
  int index, has_details;
  AnswerRecord<D> answer;
  DetailRecord<D> details;
};

template <int D>
__global__ void take_repeated(const IncrementLaunch<D> launch, const RepeatedRecord<D> *repeated,
                              int count)
{
  const int m = blockIdx.x * blockDim.x + threadIdx.x;
  if (m >= count) return;
  const int k = repeated[m].index;
  launch.answers[k] = repeated[m].answer;
  if (repeated[m].has_details) launch.details[launch.detail_of[k]] = repeated[m].details;
  take_answer(launch, k);
}

/// Initialises the records of the RVEs whose rest is known at the beginning of a new call.
template <int D>
__global__ void place_resting(const RestingRve<D> *resting, int count, Rest *rest,
                              QuiescentStateOf<D> *quiescent_states, DriveRecord<D> *drives,
                              AnswerRecord<D> *answers)
{
  const int m = blockIdx.x * blockDim.x + threadIdx.x;
  if (m >= count) return;
  const int k = resting[m].index;
  rest[k] = resting[m].rest;
  quiescent_states[k] = resting[m].quiescent;
  drives[k].substeps = BEFORE_THE_CALL;
  answers[k].status = status::Ok;
}

}    // namespace rve
