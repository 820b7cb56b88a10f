#include "format/fabric/yarn_copies.h"

#include <algorithm>
#include <cmath>

#include "format/fabric/yarns.h"

namespace selvedge {
namespace {

/// The light of a curve's stations: from the two nearest ones of its pieces.
void append_light(const YarnCopies& pieces, const std::vector<float>& light, std::span<const int> kinds,
                  const YarnCurve& curve, const ChainFrames& frames, std::vector<float>& to) {
  // validate() refuses a chain without length.
  if (!(frames.length.back() > 0)) return;
  for (int s = 0; s < curve.stations; ++s) {
    const double fraction = static_cast<double>(s) / curve.stations;
    const double at = fraction * frames.length.back();
    const auto next = std::upper_bound(frames.length.begin(), frames.length.end() - 1, at);
    const auto node = next - frames.length.begin() - 1;
    const double place = (static_cast<double>(node) + (at - *(next - 1)) / (*next - *(next - 1))) *
                         pieces.stations / pieces.nodes;
    const auto whole = static_cast<std::size_t>(place);
    to.resize(to.size() + light_values_per_station);
    for (const std::size_t station : {whole, whole + 1}) {
      const std::size_t piece = station / pieces.stations % kinds.size();
      const std::size_t own = std::size_t{1} * kinds[piece] * pieces.stations + station % pieces.stations;
      const double weight = 1 - std::abs(place - static_cast<double>(station));
      const double beyond = station / pieces.stations == kinds.size() ? 1 : 0;
      add_rotated_light(std::span(light).subspan(own * light_values_per_station, light_values_per_station),
                        angle_from_piece(frames, piece * pieces.nodes, fraction - beyond), weight,
                        curve.plies.sides != 0, std::span(to).last(light_values_per_station));
    }
  }
}

}  // namespace

double angle_from_piece(const ChainFrames& frames, std::size_t start, double fraction) {
  const V3d& tangent = frames.tangent[start];
  const V3d own = upward_across(tangent);
  const double angle =
      std::atan2(own.cross(frames.across[start]).dot(tangent), own.dot(frames.across[start]));
  return angle - frames.closing_angle * (fraction - frames.length[start] / frames.length.back());
}

void add_rotated_light(std::span<const float> from, double angle, double weight, bool sides,
                       std::span<float> to) {
  const auto add = [&](std::size_t begin, std::size_t values) {
    for (std::size_t i = 0; i < values; ++i) to[begin + i] += static_cast<float>(weight) * from[begin + i];
    for (const std::size_t pair : {1, 3}) {
      const double turn = pair == 3 && !sides ? 2 * angle : angle;
      const auto cosine = static_cast<float>(weight * std::cos(turn));
      const auto sine = static_cast<float>(weight * std::sin(turn));
      for (std::size_t i = begin + pair * values; i < begin + (pair + 1) * values; ++i) {
        to[i] += cosine * from[i] + sine * from[i + values];
        to[i + values] += cosine * from[i + values] - sine * from[i];
      }
    }
  };
  add(0, transfer_values_per_station / angle_function_count);
  for (int n = 0; n < light_moment_count; ++n)
    add(std::size_t{transfer_values_per_station} + std::size_t{angle_function_count} * n, 1);
}

void expand_copies(YarnData& data, const V2f& period) {
  const YarnCopies& pieces = data.copies;
  data.nodes.clear();
  data.station_light.clear();
  data.light_through.clear();
  std::size_t first = 0;
  for (YarnCurve& curve : data.curves) {
    const auto count = static_cast<std::size_t>(curve.nodes / pieces.nodes);
    const std::span kinds = std::span(pieces.kind_of).subspan(first, count);
    const bool squashed = !curve.squeezes.empty();
    curve.squeezes.clear();
    for (std::size_t p = 0; p < count; ++p) {
      const V3f& start = pieces.starts[first + p];
      const V3f turns(static_cast<float>(curve.repeat_offset.x) * period.x,
                      static_cast<float>(curve.repeat_offset.y) * period.y, 0);
      const V3f way = (p + 1 < count ? pieces.starts[first + p + 1] : pieces.starts[first] + turns) - start;
      for (int i = 0; i < pieces.nodes; ++i) {
        const std::size_t own = std::size_t{1} * kinds[p] * pieces.nodes + i;
        data.nodes.push_back(start + way * (static_cast<float>(i) / static_cast<float>(pieces.nodes)) +
                             pieces.shape[own]);
        if (squashed) curve.squeezes.push_back(pieces.squeezes[own]);
      }
    }
    const ChainFrames frames = chain_frames(curve, std::span(data.nodes).last(curve.nodes), period);
    append_light(pieces, pieces.light, kinds, curve, frames, data.station_light);
    if (!pieces.light_through.empty())
      append_light(pieces, pieces.light_through, kinds, curve, frames, data.light_through);
    first += count;
  }
}

}  // namespace selvedge
