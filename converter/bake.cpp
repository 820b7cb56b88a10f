#include "converter/bake.h"

#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "converter/ray_scene.h"
#include "format/fabric.h"
#include "format/parallel.h"
#include "format/random.h"

namespace selvedge {
namespace {

constexpr double pi = std::numbers::pi;

// The seed's independent uses.
constexpr std::uint64_t stream_views = 1;
constexpr std::uint64_t stream_pairs = 2;
constexpr std::uint64_t stream_directions = 3;

/// What the rays of one texel and view have gathered.
struct Gather {
  int rays = 0;
  int hits = 0;
  V3d normal{0, 0, 0};
  std::vector<V3d> radiance;  // sum over hits, per light

  explicit Gather(std::size_t lights) : radiance(lights, V3d(0, 0, 0)) {}
  void clear() {
    rays = hits = 0;
    normal = V3d(0, 0, 0);
    std::fill(radiance.begin(), radiance.end(), V3d(0, 0, 0));
  }
};

/// The additive recurrence of the plastic number (Roberts 2018): evenly spread for any number of points.
V2d spread_point(int i, const V2d& shift) {
  constexpr double g = 1.32471795724474602596;
  const double x = shift.x + i / g;
  const double y = shift.y + i / (g * g);
  return {x - std::floor(x), y - std::floor(y)};
}

V3d cosine_direction(const V3d& normal, Random& random) {
  const double r2 = random.uniform();
  const double phi = 2 * pi * random.uniform();
  const V3d side = std::abs(normal.z) < 0.9 ? V3d(0, 0, 1) : V3d(1, 0, 0);
  const V3d t = normal.cross(side).normalized();
  const V3d b = normal.cross(t);
  const double r = std::sqrt(r2);
  return (t * (r * std::cos(phi)) + b * (r * std::sin(phi)) + normal * std::sqrt(1 - r2)).normalized();
}

class Baker {
 public:
  Baker(const RayScene& scene, const BakeOptions& options, double plane_z)
      : scene_(scene), options_(options), plane_z_(plane_z) {}

  /// Adds `count` rays through the texel along `view` to `gather`.
  void sample(int x, int y, const V3f& view, std::span<const V3f> lights, int count, Random random,
              Gather& gather) const {
    const V3d towards = -V3d(view);
    const V2d shift(random.uniform(), random.uniform());
    std::uint64_t rays = 0;
    for (int i = 0; i < count; ++i) {
      const V2d within = spread_point(i, shift);
      // y points up, rows of texels run down.
      const V3d on_plane((x + within.x) / options_.width * scene_.period().x,
                         (1 - (y + within.y) / options_.height) * scene_.period().y, plane_z_);
      ++gather.rays;
      ++rays;
      SurfacePoint point;
      // From above everything: the plane may lie within the yarn.
      const double above = (scene_.bounds().max.z - plane_z_ + scene_.period().x) / view.z;
      if (!scene_.trace(on_plane - towards * above, towards, point)) continue;
      ++gather.hits;
      gather.normal += V3d(point.vertex_normal);
      rays += follow(point, lights, random, gather);
    }
    rays_.fetch_add(rays, std::memory_order_relaxed);
  }

  std::uint64_t rays() const { return rays_; }

 private:
  /// Light of all directions that reaches the eye over a path which begins at `point`.
  std::uint64_t follow(SurfacePoint point, std::span<const V3f> lights, Random& random,
                       Gather& gather) const {
    V3d throughput(1, 1, 1);
    std::uint64_t rays = 0;
    for (int bounce = 0;; ++bounce) {
      throughput *= V3d(point.albedo);
      for (std::size_t l = 0; l < lights.size(); ++l) {
        const double cosine = point.face_normal.dot(lights[l]);
        if (cosine <= 0) continue;
        ++rays;
        if (!scene_.occluded(point, lights[l])) gather.radiance[l] += throughput * (cosine / pi);
      }
      if (bounce == options_.bounces) return rays;
      const V3d direction = cosine_direction(V3d(point.face_normal), random);
      ++rays;
      if (!scene_.trace(scene_.leave(point), direction, point)) return rays;
    }
  }

  const RayScene& scene_;
  const BakeOptions& options_;
  double plane_z_;
  mutable std::atomic<std::uint64_t> rays_{0};
};

Result<void> check_options(const BakeOptions& o, const std::string& name) {
  const auto in_range = [&](const char* option, int value, int least, int most) -> Result<void> {
    if (value >= least && value <= most) return {};
    return fail(Code::option_out_of_range, name, option,
                fmt::format("{} is outside of {} to {}", value, least, most));
  };
  const FabricLimits limits;
  for (const auto& ok :
       {in_range("texels", o.width, 1, limits.texels_per_side),
        in_range("texels", o.height, 1, limits.texels_per_side),
        in_range("views", o.views, 1, limits.directions), in_range("lights", o.lights, 1, limits.directions),
        in_range("samples", o.samples, 1, 1 << 20), in_range("bounces", o.bounces, 0, 64),
        in_range("validation-pairs", o.validation_pairs, 0, 65536),
        in_range("held-out-pairs", o.held_out_pairs, 0, 65536), in_range("rim-pairs", o.rim_pairs, 0, 65536),
        in_range("truth-samples", o.truth_samples, 2, 1 << 20)}) {
    if (!ok) return ok;
  }
  const double pixels = static_cast<double>(o.width) * o.height * o.views * o.lights;
  const double limit = static_cast<double>(ExrLimits{}.pixels_per_part);
  if (pixels > limit) {
    return fail(Code::option_out_of_range, name, "texels",
                fmt::format("texels x views x lights are {:.3g}; at most {:.3g} are allowed", pixels, limit));
  }
  if (o.reference_height && !std::isfinite(*o.reference_height)) {
    return fail(Code::option_out_of_range, name, "reference-height", "is not finite");
  }
  return {};
}

SamplesHeader header_of(const RayScene& scene, const BakeOptions& o, double reference_height,
                        const std::string& provenance) {
  SamplesHeader header;
  header.width = o.width;
  header.height = o.height;
  header.period_mm = V2f(scene.period());
  header.reference_height = static_cast<float>(reference_height);
  header.thickness_mm = scene.bounds().max.z;
  header.views = grid_of(o.views);
  header.lights = grid_of(o.lights);
  header.samples_per_texel = o.samples;
  header.truth_samples = o.truth_samples / 2 * 2;
  const std::uint64_t seed = mix(o.seed ^ mix(stream_directions));
  header.pairs[0] = random_pairs(o.validation_pairs, rim_z, seed);
  header.pairs[1] = random_pairs(o.held_out_pairs, rim_z, seed + 1);
  header.pairs[2] = random_rim_pairs(o.rim_pairs, rim_z, seed + 2);
  nlohmann::json text = nlohmann::json::parse(provenance.empty() ? "{}" : provenance, nullptr, false);
  if (!text.is_object()) text = nlohmann::json::object();
  text["bake"] = {{"bounces", o.bounces}, {"samples", o.samples}, {"seed", o.seed}};
  header.provenance = text.dump();
  return header;
}

ViewSamples bake_view(const Baker& baker, const BakeOptions& o, int view_index, const V3f& view,
                      std::span<const V3f> lights) {
  const auto texels = static_cast<std::size_t>(o.width * o.height);
  ViewSamples out{std::vector<float>(texels), std::vector<V3f>(texels, V3f(0, 0, 0)),
                  std::vector<V3f>(texels * lights.size(), V3f(0, 0, 0))};
  parallel_for(0, o.height, [&](int y) {
    Gather gather(lights.size());
    for (int x = 0; x < o.width; ++x) {
      const auto texel = static_cast<std::size_t>(y * o.width + x);
      gather.clear();
      const Random random(o.seed, stream_views, static_cast<std::uint64_t>(view_index), texel);
      baker.sample(x, y, view, lights, o.samples, random, gather);
      if (gather.hits == 0) continue;
      out.alpha[texel] = static_cast<float>(gather.hits) / static_cast<float>(gather.rays);
      out.normal[texel] = V3f(gather.normal / gather.rays);
      for (std::size_t l = 0; l < lights.size(); ++l) {
        out.radiance[l * texels + texel] = V3f(gather.radiance[l] / gather.hits);
      }
    }
  });
  return out;
}

/// The truth of one pair, from two independent halves whose difference tells its noise.
PairSamples bake_pair(const Baker& baker, const BakeOptions& o, PairKind kind, std::size_t pair,
                      const DirectionPair& directions) {
  const auto texels = static_cast<std::size_t>(o.width * o.height);
  PairSamples out;
  out.width = o.width;
  out.height = o.height;
  out.pairs = {directions};
  out.alpha.assign(texels, 0);
  out.alpha_noise.assign(texels, 0);
  out.radiance.assign(texels, V3f(0, 0, 0));
  out.noise.assign(texels, V3f(0, 0, 0));
  parallel_for(0, o.height, [&](int y) {
    std::array<Gather, 2> half{Gather(1), Gather(1)};
    for (int x = 0; x < o.width; ++x) {
      const auto texel = static_cast<std::size_t>(y * o.width + x);
      for (std::size_t h = 0; h < 2; ++h) {
        half[h].clear();
        const Random random(o.seed, stream_pairs + 16 * (static_cast<std::uint64_t>(kind) + 1), 2 * pair + h,
                            texel);
        baker.sample(x, y, directions.view, {&directions.light, 1}, o.truth_samples / 2, random, half[h]);
      }
      const int rays = half[0].rays + half[1].rays;
      const int hits = half[0].hits + half[1].hits;
      out.alpha[texel] = static_cast<float>(hits) / static_cast<float>(rays);
      out.alpha_noise[texel] = static_cast<float>(half[0].hits - half[1].hits) / static_cast<float>(rays);
      out.noise[texel] = V3f((half[0].radiance[0] - half[1].radiance[0]) / rays);
      if (hits > 0) out.radiance[texel] = V3f((half[0].radiance[0] + half[1].radiance[0]) / hits);
    }
  });
  return out;
}

}  // namespace

Result<BakeReport> bake(const CellMesh& mesh, const std::string& name, const BakeOptions& options,
                        const std::string& provenance, const std::string& output, const Progress& progress) {
  if (auto ok = check_options(options, name); !ok) return tl::unexpected(ok.error());
  if (auto ok = validate(mesh, name); !ok) return tl::unexpected(ok.error());
  const auto start = std::chrono::steady_clock::now();
  const auto scene = RayScene::create(mesh, name);
  if (!scene) return tl::unexpected(scene.error());

  const auto thickness = static_cast<double>(scene->bounds().max.z);
  const double reference_height = options.reference_height.value_or(thickness);
  const double reach = thickness + std::max(scene->period().x, scene->period().y);
  if (std::abs(reference_height) > 4 * reach) {
    return fail(Code::option_out_of_range, name, "reference-height",
                fmt::format("{} mm is far from a cell of {:.3g} mm", reference_height, thickness));
  }
  const SamplesHeader header = header_of(*scene, options, reference_height, provenance);
  auto writer = SamplesWriter::create(output, header);
  if (!writer) return tl::unexpected(writer.error());

  const Baker baker(*scene, options, reference_height);
  const std::vector<V3f> views = directions_of(header.views);
  const std::vector<V3f> lights = directions_of(header.lights);
  std::size_t pair_total = 0;
  for (const auto& pairs : header.pairs) pair_total += pairs.size();
  // Cost, in rays of one light: what the bar of progress goes by.
  const double total =
      static_cast<double>(views.size()) * static_cast<double>(lights.size()) * options.samples +
      static_cast<double>(pair_total) * options.truth_samples;
  double done = 0;
  const auto advance = [&](double cost) {
    done += cost;
    if (progress) progress(done / total);
  };

  BakeReport report;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const ViewSamples samples = bake_view(baker, options, static_cast<int>(v), views[v], lights);
    if (auto ok = writer->write_view(samples); !ok) return tl::unexpected(ok.error());
    for (const float alpha : samples.alpha) report.coverage += alpha;
    advance(static_cast<double>(lights.size()) * options.samples);
  }
  report.coverage /= static_cast<double>(views.size()) * header.texels();

  for (const PairKind kind : all_pair_kinds) {
    const auto& pairs = header.pairs[static_cast<std::size_t>(kind)];
    for (std::size_t pair = 0; pair < pairs.size(); ++pair) {
      const PairSamples truth = bake_pair(baker, options, kind, pair, pairs[pair]);
      if (auto ok = writer->write_pairs(kind, truth); !ok) return tl::unexpected(ok.error());
      advance(options.truth_samples);
    }
  }
  if (auto ok = writer->commit(); !ok) return tl::unexpected(ok.error());
  report.rays = baker.rays();
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return report;
}

}  // namespace selvedge
