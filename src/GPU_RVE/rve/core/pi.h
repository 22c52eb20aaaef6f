// The nearest double to pi.

#ifndef RVE_CORE_PI_H
#define RVE_CORE_PI_H

namespace rve {

constexpr double kPi = 3.14159265358979323846;

}    // namespace rve

#endif
