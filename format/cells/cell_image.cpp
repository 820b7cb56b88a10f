#include "format/cells/cell_image.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "format/cells/surface_lanes.h"
#include "format/fabric/yarn_sky.h"

namespace selvedge {
namespace {

constexpr std::size_t batch_size = 256;
constexpr std::size_t max_lanes = 16;

/// Light that a station has for one lamp, or for smooth light.
struct Slot {
  int plane = 0;
  enum { front, behind, sky } from = front;
};

/// A lamp before the cell.
struct FrontLamp {
  V3f lifted{0, 0, 1};
  V3f irradiance{0, 0, 0};
  float rise = 1;  ///< no step where the light sets
  int plane = 0;
  V2f slope{0, 0};
  std::shared_ptr<const CellShadow> shadow = nullptr;  ///< nothing is in shadow
  float away = 0;  ///< mm along the normal, by which looked-up points leave the yarn
};

struct ShadingJob {
  const CellYarn& yarn;
  const YarnPieces& pieces;
  const CellView& view;
  std::span<const FrontLamp> lamps;
  std::span<const Slot> slots;
  std::span<const Group> table;
  float width = 0;  ///< of what a sample stands for, mm
};

struct Batch {
  std::size_t count = 0;
  alignas(64) std::array<float, batch_size> x, y, z;  ///< from the piece's start, mm
  std::array<std::int32_t, batch_size> piece;
  std::array<std::uint32_t, batch_size> texel;
  std::array<bool, batch_size> four;  ///< its neighbours on the right and below have the same value
};

/// Numbers of lanes' curves.
struct CurveNumbers {
  using Floats = std::array<float, max_lanes>;
  alignas(64) Floats slope, stations, gloss, rough, lustre, matt_x, matt_y, matt_z;
  int curve = -1;  ///< of all lanes, or -1
};

void set_curve(const YarnCurve& curve, std::size_t i, CurveNumbers& numbers, StrandCurves& strands) {
  numbers.slope[i] = curve.fibre_slope;
  numbers.stations[i] = static_cast<float>(curve.stations);
  const V3f matt = curve.albedo * ((1 - curve.gloss.weight) * std::numbers::inv_pi_v<float>);
  numbers.matt_x[i] = matt.x;
  numbers.matt_y[i] = matt.y;
  numbers.matt_z[i] = matt.z;
  numbers.gloss[i] = curve.gloss.weight;
  numbers.rough[i] = curve.gloss.roughness;
  numbers.lustre[i] = curve.gloss.lustre;
  strands.pieces[i] = static_cast<float>(curve.strands.pieces);
  strands.irregularity[i] = curve.strands.irregularity;
  strands.contrast[i] = curve.strands.contrast;
  const int plies = curve.plies.count;
  strands.marl[i] = plies > 1 ? curve.strands.marl : 0;
  strands.paler[i] =
      2 * strands.marl[i] / static_cast<float>(std::max(1, std::abs(curve.strands.count) * (plies - 1)));
  strands.swells[i] = static_cast<float>(curve.strands.swells);
  strands.seed[i] = strand_hash(static_cast<std::uint32_t>(curve.strands.seed));
}

/// Fraction of a lamp's light that reaches N points: percentage-closer filtering over 2 x 2 texels.
template <std::size_t N>
SELVEDGE_INLINE WideFloat<N> visibility_of_lamp(const FrontLamp& lamp, const WideVec3<N>& p, float plane,
                                                const V2f& period) {
  using Wide = WideFloat<N>;
  const DepthGrid& grid = lamp.shadow->grid;
  const Wide width(static_cast<float>(grid.width));
  const Wide height(static_cast<float>(grid.height));
  const Wide above = p.z - Wide(plane);
  const Wide x =
      (p.x - above * Wide(lamp.slope.x)) * Wide(static_cast<float>(grid.width) / period.x) - Wide(0.5F);
  const Wide y =
      (p.y - above * Wide(lamp.slope.y)) * Wide(static_cast<float>(grid.height) / period.y) - Wide(0.5F);
  const Wide in_x = min(max(x - floor(x / width) * width, Wide(0)), width - Wide(1e-3F));
  const Wide in_y = min(max(y - floor(y / height) * height, Wide(0)), height - Wide(1e-3F));
  const Wide column = floor(in_x);
  const Wide row = floor(in_y);
  const Wide next_row = if_greater(row + Wide(1.5F), height, Wide(0), row + Wide(1));
  std::int32_t here[N];   // NOLINT(modernize-avoid-c-arrays): written as whole vectors
  std::int32_t below[N];  // NOLINT(modernize-avoid-c-arrays)
  const Wide stride(static_cast<float>(grid.stride));
  store_whole(row * stride + column, here);
  store_whole(next_row * stride + column, below);
  float depth[4][N];  // NOLINT(modernize-avoid-c-arrays)
  const float* const z = grid.z.data();
  for (std::size_t i = 0; i < N; ++i) {
    depth[0][i] = z[here[i]];
    depth[1][i] = z[here[i] + 1];
    depth[2][i] = z[below[i]];
    depth[3][i] = z[below[i] + 1];
  }
  const auto lit = [&](std::size_t k) __attribute__((always_inline)) {
    return if_greater(Wide::load(depth[k]), p.z, Wide(0), Wide(1));
  };
  const Wide part_x = in_x - column;
  const Wide part_y = in_y - row;
  const Wide upper = lit(0) + part_x * (lit(1) - lit(0));
  const Wide lower = lit(2) + part_x * (lit(3) - lit(2));
  return upper + part_y * (lower - upper);
}

using Quad = Lanes<4>::Floats;
SELVEDGE_INLINE Quad quad_of(const Group& group) { return quad(&group, 0); }
SELVEDGE_INLINE void add(const Quad& value, Group& to) {
  const Quad sum = quad_of(to) + value;
  std::memcpy(&to, &sum, sizeof sum);
}
SELVEDGE_INLINE Quad positive(const Quad& a) { return a > 0.0F ? a : Quad{}; }

/// Shades N points of a batch, from `first` on, and adds them to raw[plane][texel].
template <std::size_t N>
SELVEDGE_INLINE void shade_lanes(const ShadingJob& job, const Batch& batch, std::size_t first,
                                 CurveNumbers& numbers, StrandCurves& strands, int columns,
                                 std::size_t plane_texels, Group* raw) {
  using Wide = WideFloat<N>;
  using Vec = WideVec3<N>;
  const YarnData& data = job.yarn.yarns().data();
  const std::size_t count = std::min(N, batch.count - first);
  const Group* from[N];    // NOLINT(modernize-avoid-c-arrays)
  const Group* extra[N];   // NOLINT(modernize-avoid-c-arrays)
  std::int32_t curves[N];  // NOLINT(modernize-avoid-c-arrays)
  bool same = true;
  for (std::size_t i = 0; i < N; ++i) {
    const std::int32_t piece = batch.piece[first + (i < count ? i : 0)];
    const Yarns::Segment& s = job.pieces.segments[piece];
    from[i] = reinterpret_cast<const Group*>(&s);
    extra[i] = job.pieces.strands[piece].data();
    curves[i] = s.curve;
    same &= s.curve == curves[0];
  }
  if (!same || numbers.curve != curves[0]) {
    for (std::size_t i = 0; i < N; ++i) set_curve(data.curves[curves[i]], i, numbers, strands);
    numbers.curve = same ? curves[0] : -1;
  }
  const bool flat = job.yarn.is_flat();
  SegmentLanes<N> s(from, flat);
  const Vec off{Wide::load(&batch.x[first]), Wide::load(&batch.y[first]), Wide::load(&batch.z[first])};
  Vec round_off = off;
  if (flat) {
    round_off = s.squeezed(off);
    s.along = s.squeezed(s.along);
    for (Vec& tangent : s.tangent) tangent = s.squeezed(tangent);
  }
  const OnCurve<N> at = nearest_on_curve<N>(s, round_off);
  const Wide zero(0);
  const Wide one(1);
  const auto load_of = [&](const CurveNumbers::Floats& floats) __attribute__((always_inline)) {
    return Wide::load(floats.data());
  };
  const Wide all_stations = load_of(numbers.stations);
  Wide station = s.station + at.fraction * s.stations;
  station = if_greater(zero, station, station + all_stations, station);
  const Vec round = unit(at.out - at.tangent * at.tangent.dot(at.out));
  const Vec around = at.tangent.cross(round);
  const Vec across0 = s.across[0] + (s.across[1] - s.across[0]) * at.fraction;
  Wide cosine = round.dot(across0);
  Wide sine = -around.dot(across0);
  const Wide norm2 = cosine * cosine + sine * sine;
  const Wide scale = one / sqrt(norm2);
  // A hair has the angle of its root.
  const auto or_root = [&](const Wide& a, const Wide& b) __attribute__((always_inline)) {
    return if_greater(s.stations, zero, a, b);
  };
  const Vec smooth = flat ? unit(s.squeezed(round)) : round;
  Vec fibre = at.tangent + around * or_root(load_of(numbers.slope), zero);
  fibre = unit(flat ? s.stretched(fibre) : fibre);
  cosine = or_root(if_greater(norm2, zero, cosine * scale, one), s.across[0].x);
  sine = or_root(if_greater(norm2, zero, sine * scale, zero), s.across[0].y);
  const Vec out_of_axis = s.out[0] + (s.out[1] - s.out[0]) * at.fraction;
  const Wide outward = or_root(round.dot(out_of_axis), s.across[0].z);
  const Wide side_x = or_root(out_of_axis.dot(across0), s.across[1].x);
  const Wide side_y = or_root(out_of_axis.dot(at.tangent.cross(across0)), s.across[1].y);

  const V3f to_viewer = lifted(job.view.view);
  const Vec viewer{Wide(to_viewer.x), Wide(to_viewer.y), Wide(to_viewer.z)};
  Wide more[4];  // NOLINT(modernize-avoid-c-arrays)
  fetch<N>(extra, 1, more);
  const Wide some = abs(more[2]);
  const Wide shown = some * min(one, more[1] * Wide(1 / std::max(2 * job.width, 1e-9F)));
  const Wide hidden = some * (one - shown * shown);
  more[0].store(strands.later_row.data());
  more[2].store(strands.sense_x.data());
  more[3].store(strands.sense_y.data());
  fetch<N>(extra, 0, more);
  more[0].store(strands.strands.data());
  more[1].store(strands.shift.data());
  more[2].store(strands.lays.data());
  more[3].store(strands.first_row.data());
  const StrandChangeLanes<N> change =
      strand_change_lanes<N>(strands, 0, cosine, sine, station / all_stations);
  const Vec across = fibre.cross(smooth);
  Vec normal = unit(smooth + across * (change.across * shown) + fibre * (change.along * shown));
  normal = unit(normal + viewer * (shown * max(zero, Wide(min_strand_facing) - normal.dot(viewer))));
  const Vec turned = fibre + across * (change.turn * shown);
  fibre = unit(turned - normal * turned.dot(normal));
  const Wide bright = change.colour * (one + change.shade * shown);
  const Wide gloss = load_of(numbers.gloss);
  const Wide rough = load_of(numbers.rough);
  const Wide roughness = sqrt(rough * rough + hidden * Wide(hidden_roughness2));
  const Wide lustre = load_of(numbers.lustre) * (one - hidden * Wide(hidden_lustre));
  const bool is_matt = !any_greater(lustre, zero);
  const Wide most = (one - gloss) * Wide(std::numbers::inv_pi_v<float>);
  const Wide less = one - hidden * Wide(hidden_loss);
  const auto matt_of = [&](const Wide& value) __attribute__((always_inline)) {
    return min(value * bright, most) * less;
  };
  const Vec matt{matt_of(load_of(numbers.matt_x)), matt_of(load_of(numbers.matt_y)),
                 matt_of(load_of(numbers.matt_z))};

  const Vec facing = unit(viewer + normal * max(zero, Wide(min_facing) - normal.dot(viewer)));
  const Vec side = normal.cross(fibre);
  const Vec local_view{facing.dot(fibre), facing.dot(side), facing.dot(normal)};
  const Vec leave = s.start + off;
  const V2f period = job.yarn.yarns().period();
  const auto add_lanes = [&](int plane, const Vec& sum) __attribute__((always_inline)) {
    float colour[3][N];  // NOLINT(modernize-avoid-c-arrays)
    sum.x.store(colour[0]);
    sum.y.store(colour[1]);
    sum.z.store(colour[2]);
    Group* const to = raw + static_cast<std::size_t>(plane) * plane_texels;
    for (std::size_t i = 0; i < count; ++i)
      add(Quad{colour[0][i], colour[1][i], colour[2][i], 0}, to[batch.texel[first + i]]);
  };
  Vec sum{zero, zero, zero};
  for (const FrontLamp& lamp : job.lamps) {
    const Vec light{Wide(lamp.lifted.x), Wide(lamp.lifted.y), Wide(lamp.lifted.z)};
    const Wide facing_light = normal.dot(light);
    if (!any_greater(facing_light, zero)) continue;
    const Wide along = light.dot(fibre);
    const Wide glint =
        if_greater(gloss, zero,
                   gloss * gloss_of(Vec{along, light.dot(side), facing_light}, local_view, roughness), zero);
    const Vec own = is_matt ? matt : matt * body_of(along, local_view.x, lustre);
    Wide fraction = facing_light * Wide(lamp.rise);
    if (lamp.shadow != nullptr)
      fraction =
          fraction * visibility_of_lamp<N>(lamp, leave + smooth * Wide(lamp.away), job.yarn.plane(), period);
    fraction = if_greater(facing_light, zero, fraction, zero);
    const Vec direct =
        Vec{(own.x + glint) * Wide(lamp.irradiance.x), (own.y + glint) * Wide(lamp.irradiance.y),
            (own.z + glint) * Wide(lamp.irradiance.z)} *
        fraction;
    if (lamp.plane == 0)
      sum = sum + direct;
    else
      add_lanes(lamp.plane, direct);
  }
  add_lanes(0, sum);

  const Wide whole = floor(station);
  const Wide double_cosine = cosine * cosine - sine * sine;
  const Wide double_sine = Wide(2) * cosine * sine;
  alignas(64) float numbers_of[12][N];  // NOLINT(modernize-avoid-c-arrays)
  whole.store(numbers_of[0]);
  (station - whole).store(numbers_of[1]);
  cosine.store(numbers_of[2]);
  sine.store(numbers_of[3]);
  double_cosine.store(numbers_of[4]);
  double_sine.store(numbers_of[5]);
  outward.store(numbers_of[6]);
  bright.store(numbers_of[7]);
  side_x.store(numbers_of[8]);
  side_y.store(numbers_of[9]);
  local_view.x.store(numbers_of[10]);
  or_root(lustre, zero).store(numbers_of[11]);
  const std::size_t slots = job.slots.size();
  const std::size_t columns_of_table = slots + 1;
  const std::span<const int> first_station = job.yarn.yarns().inside().first_station;
  for (std::size_t i = 0; i < count; ++i) {
    const YarnCurve& curve = data.curves[curves[i]];
    int here = static_cast<int>(numbers_of[0][i]);
    if (here >= curve.stations) here -= curve.stations;
    const int next = here + 1 >= curve.stations ? 0 : here + 1;
    const Group* a = &job.table[(first_station[curves[i]] + here) * angle_functions * columns_of_table];
    const Group* b = &job.table[(first_station[curves[i]] + next) * angle_functions * columns_of_table];
    const Quad part = Quad{} + numbers_of[1][i];
    const V3f& groove = curve.plies.groove;
    const Quad of_lamps = Quad{1, 1, 1, 0} + Quad{groove.x, groove.y, groove.z, 0} * numbers_of[6][i];
    const bool sides = curve.plies.sides != 0;
    const std::array<std::size_t, angle_functions> rows{0, 2, 3, sides ? 8U : 4U, sides ? 9U : 5U};
    const std::uint32_t texel = batch.texel[first + i];
    const auto about = [&](std::size_t slot) __attribute__((always_inline)) {
      Quad value{};
      for (int k = 0; k < angle_functions; ++k) {
        const Quad low = quad_of(a[k * columns_of_table + slot]);
        const Quad mixed = low + part * (quad_of(b[k * columns_of_table + slot]) - low);
        value += k == 0 ? mixed : mixed * numbers_of[rows[k]][i];
      }
      return value;
    };
    float by_view = 1;
    if (numbers_of[11][i] > 0) {
      const Quad moments = about(slots);
      by_view = lustre_factor(numbers_of[10][i], numbers_of[11][i], moments[0], moments[1]);
    }
    for (std::size_t slot = 0; slot < slots; ++slot) {
      const auto from_side = job.slots[slot].from;
      Quad value = about(slot);
      if (from_side != Slot::sky) value *= of_lamps;
      value = positive(value) * numbers_of[7][i];
      if (from_side == Slot::front) value *= by_view;
      add(value, raw[static_cast<std::size_t>(job.slots[slot].plane) * plane_texels + texel]);
    }
    raw[texel][3] = 1;
    if (!batch.four[first + i]) continue;
    for (int plane = 0; plane < job.view.planes; ++plane) {
      Group* const to = raw + static_cast<std::size_t>(plane) * plane_texels + texel;
      to[1] = to[columns] = to[columns + 1] = to[0];
    }
  }
}

template <std::size_t N>
SELVEDGE_INLINE void shade_batch(const ShadingJob& job, const Batch& batch, int columns,
                                 std::size_t plane_texels, Group* raw) {
  StrandCurves strands;
  CurveNumbers numbers;
  for (std::size_t first = 0; first < batch.count; first += N)
    shade_lanes<N>(job, batch, first, numbers, strands, columns, plane_texels, raw);
}
SELVEDGE_THREE_BODIES(shade_batch,
                      (const ShadingJob& job, const Batch& batch, int columns, std::size_t plane_texels,
                       Group* raw),
                      (job, batch, columns, plane_texels, raw))

/// Light of all stations: for angle function i, the sum over light functions of c_ik B_k.
void add_slot(std::span<const float> coefficients, const std::array<V3f, light_functions_of_yarn>& basis,
              std::size_t columns, std::size_t slot, std::vector<Group>& table) {
  const std::size_t stations = coefficients.size() / light_values_per_station;
  for (std::size_t row = 0; row < stations * angle_functions; ++row) {
    const float* c = &coefficients[row / angle_functions * light_values_per_station +
                                   row % angle_functions * 3 * light_functions_of_yarn];
    Quad sum{};
    for (int k = 0; k < light_functions_of_yarn; ++k)
      sum += Quad{c[3 * k] * basis[k].x, c[3 * k + 1] * basis[k].y, c[3 * k + 2] * basis[k].z, 0};
    std::memcpy(&table[row * columns + slot], &sum, sizeof sum);
  }
}

/// Fills the table, [station][angle function][slot], and names its slots; one more has the moments.
std::vector<Slot> fill_table(const CellYarn& yarn, const CellView& view, std::vector<Group>& table) {
  const YarnData& data = yarn.yarns().data();
  std::vector<Slot> slots;
  std::vector<std::pair<std::span<const float>, std::array<V3f, light_functions_of_yarn>>> sources;
  for (const CellLamp& lamp : view.lamps) {
    const bool behind = !(lamp.direction.z > 0);
    if (behind && (data.through.empty() || !(lamp.direction.z < 0))) continue;
    const std::array<float, light_functions_of_yarn> basis =
        light_basis(V3f(lamp.direction.x, lamp.direction.y, std::abs(lamp.direction.z)));
    auto& [from, factors] = sources.emplace_back();
    from = behind ? data.through : data.light;
    for (int k = 0; k < light_functions_of_yarn; ++k) factors[k] = lamp.irradiance * basis[k];
    slots.push_back({lamp.plane, behind ? Slot::behind : Slot::front});
  }
  if (view.around && !yarn.sky().empty()) {
    auto& [from, factors] = sources.emplace_back();
    from = yarn.sky();
    factors = view.around->factors;
    slots.push_back({0, Slot::sky});
  }
  const std::size_t columns = slots.size() + 1;
  const std::size_t stations = data.light.size() / light_values_per_station;
  table.resize(stations * angle_functions * columns);
  for (std::size_t slot = 0; slot < slots.size(); ++slot)
    add_slot(sources[slot].first, sources[slot].second, columns, slot, table);
  for (std::size_t row = 0; row < stations * angle_functions; ++row) {
    const float* moments = &data.light[row / angle_functions * light_values_per_station +
                                       transfer_values_per_station + row % angle_functions];
    table[row * columns + slots.size()] = {moments[0], moments[angle_functions], 0, 0};
  }
  return slots;
}

float pixel_width(const V2f& period, const CellSize& size) {
  const auto wide = [](float length, int pixel, int samples) {
    return length * static_cast<float>(pixel) / static_cast<float>(samples);
  };
  return std::min(wide(period.x, size.pixel.x, size.samples.x), wide(period.y, size.pixel.y, size.samples.y));
}

/// Texels of the shadow grid, and least fraction of the period, by which points leave the yarn before they
/// are looked up.
constexpr float shadow_bias = 0.7F;
constexpr float min_bias = 0.003F;

/// The lamps before the cell, with their shadows. `pixel`: its width, mm.
std::vector<FrontLamp> cast_shadows(const CellYarn& yarn, const CellView& view, float pixel,
                                    CellShadows& shadows) {
  const V2f period = yarn.yarns().period();
  std::vector<FrontLamp> lamps;
  for (const CellLamp& lamp : view.lamps) {
    if (!(lamp.direction.z > 0)) continue;
    auto shadow = shadows.cast(
        lamp.direction, {pixel / view.shadow_texels, view.piece_pixels * std::min(view.shadow_texels, 1.0F),
                         view.shadow_texels / view.detail, view.hairs && view.hair_shadows});
    lamps.push_back({lifted(lamp.direction), lamp.irradiance, std::min(1.0F, lamp.direction.z / min_rise),
                     lamp.plane, shadow->slope, shadow,
                     shadow_bias * std::max(shadow->texel, min_bias * std::min(period.x, period.y))});
  }
  return lamps;
}

/// Collects the visible points of an image and shades them.
class PointShader {
 public:
  PointShader(const ShadingJob& job, const V2f& slope, const DepthGrid& seen, std::vector<Group>& raw)
      : job_(job), slope_(slope), seen_(seen), raw_(raw), period_(job.yarn.yarns().period()) {}

  void shade() {
    const int step = job_.view.coarse_shading ? 2 : 1;
    for (int row = 0; row < seen_.height; row += step) {
      for (int column = 0; column < seen_.width; column += step) {
        if (step == 1)
          add_sample(column, row);
        else
          add_four(column, row);
      }
    }
    flush();
  }

 private:
  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * seen_.stride + column;
  }
  bool is_empty(std::size_t i) const { return !(seen_.z[i] > no_depth); }

  void add_sample(int column, int row) {
    const std::size_t i = index(column, row);
    if (!is_empty(i)) add(seen_.piece[i], column, row, 0.5F, seen_.z[i], false);
  }

  /// 2 x 2 samples, once if they lie on one ply and within a radius of each other in depth.
  void add_four(int column, int row) {
    if (column + 1 < seen_.width && row + 1 < seen_.height) {
      const std::array at{index(column, row), index(column + 1, row), index(column, row + 1),
                          index(column + 1, row + 1)};
      const std::array depths{seen_.z[at[0]], seen_.z[at[1]], seen_.z[at[2]], seen_.z[at[3]]};
      const auto [low, high] = std::minmax_element(depths.begin(), depths.end());
      if (!(*high > no_depth)) return;
      if (*low > no_depth) {
        const std::array pieces{seen_.piece[at[0]], seen_.piece[at[1]], seen_.piece[at[2]],
                                seen_.piece[at[3]]};
        const auto [first, last] = std::minmax_element(pieces.begin(), pieces.end());
        const std::vector<Yarns::Segment>& segments = job_.pieces.segments;
        if (*last - *first <= 2 && segments[*first].rows.first == segments[*last].rows.first &&
            *high - *low < segments[*first].radius) {
          add(pieces[0], column, row, 1, 0.25F * (depths[0] + depths[1] + depths[2] + depths[3]), true);
          return;
        }
      }
    }
    for (int k = 0; k < 4; ++k) {
      const int x = column + k % 2;
      const int y = row + k / 2;
      if (x < seen_.width && y < seen_.height) add_sample(x, y);
    }
  }

  void add(std::int32_t piece, int column, int row, float centre, float depth, bool four) {
    const Yarns::Segment& s = job_.pieces.segments[piece];
    const float above = depth - job_.yarn.plane();
    const auto beside = [&](int texel, int count, float period, float slope, float start, float along) {
      const float at =
          (static_cast<float>(texel) + centre) * period / static_cast<float>(count) + slope * above - start;
      return at - std::floor((at - along / 2) / period + 0.5F) * period;
    };
    const std::size_t i = batch_.count++;
    batch_.x[i] = beside(column, seen_.width, period_.x, slope_.x, s.start.x, s.along.x);
    batch_.y[i] = beside(row, seen_.height, period_.y, slope_.y, s.start.y, s.along.y);
    batch_.z[i] = depth - s.start.z;
    batch_.piece[i] = piece;
    batch_.texel[i] = static_cast<std::uint32_t>(row * seen_.width + column);
    batch_.four[i] = four;
    if (batch_.count == batch_size) flush();
  }

  void flush() {
    static const auto shade_all = shade_batch_for_this_processor();
    // Lanes behind the last point read what earlier points left.
    if (batch_.count > 0)
      shade_all(job_, batch_, seen_.width, static_cast<std::size_t>(seen_.width) * seen_.height, raw_.data());
    batch_.count = 0;
  }

  const ShadingJob& job_;
  V2f slope_;
  const DepthGrid& seen_;
  std::vector<Group>& raw_;
  V2f period_;
  Batch batch_{};
};

/// Smallest number that texels resolve.
constexpr float smallest = 0x1p-14F;

SELVEDGE_INLINE CellTexel pack(const Quad& value) {
  using Bits = Lanes<4>::Bits;
  // Numbers in [2^-14, 1]: the exponent moves down to 5 bits.
  const Quad kept = value > smallest ? value : Quad{};
  const Bits bits = ((Bits)(kept * 0x1p-112F) + 0x800U) >> 12;
  return {static_cast<std::uint16_t>(bits[0]), static_cast<std::uint16_t>(bits[1]),
          static_cast<std::uint16_t>(bits[2]), static_cast<std::uint16_t>(bits[3])};
}

/// The box filter of a pixel, and the image's texels from it.
void filter(const CellView& view, const std::vector<Group>& raw, std::vector<Group>& rows,
            std::vector<Group>& sums, CellImage& image) {
  const CellSize& size = view.size;
  const int columns = size.samples.x;
  const int lines = size.samples.y;
  const std::size_t plane_texels = static_cast<std::size_t>(columns) * lines;
  Quad most{};
  for (const Group& g : raw) most = quad_of(g) > most ? quad_of(g) : most;
  const float highest = std::clamp(std::max({most[0], most[1], most[2]}), 1e-30F, 1e30F);
  image.scale = std::exp2(std::ceil(std::log2(highest)));
  image.planes = view.planes;
  image.width = columns / size.stride;
  image.height = lines / size.stride;
  image.first = {0.5F * static_cast<float>(size.pixel.x) / static_cast<float>(size.stride),
                 0.5F * static_cast<float>(size.pixel.y) / static_cast<float>(size.stride)};
  image.texels.resize(image.plane_texels() * view.planes);
  const int kept_rows = size.pixel.y + 1;
  rows.resize(static_cast<std::size_t>(kept_rows) * columns);
  const float mean = 1 / static_cast<float>(size.pixel.x * size.pixel.y);
  const Quad scale = Quad{1 / image.scale, 1 / image.scale, 1 / image.scale, 1} * mean;
  for (int plane = 0; plane < view.planes; ++plane) {
    const Group* const from = raw.data() + plane * plane_texels;
    CellTexel* to = image.texels.data() + plane * image.plane_texels();
    // Running sums: along a row, then, of all columns at once, along the columns. Only the sums of
    // a pixel's rows are kept, since an image is larger than the processor's cache.
    const auto row_of = [&](int row) { return &rows[static_cast<std::size_t>(row % kept_rows) * columns]; };
    const auto sum_row = [&](int row) {
      const Group* const in = from + static_cast<std::size_t>(row < lines ? row : row - lines) * columns;
      Group* const out = row_of(row);
      Quad sum{};
      for (int i = 0; i < size.pixel.x; ++i) sum += quad_of(in[i]);
      for (int i = 0; i < columns; ++i) {
        std::memcpy(&out[i], &sum, sizeof sum);
        const int next = i + size.pixel.x < columns ? i + size.pixel.x : i + size.pixel.x - columns;
        sum += quad_of(in[next]) - quad_of(in[i]);
      }
    };
    sums.assign(columns, Group{});
    for (int row = 0; row < size.pixel.y; ++row) {
      sum_row(row);
      for (int i = 0; i < columns; ++i) add(quad_of(row_of(row)[i]), sums[i]);
    }
    for (int row = 0; row < lines; ++row) {
      if (row % size.stride == 0) {
        CellTexel* const begin = to;
        for (int i = 0; i + size.stride <= columns; i += size.stride) *to++ = pack(quad_of(sums[i]) * scale);
        *to++ = *begin;
      }
      sum_row(row + size.pixel.y);
      const Group* const before = row_of(row);
      const Group* const next = row_of(row + size.pixel.y);
      for (int i = 0; i < columns; ++i) add(quad_of(next[i]) - quad_of(before[i]), sums[i]);
    }
    std::copy_n(to - static_cast<std::ptrdiff_t>(image.height) * image.stride(), image.stride(), to);
  }
}

}  // namespace

CellSize cell_size(const V2f& pixel, float samples) {
  CellSize size;
  const auto set = [&](int axis) {
    const float in_repeat = std::clamp(1 / std::max(pixel[axis], 1e-9F), 1e-3F, 1e6F);
    const float wanted = std::clamp(samples * in_repeat, static_cast<float>(min_cell_texels),
                                    static_cast<float>(max_cell_samples));
    size.samples[axis] = static_cast<int>(std::lround(wanted / 4)) * 4;
    size.pixel[axis] =
        std::clamp(static_cast<int>(std::lround(static_cast<float>(size.samples[axis]) / in_repeat)), 1,
                   size.samples[axis]);
  };
  set(0);
  set(1);
  const int finest = std::min(size.pixel.x, size.pixel.y);
  size.stride =
      finest >= 4 && size.samples.x >= 2 * min_cell_texels && size.samples.y >= 2 * min_cell_texels ? 2 : 1;
  return size;
}

const YarnPieces& pieces_of(const CellYarn& yarn, const CellView& view) {
  return yarn.pieces(view.piece_pixels * pixel_width(yarn.yarns().period(), view.size));
}

namespace {

/// CellImage::heights of what was seen.
void fill_heights(const CellYarn& yarn, const YarnPieces& pieces, const DepthGrid& seen, const CellSize& size,
                  CellImage& image) {
  std::vector<bool> along_v;
  for (const YarnCurve& curve : yarn.yarns().data().curves)
    along_v.push_back(runs_along_v(curve, yarn.yarns().period()));
  constexpr float most = 127;
  const Yarns::Inside inside = yarn.yarns().inside();
  image.step = std::max({inside.high - yarn.plane(), yarn.plane() - inside.low, 1e-9F}) / most;
  image.heights.resize(image.plane_texels());
  std::int8_t* to = image.heights.data();
  std::int8_t last = 0;
  for (int j = 0; j < image.height; ++j) {
    const std::int8_t* const begin = to;
    const auto row = [&](int y) {
      y += j * size.stride;
      return static_cast<std::size_t>(y < seen.height ? y : y - seen.height) * seen.stride;
    };
    const std::array rows{row(0), row(size.pixel.y - 1)};
    for (int i = 0; i < image.width; ++i) {
      const int left = i * size.stride;
      const int right = left + size.pixel.x - 1;
      float sum = 0;
      float count = 0;
      float upright = 0;
      for (const std::size_t first : rows) {
        for (const int x : {left, right < seen.width ? right : right - seen.width}) {
          const float z = seen.z[first + x];
          if (!(z > no_depth)) continue;
          sum += z;
          count += 1;
          upright += along_v[pieces.segments[seen.piece[first + x]].curve] ? 1.0F : 0.0F;
        }
      }
      if (count > 0) {
        const float height = std::clamp((sum / count - yarn.plane()) / image.step, 1 - most, most);
        last = static_cast<std::int8_t>((static_cast<int>(height) & ~1) | (2 * upright > count ? 1 : 0));
      }
      *to++ = last;
    }
    *to++ = *begin;
  }
  std::copy_n(image.heights.data(), image.stride(), to);
}

/// Means of what hairs send to the viewer, for the planes one after the other. Hairs that are not shown are
/// black.
void shade_hairs(const ShadingJob& job, std::vector<Group>& colours) {
  static const auto shade_all = shade_batch_for_this_processor();
  const YarnPieces& pieces = job.pieces;
  const auto hairs = static_cast<std::size_t>(pieces.count() - pieces.plies);
  colours.assign(hairs * job.view.planes, Group{});
  const V3f viewer = lifted(job.view.view);
  Batch batch{};
  const auto flush = [&] {
    if (batch.count > 0) shade_all(job, batch, 1, hairs, colours.data());
    batch.count = 0;
  };
  for (std::size_t k = 0; k < hairs; ++k) {
    const auto piece = static_cast<std::int32_t>(pieces.plies + k);
    const Yarns::Segment& s = pieces.segments[piece];
    const float radius = std::min(std::max(job.width / 2, s.radius), s.reach);
    if (!(s.radius > radius * s.rank)) continue;
    const V3f axis(pieces.numbers[YarnPieces::axis_x][piece], pieces.numbers[YarnPieces::axis_y][piece],
                   pieces.numbers[YarnPieces::axis_z][piece]);
    const V3f across = axis.cross(viewer).normalized();
    // Two points of the visible half, as Gauss' rule places them; neighbours differ little.
    const float beside = std::sqrt(1.0F / 3);
    for (const float sign : {-beside, beside}) {
      if (job.view.coarse_shading && (sign > 0) == (k % 2 == 0)) continue;
      const V3f at = s.along * 0.5F + (across.cross(axis) * std::sqrt(2.0F / 3) + across * sign) * radius;
      const std::size_t i = batch.count++;
      batch.x[i] = at.x;
      batch.y[i] = at.y;
      batch.z[i] = at.z;
      batch.piece[i] = piece;
      batch.texel[i] = static_cast<std::uint32_t>(k);
      batch.four[i] = false;
      if (batch.count == batch_size) flush();
    }
  }
  flush();
  for (Group& colour : colours) {
    for (float& value : colour) value *= job.view.coarse_shading ? 1.0F : 0.5F;
  }
  for (std::size_t k = 0; k < hairs; ++k) colours[k][3] = 1;
}

/// Adds the yarn to the samples of an image.
void add_yarn(const CellYarn& yarn, const CellView& view, CellShadows& shadows, CellScratch& scratch) {
  const float pixel = pixel_width(yarn.yarns().period(), view.size);
  const float width = pixel / view.detail;
  const YarnPieces& pieces = pieces_of(yarn, view);
  const V2f slope = slope_of(view.view);
  scratch.seen.resize(view.size.samples.x, view.size.samples.y, true);
  // Thin hairs cover fractions of samples; wide ones have a lit and a dark side.
  const float sample = pixel / static_cast<float>(std::max(view.size.pixel.x, view.size.pixel.y));
  const bool lines = view.hairs && pieces.count() > pieces.plies && pieces.thickest_hair < sample;
  splat(yarn, pieces, {slope, width, view.hairs && !lines}, scratch.seen);
  const std::vector<FrontLamp> lamps = cast_shadows(yarn, view, pixel, shadows);
  const std::vector<Slot> slots = fill_table(yarn, view, scratch.table);
  const ShadingJob job{yarn, pieces, view, lamps, slots, scratch.table, width};
  PointShader(job, slope, scratch.seen, scratch.raw).shade();
  if (lines) {
    shade_hairs(job, scratch.hairs);
    blend_hairs(yarn, pieces, {slope, width, true}, scratch.seen, scratch.hairs, scratch.raw);
  }
}

}  // namespace

void make_yarn_samples(const CellSource& source, const CellView& view, CellScratch& scratch) {
  const V2i& samples = view.size.samples;
  scratch.raw.assign(static_cast<std::size_t>(samples.x) * samples.y * view.planes, Group{});
  if (view.levels.yarn > 0) add_yarn(*source.yarn, view, *source.shadows, scratch);
}

void make_cell_image(const CellSource& source, const CellView& view, CellScratch& scratch, CellImage& image) {
  const CellSize& size = view.size;
  const float of_yarn = view.levels.yarn;
  make_yarn_samples(source, view, scratch);
  if (of_yarn < 1) {
    for (Group& sample : scratch.raw) {
      for (float& value : sample) value *= of_yarn;
    }
    source.texels->add(view, scratch.raw);
  }
  filter(view, scratch.raw, scratch.rows, scratch.sums, image);
  image.heights.clear();
  if (of_yarn > 0) fill_heights(*source.yarn, pieces_of(*source.yarn, view), scratch.seen, size, image);
}

std::vector<V3f> shade_points(const CellYarn& yarn, const YarnPieces& pieces, const CellView& view,
                              std::span<const CellPoint> points) {
  static const auto shade_all = shade_batch_for_this_processor();
  std::vector<FrontLamp> lamps;
  for (const CellLamp& lamp : view.lamps) {
    if (lamp.direction.z > 0)
      lamps.push_back({.lifted = lifted(lamp.direction),
                       .irradiance = lamp.irradiance,
                       .rise = std::min(1.0F, lamp.direction.z / min_rise)});
  }
  std::vector<Group> table;
  const std::vector<Slot> slots = fill_table(yarn, view, table);
  const ShadingJob job{yarn, pieces, view, lamps, slots, table, 0};
  std::vector<V3f> result;
  for (std::size_t first = 0; first < points.size(); first += batch_size) {
    Batch batch{};
    std::vector<Group> raw(batch_size, Group{});
    batch.count = std::min(batch_size, points.size() - first);
    for (std::size_t i = 0; i < batch.count; ++i) {
      const CellPoint& point = points[first + i];
      batch.piece[i] = point.piece;
      batch.texel[i] = static_cast<std::uint32_t>(i);
      batch.x[i] = point.from_start.x;
      batch.y[i] = point.from_start.y;
      batch.z[i] = point.from_start.z;
    }
    shade_all(job, batch, 1, batch_size, raw.data());
    for (std::size_t i = 0; i < batch.count; ++i) result.emplace_back(raw[i][0], raw[i][1], raw[i][2]);
  }
  return result;
}

}  // namespace selvedge
