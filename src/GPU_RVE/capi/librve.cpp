// SPDX-License-Identifier: GPL-2.0-only
// Functions of the C interface. They turn exceptions into an error code and a text.

#include "capi/librve.h"

#include "capi/rve_batch.h"
#include "capi/saved_states.h"
#include "cuda/device_arrays.h"
#include "macro/quantities.h"
#include "rve/core/error.h"
#include "rve/core/status.h"
#include "rve/engine/contact_network.h"
#include "rve/engine/packing_image.h"
#include "rve/engine/packing_io.h"

#include <algorithm>
#include <cstring>
#include <initializer_list>
#include <memory>
#include <new>
#include <numeric>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

using rve::require;

namespace {

thread_local std::string last_error = "";

/// A pointer of the caller and its name for error messages.
struct Named {
  const void *pointer;
  const char *name;
};

/// Throws InputError if one of the pointers is null.
void require_pointers(std::initializer_list<Named> needed)
{
  for (const Named &one : needed) require(one.pointer != nullptr, one.name, " is a null pointer");
}

/// Runs `work` if none of the pointers is null. Returns RVE_SUCCESS, or the error code of an
/// exception, whose text it stores for rve_error().
template <class Work> int guarded(std::initializer_list<Named> needed, const Work &work) noexcept
{
  const auto failed = [](int code, const char *text) {
    try {
      last_error = text;
    } catch (...) {
      last_error.clear();    // there is no memory for the text
    }
    return code;
  };
  try {
    require_pointers(needed);
    work();
    return RVE_SUCCESS;
  } catch (const rve::InputError &e) {
    return failed(RVE_BAD_INPUT, e.what());
  } catch (const std::bad_alloc &) {
    return failed(RVE_NO_MEMORY, "there is not enough memory");
  } catch (const std::length_error &) {
    return failed(RVE_NO_MEMORY, "there is not enough memory");
  } catch (const std::exception &e) {
    return failed(RVE_FAILED, e.what());
  } catch (...) {
    return failed(RVE_FAILED, "unknown failure");
  }
}

std::string text_or_empty(const char *text)
{
  return text ? text : "";
}

bool is_dimension(int dimension)
{
  return dimension == 2 || dimension == 3;
}

/// Copies an array to the caller. Throws InputError unless `count` is its size.
void copy_out(const std::vector<double> &from, double *values, std::size_t count)
{
  require_pointers({{values, "values"}});
  require(count == from.size(), "count is ", count, "; it must be ", from.size());
  std::copy(from.begin(), from.end(), values);
}

/// Sets *size and copies the bytes to the caller unless `bytes` is null. Throws InputError if
/// `capacity` is too small.
void copy_bytes(const std::vector<char> &saved, void *bytes, std::size_t capacity,
                std::size_t *size)
{
  *size = saved.size();
  if (!bytes) return;
  require(saved.size() <= capacity, "capacity is ", capacity, " bytes; it must be at least ",
          saved.size());
  std::memcpy(bytes, saved.data(), saved.size());
}

/// Returns the material parameter of a packing with this keyword. Throws InputError if the material
/// has no such parameter.
rve::MaterialMember parameter_of(const rve_packing &packing, const char *keyword)
{
  return std::visit(
      [&](const auto &state) {
        return capi::parameter_named(keyword, state.material.law,
                                     capi::dimension_of(packing.state));
      },
      packing.state);
}

/// Returns the indices of RVEs in `which`, or the indices of all RVEs if `which` is null. Throws
/// InputError if an index is out of range or occurs twice.
capi::Members chosen(const rve_batch &batch, const std::size_t *which, std::size_t count)
{
  const std::size_t size = batch.size();
  capi::Members all;
  if (!which) {
    require(count == size, "count is ", count, "; it must be the number of RVEs, ", size);
    all.resize(size);
    std::iota(all.begin(), all.end(), std::size_t(0));
    return all;
  }
  require(count <= size, "count is ", count, "; it must be at most the number of RVEs, ", size);
  std::vector<char> seen(size, 0);
  for (std::size_t k = 0; k < count; ++k) {
    require(which[k] < size, "which[", k, "] is ", which[k], "; it must be below ", size);
    require(!seen[which[k]]++, "which contains RVE ", which[k], " twice");
    all.push_back(which[k]);
  }
  return all;
}

// ---- arrays of callers: on the host, or on the device of a batch ----

/// Memory that a call allows for its arrays: only host memory, or host memory and the memory of the
/// device of the batch.
enum class Arrays { OnHost, OnEither };

/// Array of the caller in a form that the batch can read or write on the host. If the array is on
/// the device of the batch, this object has a copy on the host. Number is const double for input
/// arrays and double for output arrays.
template <class Number> class CallerArray {
 public:
  /// Copies the `count` values of an input array from the device if the array is there. With
  /// Arrays::OnEither, the constructor throws InputError in two cases: the batch runs on CPU
  /// threads, or the array is in the memory of another device. The message names the array.
  CallerArray(const rve_batch &batch, Arrays arrays, Number *array, const char *name,
              std::size_t count) :
      array_(array)
  {
    if (arrays == Arrays::OnHost || !array) return;
    require(batch.cuda_device() >= 0, name,
            " must not be in the memory of a device: the batch is on ", batch.description(),
            "; use the function without _device");
    if (!rve::is_on_device(array, name, batch.cuda_device())) return;
    device_ = batch.cuda_device();
    copy_.resize(count);
    if (std::is_const_v<Number>) rve::copy_numbers(array_, copy_.data(), copy_.size(), device_);
  }

  Number *values() { return device_ >= 0 ? copy_.data() : array_; }
  /// Copies the values to the device if the array is there.
  void copy_back() const
  {
    if (device_ >= 0) rve::copy_numbers(copy_.data(), array_, copy_.size(), device_);
  }

 private:
  Number *array_;
  int device_ = -1;
  std::vector<double> copy_;
};

/// Advances RVEs. If `keeps` is false, the new states are trials.
int run_batch(rve_batch *batch, const size_t *which, size_t count, const double *increments,
              const double *dt, const int32_t *substeps, double *stresses, uint32_t *statuses,
              bool keeps, Arrays arrays)
{
  return guarded({{batch, "batch"}}, [&] {
    if (count > 0)
      require_pointers({{increments, "increments"}, {dt, "dt"}, {substeps, "substeps"}});
    const capi::Members members = chosen(*batch, which, count);
    const std::size_t numbers = count * batch->dimension() * batch->dimension();
    CallerArray given(*batch, arrays, increments, "increments", numbers);
    CallerArray wanted(*batch, arrays, stresses, "stresses", numbers);
    batch->run(members, given.values(), dt, substeps, wanted.values(), statuses, keeps);
    wanted.copy_back();
  });
}

int give_quantity(rve_batch *batch, const char *name, const size_t *which, size_t count,
                  double *values, Arrays arrays)
{
  return guarded({{batch, "batch"}, {name, "name"}, {values, "values"}}, [&] {
    const capi::Members members = chosen(*batch, which, count);
    CallerArray wanted(*batch, arrays, values, "values", count);
    batch->quantity(name, members, wanted.values());
    wanted.copy_back();
  });
}

int give_affine_stiffness(rve_batch *batch, const size_t *which, size_t count, double *stiffness,
                          Arrays arrays)
{
  return guarded({{batch, "batch"}, {stiffness, "stiffness"}}, [&] {
    const capi::Members members = chosen(*batch, which, count);
    const std::size_t d = batch->dimension(), strains = d * (d + 1) / 2;
    CallerArray wanted(*batch, arrays, stiffness, "stiffness", count * d * d * strains);
    batch->affine_stiffness(members, wanted.values());
    wanted.copy_back();
  });
}

}    // namespace

// ---- the interface ----

extern "C" {

int rve_api_version(void)
{
  return 1000 * RVE_API_MAJOR + RVE_API_MINOR;
}
const char *rve_release(void)
{
  return GPU_RVE_RELEASE;
}
const char *rve_error(void)
{
  return last_error.c_str();
}

int rve_packing_read(const char *file, rve_packing **packing)
{
  return guarded({{packing, "packing"}, {file, "file"}},
                 [&] { *packing = new rve_packing{capi::read_state(file)}; });
}

int rve_packing_write(const rve_packing *packing, const char *file)
{
  return guarded({{packing, "packing"}, {file, "file"}}, [&] {
    std::visit([&](const auto &state) { rve::write_packing(file, state); }, packing->state);
  });
}

int rve_packing_create(const char *recipe, rve_packing **packing)
{
  return guarded({{packing, "packing"}}, [&] {
    *packing = new rve_packing{capi::prepare(capi::read_recipe(text_or_empty(recipe)))};
  });
}

int rve_grains_needed(const char *sizes, size_t *grains)
{
  return guarded({{grains, "grains"}}, [&] {
    *grains = static_cast<std::size_t>(capi::grains_needed(text_or_empty(sizes)));
  });
}

int rve_contact_words(const char *contact, int dimension, char *words, size_t capacity,
                      size_t *size)
{
  return guarded({{contact, "contact"}, {size, "size"}}, [&] {
    const std::string text = capi::contact_words(contact, dimension);
    *size = text.size();
    if (!words) return;
    require(text.size() <= capacity, "capacity is ", capacity, " bytes; it must be at least ",
            text.size());
    std::copy(text.begin(), text.end(), words);
  });
}

int rve_library_read(const char *file, rve_packing **packings, size_t capacity, size_t *count)
{
  return guarded({{file, "file"}, {count, "count"}}, [&] {
    std::vector<capi::AnyState> states = capi::read_states(file);
    *count = states.size();
    if (!packings) return;
    require(states.size() <= capacity, "capacity is ", capacity, " packings; it must be at least ",
            states.size());
    // the caller gets all packings or none
    std::vector<std::unique_ptr<rve_packing>> all;
    for (capi::AnyState &state : states)
      all.push_back(std::make_unique<rve_packing>(rve_packing{std::move(state)}));
    for (std::size_t k = 0; k < all.size(); ++k) packings[k] = all[k].release();
  });
}

int rve_packing_image(const rve_packing *packing, int image, rve_packing **seen)
{
  return guarded({{packing, "packing"}, {seen, "seen"}}, [&] {
    *seen =
        std::visit([&](const auto &state) { return new rve_packing{rve::image_of(state, image)}; },
                   packing->state);
  });
}

int rve_packing_copy(const rve_packing *packing, rve_packing **copy)
{
  return guarded({{packing, "packing"}, {copy, "copy"}},
                 [&] { *copy = new rve_packing(*packing); });
}

void rve_packing_free(rve_packing *packing)
{
  delete packing;
}

int rve_packing_save(const rve_packing *packing, void *bytes, size_t capacity, size_t *size)
{
  return guarded({{packing, "packing"}, {size, "size"}}, [&] {
    const std::vector<char> record =
        std::visit([](const auto &state) { return rve::serialize(state); }, packing->state);
    const auto all =
        capi::saved(capi::dimension_of(packing->state), 1, [&](std::size_t) { return record; });
    copy_bytes(all, bytes, capacity, size);
  });
}

int rve_packing_restore(const void *bytes, size_t size, rve_packing **packing)
{
  return guarded({{bytes, "bytes"}, {packing, "packing"}}, [&] {
    const char *begin = static_cast<const char *>(bytes);
    const capi::SavedHeader header = capi::header_of(begin, size);
    require(header.count == 1, "the bytes have ", header.count, " saved RVEs; they must have one");
    *packing = header.dimension == 3 ? new rve_packing{capi::states_in<3>(begin, header).front()}
                                     : new rve_packing{capi::states_in<2>(begin, header).front()};
  });
}

int rve_packing_dimension(const rve_packing *packing)
{
  return packing ? capi::dimension_of(packing->state) : 0;
}

size_t rve_packing_grains(const rve_packing *packing)
{
  if (!packing) return 0;
  return std::visit([](const auto &state) { return state.radius.size(); }, packing->state);
}

double rve_packing_void_ratio(const rve_packing *packing)
{
  if (!packing) return 0.0;
  return std::visit([](const auto &state) { return state.void_ratio(); }, packing->state);
}

int rve_packing_diameter(const rve_packing *packing, double percent, double *diameter)
{
  return guarded({{packing, "packing"}, {diameter, "diameter"}}, [&] {
    *diameter = std::visit(
        [&](const auto &state) {
          return rve::diameter_passing(state.radius, capi::dimension_of(packing->state), percent);
        },
        packing->state);
  });
}

int rve_packing_array(const rve_packing *packing, const char *name, double *values, size_t count)
{
  return guarded({{packing, "packing"}, {name, "name"}},
                 [&] { copy_out(capi::array_named(packing->state, name), values, count); });
}

int rve_packing_parameter(const rve_packing *packing, const char *keyword, double *value)
{
  return guarded({{packing, "packing"}, {keyword, "keyword"}, {value, "value"}}, [&] {
    const rve::MaterialMember member = parameter_of(*packing, keyword);
    *value = std::visit([&](const auto &state) { return state.material.*member; }, packing->state);
  });
}

int rve_packing_set_parameter(rve_packing *packing, const char *keyword, double value)
{
  return guarded({{packing, "packing"}, {keyword, "keyword"}}, [&] {
    const rve::MaterialMember member = parameter_of(*packing, keyword);
    std::visit(
        [&](auto &state) {
          auto changed = state;
          changed.material.*member = value;
          changed.check();
          state = std::move(changed);
        },
        packing->state);
  });
}

size_t rve_contact_columns(int dimension)
{
  return is_dimension(dimension) ? 5 + 2 * static_cast<size_t>(dimension) : 0;
}

int rve_packing_contacts(const rve_packing *packing, size_t *rows)
{
  return guarded({{packing, "packing"}, {rows, "rows"}}, [&] {
    *rows = std::visit([&](const auto &state) { return rve::find_contacts(state).size(); },
                       packing->state);
  });
}

int rve_packing_contact_table(const rve_packing *packing, double *values, size_t count)
{
  return guarded({{packing, "packing"}},
                 [&] { copy_out(capi::contact_table(packing->state), values, count); });
}

int rve_batch_create(const rve_packing *const *packings, size_t count, const char *options,
                     rve_batch **batch)
{
  return guarded({{batch, "batch"}, {packings, "packings"}}, [&] {
    require(count > 0, "count is 0; a batch must have at least one RVE");
    const std::vector<const rve_packing *> all(packings, packings + count);
    for (const rve_packing *packing : all) require_pointers({{packing, "a packing"}});
    *batch = capi::make_batch(all, capi::read_options(text_or_empty(options))).release();
  });
}

void rve_batch_free(rve_batch *batch)
{
  delete batch;
}
int rve_batch_dimension(const rve_batch *batch)
{
  return batch ? batch->dimension() : 0;
}
size_t rve_batch_size(const rve_batch *batch)
{
  return batch ? batch->size() : 0;
}
const char *rve_batch_description(const rve_batch *batch)
{
  return batch ? batch->description() : "";
}

int rve_time_steps(rve_batch *batch, const size_t *which, size_t count, double *dt)
{
  return guarded({{batch, "batch"}, {dt, "dt"}},
                 [&] { batch->time_steps(chosen(*batch, which, count), dt); });
}

int rve_trial(rve_batch *batch, const size_t *which, size_t count, const double *increments,
              const double *dt, const int32_t *substeps, double *stresses, uint32_t *statuses)
{
  return run_batch(batch, which, count, increments, dt, substeps, stresses, statuses, false,
                   Arrays::OnHost);
}

int rve_advance(rve_batch *batch, const size_t *which, size_t count, const double *increments,
                const double *dt, const int32_t *substeps, double *stresses, uint32_t *statuses)
{
  return run_batch(batch, which, count, increments, dt, substeps, stresses, statuses, true,
                   Arrays::OnHost);
}

int rve_commit(rve_batch *batch)
{
  return guarded({{batch, "batch"}}, [&] { batch->commit(); });
}

int rve_revert(rve_batch *batch)
{
  return guarded({{batch, "batch"}}, [&] { batch->revert(); });
}

int rve_follow_path(rve_batch *batch, const size_t *which, size_t count, const char *path,
                    double dt, int32_t substeps, size_t calls, const char *quantities,
                    double *table, uint32_t *statuses)
{
  return guarded({{batch, "batch"}, {path, "path"}, {quantities, "quantities"}, {table, "table"}},
                 [&] {
                   batch->follow(chosen(*batch, which, count),
                                 {path, dt, substeps, calls, quantities}, table, statuses);
                 });
}

uint32_t rve_status_fatal(void)
{
  return rve::status::Fatal;
}

const char *rve_status_text(uint32_t status)
{
  thread_local std::string text;
  const int code = guarded({}, [&] { text = rve::describe_status(status); });
  return code == RVE_SUCCESS ? text.c_str() : "";
}

int rve_quantity(rve_batch *batch, const char *name, const size_t *which, size_t count,
                 double *values)
{
  return give_quantity(batch, name, which, count, values, Arrays::OnHost);
}

size_t rve_num_quantities(int dimension)
{
  return is_dimension(dimension) ? macro::quantity_names(dimension).size() : 0;
}

const char *rve_quantity_name(int dimension, size_t k)
{
  if (!is_dimension(dimension)) return nullptr;
  const auto &names = macro::quantity_names(dimension);
  return k < names.size() ? names[k] : "";
}

int rve_affine_stiffness(rve_batch *batch, const size_t *which, size_t count, double *stiffness)
{
  return give_affine_stiffness(batch, which, count, stiffness, Arrays::OnHost);
}

int rve_tangents(rve_batch *batch, const size_t *which, size_t count, const char *options,
                 const double *strain_rates, double *tangents, int *measured)
{
  return guarded({{batch, "batch"}, {tangents, "tangents"}}, [&] {
    batch->tangents(chosen(*batch, which, count), text_or_empty(options), strain_rates, tangents,
                    measured);
  });
}

int rve_batch_device_number(const rve_batch *batch)
{
  return batch ? batch->cuda_device() : -1;
}

int rve_trial_device(rve_batch *batch, const size_t *which, size_t count, const double *increments,
                     const double *dt, const int32_t *substeps, double *stresses,
                     uint32_t *statuses)
{
  return run_batch(batch, which, count, increments, dt, substeps, stresses, statuses, false,
                   Arrays::OnEither);
}

int rve_advance_device(rve_batch *batch, const size_t *which, size_t count,
                       const double *increments, const double *dt, const int32_t *substeps,
                       double *stresses, uint32_t *statuses)
{
  return run_batch(batch, which, count, increments, dt, substeps, stresses, statuses, true,
                   Arrays::OnEither);
}

int rve_quantity_device(rve_batch *batch, const char *name, const size_t *which, size_t count,
                        double *values)
{
  return give_quantity(batch, name, which, count, values, Arrays::OnEither);
}

int rve_affine_stiffness_device(rve_batch *batch, const size_t *which, size_t count,
                                double *stiffness)
{
  return give_affine_stiffness(batch, which, count, stiffness, Arrays::OnEither);
}

int rve_batch_packing(rve_batch *batch, size_t which, rve_packing **packing)
{
  return guarded({{batch, "batch"}, {packing, "packing"}},
                 [&] { *packing = new rve_packing{batch->state(chosen(*batch, &which, 1)[0])}; });
}

int rve_batch_set_packing(rve_batch *batch, size_t which, const rve_packing *packing)
{
  return guarded({{batch, "batch"}, {packing, "packing"}}, [&] {
    require(capi::dimension_of(packing->state) == batch->dimension(),
            "the packing and the batch have grains of different dimensions");
    batch->set_state(chosen(*batch, &which, 1)[0], packing->state);
  });
}

int rve_save(rve_batch *batch, void *bytes, size_t capacity, size_t *size)
{
  return guarded({{batch, "batch"}, {size, "size"}},
                 [&] { copy_bytes(batch->save(), bytes, capacity, size); });
}

int rve_restore(rve_batch *batch, const void *bytes, size_t size)
{
  return guarded({{batch, "batch"}, {bytes, "bytes"}},
                 [&] { batch->restore(static_cast<const char *>(bytes), size); });
}

}    // extern "C"
