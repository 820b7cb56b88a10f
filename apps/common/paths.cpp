#include "apps/common/paths.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <filesystem>

#include "format/base/atomic_file.h"

namespace selvedge {

std::string identity_of(const std::string& path) {
  struct stat status {};
  if (stat(path.c_str(), &status) == 0) return fmt::format("{}:{}", status.st_dev, status.st_ino);
  std::error_code ignored;
  const std::filesystem::path whole = std::filesystem::absolute(path, ignored);
  const std::filesystem::path place = std::filesystem::weakly_canonical(whole, ignored);
  return (ignored ? whole.lexically_normal() : place).string();
}

Result<void> check_writable(const std::vector<std::string>& paths) {
  for (const std::string& path : paths) {
    if (path.empty()) continue;
    if (const auto file = AtomicFile::create(path); !file) return tl::unexpected(file.error());
  }
  return {};
}

}  // namespace selvedge
