// Layout of the words of packed fabrics (gpu_words.h); GLSL and C++ both include this file. Word i is the place of
// fabric i. A place is the index of a word; place 0 means that the layer is absent. Numbers are 32-bit floats; two
// values of a table share a word if half precision holds all of them exactly (`_halves` is then 1).

// Words of a fabric, counted from its place.
const uint fabric_level_count = 0u;
const uint fabric_view_columns = 1u;  // of the grid of view directions
const uint fabric_view_rows = 2u;
const uint fabric_light_columns = 3u;
const uint fabric_light_rows = 4u;
const uint fabric_radiance_scale = 5u;
const uint fabric_view_basis = 6u;   // place of phi: [a - 1][view]
const uint fabric_light_basis = 7u;  // place of psi: [b][light][channel]
const uint fabric_repeats_per_mm_u = 8u;
const uint fabric_repeats_per_mm_v = 9u;  // upwards: negative
const uint fabric_reference_height = 10u;
const uint fabric_width = 11u;  // texels of level 0 of the whole fabric
const uint fabric_height = 12u;
const uint fabric_first_level = 13u;   // the level of the whole fabric that is the first level here
const uint fabric_level_places = 14u;  // of level 0; the place of level k is k words further

// Words of a level, counted from its place.
const uint level_width = 0u;
const uint level_height = 1u;
const uint level_lobe_count = 2u;
const uint level_lobes = 3u;       // place: [texel][channel](rho, then Cx, Cy, Cz, n of each lobe)
const uint level_frames = 4u;      // place: [texel](normal, tangent)
const uint level_view_table = 5u;  // place: [texel][view][channel]
const uint level_view_table_halves = 6u;
const uint level_opacity = 7u;  // place: [texel][view]
const uint level_opacity_halves = 8u;
const uint level_light_table = 9u;  // place: [texel][light][channel]
const uint level_light_table_halves = 10u;
const uint level_products = 11u;      // their number
const uint level_entries = 12u;       // of a texel
const uint level_pairs = 13u;         // place: [product](a, b)
const uint level_coefficients = 14u;  // place: [texel][entry][product]
const uint level_heights = 15u;       // place: [texel][entry](top, bottom), mm
const uint level_columns = 16u;       // of the cells of a texel
const uint level_rows = 17u;
const uint level_slabs = 18u;
const uint level_highest = 19u;  // top, mm
const uint level_lowest = 20u;   // bottom, mm
const uint level_words = 21u;    // in all
