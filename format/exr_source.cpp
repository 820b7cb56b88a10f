#include "format/exr_source.h"

#include <algorithm>

namespace selvedge {

Result<ExrSource> ExrSource::open(const std::string& path) {
  Result<InputFile> file = InputFile::open(path);
  if (!file) return tl::unexpected<Error>(std::move(file.error()));
  return ExrSource(std::move(*file));
}

bool ExrSource::read(std::uint64_t offset, std::span<std::uint8_t> out) {
  if (offset > size() || out.size() > size() - offset) return false;
  bytes_read_ += out.size();
  if (file_) return file_->read(offset, out);
  std::copy_n(bytes_.data() + offset, out.size(), out.data());
  return true;
}

}  // namespace selvedge
