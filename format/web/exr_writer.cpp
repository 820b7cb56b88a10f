// OpenEXR files in one piece, in place of exr/exr.cpp.
#include "format/base/atomic_file.h"
#include "format/exr/bytes.h"
#include "format/exr/exr.h"
#include "format/exr/size.h"

namespace selvedge {

struct ExrWriter::State {
  std::string path;
  std::vector<ExrPart> parts;
  std::string chunks;               ///< part by part, level by level
  std::vector<std::size_t> places;  ///< where each begins
};

Result<ExrWriter> ExrWriter::create(const std::string& path, std::vector<ExrPart> parts) {
  for (ExrPart& part : parts) part = exr_with_defaults(std::move(part));
  return ExrWriter(std::make_shared<State>(State{path, std::move(parts), {}, {}}));
}

Result<void> ExrWriter::write_level(int index, int level, const ExrPixels& pixels) {
  const ExrPart& part = state_->parts[index];
  if (auto sound = check_halves(part, pixels, state_->path); !sound) return sound;
  for (const ExrChunk& chunk : exr_chunks(part)) {
    if (chunk.level != level) continue;
    const std::vector<std::uint8_t> packed = encode_exr_chunk(part, chunk, pixels);
    state_->places.push_back(state_->chunks.size());
    state_->chunks += part.has_mipmaps ? exr_int32_bytes({index, chunk.column, chunk.row, level, level})
                                       : exr_int32_bytes({index, chunk.row});
    state_->chunks += exr_int32_bytes({static_cast<std::int32_t>(packed.size())});
    state_->chunks.append(packed.begin(), packed.end());
  }
  return {};
}

Result<void> ExrWriter::commit() {
  std::string file = encode_exr_headers(state_->parts);
  const std::size_t first = file.size() + 8 * state_->places.size();
  for (const std::size_t place : state_->places)
    file += exr_int32_bytes({static_cast<std::int32_t>(first + place), 0});
  return write_file(state_->path, file + state_->chunks);
}

}  // namespace selvedge
