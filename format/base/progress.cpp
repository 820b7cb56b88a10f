#include "format/base/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

namespace selvedge {
thread_local std::shared_ptr<const ProgressSink> progress_sink;

TerminalProgress::TerminalProgress(std::string label, bool quiet)
    : label_(std::move(label)),
      active_(!quiet && isatty(STDERR_FILENO) == 1),
      start_(std::chrono::steady_clock::now()),
      shown_(start_) {}

TerminalProgress::~TerminalProgress() {
  if (active_) std::fputs("\r\033[K", stderr);
}

Progress TerminalProgress::callback() {
  if (progress_sink)
    return [sink = progress_sink, label = label_](double fraction) { (*sink)(label, fraction); };
  if (!active_) return {};
  return [this](double fraction) { show(fraction); };
}

void TerminalProgress::show(double fraction) {
  const auto now = std::chrono::steady_clock::now();
  if (now - shown_ < std::chrono::milliseconds(200)) return;
  shown_ = now;
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  const double left = fraction > 0 ? elapsed / fraction - elapsed : 0;
  const std::string line = fmt::format("\r\033[K{} {:3.0f} %  {:.0f} s, {:.0f} s left{}{}", label_,
                                       100 * fraction, elapsed, left, note_.empty() ? "" : "  ", note_);
  std::fputs(line.c_str(), stderr);
  std::fflush(stderr);
}

}  // namespace selvedge
