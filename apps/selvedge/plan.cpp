// plan: the mip levels, the yarn and the sides of fabrics that a scene's cameras see, and the options of make
// for them.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "apps/common/shared_options.h"
#include "apps/selvedge/commands.h"
#include "format/base/mip.h"
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
  options.group("Camera, as of selvedge-view render");
  options.list(
      "--camera", command.cameras, "NAME|N",
      "A camera of the file, by name or number; may be repeated (default: all cameras of the file, or "
      "one that shows everything)");
  options.number("--distance", command.camera.distance, "METRES", "Metres from the point that is looked at");
  add_camera(options, command.camera);
  options.check([&options, &command] {
    const std::initializer_list<const char*> own{"--azimuth",      "--elevation", "--fov",
                                                 "--orthographic", "--distance",  "--distance-factor",
                                                 "--look-at"};
    options.refuse_if(!command.cameras.empty(), "has no effect with --camera", own);
    command.own_camera = std::ranges::any_of(own, [&](const char* name) { return options.given(name); });
  });
}

std::vector<Camera> cameras_of(const Scene& scene, const PlanCommand& command) {
  const std::vector<V3d> points = value_or_throw(world_points(scene));
  const double aspect = static_cast<double>(command.size.x) / command.size.y;
  std::vector<std::string> names = command.cameras;
  if (names.empty() && !command.own_camera) {
    for (std::size_t i = 0; i < scene.cameras.size(); ++i) names.push_back(std::to_string(i));
  }
  std::vector<Camera> cameras;
  for (const std::string& name : names)
    cameras.push_back(value_or_throw(camera_of(scene, name, points, aspect, command.camera)));
  if (cameras.empty()) cameras.push_back(value_or_throw(make_camera(points, aspect, command.camera)));
  return cameras;
}

/// Sizes of the pixels that show a material, in texels of its fabric's level 0, and the sides that they show.
struct Seen {
  double smallest = HUGE_VAL;
  double largest = 0;
  bool fronts = false;
  bool backs = false;
};

/// Adds the pixels of a triangle with the corners `clip` (homogeneous) and texture coordinates `at` (texels).
/// The size of a pixel grows with the depth in the triangle's plane, so that the corners of its visible part
/// bound it.
void add_triangle(const std::array<V4d, 3>& clip, const std::array<V2d, 3>& at, const V2d& pixel,
                  bool mirrored, bool culls, Seen& seen) {
  M33d corners;  // a row for each
  for (int i = 0; i < 3; ++i) {
    corners[i][0] = clip[i].x;
    corners[i][1] = clip[i].y;
    corners[i][2] = clip[i].w;
  }
  const double area = corners.determinant();
  const bool is_front = (area > 0) != mirrored;
  if (!(std::abs(area) > 0) || (culls && !is_front)) return;
  std::vector<V4d> polygon(clip.begin(), clip.end());
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
  // u / w, v / w and 1 / w are linear on the screen: each is the dot product of its row with (x, y, 1).
  const M33d inverse = corners.inverse();
  const auto row = [&](double a, double b, double c) {
    return V3d(inverse[0][0] * a + inverse[0][1] * b + inverse[0][2] * c,
               inverse[1][0] * a + inverse[1][1] * b + inverse[1][2] * c,
               inverse[2][0] * a + inverse[2][1] * b + inverse[2][2] * c);
  };
  const V3d u = row(at[0].x, at[1].x, at[2].x);
  const V3d v = row(at[0].y, at[1].y, at[2].y);
  const V3d one = row(1, 1, 1);
  for (const V4d& p : polygon) {
    if (!(p.w > 0)) continue;
    const V3d screen(p.x / p.w, p.y / p.w, 1);
    const double w = 1 / one.dot(screen);
    const auto slope = [&](const V3d& gradient, int axis) {
      return static_cast<float>((gradient[axis] - gradient.dot(screen) * w * one[axis]) * w * pixel[axis]);
    };
    const TexelSlopes slopes{{slope(u, 0), slope(v, 0)}, {slope(u, 1), slope(v, 1)}};
    const double size = pixel_size(slopes);
    seen.smallest = std::min(seen.smallest, size);
    seen.largest = std::max(seen.largest, size);
  }
  (is_front ? seen.fronts : seen.backs) = true;
}

/// Adds the pixels of all materials with a fabric; `texels` of level 0 by material. Hidden surfaces count as
/// seen.
void add_pixels(const Scene& scene, const Camera& camera, const V2d& pixel, const std::vector<V2d>& texels,
                std::vector<Seen>& seen) {
  const M44d clip = clip_matrix(camera, V3d(0, 0, 0));
  for (const SceneInstance& instance : scene.instances) {
    const ScenePrimitive& primitive = scene.primitives[instance.primitive];
    if (primitive.material < 0 || !scene.materials[primitive.material].fabric) continue;
    const SceneMaterial& material = scene.materials[primitive.material];
    const std::vector<V2d>& coordinates = primitive.tex_coords[material.fabric->tex_coord];
    if (coordinates.empty()) continue;
    for (std::size_t i = 0; i + 2 < primitive.indices.size(); i += 3) {
      std::array<V4d, 3> corners;
      std::array<V2d, 3> at;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t vertex = primitive.indices[i + k];
        const V3d world = V3d(primitive.positions[vertex]) * instance.world;
        corners[k] = V4d(world.x, world.y, world.z, 1) * clip;
        at[k] = material.fabric->transform.apply(coordinates[vertex]) * texels[primitive.material];
      }
      add_triangle(corners, at, pixel, instance.world.determinant() < 0, !material.double_sided,
                   seen[primitive.material]);
    }
  }
}

/// The report about a material: the levels that its pixels show, blended as in pictures by default.
Json material_json(const Seen& seen, const Fabric& fabric) {
  constexpr double margin = 1e-3;  // in levels, for rounding errors
  const int last = static_cast<int>(fabric.levels.size()) - 1;
  const auto level = [&](double size) {
    return std::log2(std::clamp(size, 1e-30, 1e30)) + static_cast<double>(level_bias);
  };
  const bool is_seen = seen.fronts || seen.backs;
  const int first =
      is_seen ? std::clamp(static_cast<int>(std::floor(level(seen.smallest) - margin)), 0, last) : last;
  const int coarsest =
      is_seen ? std::clamp(static_cast<int>(std::ceil(level(seen.largest) + margin)), first, last) : last;
  const float largest = largest_yarn_pixel(fabric);
  const bool yarn = is_seen && yarn_weight(static_cast<float>(seen.smallest), largest) > 0;
  // Below so many texels, files grow (spread layers have a channel for each number of a texel).
  const int fewest = yarn ? 8 : 4;
  const V2i texels(std::max(level_size(fabric.texels().x, first), std::min(fewest, fabric.texels().x)),
                   std::max(level_size(fabric.texels().y, first), std::min(fewest, fabric.texels().y)));
  const char* sides = !is_seen ? "none" : !seen.backs ? "front" : seen.fronts ? "both" : "back";
  return {{"seen", is_seen},
          {"levels", {first, coarsest}},
          {"levelsOfFabric", last + 1},
          {"pixelTexels", is_seen ? Json{seen.smallest, seen.largest} : Json()},
          {"yarn", yarn},
          {"sides", sides},
          {"make", fmt::format("--texels {}x{} --sides {} --yarns {}", texels.x, texels.y,
                               seen.backs ? "both" : "front", yarn ? "on" : "off")}};
}

Result<int> run(const PlanCommand& command) {
  const Scene scene = value_or_throw(read_scene(command.scene, command.limits, command.choice));
  std::vector<Fabric> fabrics;
  const FabricLimits limits{.memory = scene.memory_left};
  for (const SceneFabric& fabric : scene.fabrics) {
    fabrics.push_back(value_or_throw(fabric.path.empty() ? read_fabric(fabric.bytes, fabric.name, limits)
                                                         : read_fabric(fabric.path, limits)));
  }
  std::vector<V2d> texels(scene.materials.size(), V2d(1, 1));
  for (std::size_t i = 0; i < texels.size(); ++i) {
    if (const auto& fabric = scene.materials[i].fabric) texels[i] = V2d(fabrics[fabric->fabric].texels());
  }
  std::vector<Seen> seen(scene.materials.size());
  const V2d pixel = V2d(2, 2) / V2d(command.size);
  for (const Camera& camera : cameras_of(scene, command)) add_pixels(scene, camera, pixel, texels, seen);
  Json materials = Json::array();
  std::string text;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const SceneMaterial& material = scene.materials[i];
    if (!material.fabric) continue;
    Json json = {
        {"index", i}, {"name", material.name}, {"fabric", scene.fabrics[material.fabric->fabric].name}};
    json.update(material_json(seen[i], fabrics[material.fabric->fabric]));
    text += filled("#{index} {name} ({fabric}): levels {levels/0} to {levels/1} of 0 to " +
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
