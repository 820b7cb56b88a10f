// Textures of the pictures of garments: made when a frame shows them, at the size that it can show.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "format/scene/camera.h"
#include "viewer/gl/functions.h"
#include "viewer/scene/materials.h"
#include "viewer/scene/mesh.h"

namespace selvedge {

/// How often each of Materials::pictures can be halved before a frame of `height` pixels from `camera` shows
/// it: the level of its texture that is the finest one in the frame, or halvings_of_hidden. `origin`: world,
/// m, of the mesh. Surfaces behind others, and backs, count as seen.
inline constexpr int halvings_of_hidden = 64;
std::vector<int> shown_halvings(const MergedSurfaces& mesh, const Materials& materials, const V3d& origin,
                                const Camera& camera, int height);

class PictureTextures {
 public:
  /// Textures take at most `memory` bytes (format/gltf/memory.h). The context of `gl` must be current
  /// whenever a function of this class is called, the destructor included.
  PictureTextures(const GlFunctions& gl, std::uint64_t memory) : gl_(gl), memory_(memory) {}
  ~PictureTextures();
  PictureTextures& operator=(PictureTextures&&) = delete;

  /// Leaves bytes of the memory to others; false if there are fewer.
  bool reserve_bytes(std::uint64_t bytes) {
    if (bytes > memory_) return false;
    memory_ -= bytes;
    return true;
  }

  /// Makes the textures of `pictures`, halved `halvings` times each, and sets MaterialPicture::texture:
  /// always the same texture for the same number, so that frames do not depend on earlier ones. Textures of
  /// earlier frames are kept while there is room, and two finer ones of a large picture are made with its
  /// first, for frames with two and four times the rays. A picture that cannot be decoded has no texture, and
  /// once a line in `remarks`. Throws FILE_TOO_LARGE of `file` if the frame's take more than the memory.
  void make_textures(const std::vector<int>& halvings, std::vector<MaterialPicture>& pictures,
                     const std::string& file, std::vector<std::string>& remarks);
  /// Pictures that were decoded so far, each time counted.
  std::int64_t decoded_count() const { return decoded_; }

 private:
  using Levels = std::vector<std::set<int>>;  ///< halvings of each picture
  bool fits(const Levels& levels, const std::vector<MaterialPicture>& pictures) const;

  const GlFunctions& gl_;
  std::uint64_t memory_;
  std::vector<std::map<int, GLuint>> made_;  ///< textures of each picture by its halvings
  std::int64_t decoded_ = 0;
};

}  // namespace selvedge
