// Where the bytes of an EXR file come from: a file on disk or memory, read at any place and counted.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "format/error.h"

namespace selvedge {

class ExrSource {
 public:
  /// FILE_MISSING, or FILE_UNREADABLE where it is not a plain file: a pipe has no places to read at.
  static Result<ExrSource> open(const std::string& path);
  /// The bytes must outlive the source.
  explicit ExrSource(std::span<const std::uint8_t> bytes) : bytes_(bytes), size_(bytes.size()) {}

  std::uint64_t size() const { return size_; }
  /// Fills `out` from `offset` on; false where the bytes are not there.
  bool read(std::uint64_t offset, std::span<std::uint8_t> out);
  /// Bytes asked for so far.
  std::uint64_t bytes_read() const { return bytes_read_; }

 private:
  struct File {
    explicit File(int opened) : descriptor(opened) {}
    File(const File&) = delete;
    File& operator=(const File&) = delete;
    ~File();
    int descriptor;
  };
  ExrSource(std::unique_ptr<File> file, std::uint64_t size) : file_(std::move(file)), size_(size) {}

  std::unique_ptr<File> file_;  ///< null: from memory
  std::span<const std::uint8_t> bytes_;
  std::uint64_t size_ = 0;
  std::uint64_t bytes_read_ = 0;
};

}  // namespace selvedge
