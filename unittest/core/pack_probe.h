// SPDX-License-Identifier: GPL-2.0-only
// Functions that apply operations of packs to arrays of 8 numbers. Only these functions, not their
// callers, must be compiled for x86-64-v3.

#pragma once

#include <cstdint>

namespace rve_test {

void pack_convert(const std::int64_t *x, double *y);
void pack_convert(const std::int32_t *x, float *y);
void pack_convert(const float *x, double *y);
void pack_convert(const double *x, float *y);
void pack_round(const float *x, std::int32_t *q);
void pack_round(const double *x, std::int64_t *q);

/// Number of results of pack_apply() for three numbers a, b and c. The results are, in order:
///   a+b, a-b, ab, -a, ab+c (fused), |a|, copysign(a, b), smaller, larger, root a, 1/root a, 1/a,
///   a<b ? a : c, then the same expression with >, >=, <= and != in place of <,
///   a<b ? c : 0
constexpr int PACK_OPERATIONS = 18;
void pack_apply(const float *x, const float *y, const float *z, float (*results)[8]);
void pack_apply(const double *x, const double *y, const double *z, double (*results)[8]);

/// A record of K numbers. pack_mask_records() sets record k to zero if x[k] < 0 and does not change
/// the other records.
template <class T, int K> struct PackRecord {
  T number[K];
};
#define RVE_PACK_RECORDS(K)                                                \
  void pack_mask_records(const float *x, PackRecord<double, K> *records);  \
  void pack_mask_records(const double *x, PackRecord<double, K> *records); \
  void pack_mask_records(const float *x, PackRecord<float, K> *records);
RVE_PACK_RECORDS(2)
RVE_PACK_RECORDS(3)
RVE_PACK_RECORDS(4)
RVE_PACK_RECORDS(5)
#undef RVE_PACK_RECORDS

}    // namespace rve_test
