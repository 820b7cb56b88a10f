// page: garments and fabrics as one file that a browser shows by itself.
#include "apps/selvedge-view/page.h"

#include <fmt/format.h>
#include <zlib.h>

#include <cmath>
#include <filesystem>

#include "apps/common/html.h"
#include "apps/selvedge-view/commands.h"
#include "format/base/atomic_file.h"
#include "format/fabric/file.h"
#include "format/gltf/edit.h"
#include "format/gltf/fabric_extension.h"
#include "format/gltf/geometry.h"
#include "format/gltf/names.h"
#include "format/picture/environment.h"
#include "format/scene/framing.h"
#include "viewer/light/floor.h"
#include "viewer/load.h"

namespace selvedge {
namespace {

namespace fs = std::filesystem;

void declare(Options& options, PageCommand& command) {
  options
      .list("input", command.inputs, "FILE",
            "Garments (.gltf, .glb), side by side; fabrics (.exr), to be swapped on them, or flat")
      .required()
      .word_count(1, 64)
      .reads();
  add_page_output(options, command);
  add_limits(options, command.limits);
  add_environment(options, command.environment, command.environment_options,
                  "With none a finger moves two lamps");
  options.flag("--backdrop", command.has_backdrop, "Shows it behind the garments");
  options.number("--backdrop-blur", command.backdrop_blur, "FRACTION", "Blurred, up to 1").in_range(0, 1);
  add_fps(options, command.fps);
  options.add_check([&options, &command] {
    options.refuse_if(command.environment == "none", "has no effect with --environment none", {"--backdrop"});
    options.refuse_if(!command.has_backdrop, "has no effect without --backdrop", {"--backdrop-blur"});
  });
}

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

/// Bytes by zlib and base64.
std::string packed(std::span<const std::uint8_t> bytes) {
  uLongf count = compressBound(bytes.size());
  std::vector<std::uint8_t> result(count);
  compress2(result.data(), &count, bytes.data(), bytes.size(), Z_BEST_COMPRESSION);
  return base64({result.data(), count});
}

/// Takes meshes and lights from nodes that KHR_node_visibility hides, which three.js does not know.
void drop_hidden(GltfDocument& document) {
  std::vector<std::size_t> open;
  std::vector<bool> hidden(array_member(document.json, "nodes").size());
  for (std::size_t i = 0; i < hidden.size(); ++i)
    if (!is_visible(document.json["nodes"][i])) open.push_back(i);
  while (!open.empty()) {
    const std::size_t index = open.back();
    open.pop_back();
    if (index >= hidden.size() || hidden[index]) continue;
    hidden[index] = true;
    Json& node = document.json["nodes"][index];
    node.erase("mesh");
    if (node.contains("extensions")) erase_extension(node, names::gltf::lights_punctual);
    for (const Json& child : array_member(node, "children"))
      open.push_back(static_cast<std::size_t>(index_of(child)));
  }
}

/// The bytes of a .glb file that has all of a garment, its fabrics too, its geometry plain.
std::string whole_garment(const std::string& path, const GltfLimits& limits) {
  auto document = value_or_throw(load_gltf(path, limits));
  const auto fabrics = value_or_throw(read_fabric_entries(document));
  for (std::size_t i = 0; i < fabrics.size(); ++i) {
    if (fabrics[i].path.empty()) continue;
    const auto file = value_or_throw(read_file(fabrics[i].path));
    const int view = append_view(document, bytes_of(file));
    Json& entry = document.json["extensions"][names::gltf::fabric_extension][names::gltf::fabrics][i];
    entry.erase("uri");
    entry["bufferView"] = view;
  }
  drop_hidden(document);
  const auto bytes = value_or_throw(pack_glb(std::move(document)));
  return {bytes.begin(), bytes.end()};
}

/// Fabrics see no more of an environment than pictures of this width have.
constexpr int environment_width = 64;

/// The element that holds an environment, as red, green, blue of its pixels; none without one.
std::string environment_element(const PageCommand& command) {
  if (command.environment == "none") return "";
  Environment small =
      downsample(value_or_throw(load_environment(command.environment, {}, command.limits.document.memory)),
                 environment_width);
  report_remarks(command.common, command.environment, small.remarks);
  for (V3f& c : small.radiance) c *= static_cast<float>(command.environment_options.strength);
  const std::span<const V3f> pixels = small.radiance;
  const std::string backdrop =
      command.has_backdrop ? fmt::format(" data-backdrop=\"{}\"", command.backdrop_blur) : "";
  return fmt::format("<script type=\"text/plain\" data-environment=\"{}\" data-turn=\"{}\"{}>{}</script>\n",
                     small.width, command.environment_options.turn_degrees, backdrop,
                     packed({reinterpret_cast<const std::uint8_t*>(pixels.data()), pixels.size_bytes()}));
}

/// The attributes of a garment's element with what is shown of it, where that is not all or not from the
/// front.
std::string frame_attributes(const Scene& scene, const CommonOptions& common) {
  const Framing framing = value_or_throw(frame_scene(scene));
  report_remarks(common, "note", framing.stray_remarks);
  std::string text;
  if (!framing.excluded_corners.empty()) {
    const Imath::Box3d box = bounding_box(framing.points);
    text += fmt::format(" data-box=\"{},{},{},{},{},{}\"", box.min.x, box.min.y, box.min.z, box.max.x,
                        box.max.y, box.max.z);
  }
  if (framing.turn_remark.empty()) return text;
  report_remarks(common, "note", std::vector{framing.turn_remark});
  const double azimuth = framing.azimuth * radians_per_degree;
  const double elevation = framing.elevation * radians_per_degree;
  return text + fmt::format(" data-side=\"{},{},{}\"", std::sin(azimuth) * std::cos(elevation),
                            std::sin(elevation), std::cos(azimuth) * std::cos(elevation) + 0.01);
}

/// The attributes of a garment's element with the floor under it, whose shade has bytes.
std::string floor_attributes(const Scene& scene) {
  const Floor floor = find_floor(merge(value_or_throw(build_surfaces(scene, V3d(0, 0, 0)))));
  if (floor.hidden_fraction.empty()) return "";
  std::vector<std::uint8_t> shade;
  for (const float hidden : floor.hidden_fraction)
    shade.push_back(static_cast<std::uint8_t>(std::lround(255 * hidden)));
  return fmt::format(" data-floor=\"{},{},{},{}\" data-shade=\"{}\"", floor.centre.x, floor.height,
                     floor.centre.y, floor.width, packed(shade));
}

Result<int> run(const PageCommand& command) {
  return write_page("page", command,
                    fmt::format("<script type=\"text/plain\" data-fps=\"{}\"></script>\n", command.fps));
}

}  // namespace

void add_page_output(Options& options, PageCommand& command) {
  options.output(command.output, "The page", {".html"}).required();
  options.flag("--open", command.opens, "Opens it in the browser");
}

Result<int> write_page(const char* verb, const PageCommand& command, const std::string& elements) {
  std::string page =
      value_or_throw(read_file(shared_file(fmt::format("{}.html", verb))).map_error([](Error unread) {
        unread.message =
            "the page is part of the build where Node.js and the packages of tests/node are there (npm ci)";
        return unread;
      }));
  std::string scripts = environment_element(command) + elements;
  int garments = 0;
  for (const std::string& input : command.inputs) {
    const bool is_fabric = input.ends_with(".exr");
    if (is_fabric) value_or_throw(read_fabric(input));
    const std::string bytes =
        is_fabric ? value_or_throw(read_file(input)) : whole_garment(input, command.limits.document);
    garments += is_fabric ? 0 : 1;
    const bool stands = !is_fabric && command.environment != "none" && !command.has_backdrop;
    std::string attributes;
    if (!is_fabric) {
      const Scene scene = value_or_throw(load_scene(input, {}, command.limits)).scene;
      attributes = frame_attributes(scene, command.common) + (stands ? floor_attributes(scene) : "");
    }
    scripts += fmt::format("<script type=\"text/plain\" data-{}=\"{}\"{}>{}</script>\n",
                           is_fabric ? "fabric" : "garment", escape_html(fs::path(input).filename().string()),
                           attributes, packed(bytes_of(bytes)));
  }
  const std::string marker = "<!--GARMENTS-->\n";
  page.replace(page.find(marker), marker.size(), scripts);
  value_or_throw(write_file(command.output, page));
  report(command.common, verb,
         {{"output", command.output},
          {"garments", garments},
          {"fabrics", static_cast<int>(command.inputs.size()) - garments},
          {"bytes", page.size()}},
         fmt::format("{} ({} bytes)\n", command.output, page.size()));
  if (!command.opens) return 0;
  const Result<void> opened = open_in_browser(command.output);
  if (!opened) report_error(opened.error());
  return opened ? 0 : 1;
}

void add_page_verb(Program& program) {
  program.add<PageCommand>(
      {"page", "Make a web page that shows garments, in one file",
       "selvedge-view page sweater.glb -o sweater.html\n"
       "selvedge-view page plain.glb purl.glb rib.fabric.exr -o three.html\n"
       "selvedge-view page sweater.glb --environment room.hdr -o sweater.html",
       "The page opens from the file, without a server or a network, in a browser with WebGL 2.\n"},
      declare, run);
}

}  // namespace selvedge
