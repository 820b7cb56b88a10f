// Explicit fibres beside the surfaces of plies, for docs/yarn.md.
//   selvedge-fibres energies [STITCH [KIND [TRANSMISSION [FIBRES [PATHS [ALBEDOS]]]]]]: fractions of the
//   light that falls
//     on tubes, on the translucent walls of plies and on explicit fibres, straight from above and from all
//     around above: sent back, let through (holes left out), absorbed; and through holes. Then of light that
//     comes along y at 45 degrees the radiance, times pi, of cones of 12 degrees about its mirror direction,
//     the normal, and the way back.
//   selvedge-fibres picture STITCH SAMPLES OUT.exr [near|middle [W,H [SEED [X,Y,Z,INTENSITY...]]]]: as
//     `truth --place near --size 240x180 --set seed=1`, of the fibres.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numbers>
#include <string>

#include "converter/bake/setup.h"
#include "converter/bake/truth_swatch.h"
#include "converter/stitch/fibres.h"
#include "converter/stitch/library.h"
#include "converter/stitch/yarn_mesh.h"
#include "format/base/guard.h"
#include "format/base/option_text.h"
#include "format/base/parallel.h"
#include "tests/bench/fibres.h"

using namespace selvedge;

namespace {

// Three at a time, as colours.
std::vector<V3d> albedos{V3d(0.05, 0.2, 0.4), V3d(0.6, 0.8, 0.95)};

struct Energies {
  V3d back{0, 0, 0};
  V3d through{0, 0, 0};
  double holes = 0;
  std::array<V3d, 3> towards{V3d(0, 0, 0), V3d(0, 0, 0), V3d(0, 0, 0)};  ///< mirror, normal, way back
};
enum class From { above, around, slanted };
constexpr std::array from_names{"above", "around", "45 degrees"};

/// The mean over paths; `trace(origin, direction, sampler)` follows one, and says whether it met anything.
struct End {
  bool met = false;
  V3d direction{0, 0, -1};
  V3d throughput{1, 1, 1};
};
template <class Trace>
Energies energies(const V2d& period, double above, From from, int paths, const Trace& trace) {
  constexpr int blocks = 64;
  const V3d slanted = V3d(0, 1, 1).normalized();
  const std::array axes{V3d(0, -slanted.y, slanted.z), V3d(0, 0, 1), slanted};
  const double cone = std::cos(12 * std::numbers::pi / 180);
  std::array<Energies, blocks> sums;
  const int each = paths / blocks;
  parallel_for(0, blocks, [&](int block) {
    for (int k = 0; k < each; ++k) {
      PathSampler sampler(static_cast<std::uint32_t>(block * each + k), 7);
      const V2d at = sampler.next_pair() * period;
      const V3d down = from == From::around    ? cosine_direction({0, 0, -1}, sampler.next_pair())
                       : from == From::slanted ? -slanted
                                               : V3d(0, 0, -1);
      const End end = trace(V3d(at.x, at.y, above), down, sampler);
      Energies& sum = sums[static_cast<std::size_t>(block)];
      if (!end.met) {
        sum.holes += 1;
      } else {
        (end.direction.z > 0 ? sum.back : sum.through) += end.throughput;
        for (std::size_t a = 0; a < axes.size(); ++a)
          if (end.direction.z > 0 && end.direction.dot(axes[a]) > cone)
            sum.towards[a] += end.throughput / (end.direction.z * 2 * (1 - cone));
      }
    }
  });
  Energies all;
  const double count = blocks * each;
  for (const Energies& sum : sums) {
    all.back += sum.back / count;
    all.through += sum.through / count;
    all.holes += sum.holes / count;
    for (std::size_t a = 0; a < axes.size(); ++a) all.towards[a] += sum.towards[a] / count;
  }
  return all;
}

void print(const std::string& model, From from, const V3d& albedo, const Energies& e) {
  const char* light = from_names[static_cast<std::size_t>(from)];
  for (int c = 0; c < 3; ++c) {
    if (from == From::slanted) {
      fmt::print("| {} | {} | {:.2f} | {:.3f} | {:.3f} | {:.3f} | |\n", model, light, albedo[c],
                 e.towards[0][c], e.towards[1][c], e.towards[2][c]);
      continue;
    }
    fmt::print("| {} | {} | {:.2f} | {:.4f} | {:.4f} | {:.4f} | {:.4f} |\n", model, light, albedo[c],
               e.back[c], e.through[c], 1 - e.holes - e.back[c] - e.through[c], e.holes);
  }
  std::fflush(stdout);
}

StitchPattern pattern_of(const std::string& stitch, int kind, const V3d& albedo, double transmission) {
  StitchSettings settings{{"colour", {albedo.x, albedo.y, albedo.z}}};
  settings["yarn"] = {static_cast<double>(kind)};
  auto found = value_or_throw(find_stitch(stitch, settings));
  for (Yarn& yarn : found.pattern.yarns) yarn.transmission = std::max(0.0, transmission);
  return found.pattern;
}

Energies of_surface(const StitchPattern& pattern, From from_where, int paths) {
  const auto cell = value_or_throw(trace_cell(value_or_throw(mesh_stitch(pattern)), pattern.name));
  const PathTracer tracer(cell.scene, unlimited_bounces);
  const double above = static_cast<double>(cell.scene.bounds().max.z) + 1;
  return energies(cell.scene.period(), above, from_where, paths,
                  [&](const V3d& origin, const V3d& direction, PathSampler& sampler) {
                    End end;
                    SurfacePoint at;
                    end.direction = direction;
                    bool meets = cell.scene.trace(origin, end.direction, at);
                    for (int depth = 0; meets; ++depth) {
                      end.met = true;
                      const auto next =
                          tracer.continue_path(at, -end.direction, depth, sampler, end.throughput);
                      if (!next) return End{true, {0, 0, -1}, {0, 0, 0}};
                      end.direction = *next;
                      meets = tracer.follow(*next, at);
                    }
                    return end;
                  });
}

Energies of_fibres(const StitchPattern& pattern, int each_ply, From from, int paths) {
  const auto fibres = lay_fibres(pattern, value_or_throw(mesh_stitch(pattern)), each_ply);
  const FibreScene scene(fibres);
  const FibreTracer tracer(scene, fibres.yarns, unlimited_bounces);
  return energies(scene.period(), scene.high() + 1, from, paths,
                  [&](const V3d& origin, const V3d& direction, PathSampler& sampler) {
                    FibrePoint at;
                    if (!scene.trace(origin, direction, at)) return End{};
                    std::uint64_t rays = 0;
                    const auto escape = tracer.follow(at, {}, sampler, {}, rays);
                    return End{true, escape.direction, escape.throughput};
                  });
}

int print_energies(int argc, char** argv) {
  const auto argument = [&](int k, double otherwise) { return argc > k ? std::atof(argv[k]) : otherwise; };
  const std::string stitch = argc > 2 ? argv[2] : "plain-knit";
  const auto kind = find_yarn_kind(argc > 3 ? argv[3] : "wool").value();
  const double transmission = argument(4, yarn_kinds()[kind].transmission);
  const int each_ply = static_cast<int>(argument(5, 0));
  const int paths = static_cast<int>(argument(6, 65536));
  if (argc > 7) {
    const auto given = parse_numbers(argv[7], ',', 3, 300).value();
    albedos.clear();
    for (std::size_t k = 0; k + 2 < given.size(); k += 3)
      albedos.emplace_back(given[k], given[k + 1], given[k + 2]);
  }
  fmt::print(
      "| model | light | albedo | back | through | absorbed | holes |\n|---|---|---|---|---|---|---|\n");
  for (const From from : {From::above, From::around, From::slanted}) {
    for (const V3d& albedo : albedos) {
      const StitchPattern spun = pattern_of(stitch, kind, albedo, transmission);
      const StitchPattern tube = pattern_of(stitch, 0, albedo, 0);
      if (transmission >= 0) print("ply", from, albedo, of_surface(spun, from, 4 * paths));
      if (each_ply < 0) continue;
      print("fibres", from, albedo, of_fibres(spun, each_ply, from, paths));
      print("tube", from, albedo, of_surface(tube, from, paths));
    }
  }
  return 0;
}

int draw(int argc, char** argv) {
  StitchSettings settings;
  if (argc > 7) settings["seed"] = {std::atof(argv[7])};
  const StitchPattern pattern = value_or_throw(find_stitch(argv[2], settings)).pattern;
  const CellMesh mesh = value_or_throw(mesh_stitch(pattern));
  const bool is_near = argc < 6 || std::string(argv[5]) == "near";
  const auto size = parse_numbers(argc > 6 ? argv[6] : "240,180", ',', 2, 2).value();
  SwatchShot shot = swatch_shot(is_near ? SwatchView::near : SwatchView::middle, mesh.period,
                                static_cast<int>(size[0]), static_cast<int>(size[1]));
  if (argc > 8) shot.lights.clear();
  for (int k = 8; k < argc; ++k) {
    const auto given = parse_numbers(argv[k], ',', 4, 4).value();
    Light light;
    light.direction = V3d(given[0], given[1], given[2]).normalized();
    light.irradiance = V3f(static_cast<float>(given[3]));
    shot.lights.push_back(light);
  }
  TruthOptions options;
  options.samples = std::atoi(argv[3]);
  const Fibres fibres = lay_fibres(pattern, mesh, 0);
  const FibreScene scene(fibres);
  const FibreTracer tracer(scene, fibres.yarns, options.bounces);
  const auto cell = value_or_throw(trace_cell(mesh, pattern.name));
  const double plane = plane_height_fraction * cell.thickness_mm();
  const SwatchCell place{scene.period(), 1e-3, static_cast<double>(bounds_of(mesh).min.z) + plane,
                         scene.high()};
  const TruthSwatch drawn =
      draw_truth(shot, options,
                 [&](const SwatchHit& ray, PathSampler& sampler, PathLights& lights, PixelSum& sum) {
                   FibrePoint point;
                   if (!scene.trace(ray_origin(ray, shot.camera, place), -ray.view, point)) return;
                   std::uint64_t rays = 0;
                   sum.hits += 1;
                   tracer.follow(point, lights.directions, sampler, lights.unit_radiances, rays);
                   lights.add_to(sum);
                 },
                 {});
  value_or_throw(write_exr(argv[4], to_linear_image(drawn.frame)));
  fmt::print("noise {:.2g}\n", drawn.noise);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const bool picture = argc > 4 && std::string(argv[1]) == "picture";
  const auto result = catch_exceptions(
      "fibres", [&]() -> Result<int> { return picture ? draw(argc, argv) : print_energies(argc, argv); });
  if (!result) fmt::print(stderr, "{}\n", to_line(result.error()));
  return result ? 0 : 1;
}
