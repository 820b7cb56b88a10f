// Materials of surfaces in the form that the passes use.
#pragma once

#include <array>
#include <cstdint>

#include "format/base/vec.h"
#include "format/scene/scene.h"

namespace selvedge {

/// The properties of a material that geometry passes need.
struct SurfaceMaterial {
  int fabric = -1;    ///< index into the fabrics; -1: a core material
  int material = -1;  ///< Surface::material
  V4f base_color_factor{1, 1, 1, 1};
  float min_opacity = 0;  ///< nothing is drawn if the opacity of the base colour, or of the mask, is less
  bool keeps_opacity = false;  ///< else base colour and fabric count as opaque
  bool culls_back = false;
  V3f tint{1, 1, 1};                   ///< linear factor on the fabric's light
  bool is_tinted = false;              ///< the base colour is one more, of textures and vertex colours
  bool has_normal_texture = false;     ///< a normal texture bends the fabric's frame
  bool has_occlusion_texture = false;  ///< an occlusion texture dims what reaches the fabric from all around
  bool is_modified() const { return is_tinted || has_normal_texture || has_occlusion_texture; }
};

/// A picture on a surface.
struct MaterialTexture {
  int image = -1;   ///< index into Materials::pictures; -1: no texture, a factor of 1
  int mapping = 0;  ///< texture coordinates: 0 is SurfaceVertex::uv, k Surface::extra_uvs[k - 1]
  Wrap wrap_u = Wrap::repeat;
  Wrap wrap_v = Wrap::repeat;
  bool has_nearest_filter = false;
};

/// glTF's core material of a surface. The base colour is the product of `SurfaceMaterial::base_color_factor`,
/// the texture here and Surface::colors. With a fabric there are occlusion, emission, and what the garment
/// keeps (GarmentTextures): the tint as base colour, the normal texture, and the mask.
struct PbrMaterial {
  MaterialTexture base_color_texture;
  float metallic = 1;
  float roughness = 1;
  MaterialTexture
      metallic_roughness_texture;  ///< linear; roughness in green, metal in blue; or the mask, in alpha
  MaterialTexture normal_texture;  ///< linear, (n + 1) / 2
  float normal_scale = 1;
  int normal_frame = 0;               ///< Mappings::normal_frame
  MaterialTexture occlusion_texture;  ///< linear, in red
  float occlusion_strength = 1;
  V3f emissive{0, 0, 0};  ///< linear radiance
  MaterialTexture emissive_texture;
  bool unlit = false;
};

/// In the order of pbr_fragment.glsl.
inline std::array<const MaterialTexture*, 5> textures_of(const PbrMaterial& pbr) {
  return {&pbr.base_color_texture, &pbr.metallic_roughness_texture, &pbr.normal_texture,
          &pbr.occlusion_texture, &pbr.emissive_texture};
}

/// The core material at a pixel, textures and factors multiplied; with a fabric, emission, occlusion, tint
/// and normal.
struct PbrPixel {
  V4f colour{0, 0, 0, 0};  ///< linear base colour and opacity
  /// Pairs of 16 bits, the first of each pair in the lower half: the normal in the frame of the surface, x
  /// and y (signed, 32767 is 1); metal and roughness (65535 is 1); emission red and green (half); blue,
  /// occlusion.
  std::array<std::uint32_t, 4> packed_values{};
};

/// The largest width and height of a frame.
inline constexpr int max_frame_side = 16384;

}  // namespace selvedge
