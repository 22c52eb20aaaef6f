// Where RVEs and points are advanced, as a user says.

#ifndef CUDA_DEVICE_H
#define CUDA_DEVICE_H

namespace rve {

/// Auto: on a CUDA device if there is one that serves.
enum class Device { Auto, Cpu, Cuda };

}    // namespace rve

#endif
