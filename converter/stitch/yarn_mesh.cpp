#include "converter/stitch/yarn_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "converter/stitch/fibres.h"
#include "converter/stitch/flat_yarn.h"
#include "converter/stitch/hairs.h"
#include "converter/stitch/implicit_surface.h"
#include "converter/stitch/marching_cubes.h"
#include "converter/stitch/yarn_curves.h"
#include "converter/stitch/yarn_frames.h"
#include "converter/stitch/yarn_plies.h"

namespace selvedge {
namespace {

constexpr double max_grid_points = 1 << 24;
/// Distances of these from pieces of yarn: more than plied yarn takes in 16 x 16 repeats of a stitch.
constexpr double max_grid_distances = 3e9;

constexpr int min_across = 4;
constexpr int max_across = 1024;

double surface_of(const Yarn& yarn) {
  double length = 0;
  for (const BezierSegment& segment : yarn.segments) {
    for (const CurveSpan& span : spans_of(segment, yarn.radius_mm, yarn.radius_mm)) {
      length += (span.end - span.start).length();
    }
  }
  return 2 * std::numbers::pi * yarn.radius_mm * length;
}

/// The rule of MeshOptions::cells_across.
int cells_across_for(const StitchPattern& pattern, int repeats) {
  constexpr double triangles_per_square = 2.9;  // of marching cubes, for surfaces of all orientations
  constexpr double triangles = 29000;
  const double longer = std::max(pattern.period_mm.x, pattern.period_mm.y) / repeats;
  const double thinnest = thinnest_of(pattern);
  double surface = 0;
  for (const Yarn& yarn : pattern.yarns) surface += surface_of(yarn) / (repeats * repeats);
  const double step =
      std::max(std::min(longer / 40, thinnest / 4),
               std::min(std::sqrt(surface * triangles_per_square / triangles), thinnest / 1.25));
  return static_cast<int>(std::clamp(repeats * std::ceil(longer / step), static_cast<double>(min_across),
                                     static_cast<double>(max_across)));
}

/// The direction of the fibres: along the yarn, turned by its twist at the surface.
V3d fibre_of(const Yarn& yarn, const SurfaceSample& sample) {
  const double slope = 2 * std::numbers::pi * yarn.radius_mm * yarn.twist_per_mm;
  if (yarn.flattening == 1)
    return (sample.tangent + sample.tangent.cross(sample.gradient) * slope).normalized();
  const V3d tangent = squeezed(sample.tangent, sample.squeeze).normalized();
  return stretched(tangent + tangent.cross(sample.round) * slope, sample.squeeze).normalized();
}

/// Strands of fibres are not drawn finer than this, in radii: what is finer is not seen apart.
constexpr double min_strand = 0.14;
/// Length over which a strand stays at the surface, in radii.
constexpr double strand_length = 5;

double length_of(const YarnFrames& frames) { return frames.stations.back().length; }

YarnSkin skin_of(const Yarn& yarn, double length) {
  YarnSkin skin;
  skin.swells = swells_of(length, yarn.radius_mm);
  skin.irregularity = static_cast<float>(yarn.irregularity);
  if (yarn.fibre == 0) return skin;
  const double width = std::max(1e-3 * yarn_kinds()[yarn.fibre].diameter_um, min_strand * yarn.radius_mm);
  skin.strands = std::max(6, static_cast<int>(std::lround(2 * std::numbers::pi * yarn.radius_mm / width)));
  skin.lays = static_cast<int>(std::lround(length * yarn.twist_per_mm));
  skin.pieces = std::max(2, static_cast<int>(std::lround(length / (strand_length * yarn.radius_mm))));
  return skin;
}

YarnPlace place_of(const YarnFrames& frames, const SurfaceSample& sample) {
  const double length = sample.along * length_of(frames);
  const auto& stations = frames.stations;
  const auto next = std::upper_bound(stations.begin() + 1, stations.end() - 1, length,
                                     [](double at, const YarnStation& s) { return at < s.length; });
  const auto before = next - 1;
  const double part = std::clamp((length - before->length) / (next->length - before->length), 0.0, 1.0);
  const V3d across = before->across * (1 - part) + next->across * part;
  const double angle = std::atan2(sample.round.dot(sample.tangent.cross(across)), sample.round.dot(across));
  // The frame's rotation over the repeat is spread along it, so that angles meet there.
  const double turns = (angle + frames.turned * sample.along) / (2 * std::numbers::pi);
  return {sample.yarn, static_cast<float>(sample.along), static_cast<float>(turns - std::round(turns))};
}

/// Gives the curves of a mesh the strands of its skins. Those of plies are numbered by the plies' course
/// about their yarn's axis, so that they are others than the mesh's, of the same kind.
void give_strands(const StitchPattern& described, const StitchPattern& laid, CellMesh& mesh) {
  std::size_t c = 0;
  int skin = 0;
  for (const Yarn& yarn : described.yarns) {
    if (yarn.plies == 1 || mesh.yarns.curves[c].plies.count == 1) {
      const int chains = yarn.plies == 1 ? 1 : std::gcd(course_of_plies(yarn).shift, yarn.plies);
      for (int k = 0; k < chains; ++k) mesh.yarns.curves[c++].strands = strands_of(mesh, skin++);
      continue;
    }
    YarnCurve& curve = mesh.yarns.curves[c++];
    const YarnPlies& plies = curve.plies;
    const int chains = std::gcd(plies.shift, plies.count);
    const int passes = plies.count / chains;
    YarnStrands& strands = curve.strands;
    strands = strands_of(mesh, skin);
    strands.pieces = std::max(2, strands.pieces / passes);
    strands.swells =
        strands.irregularity > 0 ? laid.yarns[skin].swells.swells : std::max(2, strands.swells / passes);
    skin += chains;
    const PlyCourse course = course_of_plies(yarn);
    const double length = course.frames.stations.back().length;
    const double turns = static_cast<double>(plies.shift) / plies.count;
    const double ply = static_cast<double>(radius_of_plies(curve));
    const double climb = 2 * std::numbers::pi * turns * (static_cast<double>(curve.radius) - ply) / length;
    const double lean = static_cast<double>(curve.fibre_slope) * length / (2 * std::numbers::pi * ply);
    // The frame of the axis turns about a ply by what the ply's course falls short of a flat circle.
    const double lays = lean * std::hypot(1, climb) + turns * (1 - 1 / std::hypot(1, climb));
    strands.shift =
        static_cast<int>(std::lround(std::clamp(lays * strands.count, -1.0 * max_pieces, 1.0 * max_pieces)));
  }
}

Result<MarchingGrid> grid_for(const StitchPattern& pattern, int cells_across, double low, double high) {
  const double longer = std::max(pattern.period_mm.x, pattern.period_mm.y);
  const double step = longer / cells_across;
  const auto cells = [&](double extent) { return std::max(1.0, std::round(extent / step)); };
  const double x = cells(pattern.period_mm.x);
  const double y = cells(pattern.period_mm.y);
  const double z = std::ceil((high - low) / step) + 2;  // plus an empty cube below and above
  const auto refuse = [&](std::string why) {
    return fail(Code::option_out_of_range, pattern.name, "--grid", std::move(why));
  };
  if ((x + 1) * (y + 1) * (z + 1) >= max_grid_points) {
    return refuse(fmt::format("{} make a grid of {:.0f} points, at most {:.0f}", cells_across,
                              (x + 1) * (y + 1) * (z + 1), max_grid_points));
  }
  const double thinnest = thinnest_of(pattern);
  if (step > thinnest) {
    return refuse(fmt::format("{} are too few for a yarn of radius {} mm, at least {:.0f}", cells_across,
                              thinnest, std::ceil(longer / thinnest)));
  }
  MarchingGrid grid;
  grid.period = pattern.period_mm;
  grid.cells = {static_cast<int>(x), static_cast<int>(y), static_cast<int>(z)};
  grid.z_step = step;
  grid.z_min = 0.5 * (low + high - z * step);
  return grid;
}

}  // namespace

Result<CellMesh> mesh_stitch(const StitchPattern& described, const MeshOptions& options) {
  if (auto sound = validate(described, described.name); !sound) return tl::unexpected(sound.error());
  const auto laid = lay_plies(described, described.name);
  if (!laid) return tl::unexpected(laid.error());
  const StitchPattern& pattern = *laid;
  const int cells_across =
      options.cells_across ? *options.cells_across : cells_across_for(pattern, options.repeats);
  if (cells_across < min_across || cells_across > max_across) {
    return fail(Code::option_out_of_range, pattern.name, "--grid",
                fmt::format("must lie in {} to {}, are {}", min_across, max_across, cells_across));
  }
  // The search along an edge needs exact values up to the length of an edge.
  const double reach = std::max(pattern.period_mm.x, pattern.period_mm.y) / cells_across * 2;
  const auto surface = ImplicitSurface::build(pattern, reach, pattern.name);
  if (!surface) return tl::unexpected(surface.error());
  const auto grid = grid_for(pattern, cells_across, surface->low(), surface->high());
  if (!grid) return tl::unexpected(grid.error());
  const double points = 1.0 * grid->cells.x * grid->cells.y * grid->cells.z;
  if (points * surface->pieces_per_point() > max_grid_distances) {
    return fail(Code::mesh_invalid, pattern.name, "/yarns",
                "the yarns are too many and too close to each other for the grid");
  }
  const MarchedSurface marched = march(*grid, [&](const V3d& p) { return surface->distance(p); });
  if (marched.triangles.empty()) {
    return fail(Code::mesh_empty, pattern.name, "", "the yarns enclose no grid point");
  }

  CellMesh mesh;
  mesh.period = pattern.period_mm;
  mesh.triangles = marched.triangles;
  auto curves = yarn_curves_of(described);
  if (!curves) return tl::unexpected(curves.error());
  mesh.yarns = std::move(*curves);
  mesh.positions.reserve(marched.positions.size());
  const auto any = [&](const auto& test) {
    return std::any_of(pattern.yarns.begin(), pattern.yarns.end(), test);
  };
  const bool glossy = any([](const Yarn& yarn) { return yarn.gloss.weight > 0 || yarn.fibre != 0; });
  const bool translucent = any([](const Yarn& yarn) { return yarn.transmission > 0; });
  const bool varied =
      any([](const Yarn& yarn) { return yarn.fibre != 0 || yarn.irregularity > 0 || yarn.hairiness > 0; });
  std::vector<YarnFrames> frames;
  if (varied) {
    mesh.seed = pattern.seed;
    for (const Yarn& yarn : pattern.yarns) {
      frames.push_back(frames_of(yarn, 0.5 * yarn.radius_mm));
      mesh.skins.push_back(skin_of(yarn, length_of(frames.back())));
    }
  }
  for (std::size_t v = 0; v < marched.positions.size(); ++v) {
    mesh.positions.emplace_back(marched.positions[v]);
    const std::size_t original = marched.original[v];
    if (original != v) {  // an original precedes its copies
      mesh.normals.push_back(mesh.normals[original]);
      mesh.albedo.push_back(mesh.albedo[original]);
      if (glossy) mesh.fibres.push_back(mesh.fibres[original]);
      if (glossy) mesh.gloss.push_back(mesh.gloss[original]);
      if (translucent) mesh.transmission.push_back(mesh.transmission[original]);
      if (varied) mesh.places.push_back(mesh.places[original]);
      continue;
    }
    const SurfaceSample sample = surface->sample(marched.positions[v]);
    const Yarn& yarn = pattern.yarns[sample.yarn];
    mesh.normals.emplace_back(sample.widening == 0
                                  ? sample.gradient
                                  : (sample.gradient - sample.tangent * sample.widening).normalized());
    mesh.albedo.push_back(yarn.albedo);
    if (glossy) mesh.fibres.emplace_back(fibre_of(yarn, sample));
    if (glossy) mesh.gloss.push_back(yarn.gloss);
    if (translucent) mesh.transmission.push_back(static_cast<float>(yarn.transmission));
    if (varied) mesh.places.push_back(place_of(frames[sample.yarn], sample));
  }
  if (varied) {
    give_strands(described, pattern, mesh);
    mesh.hairs = grow_hairs(mesh);
  }
  return mesh;
}

}  // namespace selvedge
