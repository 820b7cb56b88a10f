// The names in fabric files and samples files: parts, channels, attributes (spec/fabric.md,
// spec/samples.md).
#pragma once

#include <array>

namespace selvedge::names {

inline constexpr int fabric_version_major = 4;
inline constexpr int fabric_version_minor = 0;
inline constexpr int version_of_packed_yarn = 5;  ///< major; other files have the one above
inline constexpr int minor_version_of_maps = 1;   ///< of that one
inline constexpr int samples_version = 3;

// Parts of a fabric file beside its layers of texels (layers.cpp).
inline constexpr const char* part_preview = "preview";
inline constexpr const char* part_yarns = "yarns";
inline constexpr const char* part_indirect = "indirect";

// Channels. No data channel ends in R, G, B, A or Y: tools apply colour transforms to those.
inline constexpr std::array<const char*, 4> preview_channels{"R", "G", "B", "A"};
inline constexpr std::array<const char*, 3> colour_suffix{"red", "green", "blue"};
inline constexpr std::array<const char*, 6> frame_channels{"nx", "ny", "nz", "tx", "ty", "tz"};
inline constexpr std::array<const char*, 4> lobe_parameters{"cx", "cy", "cz", "n"};

// Attributes of part 0: one JSON text and its digest.
inline constexpr const char* attribute_fabric = "selvedge.fabric";
inline constexpr const char* attribute_samples = "selvedge.samples";
inline constexpr const char* attribute_digest = "selvedge.digest";
inline constexpr const char* attribute_wrap = "wrapmodes";

inline constexpr const char* wrap_periodic = "periodic,periodic";
inline constexpr const char* layout_equal_area = "equal-area";

// Parts of a samples file.
inline constexpr const char* part_radiance = "radiance";
inline constexpr const char* part_surface = "surface";
inline constexpr const char* part_validation = "validation";
inline constexpr const char* part_held_out = "held-out";
inline constexpr const char* part_measured = "measured";
inline constexpr const char* part_light_through = "through.indirect";

}  // namespace selvedge::names
