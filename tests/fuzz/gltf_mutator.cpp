// Most mutations keep the file a GLB: its JSON by structure, or the bytes of its buffer; the lengths of file,
// chunks and buffer are set right again.
#include <nlohmann/json.hpp>

#include "tests/format/gltf_fixtures.h"
#include "tests/fuzz/mutate.h"
#include "tests/fuzz/target.h"

using namespace selvedge::fuzz;

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace {

using Json = nlohmann::ordered_json;

struct Glb {
  std::string json;
  std::string binary;
};

std::uint32_t word(const std::string& bytes, std::size_t at) {
  std::uint32_t value = 0;
  if (at + 4 <= bytes.size()) std::memcpy(&value, bytes.data() + at, 4);
  return value;
}

/// The two chunks of a GLB; a text alone is JSON without a buffer.
Glb parts_of(const std::string& bytes) {
  if (bytes.substr(0, 4) != "glTF" || bytes.size() < 20) return {bytes, {}};
  const std::size_t length = std::min<std::size_t>(word(bytes, 12), bytes.size() - 20);
  Glb glb{bytes.substr(20, length), {}};
  const std::size_t second = 20 + length;
  if (second + 8 <= bytes.size()) glb.binary = bytes.substr(second + 8, word(bytes, second));
  return glb;
}

/// Some stretch of the buffer, so that a mutation meets one view and not always the whole.
void mutate_stretch(std::string& binary, Choice& choice) {
  if (binary.empty()) return;
  const std::size_t begin = choice.below(binary.size());
  const std::size_t length = 1 + choice.below(std::min<std::size_t>(64, binary.size() - begin));
  // The same size as a rule: what comes behind stays where it is.
  std::string stretch = mutate_bytes(binary.substr(begin, length), choice.one_in(4) ? 16 : 0);
  if (!choice.one_in(4)) stretch.resize(length, '\0');
  binary.replace(begin, length, stretch);
}

/// Sets the length of the first buffer to its true value.
void fix_length(Glb& glb) {
  Json json = Json::parse(glb.json, nullptr, false);
  if (!json.is_object() || !json.contains("buffers") || !json["buffers"].is_array() ||
      json["buffers"].empty() || !json["buffers"][0].is_object()) {
    return;
  }
  json["buffers"][0]["byteLength"] = glb.binary.size();
  glb.json = json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned seed) {
  Choice choice(seed);
  const std::size_t way = choice.below(8);
  if (way == 0) return LLVMFuzzerMutate(data, size, max_size);
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  Glb glb = parts_of(bytes);
  if (way < 5) {
    glb.json = mutate_json(glb.json, choice);
  } else {
    const std::size_t before = glb.binary.size();
    mutate_stretch(glb.binary, choice);
    if (glb.binary.size() != before) fix_length(glb);
  }
  const bool text = bytes.substr(0, 4) != "glTF";
  return give(text ? glb.json : selvedge::test::glb(glb.json, glb.binary), data, size, max_size);
}
