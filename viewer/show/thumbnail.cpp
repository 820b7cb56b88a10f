#include "viewer/show/thumbnail.h"

#include <algorithm>
#include <filesystem>

#include "format/base/option_text.h"
#include "format/fabric/file.h"
#include "format/picture/display.h"
#include "format/scene/swatch.h"
#include "viewer/render.h"

namespace selvedge {

Result<OfferedFabric> offer_of(const std::string& path, std::uint64_t max_memory,
                               const std::atomic<bool>& interrupted) {
  std::vector<Fabric> fabrics(1);
  Result<Fabric> read = read_fabric(path, {.memory = max_memory});
  if (!read) return tl::unexpected(read.error());
  fabrics[0] = std::move(*read);
  const V2d period(fabrics[0].period_mm);
  const SwatchShot shot = swatch_shot(SwatchView::near, period, thumbnail_side, thumbnail_side);
  Scene scene = swatch_scene(period, shot);
  scene.fabrics.emplace_back().name = path;
  RenderOptions options;
  options.width = options.height = thumbnail_side;
  options.supersample = 2;
  options.layers = 1;
  options.lights = shot.lights;
  options.interrupted = &interrupted;
  const Result<Frame> frame = render(scene, fabrics, shot.camera, options);
  if (!frame) return tl::unexpected(frame.error());
  OfferedFabric offer{path, {}};
  to_display_bytes(*frame, default_display(), offer.picture);
  return offer;
}

std::vector<std::string> fabrics_in(const std::string& folder) {
  std::vector<std::string> paths;
  std::error_code no_folder;
  for (std::filesystem::directory_iterator at(folder, no_folder), end; at != end; at.increment(no_folder)) {
    if (has_ending(at->path().string(), ".exr")) paths.push_back(at->path().string());
  }
  std::ranges::sort(paths);
  return paths;
}

}  // namespace selvedge
