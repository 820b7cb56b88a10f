#include "format/quality/fit_record.h"

#include <fmt/format.h>

#include <limits>
#include <stdexcept>
#include <utility>

#include "format/base/atomic_file.h"
#include "format/base/json_text.h"
#include "format/fabric/json_parts.h"
#include "format/fabric/names.h"

namespace selvedge {
namespace {

using nlohmann::json;
namespace member = names::member;

/// A number without the digits that are noise. Parsed from text, so that 19.16 does not become
/// 19.160000000000004.
json short_number(const char* form, double value) {
  return json::parse(fmt::format(fmt::runtime(form), value));
}

json error_json(const FitError& error) {
  return {{member::pairs, error.pairs},
          {member::psnr, short_number("{:.2f}", error.psnr)},
          {member::relative_l2, short_number("{:.4f}", error.relative_l2)}};
}

json level_json(const LevelReport& level) {
  json text = {{member::layers, level.layers}, {member::bytes, level.bytes}};
  if (level.held_out) text[member::held_out] = error_json(*level.held_out);
  if (level.training) text[member::training] = error_json(*level.training);
  if (level.validation) {
    text[member::validation_error] = short_number("{:.4e}", *level.validation);
  }
  if (level.iterations) text[member::iterations] = short_number("{:.1f}", *level.iterations);
  if (level.converged) text[member::converged] = *level.converged;
  if (level.at_limit) text[member::at_limit] = *level.at_limit;
  return text;
}

std::string with_record(const std::string& provenance, const FitRecord& record) {
  json text = provenance_json(provenance);
  json& fit = text[member::fit];
  if (!fit.is_object()) fit = json::object();
  fit[member::peak] = short_number("{:.6g}", record.peak);
  const auto list = [](const std::vector<LevelReport>& levels) {
    json reports = json::array();
    for (const LevelReport& level : levels) reports.push_back(level_json(level));
    return reports;
  };
  fit[member::levels] = list(record.levels);
  fit.erase(member::sides);
  for (const Side side : other_sides) {
    const auto& levels = record.sides[index_of(side) - 1];
    if (!levels.empty()) fit[member::sides][name_of(side)] = list(levels);
  }
  fit[member::warnings] = json::array();
  for (const Error& warning : record.warnings) {
    fit[member::warnings].push_back({{member::code, name_of(warning.code)},
                                     {member::place, warning.place},
                                     {member::message, warning.message}});
  }
  return text.dump();
}

// The readers of a record throw where a member is not as spec/fabric.md has it.

template <class T>
T whole_number(const json& value) {
  if (!value.is_number_integer() || value < 0 || value > std::numeric_limits<T>::max())
    throw std::range_error("not a whole number of 0 or more");
  return value.get<T>();
}

double number(const json& value) { return value.get<double>(); }

FitError error_of(const json& value) {
  return {whole_number<int>(value.at(member::pairs)), number(value.at(member::psnr)),
          number(value.at(member::relative_l2))};
}

/// What `read` makes of a member, if the object has it.
template <class Read>
auto optional_member(const json& object, const char* key, const Read& read) {
  const auto found = object.find(key);
  return found == object.end() ? std::nullopt : std::optional(read(*found));
}

LevelReport level_of(const json& object) {
  LevelReport level;
  level.layers = object.at(member::layers).get<std::string>();
  level.bytes = static_cast<std::uint64_t>(whole_number<std::int64_t>(object.at(member::bytes)));
  level.held_out = optional_member(object, member::held_out, error_of);
  level.training = optional_member(object, member::training, error_of);
  level.validation = optional_member(object, member::validation_error, number);
  level.iterations = optional_member(object, member::iterations, number);
  level.converged = optional_member(object, member::converged, whole_number<int>);
  level.at_limit = optional_member(object, member::at_limit, whole_number<int>);
  return level;
}

std::vector<LevelReport> levels_of(const json& list, int count) {
  if (!list.is_array() || std::cmp_not_equal(list.size(), count))
    throw std::range_error("not of as many levels as the fabric has");
  std::vector<LevelReport> levels;
  for (const json& level : list) levels.push_back(level_of(level));
  return levels;
}

std::optional<Code> code_named(const std::string& name) {
  for (const CodeRow& row : code_table()) {
    if (row.name == name) return row.code;
  }
  return std::nullopt;
}

FitRecord record_of(const json& fit, int levels) {
  FitRecord record;
  record.peak = number(fit.at(member::peak));
  record.levels = levels_of(fit.at(member::levels), levels);
  const auto sides = fit.value(member::sides, json::object_t());
  for (const Side side : other_sides) {
    const auto list = sides.find(name_of(side));
    if (list != sides.end()) record.sides[index_of(side) - 1] = levels_of(list->second, levels);
  }
  for (const json& warning : fit.at(member::warnings).get_ref<const json::array_t&>()) {
    const auto text = [&](const char* key) { return warning.at(key).get<std::string>(); };
    const auto code = code_named(text(member::code));
    if (code) record.warnings.push_back({*code, {}, text(member::place), text(member::message)});
  }
  return record;
}

/// Layers and sizes of every level of a file.
Result<void> read_sizes(const std::string& path, const Fabric& fabric, FitRecord& record) {
  const auto reader = FabricReader::open(path);
  if (!reader) return tl::unexpected(reader.error());
  for_each_side(fabric, [&](const Fabric& side) {
    auto& levels = side.side == Side::front ? record.levels : record.sides[index_of(side.side) - 1];
    levels.resize(side.levels.size());
    for (std::size_t k = 0; k < levels.size(); ++k) {
      levels[k].layers = layers_text(side.levels[k]);
      levels[k].bytes = 0;
      for (const LayerKind layer : all_layers) {
        if (layers_of_no_level.contains(layer)) continue;
        levels[k].bytes += reader->packed_bytes(layer, static_cast<int>(k), side.side);
      }
    }
  });
  return {};
}

}  // namespace

std::string layers_text(const FabricLevel& level) {
  std::string text;
  const auto join = [&](const char* between, const std::string& more) {
    text += (text.empty() ? "" : between) + more;
  };
  if (level.has(LayerKind::lobes)) {
    const int lobes = level.lobe_count();
    text = lobes == 0 ? "diffuse" : fmt::format("{} lobe{}", lobes, lobes == 1 ? "" : "s");
  }
  if (level.has(LayerKind::table)) join(" x ", "table");
  if (level.has(LayerKind::light)) join(" x ", "light table");
  if (level.has(LayerKind::products)) join(", ", fmt::format("{} products", level.pairs.size()));
  return text.empty() ? "constant" : text;
}

Result<void> measure_errors(const Fabric& fabric, const PairSamples& held_out, const PairSamples& training,
                            double& peak, std::vector<LevelReport>& levels) {
  levels.resize(fabric.levels.size());
  const auto measure_on = [&](const PairSamples& pairs, std::optional<FitError> LevelReport::*error) {
    if (pairs.pairs.empty()) return Result<void>();
    const auto comparison = compare(fabric, pairs, PairKind::held_out, peak);
    if (!comparison) return Result<void>(tl::unexpected(comparison.error()));
    peak = comparison->peak;
    for (std::size_t k = 0; k < comparison->levels.size(); ++k) {
      const LevelComparison& level = comparison->levels[k];
      levels[k].*error = FitError{comparison->pairs, level.psnr, level.relative_l2};
    }
    return Result<void>();
  };
  if (auto ok = measure_on(held_out, &LevelReport::held_out); !ok) return ok;
  return measure_on(training, &LevelReport::training);
}

Result<void> write_fabric(const std::string& path, const Fabric& fabric, FitRecord record,
                          const FabricWriteOptions& options) {
  const auto failed = [&](Error error) {
    error.file = path;
    return tl::unexpected(std::move(error));
  };
  Fabric recorded = fabric;
  {
    const auto beside = AtomicFile::create(path);
    if (!beside) return tl::unexpected(beside.error());
    if (auto ok = write_fabric(beside->temporary(), fabric, options); !ok) return failed(ok.error());
    if (auto ok = read_sizes(beside->temporary(), fabric, record); !ok) return failed(ok.error());
  }
  recorded.provenance = with_record(fabric.provenance, record);
  return write_fabric(path, recorded, options);
}

std::optional<FitRecord> fit_record_of(const std::string& provenance, int levels, IssueSink& sink) {
  const json text = provenance_json(provenance);
  const auto fit = text.find(member::fit);
  if (fit == text.end() || !fit->is_object() || !fit->contains(member::levels)) return std::nullopt;
  std::optional<FitRecord> record;
  try {
    record = record_of(*fit, levels);
  } catch (const json::exception&) {
  } catch (const std::range_error&) {
  }
  if (!record) {
    sink.add(Code::fabric_advice, pointer_to(pointer_to({}, member::provenance), member::fit),
             "the record of the fit is not as spec/fabric.md describes it");
  }
  return record;
}

std::string without_fit_record(const std::string& provenance) {
  json text = provenance_json(provenance);
  if (const auto fit = text.find(member::fit); fit != text.end() && fit->is_object()) {
    for (const char* measured : {member::peak, member::levels, member::sides, member::warnings})
      fit->erase(measured);
  }
  return text.dump();
}

FitRecord record_of_levels(const FitRecord& record, int first, int last, bool changed) {
  FitRecord result = record;
  const auto cut = [&](std::vector<LevelReport>& levels) {
    if (levels.empty()) return;
    levels = {levels.begin() + first, levels.begin() + last + 1};
    for (LevelReport& level : levels) {
      if (!changed) continue;
      level.held_out.reset();
      level.training.reset();
      level.validation.reset();
    }
  };
  cut(result.levels);
  for (auto& levels : result.sides) cut(levels);
  return result;
}

}  // namespace selvedge
