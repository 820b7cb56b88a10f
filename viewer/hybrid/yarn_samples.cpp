#include "viewer/hybrid/yarn_samples.h"

#include <algorithm>

#include "format/fabric/lifted.h"
#include "viewer/hybrid/curved_cloth.h"

namespace selvedge {
namespace {

template <class Body>
void in_packets(std::span<const std::uint32_t> items, const Body& body) {
  for (std::size_t first = 0; first < items.size(); first += yarn_lanes)
    body(items.subspan(first, std::min(yarn_lanes, items.size() - first)));
}

}  // namespace

SampleShader::SampleShader(const PackedFabric& packed, const YarnPixels& of)
    : yarns_(*packed.fabric->levels.front().yarns()),
      plane_(packed.fabric->reference_height),
      sky_(of.around.empty() ? std::span<const float>() : packed.yarn_sky),
      of_(of),
      order_(yarns_) {}

void SampleShader::look(std::span<YarnSample> samples) {
  if (samples.empty()) return;
  samples_ = samples;
  const std::size_t lights = of_.irradiance.size();
  leave_.resize(samples.size());
  direct_.assign(samples.size() * lights, V3f(0, 0, 0));
  order_.clear();
  const V2f period = yarns_.period();
  for (std::uint32_t i = 0; i < samples.size(); ++i)
    order_.add(i, V2f(samples[i].uv.x * period.x, samples[i].uv.y * period.y), 0);
  in_packets(order_.sorted(), [&](std::span<const std::uint32_t> packet) { find(packet); });
  for (std::size_t light = 0; light < lights; ++light) cast_shadows(light);
}

/// The visible points, their indirect light, and their direct light without shadows.
void SampleShader::find(std::span<const std::uint32_t> packet) {
  for (std::size_t i = 0; i < packet.size(); ++i) {
    const YarnSample& s = samples_[packet[i]];
    a_.set(i, V3f(s.uv.x, s.uv.y, 0));
    const YarnPixel& pixel = of_.pixels[s.pixel];
    view_.set(i, pixel.view);
    spacing_[i] = pixel.spacing;
  }
  const std::uint32_t met =
      yarns_.trace(V2d(0, 0), a_, plane_, view_, (1U << packet.size()) - 1, hits_, spacing_);
  const std::span<const Yarns::Segment> segments = yarns_.inside().segments;
  std::uint32_t seen = 0;
  for (std::size_t i = 0; i < packet.size(); ++i) {
    if ((met >> i & 1) == 0) continue;
    const YarnPixel& pixel = of_.pixels[samples_[packet[i]].pixel];
    const float below = plane_ - (segments[hits_.segment[i]].start.z + hits_.from_start.z[i]);
    if (!is_met(below, pixel.depth, pixel.side)) continue;
    samples_[packet[i]].segment = hits_.segment[i];
    seen |= static_cast<std::uint32_t>(view_.z[i] > 0) << i;
  }
  if (seen == 0) return;
  find_surface(yarns_, sky_, hits_, seen, view_, spacing_, surface_);
  for (std::size_t i = 0; i < packet.size(); ++i) leave_[packet[i]] = surface_.leave.at(i);
  if (!sky_.empty()) reflect_around(packet, seen);
  for (std::size_t number = 0; number < of_.irradiance.size(); ++number) {
    alignas(64) std::array<float, yarn_lanes> share{};
    std::uint32_t shines = 0;
    std::uint32_t behind = 0;
    for (std::size_t i = 0; i < packet.size(); ++i) {
      const YarnLight& light = light_of(samples_[packet[i]], number);
      direction_.set(i, light.direction);
      share[i] = light.share;
      shines |= static_cast<std::uint32_t>(direction_.z[i] > 0 && share[i] > 0) << i;
      behind |= static_cast<std::uint32_t>(direction_.z[i] < 0 && share[i] > 0) << i;
    }
    const V3f& irradiance = of_.irradiance[number];
    if (!yarns_.data().through.empty() && (behind & seen) != 0)
      shine_through(packet, behind & seen, share, irradiance);
    shines &= seen;
    if (shines == 0) continue;
    reflect(surface_, direction_, view_, reflection_);
    for (std::size_t i = 0; i < packet.size(); ++i) {
      if ((shines >> i & 1) == 0) continue;
      YarnSample& s = samples_[packet[i]];
      s.radiance += reflection_.indirect.at(i) * irradiance * share[i];
      if ((reflection_.facing >> i & 1) != 0)
        direct_[number * samples_.size() + packet[i]] = reflection_.direct.at(i) * irradiance * share[i];
    }
  }
}

/// Adds a light from below, in `direction_`, to samples of the lanes.
void SampleShader::shine_through(std::span<const std::uint32_t> packet, std::uint32_t lanes,
                                 std::span<const float> share, const V3f& irradiance) {
  YarnLanes light = direction_;
  for (float& z : light.z) z = -z;
  reflect_through(surface_, light, reflection_.indirect);
  for (std::size_t i = 0; i < packet.size(); ++i) {
    if ((lanes >> i & 1) != 0)
      samples_[packet[i]].radiance += reflection_.indirect.at(i) * irradiance * share[i];
  }
}

void SampleShader::reflect_around(std::span<const std::uint32_t> packet, std::uint32_t seen) {
  for (std::size_t i = 0; i < packet.size(); ++i) {
    if ((seen >> i & 1) == 0) continue;
    YarnSample& s = samples_[packet[i]];
    const SmoothLight& light = of_.around[s.pixel];
    V3f sum(0, 0, 0);
    for (std::size_t k = 0; k < smooth_functions; ++k)
      sum += light.factors[k] *
             V3f(surface_.sky[3 * k][i], surface_.sky[3 * k + 1][i], surface_.sky[3 * k + 2][i]);
    s.radiance += V3f(std::max(sum.x, 0.0F), std::max(sum.y, 0.0F), std::max(sum.z, 0.0F));
  }
}

/// Adds the direct light of samples from which no yarn hides it.
void SampleShader::cast_shadows(std::size_t number) {
  const std::span<const V3f> direct = std::span(direct_).subspan(number * samples_.size(), samples_.size());
  const Yarns::Inside in = yarns_.inside();
  order_.clear();
  for (std::uint32_t i = 0; i < samples_.size(); ++i) {
    if (direct[i] == V3f(0, 0, 0)) continue;
    const V3f& light = light_of(samples_[i], number).direction;
    const V3f& from = leave_[i];
    const float height = from.z / std::max(light.z, min_rise);
    order_.add(i, V2f(from.x - height * light.x, from.y - height * light.y),
               (in.high - from.z) / (in.high - in.low));
  }
  in_packets(order_.sorted(), [&](std::span<const std::uint32_t> packet) {
    for (std::size_t i = 0; i < packet.size(); ++i) {
      a_.set(i, leave_[packet[i]]);
      direction_.set(i, light_of(samples_[packet[i]], number).direction);
      spacing_[i] = of_.pixels[samples_[packet[i]].pixel].spacing;
    }
    const std::uint32_t hidden = yarns_.occluded(a_, direction_, (1U << packet.size()) - 1, spacing_);
    for (std::size_t i = 0; i < packet.size(); ++i) {
      if ((hidden >> i & 1) != 0) continue;
      samples_[packet[i]].radiance += direct[packet[i]];
      samples_[packet[i]].lit |= 1U << number % 32;
    }
  });
}

}  // namespace selvedge
