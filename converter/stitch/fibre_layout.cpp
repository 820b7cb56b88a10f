#include "converter/stitch/fibre_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "converter/mesh/yarn_noise.h"
#include "converter/stitch/fibres.h"
#include "converter/stitch/flat_yarn.h"
#include "converter/stitch/hairs.h"
#include "converter/stitch/implicit_surface.h"
#include "converter/stitch/yarn_frames.h"
#include "converter/stitch/yarn_plies.h"

namespace selvedge {
namespace {

using std::numbers::pi;

// Independent rows of noise.
constexpr std::uint64_t stream_place = 41;
constexpr std::uint64_t stream_sway = 42;

/// Points are this far from each other, in radii of the ply.
constexpr double step_radii = 0.6;
/// A fibre keeps its place among others over this length, in radii of the ply.
constexpr double sway_radii = 5;
/// Root mean square of a fibre's way from its place, in distances of fibres.
constexpr double sway = 0.5;
/// Root mean square change of a fibre's thickness to the next, relative.
constexpr double unlike = 0.1;

/// Fibres of one ply, in a plane across it.
struct Section {
  int count = 1;
  double radius_mm = 0;  // of a fibre
};

Result<Section> section_of(const Yarn& ply, const FibreLayout& layout, const std::string& name) {
  Section section;
  const double real = 0.5e-3 * fibre_of(ply.fibre).diameter_um;
  const double fill = layout.packing * ply.radius_mm * ply.radius_mm;
  const double count =
      layout.each_ply > 0 ? layout.each_ply : std::max(1.0, std::round(fill / (real * real)));
  if (count > max_fibres_each_ply) {
    return fail(Code::option_out_of_range, name, "--fibres",
                fmt::format("{:.0f} fibres a ply are more than {}", count, max_fibres_each_ply));
  }
  section.count = static_cast<int>(count);
  section.radius_mm = std::sqrt(fill / count);
  return section;
}

void lay_ply(const Yarn& ply, int index, const Section& section, std::uint64_t seed, Fibres& fibres) {
  const YarnFrames frames = frames_of(ply, step_radii * ply.radius_mm);
  const double length = frames.stations.back().length;
  // As the strands at the surface: whole turns, and the frame's rotation is spread along the repeat.
  const double turn = 2 * pi * static_cast<double>(std::lround(length * ply.twist_per_mm)) - frames.turned;
  const int places = std::max(2, static_cast<int>(std::lround(length / (sway_radii * ply.radius_mm))));
  const double room = ply.radius_mm - section.radius_mm;
  const double between = ply.radius_mm * std::sqrt(pi / section.count);
  for (int k = 0; k < section.count; ++k) {
    const std::uint64_t own = mix(mix(seed ^ mix(stream_place + static_cast<std::uint64_t>(index))) ^
                                  static_cast<std::uint64_t>(k));
    // Evenly over a disc: a spiral of golden angles.
    const double r = room * std::sqrt((k + 0.5) / section.count);
    const double angle = k * pi * (3 - std::sqrt(5.0));
    fibres.first.push_back(static_cast<int>(fibres.points.size()));
    fibres.radius.push_back(static_cast<float>(section.radius_mm * (1 + unlike * lattice_noise(own, 1))));
    fibres.yarn.push_back(index);
    for (const YarnStation& s : frames.stations) {
      const double share = s.length / length;
      const auto noise = [&](std::int64_t row) {
        return sway * between * closed_noise(own ^ mix(stream_sway), row, places, share * places);
      };
      V2d at(r * std::cos(angle) + noise(0), r * std::sin(angle) + noise(1));
      if (at.length() > room) at *= room / at.length();
      at *= strand_swell(ply.swells, share * ply.passes, byte_of_thickness);
      const double turned = turn * share;
      const V2d placed(at.x * std::cos(turned) - at.y * std::sin(turned),
                       at.x * std::sin(turned) + at.y * std::cos(turned));
      const V3d off = s.across * placed.x + s.tangent.cross(s.across) * placed.y;
      fibres.points.emplace_back(s.position + stretched(off, s.squeeze) * thin_radius(1.0, s.squeeze));
    }
  }
}

void add_hairs(const CellMesh& mesh, Fibres& fibres) {
  for (std::size_t h = 0; h < mesh.hairs.roots.size(); ++h) {
    const auto first = mesh.hairs.points.begin() + static_cast<std::ptrdiff_t>(h * Hairs::points_each);
    fibres.first.push_back(static_cast<int>(fibres.points.size()));
    fibres.radius.push_back(mesh.hairs.radius[h]);
    fibres.yarn.push_back(mesh.places[mesh.triangles[mesh.hairs.roots[h]].x].skin);
    fibres.points.insert(fibres.points.end(), first, first + Hairs::points_each);
  }
}

}  // namespace

Result<Fibres> lay_fibres(const StitchPattern& pattern, const CellMesh& mesh, const FibreLayout& layout) {
  const auto laid = lay_plies(pattern, pattern.name);
  if (!laid) return tl::unexpected(laid.error());
  Fibres fibres;
  fibres.period = laid->period_mm;
  for (std::size_t y = 0; y < laid->yarns.size(); ++y) {
    const Yarn& ply = laid->yarns[y];
    const auto section = section_of(ply, layout, pattern.name);
    if (!section) return tl::unexpected(section.error());
    double length = 0;
    for (const BezierSegment& segment : ply.segments) length += polygon_length(segment);
    const double expected = section->count * (length / (step_radii * ply.radius_mm) +
                                              2.0 * static_cast<double>(ply.segments.size()));
    if (expected + static_cast<double>(fibres.points.size()) > max_fibre_points) {
      return fail(Code::mesh_invalid, pattern.name, fmt::format("/yarns/{}", y),
                  fmt::format("its fibres would have more than {} points", max_fibre_points));
    }
    lay_ply(ply, static_cast<int>(y), *section, laid->seed, fibres);
    fibres.yarns.push_back(ply);
    fibres.yarns.back().segments.clear();
  }
  add_hairs(mesh, fibres);
  fibres.first.push_back(static_cast<int>(fibres.points.size()));
  return fibres;
}

}  // namespace selvedge
