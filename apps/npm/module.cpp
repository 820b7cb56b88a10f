// The program in WebAssembly: selvedge's verbs, with files and zlib by a host (run.js). What needs a library
// that is not there says so in a line.
#include <filesystem>

#include "apps/selvedge-view/commands.h"
#include "apps/selvedge-view/page.h"
#include "apps/selvedge/commands.h"
#include "converter/light/ray_scene.h"
#include "fitter/refit_to_pairs.h"
#include "format/base/guard.h"
#include "format/base/progress.h"
#include "format/web/host.h"

namespace selvedge {

std::string& host_input() {
  static std::string text;
  return text;
}

namespace {

std::string shared_folder;

}  // namespace

std::string shared_file(const std::string& name) { return shared_folder + "/" + name; }

Result<void> open_in_browser(const std::string& page) {
  host_open(page.data(), page.size());
  return {};
}

// In place of sources with Ceres and Embree.
void refit_to_pairs(Fabric&, const PairSamples& measured, int, const FitOptions&) {
  if (!measured.pairs.empty())
    throw Failure{{Code::option_out_of_range,
                   {},
                   {},
                   "needs a fit to pairs (Ceres), which the native program alone has"}};
}
Result<RayScene> RayScene::create(const CellMesh&, const std::string& name) {
  return fail(Code::option_out_of_range, name, {},
              "needs rays on a mesh (Embree), which the native program alone has");
}
// Nobody calls these.
const Imath::Box3f& RayScene::bounds() const { std::abort(); }
V2d RayScene::period() const { std::abort(); }
const CellMesh& RayScene::mesh() const { std::abort(); }
bool RayScene::trace(const V3d&, const V3d&, SurfacePoint&) const { std::abort(); }
std::uint32_t RayScene::trace(std::span<const V3d>, const V3d&, PointPacket&) const { std::abort(); }
bool RayScene::is_occluded(const SurfacePoint&, const V3f&) const { std::abort(); }
std::uint32_t RayScene::is_occluded(const OffsetOrigins&, const V3f&, std::uint32_t) const { std::abort(); }
std::uint32_t RayScene::is_occluded(const SurfacePoint&, std::span<const V3f>, std::uint32_t) const {
  std::abort();
}
V3d RayScene::offset_origin(const SurfacePoint&) const { std::abort(); }
OffsetOrigins RayScene::offset_origin(const PointPacket&, std::uint32_t) const { std::abort(); }
V3f RayScene::vertex_normal(const SurfacePoint&) const { std::abort(); }

extern "C" {
/// Room for bytes from the host.
[[clang::export_name("input")]] char* selvedge_input(std::size_t count) {
  host_input().resize(count);
  return host_input().data();
}

/// Runs the words of host_input(), each with '\0' behind it; the first two are the working folder and the
/// folder of page.html. Returns the exit status.
[[clang::export_name("run")]] int selvedge_run() {
  const std::string text = host_input();
  std::vector<const char*> words;
  for (std::size_t at = 0; at < text.size(); at = text.find('\0', at) + 1) words.push_back(text.data() + at);
  std::filesystem::working_folder = std::string(words.front());
  progress_sink = std::make_shared<const ProgressSink>(
      [](const std::string& label, double fraction) { host_progress(label.data(), label.size(), fraction); });
  shared_folder = words[1];
  words[1] = "selvedge";
  return run_selvedge(static_cast<int>(words.size()) - 1, words.data() + 1, [](Program& program) {
    add_page_verb(program);
    add_design_verb(program);
  });
}
}

}  // namespace selvedge
