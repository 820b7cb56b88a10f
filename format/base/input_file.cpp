#include "format/base/input_file.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <mutex>

namespace selvedge {

struct InputFile::Stream {
  std::ifstream stream;
  std::mutex alone;
};

Result<InputFile> InputFile::open(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code reason;
  // Before it is opened: opening a pipe without a writer would wait for ever.
  const fs::file_status status = fs::status(path, reason);
  if (status.type() == fs::file_type::not_found) return fail(Code::file_missing, path, {}, "no such file");
  if (status.type() == fs::file_type::none) return fail(Code::file_unreadable, path, {}, reason.message());
  if (fs::is_directory(status)) return fail(Code::file_unreadable, path, {}, "is a folder");
  if (!fs::is_regular_file(status)) return fail(Code::file_unreadable, path, {}, "is not a plain file");
  auto file = std::make_shared<Stream>();
  file->stream.open(path, std::ios::binary);
  if (!file->stream) return fail(Code::file_unreadable, path, {}, std::strerror(errno));
  file->stream.seekg(0, std::ios::end);
  const std::streamoff size = file->stream.tellg();
  if (size < 0) return fail(Code::file_unreadable, path, {}, std::strerror(errno));
  return InputFile(std::move(file), static_cast<std::uint64_t>(size));
}

bool InputFile::read(std::uint64_t offset, std::span<std::uint8_t> out) const {
  if (offset > size_ || out.size() > size_ - offset) return false;
  if (!file_) {
    std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(offset), out.size(), out.begin());
    return true;
  }
  const std::lock_guard lock(file_->alone);
  file_->stream.clear();
  file_->stream.seekg(static_cast<std::streamoff>(offset));
  // Fails where the file has become shorter since it was opened.
  return !!file_->stream.read(reinterpret_cast<char*>(out.data()), static_cast<std::streamsize>(out.size()));
}

}  // namespace selvedge
