// Where the bytes of an EXR file come from: a file on disk or memory, read at any place and counted.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>

#include "format/base/error.h"
#include "format/base/input_file.h"

namespace selvedge {

class ExrSource {
 public:
  /// Errors are those of InputFile.
  static Result<ExrSource> open(const std::string& path);
  /// The bytes must outlive the source.
  explicit ExrSource(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  std::uint64_t size() const { return file_ ? file_->size() : bytes_.size(); }
  /// Fills `out` from `offset` on; false where the bytes are not there.
  bool read(std::uint64_t offset, std::span<std::uint8_t> out);
  /// Bytes asked for so far, each counted once.
  std::uint64_t bytes_read() const { return bytes_read_; }

 private:
  explicit ExrSource(InputFile file) : file_(std::move(file)) {}
  void count(std::uint64_t begin, std::uint64_t end);

  std::optional<InputFile> file_;  ///< none: from memory
  std::span<const std::uint8_t> bytes_;
  std::map<std::uint64_t, std::uint64_t> seen_;  ///< where stretches that were read begin and end; apart
  std::uint64_t bytes_read_ = 0;
};

}  // namespace selvedge
