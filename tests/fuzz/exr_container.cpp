#include "tests/fuzz/exr_container.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstring>

namespace selvedge::fuzz {
namespace {

constexpr std::uint32_t magic = 20000630;

class Input {
 public:
  explicit Input(const std::string& bytes) : bytes_(bytes) {}

  template <class T>
  T number() {
    T value{};
    const std::string raw = take(sizeof value);
    if (good) std::memcpy(&value, raw.data(), sizeof value);
    return value;
  }
  std::string take(std::size_t count) {
    if (count > bytes_.size() - at) {
      good = false;
      return {};
    }
    at += count;
    return bytes_.substr(at - count, count);
  }
  std::string text() {
    const std::size_t end = bytes_.find('\0', at);
    if (end == std::string::npos) {
      good = false;
      return {};
    }
    std::string value = bytes_.substr(at, end - at);
    at = end + 1;
    return value;
  }

  std::size_t at = 0;
  bool good = true;

 private:
  const std::string& bytes_;
};

template <class T>
void append(std::string& out, T value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

ExrHeader header_from(Input& in) {
  ExrHeader header;
  while (in.good) {
    ExrAttribute attribute;
    attribute.name = in.text();
    if (attribute.name.empty()) break;
    attribute.type = in.text();
    attribute.value = in.take(in.number<std::uint32_t>());
    header.attributes.push_back(std::move(attribute));
  }
  return header;
}

bool is_tiled(const ExrHeader& header) { return header.find("tiles") != nullptr; }

std::optional<ExrChunk> chunk_at(const std::string& bytes, std::uint64_t offset, bool tiled) {
  Input in(bytes);
  if (offset > bytes.size()) return std::nullopt;
  in.at = offset;
  ExrChunk chunk;
  const int words = tiled ? 5 : 2;
  for (int i = 0; i < words; ++i) chunk.place.push_back(in.number<std::int32_t>());
  chunk.data = in.take(in.number<std::uint32_t>());
  if (!in.good) return std::nullopt;
  return chunk;
}

}  // namespace

const std::string* ExrHeader::find(const std::string& name) const {
  const auto found = std::find_if(attributes.begin(), attributes.end(),
                                  [&](const ExrAttribute& a) { return a.name == name; });
  return found == attributes.end() ? nullptr : &found->value;
}

std::string* ExrHeader::find(const std::string& name) {
  return const_cast<std::string*>(static_cast<const ExrHeader*>(this)->find(name));
}

std::optional<ExrFile> take_apart(const std::string& bytes) {
  Input in(bytes);
  ExrFile file;
  if (in.number<std::uint32_t>() != magic) return std::nullopt;
  file.version = in.number<std::uint32_t>();
  for (;;) {
    ExrHeader header = header_from(in);
    if (!in.good) return std::nullopt;
    if (header.attributes.empty()) break;
    file.headers.push_back(std::move(header));
  }

  for (std::size_t p = 0; p < file.headers.size(); ++p) {
    const std::string* count = file.headers[p].find("chunkCount");
    if (count == nullptr || count->size() != 4) return std::nullopt;
    std::uint32_t chunks = 0;
    std::memcpy(&chunks, count->data(), 4);
    if (chunks > (bytes.size() - in.at) / 8) return std::nullopt;
    for (std::uint32_t i = 0; i < chunks; ++i) {
      auto chunk = chunk_at(bytes, in.number<std::uint64_t>(), is_tiled(file.headers[p]));
      if (!chunk) return std::nullopt;
      chunk->part = p;
      file.chunks.push_back(std::move(*chunk));
    }
  }
  if (!in.good) return std::nullopt;
  return file;
}

std::string put_together(const ExrFile& file) {
  std::string out;
  append(out, magic);
  append(out, file.version);
  for (const ExrHeader& header : file.headers) {
    for (const ExrAttribute& a : header.attributes) {
      out.append(a.name.c_str(), a.name.size() + 1);
      out.append(a.type.c_str(), a.type.size() + 1);
      append(out, static_cast<std::uint32_t>(a.value.size()));
      out += a.value;
    }
    out += '\0';
  }
  out += '\0';
  std::uint64_t offset = out.size() + 8 * file.chunks.size();
  for (const ExrChunk& chunk : file.chunks) {
    append(out, offset);
    offset += 4 * chunk.place.size() + 4 + chunk.data.size();
  }
  for (const ExrChunk& chunk : file.chunks) {
    for (const std::int32_t word : chunk.place) append(out, word);
    append(out, static_cast<std::uint32_t>(chunk.data.size()));
    out += chunk.data;
  }
  return out;
}

std::optional<ExrPart> part_of(const ExrHeader& header) {
  const std::string* window = header.find("dataWindow");
  const std::string* channels = header.find("channels");
  if (window == nullptr || window->size() != 16 || channels == nullptr) return std::nullopt;
  ExrPart part;
  if (const std::string* name = header.find("name")) part.name = *name;
  std::array<std::int32_t, 4> box{};
  std::memcpy(box.data(), window->data(), 16);
  part.width = static_cast<int>(std::int64_t{box[2]} - box[0] + 1);
  part.height = static_cast<int>(std::int64_t{box[3]} - box[1] + 1);
  part.mipmapped = is_tiled(header);
  Input in(*channels);
  for (std::string name = in.text(); in.good && !name.empty(); name = in.text()) {
    const auto type = in.number<std::int32_t>();
    in.take(12);
    part.channels.push_back({name, type == 1});
  }
  if (!in.good) return std::nullopt;
  return part;
}

std::optional<std::string> unpack(const std::string& packed, char compression, std::size_t size) {
  if (packed.size() == size) return packed;  // stored as it is, where packing gains nothing
  if (compression != 3) return std::nullopt;
  std::string bytes(size, '\0');
  uLongf length = static_cast<uLongf>(size);
  if (uncompress(reinterpret_cast<Bytef*>(bytes.data()), &length,
                 reinterpret_cast<const Bytef*>(packed.data()), static_cast<uLong>(packed.size())) != Z_OK ||
      length != size) {
    return std::nullopt;
  }
  // Differences to the byte before, off by 128; then the first half of the bytes are the even ones.
  for (std::size_t i = 1; i < size; ++i) bytes[i] = static_cast<char>(bytes[i - 1] + bytes[i] - 128);
  std::string pixels(size, '\0');
  for (std::size_t i = 0; i < size; ++i) pixels[i] = bytes[i % 2 == 0 ? i / 2 : (size + 1) / 2 + i / 2];
  return pixels;
}

std::string pack(const std::string& pixels, char compression) {
  if (compression != 3) return pixels;
  const std::size_t size = pixels.size();
  std::string bytes(size, '\0');
  for (std::size_t i = 0; i < size; ++i) bytes[i % 2 == 0 ? i / 2 : (size + 1) / 2 + i / 2] = pixels[i];
  for (std::size_t i = size; i-- > 1;) bytes[i] = static_cast<char>(bytes[i] - bytes[i - 1] + 128);
  uLongf length = compressBound(static_cast<uLong>(size));
  std::string packed(length, '\0');
  compress(reinterpret_cast<Bytef*>(packed.data()), &length, reinterpret_cast<const Bytef*>(bytes.data()),
           static_cast<uLong>(size));
  packed.resize(length);
  return packed.size() < size ? packed : pixels;
}

}  // namespace selvedge::fuzz
