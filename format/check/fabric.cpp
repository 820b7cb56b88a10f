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
      for_each_side(*header_, [&](const FabricHeader& side) {
        for (const LayerKind layer : all_layers) {
          if (side.layer(layer) && check_layer_part(file_, side, layer, sink_)) {
            readable_[index_of(side.side)].insert(layer);
          }
        }
      });
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
    std::array<FabricLevel, all_sides.size()> levels;
    LayerSet readable;
    for (const Side side : all_sides) {
      if (!header_) continue;
      levels[index_of(side)].width = level_size(header_->width, k);
      levels[index_of(side)].height = level_size(header_->height, k);
      readable.insert(readable_[index_of(side)]);
    }
    const std::uint64_t memory = header_ ? memory_of_levels(file_, *header_, k, k, readable) : 0;
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
      const auto layer = layer_of_part(part.name);
      const bool known = layer && readable_[index_of(layer->side)].contains(layer->kind);
      if (!known && !has_room(part.name, 2 * pixel_memory(part, k))) continue;
      const auto pixels = file_.read_level(static_cast<int>(p), k);
      if (!pixels) {
        sink_.add(pixels.error());
      } else if (known) {
        check_pixels(part, *pixels, *layer, k, levels[index_of(layer->side)]);
      }
    }
    FabricLevel& front = levels.front();
    if (sink_.errors() == errors_before && front.has(LayerKind::yarns) && front.has(LayerKind::indirect)) {
      restore_yarns(front, header_->shape, header_->period_mm, memory_ - memory, sink_);
    }
    for (const Side side : all_sides) {
      FabricLevel& level = levels[index_of(side)];
      auto& bases = bases_[index_of(side)];
      if (level.bases) bases = level.bases;
      if (level.has(LayerKind::products)) level.bases = bases;
      // The light of an incomplete fabric says nothing; the bases are those of level 0, which may be broken.
      if (level.has(LayerKind::products) && !level.bases) return;
    }
    if (understood_ && k < header_->levels && sink_.errors() == errors_before) warn_of_light(k, levels);
  }

  /// Warns of peaks and energy of readable sides.
  void warn_of_light(int k, std::array<FabricLevel, all_sides.size()>& levels) {
    const auto lit = [&](Side side) {
      const FabricHeader* const header = header_->side_of(side);
      bool known = header != nullptr && header->level_of_texels(k) == k;
      // Its opacity is the back's.
      if (side == Side::back_through) known = known && header_->side_of(Side::back)->level_of_texels(k) == k;
      return known ? LitSide{&levels[index_of(side)], header} : LitSide();
    };
    const auto give_opacity = [&](Side from, Side to) {
      levels[index_of(to)].set(LayerKind::opacity, levels[index_of(from)][LayerKind::opacity]);
    };
    const FabricHeader* const back = header_->side_of(Side::back);
    give_opacity(Side::front, Side::through);
    give_opacity(back != nullptr ? Side::back : Side::front, Side::back_through);
    for_each_side(*header_, [&](const FabricHeader& side) {
      warn_of_peaks(levels[index_of(side.side)], side.side, k, half_lobes(side.side), sink_);
    });
    // Light in front goes on to a viewer behind, and the other way round.
    const Side behind = header_->side_of(Side::back_through) != nullptr ? Side::back_through : Side::through;
    const bool known = behind == Side::back_through || back == nullptr || back->views == header_->views;
    warn_of_energy(lit(Side::front), known ? lit(behind) : LitSide(), k, sink_);
    if (lit(Side::back).level != nullptr) warn_of_energy(lit(Side::back), lit(Side::through), k, sink_);
  }

  void check_pixels(const ExrPart& part, const ExrPixels& pixels, const PartLayer& layer, int k,
                    FabricLevel& level) {
    const FabricHeader& header = *header_->side_of(layer.side);
    if (header.has(layer.kind, k)) {
      decode_layer(part, pixels, header, layer.kind, k, level, sink_);
    } else if (!is_zero(pixels)) {
      sink_.add(Code::fabric_advice, fmt::format("{}/level {}", part.name, k),
                "the level is not listed, yet not all of it is zero");
    }
  }

  bool half_lobes(Side side) const {
    const int part = file_.find_part(part_name(LayerKind::lobes, side));
    if (part < 0) return false;
    const auto& channels = file_.parts()[part].channels;
    return std::any_of(channels.begin(), channels.end(), [](const ExrChannel& c) { return c.half; });
  }

  ExrReader file_;
  IssueSink sink_;
  std::optional<FabricHeader> header_;
  std::uint64_t memory_;
  std::array<LayerSet, all_sides.size()> readable_;
  std::array<std::shared_ptr<const ProductBases>, all_sides.size()> bases_;
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
