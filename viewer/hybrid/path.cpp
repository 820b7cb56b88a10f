#include "viewer/hybrid/path.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <future>

#include "format/base/parallel.h"

namespace selvedge {

void FrameRenderer::resize(const FrameSize& size) {
  bands_ = bands_of(size);
  layers_ = size.layers;
  pass_.resize(bands_);
}

FrameScene FrameRenderer::begin(const FrameView& view, const ProjectedVertices& projected) {
  FrameScene scene{scene_, view, projected, {}, cells_, kind_ == RenderPath::paper};
  scene.shadows = view.shadows;
  cells_.begin(view, !scene.is_paper, bands_.supersample, scene.shadows, projected);
  return scene;
}

/// Draws the first round of both sides of the cloth.
void FrameRenderer::draw_nearest(TriangleLists lists, int first_row, int rows,
                                 std::array<DrawnSide, 2>& sides, Stopwatch& watch, RenderStats& stats) {
  sides[0].triangle_list = std::move(lists.front);
  sides[1].triangle_list = std::move(lists.back);
  for (int side = 0; side < 2; ++side) pass_.draw(side, 0, first_row, sides[side].triangle_list);
  pass_.finish();
  watch.add_lap(stats.geometry_seconds);
  for (int side = 0; side < 2; ++side) pass_.read(side, 0, rows, sides[side].visible);
  watch.add_lap(stats.read_back_seconds);
}

/// Draws the surfaces behind the first round at deep pixels.
void FrameRenderer::draw_behind(int first_row, int rows, std::array<DrawnSide, 2>& sides, DeepPixels& deep,
                                Stopwatch& watch, RenderStats& stats) {
  for (int side = 0; side < 2; ++side) {
    DrawnSide& drawn = sides[side];
    deep.add_depth_layer(side, 0, drawn);
    for (int round = 1; round < layers_ && deep.has_depth_layer(side, round); ++round) {
      pass_.draw(side, round, first_row, drawn.triangle_list);
      pass_.finish();
      watch.add_lap(stats.geometry_seconds);
      pass_.read(side, round, rows, drawn.visible);
      watch.add_lap(stats.read_back_seconds);
      deep.add_depth_layer(side, round, drawn);
    }
  }
}

/// Shades a band into the frame. Draws only if the scene has surfaces without fabric.
void FrameRenderer::shade(const FrameScene& scene, int first_row, Band& band, std::span<Frame> frames,
                          RenderStats& stats) {
  Stopwatch watch;
  const BandPixels pixels = pixels_of(bands_, first_row, frames, band.large);
  DeepPixels deep;
  LayerCount seen = shade_band(scene, cells_, band.surfaces, layers_, pixels, deep);
  if (!deep.empty()) {
    watch.add_lap(stats.evaluation_seconds);
    draw_behind(first_row, pixels.rows, band.surfaces.sides, deep, watch, stats);
    seen += shade_deep_pixels(scene, cells_, deep, layers_, pixels);
  }
  watch.add_lap(stats.evaluation_seconds);
  stats.covered_pixels += seen.covered_pixels;
  stats.evaluated_pixels += seen.evaluated_pixels;
  stats.cloth_pixels += seen.cloth_pixels;
  stats.layers = std::max(stats.layers, seen.layers);
  filter_band(bands_, first_row, band.large, frames);
  watch.add_lap(stats.filter_seconds);
}

void FrameRenderer::draw(const FrameView& view, std::span<Frame> frames, RenderStats& stats) {
  Stopwatch watch;
  const ProjectedVertices projected =
      project(scene_.mesh, clip_matrix(view.camera, scene_.origin), bands_.width, bands_.height);
  const bool casts = this->casts(view.options);
  if (!casts) pass_.set_vertices(projected);
  std::vector<TriangleLists> lists =
      list_bands(scene_.mesh, projected, scene_.materials.surfaces, bands_.rows);
  const FrameScene scene = begin(view, projected);
  watch.add_lap(stats.project_seconds);
  // Surfaces without fabric need further rounds of the same band, so drawing and shading cannot overlap.
  const DrawOptions& options = view.options;
  const bool at_once = thread_count() == 1 || pass_.has_pbr() || casts;
  std::future<void> shading_before;
  const auto finish_before = [&] {
    if (shading_before.valid()) shading_before.get();
  };
  for (std::size_t i = 0; i < lists.size() && !options.is_interrupted(); ++i) {
    const int first_row = static_cast<int>(i) * bands_.rows;
    Band& band = in_flight_[i % 2];
    const int rows = bands_.band_row_count(first_row);
    if (options.blocks != nullptr &&
        !options.blocks->has_drawn_rows(first_row / bands_.supersample, rows / bands_.supersample))
      continue;
    watch = {};
    band.surfaces.is_cpu_raster = casts;
    if (casts) {
      band.surfaces.sides[0].triangle_list = std::move(lists[i].front);
      band.surfaces.sides[1].triangle_list = std::move(lists[i].back);
      band.surfaces.draw_band(scene, first_row, rows);
      watch.add_lap(stats.geometry_seconds);
    } else {
      draw_nearest(std::move(lists[i]), first_row, rows, band.surfaces.sides, watch, stats);
    }
    finish_before();
    // Drawing and shading that overlap have their own members of the statistics.
    const auto shade = [&, first_row] { this->shade(scene, first_row, band, frames, stats); };
    if (at_once)
      shade();
    else
      shading_before = std::async(std::launch::async, shade);
  }
  finish_before();
  if (!view.options.is_interrupted()) {
    const CellMemory memory = cells_.end();
    stats.peak_image_bytes = static_cast<std::int64_t>(memory.peak_bytes);
    if (memory.is_coarser)
      stats.remarks.push_back(
          fmt::format("cell images are coarser than wanted: these take {:.0f} MiB, --image-memory is {}",
                      std::ceil(memory.wanted_bytes / (1 << 20)), view.options.cells.memory_bytes >> 20));
  }
}

std::optional<PixelProbe> FrameRenderer::probe_surface(const FrameView& view, const V2i& pixel) {
  Stopwatch watch;
  RenderStats unwanted;
  const int row = bands_.height - 1 - pixel.y;
  const ProjectedVertices projected =
      project(scene_.mesh, clip_matrix(view.camera, scene_.origin), bands_.width, bands_.height);
  pass_.set_vertices(projected);
  std::array<DrawnSide, 2>& sides = in_flight_[0].surfaces.sides;
  // A band of one row.
  std::vector<TriangleLists> lists =
      list_bands(scene_.mesh, projected, scene_.materials.surfaces, bands_.rows);
  draw_nearest(std::move(lists[row / bands_.rows]), row, 1, sides, watch, unwanted);
  const std::optional<TriangleSide> seen = nearest_surface(sides, pixel.x);
  if (!seen) return std::nullopt;
  const FrameScene scene = begin(view, projected);
  if (cells_.shows(*seen)) cells_.mark_visible(*seen, pixel.x, row);
  cells_.render();
  return probe_pixel(scene, *seen, V2i(pixel.x, row), sides[*seen % 2].pbr_at(pixel.x));
}

}  // namespace selvedge
