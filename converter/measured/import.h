// Measured fabrics: rectified pictures of a flat sample under many lights and from many views -> radiance
// samples (docs/measured.md).
//
// A picture's linear value over its exposure is radiance in units of a white diffuser which faces the
// light: 1 / pi per unit perpendicular irradiance, the light's cosine included. Pictures show the front, x to
// the right, y upwards; foreshortening is taken out of them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "format/base/error.h"
#include "format/base/progress.h"
#include "format/base/vec.h"
#include "format/fabric/directions.h"

namespace selvedge {

/// One picture. Directions are unit and on the sample's front, z > 0: x to the right of the picture, y
/// upwards, z out of the cloth.
struct MeasuredPicture {
  std::string file;
  DirectionPair pair;
  double exposure = 1;  ///< value that white facing the light has in it, > 0
  int table_line = 0;   ///< of the table; 0: from the file's name
};

/// The least number of pictures of which a fabric can be made.
inline constexpr int min_pictures = 20;

/// `path` is a table (CSV): a line of names, then a line for each picture. Names, in any order: `file`,
/// beside the table; `light_x`, `light_y`, `light_z`, `view_x`, `view_y`, `view_z`, of any length; `exposure`
/// may be absent. Or it is a folder, whose files, also in subfolders, have the angles in their names, in
/// degrees, as in tl030_pl180_tv000_pv000.png: polar angle and azimuth of light and view. In order of the
/// table, or of names. FILE_MISSING, SAMPLES_MALFORMED with the line or the file.
Result<std::vector<MeasuredPicture>> read_picture_table(const std::string& path);

/// Colours of pictures with whole numbers, which are sRGB-coded or linear; xyz: linear CIE XYZ (of white
/// D65).
enum class PictureColours { srgb, linear, xyz };

struct ImportOptions {
  double width_mm = 0;             ///< of a picture, whose pixels are square; > 0
  std::optional<V2d> period_mm{};  ///< of the cloth; else found in the pictures
  std::optional<V2i> texels{};     ///< of one repeat; else as many as it has pixels, at most 32 a side
  int views = 64;                  ///< of the grids of the samples, 1 to 4096
  int lights = 64;
  double thickness_mm = 0;     ///< of the cloth, >= 0; the texels lie on top
  std::string opacity_path{};  ///< a picture that is black in holes; else no holes
  PictureColours colours = PictureColours::srgb;
  std::uint64_t seed = 1;  ///< of the choice of the pictures that are held out
  std::uint64_t max_memory = std::uint64_t{4} << 30U;
};

struct ImportReport {
  int picture_count = 0;
  int held_out_count = 0;  ///< validation and held-out together
  V2i texels{0, 0};
  V2d period_mm{0, 0};
  V2d repeats{0, 0};            ///< in a picture
  double repeat_deviation = 0;  ///< root mean square difference of repeats from their mean, relative
  double leave_one_out_error =
      0;  ///< relative root mean square error of the interpolation at pictures left out one by one
  double seconds = 0;
};

/// Writes a samples file of the pictures that `table` lists (read_picture_table()). Their pairs of directions
/// are scattered in any way: the grids are interpolated, and pictures that are held out become the validation
/// and held-out pairs as they are. Bytes do not depend on the number of threads. In memory: 24 bytes for each
/// texel and picture, 80 MB for each thread, and 52 for each pixel of as many pictures at once as there is
/// room for, or 112 where the period is found. SAMPLES_MALFORMED, IMAGE_UNREADABLE, IMAGE_MISMATCH for
/// pictures of several sizes, IMAGE_MALFORMED where no period is found, OPTION_OUT_OF_RANGE, FILE_TOO_LARGE
/// beyond `max_memory`.
Result<ImportReport> import_pictures(const std::string& table, const ImportOptions& options,
                                     const std::string& output, const Progress& progress = {});

}  // namespace selvedge
