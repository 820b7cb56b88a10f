#include "format/base/progress.h"

#include <doctest/doctest.h>
#include <fcntl.h>
#include <unistd.h>

#include <chrono>
#include <string>
#include <thread>

namespace selvedge {

TEST_CASE("a terminal is told the time that is left, by the fraction that is done") {
  const int terminal = posix_openpt(O_RDWR | O_NOCTTY);
  REQUIRE((terminal >= 0 && grantpt(terminal) == 0 && unlockpt(terminal) == 0));
  const int before = dup(STDERR_FILENO);
  REQUIRE(dup2(open(ptsname(terminal), O_RDWR | O_NOCTTY), STDERR_FILENO) == STDERR_FILENO);
  const Stopwatch watch;
  {
    TerminalProgress progress("rest", false);
    std::this_thread::sleep_for(std::chrono::milliseconds(250));
    progress.callback()(1.0 / 64);
  }
  const double seconds = watch.seconds();
  dup2(before, STDERR_FILENO);
  std::string line(256, ' ');
  REQUIRE(read(terminal, line.data(), line.size()) > 0);
  CAPTURE(line);
  CHECK(line.find("rest   2 %") != std::string::npos);
  // 63 times as long as what has passed.
  const std::size_t end = line.find(" s left");
  REQUIRE(end != std::string::npos);
  const double left = std::atof(line.c_str() + line.rfind(' ', end - 1));
  CHECK(left >= 15);
  CHECK(left <= 63 * seconds + 1);
}

}  // namespace selvedge
