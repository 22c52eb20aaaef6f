// SPDX-License-Identifier: GPL-2.0-only
// Substitute for the C++ standard library in kernels that NVRTC compiles. It has only the parts
// that the kernels need. NVRTC has no host headers, and the headers of libcu++ are missing on
// machines without the CUDA Toolkit. This header replaces each standard header that the kernels
// include (cmake/EmbedKernelText.cmake), and no other code includes it. It has an include guard
// instead of #pragma once, since NVRTC includes it under several names and recognises a repeated
// file only by its name.

#ifndef CUDA_NVRTC_STD_H
#define CUDA_NVRTC_STD_H

#ifdef __CUDACC_RTC__

// The front end of NVRTC has the intrinsic __INTADDR__ but not __builtin_offsetof.
#define offsetof(type, member) __INTADDR__(&((static_cast<type *>(0))->member))

namespace std {

// The types are those of 64-bit Linux, so that overload resolution is the same as on the host.
using int32_t = int;
using uint32_t = unsigned int;
using int64_t = long;
using uint64_t = unsigned long;
using size_t = decltype(sizeof(0));
using uintptr_t = unsigned long;

using ::copysign;
using ::fabs;
using ::floor;
using ::fma;
using ::isfinite;
using ::nearbyint;
using ::sqrt;

template <class T> struct numeric_limits;
template <> struct numeric_limits<float> {
  static constexpr float infinity() { return __builtin_bit_cast(float, 0x7f800000); }
};

template <class T, class U> constexpr bool is_same_v = false;
template <class T> constexpr bool is_same_v<T, T> = true;

template <class T> constexpr bool is_const_v = false;
template <class T> constexpr bool is_const_v<const T> = true;

template <bool condition, class Yes, class No> struct conditional {
  using type = Yes;
};
template <class Yes, class No> struct conditional<false, Yes, No> {
  using type = No;
};
template <bool condition, class Yes, class No>
using conditional_t = typename conditional<condition, Yes, No>::type;

/// Replacement of std::decay for types that are neither arrays nor functions.
template <class T> struct decay {
  using type = T;
};
template <class T> struct decay<const T> {
  using type = T;
};
template <class T> struct decay<T &> {
  using type = typename decay<T>::type;
};
template <class T> struct decay<T &&> {
  using type = typename decay<T>::type;
};
template <class T> using decay_t = typename decay<T>::type;

template <class T> struct make_unsigned;
template <> struct make_unsigned<int32_t> {
  using type = uint32_t;
};
template <> struct make_unsigned<int64_t> {
  using type = uint64_t;
};
template <class T> using make_unsigned_t = typename make_unsigned<T>::type;

template <size_t... K> struct index_sequence {
};
template <size_t N, size_t... K> struct count_down {
  using type = typename count_down<N - 1, N - 1, K...>::type;
};
template <size_t... K> struct count_down<0, K...> {
  using type = index_sequence<K...>;
};
template <size_t N> using make_index_sequence = typename count_down<N>::type;

}    // namespace std

#if __CUDA_ARCH__ >= 900
// The definitions are those of cuda_device_runtime_api.h.
__device__ __forceinline__ void cudaTriggerProgrammaticLaunchCompletion()
{
  asm volatile("griddepcontrol.launch_dependents;" :::);
}
__device__ __forceinline__ void cudaGridDependencySynchronize()
{
  asm volatile("griddepcontrol.wait;" ::: "memory");
}
#endif

#endif
#endif
