#include "format/base/progress.h"

#include <doctest/doctest.h>
#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>

namespace selvedge {

TEST_CASE("a terminal is told the time that is left, by the fraction that is done") {
  const int terminal = posix_openpt(O_RDWR | O_NOCTTY);
  REQUIRE(terminal >= 0);
  REQUIRE(grantpt(terminal) == 0);
  REQUIRE(unlockpt(terminal) == 0);
  const int shown = open(ptsname(terminal), O_RDWR | O_NOCTTY);
  const int before = dup(STDERR_FILENO);
  REQUIRE(dup2(shown, STDERR_FILENO) == STDERR_FILENO);
  double seconds = 0;
  {
    TerminalProgress progress("rest", false);
    const Stopwatch watch;
    std::this_thread::sleep_for(std::chrono::milliseconds(250));
    progress.callback()(1.0 / 64);
    seconds = watch.seconds();
  }
  dup2(before, STDERR_FILENO);
  close(before);
  close(shown);
  std::array<char, 256> bytes{};
  const auto count = read(terminal, bytes.data(), bytes.size());
  close(terminal);
  REQUIRE(count > 0);
  const std::string line(bytes.data(), static_cast<std::size_t>(count));
  CAPTURE(line);
  CHECK(line.find("rest   2 %") != std::string::npos);
  // 63 times as long as what has passed, which lies between the sleep and what was measured.
  const std::size_t end = line.find(" s left");
  REQUIRE(end != std::string::npos);
  const double left = std::atof(line.c_str() + line.rfind(' ', end - 1));
  CHECK(left >= 15);
  CHECK(left <= 63 * seconds + 1);
}

}  // namespace selvedge
