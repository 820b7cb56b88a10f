// check and info: what is in a file, and whether it is as it should be.
#include <fmt/format.h>

#include "converter/tool/commands.h"
#include "converter/tool/file_kind.h"
#include "converter/tool/report.h"
#include "format/gltf_scene.h"

namespace selvedge {
namespace {

Result<void> without_value(const auto& result) {
  if (!result) return tl::unexpected(result.error());
  return {};
}

Result<void> check_samples(const std::string& path) {
  auto reader = SamplesReader::open(path);
  if (!reader) return tl::unexpected(reader.error());
  if (auto level = reader->read_level(); !level) return tl::unexpected(level.error());
  for (const PairKind kind : all_pair_kinds) {
    if (auto pairs = reader->read_pairs(kind); !pairs) return tl::unexpected(pairs.error());
  }
  return {};
}

Result<Fabric> open_fabric(const SceneFabric& fabric, const std::string& gltf) {
  if (fabric.path.empty()) return read_fabric(fabric.bytes, gltf + "#" + fabric.name);
  return read_fabric(fabric.path);
}

Result<void> check_gltf(const std::string& path) {
  const auto scene = read_scene(path);
  if (!scene) return tl::unexpected(scene.error());
  for (std::size_t i = 0; i < scene->fabrics.size(); ++i) {
    const auto fabric = open_fabric(scene->fabrics[i], path);
    if (fabric) continue;
    const Error& why = fabric.error();
    return fail(why.code == Code::file_missing ? Code::gltf_reference : why.code, path,
                fmt::format("/extensions/SELVEDGE_materials_fabric/fabrics/{}", i), to_line(why));
  }
  return {};
}

Result<FileKind> check_file(const std::string& path) {
  auto kind = kind_of(path);
  if (!kind) return kind;
  Result<void> outcome;
  if (*kind == FileKind::fabric) outcome = without_value(read_fabric(path));
  if (*kind == FileKind::samples) outcome = check_samples(path);
  if (*kind == FileKind::gltf) outcome = check_gltf(path);
  if (!outcome) return tl::unexpected(outcome.error());
  return kind;
}

Result<Json> fabric_info(const std::string& path) {
  const auto header = read_fabric_header(path);
  if (!header) return tl::unexpected(header.error());
  return Json::parse(*header);
}

Result<Json> samples_info(const std::string& path) {
  const auto reader = SamplesReader::open(path);
  if (!reader) return tl::unexpected(reader.error());
  const SamplesHeader& h = reader->header();
  Json pairs = Json::object();
  for (const PairKind kind : all_pair_kinds) {
    pairs[name_of(kind)] = h.pairs[static_cast<std::size_t>(kind)].size();
  }
  return Json{{"texels", {h.width, h.height}},
              {"mmPerRepeat", {h.period_mm.x, h.period_mm.y}},
              {"referenceHeight", h.reference_height},
              {"thickness", h.thickness_mm},
              {"views", {h.views.columns, h.views.rows}},
              {"lights", {h.lights.columns, h.lights.rows}},
              {"samplesPerTexel", h.samples_per_texel},
              {"truthSamples", h.truth_samples},
              {"pairs", pairs},
              {"provenance", Json::parse(h.provenance)}};
}

Result<Json> gltf_info(const std::string& path) {
  const auto scene = read_scene(path);
  if (!scene) return tl::unexpected(scene.error());
  std::size_t triangles = 0;
  for (const SceneInstance& instance : scene->instances) {
    triangles += scene->primitives[static_cast<std::size_t>(instance.primitive)].indices.size() / 3;
  }
  Json materials = Json::array();
  for (const SceneMaterial& m : scene->materials) {
    Json entry = {{"name", m.name}};
    if (m.fabric) {
      entry["fabric"] = m.fabric->fabric;
      entry["repeats"] = {m.fabric->transform.scale.x, m.fabric->transform.scale.y};
    }
    materials.push_back(entry);
  }
  Json fabrics = Json::array();
  for (const SceneFabric& f : scene->fabrics) {
    fabrics.push_back({{"name", f.name}, {"path", f.path}, {"embeddedBytes", f.bytes.size()}});
  }
  return Json{{"primitives", scene->primitives.size()},
              {"instances", scene->instances.size()},
              {"triangles", triangles},
              {"materials", materials},
              {"fabrics", fabrics},
              {"remarks", scene->remarks}};
}

}  // namespace

int run(const CheckCommand& command) {
  apply(command.common);
  Json files = Json::array();
  std::string text;
  int status = 0;
  for (const std::string& path : command.files) {
    const auto kind = check_file(path);
    if (kind) {
      files.push_back({{"file", path}, {"kind", name_of(*kind)}, {"good", true}});
      text += fmt::format("{}: {}, good\n", path, name_of(*kind));
      continue;
    }
    status = report_error(kind.error());
    files.push_back({{"file", path},
                     {"good", false},
                     {"code", name_of(kind.error().code)},
                     {"place", kind.error().place},
                     {"message", kind.error().message}});
  }
  report(command.common, "check", {{"good", status == 0}, {"files", files}}, text);
  return status;
}

int run(const InfoCommand& command) {
  apply(command.common);
  const auto kind = kind_of(command.file);
  if (!kind) return report_error(kind.error());
  const auto info = *kind == FileKind::fabric    ? fabric_info(command.file)
                    : *kind == FileKind::samples ? samples_info(command.file)
                                                 : gltf_info(command.file);
  if (!info) return report_error(info.error());
  const Json json = {{"file", command.file},
                     {"kind", name_of(*kind)},
                     {"bytes", size_of_file(command.file)},
                     {"content", *info}};
  report(command.common, "info", json, json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
  return 0;
}

}  // namespace selvedge
