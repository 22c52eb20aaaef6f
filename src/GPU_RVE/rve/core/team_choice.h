// SPDX-License-Identifier: GPL-2.0-only
// Chooses between one thread and all threads for light work, that is for short loops that are
// repeated often. If other programs use the cores, a thread that is not scheduled delays the end of
// each loop by milliseconds. The number of free cores is unknown, so that both choices are timed
// occasionally.

#pragma once

#include <algorithm>

namespace rve {

/// Times loops in windows of WINDOW loops. The pace [s per item] of one thread, or of all threads,
/// is a weighted mean over the last windows with this choice. The first choice is one thread. The
/// first loop after a change does not count for the pace, since it wakes threads.
class TeamChoice {
 public:
  /// Returns true if one thread does the next loop.
  bool alone() const { return alone_; }

  /// Records the duration [s] of a loop over `items` items that ran as alone() chose.
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
  static constexpr int LEAST_LOOPS = 8;    ///< number of loops before a slow pace can end a trial
  /// A trial runs loops with the other choice. This choice is kept if its pace is below BETTER
  /// times the pace of the usual choice. A trial ends early if its pace is above CLEARLY_WORSE
  /// times the pace of the usual choice.
  static constexpr double BETTER = 0.9, CLEARLY_WORSE = 4.0;
  /// Weights of a window in the mean, for a window that was slower or faster than the mean. In
  /// about one of a thousand loops a thread is not scheduled for milliseconds. A single window with
  /// such a loop must not decide the choice.
  static constexpr double SLOWER = 0.125, FASTER = 0.25;
  /// The time until the next trial is REST times the time that the last trial lost compared with
  /// the usual choice, and at least LEAST_REST windows.
  static constexpr double REST = 100.0;
  static constexpr int LEAST_REST = 16;

  double pace() const { return seconds_ / items_; }    ///< pace of the current window [s per item]
  double &known(bool alone) { return known_[alone ? 0 : 1]; }

  /// Updates the mean pace by the pace of the current window. The pace of the window replaces the
  /// mean if no mean is known yet, or if `is_all` is true. A trial that ended early sets `is_all`.
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
    if (loops_ > 0) learn(loops_ < WINDOW);    // skipped if waking the team took too long
    if (is_slow || known(alone_) >= BETTER * usual) change();
    trial_ = false;
    begin_window();
  }

  bool alone_ = true, trial_ = false, has_changed_ = true;
  int loops_ = 0;
  double items_ = 0.0, seconds_ = 0.0, waking_seconds_ = 0.0;    ///< sums of the current window
  /// Paces of one thread and of the team; 0 if not known yet [s per item].
  double known_[2] = {0.0, 0.0};
  double window_seconds_ = 0.0;    ///< length of the last window outside trials
  double patience_ = 0.0;          ///< time of light work until the next trial [s]
};

}    // namespace rve
