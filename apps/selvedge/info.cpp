// info: the contents of a file, as a table or as JSON.
#include <fmt/format.h>

#include <algorithm>

#include "apps/common/shared_options.h"
#include "apps/selvedge/commands.h"
#include "apps/selvedge/file_kind.h"
#include "apps/selvedge/make.h"
#include "converter/dress/uv_scale.h"
#include "format/base/option_text.h"
#include "format/fabric/file.h"
#include "format/gltf/read_scene.h"
#include "format/samples/samples.h"

namespace selvedge {
namespace {

struct InfoCommand {
  CommonOptions common;
  std::string file;
  SceneLimits limits;
};

void declare(Options& options, InfoCommand& command) {
  options.text("file", command.file, "FILE", "A fabric, samples or glTF file").required();
  add_limits(options, command.limits);
}

struct Info {
  Json json;  ///< members of the report; `content` is the file's own text or a summary
  std::string text;
};

constexpr const char* cell_lines =
    "texels         {texels}\nmm per repeat  {mmPerRepeat/0:.4g} x {mmPerRepeat/1:.4g}\nthickness      "
    "{thickness:.4g} mm, reference "
    "height "
    "{referenceHeight:.4g} mm\nmade of        {provenance/stitch}\nmade by "
    "       {provenance/software}\n";

/// The command of a recipe, which may be a stranger's.
std::string recipe_text(const Json& recipe) {
  constexpr std::size_t max_line = 96;
  std::string text = "recipe         selvedge make " + shell_word(fill_pattern("{stitch}", recipe));
  const auto add = [&](const std::string& word) {
    if (text.size() - (text.rfind('\n') + 1) + word.size() > max_line) text += " \\\n              ";
    text += word;
  };
  for (const auto& [option, value] : recipe.items()) {
    if (option == "set")
      for (const auto& [name, number] : value.items())
        add(" --set " + shell_word(name + fill_pattern("={}", number)));
    else if (std::ranges::count(recipe_option_names, option) > 0)
      add(" " + shell_word("--" + option) +
          (value == "true" ? "" : " " + shell_word(fill_pattern("{}", value))));
  }
  return text + "\n";
}

Info fabric_info(const std::string& path, const SceneLimits& limits) {
  const auto reader = value_or_throw(FabricReader::open(path, {.memory = limits.document.memory}));
  const FabricHeader& header = reader.header();
  Json content = Json::parse(reader.header_text());
  Json layers = Json::array();
  for_each_side(header, [&](const FabricHeader& side) {
    for (const LayerKind kind : all_layers) {
      if (!side.layer(kind)) continue;
      Json bytes = Json::array();
      std::string levels;
      for (const int k : side.layer(kind)->levels) {
        bytes.push_back(reader.packed_bytes(kind, k, side.side));
        levels += fmt::format("{}{}", levels.empty() ? "" : " ", k);
      }
      layers.push_back({{"layer", part_name(kind, side.side)},
                        {"precision", reader.is_half(kind, side.side) ? "half" : "float"},
                        {"levels", levels},
                        {"bytes", bytes}});
    }
  });
  std::string text =
      fill_pattern(cell_lines, content) +
      fill_pattern("views          {views/columns} x {views/rows}\n", content) +
      table_text(layers, {{"layer", "{layer}"}, {"precision", "{precision}"}, {"levels", "{levels}"}});
  if (content.contains("recipe")) text += recipe_text(content["recipe"]);
  if (content.contains("/sheet/coverWithHairs"_json_pointer))
    text += fill_pattern(
        "cloth          {sheet/composition}, {sheet/construction}, {sheet/gramsPerSquareMetre} g/m2, cover "
        "{sheet/cover} ({sheet/coverWithHairs} with hairs)\n",
        content);
  const Json accuracy = content.value("accuracy", Json::object());
  if (accuracy.contains("front") && accuracy["front"].is_array()) {
    text += "accuracy      ";
    for (const Json& db : accuracy["front"]) text += fill_pattern(" {db}", {{"db", db}});
    text += " dB by level";
    if (accuracy.contains("yarn")) text += fill_pattern(", {yarn} of the yarn close by", accuracy);
    text += "\n";
  }
  const YarnCounts& yarns = header.shape.yarns;
  if (yarns.curves > 0)
    text += fmt::format("yarn           {} curves, {} nodes{}\n", yarns.curves, yarns.nodes,
                        yarns.light_functions > 0 ? ", packed" : "");
  if (header.layer(LayerKind::map))
    text += fmt::format("map            {} x {} stitches, of {} x {}", yarns.map_size.x, yarns.map_size.y,
                        header.width, header.height) +
            (content.contains("/sheet/kinds/decibels"_json_pointer)
                 ? fill_pattern(", {sheet/kinds/decibels} dB beside all kinds\n", content)
                 : "\n");
  return {{{"content", std::move(content)}, {"layers", std::move(layers)}}, std::move(text)};
}

Info samples_info(const std::string& path) {
  const SamplesHeader h = value_or_throw(read_samples_header(path));
  Json pairs = Json::object();
  for (const PairKind kind : all_pair_kinds)
    pairs[name_of(kind)] = h.pairs[static_cast<std::size_t>(kind)].size();
  Json content{{"texels", {h.width, h.height}},
               {"sides", h.both_sides ? "both" : "front"},
               {"mmPerRepeat", h.period_mm},
               {"referenceHeight", h.reference_height},
               {"thickness", h.thickness_mm},
               {"views", {h.views.columns, h.views.rows}},
               {"lights", {h.lights.columns, h.lights.rows}},
               {"samplesPerTexel", h.samples_per_texel},
               {"truthSamples", h.truth_samples},
               {"pairs", pairs},
               {"provenance", Json::parse(h.provenance)}};
  std::string text =
      fill_pattern(cell_lines, content) + fill_pattern(
                                              "views, lights  {views}, {lights}\nsides          {sides}\n"
                                              "samples        {samplesPerTexel} a texel and view\n",
                                              content);
  for (const auto& [kind, count] : pairs.items())
    text += fmt::format("pairs          {} {}\n", count.dump(), kind);
  return {{{"content", std::move(content)}}, std::move(text)};
}

/// Textures and tint of the garment that stay visible with the fabric.
Json brings_json(const GarmentTextures& parts) {
  Json brings = Json::object();
  if (parts.mask.image >= 0)
    brings["mask"] = {{"texCoord", parts.mask.tex_coord}, {"cutoff", parts.mask_cutoff}};
  if (parts.normal.image >= 0)
    brings["normals"] = {{"texCoord", parts.normal.tex_coord}, {"scale", parts.normal_scale}};
  if (parts.tint_texture.image >= 0) brings["tintTexture"] = {{"texCoord", parts.tint_texture.tex_coord}};
  if (parts.tint != V3f(1, 1, 1)) brings["tint"] = parts.tint;
  return brings;
}

Info gltf_info(const std::string& path, const SceneLimits& limits) {
  const auto scene = value_or_throw(read_scene(path, limits));
  std::size_t triangles = 0;
  for (const SceneInstance& instance : scene.instances)
    triangles += scene.primitives[instance.primitive].indices.size() / 3;
  Json materials = Json::array();
  for (const SceneMaterial& m : scene.materials) {
    Json& entry = materials.emplace_back(Json{{"name", m.name}});
    if (!m.fabric) continue;
    entry["fabric"] = m.fabric->fabric;
    entry["repeats"] = m.fabric->transform.scale;
    entry["texCoord"] = m.fabric->tex_coord;
    entry["brings"] = brings_json(m.garment_textures);
  }
  Json fabrics = Json::array();
  for (const SceneFabric& f : scene.fabrics)
    fabrics.push_back({{"name", f.name}, {"path", f.path}, {"embeddedBytes", f.bytes.size()}});
  Json content{{"primitives", scene.primitives.size()},
               {"instances", scene.instances.size()},
               {"triangles", triangles},
               {"bounds", bounds_of(scene)},
               {"materials", materials},
               {"fabrics", fabrics},
               {"variants", scene.variants},
               {"remarks", scene.remarks}};
  std::string text = fill_pattern(
      "geometry       {triangles} triangles, {primitives} primitives, {instances} instances\n", content);
  text +=
      table_text(materials, {{"material", "{name}"}, {"fabric", "{fabric}"}, {"repeats", "{repeats:.5g}"}});
  text +=
      table_text(fabrics, {{"fabric", "{name}"}, {"path", "{path}"}, {"embedded bytes", "{embeddedBytes}"}});
  for (const std::string& variant : scene.variants) text += fmt::format("variant        {}\n", variant);
  for (const std::string& remark : scene.remarks) text += fmt::format("remark         {}\n", remark);
  return {{{"content", std::move(content)}}, std::move(text)};
}

Result<int> run(const InfoCommand& command) {
  const auto kind = value_or_throw(kind_of(command.file));
  const Info info = kind == FileKind::fabric    ? fabric_info(command.file, command.limits)
                    : kind == FileKind::samples ? samples_info(command.file)
                                                : gltf_info(command.file, command.limits);
  const std::uint64_t bytes = file_size_or_zero(command.file);
  Json json = {{"file", command.file}, {"kind", name_of(kind)}, {"bytes", bytes}};
  json.update(info.json);
  report(command.common, "info", json,
         fmt::format("{:13}  {}, {} bytes\n", name_of(kind), command.file, bytes) + info.text);
  return 0;
}

}  // namespace

void add_info_verb(Program& program) {
  program.add<InfoCommand>(
      {"info", "Contents of a fabric, samples or glTF file", "selvedge info k.fabric.exr"}, declare, run);
}

}  // namespace selvedge
