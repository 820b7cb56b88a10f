// Every name of a fabric file and of a samples file: parts, channels, attributes (spec/fabric.md).
#pragma once

#include <array>
#include <string_view>

namespace selvedge::names {

inline constexpr int fabric_version_major = 1;
inline constexpr int fabric_version_minor = 0;

// Parts of a fabric file, in the file's order.
inline constexpr const char* part_preview = "preview";
inline constexpr const char* part_lobes = "lobes";
inline constexpr const char* part_frame = "frame";
inline constexpr const char* part_table = "table";
inline constexpr const char* part_opacity = "opacity";

// Channels. No data channel ends in R, G, B, A or Y: tools apply colour transforms to those.
inline constexpr std::array<const char*, 3> colour_suffix{"red", "green", "blue"};
inline constexpr std::array<const char*, 6> frame_channels{"frame.nx", "frame.ny", "frame.nz",
                                                           "frame.tx", "frame.ty", "frame.tz"};
inline constexpr std::array<const char*, 4> lobe_parameters{"cx", "cy", "cz", "n"};

// Attributes of part 0: one JSON text, its digest, and flat mirrors of what people look for.
inline constexpr const char* attribute_fabric = "selvedge.fabric";
inline constexpr const char* attribute_samples = "selvedge.samples";
inline constexpr const char* attribute_digest = "selvedge.digest";
inline constexpr const char* attribute_version = "selvedge.version";
inline constexpr const char* attribute_model = "selvedge.model";
inline constexpr const char* attribute_period = "selvedge.mmPerRepeat";
inline constexpr const char* attribute_reference_height = "selvedge.referenceHeight";
inline constexpr const char* attribute_wrap = "wrapmodes";

inline constexpr const char* wrap_periodic = "periodic,periodic";
inline constexpr const char* layout_equal_area = "equal-area";

// Parts of a samples file.
inline constexpr const char* part_radiance = "radiance";
inline constexpr const char* part_surface = "surface";
inline constexpr const char* part_validation = "validation";
inline constexpr const char* part_held_out = "held-out";
inline constexpr const char* part_rim = "rim";

}  // namespace selvedge::names
