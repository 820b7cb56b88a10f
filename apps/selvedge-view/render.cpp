// render: draws a scene, or a swatch of a fabric, to PNG and EXR files.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "apps/selvedge-view/commands.h"
#include "apps/selvedge-view/shot.h"
#include "format/base/atomic_file.h"
#include "format/base/guard.h"
#include "format/base/option_text.h"
#include "format/base/parallel.h"
#include "format/base/progress.h"
#include "viewer/renderer.h"
#include "viewer/scene/change_fabrics.h"

namespace selvedge {
namespace {

namespace fs = std::filesystem;

/// Whether `mark` was there.
bool replace_all(std::string& text, const std::string& mark, const std::string& value) {
  bool found = false;
  for (std::size_t at = 0; (at = text.find(mark, at)) != std::string::npos; at += value.size()) {
    text.replace(at, mark.size(), value);
    found = true;
  }
  return found;
}

/// Replaces %d and %04d. Whether there was one.
bool replace_number(std::string& text, int number) {
  const std::size_t at = text.find('%');
  if (at == std::string::npos) return false;
  std::size_t end = at + 1;
  int digits = 0;
  const bool has_digits = text[end] == '0' && std::isdigit(static_cast<unsigned char>(text[end + 1])) != 0;
  if (has_digits) {
    digits = text[end + 1] - '0';
    end += 2;
  }
  if (text[end] != 'd') return false;
  text.replace(at, end + 1 - at, fmt::format("{:0{}}", number, digits));
  return true;
}

/// One picture's part of the names.
struct SeriesPlace {
  std::string frame;    ///< for {frame}, four digits or "top"; empty: the only one
  int number = 0;       ///< for %d and %04d
  std::string variant;  ///< for {variant}, file_safe(); empty: the only one
};

/// A name with each character of the world but those that a file system, a shell or a URL takes for another
/// thing.
std::string file_safe(const std::string& name) {
  std::string safe = name;
  for (char& c : safe) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x80 && std::isalnum(byte) == 0 && c != '.' && c != '_' && c != '-') c = '-';
  }
  if (safe.empty() || safe.front() == '.') safe.insert(0, "-");
  return safe;
}

/// Such names of all, with numbers behind those that would be equal, whatever their case.
std::vector<std::string> file_safe(const std::vector<std::string>& names) {
  std::vector<std::string> safe;
  std::set<std::string> taken;
  for (const std::string& name : names) {
    const std::string stem = file_safe(name);
    std::string one = stem;
    const auto key = [](std::string text) {
      for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
      return text;
    };
    for (int number = 2; !taken.insert(key(one)).second; ++number) one = fmt::format("{}-{}", stem, number);
    safe.push_back(one);
  }
  return safe;
}

/// The file of a picture: {frame}, {variant} and %04d of the pattern are replaced; without a place for the
/// frame it follows the stem: "red.png" is "red-0001.png".
std::string series_path(const std::string& pattern, const SeriesPlace& place) {
  std::string path = pattern;
  if (!place.variant.empty()) replace_all(path, "{variant}", place.variant);
  if (place.frame.empty()) return path;
  const bool is_numbered = replace_number(path, place.number);
  if (replace_all(path, "{frame}", place.frame) || is_numbered) return path;
  const std::size_t dot = path.find_last_of('.');
  return fmt::format("{}-{}{}", path.substr(0, dot), place.frame, path.substr(dot));
}

/// Temporary files, in folders that are made where they are missing, and removed unless the files are
/// committed.
class SeriesFiles {
 public:
  SeriesFiles() = default;
  SeriesFiles& operator=(SeriesFiles&&) = delete;
  ~SeriesFiles() {
    files_.clear();
    std::error_code ignored;  // folders that are not empty stay
    for (; !folders_.empty(); folders_.pop_back()) fs::remove(folders_.back(), ignored);
  }
  /// Throws FILE_UNWRITABLE.
  const AtomicFile& add(const std::string& path) {
    std::vector<fs::path> missing;
    std::error_code error;
    for (fs::path folder = fs::path(path).parent_path(); !folder.empty() && !fs::exists(folder, error);
         folder = folder.parent_path())
      missing.push_back(folder);
    for (; !missing.empty(); missing.pop_back()) {
      const fs::path& folder = missing.back();
      if (!fs::create_directory(folder, error))
        throw Failure{{Code::file_unwritable, folder.string(), "", "the folder cannot be made"}};
      folders_.push_back(folder.string());
    }
    return files_.emplace_back(value_or_throw(AtomicFile::create(path)));
  }
  const AtomicFile& at(std::size_t number) const { return files_[number]; }
  Result<void> commit() { return commit_all(std::move(files_)); }

 private:
  std::vector<std::string> folders_;
  std::vector<AtomicFile> files_;
};

/// Maximum number of files of one run.
constexpr std::size_t max_files = 20000;
/// Chunk of PNG files with RunKey::digest().
constexpr const char* key_name = "selvedge run";

/// Writes a frame to `path` in the format of the name `like`.
Result<void> write(const DisplayOptions& display, const Frame& frame, const std::string& like,
                   const std::string& path, const std::string& key) {
  if (has_ending(like, ".exr")) return write_exr(path, to_linear_image(frame));
  auto png = value_or_throw(encode_png(to_display_image(frame, display)));
  if (!key.empty()) add_png_text(key_name, key, png);
  return write_file(path, png);
}

void write_to_output(const DisplayOptions& display, const Frame& frame) {
  const auto bytes = value_or_throw(encode_png(to_display_image(frame, display)));
  if (std::fwrite(bytes.data(), 1, bytes.size(), stdout) != bytes.size() || std::fflush(stdout) != 0)
    throw Failure{{Code::file_unwritable, "standard output", "", "cannot be written"}};
}

struct Drawn {
  RenderStats stats;        ///< sums over the frames
  AccuratePicture picture;  ///< the first one
  std::vector<std::string> outputs;
  Json pictures = Json::array();
  float brightest = 0;  ///< sRGB value of the frames, over black
  double write_seconds = 0;
};

/// The largest sRGB value of a frame over black.
float brightest(const Frame& frame, DisplayOptions display) {
  display.background = V3f(0, 0, 0);
  const Image image = to_display_image(frame, display);
  return linear_to_srgb(std::ranges::max(image.pixels));
}

/// Variants that a scene wears with one set of images: they differ by tints.
struct VariantGroup {
  Scene scene;  ///< in the first
  std::vector<std::size_t> variants;
};

/// Draws all pictures, each by itself the one that its frame and variant alone give.
class Series {
 public:
  Series(const RenderCommand& command, Shot& shot) : command_(command), shot_(shot) {
    goal_.display = shot.look.display;
    std::vector<std::string> names;
    for (const ShotVariant& variant : shot.variants) names.push_back(variant.name);
    variant_names_ = file_safe(names);
    if (shot.variants.size() * shot.frames.size() * command.outputs.size() > max_files)
      throw Failure{
          {Code::option_out_of_range, "", "--output", fmt::format("are more than {} files", max_files)}};
    if (command.streams()) return;
    for (std::size_t v = 0; v < shot.variants.size(); ++v)
      for (const ShotFrame& frame : shot.frames)
        for (const std::string& output : command.outputs)
          paths_.push_back(series_path(output, place_of(v, frame)));
    is_kept_ = !key_.empty() && std::ranges::all_of(paths_, [&](const std::string& path) {
      return png_text(path, key_name) == key_;
    });
    if (is_kept_) return;
    // All are opened before the work, so that an unwritable folder is reported first.
    for (std::string& path : paths_) path = files_.add(path).path();
    for (std::size_t i = 0; i < paths_.size(); ++i)
      if (!by_path_.emplace(file_identity(paths_[i]), i).second)
        throw Failure{{Code::option_out_of_range, "", "--output",
                       fmt::format("{} is the file of two pictures; name it by {{frame}}", paths_[i])}};
  }

  /// Whether --if-changed keeps all files, which the report then names.
  bool is_kept() const { return is_kept_; }

  Drawn draw() {
    for (VariantGroup& group : groups()) draw(group);
    value_or_throw(files_.commit());
    drawn_.outputs = paths_;
    return std::move(drawn_);
  }

 private:
  SeriesPlace place_of(std::size_t variant, const ShotFrame& frame) const {
    return {frame.name, frame.number, command_.has_variants() ? variant_names_[variant] : ""};
  }

  std::vector<VariantGroup> groups() const {
    std::vector<VariantGroup> groups;
    for (std::size_t i = 0; i < shot_.variants.size(); ++i) {
      Scene scene = worn_scene(shot_, shot_.variants[i]);
      const auto same = std::ranges::find_if(
          groups, [&](const VariantGroup& group) { return differ_by_tints(group.scene, scene); });
      // A picture for a time is drawn alone.
      if (same != groups.end() && !goal_.seconds)
        same->variants.push_back(i);
      else
        groups.push_back({std::move(scene), {i}});
    }
    return groups;
  }

  void draw(VariantGroup& group) {
    const Stopwatch preparing;
    if (shot_.motion) pose(command_, shot_, shot_.frames[0], group.scene);
    const auto wear = [&](std::size_t variant) {
      if (const int index = shot_.variants[variant].variant; index >= 0)
        value_or_throw(wear_variant(index, group.scene));
    };
    double time = shot_.frames[0].time;
    wear(group.variants[0]);
    const auto renderer = value_or_throw(Renderer::create(group.scene, shot_.fabrics, shot_.options));
    if (goal_.seconds) *goal_.seconds -= preparing.seconds();
    RenderOptions options = shot_.options;
    std::vector<Frame> pictures;
    for (ShotFrame& frame : shot_.frames) {
      if (shot_.motion) pose(command_, shot_, frame, group.scene);
      if (shot_.motion && frame.time != time) {
        wear(group.variants[0]);
        value_or_throw(renderer->replace(group.scene));
        time = frame.time;
      }
      std::vector<Tints> tints;
      for (const std::size_t variant : group.variants) {
        wear(variant);
        tints.push_back(tints_of(group.scene));
      }
      options.lights = shot_.look.all_lights(frame.camera);
      RenderStats stats;
      const auto made = value_or_throw(
          draw_for_goal(*renderer, goal_, options, frame.camera, options, tints, pictures, stats));
      if (drawn_.pictures.empty()) drawn_.picture = made[0];
      accumulate(stats, drawn_.stats);
      Stopwatch watch;
      for (std::size_t i = 0; i < pictures.size(); ++i) write(frame, group.variants[i], pictures[i], made[i]);
      watch.add_lap(drawn_.write_seconds);
    }
  }

  void write(const ShotFrame& frame, std::size_t variant, const Frame& picture, const AccuratePicture& made) {
    const DisplayOptions& display = shot_.look.display;
    drawn_.brightest = std::max(drawn_.brightest, brightest(picture, display));
    Json row;
    if (command_.has_variants()) row["variant"] = shot_.variants[variant].name;
    if (!frame.name.empty()) row["frame"] = frame.name;
    if (shot_.motion) row["time"] = frame.time;
    if (frame.view)
      row["camera"] = {{"azimuth", frame.view->azimuth},
                       {"elevation", frame.view->elevation},
                       {"lookAt", *frame.view->look_at},
                       {"distance", *frame.view->distance}};
    row["supersample"] = made.supersample;
    if (command_.streams()) write_to_output(display, picture);
    for (std::size_t i = 0; i < command_.outputs.size() && !command_.streams(); ++i) {
      const std::string path = series_path(command_.outputs[i], place_of(variant, frame));
      row["file"] = path;
      value_or_throw(selvedge::write(display, picture, path,
                                     files_.at(by_path_.at(file_identity(path))).temporary_path(), key_)
                         .map_error([&](Error error) {
                           error.file = path;
                           return error;
                         }));
      drawn_.pictures.push_back(row);
    }
    ++written_;
    if (const Progress progress = progress_.callback())
      progress(static_cast<double>(written_) /
               static_cast<double>(shot_.variants.size() * shot_.frames.size()));
  }

  const RenderCommand& command_;
  std::string key_ = command_.key.digest();
  Shot& shot_;
  PictureGoal goal_ = command_.goal;
  TerminalProgress progress_{"pictures", command_.common.quiet};
  std::vector<std::string> variant_names_;
  SeriesFiles files_;
  std::vector<std::string> paths_;
  std::map<std::string, std::size_t> by_path_;
  std::size_t written_ = 0;
  bool is_kept_ = false;
  Drawn drawn_;
};

constexpr float black = 2.0F / 255;

/// Whether the first frame, drawn small and without the fabrics, is black.
bool is_black_undressed(const Shot& shot) {
  Scene scene = shot.scene;
  for (SceneMaterial& material : scene.materials) material.fabric.reset();
  RenderOptions options = shot.options;
  options.width = 64;
  options.height = std::max(1, 64 * shot.options.height / shot.options.width);
  options.supersample = 1;
  options.lights = shot.look.all_lights(shot.frames[0].camera);
  const Frame frame = value_or_throw(render(scene, {}, shot.frames[0].camera, options));
  return brightest(frame, shot.look.display) < black;
}

/// Why a picture shows next to nothing, in a line; or empty.
std::string emptiness(const RenderCommand& command, const Shot& shot, const Drawn& drawn) {
  const RenderStats& stats = drawn.stats;
  if (stats.covered_pixels == 0)
    return "no pixel shows the scene: it is out of the camera's sight, or all clear";
  const bool dressed = std::ranges::any_of(shot.scene.materials,
                                           [](const auto& material) { return material.fabric.has_value(); });
  if (dressed && stats.cloth_pixels == 0) return "no pixel shows cloth";
  if (drawn.brightest < black)
    return dressed && !is_black_undressed(shot)
               ? "the picture is black; without its fabrics the scene is not"
               : "the picture is black: the light, the exposure or all colours are";
  const double fraction = static_cast<double>(stats.cloth_pixels) / static_cast<double>(stats.covered_pixels);
  const PictureOptions& picture = command.picture;
  const bool is_default = !command.has_view_angles && command.file_camera.empty() &&
                          picture.camera.zoom == 1 && !picture.camera.distance && !picture.camera.look_at;
  if (dressed && is_default && fraction < 0.01)
    return fmt::format("cloth shows in {:.2g} % of the pixels that show the scene", 100 * fraction);
  return "";
}

Json to_json(const RenderStats& stats) {
  Json json;
  for (const auto& [name, seconds] : render_seconds) json[name] = stats.*seconds;
  return json;
}

/// dB of the least accurate yarn against its stitch (spec/fabric.md); infinite where nothing is known.
double yarn_accuracy(const Shot& shot) {
  double least = HUGE_VAL;
  if (shot.options.path == RenderPath::paper || shot.options.levels.forced_level >= 0) return least;
  for (const Fabric& fabric : shot.fabrics) {
    if (!fabric.levels.front().yarns()) continue;
    const Json accuracy = Json::parse(fabric.accuracy);
    if (accuracy.contains("yarn") && accuracy["yarn"].is_number())
      least = std::min(least, accuracy["yarn"].get<double>());
  }
  return least;
}

/// JSON has no infinite numbers.
Json known(double decibels) { return std::isfinite(decibels) ? Json(decibels) : Json(nullptr); }

Json to_json(const RenderCommand& command, const Shot& shot, const Drawn& drawn) {
  const RenderStats& stats = drawn.stats;
  const double picture = drawn.picture.accuracy_db > 0 ? drawn.picture.accuracy_db : HUGE_VAL;
  const double yarn = yarn_accuracy(shot);
  const double both = -10 * std::log10(std::pow(10, -picture / 10) + std::pow(10, -yarn / 10));
  return {{"input", command.picture.input},
          {"outputs", drawn.outputs},
          {"pictures", drawn.pictures},
          {"width", shot.options.width},
          {"height", shot.options.height},
          {"frames", shot.frames.size()},
          {"supersample", drawn.picture.supersample},
          {"magnified", drawn.picture.magnification},
          {"accuracy", known(picture)},
          {"yarnAccuracy", known(yarn)},
          {"bothAccuracies", known(std::isfinite(picture) && std::isfinite(yarn) ? both : HUGE_VAL)},
          {"path", path_names[static_cast<std::size_t>(shot.options.path)]},
          {"threads", thread_count()},
          {"fabrics", shot.fabrics.size()},
          {"fabricMemory", shot.fabric_memory},
          {"triangles", stats.triangles},
          {"layers", stats.layers},
          {"coveredPixels", stats.covered_pixels},
          {"evaluatedPixels", stats.evaluated_pixels},
          {"imageBytes", stats.peak_image_bytes},
          {"seconds", to_json(stats)}};
}

Result<int> run(const RenderCommand& command) {
  limit_mesa_threads(command.common.threads);
  const Stopwatch watch;
  Shot shot = read_shot(command);
  const double read = watch.seconds();
  Series series(command, shot);
  if (series.is_kept()) {
    report(command.common, "render", {{"outputs", command.outputs}, {"kept", true}}, "");
    return 0;
  }
  const Drawn drawn = series.draw();
  Json all = to_json(command, shot, drawn);
  std::vector<std::string> remarks = shot.scene.remarks;
  remarks.insert(remarks.end(), drawn.stats.remarks.begin(), drawn.stats.remarks.end());
  if (drawn.picture.magnification > 1)
    remarks.push_back(
        fmt::format("--seconds allows one ray for {0} x {0} pixels, magnified", drawn.picture.magnification));
  if (std::string empty = emptiness(command, shot, drawn); !empty.empty())
    remarks.push_back(std::move(empty));
  all["remarks"] = remarks;
  const auto environment =
      shot.look.environment ? shot.look.environment->remarks : std::vector<std::string>();
  for (const std::string& remark : environment)
    all["remarks"].push_back(shot.look.environment_name + ": " + remark);
  report_remarks(command.common, "note", remarks);
  report_remarks(command.common, shot.look.environment_name, environment);
  all["seconds"]["read"] = read;
  all["seconds"]["write"] = drawn.write_seconds;
  all["seconds"]["total"] = watch.seconds();
  if (!command.streams()) report(command.common, "render", all, "");
  return 0;
}

}  // namespace

void limit_mesa_threads(int threads) {
  if (threads > 0) setenv("LP_NUM_THREADS", fmt::format("{}", threads).c_str(), 0);
}

void add_render_verb(Program& program) {
  program.add<RenderCommand>(
      {"render", "Draw a scene, or a swatch of a fabric, into PNG and EXR files",
       "selvedge-view render sweater.glb -o sweater.png --size 1280x960 --azimuth 30\n"
       "selvedge-view render knit.fabric.exr -o knit.exr --repeats 4x4 --light 0,0.5,1 --view 0,-1,1\n"
       "selvedge-view render sweater.glb --turntable 4 --top -o spin-{frame}.png --size 320x320",
       "PNG: radiance * exposure, tone curve, over the background, clipped, sRGB.\n"
       "EXR: linear radiance * opacity, and opacity.\n"
       "Tone curves of an exposed colour c: neutral is Khronos PBR Neutral (2024), which keeps saturated "
       "colours;\n"
       "agx is AgX (Sobotka 2022) as in Blender and three.js, where bright colours turn white.\n"},
      declare_render, run);
}

}  // namespace selvedge
