// The factors of glTF's core material that come nearest to a fabric seen from afar: `make` keeps them in the
// fabric file (spec/fabric.md, "fallback"), and `dress` writes them to garments.
#pragma once

#include "format/fabric/fabric.h"

namespace selvedge {

/// Linear colours, in [0, 1]. Metallic is 0, roughness 1, and there is no reflection of dielectrics: beside
/// the sheen it never makes the fit better.
struct FallbackFactors {
  V3f albedo{0, 0, 0};      ///< directional albedo of the cloth along the normal, the mean by opacity
  V3f base_color{0, 0, 0};  ///< the mean of the picture; makes up for what the transmission takes from it
  /// KHR_materials_sheen: most fabrics brighten towards the rim, and where light comes from the viewer's
  /// side. Zero if the fit does without.
  V3f sheen_color{0, 0, 0};
  float sheen_roughness = 0.6F;  ///< what fits the built-in stitches best
  /// KHR_materials_diffuse_transmission: the fraction of light from behind that comes through in the
  /// brightest channel, and its colour. 0 for opaque cloth.
  float transmission = 0;
  V3f transmission_color{1, 1, 1};
};

/// Least squares in radiance over all pairs of 36 x 36 directions, each weighted by the cosine of the view as
/// a pixel is, against the yarn itself where the fabric has it, else against its coarsest level.
/// Precondition: a valid fabric with at least one level.
FallbackFactors fit_fallback(const Fabric& fabric);

/// As the fabric's file has them; fitted where it does not.
FallbackFactors fallback_of(const Fabric& fabric);

/// The text of Fabric::fallback, at most 300 bytes.
std::string fallback_json_text(const FallbackFactors& factors);

}  // namespace selvedge
