// SPDX-License-Identifier: GPL-2.0-only
// Operations of packs on arrays of 8 numbers, compiled for x86-64-v3.

#include "core/pack_probe.h"

#include "rve/core/pack_rows.h"

#include <initializer_list>

using namespace rve;

namespace {
template <class To, class From> void convert_all(const From *x, To *y)
{
  static_cast<Pack<To, 8>>(Pack<From, 8>::load(x)).store(y);
}

template <class T, class Integer> void round_all(const T *x, Integer *q)
{
  Pack<Integer, 8> rounded;
  round_to(Pack<T, 8>::load(x), rounded);
  rounded.store(q);
}

template <class T> void apply_all(const T *x, const T *y, const T *z, T (*results)[8])
{
  using Numbers = Pack<T, 8>;
  const Numbers a = Numbers::load(x), b = Numbers::load(y), c = Numbers::load(z);
  const auto root = root_and_inverse(a);
  int k = 0;
  for (const Numbers &result :
       {a + b, a - b, a * b, -a, fma(a, b, c), fabs(a), copysign(a, b), smaller(a, b), larger(a, b),
        root.root, root.inverse, reciprocal(a), select(a < b, a, c), select(a > b, a, c),
        select(a >= b, a, c), select(a <= b, a, c), select(a != b, a, c), where(a < b, c)})
    result.store(results[k++]);
}

template <class T, class Number, int K>
void mask_records(const T *x, rve_test::PackRecord<Number, K> *records)
{
  using Numbers = Pack<Number, 8>;
  const auto record = load_records<rve_test::PackRecord<Numbers, K>, Numbers>(records);
  PackTruth<Number, 8> keeps;
  convert_truth(Pack<T, 8>::load(x) >= Pack<T, 8>(T(0)), keeps);
  store_records<Numbers>(where(keeps, record), records);
}
}    // namespace

namespace rve_test {
#define RVE_PACK_RECORDS(T, Number, K)                               \
  void pack_mask_records(const T *x, PackRecord<Number, K> *records) \
  {                                                                  \
    mask_records(x, records);                                        \
  }
#define RVE_PACK_RECORDS_OF(K)        \
  RVE_PACK_RECORDS(float, double, K)  \
  RVE_PACK_RECORDS(double, double, K) \
  RVE_PACK_RECORDS(float, float, K)
RVE_PACK_RECORDS_OF(2)
RVE_PACK_RECORDS_OF(3)
RVE_PACK_RECORDS_OF(4)
RVE_PACK_RECORDS_OF(5)
#undef RVE_PACK_RECORDS_OF
#undef RVE_PACK_RECORDS
void pack_convert(const std::int64_t *x, double *y)
{
  convert_all(x, y);
}
void pack_convert(const std::int32_t *x, float *y)
{
  convert_all(x, y);
}
void pack_convert(const float *x, double *y)
{
  convert_all(x, y);
}
void pack_convert(const double *x, float *y)
{
  convert_all(x, y);
}
void pack_round(const float *x, std::int32_t *q)
{
  round_all(x, q);
}
void pack_round(const double *x, std::int64_t *q)
{
  round_all(x, q);
}
void pack_apply(const float *x, const float *y, const float *z, float (*results)[8])
{
  apply_all(x, y, z, results);
}
void pack_apply(const double *x, const double *y, const double *z, double (*results)[8])
{
  apply_all(x, y, z, results);
}
}    // namespace rve_test
