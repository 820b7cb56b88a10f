// info: the contents of a file, as a table or as JSON.
#include <fmt/format.h>

#include <set>

#include "apps/common/shared_options.h"
#include "apps/selvedge/commands.h"
#include "apps/selvedge/file_kind.h"
#include "apps/selvedge/make_report.h"
#include "apps/selvedge/uv_report.h"
#include "converter/dress/uv_scale.h"
#include "format/fabric/file.h"
#include "format/gltf/read_scene.h"
#include "format/samples/samples.h"

namespace selvedge {
namespace {

struct InfoCommand {
  CommonOptions common;
  std::string file;
  int tex_coord = 0;
  SceneLimits limits;
};

void declare(Options& options, InfoCommand& command) {
  options.common(command.common);
  options.text("file", command.file, "FILE", "A fabric, samples or glTF file").required();
  options
      .number("--texcoord", command.tex_coord, "N",
              "Set of texture coordinates in which materials without a fabric are measured")
      .in(0, 1);
  add_limits(options, command.limits);
}

struct Info {
  Json content;
  Json yarn;                     ///< yarn_json() of a fabric
  std::vector<std::string> uvs;  ///< uv_text() of each material of a garment, or nothing
};

Info fabric_info(const std::string& path, const SceneLimits& limits) {
  const auto reader = must(FabricReader::open(path, {.memory = limits.document.memory}));
  return {Json::parse(reader.text()), yarn_json(reader), {}};
}

Info samples_info(const std::string& path) {
  const SamplesHeader h = must(read_samples_header(path));
  Json pairs = Json::object();
  for (const PairKind kind : all_pair_kinds) {
    pairs[name_of(kind)] = h.pairs[static_cast<std::size_t>(kind)].size();
  }
  return Info{{{"texels", {h.width, h.height}},
               {"sides", h.both_sides ? "both" : "front"},
               {"mmPerRepeat", {h.period_mm.x, h.period_mm.y}},
               {"referenceHeight", h.reference_height},
               {"thickness", h.thickness_mm},
               {"views", {h.views.columns, h.views.rows}},
               {"lights", {h.lights.columns, h.lights.rows}},
               {"samplesPerTexel", h.samples_per_texel},
               {"truthSamples", h.truth_samples},
               {"pairs", pairs},
               {"provenance", Json::parse(h.provenance)}},
              nullptr,
              {}};
}

/// What the garment brings beside a fabric, as far as there is such.
Json brings_json(const GarmentParts& parts) {
  Json brings = Json::object();
  if (parts.mask.image >= 0)
    brings["mask"] = {{"texCoord", parts.mask.tex_coord}, {"cutoff", parts.mask_cutoff}};
  if (parts.normal.image >= 0)
    brings["normals"] = {{"texCoord", parts.normal.tex_coord}, {"scale", parts.normal_scale}};
  if (parts.tint_texture.image >= 0) brings["tintTexture"] = {{"texCoord", parts.tint_texture.tex_coord}};
  if (parts.tint != V3f(1, 1, 1)) brings["tint"] = {parts.tint.x, parts.tint.y, parts.tint.z};
  return brings;
}

Info gltf_info(const std::string& path, const SceneLimits& limits, int tex_coord) {
  const auto scene = must(read_scene(path, limits));
  std::size_t triangles = 0;
  for (const SceneInstance& instance : scene.instances)
    triangles += scene.primitives[instance.primitive].indices.size() / 3;
  const Imath::Box3d bounds = bounds_of(scene);
  Json materials = Json::array();
  std::vector<std::string> uvs;
  for (std::size_t i = 0; i < scene.materials.size(); ++i) {
    const SceneMaterial& m = scene.materials[i];
    Json entry = {{"name", m.name}};
    std::set<int> primitives;
    for (std::size_t p = 0; p < scene.primitives.size(); ++p) {
      if (scene.primitives[p].material == static_cast<int>(i)) primitives.insert(static_cast<int>(p));
    }
    const int set = m.fabric ? m.fabric->tex_coord : tex_coord;
    const UvSize size = measure_uv(scene, primitives, set);
    if (size.primitives > 0) entry.update(uv_json(size));
    uvs.push_back(size.primitives > 0 ? uv_text(size) : "");
    if (m.fabric) {
      entry["fabric"] = m.fabric->fabric;
      entry["repeats"] = {m.fabric->transform.scale.x, m.fabric->transform.scale.y};
      entry["texCoord"] = m.fabric->tex_coord;
      entry["brings"] = brings_json(m.kept);
    }
    materials.push_back(entry);
  }
  Json fabrics = Json::array();
  for (const SceneFabric& f : scene.fabrics) {
    fabrics.push_back({{"name", f.name}, {"path", f.path}, {"embeddedBytes", f.bytes.size()}});
  }
  return Info{{{"primitives", scene.primitives.size()},
               {"instances", scene.instances.size()},
               {"triangles", triangles},
               {"bounds", bounds_json(bounds)},
               {"materials", materials},
               {"fabrics", fabrics},
               {"variants", scene.variants},
               {"remarks", scene.remarks}},
              nullptr,
              uvs};
}

/// Maximum number of lines of a list, so that the table fits a screen; further lines are only counted.
constexpr std::size_t max_lines = 12;

std::string line(const char* name, const std::string& value) {
  return fmt::format("{:18}{:.80}\n", name, value);
}

/// Members of a file's JSON, which another program may have written; "-" if missing.
std::string text_at(const Json& json, const char* pointer) {
  const Json::json_pointer at(pointer);
  if (!json.contains(at)) return "-";
  const Json& value = json[at];
  return value.is_number_float() ? fmt::format("{:.4g}", value.get<double>())
         : value.is_string()     ? value.get<std::string>()
                                 : value.dump();
}

std::string pair_at(const Json& json, const std::string& pointer) {
  return text_at(json, (pointer + "/0").c_str()) + " x " + text_at(json, (pointer + "/1").c_str());
}

std::string provenance_table(const Json& content) {
  return line("made of", fmt::format("{}, {} triangles", text_at(content, "/provenance/stitch"),
                                     text_at(content, "/provenance/triangles"))) +
         line("made by",
              fmt::format("{}, seed {}, {} bounces, {} samples a texel and view",
                          text_at(content, "/provenance/software"), text_at(content, "/provenance/bake/seed"),
                          text_at(content, "/provenance/bake/bounces"),
                          text_at(content, "/provenance/bake/samples")));
}

std::string fabric_table(const Json& content, const Json& yarn) {
  std::string text = line("model", text_at(content, "/model"));
  text += line("texels", pair_at(content, "/texels"));
  if (content.contains("whole"))
    text += line("part of", fmt::format("{} texels, from level {} on", pair_at(content, "/whole/texels"),
                                        text_at(content, "/whole/level")));
  text += line("mm per repeat", pair_at(content, "/mmPerRepeat"));
  text += line("thickness", fmt::format("{} mm, reference height {} mm", text_at(content, "/thickness"),
                                        text_at(content, "/referenceHeight")));
  text += line("views",
               fmt::format("{} x {}", text_at(content, "/views/columns"), text_at(content, "/views/rows")));
  std::string sides;
  const Json others = content.value("sides", Json::object());
  for (const Side side : other_sides) {
    if (others.contains(name_of(side))) sides += fmt::format(", {}", name_of(side));
  }
  if (!sides.empty()) text += line("sides", "front" + sides);
  text += provenance_table(content);
  const Json layers = content.value("layers", Json::object());
  for (const auto& [name, layer] : layers.items()) {
    const Json numbers = layer.value("levels", Json::array());
    std::string levels;
    for (const Json& level : numbers) levels += fmt::format(" {}", level.dump());
    text +=
        line(("layer " + name).c_str(), fmt::format("{:5} level{}", text_at(layer, "/precision"), levels));
  }
  if (!yarn.is_null()) text += line("yarn", yarn_text(yarn));
  const Json::json_pointer record("/provenance/fit/levels");
  if (!content.contains(record) || !content[record].is_array()) return text;
  const Json& levels = content[record];
  text += "\nlevel  held-out dB  rel. L2  training dB    bytes  layers\n";
  for (std::size_t k = 0; k < std::min(levels.size(), max_lines); ++k) {
    const Json& level = levels[k];
    text += fmt::format("{:5}  {:>11}  {:>7}  {:>11}  {:>7}  {:.50}\n", k, text_at(level, "/heldOut/psnr"),
                        text_at(level, "/heldOut/relativeL2"), text_at(level, "/training/psnr"),
                        text_at(level, "/bytes"), text_at(level, "/layers"));
  }
  return text;
}

std::string samples_table(const Json& content) {
  std::string text = line("texels", pair_at(content, "/texels"));
  text += line("mm per repeat", pair_at(content, "/mmPerRepeat"));
  text += line("thickness", fmt::format("{} mm, reference height {} mm", text_at(content, "/thickness"),
                                        text_at(content, "/referenceHeight")));
  text += line("views, lights", pair_at(content, "/views") + ", " + pair_at(content, "/lights"));
  text += line("sides", text_at(content, "/sides"));
  text += line("samples", text_at(content, "/samplesPerTexel") + " a texel and view");
  std::string pairs;
  for (const auto& [kind, count] : content["pairs"].items())
    pairs += fmt::format("{}{} {}", pairs.empty() ? "" : ", ", count.dump(), kind);
  text += line("pairs", fmt::format("{}; {} samples each", pairs, text_at(content, "/truthSamples")));
  return text + provenance_table(content);
}

/// The lines of a list, and the number of those that are not shown.
template <class Line>
std::string list_table(const char* name, const Json& list, Line line_of) {
  std::string text;
  for (std::size_t i = 0; i < std::min(list.size(), max_lines); ++i)
    text += line(fmt::format("{} {}", name, i).c_str(), line_of(list[i]));
  if (list.size() > max_lines) text += line("", fmt::format("and {} more", list.size() - max_lines));
  return text;
}

std::string gltf_table(const Json& content, const std::vector<std::string>& uvs) {
  std::string text = line(
      "geometry", fmt::format("{} triangles, {} primitives, {} instances", text_at(content, "/triangles"),
                              text_at(content, "/primitives"), text_at(content, "/instances")));
  if (content["bounds"].is_array()) {
    for (int end : {0, 1}) {
      const Json& corner = content["bounds"][end];
      text += line(end == 0 ? "from (m)" : "to (m)",
                   fmt::format("{:.4g}, {:.4g}, {:.4g}", corner[0].get<double>(), corner[1].get<double>(),
                               corner[2].get<double>()));
    }
  }
  text += list_table("material", content["materials"], [](const Json& m) {
    if (!m.contains("fabric")) return text_at(m, "/name");
    std::string worn = fmt::format("{}: fabric {}, {} repeats", text_at(m, "/name"), text_at(m, "/fabric"),
                                   pair_at(m, "/repeats"));
    if (m["texCoord"] != 0) worn += fmt::format(" on set {}", text_at(m, "/texCoord"));
    for (const auto& [part, value] : m["brings"].items()) {
      worn += ", " + part;
      for (const Json& channel : part == "tint" ? value : Json::array())
        worn += fmt::format(" {:.3g}", channel.get<double>());
    }
    return worn;
  });
  for (std::size_t i = 0; i < std::min(uvs.size(), max_lines); ++i) {
    if (!uvs[i].empty()) text += line(fmt::format("size of {}", i).c_str(), uvs[i]);
  }
  text += list_table("fabric", content["fabrics"], [](const Json& f) {
    return fmt::format(
        "{}, {}", text_at(f, "/name"),
        f["path"] == "" ? text_at(f, "/embeddedBytes") + " bytes embedded" : text_at(f, "/path"));
  });
  text += list_table("variant", content["variants"], [](const Json& v) { return v.get<std::string>(); });
  return text + list_table("remark", content["remarks"], [](const Json& r) { return r.get<std::string>(); });
}

Result<int> run(const InfoCommand& command) {
  const auto kind = must(kind_of(command.file));
  const Info info = kind == FileKind::fabric    ? fabric_info(command.file, command.limits)
                    : kind == FileKind::samples ? samples_info(command.file)
                                                : gltf_info(command.file, command.limits, command.tex_coord);
  const std::uint64_t bytes = size_of_file(command.file);
  std::string text = line(name_of(kind), fmt::format("{}, {} bytes", command.file, bytes));
  text += kind == FileKind::fabric    ? fabric_table(info.content, info.yarn)
          : kind == FileKind::samples ? samples_table(info.content)
                                      : gltf_table(info.content, info.uvs);
  Json json = {{"file", command.file}, {"kind", name_of(kind)}, {"bytes", bytes}, {"content", info.content}};
  if (!info.yarn.is_null()) json["yarn"] = info.yarn;
  report(command.common, "info", json, text);
  return 0;
}

}  // namespace

void add_info_verb(Program& program) {
  program.add<InfoCommand>(
      {"info", "What is in a fabric, samples or glTF file", "selvedge info k.fabric.exr"}, declare, run);
}

}  // namespace selvedge
