// Reading and writing of little-endian numbers.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>

namespace selvedge {

/// Reads numbers one after the other. Precondition: the bytes suffice.
class ExrByteReader {
 public:
  explicit ExrByteReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  std::uint8_t byte() { return static_cast<std::uint8_t>(number<1>()); }
  std::uint32_t u32() { return static_cast<std::uint32_t>(number<4>()); }
  std::int32_t i32() { return std::bit_cast<std::int32_t>(u32()); }
  std::uint64_t u64() { return number<8>(); }
  float f32() { return std::bit_cast<float>(u32()); }

 private:
  template <std::size_t size>
  std::uint64_t number() {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < size; ++i) value |= std::uint64_t{bytes_[i]} << (8 * i);
    bytes_ = bytes_.subspan(size);
    return value;
  }
  std::span<const std::uint8_t> bytes_;
};

inline std::string exr_int32_bytes(std::initializer_list<std::int32_t> numbers) {
  std::string bytes;
  for (const std::int32_t number : numbers)
    for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(number >> shift);
  return bytes;
}

}  // namespace selvedge
