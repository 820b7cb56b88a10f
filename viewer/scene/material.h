// How a surface is drawn, as the passes have to know it.
#pragma once

#include <array>
#include <cstdint>

#include "format/base/vec.h"
#include "format/scene/scene.h"

namespace selvedge {

/// What the passes have to know of a material.
struct SurfaceMaterial {
  int fabric = -1;  ///< index into the fabrics; -1: none, a core material
  V4f base_color{1, 1, 1, 1};
  float opaque_from = 0;       ///< where the opacity of the base colour is less, nothing is drawn
  bool keeps_opacity = false;  ///< else base colour or fabric count as opaque
  bool culls_back = false;
};

/// A picture on a surface.
struct MaterialTexture {
  int image = -1;  ///< index into Materials::images; -1: none, a factor of 1
  int mapping =
      0;  ///< with which coordinates it is looked up: 0 SurfaceVertex::uv, k Surface::more_uvs[k - 1]
  Wrap wrap_u = Wrap::repeat;
  Wrap wrap_v = Wrap::repeat;
  bool nearest = false;
};

/// glTF's core material of a surface. On one with a fabric only occlusion and emission count. The base
/// colour's factors are `SurfaceMaterial::base_color`, the picture named here and Surface::colors.
struct PbrMaterial {
  MaterialTexture base_color;
  float metallic = 1;
  float roughness = 1;
  MaterialTexture metallic_roughness;  ///< linear; roughness in green, metal in blue
  MaterialTexture normal;              ///< linear, (n + 1) / 2
  float normal_scale = 1;
  MaterialTexture occlusion;  ///< linear, in red
  float occlusion_strength = 1;
  V3f emissive{0, 0, 0};  ///< linear radiance
  MaterialTexture emissive_texture;
  bool unlit = false;
};

/// What a pixel sees of a material without fabric, textures and factors multiplied; and the emission of any.
struct PbrPixel {
  V4f colour{0, 0, 0, 0};  ///< linear base colour and opacity
  /// Pairs of 16 bits, the first of each pair in the lower half: the normal in the frame of the garment, x
  /// and y (signed, 32767 is 1); metal and roughness (65535 is 1); emission red and green (half); blue,
  /// occlusion.
  std::array<std::uint32_t, 4> words{};
};

/// The largest width and height of a frame.
inline constexpr int index_pass_side_limit = 16384;

}  // namespace selvedge
