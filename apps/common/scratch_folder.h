// A folder for files of one run, of its user alone.
#pragma once

#include <string>

#include "format/base/error.h"

namespace selvedge {

/// A new folder among the system's temporary files. The destructor removes it; the next run that makes one
/// removes what killed runs of the same user left, which it knows by their locks.
class ScratchFolder {
 public:
  /// FILE_UNWRITABLE. `prefix` begins its name.
  static Result<ScratchFolder> create(const std::string& prefix);
  ScratchFolder(ScratchFolder&& other) noexcept;
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  ~ScratchFolder();

  const std::string& path() const { return path_; }

 private:
  ScratchFolder(std::string path, int lock) : path_(std::move(path)), lock_(lock) {}

  std::string path_;
  int lock_;  ///< descriptor of the folder, locked
};

}  // namespace selvedge
