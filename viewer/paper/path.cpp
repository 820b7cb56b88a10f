#include "viewer/paper/path.h"

#include <algorithm>

namespace selvedge {

Result<std::unique_ptr<PaperPath>> PaperPath::create(const GlFunctions& gl, const Scene& scene,
                                                     const std::vector<Surface>& surfaces,
                                                     const std::vector<Fabric>& fabrics,
                                                     const PreparedScene& prepared, const FrameSize& size,
                                                     std::vector<std::string>& remarks) {
  std::unique_ptr<PaperPath> path(new PaperPath(prepared));
  Result<PaperKinds> kinds = paper_kinds(scene, surfaces, prepared.materials, fabrics, remarks);
  if (!kinds) return tl::unexpected(kinds.error());
  path->kinds_ = std::move(*kinds);
  path->bands_ = bands_of(size);
  path->layers_ = size.layers;
  auto pass =
      PaperPass::create(gl, prepared.mesh, prepared.materials.surfaces, path->kinds_, fabrics, path->bands_);
  if (!pass) return tl::unexpected(pass.error());
  path->pass_ = std::move(*pass);
  return path;
}

Result<void> PaperPath::resize(const FrameSize& size) {
  bands_ = bands_of(size);
  layers_ = size.layers;
  return pass_->resize(bands_);
}

Result<void> PaperPath::draw(const FrameView& view, Frame& frame, RenderStats& stats) {
  for (int first_row = 0; first_row < bands_.height && !view.options.ends(); first_row += bands_.rows) {
    if (auto good = draw_band(view, first_row, frame, stats); !good) return good;
  }
  return {};
}

Result<void> PaperPath::draw_band(const FrameView& view, int first_row, Frame& frame, RenderStats& stats) {
  Stopwatch watch;
  const LevelOptions& levels = view.options.levels;
  const M44d clip = clip_matrix(view.camera, scene_.origin);
  const BandPixels pixels = pixels_of(bands_, first_row, frame, large_);
  ShadingScene shading{view.camera,  bands_.width,   bands_.height,
                       kinds_.kinds, scene_.fabrics, view.options.lights};
  shading.power = view.options.power;
  for (int y = 0; y < pixels.rows; ++y) std::fill_n(&pixels.at(0, y), pixels.width, V4f(0, 0, 0, 0));
  for (int round = 0; round < layers_; ++round) {
    const Result<bool> any = pass_->draw(clip, first_row, round, levels);
    if (!any) return tl::unexpected(any.error());
    watch.add_to(stats.geometry);
    if (!*any) break;
    pass_->read(coded_);
    watch.add_to(stats.read_back);
    const LayerCount count = shade_round(coded_, kinds_, levels.blend, shading, pixels);
    watch.add_to(stats.evaluation);
    if (round == 0) stats.covered_pixels += count.covered;
    stats.evaluated_pixels += count.evaluated;
    if (count.evaluated == 0) break;
    stats.layers = std::max(stats.layers, round + 1);
  }
  filter_band(bands_, first_row, large_, frame);
  watch.add_to(stats.filter);
  return {};
}

}  // namespace selvedge
