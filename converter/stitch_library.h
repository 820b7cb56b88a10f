// The built-in stitches: Bézier control points made from a few lengths.
#pragma once

#include <string>
#include <vector>

#include "converter/stitch.h"

namespace selvedge {

/// Stockinette, seen from its face: one wale by one course per cell. The centre line of one loop, for t from
/// 0 to 2 pi (the middle of one foot to that of the next):
///   x = wale t / (2 pi) + neck sin 2t
///   y = -height cos t
///   z = -depth cos 2t
/// The legs are at the front (t = pi/2, 3 pi/2), head and foot behind; every course draws its loops from the
/// back through those of the course below. The default radius is a little over an eighth of a wale: about the
/// most there is room for, so that legs and heads touch.
struct PlainKnitOptions {
  double wale_mm = 5.0;    ///< width of one stitch
  double course_mm = 3.8;  ///< height of one stitch
  double radius_mm = 0.65;
  double neck_mm = 1.18;   ///< how far a leg leans: the V of the face
  double height_mm = 3.4;  ///< half of a loop's, feet to head
  double depth_mm = 0.85;  ///< half of the way from back to front
  int segments = 16;       ///< Bézier segments per loop, at least 4
  V3f albedo{0.50F, 0.13F, 0.09F};
};
StitchPattern plain_knit(const PlainKnitOptions& options = {});

/// Plain weave, two warp by two weft yarns per cell; the warp runs along y. Each yarn is half a cosine from
/// one crossing to the next, warp over weft and under by turns.
struct PlainWeaveOptions {
  double spacing_mm = 1.0;  ///< between neighbouring yarns, both ways
  double warp_radius_mm = 0.3;
  double weft_radius_mm = 0.3;
  double warp_share = 0.5;  ///< how much of the height at a crossing the warp gives way, 0 to 1
  V3f warp_albedo{0.62F, 0.58F, 0.50F};
  V3f weft_albedo{0.09F, 0.17F, 0.38F};
};
StitchPattern plain_weave(const PlainWeaveOptions& options = {});

struct StitchInfo {
  std::string name;
  std::string description;  ///< one line
};

std::vector<StitchInfo> built_in_stitches();

/// A built-in stitch by its name, or else the stitch description in a file. Refuses (stitch_unknown) what is
/// neither.
Result<StitchPattern> find_stitch(const std::string& name_or_json_path);

}  // namespace selvedge
