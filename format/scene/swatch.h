// A flat swatch without end, seen from one of a few places: it shows fabrics, and the geometry of
// its stitch (converter/bake/truth_swatch.h), so that one is the truth of the other.
//
// World: metres, the cloth is the plane z = 0, u grows along +x and v along -y from the origin, one repeat a
// unit of each. A cell of a stitch lies in it with its own x and y, its reference plane at z = 0.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "format/scene/camera.h"
#include "format/scene/lights.h"
#include "format/scene/scene.h"

namespace selvedge {

enum class SwatchView { near, middle, far, grazing };

/// As options and files call them, in the order of the enumeration.
inline constexpr std::array<std::string_view, 4> swatch_view_names{"near", "middle", "far", "grazing"};
inline constexpr std::array<SwatchView, 4> all_swatch_views{SwatchView::near, SwatchView::middle,
                                                            SwatchView::far, SwatchView::grazing};
std::string_view name_of(SwatchView view);
std::optional<SwatchView> swatch_view_named(std::string_view name);

/// One picture of a swatch: everything but the cloth.
struct SwatchShot {
  Camera camera;
  int width = 1;
  int height = 1;
  std::vector<Light> lights;
};

/// The picture's height shows 2, 6 and 64 repeats (of the longer period) from 60, 45 and 72 degrees above the
/// cloth, and across its middle 6 repeats from 12 degrees above it (grazing); each from another side, so that
/// no direction counts twice (docs/trade.md). The field of view is 10 degrees high. A
/// key light of irradiance 1 and a fill light of 0.3 stand still. Preconditions: both periods above 0 (mm),
/// width and height at least 1, the picture at most 4 times as wide as high: then the cloth fills the frame.
SwatchShot swatch_shot(SwatchView view, const V2d& period_mm, int width, int height);

/// A digest of the four shots, their numbers to nine digits: it differs where another build has other places
/// or lights.
std::string digest_of_shots(const V2d& period_mm, int width, int height);

/// A rectangle of whole repeats in the plane z = 0 around the origin's cell, from repeat `first` to before
/// `end` (along u and v), wearing fabric 0. Periods in mm.
Scene swatch_scene(const V2d& period_mm, const V2i& first, const V2i& end);

/// A rectangle that covers all that the camera sees of the plane.
/// Precondition: all four corners of the frame see it.
Scene swatch_scene(const V2d& period_mm, const SwatchShot& shot);

/// A ray of the picture: where it meets the plane z = 0 (m), and how.
struct SwatchRay {
  V2d point{0, 0};      ///< m
  V3d view{0, 0, 1};    ///< unit, towards the viewer; z > 0
  double distance = 0;  ///< m, from the camera's position (perspective) or image plane (parallel)
};

/// Through the image point (s, t) in [-1, 1]^2 (Camera); nothing where it does not meet the plane, or from
/// below.
std::optional<SwatchRay> swatch_ray(const Camera& camera, const V2d& image_point);

}  // namespace selvedge
