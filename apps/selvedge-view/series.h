// The files of a run of `render` that draws many pictures: their names by frame and variant.
#pragma once

#include <string>
#include <vector>

#include "format/base/atomic_file.h"

namespace selvedge {

/// One picture's part of the names.
struct SeriesPlace {
  std::string frame;    ///< for {frame}, four digits or "top"; empty: the only one
  int number = 0;       ///< for %d and %04d
  std::string variant;  ///< for {variant}, file_safe(); empty: the only one
};

/// A name with each character of the world but those that a file system, a shell or a URL takes for another
/// thing.
std::string file_safe(const std::string& name);
/// The same of all names, with numbers behind those that would be equal, whatever their case.
std::vector<std::string> file_safe(const std::vector<std::string>& names);

/// The file of a picture: {frame}, {variant} and %04d of the pattern are replaced; without a place for the
/// frame it follows the stem: "red.png" is "red-0001.png".
std::string series_path(const std::string& pattern, const SeriesPlace& place);

/// Temporary files, in folders that are made where they are missing, and removed unless the files are
/// committed.
class SeriesFiles {
 public:
  SeriesFiles() = default;
  SeriesFiles& operator=(SeriesFiles&&) = delete;
  ~SeriesFiles();
  /// Throws FILE_UNWRITABLE.
  const AtomicFile& add(const std::string& path);
  const AtomicFile& at(std::size_t number) const { return files_[number]; }
  Result<void> commit();

 private:
  std::vector<std::string> folders_;
  std::vector<AtomicFile> files_;
};

}  // namespace selvedge
