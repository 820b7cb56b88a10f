#include "format/cells/cell_image.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <tuple>
#include <utility>

#include "format/cells/cell_shading.h"
#include "format/fabric/lifted.h"
#include "format/simd/fetch.h"

namespace selvedge {
namespace {

using Quad = Floats4;

float pixel_width(const V2f& period, const CellSize& size) {
  const V2f width = period * V2f(size.pixel_samples) / V2f(size.repeat_samples);
  return std::min(width.x, width.y);
}

/// Collects the visible points of an image and shades them.
class PointShader {
 public:
  PointShader(const ShadingJob& job, const V2f& slope, const DepthGrid& seen, CellScratch& scratch)
      : job_(job), slope_(slope), seen_(seen), scratch_(scratch) {}

  void shade_all() {
    const int together = job_.view.shading_block_size;
    if (together > 1) scratch_.shading_source_indices.assign(job_.view.size.count(), 0);
    for (int row = 0; row < seen_.height; row += together) {
      for (int column = 0; column < seen_.width; column += together) {
        if (together == 1)
          add_sample(column, row);
        else
          add_block({column, row},
                    {std::min(column + together, seen_.width), std::min(row + together, seen_.height)});
      }
    }
    flush();
    if (together > 1) give_to_all();
  }

 private:
  /// Samples of one ply that are shaded once.
  struct Shared {
    std::int32_t piece = 0;
    float depth = 0;  ///< of the first
    V2f place{0, 0};  ///< sums over the samples
    float sum = 0;    ///< of depths
    int count = 0;
    std::uint32_t texel = 0;
  };
  static constexpr std::size_t max_shared = 8;

  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * seen_.stride + column;
  }
  std::uint32_t texel(int column, int row) const {
    return static_cast<std::uint32_t>(row) * static_cast<std::uint32_t>(seen_.width) +
           static_cast<std::uint32_t>(column);
  }

  void add_sample(int column, int row) {
    const std::size_t i = index(column, row);
    if (seen_.z[i] > no_depth)
      add(seen_.piece[i], V2f(V2i(column, row)) + V2f(0.5F), seen_.z[i], texel(column, row));
  }

  /// Whether a sample is of the same ply, and within a radius in depth.
  bool belongs(const Shared& shared, std::int32_t piece, float depth) const {
    if (std::abs(piece - shared.piece) > 2) return false;
    const Yarns::Segment& a = job_.pieces.segment(shared.piece);
    const Yarns::Segment& b = job_.pieces.segment(piece);
    return a.curve == b.curve && a.rows.first_row == b.rows.first_row &&
           std::abs(depth - shared.depth) < a.radius;
  }

  void add_block(const V2i& begin, const V2i& end) {
    std::array<Shared, max_shared> all;
    std::size_t count = 0;
    for (int row = begin.y; row < end.y; ++row) {
      for (int column = begin.x; column < end.x; ++column) {
        const std::size_t i = index(column, row);
        const float depth = seen_.z[i];
        if (!(depth > no_depth)) continue;
        const std::uint32_t at = texel(column, row);
        std::size_t k = 0;
        while (k < count && !belongs(all[k], seen_.piece[i], depth)) ++k;
        if (k == max_shared) {
          add_sample(column, row);
          scratch_.shading_source_indices[at] = at;
          continue;
        }
        Shared& shared = all[k];
        if (k == count) {
          ++count;
          shared.piece = seen_.piece[i];
          shared.depth = depth;
          shared.texel = at;
        }
        scratch_.shading_source_indices[at] = shared.texel;
        shared.place += V2f(V2i(column, row));
        shared.sum += depth;
        ++shared.count;
      }
    }
    for (std::size_t k = 0; k < count; ++k) {
      const Shared& shared = all[k];
      const float part = 1 / static_cast<float>(shared.count);
      add(shared.piece, shared.place * part + V2f(0.5F), shared.sum * part, shared.texel);
    }
  }

  /// Samples show what was shaded for them.
  void give_to_all() {
    const auto planes = static_cast<std::size_t>(job_.view.plane_count);
    for (int row = 0; row < seen_.height; ++row) {
      for (int column = 0; column < seen_.width; ++column) {
        const std::uint32_t at = texel(column, row);
        if (seen_.z[index(column, row)] > no_depth)
          std::copy_n(&scratch_.samples[scratch_.shading_source_indices[at] * planes], planes,
                      &scratch_.samples[at * planes]);
      }
    }
  }

  void add(std::int32_t piece, const V2f& place, float depth, std::uint32_t to) {
    const Yarns::Segment& s = job_.pieces.segment(piece);
    const float above = depth - job_.yarn.reference_height();
    const std::size_t i = batch_.count++;
    const auto put = [&](int axis, auto& beside, auto& shift) {
      const float at = (static_cast<float>(seen_.window_origin[axis]) + place[axis]) * period_[axis] /
                           static_cast<float>(seen_.period[axis]) +
                       slope_[axis] * above - s.start[axis];
      const float moved = std::floor((at - s.along[axis] / 2) / repeat_[axis] + 0.5F) * repeat_[axis];
      beside[i] = at - moved;
      shift[i] = seen_.size.shows_map ? moved : 0;
    };
    put(0, batch_.x, batch_.shift_x);
    put(1, batch_.y, batch_.shift_y);
    batch_.z[i] = depth - s.start.z;
    batch_.piece[i] = piece;
    batch_.texel[i] = to;
    if (batch_.count == ShadingBatch::capacity) flush();
  }

  void flush() {
    shade(job_, batch_, scratch_.samples.data());
    batch_.count = 0;
  }

  const ShadingJob& job_;
  V2f slope_;
  const DepthGrid& seen_;
  CellScratch& scratch_;
  V2f period_ = image_period(job_.yarn, seen_.size);
  /// The repeat of pieces: a map moves them by whole stitches.
  V2f repeat_ =
      seen_.size.shows_map ? job_.yarn.yarns().period() / V2f(job_.yarn.yarns().data().map.kinds) : period_;
  ShadingBatch batch_{};
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

/// The box filter of a pixel over all planes: running sums along a row, then, of all columns at once, along
/// the columns. Only the sums of a pixel's rows are kept, since an image is larger than the processor's
/// cache.
void filter_planes(const CellView& view, const Quad& scale, CellScratch& scratch, CellImage& image) {
  const CellSize& size = view.size;
  const int planes = view.plane_count;
  const int lines = size.rendered_samples().y;
  const int columns = size.rendered_samples().x * planes;
  const V2i texels = size.texels();
  const int kept_rows = size.pixel_samples.y + 1;
  scratch.row_sums.resize(static_cast<std::size_t>(kept_rows) * columns);
  const auto row_of = [&](int row) {
    return &scratch.row_sums[static_cast<std::size_t>(row % kept_rows) * columns];
  };
  const auto sum_row = [&](int row) {
    const Group* const in =
        scratch.samples.data() + static_cast<std::size_t>(row < lines ? row : row - lines) * columns;
    Group* const out = row_of(row);
    const int pixel = size.pixel_samples.x * planes;
    for (int plane = 0; plane < planes; ++plane) {
      Quad sum{};
      for (int i = plane; i < pixel; i += planes) sum += group_lanes(in[i]);
      for (int i = plane; i < columns; i += planes) {
        std::memcpy(&out[i], &sum, sizeof sum);
        const int next = i + pixel < columns ? i + pixel : i + pixel - columns;
        sum += group_lanes(in[next]) - group_lanes(in[i]);
      }
    }
  };
  std::vector<Group>& sums = scratch.pixel_sums;
  sums.assign(columns, Group{});
  for (int row = 0; row < size.pixel_samples.y; ++row) {
    sum_row(row);
    for (int i = 0; i < columns; ++i) accumulate(group_lanes(row_of(row)[i]), sums[i]);
  }
  // A window has texels of its own behind the last.
  const bool whole = size.is_whole();
  const auto put_row = [&](int y) {
    for (int plane = 0; plane < planes; ++plane) {
      CellTexel* const to =
          &image.texels[plane * image.plane_texels() + static_cast<std::size_t>(y) * image.stride()];
      for (int i = 0; i < texels.x + (whole ? 0 : 1); ++i)
        to[i] = pack(group_lanes(sums[i * size.stride * planes + plane]) * scale);
      if (whole) to[texels.x] = to[0];
    }
  };
  for (int row = 0; row < (whole ? texels.y : texels.y + 1) * size.stride; ++row) {
    if (row % size.stride == 0) put_row(row / size.stride);
    if (row + size.pixel_samples.y >= lines && !whole) break;
    sum_row(row + size.pixel_samples.y);
    const Group* const before = row_of(row);
    const Group* const next = row_of(row + size.pixel_samples.y);
    for (int i = 0; i < columns; ++i) accumulate(group_lanes(next[i]) - group_lanes(before[i]), sums[i]);
  }
  for (int plane = 0; plane < planes && whole; ++plane) {
    const auto first = image.texels.begin() + static_cast<std::ptrdiff_t>(plane * image.plane_texels());
    std::copy_n(first, image.stride(), first + static_cast<std::ptrdiff_t>(texels.y) * image.stride());
  }
}

/// The image's texels from its samples.
void filter(const CellView& view, CellScratch& scratch, CellImage& image) {
  const CellSize& size = view.size;
  Quad most{};
  for (const Group& g : scratch.samples) most = group_lanes(g) > most ? group_lanes(g) : most;
  const float highest = std::clamp(std::max({most[0], most[1], most[2]}), 1e-30F, 1e30F);
  image.radiance_scale = std::exp2(std::ceil(std::log2(highest)));
  image.plane_count = view.plane_count;
  image.width = size.texels().x;
  image.height = size.texels().y;
  const auto stride = static_cast<float>(size.stride);
  image.repeat_texels = V2f(size.repeat_samples) / stride;
  image.origin = (V2f(size.pixel_samples) * 0.5F + V2f(size.window_origin)) / stride;
  for (int axis = 0; axis < 2; ++axis)
    if (image.origin[axis] >= image.repeat_texels[axis]) image.origin[axis] -= image.repeat_texels[axis];
  image.texels.resize(image.plane_texels() * view.plane_count);
  const float mean = 1 / static_cast<float>(size.pixel_samples.x * size.pixel_samples.y);
  const Quad scale =
      Quad{1 / image.radiance_scale, 1 / image.radiance_scale, 1 / image.radiance_scale, 1} * mean;
  filter_planes(view, scale, scratch, image);
}

/// CellImage::heights of what was seen.
void fill_heights(const CellYarn& yarn, const YarnPieces& pieces, const DepthGrid& seen, const CellSize& size,
                  CellImage& image) {
  std::vector<bool> along_v;
  for (const YarnCurve& curve : yarn.yarns().data().curves)
    along_v.push_back(runs_along_v(curve, yarn.yarns().period()));
  constexpr float most = 127;
  image.height_step = height_step(yarn.yarns(), yarn.reference_height());
  image.heights.resize(image.plane_texels());
  std::int8_t* to = image.heights.data();
  std::int8_t last = 0;
  const int own = size.is_whole() ? 0 : 1;  // texels of a window behind its last
  for (int j = 0; j < image.height + own; ++j) {
    const std::int8_t* const begin = to;
    const auto row = [&](int y) {
      y += j * size.stride;
      return static_cast<std::size_t>(y < seen.height ? y : y - seen.height) * seen.stride;
    };
    const std::array rows{row(0), row(size.pixel_samples.y - 1)};
    for (int i = 0; i < image.width + own; ++i) {
      const int left = i * size.stride;
      const int right = left + size.pixel_samples.x - 1;
      float sum = 0;
      float count = 0;
      float upright = 0;
      for (const std::size_t first : rows) {
        for (const int x : {left, right < seen.width ? right : right - seen.width}) {
          const float z = seen.z[first + x];
          if (!(z > no_depth)) continue;
          sum += z;
          count += 1;
          upright += along_v[pieces.segment(seen.piece[first + x]).curve] ? 1.0F : 0.0F;
        }
      }
      if (count > 0) {
        const float height =
            std::clamp((sum / count - yarn.reference_height()) / image.height_step, 1 - most, most);
        last = static_cast<std::int8_t>((static_cast<int>(height) & ~1) | (2 * upright > count ? 1 : 0));
      }
      *to++ = last;
    }
    if (own == 0) *to++ = *begin;
  }
  if (own == 0) std::copy_n(image.heights.data(), image.stride(), to);
}

/// The lowest and the highest point that an image shows, mm.
V2f seen_heights(const YarnPieces& pieces, const DepthGrid& seen, std::span<const SeenHair> hairs) {
  V2f heights(HUGE_VALF, -HUGE_VALF);
  const auto add = [&](float z) { heights = {std::min(heights.x, z), std::max(heights.y, z)}; };
  for (int row = 0; row < seen.height; ++row)
    for (const float z : std::span(seen.z).subspan(std::size_t{1} * row * seen.stride, seen.width))
      if (z > no_depth) add(z);
  for (const SeenHair& hair : hairs) {
    const Yarns::Segment& s = pieces.segment(hair.piece);
    add(s.start.z + s.along.z / 2);
  }
  return heights;
}

/// Means of what hairs send to the viewer: scratch.hairs, [shading][plane], and of each of `count` hairs the
/// shading that it shows. `share`: neighbours on a yarn that show one. `once`: at one point each.
void shade_hairs(const ShadingJob& job, std::size_t count, std::size_t share, bool once,
                 CellScratch& scratch) {
  struct Last {
    std::uint32_t shading = 0;
    std::size_t left = 0;  ///< neighbours that will show it
  };
  std::vector<Last> of_curve(job.yarn.yarns().data().curves.size());
  scratch.hair_shadings.assign(count, 0);
  std::vector<SeenHair>& hairs = scratch.seen_hairs;
  std::uint32_t shadings = 0;
  for (const SeenHair& hair : hairs) {
    Last& last = of_curve[job.pieces.segment(hair.piece).curve];
    if (last.left == 0) {
      last = {shadings, share};
      hairs[shadings] = {hair.piece, shadings, hair.radius, hair.shift};
      ++shadings;
    }
    --last.left;
    scratch.hair_shadings[hair.number] = last.shading;
  }
  hairs.resize(shadings);
  const YarnPieces& pieces = job.pieces;
  std::vector<Group>& colours = scratch.hairs;
  colours.assign(std::size_t{shadings} * job.view.plane_count, Group{});
  const V3f viewer = clamp_rise(job.view.view);
  ShadingBatch batch{};
  const auto flush = [&] {
    shade(job, batch, colours.data());
    batch.count = 0;
  };
  for (const auto& [piece, k, radius, shift] : hairs) {
    const V3f axis(pieces.numbers[YarnPieces::axis_x][piece], pieces.numbers[YarnPieces::axis_y][piece],
                   pieces.numbers[YarnPieces::axis_z][piece]);
    const V3f across = axis.cross(viewer).normalized();
    // Two points of the visible half, as Gauss' rule places them; neighbours differ little.
    const float beside = std::sqrt(1.0F / 3);
    for (const float sign : {-beside, beside}) {
      if (once && (sign > 0) == (piece % 2 == pieces.ply_piece_count % 2)) continue;
      const V3f at = pieces.segment(piece).along * 0.5F +
                     (across.cross(axis) * std::sqrt(2.0F / 3) + across * sign) * radius;
      const std::size_t i = batch.count++;
      batch.x[i] = at.x;
      batch.y[i] = at.y;
      batch.z[i] = at.z;
      batch.shift_x[i] = shift.x;
      batch.shift_y[i] = shift.y;
      batch.piece[i] = piece;
      batch.texel[i] = k;
      if (batch.count == ShadingBatch::capacity) flush();
    }
  }
  flush();
  for (Group& colour : colours)
    for (float& value : colour) value *= once ? 1.0F : 0.5F;
  for (std::uint32_t k = 0; k < shadings; ++k) colours[std::size_t{k} * job.view.plane_count][3] = 1;
}

/// Collects the stations of light that pieces in sight ask for.
void find_stations(const ShadingJob& job, CellScratch& scratch) {
  const YarnData& data = job.yarn.yarns().data();
  const auto grow = [](std::vector<std::uint32_t>& marks, std::size_t size) {
    if (marks.size() < size) marks.resize(size);
  };
  ++scratch.image;
  grow(scratch.marked_pieces, job.pieces.count());
  grow(scratch.marked_stations, data.station_light.size() / light_values_per_station);
  scratch.stations.clear();
  const auto add = [&](std::int32_t piece) {
    if (std::exchange(scratch.marked_pieces[piece], scratch.image) == scratch.image) return;
    const Yarns::Segment& s = job.pieces.segment(piece);
    const int count = data.curves[s.curve].stations;
    const int begin = job.yarn.yarns().geometry().first_station[s.curve];
    // A point's place along its piece lies between -1/4 and 5/4.
    const int first = static_cast<int>(std::floor(s.start_station - 0.25F * s.station_span));
    const int last = static_cast<int>(std::floor(s.start_station + 1.25F * s.station_span)) + 1;
    for (int k = first; k <= std::min(last, first + count); ++k) {
      const auto station = static_cast<std::uint32_t>(begin + (k % count + count) % count);
      if (std::exchange(scratch.marked_stations[station], scratch.image) != scratch.image)
        scratch.stations.push_back(station);
    }
  };
  const DepthGrid& seen = scratch.depths;
  for (int row = 0; row < seen.height; ++row) {
    const std::size_t begin = static_cast<std::size_t>(row) * seen.stride;
    for (std::size_t i = begin; i < begin + seen.width; ++i)
      if (seen.z[i] > no_depth) add(seen.piece[i]);
  }
  for (const SeenHair& hair : scratch.seen_hairs) add(hair.piece);
}

/// Adds the yarn to the samples of an image.
void add_yarn(const CellYarn& yarn, const CellView& view, CellShadows& shadows, CellScratch& scratch) {
  const float pixel = pixel_width(image_period(yarn, view.size), view.size);
  const float width = pixel / view.rays_per_pixel_side;
  const YarnPieces& pieces = shown_pieces(yarn, view);
  const V2f slope = ray_slope(view.view);
  scratch.depths.resize(view.size, true);
  const float sample =
      pixel / static_cast<float>(std::max(view.size.pixel_samples.x, view.size.pixel_samples.y));
  const SplatView seen_from{slope, width, view.has_hairs};
  ShownPieces& shown = scratch.shown;
  find_pieces(yarn, pieces, seen_from, scratch.depths, shown);
  splat(yarn, pieces, seen_from, shown.plies, scratch.depths);
  // Thin hairs cover fractions of samples; wide ones have a lit and a dark side.
  const bool lines = pieces.thickest_hair_radius < sample;
  if (!lines) splat(yarn, pieces, seen_from, shown.hairs, scratch.depths);
  scratch.seen_hairs.clear();
  if (lines) find_hairs(yarn, pieces, seen_from, scratch.depths, shown.hairs, scratch.seen_hairs);
  const std::vector<FrontLamp> lamps =
      make_front_lamps(yarn, view, pixel, seen_heights(pieces, scratch.depths, scratch.seen_hairs), shadows);
  const std::vector<LightSlot> slots = light_slots(yarn, view);
  ShadingJob job{yarn, pieces, view, lamps, slots, {}, width};
  if (!view.size.is_whole()) find_stations(job, scratch);
  std::vector<float> functions;
  if (view.has_station_table) {
    fill_station_table(yarn, view, view.size.is_whole() ? nullptr : &scratch.stations, scratch.station_table);
    job.station_table = scratch.station_table;
  } else {
    job.lamp_basis = functions = light_basis_of_lamps(yarn, view);
  }
  PointShader(job, slope, scratch.depths, scratch).shade_all();
  if (lines && !shown.hairs.empty()) {
    const std::size_t points = view.size.count();
    const std::size_t seen = scratch.seen_hairs.size();
    const bool once = view.shading_block_size > 1 || (yarn.has_large_cell() && 2 * seen > points);
    // Samples of texels: as many shadings as points, of hairs that are finer than these.
    const std::size_t share = view.has_station_table ? 1 : std::max<std::size_t>(1, seen / points);
    shade_hairs(job, shown.hair_count(), share, once, scratch);
    blend_hairs(yarn, pieces, seen_from, scratch.depths, shown.hairs, {scratch.hair_shadings, scratch.hairs},
                scratch.samples);
  }
}

}  // namespace

float height_step(const Yarns& yarns, float reference) {
  const Yarns::Geometry inside = yarns.geometry();
  return std::max({inside.max_z - reference, reference - inside.min_z, 1e-9F}) / 127;
}

CellSize cell_size(const V2f& pixel, float samples, int max_samples) {
  CellSize size;
  const auto set = [&](int axis) {
    const float in_repeat = std::clamp(1 / std::max(pixel[axis], 1e-9F), 1e-3F, 1e6F);
    const float wanted =
        std::clamp(samples * in_repeat, static_cast<float>(min_cell_texels), static_cast<float>(max_samples));
    size.repeat_samples[axis] = static_cast<int>(std::lround(wanted / 4)) * 4;
    size.pixel_samples[axis] =
        std::clamp(static_cast<int>(std::lround(static_cast<float>(size.repeat_samples[axis]) / in_repeat)),
                   1, size.repeat_samples[axis]);
  };
  set(0);
  set(1);
  const int finest = std::min(size.pixel_samples.x, size.pixel_samples.y);
  size.stride = finest >= 4 && size.repeat_samples.x >= 2 * min_cell_texels &&
                        size.repeat_samples.y >= 2 * min_cell_texels
                    ? 2
                    : 1;
  return size;
}

void set_window(RepeatParts parts, float pixels_around, CellSize& size) {
  CellSize window = size;
  for (int axis = 0; axis < 2; ++axis) {
    const auto bits = static_cast<std::uint32_t>(parts >> (parts_per_side * axis));
    int unit = 0;
    int units = parts_per_side;
    for (int i = 0; i < parts_per_side; ++i) {
      const int length = std::bit_width(std::rotr(bits, i));
      if (length < units) std::tie(unit, units) = std::pair(i, length);
    }
    if (axis == 1) unit = (2 * parts_per_side - unit - units) % parts_per_side;  // rows rise against v
    const int samples = size.repeat_samples[axis];
    const float of_unit = static_cast<float>(samples) / parts_per_side;
    const float around = pixels_around * static_cast<float>(size.pixel_samples[axis]);
    const int low = static_cast<int>(std::floor((static_cast<float>(unit) * of_unit - around) /
                                                static_cast<float>(size.stride))) *
                    size.stride;
    const int high = static_cast<int>(std::ceil(static_cast<float>(unit + units) * of_unit + around));
    window.window_origin[axis] = low < 0 ? low + samples : low;
    window.window_samples[axis] = std::max(high - low, min_cell_texels) + size.pixel_samples[axis];
    if (window.window_samples[axis] >= samples || low < -samples) return;
  }
  size = window;
}

const YarnPieces& shown_pieces(const CellYarn& yarn, const CellView& view) {
  return yarn.pieces(view.max_piece_pixels * pixel_width(image_period(yarn, view.size), view.size));
}

void make_yarn_samples(const CellSource& source, const CellView& view, CellScratch& scratch) {
  scratch.samples.assign(view.size.count() * view.plane_count, Group{});
  if (view.levels.yarn_weight > 0) add_yarn(*source.yarn, view, *source.shadows, scratch);
}

void make_cell_image(const CellSource& source, const CellView& view, CellScratch& scratch, CellImage& image) {
  const CellSize& size = view.size;
  const float of_yarn = view.levels.yarn_weight;
  make_yarn_samples(source, view, scratch);
  if (of_yarn < 1) {
    for (Group& sample : scratch.samples)
      for (float& value : sample) value *= of_yarn;
    source.texels->add_to_samples(view, scratch.samples);
  }
  filter(view, scratch, image);
  image.heights.clear();
  if (of_yarn > 0) fill_heights(*source.yarn, shown_pieces(*source.yarn, view), scratch.depths, size, image);
}

}  // namespace selvedge
