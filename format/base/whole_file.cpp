// Whole files, by input_file.h and atomic_file.h.
#include <fmt/format.h>

#include <cerrno>
#include <cstring>

#include "format/base/atomic_file.h"
#include "format/base/input_file.h"

namespace selvedge {

Result<void> commit_all(std::vector<AtomicFile> files) {
  for (AtomicFile& file : files)
    if (auto good = file.commit(); !good) return good;
  return {};
}

Result<void> write_file(const std::string& path, std::span<const std::uint8_t> bytes) {
  auto file = stage_file(path, bytes);
  if (!file) return tl::unexpected(file.error());
  return file->commit();
}

Result<void> write_file(const std::string& path, const std::string& text) {
  return write_file(path, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

Result<std::string> read_file(const std::string& path, std::uintmax_t limit) {
  const Result<InputFile> file = InputFile::open(path);
  if (!file) return tl::unexpected(file.error());
  if (file->size() > limit)
    return fail(Code::file_too_large, path, {}, fmt::format("larger than {} bytes", limit));
  std::string text(file->size(), '\0');
  if (!file->read(0, {reinterpret_cast<std::uint8_t*>(text.data()), text.size()}))
    return fail(Code::file_unreadable, path, {}, std::strerror(errno));
  return text;
}

}  // namespace selvedge
