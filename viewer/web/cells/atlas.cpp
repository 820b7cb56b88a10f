#include "viewer/web/cells/atlas.h"

#include <algorithm>

namespace selvedge::web {
namespace {

/// Heights of shelves are multiples.
constexpr int shelf_step = 8;

}  // namespace

TileNumber Atlas::find(std::uint64_t image, std::uint64_t mark) {
  const auto found = of_image_.find(image);
  if (found == of_image_.end()) return 0;
  tiles_[found->second].last_used = std::max(tiles_[found->second].last_used, mark);
  return found->second;
}

TileNumber Atlas::add(std::uint64_t image, const V2i& size, std::uint64_t mark) {
  if (std::max(size.x, size.y) > width || size.y > rows_) return 0;
  const TileNumber tile = place(image, size);
  if (tile == 0) return 0;
  tiles_[tile].last_used = mark;
  texels_ += static_cast<double>(size.x) * size.y;
  return tile;
}

/// Puts a tile at the left of a free span.
TileNumber Atlas::take(Shelf& shelf, int row, std::size_t span, int begin, std::uint64_t image,
                       const V2i& size) {
  TileNumber tile = 0;
  if (free_.empty()) {
    if (tiles_.size() == max_tiles) return 0;
    tile = static_cast<TileNumber>(tiles_.size());
    tiles_.emplace_back();
  } else {
    tile = free_.back();
    free_.pop_back();
  }
  tiles_[tile] = {image, {begin, row}, size, 0};
  of_image_[image] = tile;
  if (begin + size.x < shelf.spans[span].end)
    shelf.spans.insert(shelf.spans.begin() + static_cast<std::ptrdiff_t>(span), Span{begin + size.x, tile});
  else
    shelf.spans[span].tile = tile;
  return tile;
}

TileNumber Atlas::place(std::uint64_t image, const V2i& size) {
  const int height = (size.y + shelf_step - 1) / shelf_step * shelf_step;
  const auto place_in = [&](int least, int most) -> TileNumber {
    int row = 0;
    for (Shelf& shelf : shelves_) {
      const int first = row;
      row = shelf.end;
      if (shelf.is_free() || shelf.end - first < least || shelf.end - first > most) continue;
      int begin = 0;
      for (std::size_t i = 0; i < shelf.spans.size(); ++i) {
        const Span span = shelf.spans[i];
        if (span.tile == 0 && span.end - begin >= size.x) return take(shelf, first, i, begin, image, size);
        begin = span.end;
      }
    }
    return 0;
  };
  if (const TileNumber tile = place_in(height, height); tile != 0) return tile;
  // A new shelf, of the first free rows.
  int row = 0;
  for (std::size_t i = 0; i < shelves_.size(); ++i) {
    const int first = row;
    row = shelves_[i].end;
    if (!shelves_[i].is_free() || shelves_[i].end - first < height) continue;
    if (shelves_[i].end - first > height)
      shelves_.insert(shelves_.begin() + static_cast<std::ptrdiff_t>(i),
                      Shelf{first + height, {Span{width, 0}}});
    return take(shelves_[i], first, 0, 0, image, size);
  }
  if (row + height > rows_) return place_in(height + 1, rows_);
  shelves_.push_back({row + height, {Span{width, 0}}});
  return take(shelves_.back(), row, 0, 0, image, size);
}

bool Atlas::evict(std::uint64_t mark) {
  bool any = false;
  for (Shelf& shelf : shelves_) {
    for (Span& span : shelf.spans) {
      if (span.tile == 0 || tiles_[span.tile].last_used >= mark) continue;
      texels_ -= static_cast<double>(tiles_[span.tile].size.x) * tiles_[span.tile].size.y;
      of_image_.erase(tiles_[span.tile].image);
      tiles_[span.tile] = {};
      free_.push_back(span.tile);
      span.tile = 0;
      any = true;
    }
    for (std::size_t i = shelf.spans.size(); i-- > 1;)
      if (shelf.spans[i].tile == 0 && shelf.spans[i - 1].tile == 0)
        shelf.spans.erase(shelf.spans.begin() + static_cast<std::ptrdiff_t>(i) - 1);
  }
  for (std::size_t i = shelves_.size(); i-- > 1;)
    if (shelves_[i].is_free() && shelves_[i - 1].is_free())
      shelves_.erase(shelves_.begin() + static_cast<std::ptrdiff_t>(i) - 1);
  return any;
}

}  // namespace selvedge::web
