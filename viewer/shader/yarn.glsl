// The yarn itself, level -1 of a fabric, seen and lit along rays: the twin of format/fabric/yarns.h (spec/brdf.md,
// "Yarn"), held to it by a test. shade_yarn() adds weight * alpha * (radiance, 1) of a point. In single precision, so
// that WebGL 2 can do it. The includer defines what evaluate.glsl asks for, and includes that first.

// Distance to what a ray does not meet.
const float nowhere = 1e30;

struct YarnHit {
  uint segment;     // place
  vec3 from_start;  // mm, from the segment's node to the point
};
struct YarnPoint {
  vec3 normal;
  vec3 fibre;
  vec2 angle;  // about the axis: cosine, sine
  float outward;  // share of the normal in the way from the yarn's axis to that of its ply
  float station;
  uint curve;        // place
  vec3 strand;       // normal of the strand that is seen
  float brightness;  // factor of all light but the gloss
  float roughness;   // with that of strands which are not seen apart,
  float matt;        // and what they leave of the diffuse light
};

vec3 lifted(vec3 d) { return normalize(vec3(d.xy, max(d.z, 1.0 / 32.0))); }
vec2 wrapped(vec2 at, vec2 period) {
  vec2 result = at - floor(at / period) * period;
  return vec2(result.x >= 0.0 && result.x < period.x ? result.x : 0.0,
              result.y >= 0.0 && result.y < period.y ? result.y : 0.0);
}

// The walk of a ray along one axis of the cells.
struct YarnWalk {
  int cell;
  int forward;
  int cells;
  float taken;
  float first_edge;  // the ray's way to the first edge
  float each;        // and from one to the next
};
YarnWalk yarn_walk(float origin, float direction, float size, int cells) {
  YarnWalk walk;
  walk.forward = direction > 0.0 ? 1 : -1;
  walk.cells = cells;
  walk.cell = clamp(int(origin / size), 0, cells - 1);
  walk.taken = 0.0;
  bool moves = abs(direction) > 1e-20;
  float edge = float(walk.cell + (direction > 0.0 ? 1 : 0)) * size;
  walk.first_edge = moves ? (edge - origin) / direction : nowhere;
  walk.each = moves ? size / abs(direction) : nowhere;
  return walk;
}
float next_edge(YarnWalk walk) { return walk.first_edge + walk.taken * walk.each; }
// Returns by how many repeats the ray moves on: -1, 0 or 1.
int advance(inout YarnWalk walk) {
  walk.taken += 1.0;
  walk.cell += walk.forward;
  if (walk.cell >= 0 && walk.cell < walk.cells) return 0;
  walk.cell -= walk.forward * walk.cells;
  return walk.forward;
}

// format/fabric/yarn_section.h; the squeeze of a segment.
vec2 squeeze_of(uint segment) {
  return vec2(number(segment + segment_squeeze), number(segment + segment_squeeze + 1u));
}
vec3 squeezed(vec3 p, vec2 squeeze) { return vec3(p.xy - squeeze * dot(squeeze, p.xy), p.z); }
vec3 stretched(vec3 p, vec2 squeeze) {
  return vec3(p.xy + squeeze * (dot(squeeze, p.xy) / (1.0 - dot(squeeze, squeeze))), p.z);
}

// The distance, above `start`, at which a ray enters the side of a segment or its first end, else `nowhere`. The other
// end is the next segment's. `from`: the ray's origin from the segment's start.
// `radii`: of the side and of the ball.
float enter_segment(vec3 from, vec3 direction, uint segment, float start, vec2 radii) {
  vec2 squeeze = squeeze_of(segment);
  float d2 = 1.0;
  if (squeeze != vec2(0.0)) {
    from = squeezed(from, squeeze);
    direction = squeezed(direction, squeeze);
    d2 = dot(direction, direction);
  }
  vec3 axis = vector_at(segment + segment_axis);
  vec2 r2 = radii * radii;
  float back = dot(direction, from);
  vec3 off = cross(from, direction);
  float g = d2 * r2.y - dot(off, off);
  float entry = nowhere;
  if (g > 0.0) {
    float end = (-back - sqrt(g)) / d2;
    if (end > start) entry = end;
  }
  // The side: between the lines lie |gap| / |normal|.
  vec3 normal = cross(direction, axis);
  float a = dot(normal, normal);
  float gap = dot(from, normal);
  float h = a * r2.x - gap * gap;
  if (h > 0.0) {
    float along = dot(axis, from);
    float slope = dot(axis, direction);
    float side = (along * slope - back - sqrt(h)) / a;
    float at = along + side * slope;
    if (at > 0.0 && at < number(segment + segment_length) && side > start) entry = min(entry, side);
  }
  return entry;
}
bool is_in_segment(vec3 from, uint segment, float radius) {
  vec3 axis = vector_at(segment + segment_axis);
  from = squeezed(from, squeeze_of(segment));
  vec3 off = from - axis * clamp(dot(axis, from), 0.0, number(segment + segment_length));
  return radius * radius > dot(off, off);
}

// Radii of a segment's side and of the ball about its start, for rays that stand for so much, mm; of a hair that is
// left out for these, and of all that follow it in a list, 0.
vec2 radii_of(uint segment, float width) {
  float radius = number(segment + segment_radius);
  float reach = number(segment + segment_reach);
  float rank = number(segment + segment_rank);
  if (!(rank > 0.0)) return vec2(radius, reach);
  float wide = min(max(0.5 * width, radius), reach);
  return vec2(wide * rank < radius ? wide : 0.0);
}

// Finds the first segment that a ray enters; with `any`, whether it enters one or begins in one. Origin: mm, within the
// period; the direction is unit and not level.
bool march_yarn(uint yarn, vec3 origin, vec3 direction, bool any, float width, out YarnHit hit) {
  vec2 size = vec2(number(yarn + yarn_cell_size), number(yarn + yarn_cell_size + 1u));
  vec2 period = vec2(number(yarn + yarn_period), number(yarn + yarn_period + 1u));
  YarnWalk x = yarn_walk(origin.x, direction.x, size.x, int(word(yarn + yarn_columns)));
  YarnWalk y = yarn_walk(origin.y, direction.y, size.y, int(word(yarn + yarn_rows)));
  float bound = number(yarn + (direction.z < 0.0 ? yarn_low : yarn_high));
  float end = (bound - origin.z) / direction.z;
  float entered = 0.0;
  float nearest = nowhere;
  hit = YarnHit(0u, vec3(0.0));
  for (int visited = 0; visited < 16384; ++visited) {
    float left = min(min(next_edge(x), next_edge(y)), end);
    uint cell = word(yarn + yarn_cells) + cell_words * uint(y.cell * x.cells + x.cell);
    float from = origin.z + direction.z * entered;
    float to = origin.z + direction.z * left;
    uint first = word(cell + cell_first);
    uint last = first + reference_words * word(cell + cell_count);
    if (first < last && min(from, to) <= number(cell + cell_high) && max(from, to) >= number(cell + cell_low)) {
      vec3 local = origin + direction * entered - vec3((vec2(float(x.cell), float(y.cell)) + 0.5) * size, 0.0);
      for (uint reference = first; reference < last; reference += reference_words) {
        vec3 off = local - vector_at(reference + reference_start);
        uint segment = word(yarn + yarn_segments) + segment_words * word(reference + reference_segment);
        vec2 radii = radii_of(segment, width);
        if (radii.x == 0.0) break;
        if (any && visited == 0 && is_in_segment(off, segment, radii.x)) return true;
        float entry = enter_segment(off, direction, segment, -entered, radii);
        if (!(entry < nearest - entered)) continue;
        if (any) return true;
        nearest = entered + entry;
        hit = YarnHit(segment, off + direction * entry);
      }
    }
    if (nearest <= left) return true;
    if (left >= end) break;
    entered = left;
    if (next_edge(x) <= left) {
      origin.x -= float(advance(x)) * period.x;
    } else {
      origin.y -= float(advance(y)) * period.y;
    }
  }
  return nearest < nowhere;
}

bool trace_yarn(uint fabric, vec2 uv, vec3 view, float width, out YarnHit hit) {
  uint yarn = word(fabric + fabric_yarns);
  vec3 up = lifted(view);
  float high = number(yarn + yarn_high);
  // From a little higher: a ray that begins on a yarn does not enter it.
  float above = high + (high - number(yarn + yarn_low)) / 256.0;
  float rise = (above - number(fabric + fabric_reference_height)) / up.z;
  vec2 period = vec2(number(yarn + yarn_period), number(yarn + yarn_period + 1u));
  vec2 at = wrapped(vec2(uv.x, -uv.y) * period + rise * up.xy, period);
  return march_yarn(yarn, vec3(at, above), -up, false, width, hit);
}

YarnPoint yarn_point_at(uint yarn, YarnHit hit) {
  float reach = number(hit.segment + segment_length);
  vec2 squeeze = squeeze_of(hit.segment);
  vec3 from_start = squeezed(hit.from_start, squeeze);
  vec3 along = vector_at(hit.segment + segment_axis) * reach;
  vec3 first_tangent = vector_at(hit.segment + segment_tangents);
  vec3 second_tangent = vector_at(hit.segment + segment_tangents + 3u);
  float share = 0.0;
  vec3 off = vec3(0.0);
  vec3 tangent = vec3(0.0);
  // A step of Newton's method from the straight line's nearest point to that of the smooth curve.
  for (int i = 0; i < 2; ++i) {
    float next = i == 0 ? dot(from_start, along) / (reach * reach)
                        : share + dot(off, tangent) / dot(tangent, tangent);
    share = clamp(next, -0.25, 1.25);
    float rest = 1.0 - share;
    tangent = along * (6.0 * share * rest) +
              (first_tangent * (rest * (1.0 - 3.0 * share)) + second_tangent * (share * (3.0 * share - 2.0))) * reach;
    off = from_start - along * (share * share * (3.0 - 2.0 * share)) -
          (first_tangent * (share * rest * rest) - second_tangent * (share * share * rest)) * reach;
  }
  tangent = normalize(tangent);
  YarnPoint point;
  point.curve = word(yarn + yarn_curves) + curve_words * word(hit.segment + segment_curve);
  point.station = number(hit.segment + segment_station) + share * number(hit.segment + segment_stations);
  if (point.station < 0.0) point.station += float(word(point.curve + curve_stations));
  vec3 normal = normalize(off - tangent * dot(tangent, off));  // of the round section
  point.normal = normalize(squeezed(normal, squeeze));
  point.strand = point.normal;
  point.brightness = 1.0;
  point.matt = 1.0;
  point.roughness = number(point.curve + curve_roughness);
  vec3 around = cross(tangent, normal);
  point.fibre = normalize(stretched(tangent + around * number(point.curve + curve_slope), squeeze));
  vec3 across = mix(vector_at(hit.segment + segment_across), vector_at(hit.segment + segment_across + 3u), share);
  vec2 angle = vec2(dot(normal, across), -dot(around, across));
  float norm = length(angle);
  point.angle = norm > 0.0 ? angle / norm : vec2(1.0, 0.0);
  vec3 out_of_axis = mix(vector_at(hit.segment + segment_out), vector_at(hit.segment + segment_out + 3u), share);
  point.outward = dot(normal, out_of_axis);
  if (number(hit.segment + segment_rank) > 0.0) {
    // A hair, which has the light of its root.
    vec3 root = vector_at(hit.segment + segment_across);
    point.angle = root.xy;
    point.outward = root.z;
    point.fibre = tangent;
  }
  return point;
}

bool is_yarn_hidden(uint yarn, YarnHit hit, vec3 normal, vec3 light, float width) {
  vec3 at = vector_at(hit.segment + segment_start) + hit.from_start +
            normal * (number(hit.segment + segment_radius) / 64.0);
  vec2 period = vec2(number(yarn + yarn_period), number(yarn + yarn_period + 1u));
  YarnHit ignored;
  return march_yarn(yarn, vec3(wrapped(at.xy, period), at.z), lifted(light), true, width, ignored);
}

// format/fabric/yarn_strands.h
uint strand_bits(uint seed, uint row, uint place) {
  uint x = seed ^ (row << 16u | place);
  x = (x ^ x >> 16u) * 0x7feb352du;
  x = (x ^ x >> 15u) * 0x846ca68bu;
  return x ^ x >> 16u;
}
// Four numbers of unit variance, and a share of the way from one place of the lattice to the next.
vec4 strand_noise(uint a, uint b, float part) {
  float smooth_part = part * part * (3.0 - 2.0 * part);
  vec2 weight = vec2(1.0 - smooth_part, smooth_part);
  const uvec4 bytes = uvec4(0u, 8u, 16u, 24u);
  return (weight.x * (vec4(uvec4(a) >> bytes & 255u) - 127.5) + weight.y * (vec4(uvec4(b) >> bytes & 255u) - 127.5)) *
         (0.013531648 / length(weight));
}
float strand_offset(uint seed, uint row) { return float(strand_bits(seed, row, 0xffffu) >> 9u) * exp2(-23.0); }
// Turns to what is seen of a strand; `spacing`: width of what the point stands for, mm.
void add_strands(inout YarnPoint point, vec3 view, uint segment, float spacing) {
  vec2 squeeze = squeeze_of(segment);
  float wide = number(segment + segment_radius) / (1.0 - dot(squeeze, squeeze));
  uint curve = point.curve;
  uint strands = word(curve + curve_strands);
  float irregularity = number(curve + curve_irregularity);
  if (strands == 0u && !(irregularity > 0.0)) return;
  uint seed = word(curve + curve_seed);
  float share = fract(point.station / float(word(curve + curve_stations)));
  uint swells = word(curve + curve_swells);
  float swell = share * float(swells);
  uint swell_here = min(uint(swell), swells - 1u);
  uint swell_next = swell_here + 1u == swells ? 0u : swell_here + 1u;
  float brightness = 1.0 + irregularity * strand_noise(strand_bits(seed, 0xffffu, swell_here),
                                                       strand_bits(seed, 0xffffu, swell_next),
                                                       swell - float(swell_here)).w;
  if (strands > 0u && !(number(segment + segment_rank) > 0.0)) {
    // viewer/hybrid/strand_lanes.h
    float detail = min(1.0, 3.14159265358979324 * wide / (float(strands) * max(spacing, 5e-10)));
    float hidden = 1.0 - detail * detail;
    point.matt = 1.0 - 0.06 * hidden;
    point.roughness = sqrt(point.roughness * point.roughness + 0.05 * hidden);
    vec2 sense = vec2(number(curve + curve_strand_sense), number(curve + curve_strand_sense + 1u));
    vec2 angle = sense * point.angle;
    float turns = fract(atan(angle.y, angle.x) * 0.159154943091895336 - number(curve + curve_lays) * share);
    float strand = turns * float(strands);
    uint own = min(uint(strand), strands - 1u);
    uint row = own + word(segment + segment_rows);
    uint later = (own + word(curve + curve_strand_shift)) % strands + word(segment + segment_rows + 1u);
    uint pieces = word(curve + curve_pieces);
    float offset = strand_offset(seed, row);
    float place = share * float(pieces) + offset + share * (strand_offset(seed, later) - offset);
    uint here = uint(place);
    uint next = here + 1u;
    vec4 noise = strand_noise(here < pieces ? strand_bits(seed, row, here) : strand_bits(seed, later, here - pieces),
                              next < pieces ? strand_bits(seed, row, next) : strand_bits(seed, later, next - pieces),
                              place - float(here));
    brightness *= 1.0 + detail * 0.12 * noise.w;
    vec3 across = cross(point.fibre, point.normal) * (sense.x * sense.y * detail);
    vec3 fibre = point.fibre + across * (0.16 * noise.z);
    vec3 normal = normalize(point.normal + across * (strand - float(own) - 0.5 + 0.22 * noise.x) +
                            point.fibre * (detail * 0.12 * noise.y));
    vec3 v = lifted(view);
    point.strand = normalize(normal + v * (detail * max(0.0, 0.05 - dot(normal, v))));
    point.fibre = normalize(fibre - point.strand * dot(fibre, point.strand));
  }
  point.brightness = brightness;
}

// format/fabric/yarn_reflectance.h
float smith_lambda(vec3 d, float r) { return (sqrt(1.0 + (r * r * d.x * d.x + d.y * d.y) / (d.z * d.z)) - 1.0) / 2.0; }
float gloss_reflectance(vec3 l, vec3 v, float roughness) {
  if (!(l.z > 0.0) || !(v.z > 0.0)) return 0.0;
  float r = max(0.01, roughness);
  vec3 h = l + v;
  float q = (h.x * h.x / (r * r) + h.y * h.y + h.z * h.z) / dot(h, h);
  return 1.0 / (3.14159265358979324 * r * q * q * (1.0 + smith_lambda(l, r) + smith_lambda(v, r)) * 4.0 * l.z * v.z);
}
vec3 direct_light(YarnPoint point, vec3 light, vec3 view) {
  vec3 l = lifted(light);
  float cosine = dot(point.strand, l);
  if (!(cosine > 0.0)) return vec3(0.0);
  float gloss = number(point.curve + curve_gloss);
  vec3 f = min(vector_at(point.curve + curve_albedo) * point.brightness, vec3(1.0)) *
           (point.matt * (1.0 - gloss) * 0.318309886183790672);
  if (gloss > 0.0) {
    vec3 v = lifted(view);
    v = normalize(v + point.strand * max(0.0, 0.01 - dot(point.strand, v)));
    mat3 local = mat3(point.fibre, cross(point.strand, point.fibre), point.strand);
    f += gloss * gloss_reflectance(vec3((l * local).xy, cosine), v * local, point.roughness);
  }
  return f * (cosine * min(1.0, light.z * 32.0));
}
// Coefficients at a point, for each function of the light; `table`: those of all stations, of indirect light or of the sky.
void coefficients_at(uint table, YarnPoint point, vec3 groove, out vec3 of_light[9]) {
  uint stations = word(point.curve + curve_stations);
  float c = point.angle.x;
  float s = point.angle.y;
  float by_angle[5] = float[5](1.0, c, s, c * c - s * s, 2.0 * c * s);
  uint whole = uint(point.station);
  float share = point.station - float(whole);
  for (int k = 0; k < 9; ++k) of_light[k] = vec3(0.0);
  for (uint end = 0u; end < 2u; ++end) {
    uint station = word(point.curve + curve_first_station) + (whole + end) % stations;
    uint at = table + 135u * station;
    for (int i = 0; i < 5; ++i) {
      float weight = (end == 0u ? 1.0 - share : share) * by_angle[i];
      for (int k = 0; k < 9; ++k) of_light[k] += vector_at(at + uint(27 * i + 3 * k)) * weight;
    }
  }
  for (int k = 0; k < 9; ++k) of_light[k] *= 1.0 + groove * point.outward;
}

// Adds the yarn at (u, v) of the reference plane under all lights.
// `spacing`: width of what a point stands for, across the view, mm. Yarn further than
// `depth`, mm, from the reference plane is not met; of the front, that is below it.
void shade_yarn(uint fabric, vec2 uv, vec3 view, float depth, float side, mat3 frame, float spacing, float weight,
                inout vec4 sum) {
  YarnHit hit;
  if (!trace_yarn(fabric, uv, view, spacing, hit)) return;
  float below = number(fabric + fabric_reference_height) - (number(hit.segment + segment_start + 2u) + hit.from_start.z);
  if (below > depth || (side < 0.0 && below < -depth)) return;
  sum.a += weight;
  if (!(view.z > 0.0)) return;
  uint yarn = word(fabric + fabric_yarns);
  YarnPoint point = yarn_point_at(yarn, hit);
  add_strands(point, view, hit.segment, spacing);
  vec3 of_light[9];
  vec3 radiance = vec3(0.0);
#ifdef AROUND
  coefficients_at(word(sky + 1u), point, vec3(0.5), of_light);  // sky_groove
  for (int k = 0; k < 9; ++k) radiance += of_light[k] * around[k];
  radiance = max(radiance, vec3(0.0)) * point.brightness;
#endif
  // Lights above, then those below, mirrored.
  for (int pass = 0; pass < 2; ++pass) {
    uint table = word(yarn + (pass == 0 ? yarn_light : yarn_through));
    if (table == 0u) break;
    coefficients_at(table, point, vector_at(point.curve + curve_groove), of_light);
    for (uint i = 0u; i < light_count(); ++i) {
      vec3 direction;
      vec3 irradiance;
      light_at(i, direction, irradiance);
      vec3 l = direction * frame * vec3(1.0, 1.0, pass == 0 ? 1.0 : -1.0);
      if (!(l.z > 0.0) || irradiance == vec3(0.0)) continue;
      vec3 f = of_light[0] + of_light[1] * l.x + of_light[2] * l.y + of_light[3] * l.z + of_light[4] * (l.x * l.y) +
               of_light[5] * (l.x * l.z) + of_light[6] * (l.y * l.z) + of_light[7] * (l.x * l.x - l.y * l.y) +
               of_light[8] * (3.0 * l.z * l.z - 1.0);
      f = max(vec3(0.0), f * l.z) * point.brightness;
      vec3 lit = pass == 0 ? direct_light(point, l, view) : vec3(0.0);
      if (lit != vec3(0.0) && !is_yarn_hidden(yarn, hit, point.normal, l, spacing)) f += lit;
      radiance += f * irradiance;
    }
  }
  sum.rgb += weight * from_zero(radiance, 1e30);
}
