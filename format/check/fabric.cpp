#include "format/check/fabric.h"

#include "format/fabric/file.h"

namespace selvedge {
namespace {

CheckedFabric check(Result<ExrReader> file, const FabricLimits& limits) {
  if (!file) return {{file.error()}, {}};
  IssueSink sink(file->path());
  CheckedFabric checked;
  if (auto reader = FabricReader::open(std::move(*file), limits, sink)) checked.fabric = reader->read(sink);
  checked.issues = sink.take_issues();
  return checked;
}

}  // namespace

CheckedFabric check_fabric(const std::string& path, const FabricLimits& limits) {
  return check(ExrReader::open(path, exr_limits(limits)), limits);
}

CheckedFabric check_fabric(std::span<const std::uint8_t> bytes, const std::string& name,
                           const FabricLimits& limits) {
  return check(ExrReader::open(bytes, name, exr_limits(limits)), limits);
}

}  // namespace selvedge
