// How each path draws a frame, and what they share.
#include <fmt/format.h>

#include <algorithm>
#include <future>

#include "format/base/parallel.h"
#include "viewer/renderer_state.h"

namespace selvedge {

Result<void> Renderer::State::need_pass() {
  if (pass) return {};
  auto made = VisibilityPass::create(gl, mesh, materials, {width, height, band_rows});
  if (!made) return tl::unexpected(made.error());
  pass = std::move(*made);
  return {};
}

Result<void> Renderer::State::draw_shadows(const RenderOptions& look, bool read) {
  maps = {};
  if (look.shadows == 0) return {};
  if (!shadows) {
    auto made = ShadowPass::create(gl, mesh, materials);
    if (!made) return tl::unexpected(made.error());
    shadows = std::move(*made);
  }
  const std::vector<ShadowView> views = shadow_views(look.lights, mesh.positions, origin, look.shadows);
  // A map is in the memory of OpenGL and in that of the program.
  constexpr std::size_t max_texels = std::size_t{1} << 28;
  const auto side = static_cast<std::size_t>(look.shadows);
  if (views.size() * side * side > max_texels) {
    return fail(
        Code::option_out_of_range, "", "--shadows",
        fmt::format("{} maps of {} texels a side are more than {} texels", views.size(), side, max_texels));
  }
  if (auto good = shadows->draw(views); !good) return good;
  if (read)
    maps = shadows->read();
  else
    gl.Finish();
  return {};
}

Result<void> Renderer::State::draw_shader(const Camera& camera, const RenderOptions& look, Frame& frame,
                                          Watch& watch, RenderStats& stats) {
  const ShaderFrame how{width,       height,       options.layers,
                        look.levels, look.ambient, look.shadows > 0 ? shadows.get() : nullptr};
  if (auto good = shader->draw(camera, origin, look.lights, how, &stats.shader); !good) return good;
  gl.Finish();
  watch.add_to(stats.geometry);
  std::vector<V4f>& large = bands[0].large;
  shader->read(large);
  watch.add_to(stats.read_back);
  stats.layers = stats.shader.rounds;
  stats.covered_pixels = std::count_if(large.begin(), large.end(), [](const V4f& p) { return p.w > 0; });
  box_filter(large, 0, options.supersample, frame);
  watch.add_to(stats.filter);
  return {};
}

Result<void> Renderer::State::make_paper(const Scene& scene, const std::vector<Surface>& surfaces,
                                         const std::vector<Fabric>& fabrics) {
  Result<PaperKinds> found = paper_kinds(scene, surfaces, materials, fabrics, remarks);
  if (!found) return tl::unexpected(found.error());
  kinds = std::move(*found);
  kind_looks = looks_of_kinds(kinds);
  auto made = PaperPass::create(gl, mesh, materials.materials, kinds, fabrics, {width, height, band_rows});
  if (!made) return tl::unexpected(made.error());
  paper = std::move(*made);
  return {};
}

Result<void> Renderer::State::draw_paper(const Camera& camera, const RenderOptions& look, int first_row,
                                         Frame& frame, Watch& watch, RenderStats& stats) {
  const BandPixels pixels = pixels_of(bands[0], first_row, frame);
  ShadingScene shading{camera, width, height, kind_looks, packed, look.lights};
  shading.power = look.power;
  for (int y = 0; y < pixels.rows; ++y) std::fill_n(&pixels.at(0, y), pixels.width, V4f(0, 0, 0, 0));
  for (int round = 0; round < options.layers; ++round) {
    const Result<bool> any = paper->draw(clip_matrix(camera, origin), pixels.first_row, round, look.levels);
    if (!any) return tl::unexpected(any.error());
    watch.add_to(stats.geometry);
    if (!*any) break;
    paper->read(coded);
    watch.add_to(stats.read_back);
    const LayerCount count = shade_round(coded, kinds, look.levels.blend, shading, pixels);
    watch.add_to(stats.evaluation);
    if (round == 0) stats.covered_pixels += count.covered;
    stats.evaluated_pixels += count.evaluated;
    if (count.evaluated == 0) break;
    stats.layers = std::max(stats.layers, round + 1);
  }
  filter(bands[0], pixels, frame);
  watch.add_to(stats.filter);
  return {};
}

/// What lies behind the first round, at the deep pixels.
Result<void> Renderer::State::draw_behind(const IndexScene& index, FrameTiles where,
                                          std::array<DrawnSide, 2>& sides, DeepPixels& deep, Watch& watch,
                                          RenderStats& stats) {
  for (int side = 0; side < 2; ++side) {
    DrawnSide& drawn = sides[side];
    deep.take(side, 0, drawn);
    for (int round = 1; round < options.layers && deep.has_more(side, round); ++round) {
      where.tiles = deep.tiles(side, round);
      drawn.list = sift_triangles(mesh, index.projected, drawn.list, where);
      if (auto good = pass->draw(side, round, where.first_row, drawn.list); !good) return good;
      pass->finish();
      watch.add_to(stats.geometry);
      pass->read(side, round, where, drawn.seen);
      watch.add_to(stats.read_back);
      deep.take(side, round, drawn);
    }
  }
  return {};
}

/// Both sides of the cloth, the first round.
Result<void> Renderer::State::draw_nearest(TriangleLists lists, const FrameTiles& where,
                                           std::array<DrawnSide, 2>& sides, Watch& watch,
                                           RenderStats& stats) {
  sides[0].list = std::move(lists.front);
  sides[1].list = std::move(lists.back);
  for (int side = 0; side < 2; ++side) {
    auto good = pass->draw(side, 0, where.first_row, sides[side].list);
    if (!good) return good;
  }
  pass->finish();
  watch.add_to(stats.geometry);
  for (int side = 0; side < 2; ++side) pass->read(side, 0, where, sides[side].seen);
  watch.add_to(stats.read_back);
  return {};
}

/// From what a band's pixels see to the frame. Draws only where the scene has surfaces without fabric.
Result<void> Renderer::State::shade(const IndexScene& index, const ShadingScene& shading, int first_row,
                                    Band& band, Frame& frame, RenderStats& stats) {
  Watch watch;
  const BandPixels pixels = pixels_of(band, first_row, frame);
  DeepPixels deep(width, pixels.rows);
  LayerCount seen = shade_band(index, shading, band.sides, options.layers, pixels, deep);
  if (!deep.empty()) {
    if (band.sides[0].seen.colours.empty()) {
      deep.cast(mesh, index.projected, band.sides, first_row);
    } else {
      watch.add_to(stats.evaluation);
      const FrameTiles where{first_row, pixels.rows, {}};
      if (auto good = draw_behind(index, where, band.sides, deep, watch, stats); !good) return good;
    }
    seen += shade_deep(index, shading, deep, options.layers, pixels);
  }
  watch.add_to(stats.evaluation);
  stats.covered_pixels += seen.covered;
  stats.evaluated_pixels += seen.evaluated;
  stats.layers = std::max(stats.layers, seen.layers);
  filter(band, pixels, frame);
  watch.add_to(stats.filter);
  return {};
}

BandPixels Renderer::State::pixels_of(Band& band, int first_row, Frame& frame) const {
  BandPixels pixels{first_row, width, std::min(band_rows, height - first_row), nullptr, width};
  if (options.supersample > 1) {
    band.large.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(pixels.rows));
    pixels.bottom = band.large.data();
  } else {
    // The frame's first row is at the top.
    pixels.bottom = frame.pixels.data() + static_cast<std::ptrdiff_t>(height - 1 - first_row) * width;
    pixels.stride = -width;
  }
  return pixels;
}

void Renderer::State::filter(const Band& band, const BandPixels& pixels, Frame& frame) const {
  if (options.supersample > 1) box_filter(band.large, pixels.first_row, options.supersample, frame);
}

/// Each band is shaded while the next is drawn.
Result<void> Renderer::State::draw_hybrid(const Camera& camera, const RenderOptions& look, Frame& frame,
                                          Watch& watch, RenderStats& stats) {
  const ProjectedVertices projected = project(mesh, clip_matrix(camera, origin), width, height);
  pass->place(projected);
  std::vector<TriangleLists> lists = list_bands(mesh, projected, materials.materials, band_rows);
  watch.add_to(stats.project);
  const IndexScene index{mesh, projected, materials.materials, packed, look.levels};
  const ShadingScene shading = shading_of(camera, look);
  // What is drawn twice, because of surfaces without fabric, cannot wait for the next band.
  const bool at_once = thread_count() == 1 || pass->has_pbr();
  RenderStats shaded;
  double waited = 0;
  std::future<Result<void>> shading_before;
  const auto finish_before = [&]() -> Result<void> {
    if (!shading_before.valid()) return {};
    return shading_before.get();
  };
  for (std::size_t i = 0; i < lists.size(); ++i) {
    const int first_row = static_cast<int>(i) * band_rows;
    Band& band = bands[i % 2];
    const FrameTiles where{first_row, std::min(band_rows, height - first_row), {}};
    if (auto good = draw_nearest(std::move(lists[i]), where, band.sides, watch, stats); !good) return good;
    if (auto good = finish_before(); !good) return good;
    watch.add_to(waited);
    const auto shade = [&, first_row] { return this->shade(index, shading, first_row, band, frame, shaded); };
    if (!at_once) {
      shading_before = std::async(std::launch::async, shade);
    } else if (auto good = shade(); !good) {
      return good;
    }
    watch.add_to(waited);
  }
  if (auto good = finish_before(); !good) return good;
  stats.geometry += shaded.geometry;
  stats.read_back += shaded.read_back;
  stats.evaluation = shaded.evaluation;
  stats.filter = shaded.filter;
  stats.covered_pixels = shaded.covered_pixels;
  stats.evaluated_pixels = shaded.evaluated_pixels;
  stats.layers = shaded.layers;
  return {};
}

}  // namespace selvedge
