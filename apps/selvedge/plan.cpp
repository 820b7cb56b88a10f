// plan: the mip levels, the yarn and the sides of fabrics that a scene's cameras see, and the options of make
// for them.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "apps/common/shared_options.h"
#include "apps/selvedge/commands.h"
#include "format/base/mip.h"
#include "format/cells/cell_texels.h"
#include "format/fabric/evaluate.h"
#include "format/fabric/file.h"
#include "format/fabric/footprint.h"

namespace selvedge {
namespace {

using Imath::M33d;
using Imath::V4d;

struct PlanCommand {
  CommonOptions common;
  std::string scene;
  SceneChoice choice;
  SceneLimits limits;
  std::vector<std::string>
      cameras;  ///< of the file, by name or number; empty: all, or `camera` if the file has none
  CameraOptions camera;
  bool own_camera = false;  ///< options of a camera are given: `camera` alone
  V2i size{800, 600};       ///< of the frame, pixels
};

void declare(Options& options, PlanCommand& command) {
  options.text("scene", command.scene, "FILE", "A dressed glTF file (.gltf .glb)").required().reads();
  options.size("--size", command.size, "Size of the frame in pixels", 1, 1 << 20);
  add_scene_choice(options, command.choice);
  add_limits(options, command.limits);
  options.begin_group("Camera, as of selvedge-view render");
  options.list(
      "--camera", command.cameras, "NAME|N",
      "A camera of the file, by name or number; may be repeated (default: all cameras of the file, or "
      "one that shows everything)");
  add_camera(options, command.camera);
  options.add_check([&options, &command] {
    const std::initializer_list<const char*> own{"--azimuth",      "--elevation", "--fov",
                                                 "--orthographic", "--distance",  "--look-at"};
    options.refuse_if(!command.cameras.empty(), "has no effect with --camera", own);
    command.own_camera = std::ranges::any_of(own, [&](const char* name) { return options.is_given(name); });
  });
}

std::vector<Camera> cameras_of(const Scene& scene, const PlanCommand& command) {
  const std::vector<V3d> points = value_or_throw(world_points(scene));
  const double aspect = static_cast<double>(command.size.x) / command.size.y;
  std::vector<std::string> names = command.cameras;
  if (names.empty() && !command.own_camera)
    for (std::size_t i = 0; i < scene.cameras.size(); ++i) names.push_back(std::to_string(i));
  std::vector<Camera> cameras;
  for (const std::string& name : names)
    cameras.push_back(value_or_throw(find_scene_camera(scene, name, points, aspect, command.camera)));
  if (cameras.empty()) cameras.push_back(value_or_throw(make_camera(points, aspect, command.camera)));
  return cameras;
}

/// A side of the square in which hidden pixels are found, whatever the frame's pixels.
constexpr int fine = 1024;

/// Sizes of the pixels that show a material, in texels of its fabric's level 0; and how many show its front
/// and its back in the frames, and from all around before and behind what hides them.
struct Seen {
  double smallest = HUGE_VAL;
  double largest = 0;
  std::array<double, 2> in_frames{}, around{}, behind{};
};

/// A triangle with the corners `clip` (homogeneous) on the screen. What is linear in space is, over w, linear
/// on the screen: the dot product of its row with (x, y, 1).
class ScreenTriangle {
 public:
  ScreenTriangle(const std::array<V4d, 3>& clip, bool mirrored) : polygon(clip.begin(), clip.end()) {
    const M33d corners(clip[0].x, clip[0].y, clip[0].w, clip[1].x, clip[1].y, clip[1].w, clip[2].x, clip[2].y,
                       clip[2].w);
    const double area = corners.determinant();
    is_front = (area > 0) != mirrored;
    if (!(std::abs(area) > 0)) polygon.clear();
    for (int side = 0; side < 6 && !polygon.empty(); ++side) {
      const auto inside = [side](const V4d& p) { return p.w + (side % 2 == 0 ? p[side / 2] : -p[side / 2]); };
      std::vector<V4d> rest;
      for (std::size_t i = 0; i < polygon.size(); ++i) {
        const V4d& a = polygon[i];
        const V4d& b = polygon[(i + 1) % polygon.size()];
        const double da = inside(a);
        const double db = inside(b);
        if (da >= 0) rest.push_back(a);
        if ((da >= 0) != (db >= 0)) rest.push_back(a + (b - a) * (da / (da - db)));
      }
      polygon = std::move(rest);
    }
    if (polygon.empty()) return;
    to_rows_ = corners.inverse().transposed();
    depth_ = row({clip[0].z, clip[1].z, clip[2].z});
  }

  V3d row(const V3d& of_corners) const { return of_corners * to_rows_; }

  /// Calls body(pixel, depth) where the middle of a pixel lies in the triangle.
  template <class Body>
  void each_pixel(const Body& body) const {
    Imath::Box2d box;
    for (const V4d& p : polygon) box.extendBy((V2d(p.x, p.y) / p.w + V2d(1)) * (fine / 2.0));
    const std::array rows{row({1, 0, 0}), row({0, 1, 0}), row({0, 0, 1})};
    for (int y = std::max(0, static_cast<int>(box.min.y)); y < std::min<double>(fine, box.max.y); ++y) {
      for (int x = std::max(0, static_cast<int>(box.min.x)); x < std::min<double>(fine, box.max.x); ++x) {
        const V3d middle((2 * x + 1.0) / fine - 1, (2 * y + 1.0) / fine - 1, 1);
        if (std::ranges::all_of(rows, [&](const V3d& corner) { return corner.dot(middle) >= 0; }))
          body(static_cast<std::size_t>(y) * fine + x, depth_.dot(middle));
      }
    }
  }

  std::vector<V4d> polygon;  ///< its part in the frame
  bool is_front = false;

 private:
  M33d to_rows_;
  V3d depth_;
};

/// Adds the sizes of the pixels of a triangle with the texture coordinates `at` (texels). The size of a pixel
/// grows with the depth in the triangle's plane, so that the corners of its visible part bound it.
void add_sizes(const ScreenTriangle& triangle, const std::array<V2d, 3>& at, const V2d& pixel, Seen& seen) {
  const V3d u = triangle.row({at[0].x, at[1].x, at[2].x});
  const V3d v = triangle.row({at[0].y, at[1].y, at[2].y});
  const V3d one = triangle.row({1, 1, 1});
  for (const V4d& p : triangle.polygon) {
    if (!(p.w > 0)) continue;
    const V3d screen(p.x / p.w, p.y / p.w, 1);
    const double w = 1 / one.dot(screen);
    const auto slope = [&](const V3d& gradient, int axis) {
      return static_cast<float>((gradient[axis] - gradient.dot(screen) * w * one[axis]) * w * pixel[axis]);
    };
    const TexelDerivatives slopes{{slope(u, 0), slope(v, 0)}, {slope(u, 1), slope(v, 1)}};
    const double size = pixel_width_texels(slopes);
    seen.smallest = std::min(seen.smallest, size);
    seen.largest = std::max(seen.largest, size);
  }
}

/// Calls body(instance, first of its indices, triangle) for the triangles in the frame.
template <class Body>
void each_triangle(const Scene& scene, const Camera& camera, const Body& body) {
  const M44d clip = clip_matrix(camera, V3d(0, 0, 0));
  for (const SceneInstance& instance : scene.instances) {
    const ScenePrimitive& primitive = scene.primitives[instance.primitive];
    if (primitive.material < 0) continue;
    for (std::size_t i = 0; i + 2 < primitive.indices.size(); i += 3) {
      std::array<V4d, 3> corners;
      for (std::size_t k = 0; k < 3; ++k) {
        const V3d world = V3d(primitive.positions[primitive.indices[i + k]]) * instance.world;
        corners[k] = V4d(world.x, world.y, world.z, 1) * clip;
      }
      const ScreenTriangle triangle(corners, instance.world.determinant() < 0);
      if (!triangle.polygon.empty() &&
          (triangle.is_front || scene.materials[primitive.material].double_sided))
        body(primitive, i, triangle);
    }
  }
}

/// Adds the pixels of all materials with a fabric, in a frame with `texels` of level 0 by material, or around
/// the scene. Materials that hide do so where a ray through the middle of a pixel meets them.
void add_pixels(const Scene& scene, const Camera& camera, const std::vector<bool>& hides,
                const std::vector<V2d>* texels, const V2d& pixel, std::vector<Seen>& seen) {
  std::vector<double> nearest(std::size_t{fine} * fine, HUGE_VAL);
  each_triangle(
      scene, camera, [&](const ScenePrimitive& primitive, std::size_t, const ScreenTriangle& shown) {
        if (!hides[primitive.material]) return;
        shown.each_pixel([&](std::size_t i, double depth) { nearest[i] = std::min(nearest[i], depth); });
      });
  each_triangle(
      scene, camera, [&](const ScenePrimitive& primitive, std::size_t first, const ScreenTriangle& shown) {
        const std::optional<FabricReference>& fabric = scene.materials[primitive.material].fabric;
        if (!fabric || primitive.tex_coords[fabric->tex_coord].empty()) return;
        Seen& material = seen[primitive.material];
        const int side = shown.is_front ? 0 : 1;
        double open = 0;
        double hidden = 0;
        shown.each_pixel(
            [&](std::size_t i, double depth) { ++(depth - 1e-12 <= nearest[i] ? open : hidden); });
        (texels != nullptr ? material.in_frames : material.around)[side] += open;
        material.behind[side] += texels != nullptr ? 0 : hidden;
        if (open == 0 || texels == nullptr) return;
        std::array<V2d, 3> at;
        for (std::size_t k = 0; k < 3; ++k)
          at[k] =
              fabric->transform.apply(primitive.tex_coords[fabric->tex_coord][primitive.indices[first + k]]) *
              (*texels)[primitive.material];
        add_sizes(shown, at, pixel, material);
      });
}

/// Whether a material hides what lies behind: without holes, or as cloth with few that no frame shows one
/// by one.
bool hides(const SceneMaterial& material, const Seen& seen, const std::vector<Fabric>& fabrics) {
  if (material.alpha_mode == AlphaMode::opaque || !material.fabric ||
      material.garment_textures.mask.image >= 0)
    return material.alpha_mode == AlphaMode::opaque;
  const Fabric& fabric = fabrics[material.fabric->fabric];
  const int last = static_cast<int>(fabric.levels.size()) - 1;
  const V2f texels(fabric.texels());
  return evaluate(fabric, last, 0, 0, V3f(0, 0, 1), V3f(0, 0, 1)).alpha > 0.9F &&
         seen.smallest > 0.3 * static_cast<double>(std::sqrt(texels.x * texels.y));
}

/// The report about a material: the levels that its pixels show, blended as in pictures by default.
Json material_json(const Seen& seen, double frames, const Fabric& fabric) {
  constexpr double margin = 1e-3;  // in levels, for rounding errors
  const int last = static_cast<int>(fabric.levels.size()) - 1;
  const auto level = [&](double size) {
    return std::log2(std::clamp(size, 1e-30, 1e30)) + static_cast<double>(level_bias);
  };
  const bool is_seen = seen.largest > 0;
  // Less than a thousandth of the frames is hidden as well; and light comes through where the other side lies
  // open.
  const auto shows = [&](int side) {
    return seen.in_frames[side] > std::min(seen.in_frames[1 - side], 1e-3 * frames * fine * fine);
  };
  const bool backs = is_seen && shows(1);
  const bool fronts = is_seen && (!backs || shows(0));
  const int other = fronts ? 1 : 0;
  const bool through = is_seen && seen.around[other] > seen.behind[other];
  const int first =
      is_seen ? std::clamp(static_cast<int>(std::floor(level(seen.smallest) - margin)), 0, last) : last;
  const int coarsest =
      is_seen ? std::clamp(static_cast<int>(std::ceil(level(seen.largest) + margin)), first, last) : last;
  const bool yarn =
      is_seen && yarn_weight(static_cast<float>(seen.smallest), max_yarn_pixel_texels(fabric)) > 0;
  // Below this, files grow (spread layers have a channel for each number of a texel).
  const int fewest = yarn ? 8 : 4;
  const V2i texels(std::max(level_size(fabric.texels().x, first), std::min(fewest, fabric.texels().x)),
                   std::max(level_size(fabric.texels().y, first), std::min(fewest, fabric.texels().y)));
  const char* sides = !is_seen ? "none" : !backs ? "front" : fronts ? "both" : "back";
  return {{"seen", is_seen},
          {"levels", {first, coarsest}},
          {"levelsOfFabric", last + 1},
          {"pixelTexels", is_seen ? Json{seen.smallest, seen.largest} : Json()},
          {"yarn", yarn},
          {"sides", sides},
          {"through", through},
          {"make", fmt::format("--texels {}x{} --sides {} --yarns {}", texels.x, texels.y,
                               backs || through ? "both" : "front", yarn ? "on" : "off")}};
}

Result<int> run(const PlanCommand& command) {
  const Scene scene = value_or_throw(read_scene(command.scene, command.limits, command.choice));
  std::vector<Fabric> fabrics;
  const FabricLimits limits{.memory = scene.memory_left};
  for (const SceneFabric& fabric : scene.fabrics)
    fabrics.push_back(
        arranged(value_or_throw(fabric.path.empty() ? read_fabric(fabric.bytes, fabric.name, limits)
                                                    : read_fabric(fabric.path, limits))));
  std::vector<V2d> texels(scene.materials.size(), V2d(1, 1));
  for (std::size_t i = 0; i < texels.size(); ++i)
    if (const auto& fabric = scene.materials[i].fabric) texels[i] = V2d(fabrics[fabric->fabric].texels());
  std::vector<Seen> seen(scene.materials.size());
  const std::vector<Camera> cameras = cameras_of(scene, command);
  std::vector<bool> hiding(seen.size());
  // The first pass finds where pixels are so fine that holes are seen, and what lies behind them.
  for (int pass = 0; pass < 2; ++pass) {
    for (std::size_t i = 0; i < seen.size(); ++i) hiding[i] = hides(scene.materials[i], seen[i], fabrics);
    seen.assign(seen.size(), {});
    for (const Camera& camera : cameras)
      add_pixels(scene, camera, hiding, &texels, V2d(2, 2) / V2d(command.size), seen);
  }
  const std::vector<V3d> points = value_or_throw(world_points(scene));
  for (const V2d& way : {V2d(0, 20), V2d(90, 20), V2d(180, 20), V2d(270, 20), V2d(0, -90), V2d(0, 90)}) {
    CameraOptions around{.azimuth = way.x, .elevation = way.y, .look_at = {}, .distance = {}};
    around.projection = Projection::parallel;
    add_pixels(scene, value_or_throw(make_camera(points, 1, around)), hiding, nullptr, {}, seen);
  }
  Json materials = Json::array();
  std::string text;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const SceneMaterial& material = scene.materials[i];
    if (!material.fabric) continue;
    Json json = {
        {"index", i}, {"name", material.name}, {"fabric", scene.fabrics[material.fabric->fabric].name}};
    json.update(
        material_json(seen[i], static_cast<double>(cameras.size()), fabrics[material.fabric->fabric]));
    text += fill_pattern("#{index} {name} ({fabric}): levels {levels/0} to {levels/1} of 0 to " +
                             std::to_string(json["levelsOfFabric"].get<int>() - 1) +
                             ", yarn {yarn}, sides seen: {sides}\n    selvedge make STITCH {make}\n",
                         json);
    materials.push_back(std::move(json));
  }
  if (materials.empty())
    return fail(Code::material_missing, command.scene, "/materials", "no material has a fabric");
  report(command.common, "plan", {{"scene", command.scene}, {"size", command.size}, {"materials", materials}},
         text);
  return 0;
}

}  // namespace

void add_plan_verb(Program& program) {
  program.add<PlanCommand>({"plan", "Levels, yarn and sides of its fabrics that a scene's cameras see",
                            "selvedge plan dressed.glb --distance 2 --fov 45 --size 1920x1080"},
                           declare, run);
}

}  // namespace selvedge
