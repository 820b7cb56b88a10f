#include "apps/report/measure.h"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "format/base/parallel.h"

namespace selvedge {

Result<double> clocked(const std::function<Result<void>()>& run) {
  const auto start = std::chrono::steady_clock::now();
  if (auto ok = run(); !ok) return tl::unexpected(ok.error());
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

Result<Seconds> timed(int repeats, const std::function<Result<double>()>& run) {
  std::vector<double> wall;
  std::vector<double> processor;
  for (int i = 0; i < repeats; ++i) {
    const std::clock_t work = std::clock();
    const Result<double> seconds = run();
    if (!seconds) return tl::unexpected(seconds.error());
    wall.push_back(*seconds);
    processor.push_back(static_cast<double>(std::clock() - work) / CLOCKS_PER_SEC);
  }
  std::sort(wall.begin(), wall.end());
  std::sort(processor.begin(), processor.end());
  const auto middle = static_cast<std::size_t>(repeats - 1) / 2;
  return Seconds{wall[middle], processor[middle]};
}

nlohmann::ordered_json machine_json() {
  std::string processor = "unknown";
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; processor == "unknown" && std::getline(info, line);) {
    const std::size_t colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) processor = line.substr(colon + 2);
  }
  return {{"processor", processor},
          {"cores", static_cast<int>(std::thread::hardware_concurrency())},
          {"threads", thread_count()}};
}

}  // namespace selvedge
