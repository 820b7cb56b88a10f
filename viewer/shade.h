// The evaluation on the processor (paper section 6): every covered pixel of a layer is turned into light on
// all cores and laid behind the layers before it.
#pragma once

#include <cstdint>
#include <span>

#include "format/evaluate.h"
#include "viewer/camera.h"
#include "viewer/index_pass.h"
#include "viewer/lights.h"

namespace selvedge {

/// The garment's frame at a pixel. The picture of the fabric is stuck to the cloth: `tangent` runs along
/// growing u and `up` along falling v on both sides, `normal` points out of the side that is seen. So the
/// back of a cloth looks like the front's mirror image in the cloth's plane; the frame is left-handed
/// wherever the picture is seen mirrored.
struct GarmentFrame {
  V3f tangent;
  V3f up;
  V3f normal;
  /// A world direction as the fabric knows it.
  V3f into(const V3f& d) const { return {d.dot(tangent), d.dot(up), d.dot(normal)}; }
};

/// `normal` and `tangent` as interpolated (geometry.h), neither unit nor perpendicular; `view` unit. A normal
/// that an interpolation turned away from the viewer is bent until the view just clears the horizon. Where
/// there is no tangent the paper's fixed axis takes its place.
GarmentFrame garment_frame(const V3f& normal, const V4f& tangent, bool seen_from_back, const V3f& view);

struct ShadingScene {
  Camera camera;
  int width = 1;  ///< of the whole frame
  int height = 1;
  std::span<const SurfaceLook> looks;  ///< of the surfaces
  std::span<const Fabric> fabrics;
  std::span<const Light> lights;
};

/// What one layer did.
struct LayerCount {
  std::int64_t covered = 0;  ///< pixels that the layer has
  std::int64_t open = 0;     ///< of these, pixels through which something behind would show
};

/// Adds a layer (rows first_row ... of the frame, from its bottom) behind what `pixels` holds: radiance times
/// opacity, and opacity. Marks pixels that are empty, or opaque to less than half a step of an 8-bit picture,
/// in `finished`. A surface without fabric is Lambertian: base colour / pi.
LayerCount shade_layer(const ShadingScene& scene, const PixelLayer& layer, int first_row,
                       std::span<V4f> pixels, std::span<std::uint8_t> finished);

}  // namespace selvedge
