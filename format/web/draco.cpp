// Draco's decoder by the host, which holds the last mesh.
#include <cstring>

#include "format/gltf/draco_stream.h"
#include "format/web/host.h"

namespace selvedge {

struct DracoMesh::Decoded {};

Result<DracoMesh> DracoMesh::decode(std::span<const std::uint8_t> bytes) {
  const double points = host_unpack_draco(bytes.data(), bytes.size());
  if (points < 0) return fail(Code::file_damaged, "", "", host_input());
  DracoMesh mesh;
  mesh.points_ = static_cast<std::size_t>(points);
  mesh.indices_.resize(host_input().size() / sizeof(std::uint32_t));
  std::memcpy(mesh.indices_.data(), host_input().data(), host_input().size());
  return mesh;
}

int DracoMesh::components(int id) const { return host_draco_components(id); }

std::optional<Bytes> DracoMesh::values(int id, int component_type) const {
  if (!host_draco_values(id, component_type)) return std::nullopt;
  return Bytes(host_input().begin(), host_input().end());
}

/// The host has no encoder.
std::optional<Bytes> encode_draco(const std::vector<DracoAttribute>&, const std::vector<std::uint32_t>&,
                                  bool) {
  return std::nullopt;
}

}  // namespace selvedge
