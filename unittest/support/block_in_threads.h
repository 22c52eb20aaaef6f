// SPDX-License-Identifier: GPL-2.0-only
// Simulates a thread block of a GPU by threads of a CPU. Several threads process the items of a
// phase at the same time. A phase ends when all threads have finished. In a build with
// GPU_RVE_SANITIZE=thread, the sanitizer reports an item that accesses memory which another item
// writes in the same phase. On a GPU this is a race.

#pragma once

#include "rve/block/block_serial.h"

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace rve_test {

/// Threads that run functions together. Threads of OpenMP are unsuitable, since the thread
/// sanitizer does not detect their synchronisation.
class Team {
 public:
  static constexpr int SIZE = 4;

  static Team &instance()
  {
    static Team team;
    return team;
  }

  /// Runs work(t) for all threads t of the team at the same time.
  void run(const std::function<void(int)> &work)
  {
    std::unique_lock<std::mutex> lock(mutex_);
    work_ = &work;
    left_ = SIZE;
    ++turn_;
    begins_.notify_all();
    ends_.wait(lock, [&] { return left_ == 0; });
  }

 private:
  Team()
  {
    for (int t = 0; t < SIZE; ++t) threads_.emplace_back([this, t] { serve(t); });
  }
  ~Team()
  {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      is_over_ = true;
      begins_.notify_all();
    }
    for (std::thread &thread : threads_) thread.join();
  }

  void serve(int t)
  {
    std::unique_lock<std::mutex> lock(mutex_);
    for (long turn = 0;;) {
      begins_.wait(lock, [&] { return is_over_ || turn_ > turn; });
      if (is_over_) return;
      turn = turn_;
      lock.unlock();
      (*work_)(t);
      lock.lock();
      if (--left_ == 0) ends_.notify_one();
    }
  }

  std::mutex mutex_;
  std::condition_variable begins_, ends_;
  const std::function<void(int)> *work_ = nullptr;
  int left_ = 0;
  long turn_ = 0;
  bool is_over_ = false;
  std::vector<std::thread> threads_;
};

/// A block whose phases run in several threads. In `Base`, a phase is a loop of one thread.
/// Here consecutive items belong to different threads. Every second thread processes its items
/// backwards. `aside` is additional work of a phase, which one thread does.
template <class Base> class InThreads : public Base {
  template <class F> static void share(int n, const F &f)
  {
    Team::instance().run([&](int t) {
      const int count = (n - t + Team::SIZE - 1) / Team::SIZE;
      for (int k = 0; k < count; ++k) f(t + Team::SIZE * (t % 2 == 0 ? k : count - 1 - k), t);
    });
  }
  template <class F, class G> static void share(int n, const F &f, int m, const G &g)
  {
    Team::instance().run([&](int t) {
      for (int k = t; k < m; k += Team::SIZE) g(k);
      for (int i = t; i < n; i += Team::SIZE) f(i);
    });
  }

 public:
  template <class F> void for_each(int n, F f)
  {
    share(n, [&](int i, int) { f(i); });
  }
  template <class F, class Aside> void for_each(int n, F f, Aside aside)
  {
    share(n, f, 1, [&](int) { aside(); });
  }
  template <rve::Visit = rve::Visit::Items, class F> void for_items(int n, F f) { for_each(n, f); }
  template <rve::Visit = rve::Visit::Items, class F, class G> void for_items(int n, F f, int m, G g)
  {
    share(n, f, m, g);
  }
  template <class F> void own_items(int n, F f) { for_each(n, f); }

  template <class F> bool any(int n, F f)
  {
    return any(n, f, [] {});
  }
  template <class F, class Aside> bool any(int n, F f, Aside aside)
  {
    bool of_thread[Team::SIZE] = {};
    Team::instance().run([&](int t) {
      if (t == Team::SIZE - 1) aside();
      for (int i = t; i < n; i += Team::SIZE) of_thread[t] = f(i) | of_thread[t];
    });
    bool result = false;
    for (const bool one : of_thread) result = result || one;
    return result;
  }
  // No place is without an item, as in a block with two items per thread.
  template <rve::Visit = rve::Visit::Items, class F> bool any_item(int n, F f) { return any(n, f); }
  template <class F> static void for_empty_registers(int, F) {}

  template <int M, class F> rve::IntegerSums<M> sum_integers(int n, F f)
  {
    std::int64_t of_thread[Team::SIZE][M] = {};
    share(n, [&](int i, int t) { f(i, static_cast<std::int64_t *>(of_thread[t])); });
    rve::IntegerSums<M> sums = {};
    for (const auto &of_one : of_thread)
      for (int m = 0; m < M; ++m) sums.value[m] += of_one[m];
    return sums;
  }
  template <int M, class Term, rve::Visit = rve::Visit::Items, class F, class Rest>
  void reduce_items(int n, F f, Rest rest, rve::Reduction<M> &reduction)
  {
    rve::Reduction<M> of_thread[Team::SIZE] = {};
    share(n, [&](int i, int t) { Base::template add_to_reduction<M, Term>(i, f, of_thread[t]); });
    reduction = rve::Reduction<M>{};
    for (const rve::Reduction<M> &of_one : of_thread) {
      for (int m = 0; m < M; ++m)
        reduction.sum[m] = rve::wrapping_sum(reduction.sum[m], of_one.sum[m]);
      reduction.largest = of_one.largest > reduction.largest ? of_one.largest : reduction.largest;
    }
    Base::template add_rest<M, Term>(rest, reduction);
  }
  template <int M, class Term, class F, class Then>
  void add_up_items(int n, F f, std::int64_t *sum, Then then)
  {
    std::int64_t of_thread[Team::SIZE][M] = {};
    share(n, [&](int i, int t) {
      Base::template add_terms<M, Term>(i, f, static_cast<std::int64_t *>(of_thread[t]));
    });
    for (int m = 0; m < M; ++m) sum[m] = 0;
    for (const auto &of_one : of_thread)
      for (int m = 0; m < M; ++m) sum[m] = rve::wrapping_sum(sum[m], of_one[m]);
    then();
  }

  // Several items can add to a sum at the same time, so additions are atomic.
  template <class Integer> void accumulate(Integer *sums, int /*room*/, int i, Integer v)
  {
    __atomic_fetch_add(sums + i, v, __ATOMIC_RELAXED);
  }
  void add(std::int32_t *p, std::int32_t v) { __atomic_fetch_add(p, v, __ATOMIC_RELAXED); }
  int fetch_add(int *p, int v) { return __atomic_fetch_add(p, v, __ATOMIC_RELAXED); }
  void fetch_min(int *p, int v)
  {
    int now = __atomic_load_n(p, __ATOMIC_RELAXED);
    while (v < now &&
           !__atomic_compare_exchange_n(p, &now, v, false, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {}
  }
};

}    // namespace rve_test
