#include <algorithm>

#include "format/base/json_text.h"
#include "format/fabric/file.h"
#include "format/fabric/level_values.h"
#include "format/fabric/rules.h"

namespace selvedge {

FabricReader::FabricReader(ExrReader file, FabricHeader header, std::string text, std::uint64_t memory)
    : file_(std::move(file)), header_(std::move(header)), text_(std::move(text)), memory_(memory) {}

Result<FabricReader> FabricReader::open(Result<ExrReader> file, const FabricLimits& limits) {
  if (!file) return tl::unexpected(file.error());
  IssueSink sink(file->name());
  auto header = check_header(*file, limits, sink);
  if (sink.has_error()) return tl::unexpected(sink.first_error());
  for (const LayerKind kind : all_layers) {
    if (header->layer(kind)) check_layer_part(*file, *header, kind, sink);
  }
  if (sink.has_error()) return tl::unexpected(sink.first_error());
  std::string text = *fabric_text(file->parts());
  return FabricReader(std::move(*file), std::move(*header), std::move(text), limits.memory);
}

Result<FabricReader> FabricReader::open(const std::string& path, const FabricLimits& limits) {
  return open(ExrReader::open(path, exr_limits(limits)), limits);
}

Result<FabricReader> FabricReader::open(std::span<const std::uint8_t> bytes, const std::string& name,
                                        const FabricLimits& limits) {
  return open(ExrReader::open(bytes, name, exr_limits(limits)), limits);
}

LayerSet FabricReader::half() const {
  LayerSet result;
  for (const LayerKind kind : all_layers) {
    if (!header_.layer(kind)) continue;
    const auto& channels = file_.parts()[file_.find_part(name_of(kind))].channels;
    if (std::all_of(channels.begin(), channels.end(), [](const ExrChannel& c) { return c.half; })) {
      result.insert(kind);
    }
  }
  return result;
}

std::string FabricReader::digest() const { return header_digest(text_, file_.parts()); }

std::uint64_t FabricReader::memory_of(int first, int last, const LayerSet& layers) const {
  return memory_of_levels(file_, header_, first, last, layers);
}

Result<void> FabricReader::check_memory(int first, int last, const LayerSet& layers) const {
  if (memory_of(first, last, layers) <= memory_) return {};
  return tl::unexpected(beyond_memory(name(), "", "the values of " + levels_text(first, last), memory_));
}

Result<FabricLevel> FabricReader::read_level(int level, LayerSet layers) {
  if (auto ok = check_memory(level, level, layers); !ok) return tl::unexpected(ok.error());
  return read_level(level, layers, memory_ - memory_of(level, level, layers));
}

Result<FabricLevel> FabricReader::read_level(int level, const LayerSet& layers, std::uint64_t room) {
  FabricLevel result;
  result.width = level_size(header_.width, level);
  result.height = level_size(header_.height, level);
  for (const LayerKind kind : all_layers) {
    if (!layers.contains(kind) || !header_.has(kind, level) || kind == LayerKind::bases) continue;
    if (auto ok = read_layer(kind, level, result); !ok) return tl::unexpected(ok.error());
  }
  if (result.has(LayerKind::yarns) && result.has(LayerKind::indirect)) {
    IssueSink sink(file_.name());
    restore_yarns(result, header_.shape, header_.period_mm, room, sink);
    if (sink.has_error()) return tl::unexpected(sink.first_error());
  }
  if (result.has(LayerKind::products)) {
    auto shared = bases();
    if (!shared) return tl::unexpected(shared.error());
    result.bases = std::move(*shared);
  }
  return result;
}

std::uint64_t FabricReader::packed_bytes(LayerKind kind, int level) const {
  if (!header_.has(kind, level)) return 0;
  return file_.packed_bytes(file_.find_part(name_of(kind)), level);
}

Result<void> FabricReader::read_layer(LayerKind kind, int level, FabricLevel& result) {
  const int part = file_.find_part(name_of(kind));
  const auto pixels = file_.read_level(part, level);
  if (!pixels) return tl::unexpected(pixels.error());
  IssueSink sink(file_.name());
  decode_layer(file_.parts()[part], *pixels, header_, kind, level, result, sink);
  if (sink.has_error()) return tl::unexpected(sink.first_error());
  return {};
}

Result<std::shared_ptr<const ProductBases>> FabricReader::bases() {
  if (!bases_) {
    FabricLevel base;
    base.width = header_.width;
    base.height = header_.height;
    if (auto ok = read_layer(LayerKind::bases, 0, base); !ok) return tl::unexpected(ok.error());
    bases_ = base.bases;
  }
  return bases_;
}

Result<Fabric> FabricReader::read_levels(int first, int last, LayerSet layers) {
  if (auto ok = check_memory(first, last, layers); !ok) return tl::unexpected(ok.error());
  Fabric fabric = partial_fabric(header_, first, last);
  for (int k = first; k <= last; ++k) {
    auto level = read_level(k, layers, memory_ - memory_of(first, last, layers));
    if (!level) return tl::unexpected(level.error());
    fabric.levels.push_back(std::move(*level));
  }
  return fabric;
}

Result<Fabric> read_fabric(const std::string& path, const FabricLimits& limits) {
  auto reader = FabricReader::open(path, limits);
  if (!reader) return tl::unexpected(reader.error());
  return reader->read();
}

Result<Fabric> read_fabric(std::span<const std::uint8_t> bytes, const std::string& name,
                           const FabricLimits& limits) {
  auto reader = FabricReader::open(bytes, name, limits);
  if (!reader) return tl::unexpected(reader.error());
  return reader->read();
}

Result<std::string> read_fabric_header(const std::string& path) {
  const auto reader = FabricReader::open(path);
  if (!reader) return tl::unexpected(reader.error());
  return parse_json(reader->text()).dump(2);
}

}  // namespace selvedge
