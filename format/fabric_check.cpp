#include "format/fabric_check.h"

#include "format/fabric_exr.h"

namespace selvedge {
namespace {

Issues issues_of(const Result<Fabric>& fabric) {
  if (fabric) return {};
  return {fabric.error()};
}

}  // namespace

Issues check_fabric(const std::string& path, const FabricLimits& limits) {
  return issues_of(read_fabric(path, limits));
}

Issues check_fabric(std::span<const std::uint8_t> bytes, const std::string& name,
                    const FabricLimits& limits) {
  return issues_of(read_fabric(bytes, name, limits));
}

}  // namespace selvedge
