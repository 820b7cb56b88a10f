#include "viewer/shader/buffers.h"

#include <Imath/half.h>

#include <algorithm>
#include <bit>

#include "viewer/shader/word_layout.h"

namespace selvedge {
namespace {

using namespace word_layout;

class Words {
 public:
  explicit Words(std::vector<std::uint32_t>& words) : words_(words) {}

  std::uint32_t place() const { return static_cast<std::uint32_t>(words_.size()); }
  void add(std::uint32_t word) { words_.push_back(word); }
  void add(int number) { words_.push_back(static_cast<std::uint32_t>(number)); }
  void add(float value) { words_.push_back(std::bit_cast<std::uint32_t>(value)); }
  std::uint32_t& operator[](std::size_t at) { return words_[at]; }

  /// Place of the values.
  std::uint32_t floats(std::span<const float> values) {
    const std::uint32_t at = place();
    for (const float value : values) add(value);
    return at;
  }
  struct Table {
    std::uint32_t place = 0;
    bool halves = false;
  };
  Table table(std::span<const float> values) {
    const bool halves = std::all_of(values.begin(), values.end(), [](float value) {
      return static_cast<float>(Imath::half(value)) == value;
    });
    if (!halves) return {floats(values), false};
    const std::uint32_t at = place();
    for (std::size_t i = 0; i < values.size(); i += 2) {
      const std::uint32_t low = Imath::half(values[i]).bits();
      const std::uint32_t high = i + 1 < values.size() ? Imath::half(values[i + 1]).bits() : 0;
      add(low | high << 16U);
    }
    return {at, true};
  }

 private:
  std::vector<std::uint32_t>& words_;
};

// Imath's vectors are three floats without padding.
std::span<const float> floats_of(const std::vector<V3f>& vectors) {
  static_assert(sizeof(V3f) == 3 * sizeof(float));
  return {vectors.empty() ? nullptr : &vectors.front().x, vectors.size() * 3};
}

void add_level(const FabricLevel& level, Words& words) {
  const std::size_t base = words.place();
  for (std::size_t i = 0; i < level_words; ++i) words.add(0);
  const auto set = [&](std::size_t at, auto value) { words[base + at] = static_cast<std::uint32_t>(value); };
  const auto set_table = [&](std::size_t at, const Words::Table& table) {
    words[base + at] = table.place;
    words[base + at + 1] = table.halves ? 1 : 0;
  };
  set(level_width, level.width);
  set(level_height, level.height);
  if (level.lobes) {
    set(level_lobe_count, level.lobes->lobes);
    words[base + level_lobes] = words.floats(level.lobes->parameters);
  }
  if (level.frame) {
    words[base + level_frames] = words.place();
    for (std::size_t t = 0; t < level.frame->normal.size(); ++t) {
      for (const V3f& d : {level.frame->normal[t], level.frame->tangent[t]}) {
        for (int k = 0; k < 3; ++k) words.add(d[k]);
      }
    }
  }
  if (level.view_table) set_table(level_view_table, words.table(floats_of(level.view_table->colour)));
  if (level.opacity) set_table(level_opacity, words.table(level.opacity->opacity));
  if (level.light_table) set_table(level_light_table, words.table(floats_of(level.light_table->value)));
  set(level_entries, 1);
  if (level.products) {
    set(level_products, level.products->pairs.size());
    set(level_entries, level.products->entries);
    words[base + level_pairs] = words.place();
    for (const V2i& pair : level.products->pairs) {
      words.add(pair.x);
      words.add(pair.y);
    }
    words[base + level_coefficients] = words.floats(level.products->coefficient);
  }
  if (level.heights) {
    const HeightLayer& heights = *level.heights;
    words[base + level_heights] = words.place();
    for (std::size_t i = 0; i < heights.top().size(); ++i) {
      words.add(heights.top()[i]);
      words.add(heights.bottom()[i]);
    }
    set(level_columns, heights.shape().columns);
    set(level_rows, heights.shape().rows);
    set(level_slabs, heights.shape().slabs);
    words[base + level_highest] = std::bit_cast<std::uint32_t>(heights.highest());
    words[base + level_lowest] = std::bit_cast<std::uint32_t>(heights.lowest());
  }
}

void add_fabric(const Fabric& fabric, Words& words) {
  const std::size_t base = words.place();
  for (std::size_t i = 0; i < fabric_level_places + fabric.levels.size(); ++i) words.add(0);
  const auto set = [&](std::size_t at, int value) { words[base + at] = static_cast<std::uint32_t>(value); };
  const auto set_float = [&](std::size_t at, float value) {
    words[base + at] = std::bit_cast<std::uint32_t>(value);
  };
  set(fabric_level_count, static_cast<int>(fabric.levels.size()));
  set(fabric_view_columns, fabric.views.columns);
  set(fabric_view_rows, fabric.views.rows);
  set(fabric_light_columns, fabric.lights.columns);
  set(fabric_light_rows, fabric.lights.rows);
  set_float(fabric_radiance_scale, fabric.radiance_scale);
  set_float(fabric_repeats_per_mm_u, 1 / fabric.period_mm.x);
  set_float(fabric_repeats_per_mm_v, -1 / fabric.period_mm.y);
  set_float(fabric_reference_height, fabric.reference_height);
  set(fabric_width, whole_texels(fabric).x);
  set(fabric_height, whole_texels(fabric).y);
  set(fabric_first_level, first_level(fabric));
  for (const FabricLevel& level : fabric.levels) {
    if (!level.bases || words[base + fabric_light_basis] != 0) continue;
    words[base + fabric_view_basis] = words.floats(level.bases->view);
    words[base + fabric_light_basis] = words.floats(floats_of(level.bases->light));
  }
  for (std::size_t k = 0; k < fabric.levels.size(); ++k) {
    words[base + fabric_level_places + k] = words.place();
    add_level(fabric.levels[k], words);
  }
}

}  // namespace

std::vector<std::uint32_t> shader_words(std::span<const Fabric> fabrics) {
  std::vector<std::uint32_t> result(std::max<std::size_t>(fabrics.size(), 1), 0);
  Words words(result);
  for (std::size_t i = 0; i < fabrics.size(); ++i) {
    result[i] = words.place();
    add_fabric(fabrics[i], words);
  }
  return result;
}

}  // namespace selvedge
