// How fast dressed garments are drawn by each path, what a frame's time is made of, how it grows with
// triangles and with pixels, and how fast fabrics are evaluated beside the reference: selvedge-bench-view
// [--rows FILE] [--paths hybrid,paper,shader] [--rates SCENE.glb] [--yarn YARN.exr LAYERS.exr] SCENE.glb ...
// The first scene is the one whose growth is told. With --rates: also frames a second of a garment, whole and
// close. With --yarn: also what the points of pixels cost that show the yarn of a fabric.
#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>
#include <utility>

#include "format/base/option_text.h"
#include "format/base/parallel.h"
#include "format/fabric/evaluate.h"
#include "tests/bench/drawn.h"
#include "tests/bench/frame_rates.h"
#include "tests/bench/pictures.h"
#include "tests/bench/rows.h"
#include "tests/bench/yarn_bench.h"
#include "viewer/renderer.h"

namespace {

using namespace selvedge;
using bench::load;
using bench::need;
using bench::Sample;
using bench::Samples;
using bench::Subject;

constexpr V2i full_size(1920, 1080);
constexpr double zoom = 1.15;  ///< the sweater then covers more than half of the pixels

/// A turn by a quarter of a degree a frame, nearest texels, one tap. `last`: takes the last frame.
Result<Samples> draw(const Subject& subject, RenderPath path, const V2i& size, int frames,
                     PowerKind power = PowerKind::exact, Frame* last = nullptr) {
  RenderOptions options;
  options.path = path;
  options.power = power;
  options.context = ContextKind::osmesa;
  options.width = 64;
  options.height = 36;
  Result<std::unique_ptr<Renderer>> renderer = Renderer::create(subject.scene, subject.fabrics, options);
  if (!renderer) return tl::unexpected(renderer.error());
  Frame frame;
  Samples samples;
  const auto one = [&](int i) {
    CameraOptions view;
    view.zoom = zoom;
    view.azimuth = 0.25 * i;
    const Camera camera = need(make_camera(subject.points, 16.0 / 9, view));
    options.lights = default_lights(camera);
    Sample sample;
    const double start = bench::wall_seconds();
    const double start_processor = bench::cpu_seconds();
    need((*renderer)->draw(camera, options, frame, sample.stats));
    sample.wall = bench::wall_seconds() - start;
    sample.processor = bench::cpu_seconds() - start_processor;
    return sample;
  };
  // The first frames compile shaders and touch memory for the first time.
  one(0);
  options.width = size.x;
  options.height = size.y;
  need((*renderer)->resize(options));
  for (int i = frames > 1 ? -2 : 0; i < frames; ++i) {
    const Sample sample = one(i);
    if (i >= 0) samples.add(sample);
  }
  if (last != nullptr) *last = std::move(frame);
  return samples;
}

/// Pixels in sixteens, each with two texels under two lights: what a frame asks for.
struct Lanes {
  LaneDirections view;
  std::array<LaneLight, 2> lights;
  std::array<LaneTexels, 2> texels;
};

std::vector<Lanes> make_lanes(const Fabric& fabric) {
  const std::vector<DirectionPair> pairs = random_pairs(1024, 0.05, 1);
  std::vector<Lanes> all(256);
  std::size_t number = 0;
  for (Lanes& block : all) {
    for (std::size_t lane = 0; lane < lane_count; ++lane, ++number) {
      const auto set = [&](LaneDirections& to, const V3f& d) {
        to.x[lane] = d.x;
        to.y[lane] = d.y;
        to.z[lane] = d.z;
      };
      set(block.view, pairs[number % 1024].view);
      for (std::size_t i = 0; i < 2; ++i) {
        set(block.lights[i].direction, pairs[(number + 5 * i) % 1024].light);
        block.lights[i].share[lane] = 1;
        const std::size_t level = std::min(1 + i, fabric.levels.size() - 1);
        block.texels[i].level[lane] = static_cast<std::int32_t>(level);
        block.texels[i].texel[lane] =
            static_cast<std::int32_t>(number * 7 % static_cast<std::size_t>(fabric.levels[level].texels()));
        block.texels[i].weight[lane] = 0.5F;
      }
    }
  }
  return all;
}

/// Evaluations (one texel under one light) per second.
template <class Body>
double rate(std::size_t blocks, const Body& body) {
  double best = 0;
  for (int repeat = 0; repeat < 12; ++repeat) {
    const double start = bench::wall_seconds();
    body();
    best = std::max(best, static_cast<double>(blocks * lane_count * 4) / (bench::wall_seconds() - start));
  }
  return best;
}

void evaluate_rates(const Fabric& fabric, const std::string& name, bench::Rows& rows) {
  const PackedFabric packed = pack(fabric);
  const std::vector<Lanes> all = make_lanes(fabric);
  std::vector<float> sums(64);
  PowerKind power = PowerKind::exact;
  const auto wide = [&](std::size_t slot) {
    LaneScratch scratch;
    LaneShading sum;
    for (const Lanes& block : all)
      evaluate_lanes(packed, block.texels, block.view, block.lights, scratch, sum, power);
    sums[slot] = sum.red[0];
  };
  const double scalar = rate(all.size(), [&] {
    V3f sum(0, 0, 0);
    for (const Lanes& block : all) {
      for (std::size_t lane = 0; lane < lane_count; ++lane) {
        const V3f view(block.view.x[lane], block.view.y[lane], block.view.z[lane]);
        for (const LaneTexels& of : block.texels) {
          const int columns = fabric.levels[of.level[lane]].width;
          for (const LaneLight& light : block.lights) {
            const V3f l(light.direction.x[lane], light.direction.y[lane], light.direction.z[lane]);
            sum +=
                evaluate(fabric, of.level[lane], of.texel[lane] % columns, of.texel[lane] / columns, l, view)
                    .radiance;
          }
        }
      }
    }
    sums[0] += sum.x;
  });
  const double one = rate(all.size(), [&] { wide(0); });
  power = PowerKind::fast;
  const double fast = rate(all.size(), [&] { wide(0); });
  power = PowerKind::exact;
  const int threads = thread_count();
  const int tasks = 8 * threads;
  const double many = rate(all.size() * static_cast<std::size_t>(tasks), [&] {
    parallel_for(0, tasks, [&](int i) { wide(static_cast<std::size_t>(i) % sums.size()); });
  });
  fmt::print(
      "{}: reference {:.1f} M evaluations/s a thread, sixteen at once {:.1f} M/s = {:.1f} x, with fast "
      "powers {:.2f} x that; {} threads {:.1f} M/s = {:.2f} x one\n",
      name, scalar / 1e6, one / 1e6, one / scalar, fast / one, threads, many / 1e6, many / one);
  rows.add("evaluation/" + name + "/one_thread", one / scalar, "x reference");
  rows.add("evaluation/" + name + "/fast_power", fast / one, "x exact");
  rows.add("evaluation/" + name + "/all_threads", many / one, "x one");
}

int frames_of(RenderPath path) {
  // A frame by the shader path takes seconds on the software rasteriser.
  return path == RenderPath::hybrid ? 30 : path == RenderPath::paper ? 8 : 1;
}

void draw_by_all_paths(const Subject& subject, const std::vector<RenderPath>& paths, bench::Rows& rows) {
  struct {
    double frame = 0;
    double processor = 0;
  } hybrid;
  for (const RenderPath path : paths) {
    const std::string name(path_names[static_cast<std::size_t>(path)]);
    const Result<Samples> samples = draw(subject, path, full_size, frames_of(path));
    if (!samples) {
      fmt::print("| {} | {} | {} |\n", subject.name, name, to_line(samples.error()));
      continue;
    }
    if (path == RenderPath::hybrid) hybrid = {samples->frame(), samples->processor()};
    const RenderStats& last = samples->last();
    const std::string ratio = hybrid.frame > 0
                                  ? fmt::format("{:.2f} | {:.2f}", samples->frame() / hybrid.frame,
                                                samples->processor() / hybrid.processor)
                                  : " | ";
    // The shader path does not count what it evaluates.
    const std::string surfaces = last.evaluated_pixels == 0
                                     ? ""
                                     : fmt::format("{:.2f}", static_cast<double>(last.evaluated_pixels) /
                                                                 static_cast<double>(last.covered_pixels));
    fmt::print("| {} | {} | {:.1f} % | {} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {} |\n",
               subject.name, name,
               100.0 * static_cast<double>(last.covered_pixels) / (full_size.x * full_size.y), surfaces,
               samples->stage(&RenderStats::project), samples->stage(&RenderStats::geometry),
               samples->stage(&RenderStats::read_back), samples->stage(&RenderStats::evaluation),
               samples->frame(), samples->processor(), ratio);
    std::fflush(stdout);
    rows.add(fmt::format("frame/{}/{}", subject.name, name), samples->frame(), "ms");
    rows.add(fmt::format("frame/{}/{}/processor", subject.name, name), samples->processor(), "ms");
    if (path == RenderPath::hybrid) {
      rows.add("frame/" + subject.name + "/hybrid/geometry", samples->stage(&RenderStats::geometry), "ms");
      rows.add("frame/" + subject.name + "/hybrid/read_back", samples->stage(&RenderStats::read_back), "ms");
      rows.add("frame/" + subject.name + "/hybrid/evaluation", samples->stage(&RenderStats::evaluation),
               "ms");
    }
  }
}

/// Every triangle cut into four of the same plane: more triangles over the same pixels.
void subdivide(ScenePrimitive& p) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  const auto half = [](auto& values, std::uint32_t a, std::uint32_t b, float scale) {
    if (values.empty()) return;
    using Value = std::decay_t<decltype(values[0])>;
    values.push_back(Value(values[a] + values[b]) * static_cast<typename Value::BaseType>(scale));
  };
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const auto [entry, fresh] =
        middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(p.positions.size()));
    if (fresh) {
      half(p.positions, a, b, 0.5F);
      half(p.normals, a, b, 1);
      if (!p.normals.empty()) p.normals.back().normalize();
      half(p.tangents, a, b, 0.5F);
      for (std::vector<V2d>& set : p.tex_coords) half(set, a, b, 0.5F);
      half(p.colors, a, b, 0.5F);
    }
    return entry->second;
  };
  std::vector<std::uint32_t> finer;
  for (std::size_t k = 0; k + 2 < p.indices.size(); k += 3) {
    const std::uint32_t a = p.indices[k];
    const std::uint32_t b = p.indices[k + 1];
    const std::uint32_t c = p.indices[k + 2];
    const std::uint32_t ab = middle(a, b);
    const std::uint32_t bc = middle(b, c);
    const std::uint32_t ca = middle(c, a);
    finer.insert(finer.end(), {a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca});
  }
  p.indices = std::move(finer);
}

/// Time beyond the geometry pass grows with the pixels that are covered, and not with triangles.
void growth(const Subject& subject, bench::Rows& rows) {
  fmt::print(
      "\n{}, hybrid: by triangles and by pixels\n\n"
      "| triangles | pixels covered | project | geometry | read back | texels, frames, light | ns per "
      "surface of a pixel | frame (ms) | processor |\n|---|---|---|---|---|---|---|---|---|\n",
      subject.name);
  const auto line = [&](const Subject& of, const V2i& size, const std::string& name) {
    const Samples samples = need(draw(of, RenderPath::hybrid, size, 15));
    const RenderStats& last = samples.last();
    fmt::print("| {} | {} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} |\n", last.triangles,
               last.covered_pixels, samples.stage(&RenderStats::project),
               samples.stage(&RenderStats::geometry), samples.stage(&RenderStats::read_back),
               samples.stage(&RenderStats::evaluation),
               1e6 * samples.stage(&RenderStats::evaluation) / static_cast<double>(last.evaluated_pixels),
               samples.frame(), samples.processor());
    std::fflush(stdout);
    rows.add("growth/" + name + "/geometry", samples.stage(&RenderStats::geometry), "ms");
    rows.add("growth/" + name + "/evaluation", samples.stage(&RenderStats::evaluation), "ms");
  };
  line(subject, full_size / 2, "pixels_1/4");
  // The root of a half is 0.7071.
  line(subject, V2i(1358, 764), "pixels_1/2");
  Subject finer = subject;
  for (int times = 1; times <= 16; times *= 4) {
    if (times > 1) {
      for (ScenePrimitive& primitive : finer.scene.primitives) subdivide(primitive);
    }
    line(finer, full_size, fmt::format("triangles_{}", times));
  }
}

/// What the fast powers save, and what they cost.
void fast_powers(const Subject& subject, bench::Rows& rows) {
  std::array<Frame, 2> last;
  std::array<Samples, 2> samples;
  for (const std::size_t kind : {0U, 1U}) {
    samples[kind] = need(draw(subject, RenderPath::hybrid, full_size, frames_of(RenderPath::hybrid),
                              static_cast<PowerKind>(kind), &last[kind]));
    fmt::print("| {} | {} | {:.1f} | {:.1f} | {:.1f} |", subject.name, power_names[kind],
               samples[kind].stage(&RenderStats::evaluation), samples[kind].frame(),
               samples[kind].processor());
    if (kind == 0) fmt::print(" | |\n");
  }
  const bench::PictureDifference apart = bench::difference(last[0], last[1]);
  fmt::print(" {:.3f} | {:.1f} |\n", apart.largest, apart.psnr);
  std::fflush(stdout);
  rows.add("frame/" + subject.name + "/hybrid/fast_power/processor", samples[1].processor(), "ms");
  rows.add("frame/" + subject.name + "/hybrid/fast_power/difference", apart.largest, "1/255");
}

std::vector<RenderPath> paths_of(const std::string& text) {
  std::vector<RenderPath> paths;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const auto name = std::find(path_names.begin(), path_names.end(), text.substr(begin, end - begin));
    if (name != path_names.end()) paths.push_back(static_cast<RenderPath>(name - path_names.begin()));
    begin = end + 1;
  }
  return paths;
}

}  // namespace

int main(int argc, char** argv) {
  bench::Rows rows(argc, argv);
  std::vector<RenderPath> paths{RenderPath::hybrid, RenderPath::paper, RenderPath::shader};
  std::vector<std::string> files = rows.arguments();
  if (files.size() > 1 && files[0] == "--paths") {
    paths = paths_of(files[1]);
    files.erase(files.begin(), files.begin() + 2);
  }
  bool others = false;
  if (files.size() > 1 && files[0] == "--rates") {
    bench::frame_rates(files[1], rows);
    files.erase(files.begin(), files.begin() + 2);
    others = true;
  }
  if (files.size() > 2 && files[0] == "--yarn") {
    bench::yarn_points(files[1], files[2], rows);
    files.erase(files.begin(), files.begin() + 3);
    others = true;
  }
  if (others && files.empty()) {
    rows.write();
    return 0;
  }
  if (files.empty() || paths.empty()) {
    fmt::print(stderr,
               "usage: selvedge-bench-view [--rows FILE] [--paths hybrid,paper,shader] [--rates SCENE.glb] "
               "[--yarn YARN.exr LAYERS.exr] SCENE.glb ...\n");
    return 2;
  }
  std::vector<Subject> subjects;
  for (const std::string& file : files) subjects.push_back(load(file));
  fmt::print(
      "{} x {}, {} threads, OSMesa, nearest texels, one tap; ms, medians\n\n"
      "| | path | covered | surfaces | project | geometry | read back | texels, frames, light | frame | "
      "processor | frame: times hybrid | processor: the same "
      "|\n|---|---|---|---|---|---|---|---|---|---|---|---|\n",
      full_size.x, full_size.y, thread_count());
  for (const Subject& subject : subjects) draw_by_all_paths(subject, paths, rows);
  fmt::print(
      "\nExact and fast powers, hybrid: ms, and how far frames are apart, of 255 and in dB\n\n"
      "| | powers | texels, frames, light | frame | processor | largest difference | PSNR "
      "|\n|---|---|---|---|---|---|---|\n");
  for (const Subject& subject : subjects) fast_powers(subject, rows);
  growth(subjects.front(), rows);
  fmt::print("\n");
  for (const Subject& subject : subjects) {
    for (const Fabric& fabric : subject.fabrics) evaluate_rates(fabric, subject.name, rows);
  }
  rows.write();
}
