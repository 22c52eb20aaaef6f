// SPDX-License-Identifier: GPL-2.0-only
// Arrays of callers that may be in the memory of a CUDA device. In builds without CUDA none is.

#pragma once

#include <cstddef>

namespace rve {

/// Whether the array is in the memory of this CUDA device; no: the host reads and writes it. Throws InputError, which calls the array by
/// `name`, if it is in the memory of another device.
bool is_on_device(const double *array, const char *name, int device);

/// Copies numbers between this device and the host, or within one of them: after the work that the default stream of the device has been
/// given, and done on return.
void copy_numbers(const double *from, double *to, std::size_t count, int device);

}    // namespace rve
