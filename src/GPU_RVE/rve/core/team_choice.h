// Whether light work, loops of microseconds that come again and again, is shared by all threads or done by one. Where cores are taken by
// other programs, a thread that does not run keeps the others waiting at the end of each loop for milliseconds; how many cores are free is
// nobody's to know, so both ways are timed now and then.

#ifndef RVE_CORE_TEAM_CHOICE_H
#define RVE_CORE_TEAM_CHOICE_H

#include <algorithm>

namespace rve {

/// Counts loops in windows. One thread begins; the first loop after a change wakes threads and is not representative.
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
  /// A trial is paid for by so many times of what it lost; and comes no sooner than after so many windows.
  static constexpr double REST = 100.0;
  static constexpr int LEAST_REST = 16;

  double pace() const { return seconds_ / items_; }    ///< of the present window [s per item]

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
    usual_ = pace();
    window_seconds_ = seconds_;
    begin_window();
    if (patience_ > 0.0) return;
    trial_ = true;
    change();
  }

  void go_on_trying()
  {
    const bool is_slow = (loops_ >= LEAST_LOOPS && pace() > CLEARLY_WORSE * usual_) ||
        waking_seconds_ + seconds_ > CLEARLY_WORSE * window_seconds_;
    if (loops_ < WINDOW && !is_slow) return;
    const double lost = std::max(waking_seconds_ + seconds_ - usual_ * items_, 0.0);
    patience_ = std::max(REST * lost, LEAST_REST * window_seconds_);
    if (!is_slow && pace() < BETTER * usual_)
      usual_ = pace();
    else
      change();
    trial_ = false;
    begin_window();
  }

  bool alone_ = true, trial_ = false, has_changed_ = true;
  int loops_ = 0;
  double items_ = 0.0, seconds_ = 0.0, waking_seconds_ = 0.0;    ///< of the present window
  double usual_ = 0.0;             ///< pace of the last window that was no trial [s per item]
  double window_seconds_ = 0.0;    ///< its length
  double patience_ = 0.0;          ///< light work until the next trial [s]
};

}    // namespace rve

#endif
