// Inputs that the repository does not hold, in ../shared/data beside it.
#pragma once

#include <doctest/doctest.h>

#include <filesystem>
#include <string>

namespace selvedge::test {

inline unsigned skipped_cases = 0;

/// Reports the test case as skipped; the case returns after the call.
inline void skip(const std::string& why) {
  MESSAGE("skipped: ", why);
  ++skipped_cases;
}

/// The path of a file or a folder of the shared data. Without it the path is empty and the case is skipped:
/// it returns.
inline std::string shared_data(const std::string& name) {
  const std::string path = std::string(SELVEDGE_DATA_DIR) + "/" + name;
  if (std::filesystem::exists(path)) return path;
  skip("no " + path);
  return "";
}

}  // namespace selvedge::test
