// Every way to harm a file that the tests try.
#pragma once

#include <cstdint>
#include <cstring>
#include <span>
#include <string>

namespace selvedge::test {

inline std::span<const std::uint8_t> as_bytes(const std::string& bytes) {
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
}

/// Calls use(damaged, at) for the bytes [first, last) of the file, one after the other: each of the byte's
/// bits flipped, the byte 0x00 and 0xFF.
template <class Use>
void damage_each_byte(const std::string& bytes, std::size_t first, std::size_t last, const Use& use) {
  std::string damaged = bytes;
  for (std::size_t at = first; at < last; ++at) {
    const char good = bytes[at];
    for (int way = 0; way < 10; ++way) {
      const char bad =
          way < 8 ? static_cast<char>(good ^ 1 << way) : static_cast<char>(way == 8 ? 0x00 : 0xFF);
      if (bad == good) continue;
      damaged[at] = bad;
      use(damaged, at);
    }
    damaged[at] = good;
  }
}

/// Where the value of an EXR attribute begins: after its name, its type and its size. `from` skips earlier
/// headers. The attribute must be there.
inline std::size_t exr_value_at(const std::string& bytes, const std::string& name, const std::string& type,
                                std::size_t from = 0) {
  const std::string start = name + '\0' + type + '\0';
  return bytes.find(start, from) + start.size() + 4;
}

template <class T>
void put(std::string& bytes, std::size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

template <class T>
T get(const std::string& bytes, std::size_t at) {
  T value{};
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

}  // namespace selvedge::test
