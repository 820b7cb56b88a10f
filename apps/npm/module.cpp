// The program in WebAssembly: selvedge's verbs, with files and zlib by a host (run.js). What needs a library
// that is not there says so in a line.
#include <cstring>
#include <filesystem>
#include <functional>
#include <optional>
#include <string_view>
#include <type_traits>
#include <vector>

#include "apps/selvedge-view/commands.h"
#include "apps/selvedge-view/page.h"
#include "apps/selvedge/commands.h"
#include "apps/selvedge/make.h"
#include "converter/light/kept_light.h"
#include "converter/light/ray_scene.h"
#include "converter/stitch/yarn_relax.h"
#include "fitter/fit.h"
#include "format/base/digest.h"
#include "format/base/guard.h"
#include "format/base/progress.h"
#include "format/web/host.h"

namespace selvedge {

std::string& host_input() {
  static std::string text;
  return text;
}

/// Writes the shape of this key (key_of()) to host_input(), if there is one; whether there is.
SELVEDGE_HOST(recall) bool host_recall(const char* key);
/// Takes the shape of a key.
SELVEDGE_HOST(keep) void host_keep(const char* key, const char* bytes, std::size_t count);

namespace {

std::string shared_folder;

/// Numbers one after the other, which are written, or read again.
class Numbers {
 public:
  Numbers() = default;
  explicit Numbers(std::string_view bytes) : all_(bytes.size() / sizeof(double)), reads_(true) {
    std::memcpy(all_.data(), bytes.data(), bytes.size());
  }
  void pass(auto&... values) { (one(values), ...); }
  void pass_all(auto& list) {
    std::size_t count = list.size();
    pass(count);
    list.resize(count);
    auto* const first = reinterpret_cast<double*>(list.data());
    for (std::size_t i = 0; i < count * sizeof list[0] / sizeof(double); ++i) pass(first[i]);
  }
  std::string bytes() const {
    return {reinterpret_cast<const char*>(all_.data()), all_.size() * sizeof(double)};
  }

 private:
  void one(auto& value) {
    if (reads_)
      value = static_cast<std::remove_reference_t<decltype(value)>>(all_[at_++]);
    else
      all_.push_back(static_cast<double>(value));
  }
  std::vector<double> all_;
  std::size_t at_ = 0;
  bool reads_ = false;
};

/// Passes what knits have in common that differ in some stitches.
void pass_common(RelaxOptions& o, StitchPattern& pattern, Numbers& all) {
  all.pass(o.bending_length_radii, o.gap_radii, o.start_fraction, o.max_thickness_radii, o.in_plane_restoring,
           o.may_thin, o.steps, o.is_rough, pattern.period_mm.x, pattern.period_mm.y);
  all.pass(o.gauge_mm.x, o.gauge_mm.y, o.blocked_mm.x, o.blocked_mm.y);
}

/// Digest of all that relax() reads.
std::string key_of(StitchPattern pattern, RelaxOptions o) {
  Numbers all;
  pass_common(o, pattern, all);
  for (auto& parts : o.parts)
    for (KnitPart& part : parts) all.pass(part.is_loop, part.length_mm, part.segments);
  for (Yarn& yarn : pattern.yarns) {
    bool soft = yarn.fibre_kind != 0;
    all.pass(yarn.radius_mm, yarn.flattening, soft);
    all.pass_all(yarn.segments);
  }
  return digest_of(all.bytes());
}

/// Passes all that relax() changes.
void pass(RelaxResult& relaxed, Numbers& all) {
  all.pass(relaxed.radius_fraction, relaxed.has_settled, relaxed.pattern.period_mm.x,
           relaxed.pattern.period_mm.y, relaxed.free_mm.x, relaxed.free_mm.y, relaxed.stretch, relaxed.steps,
           relaxed.residual, relaxed.free_lean, relaxed.lean, relaxed.lean_repeats);
  for (Yarn& yarn : relaxed.pattern.yarns) {
    all.pass(yarn.radius_mm, yarn.flattening);
    all.pass_all(yarn.segments);
    all.pass_all(yarn.squeezes);
  }
}

void pass(RestedKnit& knit, Numbers& all) {
  std::size_t count = knit.parts.size();
  all.pass(count, knit.drawn.period_mm.x, knit.drawn.period_mm.y);
  knit.drawn.yarns.resize(count);
  knit.relaxed.pattern.yarns.resize(count);
  for (Yarn& yarn : knit.drawn.yarns) {
    all.pass(yarn.flattening);
    all.pass_all(yarn.segments);
  }
  for (auto* parts : {&knit.parts, &knit.relaxed.parts}) {
    parts->resize(count);
    for (auto& chain : *parts) {
      std::size_t of_chain = chain.size();
      all.pass(of_chain);
      chain.resize(of_chain);
      for (KnitPart& part : chain) all.pass(part.is_loop, part.length_mm, part.segments);
    }
  }
  pass(knit.relaxed, all);
}

/// relax(); of many stitches and roughly from the last knit of the same kind, if there is one, which this is
/// then.
RelaxResult relax_from_last(const StitchPattern& pattern, RelaxOptions options) {
  constexpr std::size_t many_stitches = 100;
  std::size_t stitches = 0;
  for (const auto& parts : options.parts) stitches += parts.size();
  if (stitches < many_stitches) return relax(pattern, options);
  RelaxOptions fine = options;
  fine.is_rough = false;
  StitchPattern common = pattern;
  Numbers kind;
  pass_common(fine, common, kind);
  const std::string key = digest_of(kind.bytes());
  RestedKnit last;
  if (options.is_rough && host_recall(key.data())) {
    Numbers all(host_input());
    pass(last, all);
    options.last = &last;
  }
  RelaxResult relaxed = relax(pattern, options);
  if (options.is_rough && !relaxed.is_edit) return relaxed;
  RestedKnit next{pattern, options.parts, relaxed};
  Numbers all;
  pass(next, all);
  const std::string bytes = all.bytes();
  host_keep(key.data(), bytes.data(), bytes.size());
  return relaxed;
}

/// relax(), or the host's memory of it: a page makes cloth of the same yarns many times. What the host does
/// not remember it gets: a digest of all that relax() reads, and all that that changed.
RelaxResult relaxed_once(const StitchPattern& pattern, const RelaxOptions& options) {
  const std::string key = key_of(pattern, options);
  if (host_recall(key.data())) {
    RelaxResult relaxed{pattern};
    Numbers all(host_input());
    pass(relaxed, all);
    return relaxed;
  }
  RelaxResult relaxed = relax_from_last(pattern, options);
  Numbers all;
  pass(relaxed, all);
  const std::string bytes = all.bytes();
  host_keep(key.data(), bytes.data(), bytes.size());
  return relaxed;
}

/// The same for a preview: what the host does not remember roughly, of large knits as an edit of the last one
/// of the same gauge, and as if there were room.
RelaxResult relaxed_roughly(const StitchPattern& pattern, const RelaxOptions& given) {
  RelaxOptions options = given;
  if (options.is_rough || host_recall(key_of(pattern, options).data())) return relaxed_once(pattern, options);
  options.is_rough = true;
  RelaxResult relaxed = relaxed_once(pattern, options);
  relaxed.radius_fraction = 1;
  relaxed.has_settled = true;
  relaxed.stretch = 0;
  relaxed.residual = 0;
  return relaxed;
}

/// The words of host_input(), each with '\0' behind it, but for the first two: the working folder and the
/// folder of page.html. Progress goes to the host.
std::vector<std::string> take_words() {
  std::vector<std::string> words;
  const std::string text = host_input();
  for (std::size_t at = 0; at < text.size(); at += words.back().size() + 1)
    words.emplace_back(text.data() + at);
  std::filesystem::working_folder = words[0];
  shared_folder = words[1];
  words.erase(words.begin(), words.begin() + 2);
  progress_sink = std::make_shared<const ProgressSink>(
      [](const std::string& label, double fraction) { host_progress(label.data(), label.size(), fraction); });
  default_relaxer = relaxed_once;
  return words;
}

/// The yarn over texels that are all the same: where these are as many as usual, the file is small, and those
/// of much yarn have room for its light.
Fabric preview_of(const Samples& samples, const MakeOptions& options) {
  const SideSamples front = side_samples(samples, Side::front);
  Fabric fabric = value_or_throw(fit(front.level, front.header, options.fit));
  const FabricLevel texel = std::exchange(fabric.levels, {}).front();
  constexpr int values_per_texel = 1 << 14;
  int size = 3;
  while (samples.header.yarns.stations * light_values_per_station >> 2 * size > values_per_texel) ++size;
  for (int k = size; k >= 0; --k) {
    FabricLevel& level = fabric.levels.emplace_back();
    level.width = level.height = 1 << k;
    level.copy_texels(texel, k);
    level.copied_from_coarser = false;
  }
  fabric.levels.front().set_yarns(std::make_shared<const Yarns>(samples.yarns, samples.header.period_mm));
  return fabric;
}

/// The fabric of --recolour, if there is one, and all of its yarn is in it.
std::optional<Fabric> last_fabric(const MakeCommand& command) {
  std::optional<Fabric> last;
  if (!command.recolour_path.empty()) last = value_or_throw(read_fabric(command.recolour_path));
  if (last && (!last->levels.front().yarns() || last->find_map() != nullptr)) last.reset();
  return last;
}

/// Writes the texels of the last fabric beneath yarn that differs from its yarn in some places; false: it
/// differs in more.
bool write_edited(const YarnCell& cell, const V2i& stitches, Fabric fabric, const MakeCommand& command) {
  const auto last = fabric.levels.front().yarns();
  YarnData yarns = cell.yarns;
  const V2f period(cell.period);
  if (!relight_near_changes(yarns, period, cell.wall_transmission, *last,
                            {fabric.find_side(Side::back) != nullptr, 32, 1}, period / V2f(stitches)))
    return false;
  fabric.thickness_mm = static_cast<float>(cell.thickness);
  fabric.levels.front().set_yarns(std::make_shared<const Yarns>(std::move(yarns), fabric.period_mm));
  value_or_throw(write_fabric(command.output, fabric, command.options.write));
  return true;
}

/// Makes a fabric with about the yarn of the one that these options ask for.
void make_preview(MakeCommand command) {
  MakeOptions options = quality_named("draft");
  BakeOptions& of_bake = options.bake;
  of_bake.width = of_bake.height = 1;
  of_bake.views = of_bake.lights = 16;
  of_bake.held_out_pairs = of_bake.validation_pairs = 0;
  of_bake.has_coarse_light = true;
  TerminalProgress relaxation("relax", true);
  TerminalProgress progress("bake", true);
  command.cell.form = StitchForm::yarn;
  command.cell.progress = relaxation.callback();
  const std::optional<Fabric> last = last_fabric(command);
  if (last)
    command.cell.kinds = {};
  else if (command.cell.kinds.by != KindLimit::By::none)
    command.cell.kinds = {KindLimit::By::size, 100};
  command.cell.on_start = [&](const StitchSize& size) {
    value_or_throw(check_room(size, command.input));
    if (size.is_sampler) {
      of_bake.width = size.min_texels.x;
      of_bake.height = size.min_texels.y;
      of_bake.validation_pairs = 16;
    }
    if (size.length_radii <= 1000) return;
    default_relaxer = relaxed_roughly;
    of_bake.views = of_bake.lights = 9;
  };
  const Cell cell = value_or_throw(find_cell(command.input, command.cell));
  if (last && write_edited(*cell.yarn, cell.stitch->min_texels, *last, command)) return;
  Baked baked = value_or_throw(bake(cell.yarn.value(), command.input, of_bake, "{}", progress.callback()));
  const bool has_map = !baked.samples.yarns.map.empty();
  value_or_throw(write_fabric(command.output,
                              has_map ? value_or_throw(fit_fabric(std::move(baked.samples), options)).fabric
                                      : preview_of(baked.samples, options),
                              options.write));
}

/// Makes a fabric from the one of --recolour: the yarn rests and is lit anew where it is another.
void make_edited(MakeCommand command) {
  const std::optional<Fabric> last = last_fabric(command);
  if (!last) throw Failure{{Code::option_out_of_range, command.recolour_path, {}, "has not all yarn"}};
  BakeOptions& of_bake = command.options.bake;
  of_bake.similar_yarn = last->levels.front().yarns();
  of_bake.held_out_pairs = of_bake.validation_pairs /= 3;
  command.recolour_path.clear();
  command.cell.kinds = {};
  default_relaxer = relaxed_roughly;
  make_file(command);
}

/// Gives a command of `make` in host_input() to `make`; returns 0, or 1.
int make_by(const std::function<void(MakeCommand)>& make) {
  const std::vector<std::string> words = take_words();
  const auto result = [&]() -> Result<void> {
    make(value_or_throw(make_command_of({words.begin() + 1, words.end()}, "", "")));
    return {};
  };
  return catch_exceptions("", result) ? 0 : 1;
}

int recoloured(Recolouring recolouring) {
  return make_by([recolouring](MakeCommand command) {
    command.recolouring = recolouring;
    // Only colours are taken of what is drawn.
    default_relaxer = [](const StitchPattern& drawn, const RelaxOptions&) {
      RelaxResult result{drawn};
      for (Yarn& yarn : result.pattern.yarns) yarn.hairiness = 0;
      return result;
    };
    make_file(command);
  });
}

}  // namespace

std::string shared_file(const std::string& name) { return shared_folder + "/" + name; }

Result<void> open_in_browser(const std::string& page) {
  host_open(page.data(), page.size());
  return {};
}

// In place of sources with Ceres and Embree.
void refit_to_pairs(Fabric&, const PairSamples& measured, int, const FitOptions&) {
  if (!measured.pairs.empty())
    throw Failure{{Code::option_out_of_range, {}, {}, "needs Ceres, which the native program alone has"}};
}
Result<RayScene> RayScene::create(const CellMesh&, const std::string& name) {
  return fail(Code::option_out_of_range, name, {}, "needs Embree, which the native program alone has");
}
// Nobody calls these.
const Imath::Box3f& RayScene::bounds() const { std::abort(); }
V2d RayScene::period() const { std::abort(); }
const CellMesh& RayScene::mesh() const { std::abort(); }
bool RayScene::trace(const V3d&, const V3d&, SurfacePoint&) const { std::abort(); }
bool RayScene::is_occluded(const SurfacePoint&, const V3f&) const { std::abort(); }
V3d RayScene::offset_origin(const SurfacePoint&) const { std::abort(); }
V3f RayScene::vertex_normal(const SurfacePoint&) const { std::abort(); }

extern "C" {
/// Room for bytes from the host.
[[clang::export_name("input")]] char* selvedge_input(std::size_t count) {
  host_input().resize(count);
  return host_input().data();
}

/// Runs the words of the program; returns the exit status.
[[clang::export_name("run")]] int selvedge_run() {
  const std::vector<std::string> words = take_words();
  std::vector<const char*> pointers{"selvedge"};
  for (const std::string& word : words) pointers.push_back(word.c_str());
  return run_selvedge(static_cast<int>(pointers.size()), pointers.data(), [](Program& program) {
    add_page_verb(program);
    add_design_verb(program);
  });
}

/// Makes what looks about like the fabric of a run of `make`, in a fraction of the time; returns 0, or 1: the
/// run tells why not.
[[clang::export_name("preview")]] int selvedge_preview() { return make_by(make_preview); }
/// The same from the fabric of --recolour, of nearly the same yarn.
[[clang::export_name("edit")]] int selvedge_edit() { return make_by(make_edited); }
/// The same of the same yarn in other colours.
[[clang::export_name("recolour")]] int selvedge_recolour() { return recoloured(Recolouring::rough); }
/// The same, at once and for a moment.
[[clang::export_name("tint")]] int selvedge_tint() { return recoloured(Recolouring::yarn); }
}

}  // namespace selvedge
