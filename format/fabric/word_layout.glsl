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
const uint fabric_reference_height = 8u;  // mm
const uint fabric_yarns = 9u;                // place of the yarn itself, level -1
const uint fabric_largest_yarn_pixel = 10u;  // width in texels of level 0; 0: no yarn
// Places of other fabrics, or 0: lit by mirrored lights from behind, and seen from behind; as places of words, they
// count as fabrics of numbers.
const uint fabric_through = 11u;
const uint fabric_turned = 12u;
const uint fabric_level_places = 13u;  // of level 0; the place of level k is k words further

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
const uint level_pairs = 12u;         // place: [product](a, b)
const uint level_coefficients = 13u;  // place: [texel][product]
const uint level_words = 14u;         // in all

// Words of the yarn (spec/brdf.md, "Yarn"), counted from its place; mm.
const uint yarn_period = 0u;     // x, y
const uint yarn_low = 2u;        // of the lowest point
const uint yarn_high = 3u;
const uint yarn_columns = 4u;    // of the cells that rays are marched through
const uint yarn_rows = 5u;
const uint yarn_cell_size = 6u;  // x, y
const uint yarn_cells = 8u;      // place: [row][column]
const uint yarn_segments = 9u;   // place: [segment]
const uint yarn_curves = 10u;    // place: [curve]
const uint yarn_light = 11u;     // place: [station][function of the angle][function of the light][channel]
const uint yarn_through = 12u;   // the same of light from below, mirrored, if that is known
const uint yarn_words = 13u;     // in all

// Words of a cell.
const uint cell_first = 0u;  // place of its references
const uint cell_count = 1u;  // of its references
const uint cell_low = 2u;    // mm, of what its segments reach
const uint cell_high = 3u;
const uint cell_words = 4u;

// Words of a reference to a segment.
const uint reference_start = 0u;  // x, y, z, mm; x and y count from the middle of the cell
const uint reference_segment = 3u;
const uint reference_words = 4u;

// Words of a segment, which reaches from a node to the next. Axis, length, radius and tangents are those of its round
// section (yarn_section.h).
const uint segment_axis = 0u;      // x, y, z, unit
const uint segment_length = 3u;    // mm
const uint segment_start = 4u;     // x, y, z, mm, of its node
const uint segment_radius = 7u;    // mm
const uint segment_tangents = 8u;  // x, y, z of that at its start, then of that at its end
const uint segment_across = 14u;   // x, y, z, likewise: where the angles about the axis count from; of a hair: cosine,
                                   // sine and share outwards of its root
const uint segment_out = 20u;       // x, y, z, likewise: from the yarn's axis to that of its ply; 0 without plies
const uint segment_station = 26u;   // at its start
const uint segment_stations = 27u; // over its length; 0: a hair
const uint segment_curve = 28u;
const uint segment_rows = 29u;  // of the noise of strands: its ply's first, and that of the ply which it goes on as
const uint segment_reach = 31u;  // mm, of the ball about its start; of a hair, the largest radius
const uint segment_rank = 32u;   // of a hair; else 0
const uint segment_squeeze = 33u;  // x, y
const uint segment_words = 35u;

// Words of a curve.
const uint curve_first_station = 0u;
const uint curve_stations = 1u;
const uint curve_albedo = 2u;  // red, green, blue
const uint curve_gloss = 5u;   // weight of the gloss
const uint curve_roughness = 6u;
const uint curve_slope = 7u;
const uint curve_groove = 8u;  // red, green, blue
const uint curve_strands = 11u;  // around it; 0: smooth
const uint curve_strand_shift = 12u;  // without whole turns
const uint curve_lays = 13u;          // turns of the strands
const uint curve_pieces = 14u;
const uint curve_seed = 15u;          // hashed
const uint curve_strand_sense = 16u;  // x, y
const uint curve_irregularity = 18u;
const uint curve_swells = 19u;
const uint curve_words = 20u;
