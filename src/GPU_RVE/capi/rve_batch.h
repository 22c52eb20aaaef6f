// SPDX-License-Identifier: GPL-2.0-only
// Batches of the C interface. A batch has RVEs of disks or of spheres. librve.h describes the
// functions.

#pragma once

#include "capi/rve_packing.h"
#include "rve/engine/options.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace capi {

/// Indices of different RVEs of a batch.
using Members = std::vector<std::size_t>;

/// Arguments of rve_follow_path().
struct PathOrder {
  std::string path;
  double dt;
  std::int32_t substeps;
  std::size_t calls;
  std::string quantities;
};

}    // namespace capi

/// Interface of a batch for both dimensions. All functions throw InputError on wrong input. The
/// batch is then unchanged.
struct rve_batch {
  virtual ~rve_batch() = default;
  virtual int dimension() const = 0;
  virtual std::size_t size() const = 0;
  virtual const char *description() const = 0;
  virtual int cuda_device() const = 0;

  virtual void time_steps(const capi::Members &which, double *dt) = 0;
  /// Advances RVEs. If `keeps` is false, the new state is a trial, which commit() or revert() ends.
  virtual void run(const capi::Members &which, const double *increments, const double *dt,
                   const std::int32_t *substeps, double *stresses, std::uint32_t *statuses,
                   bool keeps) = 0;
  virtual void commit() = 0;
  virtual void revert() = 0;
  virtual void follow(const capi::Members &which, const capi::PathOrder &order, double *table,
                      std::uint32_t *statuses) = 0;

  virtual void quantity(const std::string &name, const capi::Members &which,
                        double *values) const = 0;
  virtual void affine_stiffness(const capi::Members &which, double *stiffness) = 0;
  virtual void tangents(const capi::Members &which, const std::string &options,
                        const double *strain_rates, double *tangents, int *measured) = 0;

  virtual capi::AnyState state(std::size_t which) const = 0;
  /// `state` must have the dimension of the batch.
  virtual void set_state(std::size_t which, const capi::AnyState &state) = 0;
  virtual std::vector<char> save() const = 0;
  virtual void restore(const char *bytes, std::size_t size) = 0;
};

namespace capi {

/// Makes a batch with one RVE per packing. An RVE begins as a copy of its packing. There must be at
/// least one packing. Throws InputError if packings have different dimensions or contact laws, or
/// if the options do not suit them.
std::unique_ptr<rve_batch> make_batch(const std::vector<const rve_packing *> &packings,
                                      const rve::Options &options);

}    // namespace capi
