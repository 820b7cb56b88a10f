// Light from all around: an equirectangular picture of radiance, and its division into a few lamps and smooth
// light, by which fabrics are drawn (spec/brdf.md, "Environments").
//
// Pictures are laid out as glTF viewers have them: the middle column is seen along -z, the column a quarter
// to the right along +x, the top row along +y.
#pragma once

#include <string>
#include <vector>

#include "format/base/error.h"
#include "format/base/memory.h"
#include "format/fabric/smooth_light.h"
#include "format/scene/lights.h"

namespace selvedge {

struct EnvironmentOptions {
  double turn_degrees = 0;  ///< degrees, counter-clockwise seen from above
  double strength = 1;      ///< factor on radiance
  bool operator==(const EnvironmentOptions&) const = default;
};

/// Radiance over the sphere, linear RGB, world axes.
struct Environment {
  int width = 0;
  int height = 0;
  std::vector<V3f> radiance;  ///< [row][column], the top row first
  EnvironmentOptions options;
  std::vector<std::string> remarks{};  ///< which values of its file were changed

  /// Towards the middle of a pixel; unit, world.
  V3d direction(int x, int y) const;
  /// Solid angle of a row's pixels, sr.
  double solid_angle(int y) const;
  /// Interpolated between pixels, strength included. `direction` is unit, world.
  V3f radiance_at(const V3d& direction) const;
};

/// Bytes of a pixel: read, as a picture and as radiance, and drawn, with a copy.
inline constexpr std::uint64_t environment_bytes_per_pixel = 28;

/// Reads any picture that read_image() does, of values that are not encoded for a screen (.hdr, .exr).
/// Negative values and NaN become 0, infinite ones as bright as the brightest other one, at least 65504.
/// IMAGE_UNREADABLE unless it is 2 : 1; FILE_TOO_LARGE beyond `memory`.
Result<Environment> read_environment(const std::string& path, const EnvironmentOptions& options = {},
                                     std::uint64_t memory = default_memory_limit);

/// The mean over areas; the picture itself if it is not larger.
Environment downsample(const Environment& environment, int width);

/// Light as fabrics are drawn in it: together the environment's.
struct EnvironmentLight {
  std::vector<Light> lamps;  ///< directional, the strongest first
  SmoothLight smooth_light;  ///< world axes
};

/// The light of the same environment with these options, if `light` was made without any.
EnvironmentLight with_options(const EnvironmentLight& light, const EnvironmentOptions& options);

/// Bright parts become lamps; the rest is projected.
EnvironmentLight split_light(const Environment& environment);

/// A grey room with two square softboxes above the height of the eye: the key in front on the left (towards
/// +z and -x) and a weaker one behind on the right, so that no side of a garment is dark. 256 x 128 pixels.
/// White that faces the key shows a radiance of about 1.
Environment studio_environment(const EnvironmentOptions& options = {});

/// The studio by that name, or a picture: read_environment().
Result<Environment> load_environment(const std::string& name, const EnvironmentOptions& options = {},
                                     std::uint64_t memory = default_memory_limit);

}  // namespace selvedge
