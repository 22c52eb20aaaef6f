// SPDX-License-Identifier: GPL-2.0-only
// Arrays of callers that may be in the memory of a CUDA device; never in builds without CUDA.

#pragma once

#include <cstddef>

namespace rve {

/// Returns true if the array is in the memory of this CUDA device; otherwise the host reads and
/// writes it. Throws InputError with the `name` of the array if it is in the memory of another
/// device.
bool is_on_device(const double *array, const char *name, int device);

/// Copies numbers between this device and the host, or within one of them. The copy follows the
/// work in the default stream of the device and is complete on return.
void copy_numbers(const double *from, double *to, std::size_t count, int device);

}    // namespace rve
