// Fabrics as pages make them, by recipes: previews first, and with yarn that came to rest before, which the
// host remembers.
#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <type_traits>
#include <vector>

#include "converter/make/make.h"
#include "converter/stitch/yarn_mesh.h"
#include "format/base/digest.h"
#include "format/base/guard.h"
#include "format/base/json_text.h"
#include "format/web/host.h"

namespace selvedge {

enum class HostEvent : std::int32_t { refusal, remark, stitch, shape };

/// Takes bytes.
SELVEDGE_HOST(emit) void host_emit(HostEvent event, const char* bytes, std::size_t count);
/// Writes the shape of this key (key_of()) to host_input(), if there is one; whether there is.
SELVEDGE_HOST(recall) bool host_recall(const char* key);

namespace {

using Json = nlohmann::ordered_json;

std::string stitch_name;  ///< for messages

void emit(HostEvent event, const std::string& bytes) { host_emit(event, bytes.data(), bytes.size()); }

[[noreturn]] void refuse_option(const std::string& place, const std::string& why) {
  throw Failure{{Code::option_out_of_range, {}, place, why}};
}

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

/// Digest of all that relax() reads.
std::string key_of(StitchPattern pattern, RelaxOptions o) {
  Numbers all;
  all.pass(o.bending_length_radii, o.gap_radii, o.start_fraction, o.max_thickness_radii, o.in_plane_restoring,
           o.may_thin, o.steps, o.is_rough, pattern.period_mm.x, pattern.period_mm.y);
  all.pass(o.gauge_mm.x, o.gauge_mm.y, o.blocked_mm.x, o.blocked_mm.y);
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
           relaxed.pattern.period_mm.y, relaxed.free_mm.x, relaxed.free_mm.y, relaxed.stretch);
  for (Yarn& yarn : relaxed.pattern.yarns) {
    all.pass(yarn.radius_mm, yarn.flattening);
    all.pass_all(yarn.segments);
    all.pass_all(yarn.squeezes);
  }
}

/// Relaxes what the host does not remember, and hands it over: the key, and all that relax() changed.
RelaxResult relaxed_once(const StitchPattern& pattern, const RelaxOptions& options) {
  const std::string key = key_of(pattern, options);
  if (host_recall(key.data())) {
    RelaxResult relaxed{pattern};
    Numbers all(host_input());
    pass(relaxed, all);
    return relaxed;
  }
  RelaxResult relaxed = relax(pattern, options);
  Numbers all;
  pass(relaxed, all);
  emit(HostEvent::shape, key + all.bytes());
  return relaxed;
}

/// The same for a preview: much yarn roughly, and as if there were room.
RelaxResult relaxed_roughly(const StitchPattern& pattern, RelaxOptions options) {
  if (options.is_rough || host_recall(key_of(pattern, options).data())) return relaxed_once(pattern, options);
  options.is_rough = true;
  RelaxResult relaxed = relaxed_once(pattern, options);
  relaxed.radius_fraction = 1;
  relaxed.has_settled = true;
  relaxed.stretch = 0;
  return relaxed;
}

/// Reads the members that make.mjs documents.
MakeOptions read_recipe(Json& json, StitchSettings& settings) {
  const std::string quality = json.value("quality", std::string(default_quality));
  if (std::ranges::find(quality_names, quality) == quality_names.end())
    refuse_option("quality", "there is no \"" + quality + "\"");
  MakeOptions options = quality_named(quality);
  BakeOptions& bake = options.bake;
  for (auto& [name, value] : json.items()) {
    if (name == "stitch") {
      stitch_name = value.get<std::string>();
    } else if (name == "text") {
      if (!value.is_string()) refuse_option(name, "is no text");
    } else if (name == "set") {
      for (auto& [parameter, setting] : value.items()) {
        const std::string text = setting.is_string() ? setting.get<std::string>() : setting.dump();
        setting = recipe_value(text);
        if (!parse_setting(parameter + "=" + text, settings))
          refuse_option("--set " + parameter, "cannot be " + text);
      }
    } else if (name == "sides") {
      bake.both_sides = value == "both";
    } else if (name == "seed") {
      bake.seed = value.get<std::uint64_t>();
    } else if (name == "bytes") {
      options.file_bytes = value.get<std::uint64_t>();
      options.chooses_layers = false;
    } else if (name != "quality") {
      refuse_option(name, "there is no such member of a recipe");
    }
  }
  // Pairs by which layers are chosen, within bytes alone.
  bake.validation_pairs = options.chooses_layers || options.file_bytes ? bake.held_out_pairs : 0;
  bake.stores_yarns = true;
  return options;
}

/// The yarn over texels that are all the same: where these are as many as usual, the file is small.
Fabric preview_of(const Samples& samples, const MakeOptions& options) {
  const SideSamples front = side_samples(samples, Side::front);
  Fabric fabric = value_or_throw(fit(front.level, front.header, options.fit));
  const FabricLevel texel = std::exchange(fabric.levels, {}).front();
  for (int k = 3; k >= 0; --k) {
    FabricLevel& level = fabric.levels.emplace_back();
    level.width = level.height = 1 << k;
    level.copy_texels(texel, k);
    level.copied_from_coarser = false;
  }
  fabric.levels.front().set_yarns(std::make_shared<const Yarns>(samples.yarns, samples.header.period_mm));
  return fabric;
}

/// Makes the fabric of a recipe. A preview has the yarn as it came to rest, if that is known, and one texel.
void make(Json json, bool preview) {
  StitchSettings settings;
  MakeOptions options = read_recipe(json, settings);
  if (preview) {
    options = quality_named("draft");
    options.bake.width = options.bake.height = 1;
    options.bake.views = options.bake.lights = 16;
    options.bake.held_out_pairs = options.bake.validation_pairs = 0;
    options.bake.has_coarse_light = true;
  }
  const auto stage = [](std::string_view name) {
    return [name](double fraction) { host_progress(name.data(), name.size(), fraction); };
  };
  stage("relax")(0);
  if (json.contains("text"))
    emit(HostEvent::stitch, to_json(value_or_throw(describe_stitch(stitch_name))).dump());
  BakeOptions of_bake = options.bake;
  bool is_large = false;
  const auto adapt = [&](const auto& stitch) {
    if (preview) return;
    value_or_throw(set_texels(stitch.min_texels, stitch.repeats, false, stitch_name, options.bake, of_bake));
  };
  const FoundStitch stitch = value_or_throw(find_stitch(
      stitch_name, settings,
      [&](const StitchSize& size) {
        value_or_throw(check_room(size, stitch_name));
        adapt(size);
        reduce_pair_samples(of_bake);
        is_large = size.length_radii > 1000;
      },
      [&](const StitchPattern& pattern, RelaxOptions relaxation) {
        relaxation.progress = stage("relax");
        return preview && is_large ? relaxed_roughly(pattern, relaxation) : relaxed_once(pattern, relaxation);
      }));
  adapt(stitch);
  if (preview && is_large) of_bake.views = of_bake.lights = 9;
  const YarnCell cell = value_or_throw(yarn_cell_of(stitch.pattern));
  Json provenance = {{"software", "selvedge " SELVEDGE_VERSION}, {"stitch", stitch_name}};
  if (!preview) provenance["sheet"] = value_or_throw(sheet_of(stitch, cell.yarns, cell.period));
  provenance["recipe"] = recipe_of(stitch_name, stitch, json);
  const std::string text = provenance.dump(-1, ' ', false, Json::error_handler_t::replace);
  const Baked baked = value_or_throw(bake(cell, stitch_name, of_bake, text, stage("bake")));
  if (preview)
    return value_or_throw(write_fabric(stitch_name, preview_of(baked.samples, options), options.write));
  const FitOutcome fitted = value_or_throw(fit_fabric(baked.samples, options, stage("fit")));
  for (const auto* remarks : {&stitch.remarks, &baked.report.remarks})
    for (const std::string& remark : *remarks) emit(HostEvent::remark, remark);
  value_or_throw(write_fabric(stitch_name, fitted.fabric, options.write));
}

/// Makes the fabric of the recipe in host_input(), a file of its stitch's name; a refusal goes to the host.
void make_or_refuse(bool preview) {
  try {
    make(Json::parse(host_input()), preview);
  } catch (Failure& failure) {
    if (failure.error.file.empty()) failure.error.file = stitch_name;
    emit(HostEvent::refusal, to_line(failure.error));
  } catch (const std::exception& error) {
    emit(HostEvent::refusal, to_line({Code::json_malformed, stitch_name, {}, exception_message(error)}));
  }
}

}  // namespace

extern "C" {
[[clang::export_name("make")]] void make_fabric() { make_or_refuse(false); }
/// Makes one that looks about the same, in a fraction of the time.
[[clang::export_name("preview")]] void preview_fabric() { make_or_refuse(true); }
/// Hands the built-in stitches to the host.
[[clang::export_name("stitches")]] void emit_stitches() {
  for (const StitchInfo& info : built_in_stitches()) emit(HostEvent::stitch, to_json(info).dump());
}
}

}  // namespace selvedge
