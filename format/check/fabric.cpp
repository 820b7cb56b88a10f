#include "format/check/fabric.h"

#include <fmt/format.h>

#include <algorithm>

#include "format/check/fabric_extras.h"
#include "format/exr/exr.h"
#include "format/fabric/level_values.h"
#include "format/fabric/rules.h"
#include "format/fabric/warnings.h"

namespace selvedge {
namespace {

bool is_zero(const ExrPixels& pixels) {
  return std::all_of(pixels.planes.begin(), pixels.planes.end(), [](const std::vector<float>& plane) {
    return std::all_of(plane.begin(), plane.end(), [](float value) { return value == 0; });
  });
}

/// Checks one file, stage by stage.
class Checker {
 public:
  Checker(ExrReader file, const FabricLimits& limits)
      : file_(std::move(file)),
        sink_(file_.name()),
        header_(check_header(file_, limits, sink_)),
        memory_(limits.memory) {}

  Issues check() {
    if (fabric_text(file_.parts()) == nullptr) return sink_.take();  // another kind of file
    if (header_) {
      for (const LayerKind layer : all_layers) {
        if (header_->layer(layer) && check_layer_part(file_, *header_, layer, sink_)) readable_.insert(layer);
      }
      understood_ = !sink_.has_error();
      check_extras(file_, *header_, sink_);
    }
    int levels = 0;
    for (const ExrPart& part : file_.parts()) levels = std::max(levels, part.levels);
    for (int k = 0; k < levels; ++k) check_level(k);
    return sink_.take();
  }

 private:
  /// Decodes level k of all parts, and checks the values of readable layers.
  void check_level(int k) {
    const std::size_t errors_before = sink_.errors();
    FabricLevel level;
    if (header_) {
      level.width = level_size(header_->width, k);
      level.height = level_size(header_->height, k);
    }
    const std::uint64_t memory = header_ ? memory_of_levels(file_, *header_, k, k, readable_) : 0;
    const auto has_room = [&](const std::string& place, std::uint64_t more) {
      if (memory <= memory_ && more <= memory_ - memory) return true;
      const Error beyond = beyond_memory("", place, "the values of " + levels_text(k, k), memory_);
      sink_.add(beyond.code, beyond.place, beyond.message);
      return false;
    };
    if (!has_room("", 0)) return;
    for (std::size_t p = 0; p < file_.parts().size(); ++p) {
      const ExrPart& part = file_.parts()[p];
      if (k >= part.levels) continue;
      if (is_lossy(part.compression)) continue;  // readers do not decode it
      const auto layer = layer_named(part.name);
      const bool readable = layer && readable_.contains(*layer);
      if (!readable && !has_room(part.name, 2 * pixel_memory(part, k))) continue;
      const auto pixels = file_.read_level(static_cast<int>(p), k);
      if (!pixels) {
        sink_.add(pixels.error());
      } else if (readable) {
        check_pixels(part, *pixels, *layer, k, level);
      }
    }
    if (sink_.errors() == errors_before && level.has(LayerKind::yarns) && level.has(LayerKind::indirect)) {
      restore_yarns(level, header_->shape, header_->period_mm, memory_ - memory, sink_);
    }
    if (level.bases) bases_ = level.bases;
    if (level.has(LayerKind::products)) level.bases = bases_;
    // The light of an incomplete fabric says nothing; the bases are those of level 0, which may be broken.
    if (level.has(LayerKind::products) && !level.bases) return;
    if (!understood_ || k >= header_->levels || sink_.errors() > errors_before) return;
    warn_of_peaks(level, k, half_lobes(), sink_);
    warn_of_energy(level, *header_, k, sink_);
  }

  void check_pixels(const ExrPart& part, const ExrPixels& pixels, LayerKind layer, int k,
                    FabricLevel& level) {
    if (header_->has(layer, k)) {
      decode_layer(part, pixels, *header_, layer, k, level, sink_);
    } else if (!is_zero(pixels)) {
      sink_.add(Code::fabric_advice, fmt::format("{}/level {}", part.name, k),
                "the level is not listed, yet not all of it is zero");
    }
  }

  bool half_lobes() const {
    const int part = file_.find_part(name_of(LayerKind::lobes));
    if (part < 0) return false;
    const auto& channels = file_.parts()[part].channels;
    return std::any_of(channels.begin(), channels.end(), [](const ExrChannel& c) { return c.half; });
  }

  ExrReader file_;
  IssueSink sink_;
  std::optional<FabricHeader> header_;
  std::uint64_t memory_;
  LayerSet readable_;
  std::shared_ptr<const ProductBases> bases_;
  bool understood_ = false;  ///< every layer of the header is readable
};

Issues issues_of(Result<ExrReader> file, const FabricLimits& limits) {
  if (!file) return {file.error()};
  return Checker(std::move(*file), limits).check();
}

}  // namespace

Issues check_fabric(const std::string& path, const FabricLimits& limits) {
  return issues_of(ExrReader::open(path, exr_limits(limits)), limits);
}

Issues check_fabric(std::span<const std::uint8_t> bytes, const std::string& name,
                    const FabricLimits& limits) {
  return issues_of(ExrReader::open(bytes, name, exr_limits(limits)), limits);
}

}  // namespace selvedge
