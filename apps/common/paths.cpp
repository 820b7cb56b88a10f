#include "apps/common/paths.h"

#include <fmt/format.h>

#include <filesystem>

#include "format/base/atomic_file.h"

namespace selvedge {

Result<void> check_distinct(const std::vector<std::pair<std::string, std::string>>& paths) {
  const auto place_of = [](const std::string& path) {
    std::error_code ignored;
    const std::filesystem::path place = std::filesystem::weakly_canonical(path, ignored);
    return ignored ? std::filesystem::path(path).lexically_normal() : place;
  };
  for (std::size_t i = 0; i < paths.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const auto& [name, path] = paths[i];
      const auto& [other_name, other] = paths[k];
      if (path.empty() || other.empty()) continue;
      std::error_code ignored;
      if (place_of(path) != place_of(other) && !std::filesystem::equivalent(path, other, ignored)) continue;
      return fail(Code::option_out_of_range, path, name,
                  fmt::format("is the file of {} as well", other_name));
    }
  }
  return {};
}

Result<void> check_writable(const std::vector<std::string>& paths) {
  for (const std::string& path : paths) {
    if (path.empty()) continue;
    if (const auto file = AtomicFile::create(path); !file) return tl::unexpected(file.error());
  }
  return {};
}

}  // namespace selvedge
