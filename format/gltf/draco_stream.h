// Meshes and the bytes that Draco makes of them (draco_stream.cpp is the only file that includes Draco;
// WebAssembly has format/web/draco.cpp).
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "format/gltf/access.h"

namespace selvedge {

/// A decoded mesh, whose attributes have ids.
class DracoMesh {
 public:
  /// FILE_DAMAGED with Draco's message.
  static Result<DracoMesh> decode(std::span<const std::uint8_t> bytes);

  std::size_t points() const { return points_; }
  const std::vector<std::uint32_t>& indices() const { return indices_; }  ///< three a face
  int components(int id) const;  ///< 0: no such attribute, or booleans
  /// The elements of all points as a type of glTF; nothing if a value does not fit.
  std::optional<Bytes> values(int id, int component_type) const;

 private:
  struct Decoded;
  std::shared_ptr<const Decoded> decoded_;
  std::size_t points_ = 0;
  std::vector<std::uint32_t> indices_;
};

struct DracoAttribute {
  std::string semantic;
  AccessorShape shape;
  Bytes elements;
  int bits = 0;  ///< for floats; 0: as they are
};

/// A stream, in which an attribute's id is its place; nothing if Draco cannot. `is_ordered`: points stay in
/// their order.
std::optional<Bytes> encode_draco(const std::vector<DracoAttribute>& attributes,
                                  const std::vector<std::uint32_t>& triangles, bool is_ordered);

}  // namespace selvedge
