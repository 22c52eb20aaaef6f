// SPDX-License-Identifier: GPL-2.0-only
// Functions for arrays that a caller has in host memory or in the memory of a CUDA device. In
// builds without CUDA all arrays are in host memory.

#pragma once

#include <cstddef>

namespace rve {

/// Returns true if the array is in the memory of this CUDA device, and false if the host can access
/// the array. Throws InputError with the `name` of the array if it is in the memory of another
/// device.
bool is_on_device(const double *array, const char *name, int device);

/// Copies numbers between this device and the host, or within one of them. The copy begins after
/// the work in the default stream of the device and is complete on return.
void copy_numbers(const double *from, double *to, std::size_t count, int device);

}    // namespace rve
