// Time and progress of long-running stages, and the line of progress on the terminal.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <utility>

namespace selvedge {

/// Called with the completed fraction in [0, 1], from one thread at a time; may be empty.
using Progress = std::function<void(double)>;

/// Told the label and the fraction of every stage that this thread begins, from any thread, in place of the
/// terminal; null: the terminal.
using ProgressSink = std::function<void(const std::string&, double)>;
extern thread_local std::shared_ptr<const ProgressSink> progress_sink;

/// Seconds since it was made, or since the last add_lap().
class Stopwatch {
 public:
  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  /// Adds the time to one of several stages, and begins again.
  void add_lap(double& stage) {
    const Clock::time_point now = Clock::now();
    stage += std::chrono::duration<double>(now - std::exchange(start_, now)).count();
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
};

/// A line on standard error with percentage, elapsed and estimated remaining time, if standard error is a
/// terminal and `quiet` is false. The destructor erases the line.
class TerminalProgress {
 public:
  TerminalProgress(std::string label, bool quiet);
  TerminalProgress& operator=(TerminalProgress&&) = delete;
  ~TerminalProgress();

  /// The callback to hand to a stage; valid as long as this object.
  Progress callback();

  /// Text to show after the times.
  void print_note(std::string text) { note_ = std::move(text); }

 private:
  void show(double fraction);

  std::string label_;
  std::string note_;
  bool active_ = false;
  std::chrono::steady_clock::time_point start_;
  std::chrono::steady_clock::time_point shown_;
};

}  // namespace selvedge
