#include "apps/report/machine.h"

#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "format/base/parallel.h"

namespace selvedge {

Machine this_machine() {
  Machine machine{"unknown", static_cast<int>(std::thread::hardware_concurrency())};
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    const std::size_t colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) {
      machine.processor = line.substr(colon + 2);
      break;
    }
  }
  return machine;
}

nlohmann::ordered_json machine_json() {
  const Machine machine = this_machine();
  return {{"processor", machine.processor}, {"cores", machine.cores}, {"threads", thread_count()}};
}

}  // namespace selvedge
