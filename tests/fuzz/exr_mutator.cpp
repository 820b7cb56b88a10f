// Mutations of fabric and samples files that stay OpenEXR files: read by our reader, changed in the JSON text
// (by its structure), other texts, names, precisions, parts and pixels, and written by our writer with true
// digests. What is behind the container and the digests is reached without a reader that leaves them out;
// faults of the container itself are libFuzzer's, and the conformance kit's.
#include <algorithm>
#include <nlohmann/json.hpp>

#include "format/fabric/file.h"
#include "format/fabric/names.h"
#include "tests/fuzz/mutate.h"
#include "tests/fuzz/target.h"

using namespace selvedge;
using namespace selvedge::fuzz;

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace {

using Json = nlohmann::json;

struct File {
  std::vector<ExrPart> parts;
  std::vector<std::vector<ExrPixels>> levels;  ///< [part][level]
};

std::optional<File> read_file(std::span<const std::uint8_t> bytes) {
  auto reader = ExrReader::open(bytes, "input");
  if (!reader) return std::nullopt;
  File file{reader->parts(), {}};
  for (std::size_t p = 0; p < file.parts.size(); ++p) {
    auto& levels = file.levels.emplace_back();
    for (int k = 0; k < file.parts[p].levels; ++k) {
      auto pixels = reader->read_level(static_cast<int>(p), k);
      if (!pixels) return std::nullopt;
      levels.push_back(std::move(*pixels));
    }
  }
  return file;
}

void mutate_pixels(File& file, Choice& choice) {
  auto& levels = file.levels[choice.below(file.levels.size())];
  ExrPixels& pixels = levels[choice.below(levels.size())];
  std::vector<float>& plane = pixels.planes[choice.below(pixels.planes.size())];
  const std::size_t first = choice.below(plane.size());
  auto* const begin = reinterpret_cast<char*>(&plane[first]);
  const std::size_t size = 4 * std::min<std::size_t>(plane.size() - first, 1 + choice.below(16));
  std::string mutated = mutate_bytes({begin, size}, 0);
  mutated.resize(size, '\0');
  std::copy(mutated.begin(), mutated.end(), begin);
}

void mutate_parts(File& file, Choice& choice) {
  const std::size_t p = choice.below(file.parts.size());
  ExrPart& part = file.parts[p];
  ExrChannel& channel = part.channels[choice.below(part.channels.size())];
  switch (choice.below(6)) {
    case 0:
      part.name = mutate_bytes(part.name, 2);
      return;
    case 1:
      channel.name = mutate_bytes(channel.name, 2);
      return;
    case 2:
      channel.is_half = !channel.is_half;
      return;
    case 3:
      std::swap(part.name, file.parts[choice.below(file.parts.size())].name);
      return;
    case 4:
      file.parts.erase(file.parts.begin() + static_cast<std::ptrdiff_t>(p));
      file.levels.erase(file.levels.begin() + static_cast<std::ptrdiff_t>(p));
      return;
    default:
      for (auto& [name, text] : part.attributes)
        if (choice.one_in(part.attributes.size())) text = mutate_bytes(text, 8);
  }
}

/// Digests of the listed levels from their pixels, and of the text.
void seal(File& file) {
  auto& attributes = file.parts.front().attributes;
  const auto text = attributes.find(names::attribute_fabric);
  if (text == attributes.end()) return;
  try {
    Json json = Json::parse(text->second);
    for (std::size_t p = 0; p < file.parts.size(); ++p) {
      const ExrPart& part = file.parts[p];
      if (!json.at("layers").contains(part.name)) continue;
      const Json levels = json["layers"][part.name].at("levels");
      Json& digests = json.at("digests").at(part.name);
      for (std::size_t i = 0; i < levels.size() && i < digests.size(); ++i)
        digests.at(i) = digest_of(part, file.levels[p].at(levels.at(i).get<std::size_t>()));
    }
    text->second = json.dump();
  } catch (const std::exception&) {
    // Some other shape: as it is.
  }
  attributes[names::attribute_digest] = header_digest(text->second, file.parts);
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned seed) {
  Choice choice(seed);
  auto file = choice.one_in(6) ? std::nullopt : read_file({data, size});
  if (!file) return LLVMFuzzerMutate(data, size, max_size);
  const std::size_t way = choice.below(8);
  auto& attributes = file->parts.front().attributes;
  const auto text = attributes.contains(names::attribute_fabric) ? attributes.find(names::attribute_fabric)
                                                                 : attributes.find(names::attribute_samples);
  if (way < 4 && text != attributes.end())
    text->second = mutate_json(text->second, choice);
  else if (way < 6)
    mutate_pixels(*file, choice);
  else
    mutate_parts(*file, choice);
  if (!choice.one_in(8) && !file->parts.empty()) seal(*file);
  return give(exr_file(file->parts, [&](int part, int level) { return file->levels[part][level]; }), data,
              size, max_size);
}
