#include "apps/selvedge/file_kind.h"

#include <array>

#include "converter/dress/uv_scale.h"
#include "format/base/foreign.h"
#include "format/base/input_file.h"
#include "format/base/option_text.h"
#include "format/check/fabric.h"
#include "format/check/gltf.h"
#include "format/exr/exr.h"
#include "format/fabric/names.h"
#include "format/samples/samples.h"

namespace selvedge {

const char* name_of(FileKind kind) {
  constexpr std::array<const char*, 3> names{"fabric", "samples", "gltf"};
  return names[static_cast<std::size_t>(kind)];
}

Result<FileKind> kind_of(const std::string& path) {
  const Result<InputFile> file = InputFile::open(path);
  if (!file) return tl::unexpected(file.error());
  std::array<std::uint8_t, 4> start{};
  if (!file->read(0, start)) return fail(Code::file_damaged, path, {}, "shorter than 4 bytes");
  if (has_ending(path, ".obj")) return FileKind::gltf;
  const std::string_view magic(reinterpret_cast<const char*>(start.data()), start.size());
  if (magic == "glTF" || magic == "ply\n" || magic == "ply\r" || magic.find('{') != std::string_view::npos)
    return FileKind::gltf;
  if (magic != std::string_view("\x76\x2f\x31\x01", 4)) {
    const std::string_view kind = foreign_file_message(*file);
    return fail(Code::file_unreadable, path, {},
                kind.empty()
                    ? "is neither OpenEXR nor glTF nor OBJ nor PLY (selvedge stitch reads drafts and charts)"
                    : std::string(kind));
  }
  const auto reader = ExrReader::open(path);
  if (!reader) return tl::unexpected(reader.error());
  for (const ExrPart& part : reader->parts()) {
    if (part.attributes.contains(names::attribute_fabric)) return FileKind::fabric;
    if (part.attributes.contains(names::attribute_samples)) return FileKind::samples;
  }
  return fail(Code::fabric_malformed, path, {}, "an OpenEXR file, but neither a fabric nor samples");
}

Issues check_file(const std::string& path, FileKind kind, const SceneLimits& limits) {
  if (kind == FileKind::fabric) return check_fabric(path, {.memory = limits.document.memory}).issues;
  if (kind == FileKind::samples) {
    const auto samples = read_samples(path, limits.document.memory);
    return samples ? Issues{} : Issues{samples.error()};
  }
  Scene scene;
  Issues issues = check_gltf(path, limits, &scene);
  const Issues more = check_uv_areas(scene);
  issues.insert(issues.end(), more.begin(), more.end());
  return issues;
}

}  // namespace selvedge
