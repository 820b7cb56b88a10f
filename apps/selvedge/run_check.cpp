// check and info: what is in a file, and whether it is as it should be.
#include <Imath/ImathBox.h>
#include <fmt/format.h>

#include <algorithm>

#include "apps/selvedge/check_file.h"
#include "apps/selvedge/commands.h"
#include "apps/selvedge/report.h"
#include "format/base/printable.h"
#include "format/gltf/read_scene.h"

namespace selvedge {
namespace {

std::string praise(std::size_t warnings) {
  if (warnings == 0) return "good";
  return fmt::format("good, {} warning{}", warnings, warnings == 1 ? "" : "s");
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
  Imath::Box3d bounds;
  for (const SceneInstance& instance : scene->instances) {
    const ScenePrimitive& primitive = scene->primitives[instance.primitive];
    triangles += primitive.indices.size() / 3;
    for (const std::uint32_t index : primitive.indices)
      bounds.extendBy(V3d(primitive.positions[index]) * instance.world);
  }
  const auto numbers = [](const V3d& v) { return Json{v.x, v.y, v.z}; };
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
              {"bounds", bounds.isEmpty() ? Json() : Json{numbers(bounds.min), numbers(bounds.max)}},
              {"materials", materials},
              {"fabrics", fabrics},
              {"remarks", scene->remarks}};
}

}  // namespace

int run(const CheckCommand& command) {
  apply(command.common);
  Json files = Json::array();
  std::string text;
  bool all_good = true;
  for (const std::string& path : command.files) {
    const Result<FileKind> kind = kind_of(path);
    const Issues issues = kind ? check_file(path, *kind) : Issues{kind.error()};
    const auto warnings =
        static_cast<std::size_t>(std::count_if(issues.begin(), issues.end(), [](const Error& e) {
          return severity_of(e.code) == Severity::warning;
        }));
    const bool good = command.warnings_as_errors ? issues.empty() : warnings == issues.size();
    all_good = all_good && good;
    Json list = Json::array();
    for (const Error& issue : issues) {
      list.push_back(to_json(issue));
      // In a report and in quiet, only what makes the status 1 is said as well.
      const bool failing = command.warnings_as_errors || severity_of(issue.code) == Severity::error;
      if (failing || !(command.common.quiet || command.common.json)) report_issue(issue);
    }
    Json entry = {{"file", as_utf8(path)}, {"good", good}, {"issues", std::move(list)}};
    if (kind) entry["kind"] = name_of(*kind);
    files.push_back(std::move(entry));
    if (good) text += fmt::format("{}: {}, {}\n", path, name_of(*kind), praise(warnings));
  }
  report(command.common, "check", {{"good", all_good}, {"files", files}}, text);
  return all_good ? 0 : 1;
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
