// Selvedge for other programs: read a fabric file, evaluate it, pack it for a graphics card.
// The only header that is installed; it needs the standard library alone. Link to selvedge::selvedge.
//
// Frames, units and formulas are those of the specification (fabric.md, brdf.md; Daubert et al. 2001,
// section 3): directions are unit vectors in the fabric's frame that point away from the cloth, radiance is
// in 1/sr under unit perpendicular irradiance with the light's cosine included, and is not multiplied by
// opacity. Texel (i, j) is i to the right and j down; arrays are texel by texel, index j * width + i.
//
// Nothing throws but std::bad_alloc. A FabricFile does not change after it was read: any number of threads
// may use one.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#if defined(__GNUC__)
#define SELVEDGE_PUBLIC __attribute__((visibility("default")))
#else
#define SELVEDGE_PUBLIC
#endif

namespace selvedge {

/// What is wrong with a file: one of the codes of the specification's issues.md and where.
struct FabricProblem {
  std::string code;
  bool is_error = true;  ///< else a warning
  std::string file;
  std::string place;  ///< JSON pointer or part/level/channel; may be empty
  std::string message;
};

/// What a texel sends towards the viewer. A picture shows alpha * rgb * irradiance.
struct FabricRadiance {
  std::array<float, 3> rgb{};  ///< 1/sr
  float alpha = 0;             ///< opacity, 0 to 1
};

/// The whole of a fabric, whatever its levels hold.
struct FabricFacts {
  std::array<float, 2> mm_per_repeat{};  ///< size of one repeat along u and v
  float reference_height_mm = 0;         ///< of the texels' plane above the lowest point of the cloth
  float thickness_mm = 0;
  int levels = 0;
  int view_columns = 0;  ///< the equal-area grid of stored views
  int view_rows = 0;
  int light_columns = 0;  ///< that of stored lights; without light tables and bases it says nothing
  int light_rows = 0;
  float radiance_scale = 1;  ///< factor on the radiance of all texels; the numbers of a level are without it
  /// Of a file that has some levels of a fabric only: texels of the whole fabric's level 0, which of its
  /// levels is the file's level 0, and the number of its levels, 0 where it is not known.
  std::array<int, 2> whole_texels{};
  int whole_level = 0;
  int whole_levels = 0;
};

/// The numbers of one level: every layer that a file can have. A span is empty where the level has no such
/// layer, which then counts as 1 (brdf.md); it lives as long as the FabricFile it came from.
struct FabricLevelData {
  int width = 0;
  int height = 0;
  int lobes = 0;  ///< Lafortune lobes per texel and channel; says nothing without parameters
  std::span<const float> parameters;   ///< texel, channel, then rho and (Cx, Cy, Cz, n) of each lobe
  std::span<const float> frames;       ///< texel, then xyz of the normal and xyz of the tangent
  std::span<const float> view_table;   ///< texel, view, rgb
  std::span<const float> opacity;      ///< texel, view
  std::span<const float> light_table;  ///< texel, light, rgb
  int columns = 1;                     ///< cells of a texel that has heights, side by side
  int rows = 1;
  int slabs = 1;                        ///< of yarn, one above the other in each cell
  std::span<const float> heights;       ///< texel, entry (slab, row, column), then top and bottom in mm
  int products = 0;                     ///< their number
  int entries = 1;                      ///< of a texel's products: those of its heights, or one
  std::span<const int> pairs;           ///< product, then a and b: phi_a of the view times psi_b of the light
  std::span<const float> coefficients;  ///< texel, entry, product
  /// The functions of the products, the same for all levels. phi_0 = 1 is not stored.
  std::span<const float> view_basis;   ///< a - 1, view
  std::span<const float> light_basis;  ///< b, light, rgb
};

struct FabricReadOptions {
  int first_level = 0;
  int last_level = 1000;  ///< levels outside of first to last are not read, and cost nothing
  /// A file beyond these is refused before anything is allocated; they are those of the specification.
  int max_texels_per_side = 4096;
  int max_directions = 4096;
  int max_lobes = 16;
};

class SELVEDGE_PUBLIC FabricFile {
 public:
  /// Verifies the digests of what it reads. Nothing comes back from a bad file; `problem`, where given, then
  /// says why.
  static std::optional<FabricFile> open(const std::string& path, FabricProblem* problem = nullptr,
                                        const FabricReadOptions& options = {});
  /// From memory, a file embedded in a glTF for one; `name` is used in messages. The bytes are not kept.
  static std::optional<FabricFile> open(std::span<const std::byte> bytes, const std::string& name,
                                        FabricProblem* problem = nullptr,
                                        const FabricReadOptions& options = {});

  const FabricFacts& facts() const;

  /// Whether the level exists and was read.
  bool has_level(int level) const;

  /// Empty where has_level() is false.
  FabricLevelData level(int level) const;

  /// One texel of one level. Nothing where the level was not read or the texel lies outside of it.
  std::optional<FabricRadiance> evaluate(int level, int x, int y, const std::array<float, 3>& light,
                                         const std::array<float, 3>& view) const;

  /// The same for many pairs of directions: out[i] is of lights[i] and views[i]. Whether all was evaluated;
  /// if not, because lengths differ or for the reasons above, nothing is written.
  bool evaluate(int level, int x, int y, std::span<const std::array<float, 3>> lights,
                std::span<const std::array<float, 3>> views, std::span<FabricRadiance> out) const;

  /// At texture coordinates, which repeat, with v growing downwards. A fractional level blends its two
  /// neighbours; levels are clamped to those of the fabric. Nothing where one of the two was not read or a
  /// number is not finite.
  std::optional<FabricRadiance> evaluate_at(double level, double u, double v,
                                            const std::array<float, 3>& light,
                                            const std::array<float, 3>& view) const;
  bool evaluate_at(double level, double u, double v, std::span<const std::array<float, 3>> lights,
                   std::span<const std::array<float, 3>> views, std::span<FabricRadiance> out) const;

  /// The levels that were read, packed for a graphics card: the words that selvedge-view's own shader reads,
  /// as word_layout.glsl describes them, which is installed beside this header. Empty where no level was
  /// read.
  std::vector<std::uint32_t> gpu_words() const;

 private:
  struct State;
  explicit FabricFile(std::shared_ptr<const State> state);
  std::shared_ptr<const State> state_;
};

/// Every rule of the specification that the file breaks; empty for a good file.
SELVEDGE_PUBLIC std::vector<FabricProblem> check_fabric_file(const std::string& path);

}  // namespace selvedge
