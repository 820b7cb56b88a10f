// Atomic output files: written under a temporary name in the same folder, then renamed.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "format/base/error.h"

namespace selvedge {

/// A file being written. create() makes the temporary file, so that an unwritable folder is found before the
/// work begins. The destructor, SIGINT and SIGTERM remove it unless it was committed.
class AtomicFile {
 public:
  /// Refuses folders, devices, pipes, and links to no file. If `path` is a link, the file that it points to
  /// is replaced. What replaces a file gets its permissions, by commit().
  static Result<AtomicFile> create(const std::string& path);
  AtomicFile(AtomicFile&&) noexcept = default;
  AtomicFile& operator=(AtomicFile&&) noexcept = default;

  const std::string& path() const { return path_; }
  /// The temporary file, in the same folder as path(). Not after commit().
  const std::string& temporary_path() const;
  /// Renames the temporary file to path(), replacing an existing file.
  Result<void> commit();

 private:
  struct Unfinished;
  AtomicFile(std::string path, std::shared_ptr<Unfinished> unfinished)
      : path_(std::move(path)), unfinished_(std::move(unfinished)) {}

  std::string path_;
  std::shared_ptr<Unfinished> unfinished_;
};

/// Renames one after the other; where one cannot be, those behind it are removed.
Result<void> commit_all(std::vector<AtomicFile> files);

/// Writes all bytes to a temporary file, for commit().
Result<AtomicFile> stage_file(const std::string& path, std::span<const std::uint8_t> bytes);

/// Writes all bytes as one file, atomically.
Result<void> write_file(const std::string& path, std::span<const std::uint8_t> bytes);
Result<void> write_file(const std::string& path, const std::string& text);

/// Reads a whole file of at most `limit` bytes. Errors of opening as of InputFile.
Result<std::string> read_file(const std::string& path, std::uintmax_t limit = std::uintmax_t{1} << 32);

/// Installs handlers for SIGINT, SIGTERM and SIGHUP that remove the temporary files of this process and then
/// raise the signal again, so that the shell sees it. To be called once at the start of a program.
void remove_unfinished_files_on_signal();

}  // namespace selvedge
