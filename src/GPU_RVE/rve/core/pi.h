// SPDX-License-Identifier: GPL-2.0-only
// The nearest double to pi.

#pragma once

namespace rve {

constexpr double kPi = 3.14159265358979323846;

}    // namespace rve
