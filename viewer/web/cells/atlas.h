// Places for the cell images of all garments on a page in one picture, by shelves of equal heights.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "format/base/vec.h"
#include "viewer/cells/cell_store.h"

namespace selvedge::web {

/// Number of a tile; 0: none.
using TileNumber = std::uint32_t;

struct Tile {
  std::uint64_t image = 0;  ///< CellLook::image; 0: free
  V2i place{0, 0};          ///< texels
  V2i size{0, 0};
  std::uint64_t last_used = 0;  ///< mark
};

class Atlas {
 public:
  static constexpr int width = 2048;
  static constexpr int max_tiles = 1 << 15;

  void set_rows(int rows) { rows_ = rows; }
  int rows() const { return rows_; }
  /// The tile of an image that has a place, with a mark of at least `mark`; 0: it has none.
  TileNumber find(std::uint64_t image, std::uint64_t mark);
  /// Gives an image a place; 0: there is no room.
  TileNumber add(std::uint64_t image, const V2i& size, std::uint64_t mark);
  /// Frees the tiles of earlier marks; whether there was one.
  bool evict(std::uint64_t mark);
  /// Texels of all tiles.
  double texel_count() const { return texels_; }
  const Tile& operator[](TileNumber tile) const { return tiles_[tile]; }

 private:
  struct Span {
    int end = 0;
    TileNumber tile = 0;
  };
  struct Shelf {
    int end = 0;  ///< row
    std::vector<Span> spans;
    bool is_free() const { return spans.size() == 1 && spans.front().tile == 0; }
  };
  TileNumber place(std::uint64_t image, const V2i& size);
  TileNumber take(Shelf& shelf, int row, std::size_t span, int begin, std::uint64_t image, const V2i& size);

  int rows_ = 0;
  double texels_ = 0;
  std::vector<Shelf> shelves_;
  std::vector<Tile> tiles_{Tile{}};
  std::vector<TileNumber> free_;
  std::unordered_map<std::uint64_t, TileNumber> of_image_;
};

}  // namespace selvedge::web
