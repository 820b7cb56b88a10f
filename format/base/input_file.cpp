#include "format/base/input_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace selvedge {

Result<InputFile> InputFile::open(const std::string& path) {
  // Non-blocking: opening a pipe without a writer would wait for ever.
  const int number = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  if (number < 0) {
    const int reason = errno;
    if (reason == ENOENT || reason == ENOTDIR) return fail(Code::file_missing, path, {}, "no such file");
    return fail(Code::file_unreadable, path, {}, std::strerror(reason));
  }
  const std::shared_ptr<const int> descriptor(new int(number), [](const int* open) {
    ::close(*open);
    delete open;
  });
  struct stat status {};
  if (::fstat(number, &status) != 0) return fail(Code::file_unreadable, path, {}, std::strerror(errno));
  if (S_ISDIR(status.st_mode)) return fail(Code::file_unreadable, path, {}, "is a folder");
  if (!S_ISREG(status.st_mode)) return fail(Code::file_unreadable, path, {}, "is not a plain file");
  return InputFile(descriptor, static_cast<std::uint64_t>(status.st_size));
}

bool InputFile::read(std::uint64_t offset, std::span<std::uint8_t> out) const {
  if (offset > size_ || out.size() > size_ - offset) return false;
  if (!descriptor_) {
    std::copy_n(bytes_.begin() + offset, out.size(), out.begin());
    return true;
  }
  while (!out.empty()) {
    const ssize_t count = ::pread(*descriptor_, out.data(), out.size(), static_cast<off_t>(offset));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return false;  // an error, or the file has become shorter since it was opened
    offset += count;
    out = out.subspan(count);
  }
  return true;
}

}  // namespace selvedge
