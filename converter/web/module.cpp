// The WebAssembly module that makes fabrics of yarn: a recipe in, the bytes of a fabric file out (make.mjs).
//
// A refusal is told to the host and ends the instance: nothing is caught here (format/base/guard.h).
#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <nlohmann/json.hpp>
#include <optional>
#include <typeinfo>

#include "converter/make/make.h"
#include "converter/stitch/yarn_mesh.h"
#include "fitter/refit_to_pairs.h"
#include "format/base/guard.h"
#include "format/base/json_text.h"
#include "format/base/parallel.h"
#include "format/exr/bytes.h"
#include "format/exr/size.h"

namespace selvedge {
namespace {

enum class Told : std::int32_t { fabric, refusal, remark, stitch };

/// Takes bytes. Does not return from a refusal.
extern "C" [[clang::import_module("host"), clang::import_name("tell")]] void host_tell(Told what,
                                                                                       const char* bytes,
                                                                                       std::size_t count);
/// The stage that runs (yarns come to rest, bake, fit), and the fraction of it that is done.
extern "C" [[clang::import_module("host"), clang::import_name("progress")]] void host_progress(
    std::int32_t stage, double fraction);
/// Packs bytes by zlib at level 4 to `out`, which has room for as many; returns the packed size, or `count`
/// where they do not get smaller.
extern "C" [[clang::import_module("host"), clang::import_name("deflate")]] std::size_t host_deflate(
    const std::uint8_t* bytes, std::size_t count, std::uint8_t* out);

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

/// Reads the members that make.mjs documents.
MakeOptions read_recipe(const Json& json, StitchSettings& settings) {
  const std::string quality = json.value("quality", std::string(default_quality));
  if (std::ranges::find(quality_names, quality) == quality_names.end())
    refuse_option("quality", "there is no \"" + quality + "\"");
  MakeOptions options = quality_named(quality);
  BakeOptions& bake = options.bake;
  for (const auto& [name, value] : json.items()) {
    if (name == "stitch") {
      stitch_name = value.get<std::string>();
    } else if (name == "text") {
      stitch_text = value.get<std::string>();
    } else if (name == "set") {
      for (const auto& [parameter, setting] : value.items()) {
        const std::string text = setting.is_string() ? setting.get<std::string>() : setting.dump();
        if (!parse_setting(parameter + "=" + text, settings))
          refuse_option("--set " + parameter, "cannot be " + text);
      }
    } else if (name == "sides") {
      bake.both_sides = value == "both";
    } else if (name == "seed") {
      bake.seed = value.get<std::uint64_t>();
    } else if (name != "quality") {
      refuse_option(name, "there is no such member of a recipe");
    }
  }
  // Pairs by which layers are chosen, within a budget alone.
  bake.validation_pairs = options.budget ? bake.held_out_pairs : 0;
  bake.yarns = true;
  return options;
}

void make(const Json& json) {
  StitchSettings settings;
  const MakeOptions options = read_recipe(json, settings);
  const auto stage = [](std::int32_t number) {
    return [number](double fraction) { host_progress(number, fraction); };
  };
  stage(0)(0);
  if (stitch_text) tell(Told::stitch, to_json(value_or_throw(describe_stitch(stitch_name))).dump());
  BakeOptions of_bake = options.bake;
  const auto adapt = [&](const auto& stitch) {
    value_or_throw(set_texels(stitch.min_texels, stitch.repeats, false, stitch_name, options.bake, of_bake));
  };
  const FoundStitch stitch = value_or_throw(find_stitch(stitch_name, settings, [&](const StitchSize& size) {
    adapt(size);
    share_rays(of_bake);
  }));
  adapt(stitch);
  const YarnCell cell = value_or_throw(yarn_cell_of(stitch.pattern));
  const Json provenance = {{"software", "selvedge " SELVEDGE_VERSION},
                           {"stitch", stitch_name},
                           {"sheet", value_or_throw(sheet_of(stitch, cell.yarns, cell.period))}};
  const std::string text = provenance.dump(-1, ' ', false, Json::error_handler_t::replace);
  const Baked baked = value_or_throw(bake(cell, stitch_name, of_bake, text, stage(1)));
  const FitOutcome fitted = value_or_throw(fit_fabric(baked.samples, options, stage(2)));
  for (const auto* remarks : {&stitch.remarks, &baked.report.remarks})
    for (const std::string& remark : *remarks) tell(Told::remark, remark);
  for (const Error& warning : fitted.warnings) tell(Told::remark, to_line(warning));
  value_or_throw(write_fabric(stitch_name, fitted.fabric, options.write));
}

}  // namespace

// In place of sources with OpenEXR, zlib, threads, files and Ceres.
struct ExrWriter::State {
  std::string path;
  std::vector<ExrPart> parts;
  std::string chunks;               ///< part by part, level by level
  std::vector<std::size_t> places;  ///< where each begins
};

Result<ExrWriter> ExrWriter::create(const std::string& path, std::vector<ExrPart> parts) {
  for (ExrPart& part : parts) part = exr_with_defaults(std::move(part));
  return ExrWriter(std::make_shared<State>(State{path, std::move(parts), {}, {}}));
}

Result<void> ExrWriter::write_level(int index, int level, const ExrPixels& pixels) {
  const ExrPart& part = state_->parts[index];
  if (auto sound = check_halves(part, pixels, state_->path); !sound) return sound;
  for (const ExrChunk& chunk : exr_chunks(part)) {
    if (chunk.level != level) continue;
    const std::vector<std::uint8_t> packed = exr_packed_chunk(part, chunk, pixels);
    state_->places.push_back(state_->chunks.size());
    state_->chunks +=
        part.mipmapped ? exr_numbers({index, chunk.x, chunk.y, level, level}) : exr_numbers({index, chunk.y});
    state_->chunks += exr_numbers({static_cast<std::int32_t>(packed.size())});
    state_->chunks.append(packed.begin(), packed.end());
  }
  return {};
}

Result<void> ExrWriter::commit() {
  std::string file = exr_headers(state_->parts);
  const std::size_t first = file.size() + 8 * state_->places.size();
  for (const std::size_t place : state_->places)
    file += exr_numbers({static_cast<std::int32_t>(first + place), 0});
  tell(Told::fabric, file + state_->chunks);
  return {};
}

std::vector<std::uint8_t> exr_deflated(std::span<const std::uint8_t> bytes) {
  std::vector<std::uint8_t> packed(bytes.size());
  packed.resize(host_deflate(bytes.data(), bytes.size(), packed.data()));
  return packed;
}

void parallel_for(int begin, int end, const std::function<void(int)>& body) {
  for (int i = begin; i < end; ++i) body(i);
}
int thread_count() { return 1; }

Result<std::string> read_file(const std::string& path, std::uintmax_t) {
  if (stitch_text) return *stitch_text;
  return fail(Code::file_missing, path, {}, "no such file");
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
