// Where the time of a bake goes, and how near it comes to what the ray tracer alone could do: CPU seconds by
// stage, rays by kind, and the rate at which the tracer takes rays of the same kind when nothing else is
// done. All in one run, in CPU seconds: ratios hold on a machine that is shared with others.
//
//   selvedge-bake-rates [STITCH [TEXELS VIEWS LIGHTS]]
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "converter/bake/bake.h"
#include "converter/bake/setup.h"
#include "converter/bake/texels.h"
#include "converter/light/sobol.h"
#include "converter/stitch/find_cell.h"
#include "tests/bench/bare_rays.h"
#include "tests/bench/rows.h"
#include "tests/converter/load_cell.h"

namespace {

using namespace selvedge;
using bench::cpu_seconds;
using bench::need;

struct Stage {
  const char* name;
  double seconds;
};

struct Kind {
  const char* name;
  double rays;
  bool shadow;
  std::vector<BareRays> packets = {};
};

double wrap(double x, double period) { return x - period * std::floor(x / period); }

void set_lane(BareRays& rays, std::size_t i, const V3d& origin, const V3d& direction, const V2d& period) {
  rays.x[i] = static_cast<float>(wrap(origin.x, period.x));
  rays.y[i] = static_cast<float>(wrap(origin.y, period.y));
  rays.z[i] = static_cast<float>(origin.z);
  rays.dx[i] = static_cast<float>(direction.x);
  rays.dy[i] = static_cast<float>(direction.y);
  rays.dz[i] = static_cast<float>(direction.z);
}

/// A packet of view rays as the bake casts them, and what they meet.
struct Seen {
  BareRays rays{};
  PointPacket points;
  std::uint32_t hits = 0;
};

/// `texels` neighbouring texels share the packet's 16 rays; every `stride`-th point of a texel's is taken.
Seen look(const RayScene& scene, const BakeOptions& o, const V3d& view, std::size_t texels,
          std::size_t stride, Random& random) {
  const V2d period = scene.period();
  const double top = static_cast<double>(scene.bounds().max.z);
  const double plane = o.reference.value * top;
  const std::size_t each = packet_size / texels;
  const auto row = static_cast<int>(random.uniform() * o.height);
  const auto first = static_cast<int>(random.uniform() * o.width);
  const std::array<std::uint64_t, 16> seed{random.next(), random.next()};
  std::array<V3d, packet_size> origins;
  Seen seen;
  for (std::size_t i = 0; i < packet_size; ++i) {
    const std::size_t texel = i / each;
    const V2d within = spread_point(static_cast<std::uint32_t>(i % each * stride), seed[texel] + texel);
    const V3d on_plane((first + static_cast<int>(texel) + within.x) / o.width * period.x,
                       (row + within.y) / o.height * period.y, plane);
    origins[i] = on_plane + view * ((top * 1.001 - plane) / view.z);
    set_lane(seen.rays, i, origins[i], -view, period);
  }
  seen.rays.active = 0xffffU;
  seen.hits = scene.trace(origins, -view, seen.points);
  return seen;
}

/// The shadow rays of the points that a packet met.
BareRays shadows(const RayScene& scene, const PointPacket& points, std::uint32_t hits, const V3f& light) {
  BareRays rays{};
  for (std::size_t i = 0; i < packet_size; ++i) {
    if ((hits >> i & 1U) != 0 && points[i].face_normal.dot(light) > 0) rays.active |= 1U << i;
  }
  for (std::size_t i = 0; i < packet_size; ++i) {
    const std::size_t lane = (rays.active >> i & 1U) != 0 ? i : 0;
    set_lane(rays, i, scene.leave(points[lane]), V3d(light), scene.period());
  }
  return rays;
}

/// 16 neighbouring directions from a point, as indirect light is gathered.
BareRays gathering(const RayScene& scene, const SurfacePoint& from, Random& random) {
  BareRays rays{};
  constexpr int side = 8;
  const int block = static_cast<int>(random.uniform() * 4);
  for (int k = 0; k < 16; ++k) {
    const double x = block % 2 * 4 + k % 4 + random.uniform();
    const double y = block / 2 * 4 + k / 4 + random.uniform();
    set_lane(rays, static_cast<std::size_t>(k), scene.leave(from),
             cosine_direction(V3d(from.face_normal), {x / side, y / side}), scene.period());
  }
  rays.active = 0xffffU;
  return rays;
}

}  // namespace

int main(int argc, char** argv) {
  const auto number = [&](int i, int otherwise) { return argc > i ? std::atoi(argv[i]) : otherwise; };
  const std::string stitch = argc > 1 ? argv[1] : "plain-weave";
  BakeOptions o;
  o.width = o.height = number(2, o.width);
  o.views = number(3, o.views);
  o.lights = number(4, o.lights);

  std::vector<Stage> stages;
  double last = cpu_seconds();
  const auto lap = [&](const char* name) {
    const double now = cpu_seconds();
    stages.push_back({name, now - last});
    last = cpu_seconds();
  };
  const auto seconds_of = [&](std::string_view name) {
    for (const Stage& s : stages) {
      if (s.name == name) return s.seconds;
    }
    return 0.0;
  };
  const CellMesh mesh = need(load_cell(stitch));
  lap("stitch and its mesh");
  const TracedCell cell = need(trace_cell(mesh, stitch, {}));
  const RayScene& scene = cell.scene;
  lap("tree of the ray tracer");
  auto cache = IrradianceCache::build(scene, 1);
  if (!cache) {
    fmt::print(stderr, "bake_rates: {} needs more points than indirect light is cached at\n", stitch);
    return 1;
  }
  lap("points of indirect light");
  std::uint64_t gathered = cache->rays();

  const double top = static_cast<double>(scene.bounds().max.z);
  const SamplesHeader header =
      samples_header(mesh, o, o.reference.value * top * cell.mm, top * cell.mm, "{}");
  const std::vector<V3f> views = directions_of(header.views);
  const std::vector<V3f> lights = directions_of(header.lights);
  const TexelBaker baker(scene, &*cache, o.bounces, V2i(o.width, o.height), o.reference.value * top);
  const std::vector<float> indirect = cache->solve(scene, lights, o.bounces);
  lap("indirect light of the grid");
  NoiseSum noise;
  for (std::size_t v = 0; v < views.size(); ++v) {
    baker.bake_view(views[v], {lights, indirect}, o.samples, mix(v), noise);
  }
  lap("views");
  const auto view_rays = static_cast<double>(baker.rays());

  double solving = 0;
  constexpr std::size_t at_once = 64;
  const auto points = static_cast<std::size_t>(cache->points());
  std::vector<float> own(points * 3);
  std::size_t pairs = 0;
  for (const auto& set : header.pairs) {
    for (std::size_t first = 0; first < set.size(); first += at_once) {
      const double start = cpu_seconds();
      const std::size_t count = std::min(at_once, set.size() - first);
      std::vector<V3f> some;
      for (std::size_t p = first; p < first + count; ++p) some.push_back(set[p].light);
      const std::vector<float> solved = cache->solve(scene, some, o.bounces);
      solving += cpu_seconds() - start;
      for (std::size_t p = 0; p < count; ++p) {
        for (std::size_t i = 0; i < own.size(); ++i) own[i] = solved[i * count + p];
        baker.bake_pair(set[first + p], {{&some[p], 1}, own, false}, header.truth_samples, mix(p), noise);
      }
      pairs += count;
    }
  }
  lap("pairs");
  stages.back().seconds -= solving;
  stages.push_back({"indirect light of the pairs", solving});
  const double pair_rays = static_cast<double>(baker.rays()) - view_rays;

  const std::string file = (std::filesystem::temp_directory_path() / "selvedge-bake-rates.exr").string();
  last = cpu_seconds();
  const BakeReport report = need(bake(mesh, stitch, o, "{}", file));
  const double baking = cpu_seconds() - last;
  std::filesystem::remove(file);
  double known = 0;
  for (const Stage& s : stages) known += s.seconds;
  stages.push_back({"journal, compression, file", baking + stages.front().seconds - known});
  const double whole = baking + stages.front().seconds;

  const double texels = header.texels();
  const double first_views = texels * static_cast<double>(views.size()) * o.samples;
  const double first_pairs = texels * static_cast<double>(pairs) * header.truth_samples;
  const auto solve_rays = static_cast<double>(cache->rays() - gathered);
  std::array<Kind, 6> kinds{{{"grid: view rays", first_views, false},
                             {"grid: shadow rays", view_rays - first_views, true},
                             {"pairs: view rays", first_pairs, false},
                             {"pairs: shadow rays", pair_rays - first_pairs, true},
                             {"indirect light: gathering", static_cast<double>(gathered), false},
                             {"indirect light: shadow rays", solve_rays, true}}};
  Random random(1);
  constexpr int count = 400;
  const auto some_direction = [&](const std::vector<V3f>& of) {
    return of[static_cast<std::size_t>(random.uniform() * static_cast<double>(of.size()))];
  };
  for (int i = 0; i < count; ++i) {
    Seen seen = look(scene, o, V3d(some_direction(views)), 2, 1, random);
    kinds[0].packets.push_back(seen.rays);
    for (const V3f& light : lights) {
      const BareRays rays = shadows(scene, seen.points, seen.hits, light);
      if (rays.active != 0) kinds[1].packets.push_back(rays);
    }
    // What a gather and its shadow rays begin at: any point, not only those that are seen from above.
    for (std::size_t lane = 0; lane < packet_size; lane += 4) {
      if ((seen.hits >> lane & 1U) == 0) continue;
      const SurfacePoint& from = seen.points[lane];
      kinds[4].packets.push_back(gathering(scene, from, random));
      for (std::size_t l = 0; l + packet_size <= lights.size(); l += packet_size) {
        BareRays rays{};
        for (std::size_t k = 0; k < packet_size; ++k) {
          set_lane(rays, k, scene.leave(from), V3d(lights[l + k]), scene.period());
          if (from.face_normal.dot(lights[l + k]) > 0) rays.active |= 1U << k;
        }
        if (rays.active != 0) kinds[5].packets.push_back(rays);
      }
    }
  }
  const auto& some_pairs = header.pairs[0];
  for (int i = 0; i < 10 * count && !some_pairs.empty(); ++i) {
    const DirectionPair& pair = some_pairs[static_cast<std::size_t>(i) % some_pairs.size()];
    Seen seen = look(scene, o, V3d(pair.view), 1, 2, random);
    kinds[2].packets.push_back(seen.rays);
    const BareRays rays = shadows(scene, seen.points, seen.hits, pair.light);
    if (rays.active != 0) kinds[3].packets.push_back(rays);
  }

  fmt::print(
      "{}: {} triangles, {} points of indirect light; {} x {} texels, {} views x {} lights, {} pairs\n\n",
      stitch, mesh.triangles.size(), points, o.width, o.height, views.size(), lights.size(), pairs);
  fmt::print("| stage | CPU s | share |\n|---|---|---|\n");
  for (const Stage& s : stages) {
    fmt::print("| {} | {:.3f} | {:.1f} % |\n", s.name, s.seconds, 100 * s.seconds / whole);
  }
  fmt::print("| whole | {:.3f} | |\n\n", whole);
  const BareTracer tracer(scene.mesh());
  fmt::print("| rays | million | bare, million/s | bare, CPU s |\n|---|---|---|---|\n");
  double bare = 0;
  double rays = 0;
  std::array<double, kinds.size()> alone{};
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    const Kind& kind = kinds[k];
    if (kind.packets.empty()) continue;
    double traced = 0;
    for (const BareRays& p : kind.packets) traced += std::popcount(p.active);
    double seconds = 0;
    constexpr int rounds = 5;
    for (int round = 0; round < rounds; ++round) {
      seconds += kind.shadow ? tracer.any(kind.packets) : tracer.nearest(kind.packets);
    }
    const double rate = traced * rounds / seconds;
    fmt::print("| {} | {:.2f} | {:.1f} | {:.3f} |\n", kind.name, kind.rays * 1e-6, rate * 1e-6,
               kind.rays / rate);
    alone[k] = kind.rays / rate;
    bare += alone[k];
    rays += kind.rays;
  }
  fmt::print("| all | {:.2f} | {:.1f} | {:.3f} |\n\n", rays * 1e-6, rays / bare * 1e-6, bare);
  fmt::print("| part | bake, CPU s | tracer alone, CPU s | of the bare rate |\n|---|---|---|---|\n");
  const auto part = [&](const char* name, double baked, double traced) {
    fmt::print("| {} | {:.3f} | {:.3f} | {:.0f} % |\n", name, baked, traced, 100 * traced / baked);
  };
  part("grid", seconds_of("views"), alone[0] + alone[1]);
  part("pairs", seconds_of("pairs"), alone[2] + alone[3]);
  part("indirect light",
       seconds_of("points of indirect light") + seconds_of("indirect light of the grid") + solving,
       alone[4] + alone[5]);
  part("whole", whole, bare);
  fmt::print("\n{:.1f} million rays/s a core; {:.2f} s on the clock\n", rays / whole * 1e-6,
             report.seconds + stages.front().seconds);
  return 0;
}
