// Small glTF files for tests.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>

#include "tests/format/files.h"

namespace selvedge::test {

/// A GLB file of a JSON text and a binary chunk.
inline std::string glb(std::string json, std::string binary) {
  json.resize((json.size() + 3) / 4 * 4, ' ');
  binary.resize((binary.size() + 3) / 4 * 4, '\0');
  const auto word = [](std::size_t value) {
    const auto number = static_cast<std::uint32_t>(value);
    std::string bytes(4, '\0');
    std::memcpy(bytes.data(), &number, 4);
    return bytes;
  };
  const std::size_t length = 12 + 8 + json.size() + (binary.empty() ? 0 : 8 + binary.size());
  std::string file = "glTF" + word(2) + word(length) + word(json.size()) + "JSON" + json;
  if (!binary.empty()) file += word(binary.size()) + std::string("BIN\0", 4) + binary;
  return file;
}

/// Bytes of numbers of type T.
template <class T>
std::string bytes_of(std::initializer_list<T> values) {
  std::string bytes(values.size() * sizeof(T), '\0');
  std::memcpy(bytes.data(), values.begin(), bytes.size());
  return bytes;
}

}  // namespace selvedge::test
