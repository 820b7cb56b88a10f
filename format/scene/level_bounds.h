// Which mip levels pixels can ask for, known before any of them is drawn or read: from a camera, or from all
// around at some distance. Bounds, never too narrow; footprint.h has the formula that pixels use.
#pragma once

#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "format/base/error.h"
#include "format/fabric/header.h"
#include "format/fabric/level_options.h"
#include "format/scene/camera.h"
#include "format/scene/scene.h"

namespace selvedge {

/// Every camera that make_camera() makes of a scene with these options, from any azimuth and elevation and
/// from any distance of a range. Distances are those of CameraOptions: of the eye, along its axis, from the
/// middle of the box around the scene.
struct Orbit {
  double nearest = 1;  ///< m
  double farthest = 1;
  V3d middle{0, 0, 0};
  V2d reach{0, 0};  ///< m; a point z before the middle is seen at most reach - slope z aside of the axis
  V2d slope{1, 1};
  V2d window_half{1, 1};  ///< as those of Camera; in parallel projection at the distance 1
  V2d window_centre{0, 0};
  Projection projection = Projection::perspective;
};

/// Of `points` (at least one, finite; world, m) for frames of width : height = `aspect`. `options` gives
/// projection, field of view, zoom and focus, `nearest` and `farthest` the distance. OPTION_OUT_OF_RANGE as
/// make_camera(), for distances that are not a range, and for options that name a point to look at.
Result<Orbit> look_all_around(std::span<const V3d> points, double aspect, double nearest, double farthest,
                              const CameraOptions& options);

using Viewpoints = std::variant<Camera, Orbit>;

/// What pixels cover of a fabric, over all that show it.
struct PixelCover {
  /// At least so much lies across the shorter axis of any pixel's footprint; infinite where none shows it, 0
  /// where there is no bound.
  double least = HUGE_VAL;
  /// At most so much lies across one of the `taps` parts of any pixel's footprint; 0 where none shows it,
  /// infinite where there is no bound.
  double most = 0;
  bool fronts = false;  ///< whether they may be seen
  bool backs = false;

  PixelCover& operator|=(const PixelCover& other);
};

/// The materials in all frames of `height` pixels from `sight`. `units[i]`: how many of what is counted in
/// lie along u and v of a repeat of material i, such as texels of level 0 or millimetres. Surfaces that hide
/// each other are taken to be seen; materials without a fabric are not, nor is a side that its material does
/// not show. Precondition: 1 <= taps.
std::vector<PixelCover> pixel_covers(const Scene& scene, const Viewpoints& sight, int height, int taps,
                                     std::span<const V2d> units);

/// First and last of the levels that pixels may ask for.
struct LevelRange {
  int first = 0;
  int last = 0;
};

/// Of a fabric with as many levels as there can be; `cover` in texels of its level 0. Options that force a
/// level are not looked at. Where no pixel shows it, all there is is the last of `levels`.
LevelRange levels_asked(const PixelCover& cover, const LevelOptions& options, int levels);

/// What pixels ask of the texels of some cloth, of whatever fabric it is.
struct TexelDemand {
  double min_mm = 0;  ///< PixelCover::least, of millimetres of cloth; infinite: not seen
  double max_mm = 0;  ///< PixelCover::most; may be infinite
  double bias = 0;    ///< LevelOptions::bias
};

/// The finest level that the demand needs of cloth whose texels at level 0 have these sides (mm), 0 to
/// `levels` - 1, and the coarsest. With a little to spare: a level more where it is nearly needed.
LevelRange levels_for(const TexelDemand& demand, const V2d& texel_mm, int levels);

/// How many levels of the whole may be asked for that a file does not have, as far as it says.
struct LackingLevels {
  int finer = 0;  ///< before its first
  int coarser = 0;

  bool any() const { return finer > 0 || coarser > 0; }
  LackingLevels& operator|=(const LackingLevels& other);
};

/// Of `asked` of the whole fabric.
LackingLevels lacking_levels(const FabricHeader& header, const LevelRange& asked);

/// FABRIC_LEVELS at /whole of the fabric `name` where one level is shown everywhere, `wanted` of the whole or
/// its last, and the file does not have it.
std::optional<Error> lacking_issue(const std::string& name, const FabricHeader& header, int wanted);

/// The warning of them: FABRIC_LEVELS at /whole of the fabric `name`.
Error lacking_issue(const std::string& name, const FabricHeader& header, const LackingLevels& lacking);

/// The levels of each file that a frame of `height` pixels can ask for, by their numbers in the file: never
/// too few. Materials name the fabrics of `headers`.
/// `lacking`, where it is not null: what the frame may ask for beyond them.
std::vector<LevelRange> levels_asked(const Scene& scene, const Camera& camera, int height,
                                     const LevelOptions& options,
                                     std::span<const FabricHeader* const> headers,
                                     std::vector<LackingLevels>* lacking = nullptr);

}  // namespace selvedge
