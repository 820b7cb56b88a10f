// Converts the materials of a scene for drawing.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "format/picture/image.h"
#include "format/scene/scene.h"
#include "viewer/scene/material.h"
#include "viewer/scene/surfaces.h"

namespace selvedge {

/// A picture as its file has it; a texture is made of it when a frame shows it (light/picture_textures.h).
struct MaterialPicture {
  std::string name;
  std::shared_ptr<const std::vector<std::uint8_t>> bytes;  ///< encoded
  Transfer transfer = Transfer::keep;
  V2i size{1, 1};  ///< by its header
  /// After this number of halvings.
  std::uint64_t pixels(int halvings) const {
    return std::uint64_t{1} * level_size(size.x, halvings) * level_size(size.y, halvings);
  }
  std::uint32_t texture = 0;  ///< OpenGL's, linear; 0: absent, as if no material had the picture
};

struct Materials {
  std::vector<SurfaceMaterial> surfaces;  ///< one per surface
  std::vector<PbrMaterial> pbr;           ///< one per surface
  std::vector<MaterialPicture> pictures;

  bool emits(std::size_t surface) const {
    return surface < pbr.size() && pbr[surface].emissive != V3f(0, 0, 0);
  }
  /// Whether some surface shows more than its fabric.
  bool needs_pbr() const;
};

/// Takes the pictures that `surfaces` need; those without a size in their header, and those too large for
/// OpenGL, are skipped with a line in `remarks`. Fabrics are drawn on both sides, since cloth is thin and its
/// back shows through holes; doubleSided applies to materials without a fabric. Precondition: indices are as
/// read_scene() leaves them.
Materials materials_of(const Scene& scene, const std::vector<Surface>& surfaces,
                       std::vector<std::string>& remarks);

}  // namespace selvedge
