// A folder of temporary files.
#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <string>

#include "format/base/guard.h"

namespace selvedge {

/// A folder of temporary files, which the destructor removes. Throws Failure.
class Workbench {
 public:
  Workbench() : folder_((std::filesystem::temp_directory_path() / "selvedge-view-XXXXXX").string()) {
    if (mkdtemp(folder_.data()) == nullptr)
      throw Failure{{Code::file_unwritable, folder_, "", "cannot be made"}};
  }
  Workbench& operator=(Workbench&&) = delete;
  ~Workbench() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  std::string next(const char* ending) { return fmt::format("{}/{}{}", folder_, ++count_, ending); }

 private:
  std::string folder_;
  int count_ = 0;
};

}  // namespace selvedge
