// The WebAssembly module that makes fabrics of yarn: a recipe in, the bytes of a fabric file out (make.mjs).
//
// A refusal is told to the host and ends the instance: nothing is caught here (format/base/guard.h).
#include <cstdlib>
#include <ctime>
#include <nlohmann/json.hpp>
#include <optional>
#include <typeinfo>
#include <utility>

#include "converter/make/make.h"
#include "converter/make/stitch_bake.h"
#include "converter/stitch/text_fault.h"
#include "converter/stitch/yarn_mesh.h"
#include "converter/web/host.h"
#include "fitter/refit_to_pairs.h"
#include "format/base/json_text.h"
#include "format/base/parallel.h"

namespace selvedge {
namespace {

using Json = nlohmann::ordered_json;

std::string input_text;                  ///< the recipe, JSON
std::string stitch_name;                 ///< for messages
std::optional<std::string> stitch_text;  ///< the one file that there is

void tell(Told what, const std::string& text) { host_tell(what, text.data(), text.size()); }

[[noreturn]] void refuse(Error error) {
  if (error.file.empty()) error.file = stitch_name;
  tell(Told::refusal, to_line(error));
  std::abort();
}

[[noreturn]] void refuse_option(const std::string& place, const std::string& why) {
  throw Failure{{Code::option_out_of_range, {}, place, why}};
}

struct Recipe {
  StitchSettings settings;
  MakeOptions options;
  bool texels_given = false;
};

/// Reads the members that make.mjs documents.
Recipe read_recipe(const Json& json) {
  if (!json.is_object()) refuse_option("recipe", "is not a JSON object");
  Recipe recipe;
  const std::string quality = json.value("quality", std::string(default_quality));
  if (std::ranges::find(quality_names, quality) == quality_names.end())
    refuse_option("quality", "there is no \"" + quality + "\"");
  recipe.options = quality_named(quality);
  BakeOptions& bake = recipe.options.bake;
  for (const auto& [name, value] : json.items()) {
    if (name == "stitch") {
      stitch_name = value.get<std::string>();
    } else if (name == "text") {
      stitch_text = value.get<std::string>();
    } else if (name == "set") {
      for (const auto& [parameter, setting] : value.items()) {
        const std::string text = setting.is_string() ? setting.get<std::string>() : setting.dump();
        if (!parse_setting(parameter + "=" + text, recipe.settings))
          refuse_option("--set " + parameter, "cannot be " + text);
      }
    } else if (name == "texels") {
      bake.width = value.at(0).get<int>();
      bake.height = value.at(1).get<int>();
      recipe.texels_given = true;
    } else if (name == "sides") {
      bake.both_sides = value == "both";
    } else if (name == "seed") {
      bake.seed = value.get<std::uint64_t>();
    } else if (name != "quality") {
      refuse_option(name, "there is no such member of a recipe");
    }
  }
  // Pairs by which layers are chosen, within a budget alone.
  bake.validation_pairs = recipe.options.budget ? bake.held_out_pairs : 0;
  bake.yarns = true;
  return recipe;
}

void make(const Json& json) {
  Recipe recipe = read_recipe(json);
  BakeOptions& bake_options = recipe.options.bake;
  bool sized = false;
  const auto set_texels = [&](const auto& stitch) {
    if (!std::exchange(sized, true))
      value_or_throw(
          ensure_texels(stitch.min_texels, stitch.repeats, recipe.texels_given, stitch_name, bake_options));
  };
  const auto stage = [](std::int32_t number) {
    return [number](double fraction) { host_progress(number, fraction); };
  };
  stage(0)(0);
  const FoundStitch stitch =
      value_or_throw(find_stitch(stitch_name, recipe.settings, [&](const StitchSize& size) {
        set_texels(size);
        share_rays(bake_options);
      }));
  set_texels(stitch);
  const YarnCell cell = value_or_throw(yarn_cell_of(stitch.pattern));
  const Json provenance = {{"software", "selvedge " SELVEDGE_VERSION},
                           {"stitch", stitch_name},
                           {"sheet", value_or_throw(sheet_of(stitch, cell.yarns, cell.period))}};
  const Baked baked =
      value_or_throw(bake(cell, stitch_name, bake_options,
                          provenance.dump(-1, ' ', false, Json::error_handler_t::replace), stage(1)));
  const FitOutcome fitted = value_or_throw(fit_fabric(baked.samples, recipe.options, stage(2)));
  for (const auto* remarks : {&stitch.remarks, &baked.report.remarks})
    for (const std::string& remark : *remarks) tell(Told::remark, remark);
  for (const Error& warning : fitted.warnings) tell(Told::remark, to_line(warning));
  value_or_throw(write_fabric(stitch_name, fitted.fabric, recipe.options.write));
}

}  // namespace

// In place of sources with threads, files and Ceres.
void parallel_for(int begin, int end, const std::function<void(int)>& body) {
  for (int i = begin; i < end; ++i) body(i);
}
int thread_count() { return 1; }

Result<std::string> read_file(const std::string& path, std::uintmax_t limit) {
  if (!stitch_text) return fail(Code::file_missing, path, {}, "no such file");
  if (stitch_text->size() <= limit) return *stitch_text;
  return fail(Code::file_too_large, path, {}, "is too large");
}

void refit_to_pairs(Fabric&, const PairSamples&, int, const FitOptions&) {}  // no pairs are measured

extern "C" {
/// Room for the bytes of a recipe.
[[clang::export_name("input")]] char* input(std::size_t count) {
  input_text.resize(count);
  return input_text.data();
}

/// Makes the fabric of the recipe.
[[clang::export_name("make")]] void make_fabric() { make(Json::parse(input_text)); }

// The C++ runtime beside wasi-libc and libc++: what is thrown is a refusal; there are no clock, no files and
// one thread, and the instance ends with its fabric.
void* __cxa_allocate_exception(std::size_t size) { return std::malloc(size); }
void __cxa_throw(void* thrown, const std::type_info* type, void (*)(void*)) {
  if (*type == typeid(Failure)) refuse(std::move(static_cast<Failure*>(thrown)->error));
  refuse({Code::json_malformed, {}, {}, reason_of(*static_cast<const std::exception*>(thrown))});
}
int __cxa_thread_atexit(void (*)(void*), void*, void*) { return 0; }
int __cxa_atexit(void (*)(void*), void*, void*) { return 0; }
int clock_gettime(clockid_t, timespec* now) {
  *now = {};
  return 0;
}
}

}  // namespace selvedge
