#include "format/quality/fit_record.h"

#include <fmt/format.h>

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

/// Reads members of an object, and reports those that break the rules as FABRIC_ADVICE.
class RecordMembers {
 public:
  RecordMembers(const json& object, std::string place, IssueSink& sink)
      : object_(object), place_(std::move(place)), sink_(sink) {}

  std::string place_of(const char* key) const { return pointer_to(place_, key); }
  void advise(const char* key, const char* what) const {
    sink_.add(Code::fabric_advice, place_of(key), what);
  }

  /// A member for which `is_right` is true, or null.
  const json* find(const char* key, bool (*is_right)(const json&), const char* what, bool required) const {
    const auto found = object_.find(key);
    if (found == object_.end()) {
      if (required) advise(key, "is missing");
      return nullptr;
    }
    if (is_right(*found)) return &*found;
    advise(key, what);
    return nullptr;
  }
  std::optional<double> number(const char* key, bool required = false) const {
    const json* value = find(
        key, [](const json& v) { return v.is_number(); }, "is not a number", required);
    return value ? std::optional(value->get<double>()) : std::nullopt;
  }
  std::optional<std::int64_t> count(const char* key, bool required = false) const {
    const json* value = find(
        key, [](const json& v) { return v.is_number_integer() && v >= 0 && v <= std::int64_t{1} << 53; },
        "is not a whole number of 0 or more", required);
    return value ? std::optional(value->get<std::int64_t>()) : std::nullopt;
  }
  std::string text(const char* key) const {
    const json* value = find(
        key, [](const json& v) { return v.is_string(); }, "is not a string", true);
    return value ? value->get<std::string>() : std::string();
  }
  const json* array(const char* key) const {
    return find(
        key, [](const json& v) { return v.is_array(); }, "is not an array", true);
  }
  std::optional<FitError> error(const char* key) const {
    const json* value = find(
        key, [](const json& v) { return v.is_object(); }, "is not an object", false);
    if (value == nullptr) return std::nullopt;
    const RecordMembers inner(*value, place_of(key), sink_);
    const auto pairs = inner.count(member::pairs, true);
    const auto psnr = inner.number(member::psnr, true);
    const auto relative_l2 = inner.number(member::relative_l2, true);
    if (!pairs || !psnr || !relative_l2) return std::nullopt;
    return FitError{static_cast<int>(*pairs), *psnr, *relative_l2};
  }

 private:
  const json& object_;
  std::string place_;
  IssueSink& sink_;
};

std::optional<int> as_int(std::optional<std::int64_t> count) {
  return count ? std::optional(static_cast<int>(*count)) : std::nullopt;
}

LevelReport level_of(const RecordMembers& object) {
  LevelReport level;
  level.layers = object.text(member::layers);
  level.bytes = static_cast<std::uint64_t>(object.count(member::bytes, true).value_or(0));
  level.held_out = object.error(member::held_out);
  level.training = object.error(member::training);
  level.validation = object.number(member::validation_error);
  level.iterations = object.number(member::iterations);
  level.converged = as_int(object.count(member::converged));
  level.at_limit = as_int(object.count(member::at_limit));
  return level;
}

/// The reports of `count` levels; false if there are none of them.
bool read_levels(const RecordMembers& object, const char* key, int count, IssueSink& sink,
                 std::vector<LevelReport>& levels) {
  const json* list = object.array(key);
  if (list == nullptr) return false;
  if (std::cmp_not_equal(list->size(), count)) {
    object.advise(key, "is not of as many levels as the fabric has");
    return false;
  }
  for (std::size_t k = 0; k < list->size(); ++k) {
    const json& level = (*list)[k];
    const std::string at = fmt::format("{}/{}", object.place_of(key), k);
    if (level.is_object()) {
      levels.push_back(level_of(RecordMembers(level, at, sink)));
    } else {
      sink.add(Code::fabric_advice, at, "is not an object");
      levels.emplace_back();
    }
  }
  return true;
}

std::optional<Code> code_named(const std::string& name) {
  for (const CodeRow& row : code_table()) {
    if (row.name == name) return row.code;
  }
  return std::nullopt;
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
  const std::string place = pointer_to(pointer_to({}, member::provenance), member::fit);
  const RecordMembers object(*fit, place, sink);
  FitRecord record;
  record.peak = object.number(member::peak, true).value_or(0);
  if (!read_levels(object, member::levels, levels, sink, record.levels)) return std::nullopt;
  if (const json* sides = object.find(
          member::sides, [](const json& v) { return v.is_object(); }, "is not an object", false)) {
    const RecordMembers inner(*sides, object.place_of(member::sides), sink);
    for (const Side side : other_sides) {
      auto& list = record.sides[index_of(side) - 1];
      if (sides->contains(name_of(side))) read_levels(inner, name_of(side), levels, sink, list);
    }
  }
  if (const json* warnings = object.array(member::warnings)) {
    for (std::size_t i = 0; i < warnings->size(); ++i) {
      const json& warning = (*warnings)[i];
      const std::string at = fmt::format("{}/{}", object.place_of(member::warnings), i);
      if (!warning.is_object()) {
        sink.add(Code::fabric_advice, at, "is not an object");
        continue;
      }
      const RecordMembers inner(warning, at, sink);
      const auto code = code_named(inner.text(member::code));
      if (!code) {
        inner.advise(member::code, "is not a known code");
        continue;
      }
      record.warnings.push_back({*code, {}, inner.text(member::place), inner.text(member::message)});
    }
  }
  return record;
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
