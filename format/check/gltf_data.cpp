#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "format/check/gltf_parts.h"
#include "format/gltf/access.h"
#include "format/gltf/names.h"

namespace selvedge {
namespace {

/// Rounding to 8 bits moves each component by at most half a step, the length by sqrt(3) times that.
constexpr double unit_tolerance = 0.00682;

/// Values that many accessors share are looked at once for each: a file may ask for so much of it.
constexpr std::size_t free_scans = std::size_t{1} << 26;
constexpr std::size_t scans_per_byte = 16;

/// What an accessor is for. One may serve several primitives.
struct AccessorUse {
  bool vertex = false;
  bool indices = false;
  bool unit = false;     ///< NORMAL, TANGENT
  bool tangent = false;  ///< w is +1 or -1
  bool color = false;
  bool target = false;                     ///< of a morph: differences, not values
  std::size_t vertices = std::size_t(-1);  ///< indices: of the smallest primitive
  std::size_t joints = std::size_t(-1);    ///< JOINTS_n: of the smallest skin
  std::string place;                       ///< of the first use
};

/// What a view is for; it may be for one kind of thing only.
enum class ViewUse { none, vertices, indices, other };

double number_at(const std::uint8_t* bytes, int component_type) {
  const auto load = [bytes](auto value) {
    std::memcpy(&value, bytes, sizeof value);
    return static_cast<double>(value);
  };
  switch (component_type) {
    case 5120:
      return load(std::int8_t{});
    case 5121:
      return load(std::uint8_t{});
    case 5122:
      return load(std::int16_t{});
    case 5123:
      return load(std::uint16_t{});
    case 5125:
      return load(std::uint32_t{});
    default:
      return load(float{});
  }
}

bool is_matrix(const Json& accessor) {
  const Json& type = member(accessor, "type");
  return type.is_string() && type.get_ref<const std::string&>().starts_with("MAT");
}

class DataCheck {
 public:
  DataCheck(const GltfDocument& document, IssueSink& issues)
      : document_(document),
        root_(document.json),
        issues_(issues),
        uses_(size_of_array("accessors")),
        views_(size_of_array("bufferViews"), ViewUse::none) {
    for (const std::vector<std::uint8_t>& buffer : document.buffers)
      budget_ += scans_per_byte * buffer.size();
  }

  void check() {
    for_each_object(root_, "bufferViews", [&](const Json& view, int index) { check_view(view, index); });
    collect_uses();
    check_sharing();
    for_each_object(root_, "accessors",
                    [&](const Json& accessor, int index) { check_accessor(accessor, index); });
  }

 private:
  std::size_t size_of_array(const char* name) const {
    const Json& array = member(root_, name);
    return array.is_array() ? array.size() : 0;
  }

  void wrong(const std::string& place, std::string message) {
    issues_.add(Code::gltf_malformed, place, std::move(message));
  }

  void check_view(const Json& view, int index) {
    const std::string place = fmt::format("/bufferViews/{}", index);
    const std::optional<std::size_t> stride = size_of(member(view, "byteStride"));
    const std::optional<std::size_t> length = size_of(member(view, "byteLength"));
    if (stride && *stride % 4 != 0)
      wrong(place + "/byteStride", fmt::format("{} is no multiple of 4", *stride));
    if (stride && length && *stride > *length) {
      wrong(place + "/byteStride", fmt::format("{} is more than the view's {} bytes", *stride, *length));
    }
    if (stride && member(view, "target") == 34963) {
      wrong(place + "/byteStride", "indices have no byteStride");
    }
    // Indices that are out of range have been named by the schema.
    if (static_cast<std::size_t>(index_of(member(view, "buffer"))) >= size_of_array("buffers")) return;
    if (!length) return;
    if (const auto good = view_of(document_, index, place); !good) issues_.add(good.error());
  }

  AccessorUse* use_of(const Json& accessor) {
    const int index = index_of(accessor);
    return index >= 0 && static_cast<std::size_t>(index) < uses_.size() ? &uses_[index] : nullptr;
  }

  void use_attribute(const std::string& semantic, const Json& accessor, const std::string& place, bool target,
                     std::size_t joints) {
    AccessorUse* use = use_of(accessor);
    if (use == nullptr) return;
    if (semantic.starts_with("JOINTS_")) use->joints = std::min(use->joints, joints);
    use->vertex = true;
    use->target = use->target || target;
    use->tangent = use->tangent || (semantic == "TANGENT" && !target);
    use->unit = use->unit || ((semantic == "NORMAL" || semantic == "TANGENT") && !target);
    use->color = use->color || (semantic.starts_with("COLOR_") && !target);
    if (use->place.empty()) use->place = place;
    use_view_of(accessor, ViewUse::vertices, place);
  }

  void use_view_of(const Json& accessor, ViewUse use, const std::string& place) {
    const Json& accessors = member(root_, "accessors");
    const int index = index_of(accessor);
    if (!accessors.is_array() || index < 0 || static_cast<std::size_t>(index) >= accessors.size()) return;
    const Json& view = member(accessors[index], "bufferView");
    if (use == ViewUse::vertices) {
      if (const int number = index_of(view); number >= 0) vertex_accessors_.insert({number, index});
    }
    use_view(view, use, place);
  }

  void use_view(const Json& number, ViewUse use, const std::string& place) {
    const int index = index_of(number);
    if (index < 0 || static_cast<std::size_t>(index) >= views_.size()) return;
    ViewUse& so_far = views_[index];
    const Json& view = root_["bufferViews"][index];
    const Json& target = member(view, "target");
    if (so_far != ViewUse::none && so_far != use) {
      wrong(place, fmt::format("buffer view {} is used for something else, too", index));
    } else if ((target == 34962 && use != ViewUse::vertices) ||
               (target == 34963 && use != ViewUse::indices)) {
      if (so_far == ViewUse::none)
        wrong(place, fmt::format("is not what buffer view {} is the target of", index));
    }
    if (so_far == ViewUse::none && use != ViewUse::vertices && !member(view, "byteStride").is_null()) {
      wrong(place, fmt::format("buffer view {} has a byteStride, which is for vertices only", index));
    }
    so_far = use;
  }

  void collect_uses() {
    const std::map<int, std::size_t> joints = joints_of_meshes();
    for_each_object(root_, "meshes", [&](const Json& mesh, int m) {
      const auto skinned = joints.find(m);
      for_each_object(mesh, "primitives", [&](const Json& primitive, int p) {
        collect_primitive(primitive, fmt::format("/meshes/{}/primitives/{}", m, p),
                          skinned == joints.end() ? std::size_t(-1) : skinned->second);
      });
    });
    for_each_object(root_, "accessors", [&](const Json& accessor, int i) {
      const Json& sparse = member(accessor, "sparse");
      for (const char* part : {"indices", "values"}) {
        use_view(member(member(sparse, part), "bufferView"), ViewUse::other,
                 fmt::format("/accessors/{}/sparse/{}/bufferView", i, part));
      }
    });
    for_each_object(root_, "images", [&](const Json& image, int i) {
      use_view(member(image, "bufferView"), ViewUse::other, fmt::format("/images/{}/bufferView", i));
    });
    for_each_object(root_, "skins", [&](const Json& skin, int i) {
      use_view_of(member(skin, "inverseBindMatrices"), ViewUse::other,
                  fmt::format("/skins/{}/inverseBindMatrices", i));
    });
    for_each_object(root_, "animations", [&](const Json& animation, int i) {
      for_each_object(animation, "samplers", [&](const Json& sampler, int s) {
        for (const char* part : {"input", "output"}) {
          use_view_of(member(sampler, part), ViewUse::other,
                      fmt::format("/animations/{}/samplers/{}/{}", i, s, part));
        }
      });
    });
  }

  /// How many joints the smallest skin of each mesh that has one has.
  std::map<int, std::size_t> joints_of_meshes() const {
    std::map<int, std::size_t> joints;
    for_each_object(root_, "nodes", [&](const Json& node, int) {
      const auto skin = entry_of(document_, "skins", index_of(member(node, "skin")), "");
      const int mesh = index_of(member(node, "mesh"));
      if (!skin || !member(**skin, "joints").is_array() || mesh < 0) return;
      const std::size_t count = member(**skin, "joints").size();
      const auto [entry, fresh] = joints.try_emplace(mesh, count);
      if (!fresh) entry->second = std::min(entry->second, count);
    });
    return joints;
  }

  void collect_primitive(const Json& primitive, const std::string& place, std::size_t joints) {
    const Json& attributes = member(primitive, "attributes");
    std::size_t vertices = std::size_t(-1);
    if (attributes.is_object()) {
      for (const auto& [semantic, accessor] : attributes.items()) {
        use_attribute(semantic, accessor, pointer_to(place + "/attributes", semantic), false, joints);
      }
      if (const auto shape = shape_of(document_, index_of(member(attributes, "POSITION")), place)) {
        vertices = shape->count;
      }
    }
    const Json& targets = member(primitive, "targets");
    for (std::size_t t = 0; targets.is_array() && t < targets.size(); ++t) {
      if (!targets[t].is_object()) continue;
      for (const auto& [semantic, accessor] : targets[t].items()) {
        use_attribute(semantic, accessor, pointer_to(fmt::format("{}/targets/{}", place, t), semantic), true,
                      joints);
      }
    }
    if (AccessorUse* use = use_of(member(primitive, "indices"))) {
      use->indices = true;
      use->vertices = std::min(use->vertices, vertices);
      if (use->place.empty()) use->place = place + "/indices";
      use_view_of(member(primitive, "indices"), ViewUse::indices, place + "/indices");
    }
  }

  /// Without a stride, vertices of two accessors in one view cannot be told apart.
  void check_sharing() {
    int last = -1;
    bool reported = false;
    for (const auto& [view, accessor] : vertex_accessors_) {
      if (view != last) {
        last = view;
        reported = false;
        continue;
      }
      if (reported || static_cast<std::size_t>(view) >= views_.size()) continue;
      if (!member(root_["bufferViews"][view], "byteStride").is_null()) continue;
      wrong(fmt::format("/bufferViews/{}", view), "has no byteStride, but several accessors of vertices");
      reported = true;
    }
  }

  void check_accessor(const Json& accessor, int index) {
    const std::string place = fmt::format("/accessors/{}", index);
    const Result<AccessorShape> shape = shape_of(document_, index, place);
    if (!shape) return;  // named by the schema
    const bool integer = shape->component_type != 5126 && shape->component_type != 5125;
    if (shape->normalized && !integer)
      wrong(place + "/normalized", "only bytes and shorts can be normalised");
    for (const char* bound : {"min", "max"}) {
      const Json& values = member(accessor, bound);
      if (values.is_array() && values.size() != static_cast<std::size_t>(shape->components)) {
        wrong(fmt::format("{}/{}", place, bound),
              fmt::format("has {} elements, not {}", values.size(), shape->components));
      }
    }
    const AccessorUse& use = uses_[index];
    const bool whole = check_runs(accessor, index, place);
    if (whole) check_values(accessor, index, *shape, use);
  }

  /// True if all elements are there.
  bool check_runs(const Json& accessor, int index, const std::string& place) {
    bool good = true;
    const Result<ElementRun> elements = elements_of(document_, index, place);
    if (elements) {
      check_alignment(accessor, *elements, member(accessor, "componentType"), place + "/byteOffset");
    } else if (!already_named(member(accessor, "bufferView"))) {
      issues_.add(elements.error());
    }
    good = elements.has_value();
    const Json& sparse = member(accessor, "sparse");
    if (sparse.is_null()) return good;
    const Result<std::optional<SparseRuns>> runs = sparse_of(document_, index, place);
    if (!runs) {
      const Json& indices = member(sparse, "indices");
      const Json& values = member(sparse, "values");
      if (!already_named(member(indices, "bufferView")) && !already_named(member(values, "bufferView")) &&
          size_of(member(sparse, "count")) && runs.error().code == Code::gltf_accessor) {
        issues_.add(runs.error());
      }
      return false;
    }
    check_alignment(accessor, (*runs)->indices, member(member(sparse, "indices"), "componentType"),
                    place + "/sparse/indices/byteOffset");
    check_alignment(accessor, (*runs)->values, member(accessor, "componentType"),
                    place + "/sparse/values/byteOffset");
    return good;
  }

  /// A view that is broken itself, or not there, has been reported where it stands or is referred to.
  bool already_named(const Json& view) const {
    return !view.is_null() && !view_of(document_, index_of(view), "").has_value();
  }

  void check_alignment(const Json& accessor, const ElementRun& run, const Json& type,
                       const std::string& place) {
    if (run.view < 0) return;
    const std::size_t size = component_size(index_of(type));
    if (size == 0) return;
    const Json& view = root_["bufferViews"][run.view];
    const std::size_t start = size_of(member(view, "byteOffset")).value_or(0);
    const std::size_t own = is_matrix(accessor) ? 4 : size;  // columns of matrices begin at multiples of 4
    if (run.offset % own != 0 || (run.offset + start) % size != 0) {
      wrong(place, fmt::format("byte {} of view {}, which begins at byte {}: is no multiple of {}",
                               run.offset, run.view, start, own));
    }
  }

  bool is_present(int view) const {
    if (view < 0) return true;
    return bytes_of_view(document_, view, "").has_value();
  }

  void check_values(const Json& accessor, int index, const AccessorShape& shape, const AccessorUse& use) {
    const std::string place = fmt::format("/accessors/{}", index);
    const Json& view = member(accessor, "bufferView");
    const Json& sparse = member(accessor, "sparse");
    // Zeros only, or the place of what is compressed.
    if (view.is_null() && sparse.is_null()) return;
    if (is_matrix(accessor) && component_size(shape.component_type) < 4) return;  // columns are padded
    if (!view.is_null() && !is_present(index_of(view))) return;
    const std::size_t cost = shape.count * static_cast<std::size_t>(shape.components) * 4;
    if (cost > budget_) {
      if (!exhausted_) issues_.add(Code::gltf_advice, place, "more values than are looked at: not looked at");
      exhausted_ = true;
      return;
    }
    budget_ -= cost;
    const auto elements = read_elements(document_, index, place);
    if (!elements) return issues_.add(elements.error());
    scan(*elements, accessor, shape, use, place);
  }

  void scan(const std::vector<std::uint8_t>& elements, const Json& accessor, const AccessorShape& shape,
            const AccessorUse& use, const std::string& place) {
    const auto components = static_cast<std::size_t>(shape.components);
    const std::size_t size = component_size(shape.component_type);
    std::vector<double> low(components, std::numeric_limits<double>::infinity());
    std::vector<double> high(components, -std::numeric_limits<double>::infinity());
    std::size_t bad = 0;
    std::size_t first_bad = 0;
    for (std::size_t i = 0; i < shape.count; ++i) {
      for (std::size_t c = 0; c < components; ++c) {
        const double value = number_at(elements.data() + (i * components + c) * size, shape.component_type);
        if (!std::isfinite(value)) {
          if (bad++ == 0) first_bad = i;
          continue;
        }
        low[c] = std::min(low[c], value);
        high[c] = std::max(high[c], value);
      }
    }
    if (bad > 0) {
      issues_.add(use.vertex ? Code::mesh_not_finite : Code::gltf_accessor, use.vertex ? use.place : place,
                  fmt::format("{} values are not finite, first in element {}", bad, first_bad));
    }
    check_bounds(accessor, "min", low, place, shape.component_type);
    check_bounds(accessor, "max", high, place, shape.component_type);
    if (use.indices && components == 1) check_indices(high[0], shape.component_type, use);
    if (use.joints != std::size_t(-1)) {
      const double highest = *std::max_element(high.begin(), high.end());
      if (highest >= static_cast<double>(use.joints)) {
        issues_.add(Code::gltf_accessor, use.place, fmt::format("joint {} of {}", highest, use.joints));
      }
    }
    if (use.color && shape.component_type == 5126) {
      if (*std::min_element(low.begin(), low.end()) < 0 || *std::max_element(high.begin(), high.end()) > 1) {
        issues_.add(Code::gltf_accessor, use.place, "colours beyond 0 to 1");
      }
    }
    if (use.unit && components >= 3) {
      check_units(to_floats(elements, shape.component_type, shape.normalized), components, use);
    }
  }

  void check_bounds(const Json& accessor, const char* name, const std::vector<double>& actual,
                    const std::string& place, int component_type) {
    const Json& declared = member(accessor, name);
    if (!declared.is_array() || declared.size() != actual.size()) return;
    for (std::size_t c = 0; c < actual.size(); ++c) {
      if (!declared[c].is_number() || !std::isfinite(actual[c])) continue;
      const double value = declared[c].get<double>();
      const double as_stored =
          component_type == 5126 ? static_cast<double>(static_cast<float>(value)) : value;
      if (as_stored == actual[c]) continue;
      issues_.add(Code::gltf_accessor, fmt::format("{}/{}/{}", place, name, c),
                  fmt::format("{} is not that of the values, {}", value, actual[c]));
    }
  }

  void check_indices(double highest, int component_type, const AccessorUse& use) {
    const double restart = component_type == 5121 ? 255 : component_type == 5123 ? 65535 : 4294967295.0;
    if (component_type == 5126) return;
    if (highest == restart) {
      issues_.add(Code::gltf_accessor, use.place, fmt::format("index {} means a restart", restart));
    } else if (use.vertices != std::size_t(-1) && highest >= static_cast<double>(use.vertices)) {
      issues_.add(Code::gltf_accessor, use.place,
                  fmt::format("index {} of {} vertices", highest, use.vertices));
    }
  }

  void check_units(const std::vector<float>& values, std::size_t components, const AccessorUse& use) {
    std::size_t bad = 0;
    std::size_t first_bad = 0;
    std::size_t wrong_sign = 0;
    double length_of_bad = 0;
    for (std::size_t i = 0; i * components < values.size(); ++i) {
      const float* v = values.data() + i * components;
      const double length = std::sqrt(double{v[0]} * v[0] + double{v[1]} * v[1] + double{v[2]} * v[2]);
      if (!(std::abs(length - 1) <= unit_tolerance) && bad++ == 0) {
        first_bad = i;
        length_of_bad = length;
      }
      if (use.tangent && components == 4 && v[3] != 1.0F && v[3] != -1.0F) ++wrong_sign;
    }
    if (bad > 0) {
      issues_.add(Code::gltf_accessor, use.place,
                  fmt::format("{} vectors are not of unit length, first element {}: {}", bad, first_bad,
                              length_of_bad));
    }
    if (wrong_sign > 0) {
      issues_.add(Code::gltf_accessor, use.place,
                  fmt::format("w of {} tangents is neither 1 nor -1", wrong_sign));
    }
  }

  const GltfDocument& document_;
  const Json& root_;
  IssueSink& issues_;
  std::vector<AccessorUse> uses_;
  std::vector<ViewUse> views_;
  std::set<std::pair<int, int>> vertex_accessors_;  ///< view, accessor
  std::size_t budget_ = free_scans;
  bool exhausted_ = false;
};

}  // namespace

void check_data(const GltfDocument& document, IssueSink& issues) { DataCheck(document, issues).check(); }

}  // namespace selvedge
