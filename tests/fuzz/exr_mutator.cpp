// Mutations of fabric and samples files that stay OpenEXR files: attributes (the JSON text by its structure),
// chunks as they are packed or as pixels, names, places. All offsets and sizes are made true, and so are the
// digests of a fabric: what is behind those checks is reached without a reader that leaves them out.
#include <Imath/half.h>

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>

#include "format/base/digest.h"
#include "format/fabric/fabric.h"
#include "format/fabric/names.h"
#include "tests/fuzz/exr_container.h"
#include "tests/fuzz/mutate.h"
#include "tests/fuzz/target.h"

using namespace selvedge;
using namespace selvedge::fuzz;

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace {

using Json = nlohmann::json;

/// Bytes of one row of a chunk.
std::size_t row_size(const ExrPart& part, int width) {
  std::size_t size = 0;
  for (const ExrChannel& channel : part.channels)
    size += (channel.half ? 2U : 4U) * static_cast<std::size_t>(width);
  return size;
}

char compression_of(const ExrHeader& header) {
  const std::string* compression = header.find("compression");
  return compression == nullptr || compression->empty() ? '\0' : compression->front();
}

/// Width and height of the pixels in a chunk, as long as it is rows or the only tile of its level.
std::optional<std::pair<int, int>> extent_of(const ExrFile& file, const ExrChunk& chunk,
                                             const ExrPart& part) {
  constexpr int largest = 64;
  if (part.width < 1 || part.height < 1 || part.width > 4096) return std::nullopt;
  const bool zip = compression_of(file.headers[chunk.part]) == 3;
  if (!part.mipmapped)
    return std::pair(part.width, zip ? std::clamp(part.height - chunk.place[1], 1, 16) : 1);
  const int level = chunk.place[3];
  if (part.width > largest || part.height > largest || level < 0 || level > 16) return std::nullopt;
  return std::pair(level_size(part.width, level), level_size(part.height, level));
}

std::optional<std::string> pixels_of(const ExrFile& file, const ExrChunk& chunk, const ExrPart& part) {
  const auto extent = extent_of(file, chunk, part);
  if (!extent) return std::nullopt;
  return unpack(chunk.data, compression_of(file.headers[chunk.part]),
                row_size(part, extent->first) * static_cast<std::size_t>(extent->second));
}

void mutate_chunk(ExrFile& file, Choice& choice) {
  if (file.chunks.empty()) return;
  const std::size_t index = choice.below(file.chunks.size());
  ExrChunk& chunk = file.chunks[index];
  const auto part = part_of(file.headers[chunk.part]);
  switch (choice.below(8)) {
    case 0: {
      std::int32_t& word = chunk.place[choice.below(chunk.place.size())];
      word = choice.one_in(2) ? word + 1 : static_cast<std::int32_t>(choice.below(8)) - 1;
      return;
    }
    case 1:
      if (choice.one_in(2)) {
        const ExrChunk copy = chunk;
        file.chunks.insert(file.chunks.begin() + static_cast<std::ptrdiff_t>(index), copy);
      } else {
        file.chunks.erase(file.chunks.begin() + static_cast<std::ptrdiff_t>(index));
      }
      return;
    case 2:
      std::swap(chunk.data, file.chunks[choice.below(file.chunks.size())].data);
      return;
    case 3:
      chunk.data = mutate_bytes(chunk.data, 16);
      return;
    default:
      if (!part) return;
      if (auto pixels = pixels_of(file, chunk, *part)) {
        const std::size_t size = pixels->size();
        *pixels = mutate_bytes(std::move(*pixels), 0);
        pixels->resize(size, '\0');
        chunk.data = pack(*pixels, compression_of(file.headers[chunk.part]));
      }
  }
}

void mutate_attributes(ExrFile& file, Choice& choice) {
  ExrHeader& header = file.headers[choice.below(file.headers.size())];
  if (header.attributes.empty()) return;
  const std::size_t index = choice.below(header.attributes.size());
  ExrAttribute& attribute = header.attributes[index];
  switch (choice.below(10)) {
    case 0: {
      const ExrHeader& other = file.headers[choice.below(file.headers.size())];
      if (other.attributes.empty()) return;
      const ExrAttribute copy = other.attributes[choice.below(other.attributes.size())];
      header.attributes.push_back(copy);
      return;
    }
    case 1:
      header.attributes.erase(header.attributes.begin() + static_cast<std::ptrdiff_t>(index));
      return;
    case 2:
      (choice.one_in(2) ? attribute.name : attribute.type) = mutate_bytes(attribute.name, 2);
      return;
    default:
      attribute.value = mutate_bytes(attribute.value, choice.one_in(2) ? 0 : 8);
  }
}

/// The text that makes the file a fabric or samples; null if absent.
std::string* text_of(ExrFile& file) {
  for (const char* name : {names::attribute_fabric, names::attribute_samples}) {
    if (std::string* text = file.headers.front().find(name)) return text;
  }
  return nullptr;
}

std::string pixel_digest(const ExrFile& file, std::size_t part_index, int level) {
  const auto part = part_of(file.headers[part_index]);
  if (!part) return {};
  for (const ExrChunk& chunk : file.chunks) {
    if (chunk.part != part_index || chunk.place.size() < 5 || chunk.place[chunk.place.size() - 2] != level) {
      continue;
    }
    const auto bytes = pixels_of(file, chunk, *part);
    const auto extent = extent_of(file, chunk, *part);
    if (!bytes || !extent) return {};
    ExrPixels pixels{extent->first, extent->second, std::vector<std::vector<float>>(part->channels.size())};
    const char* at = bytes->data();
    for (int y = 0; y < extent->second; ++y) {
      for (std::size_t c = 0; c < part->channels.size(); ++c) {
        for (int x = 0; x < extent->first; ++x) {
          float value = 0;
          if (part->channels[c].half) {
            std::uint16_t bits = 0;
            std::memcpy(&bits, at, 2);
            at += 2;
            value = Imath::half(Imath::half::FromBits, bits);
          } else {
            std::memcpy(&value, at, 4);
            at += 4;
          }
          pixels.planes[c].push_back(value);
        }
      }
    }
    return digest_of(*part, pixels);
  }
  return {};
}

/// Computes the digests of the listed levels from their pixels.
void seal_pixels(const ExrFile& file, Json& text) {
  if (!text.contains("layers") || !text.contains("digests") || !text["digests"].is_object()) return;
  for (std::size_t p = 0; p < file.headers.size(); ++p) {
    const std::string* name = file.headers[p].find("name");
    if (name == nullptr || !text["layers"].contains(*name) || !text["digests"].contains(*name)) continue;
    const Json levels = text["layers"][*name].value("levels", Json::array());
    Json& digests = text["digests"][*name];
    if (!digests.is_array() || !levels.is_array()) continue;
    for (std::size_t i = 0; i < digests.size() && i < levels.size(); ++i) {
      if (!levels[i].is_number_integer()) continue;
      const std::string digest = pixel_digest(file, p, levels[i].get<int>());
      if (!digest.empty()) digests[i] = digest;
    }
  }
}

/// spec/fabric.md: the digest over the text and all part and channel names.
std::string header_digest(const ExrFile& file, const std::string& text) {
  std::string all = text;
  for (const ExrHeader& header : file.headers) {
    const auto part = part_of(header);
    if (!part) return {};
    all += '\n' + part->name;
    std::vector<std::string> channels;
    for (const ExrChannel& c : part->channels) channels.push_back(c.name + (c.half ? " half" : " float"));
    std::sort(channels.begin(), channels.end());
    for (const std::string& channel : channels) all += '\n' + channel;
  }
  return digest_of(all);
}

void seal(ExrFile& file) {
  std::string* text = file.headers.front().find(names::attribute_fabric);
  std::string* digest = file.headers.front().find(names::attribute_digest);
  if (text == nullptr || digest == nullptr) return;
  Json json = Json::parse(*text, nullptr, false);
  if (json.is_object()) {
    try {
      seal_pixels(file, json);
      *text = json.dump();
    } catch (const Json::exception&) {
      // Of some other shape: as it is.
    }
  }
  *digest = header_digest(file, *text);
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned seed) {
  Choice choice(seed);
  if (choice.one_in(6)) return LLVMFuzzerMutate(data, size, max_size);
  auto file = take_apart({reinterpret_cast<const char*>(data), size});
  if (!file || file->headers.empty()) return LLVMFuzzerMutate(data, size, max_size);
  const std::size_t way = choice.below(8);
  if (std::string* text = text_of(*file); text != nullptr && way < 4) {
    *text = mutate_json(*text, choice);
  } else if (way < 6) {
    mutate_chunk(*file, choice);
  } else {
    mutate_attributes(*file, choice);
  }
  if (!choice.one_in(8)) seal(*file);
  return give(put_together(*file), data, size, max_size);
}
