#include "format/fabric/value_ranges.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

namespace selvedge {
namespace {

/// A range that values must be in, and how it is called. NaN and infinities are in none.
struct Range {
  float least = std::numeric_limits<float>::lowest();
  float most = std::numeric_limits<float>::max();
  const char* fault = "is not finite";
  bool holds(float value) const { return value >= least && value <= most; }
};

constexpr Range not_negative{0, std::numeric_limits<float>::max(), "is negative or not finite"};

Range range_of(Layer layer, std::size_t channel, int lobes) {
  switch (layer) {
    case Layer::lobes: {
      const std::size_t within = channel % static_cast<std::size_t>(parameter_count(lobes));
      return within % 4 == 0 ? not_negative : Range{};  // rho, and the lobes' exponents
    }
    case Layer::frame:
    case Layer::heights:
    case Layer::products:
    case Layer::bases:
      return {};
    case Layer::table:
    case Layer::light:
      return not_negative;
    case Layer::opacity:
      break;
  }
  return {0, 1, "is outside of [0, 1]"};
}

/// Half precision leaves 3 digits; a frame worse than this was not written as a frame.
constexpr float frame_tolerance = 0.01F;

bool is_frame(const V3f& n, const V3f& t) {
  return std::abs(n.length() - 1) <= frame_tolerance && std::abs(t.length() - 1) <= frame_tolerance &&
         std::abs(n.dot(t)) <= frame_tolerance;
}

/// Issues of one layer at one level: the first few, then their number.
class Counted {
 public:
  explicit Counted(IssueSink& sink) : sink_(sink) {}
  /// `place` and `message` are called for those that are named.
  template <class Place, class Message>
  void add(const Place& place, const Message& message) {
    if (++count_ <= named) sink_.add(Code::fabric_not_finite, place(), message());
  }
  void finish(const std::string& place) {
    if (count_ > named) {
      sink_.add(Code::fabric_not_finite, place,
                fmt::format("{} more values break the rules", count_ - named));
    }
  }

 private:
  static constexpr std::size_t named = 8;
  IssueSink& sink_;
  std::size_t count_ = 0;
};

}  // namespace

std::string place_of(Layer layer, int level, const std::string& channel, std::size_t texel, int width) {
  const auto columns = static_cast<std::size_t>(width);
  return fmt::format("{}/level {}/{}/{},{}", name_of(layer), level, channel, texel % columns,
                     texel / columns);
}

void check_values(const FabricLevel& level, int level_index, Layer layer, const LayerShape& shape,
                  IssueSink& sink) {
  const std::size_t channels = channel_count(layer, shape);
  const auto texels = static_cast<std::size_t>(level.texels());
  std::vector<Range> ranges;
  for (std::size_t channel = 0; channel < channels; ++channel) {
    ranges.push_back(range_of(layer, channel, shape.lobes));
  }
  Counted issues(sink);
  for (std::size_t texel = 0; texel < texels; ++texel) {
    for (std::size_t channel = 0; channel < channels; ++channel) {
      const float value = value_of(level, layer, shape, texel, channel);
      if (ranges[channel].holds(value)) continue;
      issues.add(
          [&] {
            return place_of(layer, level_index, channel_names(layer, shape)[channel], texel, level.width);
          },
          [&] { return fmt::format("{} {}", value, ranges[channel].fault); });
    }
  }
  if (layer == Layer::frame) {
    for (std::size_t texel = 0; texel < texels; ++texel) {
      const V3f& n = level.frame->normal[texel];
      const V3f& t = level.frame->tangent[texel];
      // Those that are not finite have been named.
      if (!std::isfinite(n.length2() + t.length2()) || is_frame(n, t)) continue;
      issues.add([&] { return place_of(layer, level_index, "frame", texel, level.width); },
                 [&] { return std::string("normal and tangent are not unit and perpendicular"); });
    }
  }
  issues.finish(fmt::format("{}/level {}", name_of(layer), level_index));
}

}  // namespace selvedge
