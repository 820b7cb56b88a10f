// Random-access input: plain files on disk, or bytes in memory.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "format/base/error.h"

namespace selvedge {

class InputFile {
 public:
  /// FILE_MISSING, or FILE_UNREADABLE for a folder, a device or a pipe; never waits for a pipe's writer.
  static Result<InputFile> open(const std::string& path);
  /// From memory. The bytes must outlive the file.
  explicit InputFile(std::span<const std::uint8_t> bytes) : bytes_(bytes), size_(bytes.size()) {}

  std::uint64_t size() const { return size_; }
  /// Fills `out` with the bytes from `offset` on; false if the file ends before, or cannot be read.
  bool read(std::uint64_t offset, std::span<std::uint8_t> out) const;

 private:
  struct Stream;
  InputFile(std::shared_ptr<Stream> file, std::uint64_t size) : file_(std::move(file)), size_(size) {}

  std::shared_ptr<Stream> file_;  ///< null: from memory
  std::span<const std::uint8_t> bytes_;
  std::uint64_t size_ = 0;
};

}  // namespace selvedge
