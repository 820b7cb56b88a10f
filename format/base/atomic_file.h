// Output files that are either whole or not there: written beside their final place, then renamed.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "format/base/error.h"

namespace selvedge {

/// A file being written. The temporary file is made at once (so that an unwritable folder is found before
/// the work begins) and is removed by the destructor, by SIGINT and by SIGTERM, unless committed. Leftovers
/// of a killed process are removed by the next one that makes the same file.
class AtomicFile {
 public:
  /// Refuses folders, devices and pipes. Where `path` is a link, the file that it points to is replaced.
  static Result<AtomicFile> create(const std::string& path);
  AtomicFile(AtomicFile&&) noexcept;
  AtomicFile& operator=(AtomicFile&&) noexcept;
  ~AtomicFile();

  const std::string& path() const { return path_; }
  /// Where to write; in the same folder as path(). Not after commit().
  const std::string& temporary() const;
  /// The same file, open to read and write, with an exclusive lock (flock) that says that it is being
  /// written.
  int descriptor() const;
  /// Moves the temporary file to its final place, replacing what was there.
  Result<void> commit();

 private:
  struct Unfinished;
  AtomicFile(std::string path, std::unique_ptr<Unfinished> unfinished);

  std::string path_;
  std::unique_ptr<Unfinished> unfinished_;
};

/// Writes all bytes as one file, atomically.
Result<void> write_file(const std::string& path, std::span<const std::uint8_t> bytes);
Result<void> write_file(const std::string& path, const std::string& text);

/// Reads a whole file of at most `limit` bytes. Errors of opening are those of InputFile.
Result<std::string> read_file(const std::string& path, std::uintmax_t limit = std::uintmax_t{1} << 32);

/// Removes the temporary files of this process when it is interrupted (SIGINT, SIGTERM, SIGHUP), then dies of
/// that signal, so that the shell sees it. To be called once at the start of a program.
void remove_unfinished_files_on_signal();

}  // namespace selvedge
