#include "format/fabric/gpu_words.h"

#include <Imath/half.h>

#include <algorithm>
#include <bit>

#include "format/fabric/level_values.h"

namespace selvedge {
namespace {

using uint = std::uint32_t;  // NOLINT(readability-identifier-naming): the name that GLSL has
#include "format/fabric/word_layout.glsl"

/// Access to the words of a fabric or of a level.
class Words {
 public:
  /// Appends `count` words of value 0.
  Words(std::vector<uint>& words, std::size_t count) : words_(words), base_(words.size()) {
    words.resize(base_ + count);
  }
  uint& operator[](uint at) { return words_[base_ + at]; }
  void set(uint at, int value) { (*this)[at] = static_cast<uint>(value); }
  void set(uint at, float value) { (*this)[at] = std::bit_cast<uint>(value); }
  void set(uint at, const V3f& value) {
    for (uint k = 0; k < 3; ++k) set(at + k, value[static_cast<int>(k)]);
  }
  /// Sets the place to the place of the next appended word.
  void set_place(uint at) { (*this)[at] = static_cast<uint>(words_.size()); }
  /// Appends the values, and sets their place.
  void set(uint at, std::span<const float> values) {
    if (values.empty()) return;
    set_place(at);
    for (const float value : values) words_.push_back(std::bit_cast<uint>(value));
  }
  /// Appends the values, as halves, two in a word, if half precision holds all of them; sets their place, and
  /// the next word to whether they are halves.
  void set_table(uint at, std::span<const float> values) {
    const bool halves = std::ranges::all_of(
        values, [](float value) { return static_cast<float>(Imath::half(value)) == value; });
    if (values.empty() || !halves) return set(at, values);
    set_place(at);
    (*this)[at + 1] = 1;
    for (std::size_t i = 0; i < values.size(); i += 2) {
      const uint low = Imath::half(values[i]).bits();
      const uint high = i + 1 < values.size() ? Imath::half(values[i + 1]).bits() : 0;
      words_.push_back(low | high << 16U);
    }
  }

 private:
  std::vector<uint>& words_;
  std::size_t base_;
};

void add_level(const FabricLevel& level, std::vector<uint>& result) {
  Words words(result, level_words);
  words.set(level_width, level.width);
  words.set(level_height, level.height);
  words.set(level_lobe_count, level.lobe_count());
  words.set(level_lobes, level.lobes());
  words.set(level_frames, level[LayerKind::frame].values);
  words.set_table(level_view_table, level[LayerKind::table].values);
  words.set_table(level_opacity, level.opacity());
  words.set_table(level_light_table, level[LayerKind::light].values);
  if (level.has(LayerKind::products)) {
    words.set(level_products, static_cast<int>(level.pairs.size()));
    words.set_place(level_pairs);
    for (const V2i& pair : level.pairs) {
      result.push_back(static_cast<uint>(pair.x));
      result.push_back(static_cast<uint>(pair.y));
    }
    words.set(level_coefficients, level.coefficients());
  }
}

void add_cells(const Yarns::Inside& inside, std::vector<uint>& result) {
  const std::size_t first = result.size();
  result.resize(first + inside.grid.size() * cell_words);
  for (std::size_t i = 0; i < inside.grid.size(); ++i) {
    const Yarns::Cell& cell = inside.grid[i];
    const std::size_t place = result.size();
    std::vector<std::pair<const Yarns::Block*, std::size_t>> near;
    for (const Yarns::Block& block : inside.blocks.subspan(cell.first, cell.blocks)) {
      for (std::size_t k = 0; k < yarn_block && block.reach[k] > 0; ++k) near.emplace_back(&block, k);
    }
    // Hairs that vanish first are the last.
    std::ranges::stable_sort(near, [&](const auto& a, const auto& b) {
      const auto lasts = [&](const auto& of) {
        return empty_for(inside.segments[of.first->segment[of.second]]);
      };
      return lasts(a) > lasts(b);
    });
    for (const auto& [block, k] : near) {
      Words reference(result, reference_words);
      reference.set(reference_start, V3f(block->start[0][k], block->start[1][k], block->start[2][k]));
      reference.set(reference_segment, block->segment[k]);
    }
    uint* words = &result[first + i * cell_words];
    words[cell_first] = static_cast<uint>(place);
    words[cell_count] = static_cast<uint>((result.size() - place) / reference_words);
    words[cell_low] = std::bit_cast<uint>(cell.low);
    words[cell_high] = std::bit_cast<uint>(cell.high);
  }
}

void add_segment(const Yarns::Segment& segment, std::vector<uint>& result) {
  Words words(result, segment_words);
  const V3f along = squeezed(segment.along, segment.squeeze);
  words.set(segment_axis, along.normalized());
  words.set(segment_length, along.length());
  words.set(segment_start, segment.start);
  words.set(segment_radius, segment.radius);
  words.set(segment_squeeze, segment.squeeze.x);
  words.set(segment_squeeze + 1, segment.squeeze.y);
  for (uint end = 0; end < 2; ++end) {
    words.set(segment_tangents + 3 * end, squeezed(segment.tangent[end], segment.squeeze));
    words.set(segment_across + 3 * end, segment.across[end]);
    words.set(segment_out + 3 * end, segment.out[end]);
  }
  words.set(segment_station, segment.station);
  words.set(segment_stations, segment.stations);
  words.set(segment_curve, segment.curve);
  words.set(segment_rows, segment.rows.first);
  words.set(segment_rows + 1, segment.rows.later);
  words.set(segment_reach, segment.reach);
  words.set(segment_rank, segment.rank);
}

void add_strands(const YarnStrands& strands, const V2f& sense, Words& curve) {
  const int count = std::abs(strands.count);
  curve.set(curve_strands, count);
  if (count > 0) {
    curve[curve_strand_shift] = shift_within_turn(strands);
    curve.set(curve_lays, static_cast<float>(strands.shift) / static_cast<float>(count));
  }
  curve.set(curve_pieces, strands.pieces);
  curve[curve_seed] = strand_hash(static_cast<uint>(strands.seed));
  curve.set(curve_strand_sense, sense.x);
  curve.set(curve_strand_sense + 1, sense.y);
  curve.set(curve_irregularity, strands.irregularity);
  curve.set(curve_swells, strands.swells);
}

void add_yarns(const Yarns& yarns, std::vector<uint>& result) {
  const Yarns::Inside inside = yarns.inside();
  const std::vector<YarnCurve>& curves = yarns.data().curves;
  Words words(result, yarn_words);
  words.set(yarn_period, yarns.period().x);
  words.set(yarn_period + 1, yarns.period().y);
  words.set(yarn_low, inside.low);
  words.set(yarn_high, inside.high);
  words.set(yarn_columns, inside.cells.x);
  words.set(yarn_rows, inside.cells.y);
  words.set(yarn_cell_size, inside.cell_size.x);
  words.set(yarn_cell_size + 1, inside.cell_size.y);
  words.set_place(yarn_cells);
  add_cells(inside, result);
  words.set_place(yarn_segments);
  for (const Yarns::Segment& s : inside.segments) add_segment(s, result);
  words.set_place(yarn_curves);
  for (std::size_t i = 0; i < curves.size(); ++i) {
    Words curve(result, curve_words);
    curve.set(curve_first_station, inside.first_station[i]);
    curve.set(curve_stations, curves[i].stations);
    curve.set(curve_albedo, curves[i].albedo);
    curve.set(curve_gloss, curves[i].gloss.weight);
    curve.set(curve_roughness, curves[i].gloss.roughness);
    curve.set(curve_slope, curves[i].fibre_slope);
    curve.set(curve_groove, curves[i].plies.groove);
    add_strands(curves[i].strands, inside.strand_sense[i], curve);
  }
  words.set(yarn_light, yarns.data().light);
  words.set(yarn_through, yarns.data().through);
}

void add_fabric(const Fabric& fabric, std::vector<uint>& result) {
  Words words(result, fabric_level_places + fabric.levels.size());
  words.set(fabric_level_count, static_cast<int>(fabric.levels.size()));
  words.set(fabric_view_columns, fabric.views.columns);
  words.set(fabric_view_rows, fabric.views.rows);
  words.set(fabric_light_columns, fabric.lights.columns);
  words.set(fabric_light_rows, fabric.lights.rows);
  words.set(fabric_radiance_scale, fabric.radiance_scale);
  words.set(fabric_reference_height, fabric.reference_height);
  words.set(fabric_largest_yarn_pixel, largest_yarn_pixel(fabric));
  if (const auto bases = bases_of(fabric)) {
    words.set(fabric_view_basis, bases->view);
    words.set(fabric_light_basis, floats_of(bases->light));
  }
  if (!fabric.levels.empty() && fabric.levels.front().yarns()) {
    words.set_place(fabric_yarns);
    add_yarns(*fabric.levels.front().yarns(), result);
  }
  for (uint k = 0; k < fabric.levels.size(); ++k) {
    words.set_place(fabric_level_places + k);
    add_level(fabric.levels[k], result);
  }
  if (const Fabric* const through = fabric.side_of(Side::through)) {
    words.set_place(fabric_through);
    add_fabric(*through, result);
  }
  if (fabric.side_of(Side::back) != nullptr) {
    words.set_place(fabric_turned);
    add_fabric(turned_over(fabric), result);
  }
}

}  // namespace

std::vector<std::uint32_t> gpu_words(std::span<const Fabric> fabrics) {
  std::vector<uint> result(std::max<std::size_t>(fabrics.size(), 1), 0);
  for (std::size_t i = 0; i < fabrics.size(); ++i) {
    result[i] = static_cast<uint>(result.size());
    add_fabric(fabrics[i], result);
  }
  return result;
}

}  // namespace selvedge
