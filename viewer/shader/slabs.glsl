// Marches rays through the slabs of a fabric (the GLSL twin of format/fabric/slabs.h) in double precision.
// shade_texel() evaluates the entries that they meet, or the only entry of a texel without slabs.
//
// The walk of a ray along one axis of the cells, by the depth below the top.
struct Walk {
  float slope;
  float edge;
  float steps;
  int cell;
  int cells;
};
Walk walk_from(double start, float slope, int cells) {
  // Single precision would lose the position within the cell.
  double repeated = start - floor(start / double(cells)) * double(cells);
  Walk walk;
  walk.slope = slope;
  walk.steps = 0.0;
  walk.cells = cells;
  walk.cell = clamp(int(repeated), 0, cells - 1);
  float within = float(repeated - double(walk.cell));
  walk.edge = slope > 0.0 ? 1.0 - within : within;
  return walk;
}
float leaves(Walk walk) {
  return walk.slope == 0.0 ? largest : (walk.edge + walk.steps) / abs(walk.slope);
}
void step_on(inout Walk walk) {
  walk.steps += 1.0;
  walk.cell += walk.slope > 0.0 ? 1 : -1;
  if (walk.cell == walk.cells) walk.cell = 0;
  if (walk.cell < 0) walk.cell = walk.cells - 1;
}

// Finds texel and entry of the yarn that a ray meets; false if there is none.
bool march(uint fabric, uint level, dvec2 uv, vec3 view, out uvec2 hit) {
  hit = uvec2(0u);
  int columns = int(word(level + level_columns));
  int rows = int(word(level + level_rows));
  int slabs = int(word(level + level_slabs));
  float highest = number(level + level_highest);
  float deepest = highest - number(level + level_lowest);
  if (!(deepest > 0.0)) return false;
  ivec2 cells = ivec2(int(word(level + level_width)) * columns, int(word(level + level_height)) * rows);
  dvec2 per_mm = dvec2(number(fabric + fabric_repeats_per_mm_u), number(fabric + fabric_repeats_per_mm_v));
  dvec2 up = dvec2(view.xy) / double(max(view.z, 1.0 / 32.0)) * per_mm * dvec2(cells);
  double above = double(highest) - double(number(fabric + fabric_reference_height));
  Walk x = walk_from(uv.x * double(cells.x) + above * up.x, float(-up.x), cells.x);
  Walk y = walk_from(uv.y * double(cells.y) + above * up.y, float(-up.y), cells.y);
  float entry_depth = 0.0;
  for (int visited = 0; visited < 16384; ++visited) {
    float exit_depth = min(min(leaves(x), leaves(y)), deepest);
    float ray_top = highest - entry_depth;
    float ray_bottom = highest - exit_depth;
    uint texel = uint(y.cell / rows) * word(level + level_width) + uint(x.cell / columns);
    uint cell = uint((y.cell % rows) * columns + x.cell % columns);
    float best = -largest;
    bool met = false;
    for (int slab = 0; slab < slabs; ++slab) {
      uint entry = uint(slab * columns * rows) + cell;
      uint heights = word(level + level_heights) + 2u * (texel * uint(slabs * columns * rows) + entry);
      float top = number(heights);
      float bottom = number(heights + 1u);
      if (!(top > bottom) || ray_bottom > top || ray_top < bottom || min(top, ray_top) <= best) continue;
      best = min(top, ray_top);
      hit = uvec2(texel, entry);
      met = true;
    }
    if (met) return true;
    if (exit_depth >= deepest) return false;
    entry_depth = exit_depth;
    if (leaves(x) <= exit_depth) {
      step_on(x);
    } else {
      step_on(y);
    }
  }
  return false;
}

void shade_texel(uint fabric_index, uint level_index, uint texel, vec3 view, mat3 frame, float weight,
                 inout vec4 sum) {
  uint fabric = word(fabric_index);
  uint level = word(fabric + fabric_level_places + level_index);
  if (word(level + level_heights) == 0u) {
    shade_entry(fabric, level, texel, 0u, view, frame, weight, sum);
    return;
  }
  int columns = int(word(level + level_columns));
  int rows = int(word(level + level_rows));
  ivec2 at = ivec2(int(texel % word(level + level_width)) * columns, int(texel / word(level + level_width)) * rows);
  dvec2 cells = dvec2(double(int(word(level + level_width)) * columns), double(int(word(level + level_height)) * rows));
  float share = weight / float(columns * rows);
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      dvec2 centre = (dvec2(at + ivec2(column, row)) + dvec2(0.5LF)) / cells;
      uvec2 hit;
      if (march(fabric, level, centre, view, hit)) {
        shade_entry(fabric, level, hit.x, hit.y, view, frame, share, sum);
      }
    }
  }
}
