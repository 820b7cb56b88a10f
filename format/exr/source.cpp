#include "format/exr/source.h"

#include <algorithm>
#include <iterator>

namespace selvedge {

Result<ExrSource> ExrSource::open(const std::string& path) {
  Result<InputFile> file = InputFile::open(path);
  if (!file) return tl::unexpected<Error>(std::move(file.error()));
  return ExrSource(std::move(*file));
}

void ExrSource::count(std::uint64_t begin, std::uint64_t end) {
  auto next = seen_.upper_bound(begin);
  // Those that touch it become one with it.
  if (next != seen_.begin() && std::prev(next)->second >= begin) --next;
  std::uint64_t from = begin;
  std::uint64_t to = end;
  std::uint64_t known = 0;
  while (next != seen_.end() && next->first <= end) {
    from = std::min(from, next->first);
    to = std::max(to, next->second);
    known += next->second - next->first;
    next = seen_.erase(next);
  }
  seen_.emplace(from, to);
  bytes_read_ += to - from - known;
}

bool ExrSource::read(std::uint64_t offset, std::span<std::uint8_t> out) {
  if (offset > size() || out.size() > size() - offset) return false;
  if (!out.empty()) count(offset, offset + out.size());
  if (file_) return file_->read(offset, out);
  std::copy_n(bytes_.data() + offset, out.size(), out.data());
  return true;
}

}  // namespace selvedge
