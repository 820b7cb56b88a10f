#include "converter/stitch/hairs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "converter/stitch/fibres.h"
#include "format/base/random.h"

namespace selvedge {
namespace {

using std::numbers::pi;

constexpr std::uint64_t stream_hairs = 31;
constexpr int pieces = Hairs::points_each - 1;

/// The triangles of one yarn, and the area of all up to each.
struct YarnSurfaceArea {
  std::vector<int> triangles;
  std::vector<double> up_to;
};

/// Where a hair begins, with unit vectors out of the yarn, along the fibres and across both.
struct Root {
  V3d position{0, 0, 0};
  V3d normal, along, across;
  int triangle = 0;
};

std::vector<YarnSurfaceArea> areas_of(const CellMesh& mesh, std::size_t yarns) {
  std::vector<YarnSurfaceArea> areas(yarns);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const V3i& corner = mesh.triangles[t];
    YarnSurfaceArea& area = areas[mesh.places[corner.x].skin];
    const V3d a(mesh.positions[corner.x]);
    const double size =
        0.5 * (V3d(mesh.positions[corner.y]) - a).cross(V3d(mesh.positions[corner.z]) - a).length();
    area.triangles.push_back(static_cast<int>(t));
    area.up_to.push_back((area.up_to.empty() ? 0 : area.up_to.back()) + size);
  }
  return areas;
}

Root root_of(const CellMesh& mesh, const YarnSurfaceArea& area, Random& random) {
  const auto at =
      std::upper_bound(area.up_to.begin(), area.up_to.end(), random.uniform() * area.up_to.back());
  const auto index = std::min<std::ptrdiff_t>(at - area.up_to.begin(), std::ssize(area.up_to) - 1);
  Root root;
  root.triangle = area.triangles[index];
  const V3i& corner = mesh.triangles[root.triangle];
  const double side = std::sqrt(random.uniform());
  const double share = random.uniform();
  const V3d weight(1 - side, side * (1 - share), side * share);
  V3d normal(0, 0, 0);
  for (int k = 0; k < 3; ++k) {
    root.position += V3d(mesh.positions[corner[k]]) * weight[k];
    normal += V3d(mesh.normals[corner[k]]) * weight[k];
  }
  root.normal = normal.length() > 0 ? normal.normalized() : V3d(mesh.normals[corner.x]);
  V3d along = mesh.fibres.empty() ? V3d(1, 0, 0) : V3d(mesh.fibres[corner.x]);
  if (std::abs(along.dot(root.normal)) > 0.9) along = V3d(0, 0, 1).cross(root.normal);
  root.along = (along - root.normal * along.dot(root.normal)).normalized();
  root.across = root.normal.cross(root.along);
  return root;
}

/// A free end: it leaves at a slant and bends.
void grow_end(const Root& root, double length, Random& random, std::vector<V3f>& points) {
  const double slant = (15 + 55 * random.uniform()) * pi / 180;  // from the normal
  // Mostly along the fibres, either way.
  const double spread = random.uniform() + random.uniform() - 1;
  const double azimuth = 0.5 * pi * spread + (random.uniform() < 0.5 ? pi : 0);
  const V3d out = root.along * std::cos(azimuth) + root.across * std::sin(azimuth);
  V3d direction = root.normal * std::cos(slant) + out * std::sin(slant);
  V3d bend = direction.cross(V3d(random.uniform(), random.uniform(), random.uniform()) - V3d(0.5));
  bend = bend.length() > 0 ? bend.normalized() : root.across;
  const double turn = (0.3 + 1.5 * random.uniform()) / pieces;
  V3d at = root.position;
  points.emplace_back(at);
  for (int k = 0; k < pieces; ++k) {
    direction = (direction + bend * turn).normalized();
    bend = (bend - direction * bend.dot(direction)).normalized();
    at += direction * (length / pieces);
    points.emplace_back(at);
  }
}

/// A bow with both ends on the surface.
void grow_loop(const Root& root, double length, Random& random, std::vector<V3f>& points) {
  const double lean = (random.uniform() - 0.5) * pi / 2;
  const V3d up = root.normal * std::cos(lean) + root.across * std::sin(lean);
  // Half an ellipse of this width and height is about as long as the hair.
  const double width = length * (0.3 + 0.2 * random.uniform());
  const double height = 0.5 * std::sqrt(length * length - width * width) * 0.8;
  for (int k = 0; k <= pieces; ++k) {
    const double angle = pi * k / pieces;
    points.emplace_back(root.position + root.along * (0.5 * width * (1 - std::cos(angle))) +
                        up * (height * std::sin(angle)));
  }
}

}  // namespace

Result<Hairs> grow_hairs(const StitchPattern& pattern, const CellMesh& mesh) {
  Hairs hairs;
  const auto areas = areas_of(mesh, pattern.yarns.size());
  // The mean of what is left of an exponential distribution.
  const double mean = 1 - max_hair / std::expm1(max_hair);
  for (std::size_t y = 0; y < pattern.yarns.size(); ++y) {
    const Yarn& yarn = pattern.yarns[y];
    if (yarn.hairiness == 0 || areas[y].triangles.empty()) continue;
    const YarnKind fibre = fibre_of(yarn.fibre);
    const double passed = forward_share(fibre.refraction);
    double length = 0;
    for (const BezierSegment& segment : yarn.segments) length += polygon_length(segment);
    const double expected = yarn.hairiness * length / (mean * yarn.hair_mm);
    if (expected + static_cast<double>(hairs.roots.size()) > max_hairs) {
      return fail(Code::mesh_invalid, pattern.name, fmt::format("/yarns/{}/hairiness", y),
                  fmt::format("the repeat would have more than {} hairs", max_hairs));
    }
    const std::uint64_t seed = mix(pattern.seed ^ mix(stream_hairs));
    const auto count = static_cast<std::uint64_t>(expected + Random(seed, y).uniform());
    for (std::uint64_t h = 0; h < count; ++h) {
      Random random(seed, y, h + 1);
      const double hair = -yarn.hair_mm * std::log1p(random.uniform() * std::expm1(-max_hair));
      const Root root = root_of(mesh, areas[y], random);
      hairs.roots.push_back(root.triangle);
      hairs.radius.push_back(static_cast<float>(0.5e-3 * fibre.diameter_um));
      hairs.passed.push_back(static_cast<float>(passed));
      const bool loop = random.uniform() < yarn.hair_loops;
      (loop ? grow_loop : grow_end)(root, hair, random, hairs.points);
    }
  }
  return hairs;
}

}  // namespace selvedge
