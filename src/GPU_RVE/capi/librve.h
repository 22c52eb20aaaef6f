// SPDX-License-Identifier: GPL-2.0-only
/* librve: C interface to RVEs of grains for the material points of any continuum code.
 *
 * An RVE is a periodic packing of disks or spheres, simulated by the discrete element method (DEM).
 * It is deformed by an increment of the deformation gradient and returns its Cauchy stress. A batch
 * has many RVEs and advances them together, on CPU threads or on a GPU.
 *
 * Conventions. Any consistent units may be used; all values have the units of the packings.
 * Stresses and strains are positive in tension (extension). Matrices are stored row by row: an
 * array (n, D, D) has n*D*D numbers. D is the dimension of the grains, 2 for disks and 3 for
 * spheres.
 *
 * Errors. A function that returns int returns RVE_SUCCESS or an error code. rve_error() returns the
 * text of the error, which names the value, its unit and the allowed range. A function that returns
 * an error has changed nothing, and output arguments keep their earlier values. There is one
 * exception: if a trial ends with RVE_NO_MEMORY or RVE_FAILED, RVEs of the call can have lost their
 * earlier trials. They then have their committed states, as after rve_revert(). No function throws
 * a C++ exception.
 *
 * Threads. Several threads may use different batches and packings at the same time. Only one thread
 * at a time may use a batch or a packing.
 *
 * State. A batch has a committed state of each RVE. Each call of rve_trial() begins from the
 * committed state. rve_commit() makes the last trial the committed state, and rve_revert() discards
 * it. rve_advance() does a trial and a commit in one call and copies no state. A trial costs its
 * DEM steps and one copy of the RVE. The first trial after a commit copies the committed state out
 * of the memory of the engine. Later trials copy it back. The results of an RVE depend, bit for
 * bit, only on its own state and increments. They do not depend on the batch, the threads or
 * discarded trials.
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

/* Version of the interface. The major number changes if programs for an earlier version may have to
 * change. The minor number changes with each addition. */
#define RVE_API_MAJOR 1
#define RVE_API_MINOR 4

enum {
  RVE_SUCCESS = 0,
  RVE_BAD_INPUT = 1, /* a value out of range, a file that cannot be read, a null pointer */
  RVE_NO_MEMORY = 2, /* on the host or on the device */
  RVE_FAILED = 3     /* anything else */
};

/* Returns 1000 * major + minor of the loaded library. */
RVE_API int rve_api_version(void);
/* Returns the release of GPU_RVE, for example "0.1.0". */
RVE_API const char *rve_release(void);
/* Returns the text of the last error of this thread. It is valid until the next error of this
 * thread. */
RVE_API const char *rve_error(void);

/* ---- packings: the state of one RVE ---- */

typedef struct rve_packing rve_packing;

/* Reads a packing file (manual: packing_file). It is an error if the grains drift: their mean
 * velocity exceeds their velocity fluctuations. */
RVE_API int rve_packing_read(const char *file, rve_packing **packing);
/* Writes a packing file. After an error there is no partial file. The file does not contain
 * counters, energies or the list of pairs. */
RVE_API int rve_packing_write(const rve_packing *packing, const char *file);
/* Reads all packings of a library in their order, or the packing of a packing file (manual:
 * packing_file). `packings` has space for `capacity` pointers. *count becomes the number of
 * packings, and it is an error if this number exceeds `capacity`. With packings NULL only *count is
 * set. The caller frees each packing by rve_packing_free(). Since 1.2. */
RVE_API int rve_library_read(const char *file, rve_packing **packings, size_t capacity,
                             size_t *count);
/* Makes an image of a packing: the same grains, mirrored or rotated by right angles. An image is a
 * statistically equivalent sample of the material. image is 0 to 7 for disks and 0 to 47 for
 * spheres (manual: fix rve, packing_image); 0 is the packing itself. Since 1.2. */
RVE_API int rve_packing_image(const rve_packing *packing, int image, rve_packing **seen);
/* Prepares a packing by compressing a loose cloud of grains to a pressure (manual: create_rve). The
 * recipe is a text of keywords and values of that command:
 *   shape disk|sphere, grains N, seed N, radius uniform lo hi (or radius_min x, radius_max x),
 *   radius lognormal median sigma lo hi, radius power_law exponent lo hi, grading d1 p1 d2 p2 ...,
 *   pressure x, k0 x|rest, void_ratio x, void_ratio_tolerance x, friction_prep x, damping_prep x,
 *   tolerance x, contact hooke|hertz|dmt, format fast|mixed|double|single, device auto|cpu|cuda,
 *   threads N, and the keywords of the material: kn, kt, friction, density, ...
 * With k0 rest the pressure is the stress along the last axis. There is no strain along the other
 * axes, and the grains determine the stresses along them. Without device and threads the
 * preparation runs on one CPU thread, from seconds to minutes. radius uniform, k0 rest,
 * void_ratio_tolerance, device and threads exist since 1.2. A call makes one packing, so the words
 * of create_rve that make a library are errors: seeds, policy, and several values of pressure,
 * friction_prep or void_ratio. After contact, a law with numbers is read in the syntax of LAMMPS'
 * pair granular (manual: contact_laws), for example contact hertz/material 7e10 0 0.25 tangential
 * mindlin NULL 0 0.5; without numbers each contact parameter has its own keyword, as kn, hertz_kn,
 * surface_energy. Since 1.4: lognormal, power_law, grading, the syntax of LAMMPS. */
RVE_API int rve_packing_create(const char *recipe, rve_packing **packing);
/* Returns the number of grains that represent a distribution of sizes (manual: create_rve). `sizes`
 * has the keywords shape and radius or grading of a recipe. Since 1.4. */
RVE_API int rve_grains_needed(const char *sizes, size_t *grains);
/* Translates a contact law in the syntax of LAMMPS' pair granular, the words after contact, to
 * contact and single keywords of a recipe for disks (dimension 2) or spheres (3). The text has no
 * final 0. With words NULL only *size is set. Since 1.4. */
RVE_API int rve_contact_words(const char *contact, int dimension, char *words, size_t capacity,
                              size_t *size);
RVE_API int rve_packing_copy(const rve_packing *packing, rve_packing **copy);
RVE_API void rve_packing_free(rve_packing *packing);
/* Save and restore the exact state of a packing as bytes, for other processes and for checkpoints
 * of the host program. In contrast to a packing file, the bytes contain counters, energies and the
 * list of pairs. The arguments are those of rve_save() and rve_restore(): with bytes NULL only
 * *size is set. Since 1.1. */
RVE_API int rve_packing_save(const rve_packing *packing, void *bytes, size_t capacity,
                             size_t *size);
RVE_API int rve_packing_restore(const void *bytes, size_t size, rve_packing **packing);

/* Returns the dimension of the grains: 2 for disks, 3 for spheres. */
RVE_API int rve_packing_dimension(const rve_packing *packing);
RVE_API size_t rve_packing_grains(const rve_packing *packing);
/* Returns the void ratio: (volume of the cell) / (volume of the grains) - 1 [-]. */
RVE_API double rve_packing_void_ratio(const rve_packing *packing);
/* Returns the smallest diameter for which the grains up to this diameter have at least `percent`, 0
 * to 100, of the mass of all grains [length]. Since 1.4. */
RVE_API int rve_packing_diameter(const rve_packing *packing, double percent, double *diameter);
/* Copies the array `name` to `values`. N is the number of grains:
 *   "cell" (D, D) [length], "deformation" (D, D) [-], "radius" (N) [length], "position" (N, D)
 *   [length], "velocity" (N, D), relative to the motion of the cell [length/time], "spin" (N), for
 *   spheres (N, 3) [1/time]
 * `count` must be the number of values of the array. */
RVE_API int rve_packing_array(const rve_packing *packing, const char *name, double *values,
                              size_t count);
/* Get and set a parameter of the material by its keyword: kn, kt, friction, density, damping, ...
 * (manual: fix rve). */
RVE_API int rve_packing_parameter(const rve_packing *packing, const char *keyword, double *value);
RVE_API int rve_packing_set_parameter(rve_packing *packing, const char *keyword, double value);

/* Table of the contacts between grains. Forces are those of the contact springs, without dashpots.
 * rve_packing_contacts() gives the number of rows, and rve_contact_columns() returns the number of
 * columns. A row has the ID of the first and of the second grain (from 0), the branch vector (D)
 * [length], the overlap [length], the normal force [force], the force on the first grain (D)
 * [force], and 1 if the contact slides, else 0. */
RVE_API size_t rve_contact_columns(int dimension);
RVE_API int rve_packing_contacts(const rve_packing *packing, size_t *rows);
RVE_API int rve_packing_contact_table(const rve_packing *packing, double *values, size_t count);

/* ---- batches ---- */

typedef struct rve_batch rve_batch;

/* Makes a batch whose RVEs begin as copies of these packings. All packings must have the same
 * dimension and contact law. Options are words and values:
 *   format fast|mixed|double, arithmetic strict|relaxed, device auto|cpu|cuda, device_number N,
 *   threads N (0: default of OpenMP), block_size N, skin x [length], arms contact|lammps (since
 *   1.2), overlap_limit x [-], energy yes|no (sums up work and losses)
 * NULL or "" gives format mixed, device auto. Other keywords of fix rve are not options. drive,
 * servo, path, dt, substeps, quiescent, stress, policy, copies, shadow, progress, preset and dump
 * define a macro step, which the host program builds from the functions below. The packings define
 * the packing and image of each RVE. Instead of mass_scaling, the host program multiplies the
 * parameter mass_depth of the packings by the factor. */
RVE_API int rve_batch_create(const rve_packing *const *packings, size_t count, const char *options,
                             rve_batch **batch);
RVE_API void rve_batch_free(rve_batch *batch);
RVE_API int rve_batch_dimension(const rve_batch *batch);
RVE_API size_t rve_batch_size(const rve_batch *batch);
/* Returns a line for a log, for example "2 CPU threads (x86-64-v3), mixed, strict" or "NVIDIA H200,
 * mixed, strict". It is valid as long as the batch. */
RVE_API const char *rve_batch_description(const rve_batch *batch);

/* In the functions below `which` has `count` different indices of RVEs, from 0, and arrays have one
 * entry for each of these RVEs in the same order. With which NULL the call is for all RVEs, and
 * count must be their number. */

/* Gives lower bounds of the critical DEM time steps of the present states, dt (count) [time]. A
 * step should be at most 0.9 of its bound. The functions below reject a step above the bound. They
 * check an RVE at the start of a call in three cases: it was not checked before, the step exceeds
 * the bound of the last check, or the number or the forces of its contacts have grown since that
 * check. */
RVE_API int rve_time_steps(rve_batch *batch, const size_t *which, size_t count, double *dt);

/* Deforms RVEs from their committed states: F becomes increment * F in substeps[k] DEM steps of
 * dt[k].
 *   increments  (count, D, D) of the deformation gradient, near identity
 *   dt          (count) [time], at most the stability bound of the committed state
 *   substeps    (count), 0 or more; with 0 the increment must be the identity, and the present
 *               configuration is evaluated
 *   stresses    (count, D, D) Cauchy stress [stress], or NULL
 *   statuses    (count), 0 without errors or warnings (rve_status_text), or NULL; an RVE that
 *               failed has no trial and keeps its committed state */
RVE_API int rve_trial(rve_batch *batch, const size_t *which, size_t count, const double *increments,
                      const double *dt, const int32_t *substeps, double *stresses,
                      uint32_t *statuses);
/* Makes the last trials of all RVEs their committed states. */
RVE_API int rve_commit(rve_batch *batch);
/* Discards the last trials of all RVEs. */
RVE_API int rve_revert(rve_batch *batch);
/* Does a trial and commits it at once for the RVEs that succeeded. This is for host programs that
 * never discard a trial. It is an error while any RVE has a trial. */
RVE_API int rve_advance(rve_batch *batch, const size_t *which, size_t count,
                        const double *increments, const double *dt, const int32_t *substeps,
                        double *stresses, uint32_t *statuses);
/* Element tests: each RVE follows a loading path from its committed state. A path prescribes rates,
 * strains and stresses; a servo controls the stresses. A test has `calls` calls of `substeps` DEM
 * steps of dt. Since 1.1.
 *   path        the words of a path file (manual: fix rve, loading paths) without v_names: one path
 *               for all RVEs, or `count` paths for the RVEs in the same order
 *   quantities  names of rve_quantity(), separated by blanks
 *   table       (calls + 1, count, quantities) before the first call and after each call; the
 *               values of an RVE are constant after the end of its path and after its failure
 *   statuses    (count), 0 without errors or warnings, or NULL; an RVE that failed keeps the state
 *               before the call in which it failed
 * The states are committed. It is an error while any RVE has a trial. */
RVE_API int rve_follow_path(rve_batch *batch, const size_t *which, size_t count, const char *path,
                            double dt, int32_t substeps, size_t calls, const char *quantities,
                            double *table, uint32_t *statuses);
/* Returns the mask of the status bits of failures. An RVE that failed keeps its earlier state. */
RVE_API uint32_t rve_status_fatal(void);
/* Returns the text of a status, for example "overlap too large, no contacts"; "ok" for 0. The text
 * is valid until the next call of this function by this thread. */
RVE_API const char *rve_status_text(uint32_t status);

/* Gives a quantity (count) of the states after the last trial or advance, or of the committed
 * states before any trial. The names are those of compute rve/atom: "p", "q", "void_ratio",
 * "coordination", "fabric_xx", "kinetic", "work", "sliding", ... Names that need a fix are
 * errors: servo_error, path_..., inertial, copies, renewals. */
RVE_API int rve_quantity(rve_batch *batch, const char *name, const size_t *which, size_t count,
                         double *values);
/* rve_num_quantities() returns the number of these names for a dimension of 2 or 3.
 * rve_quantity_name() returns the k-th name (from 0), and "" after the last one. For any other
 * dimension they return 0 and NULL. */
RVE_API size_t rve_num_quantities(int dimension);
RVE_API const char *rve_quantity_name(int dimension, size_t k);

/* Gives the stiffness of the present contacts under the assumption that grains move affinely and do
 * not spin. It is an upper bound of the elastic tangent and needs no DEM step.
 *   stiffness  (count, D*D, S) derivatives of the components of stress, row by row, with respect to
 *              the components of strain [stress]; S = 3: xx, yy, xy, or S = 6: xx, yy, zz, xy, xz,
 *              yz, where a strain xy changes both xy and yx */
RVE_API int rve_affine_stiffness(rve_batch *batch, const size_t *which, size_t count,
                                 double *stiffness);

/* Measures tangents of the present states by probing (manual: compute rve/tangent): copies of the
 * RVEs are strained slightly and come to rest, which takes thousands of DEM steps per copy. The
 * RVEs themselves are not changed. Options are words and values:
 *   kind elastic|loading, format fast|mixed|double|single of the copies (since 1.2; default: format
 *   of the batch), probe x, lead x, spread x, strain_steps N, lead_steps N, look_steps N,
 *   most_steps N, tolerance x, damping x
 * NULL or "" gives kind elastic and values that suit the number format.
 *   strain_rates  (count, D, D) present direction of straining for kind loading; NULL allowed with
 *                 kind elastic
 *   tangents      (count, S, S) derivatives of stress with respect to engineering strain [stress];
 *                 S = 3: xx, yy, xy, or S = 6: xx, yy, zz, xy, xz, yz; zeros if a copy has failed
 *                 or if there is no direction of straining
 *   measured      (count) 1 for an RVE with a tangent, else 0, or NULL */
RVE_API int rve_tangents(rve_batch *batch, const size_t *which, size_t count, const char *options,
                         const double *strain_rates, double *tangents, int *measured);

/* ---- arrays in the memory of a GPU. Since 1.3 ---- */

/* Returns the number of the CUDA device of the batch; -1 for a batch on CPU threads. */
RVE_API int rve_batch_device_number(const rve_batch *batch);
/* A function with the suffix _device returns the same bits as the function without it. It needs a
 * batch on a CUDA device. Each of `increments`, `stresses`, `values` and `stiffness` may be in the
 * memory of that device or of the host. All other arrays are on the host. It is an error if an
 * array is in the memory of another device or if the batch is on CPU threads. The error names the
 * array, and the array is not accessed. The arrays are read and written in the default stream of
 * the device. Results are complete on return. If a stream that does not synchronise with the
 * default stream (a non-blocking CUDA stream) works on the arrays, its work must have finished
 * before the call. After any call for a batch on a CUDA device, the current CUDA device of the
 * thread is the device of the batch. */
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

/* ---- states of the RVEs of a batch ---- */

/* Copies the state of an RVE to a packing: its last trial if there is one, else its committed
 * state. */
RVE_API int rve_batch_packing(rve_batch *batch, size_t which, rve_packing **packing);
/* Replaces the committed state and the trial of an RVE by a packing with the same contact law. */
RVE_API int rve_batch_set_packing(rve_batch *batch, size_t which, const rve_packing *packing);

/* Saves the exact committed states as bytes, for restart files and for other processes. `bytes` has
 * space for `capacity` bytes. *size becomes the number of bytes of these states, and it is an error
 * if this number exceeds `capacity`. With bytes NULL only *size is set. This release restores bytes
 * of earlier releases; earlier releases reject bytes of this release. */
RVE_API int rve_save(rve_batch *batch, void *bytes, size_t capacity, size_t *size);
/* Restores committed states. The bytes must have as many RVEs as the batch. */
RVE_API int rve_restore(rve_batch *batch, const void *bytes, size_t size);

#ifdef __cplusplus
}
#endif

#endif
