// Runs a fuzz target over files and folders: what fuzzing has found stays found, in builds without libFuzzer.
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "tests/fuzz/target.h"

namespace fs = std::filesystem;

namespace {

/// Seconds for one input; far more than any needs, even under the sanitizers on a busy machine.
constexpr double limit_seconds = 20;

std::vector<fs::path> files_of(const fs::path& path) {
  std::vector<fs::path> files;
  if (!fs::exists(path)) return files;  // a target without findings has no folder for them
  if (!fs::is_directory(path)) return {path};
  for (const auto& entry : fs::recursive_directory_iterator(path))
    if (entry.is_regular_file()) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace

int main(int argc, char** argv) {
  int count = 0;
  double longest = 0;
  std::string slowest;
  for (int i = 1; i < argc; ++i) {
    for (const fs::path& path : files_of(argv[i])) {
      std::ifstream file(path, std::ios::binary);
      const std::vector<char> bytes{std::istreambuf_iterator<char>(file), {}};
      // Named before it runs: a crash leaves no other trace.
      std::printf("%s\n", path.string().c_str());
      std::fflush(stdout);
      const auto start = std::chrono::steady_clock::now();
      LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
      const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
      if (seconds.count() >= longest) {
        longest = seconds.count();
        slowest = path.string();
      }
      ++count;
    }
  }
  std::printf("%d inputs, the slowest took %.3f s: %s\n", count, longest, slowest.c_str());
  if (count == 0) {
    std::fprintf(stderr, "nothing to replay\n");
    return 1;
  }
  return longest <= limit_seconds ? 0 : 1;
}
