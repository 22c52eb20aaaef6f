/* A host program in C. It strains two RVEs isotropically: as in a Newton iteration, it makes two
 * trials from the same state and commits the second.
 *
 *   c_host <packing> */
#include <librve.h>

#include <stdio.h>
#include <stdlib.h>

static void check(int code)
{
  if (code == RVE_SUCCESS) return;
  fprintf(stderr, "error %d: %s\n", code, rve_error());
  exit(1);
}

int main(int argc, char **argv)
{
  rve_packing *packing = NULL;
  rve_batch *batch = NULL;
  const rve_packing *packings[2];
  double dt[2], stress[8], again[8], p[2];
  double increments[8] = {1 - 1e-5, 0, 0, 1 - 1e-5, 1 - 2e-5, 0, 0, 1 - 2e-5};
  int32_t substeps[2] = {100, 100};
  uint32_t statuses[2];
  int k;

  if (argc != 2) return 2;
  if (rve_api_version() != 1000 * RVE_API_MAJOR + RVE_API_MINOR) return 3;
  check(rve_packing_read(argv[1], &packing));
  printf("%d dimensions, %zu grains\n", rve_packing_dimension(packing),
         rve_packing_grains(packing));
  packings[0] = packings[1] = packing;
  check(rve_batch_create(packings, 2, "format mixed device cpu threads 1", &batch));
  printf("%s\n", rve_batch_description(batch));
  rve_packing_free(packing);

  check(rve_time_steps(batch, NULL, 2, dt));
  for (k = 0; k < 2; ++k) dt[k] *= 0.5;
  check(rve_trial(batch, NULL, 2, increments, dt, substeps, stress, statuses));
  check(rve_trial(batch, NULL, 2, increments, dt, substeps, again, statuses));
  for (k = 0; k < 8; ++k)
    if (stress[k] != again[k]) return 4;
  check(rve_commit(batch));
  check(rve_quantity(batch, "p", NULL, 2, p));
  printf("p = %g and %g\n", p[0], p[1]);
  if (!(p[1] > p[0]) || statuses[0] != 0) return 5;

  /* an error has a text and changes nothing */
  if (rve_quantity(batch, "pressure", NULL, 2, p) != RVE_BAD_INPUT) return 6;
  printf("%s\n", rve_error());
  rve_batch_free(batch);
  return 0;
}
