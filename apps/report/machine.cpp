#include "apps/report/machine.h"

#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "format/base/parallel.h"

namespace selvedge {

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
