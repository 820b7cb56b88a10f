// A plain garment -> GLB: what the sample garments are written with.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "format/base/error.h"
#include "format/base/vec.h"

namespace selvedge {

/// Triangles of one material. Arrays are per vertex; metres, +y up, v growing downwards in the picture.
struct GarmentPrimitive {
  int material = 0;  ///< index into Garment::materials
  std::vector<V3f> positions;
  std::vector<V3f> normals;  ///< unit; empty: flat shading
  std::vector<V2f> tex_coords;
  std::vector<std::uint32_t> indices;  ///< three per triangle, counter-clockwise from outside
};

struct GarmentMaterial {
  std::string name;
  V4f base_color{0.8F, 0.8F, 0.8F, 1.0F};  ///< linear
  float roughness = 1;
  bool double_sided = true;
};

/// One node with one mesh.
struct Garment {
  std::string name;
  std::vector<GarmentMaterial> materials;
  std::vector<GarmentPrimitive> primitives;
};

/// Writes a GLB, whole or not at all; the same garment gives the same bytes. Precondition: arrays fit each
/// other, indices and materials are in range, and values are finite.
Result<void> write_garment(const std::string& path, const Garment& garment);

}  // namespace selvedge
