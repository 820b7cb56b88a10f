// Shared by the programs of tests/bench: errors that end them, clocks, and figures that
// tests/bench/run keeps.
#pragma once

#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>
#include <vector>

#include "format/base/error.h"

namespace selvedge::bench {

template <class T>
T need(Result<T> result) {
  if (!result) {
    std::fprintf(stderr, "%s\n", to_line(result.error()).c_str());
    std::exit(1);
  }
  return std::move(*result);
}

inline void need(const Result<void>& result) {
  if (result) return;
  std::fprintf(stderr, "%s\n", to_line(result.error()).c_str());
  std::exit(1);
}

/// Seconds of a clock on the wall.
inline double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Processor seconds of all threads of the process, the rasteriser's included: others on the machine disturb
/// them less.
inline double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

/// Figures by name: `--rows FILE` writes them, one "name,value,unit" a line.
class Rows {
 public:
  /// Takes `--rows FILE` off the arguments, and keeps the others.
  Rows(int argc, char** argv) {
    for (int i = 1; i < argc; ++i) {
      const std::string argument = argv[i];
      if (argument == "--rows" && i + 1 < argc)
        path_ = argv[++i];
      else
        arguments_.push_back(argument);
    }
  }
  const std::vector<std::string>& arguments() const { return arguments_; }

  /// Characters that would part columns become underscores.
  void add(std::string name, double value, const char* unit) {
    for (char& c : name) c = c == ',' || c == ' ' ? '_' : c;
    text_ += fmt::format("{},{:.4g},{}\n", name, value, unit);
  }

  void write() const {
    if (path_.empty()) return;
    std::FILE* file = std::fopen(path_.c_str(), "w");
    const bool good = file != nullptr && std::fwrite(text_.data(), 1, text_.size(), file) == text_.size();
    if (file == nullptr || std::fclose(file) != 0 || !good) {
      std::fprintf(stderr, "%s cannot be written\n", path_.c_str());
      std::exit(1);
    }
  }

 private:
  std::string path_;
  std::vector<std::string> arguments_;
  std::string text_;
};

}  // namespace selvedge::bench
