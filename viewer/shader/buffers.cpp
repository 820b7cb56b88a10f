#include "viewer/shader/buffers.h"

#include <Imath/half.h>

#include <algorithm>
#include <bit>

namespace selvedge {
namespace {

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

/// Number of words of a level, and of a fabric without its levels.
constexpr std::size_t level_words = 21;
constexpr std::size_t fabric_words = 14;

void add_level(const FabricLevel& level, Words& words) {
  const std::size_t base = words.place();
  for (std::size_t i = 0; i < level_words; ++i) words.add(0);
  const auto set = [&](std::size_t at, auto value) { words[base + at] = static_cast<std::uint32_t>(value); };
  const auto set_table = [&](std::size_t at, const Words::Table& table) {
    words[base + at] = table.place;
    words[base + at + 1] = table.halves ? 1 : 0;
  };
  set(0, level.width);
  set(1, level.height);
  if (level.lobes) {
    set(2, level.lobes->lobes);
    words[base + 3] = words.floats(level.lobes->parameters);
  }
  if (level.frame) {
    words[base + 4] = words.place();
    for (std::size_t t = 0; t < level.frame->normal.size(); ++t) {
      for (const V3f& d : {level.frame->normal[t], level.frame->tangent[t]}) {
        for (int k = 0; k < 3; ++k) words.add(d[k]);
      }
    }
  }
  if (level.view_table) set_table(5, words.table(floats_of(level.view_table->colour)));
  if (level.opacity) set_table(7, words.table(level.opacity->opacity));
  if (level.light_table) set_table(9, words.table(floats_of(level.light_table->value)));
  set(12, 1);
  if (level.products) {
    set(11, level.products->pairs.size());
    set(12, level.products->entries);
    words[base + 13] = words.place();
    for (const V2i& pair : level.products->pairs) {
      words.add(pair.x);
      words.add(pair.y);
    }
    words[base + 14] = words.floats(level.products->coefficient);
  }
  if (level.heights) {
    const HeightLayer& heights = *level.heights;
    words[base + 15] = words.place();
    for (std::size_t i = 0; i < heights.top().size(); ++i) {
      words.add(heights.top()[i]);
      words.add(heights.bottom()[i]);
    }
    set(16, heights.shape().columns);
    set(17, heights.shape().rows);
    set(18, heights.shape().slabs);
    words[base + 19] = std::bit_cast<std::uint32_t>(heights.highest());
    words[base + 20] = std::bit_cast<std::uint32_t>(heights.lowest());
  }
}

void add_fabric(const Fabric& fabric, Words& words) {
  const std::size_t base = words.place();
  words.add(static_cast<int>(fabric.levels.size()));
  words.add(fabric.views.columns);
  words.add(fabric.views.rows);
  words.add(fabric.lights.columns);
  words.add(fabric.lights.rows);
  words.add(fabric.radiance_scale);
  words.add(0);
  words.add(0);
  words.add(1 / fabric.period_mm.x);
  words.add(-1 / fabric.period_mm.y);
  words.add(fabric.reference_height);
  words.add(whole_texels(fabric).x);
  words.add(whole_texels(fabric).y);
  words.add(first_level(fabric));
  static_assert(fabric_words == 14);
  for (std::size_t k = 0; k < fabric.levels.size(); ++k) words.add(0);
  for (const FabricLevel& level : fabric.levels) {
    if (!level.bases || words[base + 7] != 0) continue;
    words[base + 6] = words.floats(level.bases->view);
    words[base + 7] = words.floats(floats_of(level.bases->light));
  }
  for (std::size_t k = 0; k < fabric.levels.size(); ++k) {
    words[base + fabric_words + k] = words.place();
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
