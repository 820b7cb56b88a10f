#include <algorithm>

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
  for_each_side(*header, [&](const FabricHeader& side) {
    for (const LayerKind kind : all_layers) {
      if (side.layer(kind)) check_layer_part(*file, side, kind, sink);
    }
  });
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
  LayerSet whole;
  for_each_side(header_, [&](const FabricHeader& side) {
    for (const LayerKind kind : all_layers) {
      if (!side.layer(kind)) continue;
      const auto& channels = file_.parts()[file_.find_part(part_name(kind, side.side))].channels;
      const bool half =
          std::all_of(channels.begin(), channels.end(), [](const ExrChannel& c) { return c.half; });
      (half ? result : whole).insert(kind);
    }
  });
  result.erase(whole);
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
  return read_level(header_, level, layers, memory_ - memory_of(level, level, layers));
}

Result<FabricLevel> FabricReader::read_level(const FabricHeader& side, int level, const LayerSet& layers,
                                             std::uint64_t room) {
  FabricLevel result;
  result.width = level_size(header_.width, level);
  result.height = level_size(header_.height, level);
  for (const LayerKind kind : all_layers) {
    if (!layers.contains(kind) || !side.has(kind, level) || kind == LayerKind::bases) continue;
    if (auto ok = read_layer(side, kind, level, result); !ok) return tl::unexpected(ok.error());
  }
  if (result.has(LayerKind::yarns) && result.has(LayerKind::indirect)) {
    IssueSink sink(file_.name());
    restore_yarns(result, side.shape, side.period_mm, room, sink);
    if (sink.has_error()) return tl::unexpected(sink.first_error());
  }
  if (result.has(LayerKind::products)) {
    auto shared = bases(side);
    if (!shared) return tl::unexpected(shared.error());
    result.bases = std::move(*shared);
  }
  if (const int shown = side.level_of_texels(level); shown > level) {
    LayerSet of_texels = layers;
    of_texels.erase({LayerKind::indirect});
    auto coarser = read_level(side, shown, of_texels, room);
    if (!coarser) return coarser;
    result.take_texels(*coarser, shown - level);
  }
  return result;
}

std::uint64_t FabricReader::packed_bytes(LayerKind kind, int level, Side side) const {
  const FabricHeader* const header = header_.side_of(side);
  if (header == nullptr || !header->has(kind, level)) return 0;
  return file_.packed_bytes(file_.find_part(part_name(kind, side)), level);
}

Result<void> FabricReader::read_layer(const FabricHeader& side, LayerKind kind, int level,
                                      FabricLevel& result) {
  const int part = file_.find_part(part_name(kind, side.side));
  const auto pixels = file_.read_level(part, level);
  if (!pixels) return tl::unexpected(pixels.error());
  IssueSink sink(file_.name());
  decode_layer(file_.parts()[part], *pixels, side, kind, level, result, sink);
  if (sink.has_error()) return tl::unexpected(sink.first_error());
  return {};
}

Result<std::shared_ptr<const ProductBases>> FabricReader::bases(const FabricHeader& side) {
  auto& known = bases_[index_of(side.side)];
  if (!known) {
    FabricLevel base;
    base.width = header_.width;
    base.height = header_.height;
    if (auto ok = read_layer(side, LayerKind::bases, 0, base); !ok) return tl::unexpected(ok.error());
    known = base.bases;
  }
  return known;
}

Result<Fabric> FabricReader::read_levels(int first, int last, LayerSet layers) {
  if (auto ok = check_memory(first, last, layers); !ok) return tl::unexpected(ok.error());
  const std::uint64_t room = memory_ - memory_of(first, last, layers);
  const auto read = [&](const FabricHeader& side) -> Result<Fabric> {
    Fabric fabric = partial_fabric(side, first, last);
    for (int k = first; k <= last; ++k) {
      auto level = read_level(side, k, layers, room);
      if (!level) return tl::unexpected(level.error());
      fabric.levels.push_back(std::move(*level));
    }
    return fabric;
  };
  auto fabric = read(header_);
  for (std::size_t s = 0; fabric && s < header_.sides.size(); ++s) {
    auto other = read(header_.sides[s]);
    if (!other) return other;
    restore_light_through(fabric->levels.front(), other->levels.front());
    // Of other layers than were asked for, nothing may be left.
    const bool reflects = std::all_of(other->levels.begin(), other->levels.end(),
                                      [](const FabricLevel& level) { return level.reflects(); });
    if (!reflects) continue;
    fabric->add_side(std::move(*other));
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

}  // namespace selvedge
