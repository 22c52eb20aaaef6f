// SPDX-License-Identifier: GPL-2.0-only
/* librve: RVEs of grains behind the points of any continuum code, in C.
 *
 * An RVE is a periodic packing of disks or spheres, simulated by the discrete element method: deformed by an increment of the deformation
 * gradient it answers with its Cauchy stress. A batch has many of them and advances them together, on CPU threads or on a GPU.
 *
 * Conventions. Units are consistent and those of the packings. Stresses and strains are tension (extension) positive. Matrices have their rows
 * one after another: an array (n, D, D) has n*D*D numbers, D the dimension of the grains, 2 for disks and 3 for spheres.
 *
 * Errors. A function that returns int returns RVE_SUCCESS or what went wrong; rve_error() has the text, which names the value, its unit and
 * the allowed range. Then nothing has been changed, and what a pointer was to receive is as it was. The exception is a trial that ends with
 * RVE_NO_MEMORY or RVE_FAILED: RVEs of its call may have lost their earlier trials, as by rve_revert(). Nothing is thrown.
 *
 * Threads. Different batches and packings may be used by different threads at the same time, one of them by one thread at a time.
 *
 * State. A batch has a committed state of each RVE. rve_trial() begins from it, however often it is called; rve_commit() makes the last trial the
 * committed state, rve_revert() forgets it. rve_advance() is both in one and keeps no copy. What a trial costs beyond its DEM steps: the first one
 * after a commit copies the RVE from the engine's memory, the second one and those after it copy it back. The bits of an RVE depend on its own
 * state and increments alone: not on the batch, the threads, nor on trials that were forgotten.
 */
#ifndef LIBRVE_H
#define LIBRVE_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(__GNUC__)
#define RVE_API __attribute__((visibility("default")))
#else
#define RVE_API
#endif

/* The interface. The major number changes when a program that was written for an earlier one may have to change, the minor one when something
 * comes that was not there. */
#define RVE_API_MAJOR 1
#define RVE_API_MINOR 3

enum {
  RVE_SUCCESS = 0,
  RVE_BAD_INPUT = 1, /* a value out of range, a file that cannot be read, a null pointer */
  RVE_NO_MEMORY = 2, /* on the host or on the device */
  RVE_FAILED = 3     /* anything else */
};

/* 1000 * major + minor of the library that was loaded. */
RVE_API int rve_api_version(void);
/* Release of GPU_RVE, "0.1.0". */
RVE_API const char *rve_release(void);
/* What went wrong in the last call of this thread that did not succeed; lives until the next such call of this thread. */
RVE_API const char *rve_error(void);

/* ---- packings: the state of one RVE ---- */

typedef struct rve_packing rve_packing;

/* From a packing file (manual: packing_file). Grains whose mean velocity is most of their motion are an error. */
RVE_API int rve_packing_read(const char *file, rve_packing **packing);
/* The file is written whole or not at all. Counters, energies and the list of pairs are not in it. */
RVE_API int rve_packing_write(const rve_packing *packing, const char *file);
/* All packings of a library, in its order, or the one of a packing file (manual: packing_file). `capacity` pointers have room; *count becomes the number
 * that is needed, and it is an error if that is more. With packings NULL only *count is set. Each of them is freed by itself. Since 1.2. */
RVE_API int rve_library_read(const char *file, rve_packing **packings, size_t capacity,
                             size_t *count);
/* The same grains in a mirror or turned by right angles, as good a sample of the material: image 0 to 7 of disks, 0 to 47 of spheres (manual: fix rve,
 * packing_image); 0 is the packing itself. Since 1.2. */
RVE_API int rve_packing_image(const rve_packing *packing, int image, rve_packing **seen);
/* Prepares a packing: a loose cloud that is compressed to a pressure (manual: create_rve). Recipe: words and values as in that command,
 *   shape disk|sphere, grains N, seed N, radius uniform lo hi (or radius_min x, radius_max x), pressure x, k0 x|rest, void_ratio x,
 *   void_ratio_tolerance x, friction_prep x, damping_prep x, tolerance x, contact hooke|hertz|dmt, format fast|mixed|double|single,
 *   device auto|cpu|cuda, threads N, and the keywords of the material, kn, kt, friction, density, ...
 * With k0 rest the stress along the last axis is the pressure, and those along the others are what the grains make of it while their strain is zero.
 * Without device and threads it runs on one CPU thread, from seconds to minutes. Radius uniform, k0 rest, void_ratio_tolerance, device and threads since 1.2.
 * Words of create_rve that are not here: seeds, several pressures, friction_preps and void_ratios, and policy make a library, and a call makes one packing;
 * those behind contact hooke, hertz or dmt are LAMMPS' (pair granular), here each number has its keyword: kn, hertz_kn, surface_energy, ... */
RVE_API int rve_packing_create(const char *recipe, rve_packing **packing);
RVE_API int rve_packing_copy(const rve_packing *packing, rve_packing **copy);
RVE_API void rve_packing_free(rve_packing *packing);
/* The whole state as bytes, exact, for other processes and for a host's checkpoints: a file has no counters, energies and list of pairs, and bytes do.
 * As rve_save() and rve_restore() of a batch: with bytes NULL only *size is set. Since 1.1. */
RVE_API int rve_packing_save(const rve_packing *packing, void *bytes, size_t capacity,
                             size_t *size);
RVE_API int rve_packing_restore(const void *bytes, size_t size, rve_packing **packing);

/* 2: disks, 3: spheres. */
RVE_API int rve_packing_dimension(const rve_packing *packing);
RVE_API size_t rve_packing_grains(const rve_packing *packing);
/* Cell volume over solid volume minus one [-]. */
RVE_API double rve_packing_void_ratio(const rve_packing *packing);
/* An array by name, N the number of grains: "cell" (D, D) [length], "deformation" (D, D) [-], "radius" (N) [length], "position" (N, D) [length],
 * "velocity" (N, D), peculiar [length/time], "spin" (N), of spheres (N, 3) [1/time]. `count` numbers have room, and must be as many as there are. */
RVE_API int rve_packing_array(const rve_packing *packing, const char *name, double *values,
                              size_t count);
/* A number of the material by its keyword: kn, kt, friction, density, damping, ... (manual: fix rve). */
RVE_API int rve_packing_parameter(const rve_packing *packing, const char *keyword, double *value);
RVE_API int rve_packing_set_parameter(rve_packing *packing, const char *keyword, double value);

/* Contacts between grains, with the forces of their springs. Rows of numbers: id of the first and the second grain (from 0 on), branch vector (D)
 * [length], overlap [length], normal force [force], force on the first grain (D) [force], 1 where it slides, else 0. */
RVE_API size_t rve_contact_columns(int dimension);
RVE_API int rve_packing_contacts(const rve_packing *packing, size_t *rows);
RVE_API int rve_packing_contact_table(const rve_packing *packing, double *values, size_t count);

/* ---- batches ---- */

typedef struct rve_batch rve_batch;

/* RVEs that begin as copies of these packings, all of disks or all of spheres and of one contact law. Options: words and values,
 *   format fast|mixed|double, arithmetic strict|relaxed, device auto|cpu|cuda, device_number N, threads N (0: as OpenMP decides), block_size N,
 *   skin x [length], arms contact|lammps (since 1.2), overlap_limit x [-], energy yes|no (whether work and losses are counted)
 * NULL or "": format mixed, device auto.
 * Words of fix rve that are not here: what a macro step is made of (drive, servo, path, dt, substeps, quiescent, stress, policy, copies, shadow, progress, preset,
 * dump) is the program's own, by the functions below; which packing and image an RVE begins from is said by the packings; mass_scaling is a factor on the parameter
 * mass_depth. */
RVE_API int rve_batch_create(const rve_packing *const *packings, size_t count, const char *options,
                             rve_batch **batch);
RVE_API void rve_batch_free(rve_batch *batch);
RVE_API int rve_batch_dimension(const rve_batch *batch);
RVE_API size_t rve_batch_size(const rve_batch *batch);
/* "2 CPU threads (x86-64-v3), mixed, strict" or "NVIDIA H200, mixed, strict": a line for a log; lives as long as the batch. */
RVE_API const char *rve_batch_description(const rve_batch *batch);

/* In the functions below `which` has `count` different numbers of RVEs, from 0 on, and arrays have one entry for each of them, in that order. NULL: all
 * RVEs, and count must be their number. */

/* Lower bounds of the stable DEM time steps as the RVEs are (count) [time]; a step should be at most 0.9 of it. A step above the bound is an error of
 * the functions below. They check it at the beginning of a call: in the first call of an RVE, with a longer step than before, and where the number or the
 * overlaps of the contacts have grown since the last check. */
RVE_API int rve_time_steps(rve_batch *batch, const size_t *which, size_t count, double *dt);

/* Deforms from the committed states: F becomes increment * F in substeps[k] DEM steps of dt[k].
 *   increments  (count, D, D) of the deformation gradient, near identity
 *   dt          (count) [time], at most the stability bound of the committed state
 *   substeps    (count), 0 or more; with 0 the increment must be the identity, and the configuration is evaluated as it is
 *   stresses    (count, D, D) Cauchy, or NULL
 *   statuses    (count), 0 for an RVE that is sound (rve_status_text), or NULL. An RVE that failed has its committed state for a trial. */
RVE_API int rve_trial(rve_batch *batch, const size_t *which, size_t count, const double *increments,
                      const double *dt, const int32_t *substeps, double *stresses,
                      uint32_t *statuses);
/* The last trials of all RVEs become their committed states. */
RVE_API int rve_commit(rve_batch *batch);
/* The last trials of all RVEs are forgotten. */
RVE_API int rve_revert(rve_batch *batch);
/* A trial that is committed at once, of those that succeeded; for hosts that never go back. It is an error while other RVEs have a trial. */
RVE_API int rve_advance(rve_batch *batch, const size_t *which, size_t count,
                        const double *increments, const double *dt, const int32_t *substeps,
                        double *stresses, uint32_t *statuses);
/* Element tests: from its committed state each RVE follows a loading path of rates, strains and stresses, which a servo steers, in `calls` calls of `substeps`
 * DEM steps of dt. Since 1.1.
 *   path        the words of a path file (manual: fix rve, loading paths), without v_names: one path for all, or as many as `count`, one each, in that order
 *   quantities  names of rve_quantity(), with blanks between them
 *   table       (calls + 1, count, quantities) before the first call and after each; rows of an RVE whose path has ended, or that failed, repeat
 *   statuses    (count), 0 for an RVE that is sound, or NULL; one that failed is at the end of the call before
 * The states are committed. It is an error while RVEs have a trial. */
RVE_API int rve_follow_path(rve_batch *batch, const size_t *which, size_t count, const char *path,
                            double dt, int32_t substeps, size_t calls, const char *quantities,
                            double *table, uint32_t *statuses);
/* Which failures are fatal: the RVE stayed as it was. */
RVE_API uint32_t rve_status_fatal(void);
/* Words for a status: "overlap too large, no contacts"; "ok" for 0. Lives until the next call of this function by this thread. */
RVE_API const char *rve_status_text(uint32_t status);

/* A quantity of the states that the last trial or advance left, or of the committed ones before any (count): the names of compute rve/atom, "p", "q",
 * "void_ratio", "coordination", "fabric_xx", "kinetic", "work", "sliding", ... Those that a fix has of an atom are not here: servo_error, path_..., inertial,
 * copies, renewals. */
RVE_API int rve_quantity(rve_batch *batch, const char *name, const size_t *which, size_t count,
                         double *values);
/* Number of those names for grains of this dimension, 2 or 3, and the k-th of them, "" beyond the last; 0 and NULL of any other dimension. */
RVE_API size_t rve_num_quantities(int dimension);
RVE_API const char *rve_quantity_name(int dimension, size_t k);

/* Stiffness of the contacts as they are, with grains that move affinely and do not spin: an upper bound of the elastic tangent, without a DEM step.
 * (count, D*D, S): change of the components of stress, rows of the matrix one after another, by those of strain, S = 3: xx, yy, xy, or S = 6: xx, yy, zz,
 * xy, xz, yz, where a strain xy is that of both xy and yx [stress]. */
RVE_API int rve_affine_stiffness(rve_batch *batch, const size_t *which, size_t count,
                                 double *stiffness);

/* Tangents of the RVEs as they are, by probing (manual: compute rve/tangent): copies take small strains and come to rest, thousands of DEM steps of each.
 * Options: words and values, kind elastic|loading, format fast|mixed|double|single of the copies (since 1.2; without, that of the batch), probe x, lead x,
 * spread x, strain_steps N, lead_steps N, look_steps N, most_steps N, tolerance x, damping x; NULL or "": kind elastic and what suits the number format.
 *   strain_rates  (count, D, D) present direction of straining, for kind loading; NULL with kind elastic
 *   tangents      (count, S, S), S = 3: xx, yy, xy, or S = 6: xx, yy, zz, xy, xz, yz, of stress by engineering strain [stress]; zeros where the status of a
 *                 copy was fatal or there is no direction of straining
 *   measured      (count) 1 where there is a tangent, else 0, or NULL
 * The RVEs are not changed. */
RVE_API int rve_tangents(rve_batch *batch, const size_t *which, size_t count, const char *options,
                         const double *strain_rates, double *tangents, int *measured);

/* ---- arrays in the memory of a GPU. Since 1.3 ---- */

/* The CUDA device that the batch is on, as CUDA counts; -1 on CPU threads. */
RVE_API int rve_batch_device_number(const rve_batch *batch);
/* The functions of these names without _device, to the same bits, of a batch on a CUDA device: `increments`, `stresses`, `values` and `stiffness` may each be
 * in the memory of that device or of the host. All else is on the host. It is an error, which names the array, if it is in the memory of another device, or
 * if the batch is on CPU threads; then the array has not been touched.
 * The arrays are read and written in the default stream of the device, and what is written is there on return. Work on them in streams that do not wait for
 * that one, those that CUDA calls non-blocking, must have ended before the call. As after any call, the device of the batch is the current one of the thread. */
RVE_API int rve_trial_device(rve_batch *batch, const size_t *which, size_t count,
                             const double *increments, const double *dt, const int32_t *substeps,
                             double *stresses, uint32_t *statuses);
RVE_API int rve_advance_device(rve_batch *batch, const size_t *which, size_t count,
                               const double *increments, const double *dt, const int32_t *substeps,
                               double *stresses, uint32_t *statuses);
RVE_API int rve_quantity_device(rve_batch *batch, const char *name, const size_t *which,
                                size_t count, double *values);
RVE_API int rve_affine_stiffness_device(rve_batch *batch, const size_t *which, size_t count,
                                        double *stiffness);

/* An RVE as it is: with its last trial, if there is one. */
RVE_API int rve_batch_packing(rve_batch *batch, size_t which, rve_packing **packing);
/* Replaces an RVE by a packing of the same grains' law; what was is gone. */
RVE_API int rve_batch_set_packing(rve_batch *batch, size_t which, const rve_packing *packing);

/* The committed states as bytes, for restart files and for other processes: exact. The size is that of the present states. Bytes of earlier releases can
 * be restored; those of this release are refused by releases before it.
 * rve_save: `capacity` bytes have room; *size becomes the number that is needed, and it is an error if that is more. With bytes NULL only *size is set. */
RVE_API int rve_save(rve_batch *batch, void *bytes, size_t capacity, size_t *size);
/* As many RVEs as are in the bytes, which must be those of the batch; committed. */
RVE_API int rve_restore(rve_batch *batch, const void *bytes, size_t size);

#ifdef __cplusplus
}
#endif

#endif
