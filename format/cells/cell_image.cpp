#include "format/cells/cell_image.h"

#include <algorithm>
#include <cmath>

#include "format/cells/cell_shading.h"
#include "format/fabric/lifted.h"
#include "format/simd/fetch.h"
#include "format/simd/wide_float.h"

namespace selvedge {
namespace {

using Quad = Floats4;

float pixel_width(const V2f& period, const CellSize& size) {
  const auto wide = [](float length, int pixel, int samples) {
    return length * static_cast<float>(pixel) / static_cast<float>(samples);
  };
  return std::min(wide(period.x, size.pixel.x, size.samples.x), wide(period.y, size.pixel.y, size.samples.y));
}

/// Collects the visible points of an image and shades them.
class PointShader {
 public:
  PointShader(const ShadingJob& job, const V2f& slope, const DepthGrid& seen, CellScratch& scratch)
      : job_(job), slope_(slope), seen_(seen), scratch_(scratch), period_(job.yarn.yarns().period()) {}

  void shade_all() {
    const int together = job_.view.shaded_together;
    if (together > 1) scratch_.owners.assign(job_.view.size.count(), 0);
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
    const YarnPieces& pieces = job_.pieces;
    return std::abs(piece - shared.piece) <= 2 && pieces.ply[piece] == pieces.ply[shared.piece] &&
           std::abs(depth - shared.depth) < pieces.numbers[YarnPieces::radius][shared.piece];
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
          scratch_.owners[at] = at;
          continue;
        }
        Shared& shared = all[k];
        if (k == count) {
          ++count;
          shared.piece = seen_.piece[i];
          shared.depth = depth;
          shared.texel = at;
        }
        scratch_.owners[at] = shared.texel;
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
    const std::size_t texels = scratch_.owners.size();
    for (int plane = 0; plane < job_.view.planes; ++plane) {
      Group* const raw = scratch_.raw.data() + static_cast<std::size_t>(plane) * texels;
      for (int row = 0; row < seen_.height; ++row) {
        for (int column = 0; column < seen_.width; ++column) {
          const std::uint32_t at = texel(column, row);
          if (seen_.z[index(column, row)] > no_depth) raw[at] = raw[scratch_.owners[at]];
        }
      }
    }
  }

  void add(std::int32_t piece, const V2f& place, float depth, std::uint32_t to) {
    const Yarns::Segment& s = job_.pieces.segments[piece];
    const float above = depth - job_.yarn.plane();
    const auto beside = [&](int axis, float along) {
      const float at = (static_cast<float>(seen_.first[axis]) + place[axis]) * period_[axis] /
                           static_cast<float>(seen_.period[axis]) +
                       slope_[axis] * above - s.start[axis];
      return at - std::floor((at - along / 2) / period_[axis] + 0.5F) * period_[axis];
    };
    const std::size_t i = batch_.count++;
    batch_.x[i] = beside(0, s.along.x);
    batch_.y[i] = beside(1, s.along.y);
    batch_.z[i] = depth - s.start.z;
    batch_.piece[i] = piece;
    batch_.texel[i] = to;
    if (batch_.count == ShadingBatch::size) flush();
  }

  void flush() {
    shade(job_, batch_, job_.view.size.count(), scratch_.raw.data());
    batch_.count = 0;
  }

  const ShadingJob& job_;
  V2f slope_;
  const DepthGrid& seen_;
  CellScratch& scratch_;
  V2f period_;
  ShadingBatch batch_{};
};

/// Smallest number that texels resolve.
constexpr float smallest = 0x1p-14F;
/// Vectors may read and write beyond a row.
constexpr std::size_t behind_row = 16;

struct FilteredRow {
  float* sums;
  const float *before, *next;  ///< rows that leave the sums and join them
  std::size_t count;
  Quad scale;
  std::uint16_t* to;
};

/// Packs sums times `scale`, four numbers a texel, and moves the sums to the next row.
template <std::size_t N>
SELVEDGE_INLINE void pack_row(const FilteredRow& row) {
  using Wide = WideFloat<N>;
  using Halves [[gnu::vector_size(2 * N)]] = std::uint16_t;
  Wide scale;
  for (std::size_t k = 0; k < N; ++k) scale.v[k] = row.scale[k % 4];
  for (std::size_t i = 0; i < row.count; i += N) {
    const Wide value = Wide::load(row.sums + i);
    // Numbers in [2^-14, 1]: the exponent moves down to 5 bits.
    const Wide scaled = value * scale;
    const Wide kept = if_greater(scaled, Wide(smallest), scaled, Wide(0)) * Wide(0x1p-112F);
    const Halves packed = __builtin_convertvector(((typename Lanes<N>::Bits)kept.v + 0x800U) >> 12, Halves);
    std::memcpy(row.to + i, &packed, sizeof packed);
    (value + (Wide::load(row.next + i) - Wide::load(row.before + i))).store(row.sums + i);
  }
}
SELVEDGE_THREE_BODIES(pack_row, (const FilteredRow& row), (row))

/// The box filter of a pixel over one plane: running sums along a row, then, of all columns at once, along
/// the columns. Only the sums of a pixel's rows are kept, since an image is larger than the processor's
/// cache.
void filter_plane(const CellSize& size, const Group* from, const Quad& scale, CellScratch& scratch,
                  CellTexel* to) {
  const int columns = size.made().x;
  const int lines = size.made().y;
  const V2i texels = size.texels();
  const int kept_rows = size.pixel.y + 1;
  scratch.rows.resize(static_cast<std::size_t>(kept_rows) * columns + behind_row);
  const auto row_of = [&](int row) {
    return &scratch.rows[static_cast<std::size_t>(row % kept_rows) * columns];
  };
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
  std::vector<Group>& sums = scratch.sums;
  sums.assign(columns + behind_row, Group{});
  for (int row = 0; row < size.pixel.y; ++row) {
    sum_row(row);
    for (int i = 0; i < columns; ++i) add(quad_of(row_of(row)[i]), sums[i]);
  }
  static const auto pack_this = pack_row_for_this_processor();
  std::vector<CellTexel>& packed = scratch.packed;
  packed.resize(columns + behind_row);
  // A window has texels of its own behind the last.
  const bool whole = size.is_whole();
  CellTexel* const first = to;
  for (int row = 0; row < (whole ? texels.y : texels.y + 1) * size.stride; ++row) {
    const int next = row + size.pixel.y;
    const bool is_last = next >= lines && !whole;
    if (!is_last) sum_row(next);
    pack_this({sums.data()->data(), row_of(row)->data(), row_of(is_last ? row : next)->data(),
               std::size_t{4} * columns, scale, packed.data()->data()});
    if (row % size.stride == 0) {
      if (whole) packed[texels.x * size.stride] = packed[0];
      for (int i = 0; i <= texels.x; ++i) *to++ = packed[i * size.stride];
    }
    if (is_last) break;
  }
  if (whole) std::copy_n(first, texels.x + 1, to);
}

/// The image's texels from its samples.
void filter(const CellView& view, CellScratch& scratch, CellImage& image) {
  const CellSize& size = view.size;
  Quad most{};
  for (const Group& g : scratch.raw) most = quad_of(g) > most ? quad_of(g) : most;
  const float highest = std::clamp(std::max({most[0], most[1], most[2]}), 1e-30F, 1e30F);
  image.scale = std::exp2(std::ceil(std::log2(highest)));
  image.planes = view.planes;
  image.width = size.texels().x;
  image.height = size.texels().y;
  const auto stride = static_cast<float>(size.stride);
  image.repeat = V2f(size.samples) / stride;
  image.first = (V2f(size.pixel) * 0.5F + V2f(size.first)) / stride;
  for (int axis = 0; axis < 2; ++axis)
    if (image.first[axis] >= image.repeat[axis]) image.first[axis] -= image.repeat[axis];
  image.texels.resize(image.plane_texels() * view.planes);
  const float mean = 1 / static_cast<float>(size.pixel.x * size.pixel.y);
  const Quad scale = Quad{1 / image.scale, 1 / image.scale, 1 / image.scale, 1} * mean;
  for (int plane = 0; plane < view.planes; ++plane) {
    filter_plane(size, scratch.raw.data() + plane * size.count(), scale, scratch,
                 image.texels.data() + plane * image.plane_texels());
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

/// Of samples of a row that show yarn: depth, 1, and 1 where it runs along v; of others 0.
using SeenRow = std::array<std::vector<float>, 3>;

struct HeightRow {
  const SeenRow &upper, &lower;
  int stride, apart;  ///< samples from texel to texel, and between a texel's outer samples
  float plane, step;
  std::vector<std::int32_t>& to;
};

constexpr std::int32_t no_height = 128;

template <std::size_t N>
SELVEDGE_INLINE void fill_row(const HeightRow& row) {
  using Wide = WideFloat<N>;
  using Ints = typename Lanes<N>::Ints;
  for (std::size_t i = 0; i + N <= row.to.size(); i += N) {
    const auto sum = [&](std::size_t k) __attribute__((always_inline)) {
      const std::size_t left = i * row.stride;
      const auto all = [&](const float* from) __attribute__((always_inline)) {
        if (row.stride == 1) return Wide::load(from);
        Wide values;
        for (std::size_t lane = 0; lane < N; ++lane) values.v[lane] = from[lane * row.stride];
        return values;
      };
      return all(&row.upper[k][left]) + all(&row.upper[k][left + row.apart]) + all(&row.lower[k][left]) +
             all(&row.lower[k][left + row.apart]);
    };
    const Wide count = sum(1);
    const Wide most(127);
    const Wide height = (sum(0) / max(count, Wide(1)) - Wide(row.plane)) / Wide(row.step);
    const Ints whole = __builtin_convertvector(max(min(height, most), Wide(1) - most).v, Ints) & ~1;
    const Wide upright = sum(2) + sum(2);
    Ints result = upright.v > count.v ? whole | 1 : whole;
    result = count.v > 0 ? result : Ints{} + no_height;
    std::memcpy(&row.to[i], &result, sizeof result);
  }
}
SELVEDGE_THREE_BODIES(fill_row, (const HeightRow& row), (row))

/// CellImage::heights of what was seen.
void fill_heights(const CellYarn& yarn, const YarnPieces& pieces, const DepthGrid& seen, const CellSize& size,
                  CellImage& image) {
  const Yarns::Inside inside = yarn.yarns().inside();
  image.step = std::max({inside.high - yarn.plane(), yarn.plane() - inside.low, 1e-9F}) / 127;
  image.heights.resize(image.plane_texels());
  std::int8_t* to = image.heights.data();
  std::int8_t last = 0;
  const int own = size.is_whole() ? 0 : 1;  // texels of a window behind its last
  std::vector<SeenRow> rows(size.pixel.y);
  std::vector<std::int32_t> heights((image.width + own + behind_row) / behind_row * behind_row);
  const std::size_t columns = heights.size() * size.stride + size.pixel.x;
  const auto read_row = [&](int y) {
    SeenRow& row = rows[y % size.pixel.y];
    const std::size_t begin = static_cast<std::size_t>(y < seen.height ? y : y - seen.height) * seen.stride;
    for (std::vector<float>& values : row) values.resize(columns);
    for (std::size_t x = 0, from = 0; x < columns; ++x, ++from) {
      if (from == static_cast<std::size_t>(seen.width)) from = 0;
      const bool is_there = seen.z[begin + from] > no_depth;
      row[0][x] = is_there ? seen.z[begin + from] : 0.0F;
      row[1][x] = is_there ? 1.0F : 0.0F;
      row[2][x] = static_cast<float>(pieces.ply[is_there ? seen.piece[begin + from] : 0] & 1U) * row[1][x];
    }
  };
  static const auto fill_this = fill_row_for_this_processor();
  for (int y = 0; y + 1 < size.pixel.y; ++y) read_row(y);
  for (int j = 0; j < image.height + own; ++j) {
    const int bottom = (j + 1) * size.stride + size.pixel.y - 1 - size.stride;
    for (int y = std::max(bottom - size.stride + 1, size.pixel.y - 1); y <= bottom; ++y) read_row(y);
    fill_this({rows[j * size.stride % size.pixel.y], rows[bottom % size.pixel.y], size.stride,
               size.pixel.x - 1, yarn.plane(), image.step, heights});
    const std::int8_t* const begin = to;
    for (int i = 0; i < image.width + own; ++i) {
      if (heights[i] != no_height) last = static_cast<std::int8_t>(heights[i]);
      *to++ = last;
    }
    if (own == 0) *to++ = *begin;
  }
  if (own == 0) std::copy_n(image.heights.data(), image.stride(), to);
}

/// Whether some of a hair may lie in an image's window.
bool reaches(const YarnPieces& pieces, std::int32_t hair, const CellYarn& yarn, const V2f& slope,
             const CellSize& size, float radius) {
  if (size.is_whole()) return true;
  const Yarns::Segment& s = pieces.segments[hair];
  const V2f period = yarn.yarns().period();
  for (int axis = 0; axis < 2; ++axis) {
    const float samples = static_cast<float>(size.samples[axis]) / period[axis];
    const float start = s.start[axis] - slope[axis] * (s.start.z - yarn.plane());
    const float along = s.along[axis] - slope[axis] * s.along.z;
    const float wide = radius * (1 + std::abs(slope[axis])) * samples + 1;
    const float low = (start + std::min(along, 0.0F)) * samples - wide - static_cast<float>(size.first[axis]);
    const float length = std::abs(along) * samples + 2 * wide;
    const auto repeat = static_cast<float>(size.samples[axis]);
    const float at = low - std::floor(low / repeat) * repeat;
    if (at > static_cast<float>(size.window[axis]) && at + length < repeat) return false;
  }
  return true;
}

/// Means of what hairs send to the viewer, for the planes one after the other. Hairs that are not shown are
/// black.
void shade_hairs(const ShadingJob& job, const V2f& slope, std::vector<Group>& colours) {
  const YarnPieces& pieces = job.pieces;
  const auto hairs = static_cast<std::size_t>(pieces.count() - pieces.plies);
  colours.assign(hairs * job.view.planes, Group{});
  const V3f viewer = lifted(job.view.view);
  const bool once = job.view.shaded_together > 1;
  ShadingBatch batch{};
  const auto flush = [&] {
    shade(job, batch, hairs, colours.data());
    batch.count = 0;
  };
  for (std::size_t k = 0; k < hairs; ++k) {
    const auto piece = static_cast<std::int32_t>(pieces.plies + k);
    const Yarns::Segment& s = pieces.segments[piece];
    const float radius = std::min(std::max(job.width / 2, s.radius), s.reach);
    if (!(s.radius > radius * s.rank) || !reaches(pieces, piece, job.yarn, slope, job.view.size, radius))
      continue;
    const V3f axis(pieces.numbers[YarnPieces::axis_x][piece], pieces.numbers[YarnPieces::axis_y][piece],
                   pieces.numbers[YarnPieces::axis_z][piece]);
    const V3f across = axis.cross(viewer).normalized();
    // Two points of the visible half, as Gauss' rule places them; neighbours differ little.
    const float beside = std::sqrt(1.0F / 3);
    for (const float sign : {-beside, beside}) {
      if (once && (sign > 0) == (k % 2 == 0)) continue;
      const V3f at = s.along * 0.5F + (across.cross(axis) * std::sqrt(2.0F / 3) + across * sign) * radius;
      const std::size_t i = batch.count++;
      batch.x[i] = at.x;
      batch.y[i] = at.y;
      batch.z[i] = at.z;
      batch.piece[i] = piece;
      batch.texel[i] = static_cast<std::uint32_t>(k);
      if (batch.count == ShadingBatch::size) flush();
    }
  }
  flush();
  for (Group& colour : colours) {
    for (float& value : colour) value *= once ? 1.0F : 0.5F;
  }
  for (std::size_t k = 0; k < hairs; ++k) colours[k][3] = 1;
}

/// Flags the stations of light that pieces in sight, and hairs, ask for.
void want_stations(const CellYarn& yarn, const YarnPieces& pieces, const DepthGrid& seen, bool hairs,
                   std::vector<std::uint8_t>& wanted) {
  const YarnData& data = yarn.yarns().data();
  const std::span<const int> first_station = yarn.yarns().inside().first_station;
  std::vector<std::uint8_t> is_seen(pieces.segments.size());
  for (int row = 0; row < seen.height; ++row) {
    const std::size_t begin = static_cast<std::size_t>(row) * seen.stride;
    for (std::size_t i = begin; i < begin + seen.width; ++i)
      if (seen.z[i] > no_depth) is_seen[seen.piece[i]] = 1;
  }
  if (hairs) std::fill(is_seen.begin() + pieces.plies, is_seen.end(), std::uint8_t{1});
  wanted.assign(data.light.size() / light_values_per_station, 0);
  for (std::size_t i = 0; i < is_seen.size(); ++i) {
    if (is_seen[i] == 0) continue;
    const Yarns::Segment& s = pieces.segments[i];
    const int count = data.curves[s.curve].stations;
    // A point's place along its piece lies between -1/4 and 5/4.
    const int first = static_cast<int>(std::floor(s.station - 0.25F * s.stations));
    const int last = static_cast<int>(std::floor(s.station + 1.25F * s.stations)) + 1;
    for (int k = first; k <= std::min(last, first + count); ++k)
      wanted[first_station[s.curve] + (k % count + count) % count] = 1;
  }
}

/// Adds the yarn to the samples of an image.
void add_yarn(const CellYarn& yarn, const CellView& view, CellShadows& shadows, CellScratch& scratch) {
  const float pixel = pixel_width(yarn.yarns().period(), view.size);
  const float width = pixel / view.detail;
  const YarnPieces& pieces = pieces_of(yarn, view);
  const V2f slope = slope_of(view.view);
  scratch.seen.resize(view.size, true);
  // Thin hairs cover fractions of samples; wide ones have a lit and a dark side.
  const float sample = pixel / static_cast<float>(std::max(view.size.pixel.x, view.size.pixel.y));
  const bool lines = view.hairs && pieces.count() > pieces.plies && pieces.thickest_hair < sample;
  splat(yarn, pieces, {slope, width, view.hairs && !lines}, scratch.seen);
  const std::vector<FrontLamp> lamps = cast_shadows(yarn, view, pixel, shadows);
  scratch.wanted.clear();
  if (!view.size.is_whole()) want_stations(yarn, pieces, scratch.seen, lines, scratch.wanted);
  const std::vector<LightSlot> slots = fill_table(yarn, view, scratch.wanted, scratch.table);
  const ShadingJob job{yarn, pieces, view, lamps, slots, scratch.table, width};
  PointShader(job, slope, scratch.seen, scratch).shade_all();
  if (lines) {
    shade_hairs(job, slope, scratch.hairs);
    blend_hairs(yarn, pieces, {slope, width, true}, scratch.seen, scratch.hairs, scratch.raw);
  }
}

}  // namespace

void make_yarn_samples(const CellSource& source, const CellView& view, CellScratch& scratch) {
  scratch.raw.assign(view.size.count() * view.planes, Group{});
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
  filter(view, scratch, image);
  image.heights.clear();
  if (of_yarn > 0) fill_heights(*source.yarn, pieces_of(*source.yarn, view), scratch.seen, size, image);
}

std::vector<V3f> shade_points(const CellYarn& yarn, const YarnPieces& pieces, const CellView& view,
                              std::span<const CellPoint> points) {
  std::vector<FrontLamp> lamps;
  for (const CellLamp& lamp : view.lamps) {
    if (lamp.direction.z > 0)
      lamps.push_back({.lifted = lifted(lamp.direction),
                       .irradiance = lamp.irradiance,
                       .rise = std::min(1.0F, lamp.direction.z / min_rise)});
  }
  std::vector<Group> table;
  const std::vector<LightSlot> slots = fill_table(yarn, view, {}, table);
  const ShadingJob job{yarn, pieces, view, lamps, slots, table, 0};
  std::vector<V3f> result;
  for (std::size_t first = 0; first < points.size(); first += ShadingBatch::size) {
    ShadingBatch batch{};
    std::vector<Group> raw(ShadingBatch::size, Group{});
    batch.count = std::min(ShadingBatch::size, points.size() - first);
    for (std::size_t i = 0; i < batch.count; ++i) {
      const CellPoint& point = points[first + i];
      batch.piece[i] = point.piece;
      batch.texel[i] = static_cast<std::uint32_t>(i);
      batch.x[i] = point.from_start.x;
      batch.y[i] = point.from_start.y;
      batch.z[i] = point.from_start.z;
    }
    shade(job, batch, ShadingBatch::size, raw.data());
    for (std::size_t i = 0; i < batch.count; ++i) result.emplace_back(raw[i][0], raw[i][1], raw[i][2]);
  }
  return result;
}

}  // namespace selvedge
