// The installed library: reads fabric files and evaluates them.
// This is the only installed header; it needs the standard library alone. Link to selvedge::selvedge.
//
// Frames, units and formulas follow the specification (fabric.md, brdf.md; Daubert et al. 2001,
// section 3): directions are unit vectors in the fabric's frame that point away from the cloth, radiance is
// in 1/sr under unit perpendicular irradiance with the light's cosine included, and is not multiplied by
// opacity. Texel (i, j) is i to the right and j down; arrays are texel by texel, index j * width + i.
//
// Functions throw nothing: too little memory is FILE_TOO_LARGE where there are problems, else nothing or
// false. A FabricFile is immutable: any number of threads may use one.
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

/// A fault of a file, with a code of the specification's issues.md.
struct FabricProblem {
  std::string code;
  bool is_error = true;  ///< else a warning
  std::string file;
  std::string place;  ///< JSON pointer or part/level/channel; may be empty
  std::string message;
};

/// Radiance and opacity of a texel towards the viewer. A picture shows alpha * rgb * irradiance.
struct FabricRadiance {
  std::array<float, 3> rgb{};  ///< 1/sr
  float alpha = 0;             ///< opacity, 0 to 1
};

/// A light that a path tracer draws for a view.
struct FabricLightSample {
  std::array<float, 3> light{};   ///< unit; below the plane of the cloth where light comes through it
  float pdf = 0;                  ///< density of `light`, 1/sr; 0: nothing can be drawn, and the weight is 0
  std::array<float, 3> weight{};  ///< radiance of evaluate_at() over pdf: holds the cosine of the light
  float alpha = 0;                ///< as of evaluate_at(); not part of the weight
};

/// Properties that all levels of a fabric share.
struct FabricFacts {
  std::array<float, 2> mm_per_repeat{};  ///< size of one repeat along u and v
  float reference_height_mm = 0;         ///< of the texels' plane above the lowest point of the cloth
  float thickness_mm = 0;
  int levels = 0;
  int view_columns = 0;  ///< the equal-area grid of stored views
  int view_rows = 0;
  int light_columns = 0;  ///< the grid of stored lights; undefined without light tables and bases
  int light_rows = 0;
  float radiance_scale = 1;  ///< factor on the radiance of all texels, not included in FabricLevelData
};

/// The values of one level: every layer that a file can have. A span is empty if the level does not have the
/// layer, which then counts as 1 (brdf.md); it is valid as long as the FabricFile that returned it.
struct FabricLevelData {
  int width = 0;
  int height = 0;
  int lobes = 0;                        ///< Lafortune lobes per texel and channel, if there are parameters
  std::span<const float> parameters;    ///< texel, channel, then rho and (Cx, Cy, Cz, n) of each lobe
  std::span<const float> frames;        ///< texel, then xyz of the normal and xyz of the tangent
  std::span<const float> view_table;    ///< texel, view, rgb
  std::span<const float> opacity;       ///< texel, view
  std::span<const float> light_table;   ///< texel, light, rgb
  int products = 0;                     ///< per texel
  std::span<const int> pairs;           ///< product, then a and b: phi_a of the view times psi_b of the light
  std::span<const float> coefficients;  ///< texel, product
  /// The functions of the products, the same for all levels, without phi_0 = 1.
  std::span<const float> view_basis;   ///< a - 1, view
  std::span<const float> light_basis;  ///< b, light, rgb
};

/// One yarn: a closed chain of nodes, joined by segments; from the last node it runs on to the first of
/// the repeat that lies `turns` away (brdf.md, "Yarn"). Of several plies it is their axis.
struct FabricYarnCurve {
  int nodes = 0;                  ///< >= 2
  int stations = 0;               ///< >= 1: places, evenly spaced along it, where indirect light is known
  std::array<int, 2> turns{};     ///< repeats along x and y; both 0: a ring
  float radius_mm = 0;            ///< > 0
  std::array<float, 3> albedo{};  ///< red, green, blue of its fibres, 0 to 1
  float gloss = 0;                ///< weight, 0 to 1
  float roughness = 0;            ///< of the gloss, above 0, at most 1
  float fibre_slope = 0;          ///< tangent of the angle from axis to fibres, of a right-handed screw
  int plies = 1;                  ///< 1 to 8; 1: none
  int divisions = 1;              ///< parts of a segment, each with a node of every ply
  int shift = 0;                  ///< at the chain's end ply j runs on as ply j + shift
  float phase = 0;                ///< radians, of ply 0 at node 0
  std::array<float, 3> groove{};  ///< change of indirect light where the normal points out of the yarn
  int sides = 0;                  ///< 1: in place of cos 2a and sin 2a indirect light has the side of the ply
  float flattening = 1;           ///< thickness over width of its section where it lies level; 1: round
};

/// The yarn itself. x runs along growing u, y along falling v, z is above the cell's lowest point; a point
/// (u, v) of the reference plane lies at x = u mm_per_repeat[0], y = -v mm_per_repeat[1].
struct FabricYarns {
  std::span<const FabricYarnCurve> curves;
  std::span<const float> nodes;  ///< node, then xyz in mm; curve by curve
  /// station, function of the angle about the axis (1, cos a, sin a, cos 2a, sin 2a), function of the light
  /// (1, x, y, z, xy, xz, yz, x^2 - y^2, 3 z^2 - 1), rgb; curve by curve. f = max(0, l_z times their sum),
  /// 1/sr.
  std::span<const float> indirect;
};

struct FabricReadOptions {
  /// A file beyond these limits is refused before anything is allocated. Defaults of the
  /// specification.
  int max_texels_per_side = 4096;
  int max_directions = 4096;
  int max_lobes = 16;
  std::uint64_t max_memory = std::uint64_t{1} << 32;  ///< bytes that its levels may take
};

class SELVEDGE_PUBLIC FabricFile {
 public:
  /// Verifies all digests. Returns nothing for a bad file and sets `problem`,
  /// unless that is null.
  static std::optional<FabricFile> open(const std::string& path, FabricProblem* problem = nullptr,
                                        const FabricReadOptions& options = {});
  /// From memory, e.g. from a glTF; `name` is used in messages. The bytes are not kept.
  static std::optional<FabricFile> open(std::span<const std::byte> bytes, const std::string& name,
                                        FabricProblem* problem = nullptr,
                                        const FabricReadOptions& options = {});

  const FabricFacts& facts() const;

  /// Empty if the level does not exist.
  FabricLevelData level(int level) const;

  /// The yarn of level 0, valid as long as this FabricFile. Empty without yarn, or if level 0 was not read.
  FabricYarns yarns() const;

  /// One texel of one level. Nothing if the level was not read or does not have the texel.
  std::optional<FabricRadiance> evaluate(int level, int x, int y, const std::array<float, 3>& light,
                                         const std::array<float, 3>& view) const;

  /// Evaluates many pairs of directions: out[i] is for lights[i] and views[i]. False, with nothing written,
  /// if lengths differ or a direction is not finite, or for the reasons above.
  bool evaluate(int level, int x, int y, std::span<const std::array<float, 3>> lights,
                std::span<const std::array<float, 3>> views, std::span<FabricRadiance> out) const;

  /// At texture coordinates, which repeat, with v growing downwards. A fractional level blends the two levels
  /// next to it; level -1 is the yarn itself, if present. Levels are clamped to the file's.
  /// Nothing if one of the two was not read or a number is not finite.
  std::optional<FabricRadiance> evaluate_at(double level, double u, double v,
                                            const std::array<float, 3>& light,
                                            const std::array<float, 3>& view) const;
  bool evaluate_at(double level, double u, double v, std::span<const std::array<float, 3>> lights,
                   std::span<const std::array<float, 3>> views, std::span<FabricRadiance> out) const;

  /// Draws a light for a view, with a density close to what evaluate_at() returns. `random`: three numbers in
  /// [0, 1), or 1 by rounding. The mean weight is the integral of the radiance over all lights on both sides
  /// of the cloth. Nothing if evaluate_at() says nothing, or for other random numbers.
  std::optional<FabricLightSample> sample_at(double level, double u, double v,
                                             const std::array<float, 3>& view,
                                             const std::array<float, 3>& random) const;
  /// One for each view. It takes less time where neighbouring views are equal.
  bool sample_at(double level, double u, double v, std::span<const std::array<float, 3>> views,
                 std::span<const std::array<float, 3>> randoms, std::span<FabricLightSample> out) const;

  /// The density of sample_at(), 1/sr. Positive wherever the radiance is; its integral over the sphere is 1,
  /// or it is 0 everywhere: for view.z <= 0 and where there is only hole.
  std::optional<float> pdf_at(double level, double u, double v, const std::array<float, 3>& light,
                              const std::array<float, 3>& view) const;
  bool pdf_at(double level, double u, double v, std::span<const std::array<float, 3>> lights,
              std::span<const std::array<float, 3>> views, std::span<float> out) const;

  /// The cloth turned over, for views from behind: in the frame of the side that is seen, x and y as before
  /// and z towards the viewer. The same where the file has no side `back`. Nothing if no level was read, or
  /// without memory.
  std::optional<FabricFile> turned_over() const;

 private:
  struct State;
  explicit FabricFile(std::shared_ptr<const State> state);
  std::shared_ptr<const State> state_;
};

/// The rules of the specification that the file breaks; empty for a valid file.
SELVEDGE_PUBLIC std::vector<FabricProblem> check_fabric_file(const std::string& path);

}  // namespace selvedge
