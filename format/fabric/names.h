// The names in fabric files and samples files: parts, channels, attributes, members of the JSON texts
// (spec/fabric.md, spec/samples.md).
#pragma once

#include <array>

namespace selvedge::names {

inline constexpr int fabric_version_major = 4;
inline constexpr int fabric_version_minor = 0;
inline constexpr int version_of_packed_yarn = 5;  ///< major; other files have the one above
inline constexpr int samples_version = 3;

// Parts of a fabric file, in the file's order.
inline constexpr const char* part_preview = "preview";
inline constexpr const char* part_lobes = "lobes";
inline constexpr const char* part_frame = "frame";
inline constexpr const char* part_table = "table";
inline constexpr const char* part_opacity = "opacity";
inline constexpr const char* part_light_table = "light";
inline constexpr const char* part_products = "products";
inline constexpr const char* part_bases = "bases";
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

/// Members of the JSON texts. The members of `layers` and `digests` have the names of parts.
namespace selvedge::names::member {

inline constexpr const char* version = "version";
inline constexpr const char* texels = "texels";
inline constexpr const char* levels = "levels";
inline constexpr const char* mm_per_repeat = "mmPerRepeat";
inline constexpr const char* reference_height = "referenceHeight";
inline constexpr const char* thickness = "thickness";
inline constexpr const char* views = "views";
inline constexpr const char* layout = "layout";
inline constexpr const char* columns = "columns";
inline constexpr const char* rows = "rows";
inline constexpr const char* layers = "layers";
inline constexpr const char* sides = "sides";
inline constexpr const char* curve_count = "curves";
inline constexpr const char* node_count = "nodes";
inline constexpr const char* station_count = "stations";
inline constexpr const char* field_count = "fields";
inline constexpr const char* values_per_station = "valuesPerStation";
inline constexpr const char* provenance = "provenance";
inline constexpr const char* lights = "lights";
inline constexpr const char* pairs = "pairs";

// In the record of a fit, in a fabric's provenance.
inline constexpr const char* fit = "fit";
inline constexpr const char* peak = "peak";

// In samples files only.
inline constexpr const char* both = "both";
inline constexpr const char* directions = "directions";
inline constexpr const char* samples_per_texel = "samplesPerTexel";
inline constexpr const char* truth_samples = "truthSamples";
inline constexpr const char* light = "light";
inline constexpr const char* view = "view";

}  // namespace selvedge::names::member
