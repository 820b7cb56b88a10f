#include "format/gltf/draco_header.h"

#include <cstddef>
#include <string_view>

namespace selvedge {
namespace {

constexpr std::uint64_t mesh_geometry = 1;
constexpr std::uint64_t has_metadata = 0x8000;
constexpr int deepest_metadata = 64;

/// Reads forward; after the end everything is 0 and `good` is false.
class Cursor {
 public:
  explicit Cursor(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  bool good = true;

  std::uint64_t fixed(std::size_t size) {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < size; ++i) value |= std::uint64_t{byte()} << (8 * i);
    return value;
  }

  /// Seven bits a byte, lowest first.
  std::uint64_t varint() {
    std::uint64_t value = 0;
    for (unsigned shift = 0; shift < 64; shift += 7) {
      const std::uint8_t next = byte();
      value |= std::uint64_t{next & 0x7FU} << shift;
      if ((next & 0x80U) == 0) return value;
    }
    good = false;
    return 0;
  }

  void skip(std::uint64_t size) {
    good = good && size <= bytes_.size() - at_;
    if (good) at_ += static_cast<std::size_t>(size);
  }

 private:
  std::uint8_t byte() {
    good = good && at_ < bytes_.size();
    return good ? bytes_[at_++] : std::uint8_t{0};
  }

  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

void skip_metadata(Cursor& cursor, int depth) {
  if (depth > deepest_metadata) cursor.good = false;
  const std::uint64_t entries = cursor.varint();
  for (std::uint64_t i = 0; cursor.good && i < entries; ++i) {
    cursor.skip(cursor.fixed(1));
    cursor.skip(cursor.varint());
  }
  const std::uint64_t children = cursor.varint();
  for (std::uint64_t i = 0; cursor.good && i < children; ++i) {
    cursor.skip(cursor.fixed(1));
    skip_metadata(cursor, depth + 1);
  }
}

}  // namespace

std::optional<DracoCounts> draco_counts(std::span<const std::uint8_t> bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (!text.starts_with("DRACO")) return std::nullopt;
  Cursor cursor(bytes.subspan(5));
  const std::uint64_t major = cursor.fixed(1);
  const std::uint64_t version = major * 256 + cursor.fixed(1);
  const std::uint64_t geometry = cursor.fixed(1);
  const std::uint64_t method = cursor.fixed(1);
  const std::uint64_t flags = cursor.fixed(2);
  if (geometry != mesh_geometry || method > 1) return std::nullopt;
  if (version >= 0x103 && (flags & has_metadata) != 0) {
    const std::uint64_t attributes = cursor.varint();
    for (std::uint64_t i = 0; cursor.good && i < attributes; ++i) {
      cursor.varint();
      skip_metadata(cursor, 0);
    }
    skip_metadata(cursor, 0);
  }
  const bool edgebreaker = method == 1;
  const bool packed = version >= (edgebreaker ? 0x200U : 0x202U);
  const auto count = [&] { return packed ? cursor.varint() : cursor.fixed(4); };
  DracoCounts counts;
  if (edgebreaker) {
    cursor.fixed(1);                     // how it is traversed
    if (version < 0x202) (void)count();  // vertices that splits add
    counts.points = count();
    counts.faces = count();
  } else {
    counts.faces = count();
    counts.points = count();
  }
  if (!cursor.good) return std::nullopt;
  return counts;
}

}  // namespace selvedge
