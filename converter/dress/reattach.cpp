#include "converter/dress/reattach.h"

#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <set>

#include "converter/dress/extras_mirror.h"
#include "converter/dress/fabric_source.h"
#include "format/fabric/file.h"
#include "format/gltf/access.h"
#include "format/gltf/document.h"
#include "format/gltf/fabric_extension.h"
#include "format/gltf/material_uses.h"
#include "format/gltf/names.h"
#include "format/gltf/uri.h"

namespace selvedge {
namespace {

namespace fs = std::filesystem;

/// A material to be restored.
struct LostMaterial {
  int material = 0;
  Mirror mirror;
  std::string file;  ///< the fabric on disk; empty if missing
  int entry = -1;    ///< the fabric's entry in the document; -1 if dropped

  bool found() const { return entry >= 0 || !file.empty(); }
};

struct Offer {
  std::string name;  ///< empty: any
  std::string file;
  std::string digest;
};

std::string place_of(int material) {
  return fmt::format("/materials/{}/extras/{}", material, names::gltf::fabric_extension);
}

/// "NAME=FILE" or "FILE". An existing file with "=" in its name is a FILE.
Offer offer_of(const std::string& text) {
  Offer offer;
  offer.file = text;
  std::error_code ignored;
  const std::size_t equals = text.find('=');
  if (equals != std::string::npos && !fs::exists(text, ignored)) {
    offer.name = text.substr(0, equals);
    offer.file = text.substr(equals + 1);
  }
  offer.digest = value_or_throw(digest_of_fabric(offer.file));
  return offer;
}

class Restorer {
 public:
  Restorer(GltfDocument& document, const std::string& output, const ReattachOptions& options)
      : document_(document), output_(output), options_(options) {}

  ReattachReport restore() {
    find_lost();
    find_fabrics();
    const Uses uses = uses_of(document_.json);
    for (const LostMaterial& lost : lost_) restore(lost, uses);
    return std::move(report_);
  }

 private:
  void find_lost() {
    const std::vector<SceneFabric> present = value_or_throw(read_fabric_entries(document_));
    const Json& materials = member(document_.json, "materials");
    const int count = materials.is_array() ? static_cast<int>(materials.size()) : 0;
    for (int i = 0; i < count; ++i) {
      if (value_or_throw(read_fabric_reference(document_, i, static_cast<int>(present.size())))) {
        report_.attached.push_back(i);
        continue;
      }
      std::optional<Mirror> mirror = value_or_throw(read_mirror(document_, i));
      if (!mirror) continue;
      LostMaterial lost{i, std::move(*mirror), {}, -1};
      look_around(lost, present);
      lost_.push_back(std::move(lost));
    }
    if (!lost_.empty()) return;
    throw Failure{{Code::material_missing, document_.file, "/materials",
                   report_.attached.empty()
                       ? "no material has the record of a fabric in its extras"
                       : fmt::format("nothing to restore: {} of {} materials have a fabric, "
                                     "the extras of the others have no record of a fabric",
                                     report_.attached.size(), count)}};
  }

  /// Looks for the fabric in the document, then beside it.
  void look_around(LostMaterial& lost, const std::vector<SceneFabric>& present) const {
    for (std::size_t i = 0; i < present.size(); ++i) {
      if (present[i].bytes.empty() || lost.mirror.digest.empty()) continue;
      const Result<std::string> digest = digest_of_fabric(present[i].bytes, present[i].name);
      if (digest && *digest == lost.mirror.digest) lost.entry = static_cast<int>(i);
    }
    if (lost.mirror.uri.empty() || lost.mirror.uri.starts_with("data:")) return;
    const Result<std::string> path = resolve_uri(document_, lost.mirror.uri, "");
    std::error_code ignored;
    if (path && fs::is_regular_file(*path, ignored)) lost.file = *path;
  }

  /// Assigns each offered file to its materials. An offer by name overrides a fabric found beside the glTF.
  void find_fabrics() {
    for (const std::string& text : options_.fabrics) {
      const Offer offer = offer_of(text);
      bool taken = false;
      for (LostMaterial& lost : lost_) taken |= take(lost, offer);
      if (!taken)
        throw Failure{{Code::gltf_reference, offer.file, "",
                       fmt::format("no material of {} has lost this fabric", document_.file)}};
    }
    for (const LostMaterial& lost : lost_) {
      if (lost.found()) continue;
      const Mirror& mirror = lost.mirror;
      const std::string what = mirror.uri.empty()
                                   ? fmt::format("the embedded fabric \"{}\" is gone", mirror.name)
                                   : fmt::format("the fabric \"{}\" is not there", mirror.uri.substr(0, 200));
      throw Failure{{Code::gltf_reference, document_.file, place_of(lost.material),
                     what + "; give its file with --fabric"}};
    }
  }

  bool take(LostMaterial& lost, const Offer& offer) const {
    const std::string stem = fs::path(offer.file).stem().string();
    const auto fits = [&](const LostMaterial& other) {
      return offer.name.empty() ? other.mirror.digest == offer.digest || other.mirror.name == stem
                                : other.mirror.name == offer.name;
    };
    bool any_fits = false;
    std::set<std::string> missing;
    for (const LostMaterial& other : lost_) {
      any_fits |= fits(other);
      if (!other.found()) missing.insert(other.mirror.name + '\n' + other.mirror.digest);
    }
    const bool only_one_left = offer.name.empty() && !any_fits && missing.size() == 1 && !lost.found();
    if (!fits(lost) && !only_one_left) return false;
    lost.file = offer.file;
    lost.entry = -1;
    return true;
  }

  void restore(const LostMaterial& lost, const Uses& uses) {
    const std::string name = string_of(member(document_.json["materials"][lost.material], names::gltf::name));
    const std::string label = fmt::format("material #{} \"{}\"", lost.material, name);
    const int fabric = lost.entry >= 0 ? lost.entry : add(lost, label);
    std::optional<Placement> placement =
        placement_now(lost.mirror, base_color_placement(document_, lost.material));
    if (!placement) {
      placement = lost.mirror.fabric;
      report_.warnings.push_back(label +
                                 ": the base colour texture does not tell where the fabric lies now; the "
                                 "transform from the time of dressing is used");
    }
    if (const std::optional<TransformFault> fault = fault_of(placement->transform)) {
      throw Failure{{Code::gltf_extension, document_.file, place_of(lost.material),
                     fmt::format("{}: {}", fault->member, fault->reason)}};
    }
    if (const auto places = uses.find(lost.material); places != uses.end()) {
      value_or_throw(check_uvs(document_, places->second, placement->tex_coord));
    }
    set_fabric_reference(document_, lost.material, {fabric, placement->tex_coord, placement->transform});
    for (const std::string& part : restore_parts(document_, lost.material, lost.mirror))
      report_.warnings.push_back(fmt::format("{}: its {} is gone from the core material", label, part));
    complete_mirror(document_, lost.material, lost.entry >= 0 ? lost.mirror.digest : digests_.at(lost.file));
    report_.materials.push_back({lost.material, name, lost.entry >= 0 ? lost.mirror.name : lost.file,
                                 placement->tex_coord, placement->transform});
  }

  /// Checks the fabric's file and adds it to the document.
  int add(const LostMaterial& lost, const std::string& label) {
    if (!digests_.contains(lost.file)) {
      value_or_throw(read_fabric(lost.file, {.memory = options_.limits.document.memory}));
      digests_[lost.file] = value_or_throw(digest_of_fabric(lost.file));
    }
    if (!lost.mirror.digest.empty() && lost.mirror.digest != digests_[lost.file]) {
      report_.warnings.push_back(
          fmt::format("{}: {} is another fabric than the one that was attached", label, lost.file));
    }
    const bool embed = lost.mirror.uri.empty();  // as it was
    FabricSource source = value_or_throw(source_of(lost.file, output_, embed));
    if (!lost.mirror.name.empty()) source.name = lost.mirror.name;
    if (embed && embedded_.insert(lost.file).second) ++report_.embedded;
    return value_or_throw(add_fabric(document_, source));
  }

  GltfDocument& document_;
  const std::string& output_;
  const ReattachOptions& options_;
  std::vector<LostMaterial> lost_;
  std::map<std::string, std::string> digests_;  ///< of the files that were read
  std::set<std::string> embedded_;
  ReattachReport report_;
};

}  // namespace

Result<ReattachReport> reattach(const std::string& input_path, const std::string& output_path,
                                const ReattachOptions& options) {
  return result_of_edit(input_path, [&] {
    GltfDocument document = load_garment(input_path, output_path, options.limits.document);
    ReattachReport report = Restorer(document, output_path, options).restore();
    for (std::string& warning : outside_warnings(document, output_path))
      report.warnings.push_back(std::move(warning));
    report.bytes = value_or_throw(save_gltf(std::move(document), output_path));
    return report;
  });
}

}  // namespace selvedge
