// A stub of NVIDIA's driver. It acts as a driver that is too old or has no device (DRIVER_VERSION,
// INIT_ERROR). It has only the functions that the CUDA runtime calls before it fails. A test links
// the runtime and loads this library instead of the driver.

#include <string.h>

int cuInit(unsigned flags)
{
  (void) flags;
  return INIT_ERROR;
}

int cuDriverGetVersion(int *version)
{
  *version = DRIVER_VERSION;
  return 0;
}

static int not_supported(void)
{
  return 801;
}

int cuGetProcAddress_v2(const char *name, void **function, int version, unsigned long long flags,
                        void *found)
{
  (void) version, (void) flags, (void) found;
  if (strcmp(name, "cuInit") == 0)
    *function = (void *) cuInit;
  else if (strcmp(name, "cuDriverGetVersion") == 0)
    *function = (void *) cuDriverGetVersion;
  else if (strcmp(name, "cuGetProcAddress") == 0)
    *function = (void *) cuGetProcAddress_v2;
  else
    *function = (void *) not_supported;
  return 0;
}
