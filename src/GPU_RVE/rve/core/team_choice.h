// SPDX-License-Identifier: GPL-2.0-only
// Whether light work, loops of microseconds that come again and again, is shared by all threads or done by one. Where cores are taken by
// other programs, a thread that does not run keeps the others waiting at the end of each loop for milliseconds; how many cores are free is
// nobody's to know, so both ways are timed now and then.

#pragma once

#include <algorithm>

namespace rve {

/// Counts loops in windows, and knows the paces of both ways by a mean of their last ones. One thread begins; the first loop after a change
/// wakes threads and is not representative.
class TeamChoice {
 public:
  /// Whether the next loop is for one thread.
  bool alone() const { return alone_; }

  /// A loop over so many items took so long, done as alone() said [s].
  void done(int items, double seconds)
  {
    if (has_changed_) {
      has_changed_ = false;
      waking_seconds_ = seconds;
    } else {
      items_ += items;
      seconds_ += seconds;
      ++loops_;
    }
    if (trial_)
      go_on_trying();
    else
      go_on(seconds);
  }

 private:
  static constexpr int WINDOW = 64;        ///< loops
  static constexpr int LEAST_LOOPS = 8;    ///< of a trial that is given up for its pace
  /// The other way must be faster by so much; and is as clearly slower when a trial is given up.
  static constexpr double BETTER = 0.9, CLEARLY_WORSE = 4.0;
  /// Share of a window in what is known, if it was slower than that, or faster. A thread that does not run for milliseconds, once in a
  /// thousand loops, makes a window slow in which it happens: one window shall not decide.
  static constexpr double SLOWER = 0.125, FASTER = 0.25;
  /// A trial is paid for by so many times of what it lost; and comes no sooner than after so many windows.
  static constexpr double REST = 100.0;
  static constexpr int LEAST_REST = 16;

  double pace() const { return seconds_ / items_; }    ///< of the present window [s per item]
  double &known(bool alone) { return known_[alone ? 0 : 1]; }

  /// From the present window. All there is to know, if it was the first or a trial that was given up.
  void learn(bool is_all)
  {
    double &known_pace = known(alone_);
    if (is_all || known_pace == 0.0)
      known_pace = pace();
    else
      known_pace += (pace() > known_pace ? SLOWER : FASTER) * (pace() - known_pace);
  }

  void begin_window()
  {
    items_ = seconds_ = waking_seconds_ = 0.0;
    loops_ = 0;
  }

  void change()
  {
    alone_ = !alone_;
    has_changed_ = true;
  }

  void go_on(double seconds)
  {
    patience_ -= seconds;
    if (loops_ < WINDOW) return;
    learn(false);
    window_seconds_ = seconds_;
    begin_window();
    if (patience_ > 0.0) return;
    trial_ = true;
    change();
  }

  void go_on_trying()
  {
    const double usual = known(!alone_);
    const bool is_slow = (loops_ >= LEAST_LOOPS && pace() > CLEARLY_WORSE * usual) ||
        waking_seconds_ + seconds_ > CLEARLY_WORSE * window_seconds_;
    if (loops_ < WINDOW && !is_slow) return;
    const double lost = std::max(waking_seconds_ + seconds_ - usual * items_, 0.0);
    patience_ = std::max(REST * lost, LEAST_REST * window_seconds_);
    if (loops_ > 0) learn(loops_ < WINDOW);    // none where waking the team took too long
    if (is_slow || known(alone_) >= BETTER * usual) change();
    trial_ = false;
    begin_window();
  }

  bool alone_ = true, trial_ = false, has_changed_ = true;
  int loops_ = 0;
  double items_ = 0.0, seconds_ = 0.0, waking_seconds_ = 0.0;    ///< of the present window
  /// Paces of one thread and of the team; 0: not known yet [s per item].
  double known_[2] = {0.0, 0.0};
  double window_seconds_ = 0.0;    ///< length of the last window that was no trial
  double patience_ = 0.0;          ///< light work until the next trial [s]
};

}    // namespace rve
