#include "apps/selvedge/check_file.h"

#include "converter/dress/check.h"
#include "format/check/fabric.h"
#include "format/check/gltf.h"
#include "format/samples/samples.h"

namespace selvedge {
namespace {

Issues issues_of(const auto& result) { return result ? Issues{} : Issues{result.error()}; }

Issues check_samples(const std::string& path) {
  auto reader = SamplesReader::open(path);
  if (!reader) return {reader.error()};
  if (Issues issues = issues_of(reader->read_level()); !issues.empty()) return issues;
  for (const PairKind kind : all_pair_kinds) {
    if (Issues issues = issues_of(reader->read_pairs(kind)); !issues.empty()) return issues;
  }
  return {};
}

Issues check_garment(const std::string& path) {
  Scene scene;
  Issues issues = check_gltf(path, {}, &scene);
  const Issues more = check_dressed(scene);
  issues.insert(issues.end(), more.begin(), more.end());
  return issues;
}

}  // namespace

Issues check_file(const std::string& path, FileKind kind) {
  if (kind == FileKind::fabric) return check_fabric(path);
  if (kind == FileKind::samples) return check_samples(path);
  return check_garment(path);
}

}  // namespace selvedge
