// Samples of yarn: points of the cloth, what is seen there, and by which lights (spec/brdf.md, "Yarn").
#pragma once

#include <algorithm>
#include <limits>
#include <span>
#include <vector>

#include "viewer/hybrid/evaluate_lanes.h"
#include "viewer/hybrid/yarn_surface.h"

namespace selvedge {

/// A pixel of a block, with what its samples need.
struct YarnPixel {
  std::uint32_t block = 0;
  std::uint32_t lane = 0;
  V2i position{0, 0};
  V2f uv{0, 0}, right{0, 0}, up{0, 0};  ///< of its centre; their change per pixel
  V3f view{0, 0, 1};
  float depth = 0;  ///< how far from the plane yarn is met, mm (curved_cloth.h)
  std::uint32_t surface = 0;
  float side = 1;
  float spacing = 0;  ///< of its points, across the view, mm
  /// The place so many pixels to the right and up of its centre, by its own surface.
  V2f place(float to_right, float upwards) const { return uv + right * to_right + up * upwards; }
};

/// A light at a pixel.
struct YarnLight {
  V3f direction{0, 0, 1};
  float share = 0;
};

/// The pixels of some blocks that show the yarn of one fabric.
struct YarnPixels {
  std::vector<YarnPixel> pixels;
  std::vector<YarnLight> lights;    ///< [pixel][light]
  std::vector<V3f> irradiance;      ///< of the lights
  std::vector<SmoothLight> around;  ///< [pixel], in its axes; empty if absent
};

/// Pixels that show no yarn.
inline constexpr std::int32_t no_segment = std::numeric_limits<std::int32_t>::min() / 2;

/// A point of the cloth, and what is seen there.
struct YarnSample {
  V2f uv{0, 0};
  std::uint32_t pixel = 0;  ///< whose view and lights it has
  std::int32_t segment = no_segment;
  V3f radiance{0, 0, 0};
  std::uint32_t lit = 0;  ///< lights that no yarn hides, as bits
};

/// An order of things that lie in the repeating cell: neighbours in it come after each other, things of one
/// depth first, so that their rays can be traced together.
class CellOrder {
 public:
  explicit CellOrder(const Yarns& yarns) : per_period_(1 / yarns.period().x, 1 / yarns.period().y) {
    // Rays that are traced together lie in about one cell.
    const V2i cells = yarns.inside().cells;
    columns_ = std::clamp(2 * cells.x, 1, most);
    rows_ = std::clamp(2 * cells.y, 1, most);
  }

  void clear() {
    items_.clear();
    slots_.clear();
  }
  /// `place` in mm, of any repeat; `depth` below the highest yarn, as a share of the cloth.
  void add(std::uint32_t item, const V2f& place, float depth) {
    const auto part = [](float at, int count) {
      const float share = at - static_cast<float>(static_cast<int>(at));
      return std::min(static_cast<int>((share < 0 ? share + 1 : share) * static_cast<float>(count)),
                      count - 1);
    };
    items_.push_back(item);
    const int layer = std::clamp(static_cast<int>(depth * layers), 0, layers - 1);
    const int row = part(place.y * per_period_.y, rows_);
    const int column = part(place.x * per_period_.x, columns_);
    slots_.push_back((layer * rows_ + row) * columns_ + (row % 2 == 0 ? column : columns_ - 1 - column));
  }
  std::span<const std::uint32_t> sorted() {
    starts_.assign(static_cast<std::size_t>(layers) * columns_ * rows_ + 1, 0);
    for (const int slot : slots_) ++starts_[slot + 1];
    for (std::size_t i = 1; i < starts_.size(); ++i) starts_[i] += starts_[i - 1];
    sorted_.resize(items_.size());
    for (std::size_t i = 0; i < items_.size(); ++i) sorted_[starts_[slots_[i]]++] = items_[i];
    return sorted_;
  }

 private:
  static constexpr int most = 64;
  static constexpr int layers = 4;
  V2f per_period_;
  int columns_;
  int rows_;
  std::vector<std::uint32_t> items_;
  std::vector<int> slots_;
  std::vector<std::uint32_t> starts_;
  std::vector<std::uint32_t> sorted_;
};

/// Looks at samples of one fabric: all view rays, then the shadow rays of each light, those that lie close
/// together at once.
class SampleShader {
 public:
  /// Both must outlive the object.
  SampleShader(const PackedFabric& packed, const YarnPixels& of);
  void look(std::span<YarnSample> samples);

 private:
  const YarnLight& light_of(const YarnSample& sample, std::size_t number) const {
    return of_.lights[sample.pixel * of_.irradiance.size() + number];
  }
  void find(std::span<const std::uint32_t> packet);
  void shine_through(std::span<const std::uint32_t> packet, std::uint32_t lanes, std::span<const float> share,
                     const V3f& irradiance);
  void reflect_around(std::span<const std::uint32_t> packet, std::uint32_t seen);
  void cast_shadows(std::size_t number);

  const Yarns& yarns_;
  float plane_;
  std::span<const float> sky_;
  const YarnPixels& of_;
  CellOrder order_;
  std::span<YarnSample> samples_;
  std::vector<V3f> leave_;   ///< where light leaves the samples' yarn
  std::vector<V3f> direct_;  ///< [light][sample]
  YarnLanes a_;              ///< where rays come from
  YarnLanes view_;
  YarnLanes direction_;  ///< to a light
  alignas(64) YarnSurface::Floats spacing_{};
  YarnHits hits_;
  YarnSurface surface_;
  YarnReflection reflection_;
};

}  // namespace selvedge
