// Kinds of stitches of a large knit (knit_cloth.h): what is drawn alike, with all around it, rests alike.
//
// Left to themselves, loops turn to one side or the other, one leg in front, as rounding has it, and drag
// each other along: equal stitches of a chart rested 0.4 to 0.8 radii apart, and its repeat 4 % too narrow.
#include <algorithm>
#include <array>
#include <map>
#include <vector>

#include "converter/stitch/knit_cloth.h"
#include "converter/stitch/relax_chain.h"

namespace selvedge {
namespace {

/// Stitches each way that are around one, as in maps (arrange.h). Kinds by two or three leave 7 or 8 % less
/// energy, but only 34 or 6 % of the yarn of 24 x 24 stitches has others of its kind then, not 83 %; by two,
/// a sampler lies 22 dB beside the whole at the place `middle`, not 27.
constexpr int reach = 1;

int in_repeat(int i, int count) { return (i + count) % count; }

}  // namespace

/// A part in the frame of its stitch, whose mirror has -x for x.
struct KnitCloth::PartShape {
  const Chain& chain;
  const Part& part;
  V3d middle;
  bool is_drawn_as(const PartShape& other, const std::vector<V3d>& points, bool mirrored) const {
    const std::uint32_t count = part.end - part.begin;
    if (part.is_loop != other.part.is_loop || part.length != other.part.length ||
        count != other.part.end - other.part.begin || chain.radius != other.chain.radius ||
        chain.soft != other.chain.soft || chain.flattening != other.chain.flattening)
      return false;
    for (std::uint32_t i = 1; i < count; ++i) {
      const V3d p = points[part.begin + i] - middle;
      const V3d q = points[other.part.begin + (mirrored ? count - i : i)] - other.middle;
      if (!p.equalWithAbsError(mirrored ? V3d(-q.x, q.y, q.z) : q, 1e-3 * chain.radius)) return false;
    }
    return true;
  }
};

/// Numbers of the shapes of all parts, [chain][part], and of their images.
std::vector<std::vector<std::array<int, 2>>> KnitCloth::part_shapes() const {
  std::vector<PartShape> shapes;
  const auto number_of = [&](const PartShape& shape, bool mirrored) {
    const auto is_alike = [&](const PartShape& other) { return shape.is_drawn_as(other, points_, mirrored); };
    return static_cast<int>(std::ranges::find_if(shapes, is_alike) - shapes.begin());
  };
  std::vector<std::vector<std::array<int, 2>>> numbers(chains_.size());
  for (const int image : {0, 1})
    for (std::size_t c = 0; c < chains_.size(); ++c) {
      const auto columns = static_cast<int>(chains_[c].parts.size());
      const double y = chains_[c].row * period_.y / (chains_.back().row + 1);
      numbers[c].resize(columns);
      for (int k = 0; k < columns; ++k) {
        const PartShape shape{chains_[c], chains_[c].parts[k], {(k + 0.5) * period_.x / columns, y, 0}};
        numbers[c][k][image] = number_of(shape, image == 1);
        if (image == 0 && numbers[c][k][0] == static_cast<int>(shapes.size())) shapes.push_back(shape);
      }
    }
  return numbers;
}

void KnitCloth::find_kinds() {
  if (has_kinds_) return;
  const auto columns = static_cast<int>(chains_.front().parts.size());
  const int rows = chains_.back().row + 1;
  const auto shapes = part_shapes();
  // Numbers of what is around each stitch, and of that in the mirror: [row * columns + column].
  std::array<std::vector<int>, 2> around;
  std::map<std::vector<int>, int> surroundings;
  for (int i = 0; i < 2 * rows * columns; ++i) {
    const int image = i % 2;
    std::vector<int> key;
    for (int y = -reach; y <= reach; ++y)
      for (int x = -reach; x <= reach; ++x, key.push_back(-1))
        for (std::size_t c = 0; c < chains_.size(); ++c)
          if (chains_[c].row == in_repeat(i / 2 / columns + y, rows))
            key.push_back(shapes[c][in_repeat(i / 2 % columns + (image == 1 ? -x : x), columns)][image]);
    around[image].push_back(
        surroundings.try_emplace(std::move(key), static_cast<int>(surroundings.size())).first->second);
  }
  std::map<std::array<int, 4>, std::uint32_t> numbers;
  const auto for_each_point = [&](int image, const auto& visit) {
    for (std::size_t c = 0; c < chains_.size(); ++c)
      for (int k = 0; k < columns; ++k) {
        const auto kind = [&](int x) {
          return around[image][chains_[c].row * columns + in_repeat(x, columns)];
        };
        const Part& part = chains_[c].parts[k];
        // A foot is of the stitches on both of its sides.
        visit(part.begin, std::array{shapes[c][in_repeat(k - image, columns)][image], 0, kind(k - 1 + image),
                                     kind(k - image)});
        for (std::uint32_t i = part.begin + 1; i < part.end; ++i)
          visit(i,
                std::array{shapes[c][k][image], static_cast<int>(image == 1 ? part.end - i : i - part.begin),
                           kind(k), kind(k)});
      }
  };
  kind_of_.resize(points_.size());
  for_each_point(0, [&](std::uint32_t i, const auto& key) {
    kind_of_[i] = numbers.try_emplace(key, static_cast<std::uint32_t>(numbers.size())).first->second;
  });
  images_.assign(numbers.size(), no_image);
  for_each_point(1, [&](std::uint32_t i, const auto& key) {
    if (const auto found = numbers.find(key); found != numbers.end()) images_[kind_of_[i]] = found->second;
  });
  has_kinds_ = true;
}

/// Finds the mirror of the drawing, in which column k is column axis - k. What is symmetric stays so:
/// pressed, all loops would turn to one side, one leg in front of the other.
void KnitCloth::find_mirror() {
  const auto shapes = part_shapes();
  const auto columns = static_cast<int>(chains_.front().parts.size());
  for (int axis = 0; axis < columns; ++axis) {
    const auto across = [&](int k) { return in_repeat(axis - k, columns); };
    bool is_mirror = true;
    for (const auto& chain : shapes)
      for (int k = 0; k < columns && is_mirror; ++k) is_mirror = chain[k][1] == chain[across(k)][0];
    if (!is_mirror) continue;
    for (const Chain& chain : chains_)
      for (int k = 0; k < columns; ++k)
        for (std::uint32_t i = chain.parts[k].begin; i < chain.parts[k].end; ++i) {
          const std::uint32_t image = chain.parts[across(k)].end - (i - chain.parts[k].begin);
          kind_of_.push_back(i);
          images_.push_back(image < chain.end ? image : chain.begin);
        }
    return;
  }
}

}  // namespace selvedge
