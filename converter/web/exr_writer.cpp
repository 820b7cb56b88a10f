// ExrWriter (format/exr/exr.h) without OpenEXR: the file is told to the host.
#include "converter/web/host.h"
#include "format/exr/bytes.h"
#include "format/exr/size.h"

namespace selvedge {

struct ExrWriter::State {
  std::string path;
  std::vector<ExrPart> parts;
  std::vector<std::vector<std::size_t>> places;  ///< of each part's chunks within all
  std::string chunks;
};

Result<ExrWriter> ExrWriter::create(const std::string& path, std::vector<ExrPart> parts) {
  for (ExrPart& part : parts) part = exr_with_defaults(std::move(part));
  std::vector<std::vector<std::size_t>> places(parts.size());
  return ExrWriter(std::make_shared<State>(State{path, std::move(parts), std::move(places), {}}));
}

Result<void> ExrWriter::write_level(int index, int level, const ExrPixels& pixels) {
  const ExrPart& part = state_->parts[index];
  if (auto sound = check_halves(part, pixels, state_->path); !sound) return sound;
  for (const ExrChunk& chunk : exr_chunks(part)) {
    if (chunk.level != level) continue;
    const std::vector<std::uint8_t> packed = exr_packed_chunk(part, chunk, pixels);
    state_->places[index].push_back(state_->chunks.size());
    state_->chunks +=
        part.mipmapped ? exr_numbers({index, chunk.x, chunk.y, level, level}) : exr_numbers({index, chunk.y});
    state_->chunks += exr_numbers({static_cast<std::int32_t>(packed.size())});
    state_->chunks.append(packed.begin(), packed.end());
  }
  return {};
}

Result<void> ExrWriter::commit() {
  std::string file = exr_headers(state_->parts);
  std::size_t first = file.size();
  for (const auto& places : state_->places) first += 8 * places.size();
  for (const auto& places : state_->places)
    for (const std::size_t place : places) file += exr_numbers({static_cast<std::int32_t>(first + place), 0});
  file += state_->chunks;
  host_tell(Told::fabric, file.data(), file.size());
  return {};
}

std::vector<std::uint8_t> exr_deflated(std::span<const std::uint8_t> bytes) {
  std::vector<std::uint8_t> packed(bytes.size());
  packed.resize(host_deflate(bytes.data(), bytes.size(), packed.data()));
  return packed;
}

}  // namespace selvedge
