// The memory that a document takes, reckoned from what it declares before anything of that size is allocated.
// A file of some kilobytes may declare terabytes: pictures of one colour, many instances of a large mesh,
// primitives that share their vertices. No single one of them is too large; together they are.
#pragma once

#include <cstdint>

#include "format/base/error.h"
#include "format/scene/scene.h"

namespace selvedge {

/// Bytes that one of these takes at most, reading and drawing.
namespace memory_price {
inline constexpr std::uint64_t json_value = 128;       ///< in the parsed text, beside the text itself
inline constexpr std::uint64_t vertex = 160;           ///< of a primitive, with what reading it takes
inline constexpr std::uint64_t index = 12;             ///< of a primitive
inline constexpr std::uint64_t instance = 320;         ///< of a primitive, without its vertices
inline constexpr std::uint64_t placed_vertex = 256;    ///< of an instance: surface, merged mesh, projection
inline constexpr std::uint64_t placed_triangle = 128;  ///< of an instance: corners and lists
inline constexpr std::uint64_t pixel = 16;             ///< of a decoded picture, and once more of the largest
}  // namespace memory_price

/// Sums prices up to a limit.
class MemoryAccount {
 public:
  explicit MemoryAccount(std::uint64_t limit) : left_(limit) {}

  /// Takes `count` times `price`; false, with nothing left from then on, if that is more than there is.
  bool take(std::uint64_t count, std::uint64_t price) {
    const bool enough = price == 0 || count <= left_ / price;
    left_ = enough ? left_ - count * price : 0;
    return enough;
  }
  std::uint64_t left() const { return left_; }

 private:
  std::uint64_t left_;
};

/// FILE_TOO_LARGE of `place`: `what` of it do not fit into the memory that is allowed.
Error beyond_memory(const std::string& file, const std::string& place, const std::string& what,
                    std::uint64_t limit);

/// FILE_TOO_LARGE if a scene and its pictures, as drawing decodes them, take more than `limit` bytes.
/// Pictures are reckoned by the sizes in their headers (picture_size).
Result<void> check_drawable(const Scene& scene, std::uint64_t limit);

}  // namespace selvedge
