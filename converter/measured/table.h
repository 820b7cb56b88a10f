// The list of the pictures of a flat sample: files with the directions of light and view, from a table or
// from the files' names (docs/measured.md).
#pragma once

#include <string>
#include <vector>

#include "format/base/error.h"
#include "format/fabric/directions.h"

namespace selvedge {

/// One picture. Directions are unit and on the sample's front, z > 0: x to the right of the picture, y
/// upwards, z out of the cloth.
struct MeasuredPicture {
  std::string file;
  DirectionPair pair;
  double exposure = 1;  ///< value that white facing the light has in it, > 0
  int line = 0;         ///< of the table; 0: from the file's name
};

/// The least number of pictures of which a fabric can be made.
inline constexpr int min_pictures = 20;

/// `path` is a table (CSV): a line of names, then a line for each picture. Names, in any order: `file`,
/// beside the table; `light_x`, `light_y`, `light_z`, `view_x`, `view_y`, `view_z`, of any length; `exposure`
/// may be absent. Or it is a folder, of whose files, and those of its folders, the names have the angles in
/// degrees, as in tl030_pl180_tv000_pv000.png: polar angle and azimuth of light and view. In order of the
/// table, or of names. FILE_MISSING, SAMPLES_MALFORMED with the line or the file.
Result<std::vector<MeasuredPicture>> read_picture_table(const std::string& path);

}  // namespace selvedge
