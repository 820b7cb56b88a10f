// Files by the host, in place of format/base's input_file.cpp, atomic_file.cpp and parallel.cpp, and of zlib.
#include <zlib.h>

#include <cstring>
#include <filesystem>

#include "format/base/atomic_file.h"
#include "format/base/input_file.h"
#include "format/base/parallel.h"
#include "format/web/host.h"

namespace selvedge {

struct InputFile::Stream {
  std::string path;
};

Result<InputFile> InputFile::open(const std::string& path) {
  const double size = host_size(path.data(), path.size());
  if (size == host_missing) return fail(Code::file_missing, path, {}, "no such file");
  if (size == host_folder) return fail(Code::file_unreadable, path, {}, "is a folder");
  if (size < 0) return fail(Code::file_unreadable, path, {}, "is not a plain file");
  if (!host_read(path.data(), path.size(), 0, nullptr, 0))
    return fail(Code::file_unreadable, path, {}, std::strerror(EACCES));
  return InputFile(std::make_shared<Stream>(Stream{path}), static_cast<std::uint64_t>(size));
}

bool InputFile::read(std::uint64_t offset, std::span<std::uint8_t> out) const {
  if (offset > size_ || out.size() > size_ - offset) return false;
  if (file_)
    return host_read(file_->path.data(), file_->path.size(), static_cast<double>(offset), out.data(),
                     out.size());
  std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(offset), out.size(), out.begin());
  return true;
}

Result<AtomicFile> AtomicFile::create(const std::string& path) {
  if (path.empty()) return fail(Code::file_unwritable, path, {}, "the output has no name");
  const double size = host_size(path.data(), path.size());
  if (size == host_folder) return fail(Code::file_unwritable, path, {}, "is a folder");
  if (size < 0 && size != host_missing)
    return fail(Code::file_unwritable, path, {}, "is a device or a pipe, not a plain file");
  const bool is_temporary = path.starts_with(std::filesystem::temp_directory_path().native());
  if (const int reason = is_temporary ? 0 : host_refusal(path.data(), path.size()); reason != 0)
    return fail(Code::file_unwritable, path, {}, std::strerror(reason));
  return AtomicFile(path, nullptr);
}

Result<void> AtomicFile::commit() {
  host_commit(path_.data(), path_.size());
  return {};
}

Result<AtomicFile> stage_file(const std::string& path, std::span<const std::uint8_t> bytes) {
  auto file = AtomicFile::create(path);
  if (file) host_stage(path.data(), path.size(), bytes.data(), bytes.size());
  return file;
}

void remove_unfinished_files_on_signal() {}

void set_thread_limit(int) {}
int thread_count() { return 1; }
void parallel_for(int begin, int end, const std::function<void(int)>& body) {
  for (int i = begin; i < end; ++i) body(i);
}

}  // namespace selvedge

extern "C" {
int uncompress(Bytef* out, uLongf* room, const Bytef* bytes, uLong count) {
  const int unpacked = selvedge::host_pack(-1, bytes, count, out, *room);
  *room = unpacked < 0 ? 0 : unpacked;
  return unpacked < 0 ? Z_DATA_ERROR : Z_OK;
}
uLong compressBound(uLong count) { return count + (count >> 12) + (count >> 14) + (count >> 25) + 13; }
int compress2(Bytef* out, uLongf* room, const Bytef* bytes, uLong count, int level) {
  const int packed = selvedge::host_pack(level, bytes, count, out, *room);
  *room = packed < 0 ? 0 : packed;
  return packed < 0 ? Z_BUF_ERROR : Z_OK;
}
/// Streams that are one call of deflate() long.
int deflateInit_(z_stream* stream, int level, const char*, int) {
  stream->reserved = level;
  return Z_OK;
}
int deflateReset(z_stream*) { return Z_OK; }
int deflateEnd(z_stream*) { return Z_OK; }
uLong deflateBound(z_stream*, uLong count) { return compressBound(count); }
int deflate(z_stream* stream, int) {
  stream->total_out = stream->avail_out;
  compress2(stream->next_out, &stream->total_out, stream->next_in, stream->avail_in,
            static_cast<int>(stream->reserved));
  return Z_STREAM_END;
}
uLong crc32(uLong sum, const Bytef* bytes, uInt count) {
  sum = ~sum & 0xFFFFFFFF;
  for (uInt i = 0; i < count; ++i) {
    sum ^= bytes[i];
    for (int bit = 0; bit < 8; ++bit) sum = sum >> 1 ^ (sum & 1 ? 0xEDB88320 : 0);
  }
  return ~sum & 0xFFFFFFFF;
}
}
