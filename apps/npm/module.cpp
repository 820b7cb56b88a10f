// The program in WebAssembly: selvedge's verbs, with files and zlib by a host (run.js). What needs a library
// that is not there says so in a line.
#include <filesystem>

#include "apps/npm/yarn_memory.h"
#include "apps/selvedge-view/commands.h"
#include "apps/selvedge-view/page.h"
#include "apps/selvedge/commands.h"
#include "apps/selvedge/make.h"
#include "converter/light/kept_light.h"
#include "converter/light/ray_scene.h"
#include "fitter/fit.h"
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

/// The words of host_input(), each with '\0' behind it, but for the first two: the working folder and the
/// folder of page.html. Progress goes to the host.
std::vector<std::string> take_words() {
  std::vector<std::string> words;
  const std::string text = host_input();
  for (std::size_t at = 0; at < text.size(); at += words.back().size() + 1)
    words.emplace_back(text.data() + at);
  std::filesystem::working_folder = words[0];
  shared_folder = words[1];
  words.erase(words.begin(), words.begin() + 2);
  progress_sink = std::make_shared<const ProgressSink>(
      [](const std::string& label, double fraction) { host_progress(label.data(), label.size(), fraction); });
  default_relaxer = relaxed_once;
  return words;
}

/// The yarn over texels that are all the same: where these are as many as usual, the file is small, and those
/// of much yarn have room for its light.
Fabric preview_of(const Samples& samples, const MakeOptions& options) {
  const SideSamples front = side_samples(samples, Side::front);
  Fabric fabric = value_or_throw(fit(front.level, front.header, options.fit));
  const FabricLevel texel = std::exchange(fabric.levels, {}).front();
  constexpr int values_per_texel = 1 << 14;
  int size = 3;
  while (samples.header.yarns.stations * light_values_per_station >> 2 * size > values_per_texel) ++size;
  for (int k = size; k >= 0; --k) {
    FabricLevel& level = fabric.levels.emplace_back();
    level.width = level.height = 1 << k;
    level.copy_texels(texel, k);
    level.copied_from_coarser = false;
  }
  fabric.levels.front().set_yarns(std::make_shared<const Yarns>(samples.yarns, samples.header.period_mm));
  return fabric;
}

/// Writes the texels of the fabric of --recolour beneath yarn that differs from its yarn in some places;
/// false: it differs in more.
bool write_edited(const YarnCell& cell, const MakeCommand& command) {
  Fabric fabric = value_or_throw(read_fabric(command.recolour_path));
  const auto last = fabric.levels.front().yarns();
  YarnData yarns = cell.yarns;
  LineLightOptions lines{.both_sides = fabric.find_side(Side::back) != nullptr, .direction_count = 32};
  lines.spacing_radii = 1;
  if (!last || !relight_near_changes(yarns, V2f(cell.period), cell.wall_transmission, *last, lines))
    return false;
  fabric.thickness_mm = static_cast<float>(cell.thickness);
  fabric.levels.front().set_yarns(std::make_shared<const Yarns>(std::move(yarns), fabric.period_mm));
  value_or_throw(write_fabric(command.output, fabric, command.options.write));
  return true;
}

/// Makes a fabric with about the yarn of the one that these options ask for.
void make_preview(MakeCommand command) {
  MakeOptions options = quality_named("draft");
  BakeOptions& of_bake = options.bake;
  of_bake.width = of_bake.height = 1;
  of_bake.views = of_bake.lights = 16;
  of_bake.held_out_pairs = of_bake.validation_pairs = 0;
  of_bake.has_coarse_light = true;
  TerminalProgress relaxation("relax", true);
  TerminalProgress progress("bake", true);
  command.cell.needs_stitch_mesh = false;
  command.cell.progress = relaxation.callback();
  command.cell.on_start = [&](const StitchSize& size) {
    value_or_throw(check_room(size, command.input));
    if (size.length_radii <= 1000) return;
    default_relaxer = relaxed_roughly;
    of_bake.views = of_bake.lights = 9;
  };
  const Cell cell = value_or_throw(find_cell(command.input, command.cell));
  if (!command.recolour_path.empty() && write_edited(*cell.yarn, command)) return;
  const Baked baked =
      value_or_throw(bake(cell.yarn.value(), command.input, of_bake, "{}", progress.callback()));
  value_or_throw(write_fabric(command.output, preview_of(baked.samples, options), options.write));
}

}  // namespace

std::string shared_file(const std::string& name) { return shared_folder + "/" + name; }

Result<void> open_in_browser(const std::string& page) {
  host_open(page.data(), page.size());
  return {};
}

// In place of sources with Ceres and Embree.
void refit_to_pairs(Fabric&, const PairSamples& measured, int, const FitOptions&) {
  if (!measured.pairs.empty())
    throw Failure{{Code::option_out_of_range, {}, {}, "needs Ceres, which the native program alone has"}};
}
Result<RayScene> RayScene::create(const CellMesh&, const std::string& name) {
  return fail(Code::option_out_of_range, name, {}, "needs Embree, which the native program alone has");
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

/// Runs the words of the program; returns the exit status.
[[clang::export_name("run")]] int selvedge_run() {
  const std::vector<std::string> words = take_words();
  std::vector<const char*> pointers{"selvedge"};
  for (const std::string& word : words) pointers.push_back(word.c_str());
  return run_selvedge(static_cast<int>(pointers.size()), pointers.data(), [](Program& program) {
    add_page_verb(program);
    add_design_verb(program);
  });
}

/// Makes what looks about like the fabric of a run of `make`, in a fraction of the time; returns 0, or 1: the
/// run tells why not.
[[clang::export_name("preview")]] int selvedge_preview() {
  const std::vector<std::string> words = take_words();
  const auto make = [&]() -> Result<void> {
    make_preview(value_or_throw(make_command_of({words.begin() + 1, words.end()}, "", "")));
    return {};
  };
  return catch_exceptions("", make) ? 0 : 1;
}
}

}  // namespace selvedge
