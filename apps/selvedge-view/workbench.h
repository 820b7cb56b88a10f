// A folder of temporary files.
#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <string>

#include "format/base/guard.h"

namespace selvedge {

/// A folder of temporary files, which the destructor removes. Throws Failure.
class TemporaryFolder {
 public:
  TemporaryFolder() : folder_((std::filesystem::temp_directory_path() / "selvedge-view-XXXXXX").string()) {
    if (mkdtemp(folder_.data()) == nullptr)
      throw Failure{{Code::file_unwritable, folder_, "", "cannot be made"}};
  }
  TemporaryFolder& operator=(TemporaryFolder&&) = delete;
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  std::string next_path(const char* ending) { return fmt::format("{}/{}{}", folder_, ++count_, ending); }

 private:
  std::string folder_;
  int count_ = 0;
};

}  // namespace selvedge
