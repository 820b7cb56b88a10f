// Inputs that the repository does not hold, in ../shared/data beside it.
#pragma once

#include <doctest/doctest.h>

#include <filesystem>
#include <string>

namespace selvedge::test {

/// The path of a file or a folder of the shared data. Without it the path is empty, and the test is reported as
/// skipped: it has to end.
inline std::string shared_data(const std::string& name) {
  const std::string path = std::string(SELVEDGE_DATA_DIR) + "/" + name;
  if (std::filesystem::exists(path)) return path;
  MESSAGE("skipped: no ", path);
  return "";
}

}  // namespace selvedge::test
