#include "format/gltf/ply.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

#include "format/base/ply.h"
#include "format/gltf/memory.h"
#include "format/gltf/mesh_corners.h"
#include "format/gltf/uri.h"

namespace selvedge {
namespace {

constexpr std::uint64_t header_price = 64;  ///< a byte of the header
constexpr std::uint64_t vertex_price = 128;

/// Where a vertex keeps the numbers of a property: x, y, z, nx, ny, nz, u, v; -1: nowhere.
int slot_of(const std::string& name) {
  constexpr std::array names{"x", "y", "z", "nx", "ny", "nz", "u", "v"};
  const std::string plain = name == "s" || name == "texture_u"   ? "u"
                            : name == "t" || name == "texture_v" ? "v"
                                                                 : name;
  const auto found = std::find(names.begin(), names.end(), plain);
  return found == names.end() ? -1 : static_cast<int>(found - names.begin());
}

class PlyGarment {
 public:
  PlyGarment(const PlyHeader& header, std::string_view bytes, const std::string& file, MemoryAccount& account)
      : header_(header), body_(bytes.substr(header.size), header.form), file_(file), account_(account) {}

  Result<void> read() {
    for (const PlyElement& element : header_.elements) {
      if (element.properties.empty()) continue;
      // Each takes at least a byte: a larger count must be damaged.
      if (element.count > body_.bytes_left()) return damaged(element, 0);
      find_slots(element);
      for (std::uint64_t i = 0; i < element.count; ++i) {
        if (!read_item(element)) return too_large_ ? beyond(i) : damaged(element, i);
        Result<void> ok = element.name == "vertex" ? add_vertex(i)
                          : element.name == "face" ? add_face(i)
                                                   : Result<void>();
        if (!ok) return ok;
      }
    }
    return check_faces();
  }

  MeshCorners mesh;

 private:
  tl::unexpected<Error> damaged(const PlyElement& element, std::uint64_t item) const {
    return fail(Code::file_damaged, file_, fmt::format("{} {}", element.name, item), "cannot be read");
  }

  void find_slots(const PlyElement& element) {
    slots_.clear();
    std::array<bool, 8> has{};
    for (const PlyProperty& property : element.properties) {
      const int slot = property.length ? -1 : slot_of(property.name);
      slots_.push_back(slot);
      if (slot >= 0) has[static_cast<std::size_t>(slot)] = true;
    }
    if (element.name != "vertex") return;
    has_normals_ = has[3] && has[4] && has[5];
    has_uvs_ = has[6] && has[7];
    if (mesh.positions.empty()) first_uv_ = mesh.uvs.size();
  }

  /// The numbers of the slots, and the two lists that count.
  bool read_item(const PlyElement& element) {
    numbers_ = {};
    corners_.clear();
    uvs_.clear();
    for (std::size_t p = 0; p < element.properties.size(); ++p) {
      const PlyProperty& property = element.properties[p];
      double number = 0;
      if (!property.length) {
        if (!body_.read(property.type, number)) return false;
        if (slots_[p] >= 0) numbers_[static_cast<std::size_t>(slots_[p])] = number;
        continue;
      }
      if (!body_.read(*property.length, number)) return false;
      if (!(number >= 0) || number > static_cast<double>(body_.bytes_left())) return false;
      std::vector<double> unused;
      std::vector<double>& list = property.name == "vertex_indices" || property.name == "vertex_index"
                                      ? corners_
                                  : property.name == "texcoord" ? uvs_
                                                                : unused;
      too_large_ = !account_.take(static_cast<std::uint64_t>(number), sizeof(double));
      if (too_large_) return false;
      for (auto left = static_cast<std::size_t>(number); left > 0; --left) {
        double value = 0;
        if (!body_.read(property.type, value)) return false;
        list.push_back(value);
      }
    }
    return true;
  }

  Result<void> add_vertex(std::uint64_t item) {
    if (!account_.take(1, vertex_price)) return beyond(item);
    const V3d position(numbers_[0], numbers_[1], numbers_[2]);
    const V3f single(position);
    if (!std::isfinite(single.x) || !std::isfinite(single.y) || !std::isfinite(single.z))
      return fail(Code::mesh_not_finite, file_, fmt::format("vertex {}", item), "is not finite");
    mesh.positions.push_back(position);
    const V3d normal(numbers_[3], numbers_[4], numbers_[5]);
    const bool sound = std::isfinite(normal.length2()) && normal.length2() > 0;
    if (has_normals_) mesh.normals.push_back(sound ? V3f(normal.normalized()) : V3f(0, 0, 1));
    return has_uvs_ ? add_uv(numbers_[6], numbers_[7], item) : Result<void>();
  }

  Result<void> add_uv(double u, double v, std::uint64_t item) {
    const V2f uv(static_cast<float>(u), static_cast<float>(1 - v));
    if (!std::isfinite(uv.x) || !std::isfinite(uv.y))
      return fail(Code::file_damaged, file_, fmt::format("item {}", item),
                  "texture coordinates beyond all numbers");
    mesh.uvs.push_back(uv);
    return {};
  }

  Result<void> add_face(std::uint64_t item) {
    if (corners_.size() < 3) return {};
    if (!account_.take(3 * corners_.size(), corner_price)) return beyond(item);
    const bool own = uvs_.size() == 2 * corners_.size();
    const bool has_uvs = own || has_uvs_;
    std::vector<MeshCorner> face;
    for (std::size_t k = 0; k < corners_.size(); ++k) {
      const double index = corners_[k];
      if (!(index >= 0 && index < static_cast<double>(1U << 30U)))
        return fail(Code::file_damaged, file_, fmt::format("face {}", item), "names a vertex that is none");
      MeshCorner corner{static_cast<int>(index), -1, has_normals_ ? static_cast<int>(index) : -1};
      if (own) {
        corner.uv = static_cast<int>(mesh.uvs.size());
        if (auto ok = add_uv(uvs_[2 * k], uvs_[2 * k + 1], item); !ok) return ok;
      } else if (has_uvs_) {
        corner.uv = static_cast<int>(first_uv_) + corner.position;
      }
      face.push_back(corner);
    }
    std::vector<MeshCorner>& corners = mesh.parts[{"", has_uvs}];
    for (std::size_t k = 2; k < face.size(); ++k)
      corners.insert(corners.end(), {face[0], face[k - 1], face[k]});
    return {};
  }

  /// Faces may stand before the vertices that they name.
  Result<void> check_faces() const {
    if (mesh.parts.empty()) return fail(Code::gltf_malformed, file_, "", "has no faces");
    const auto within = [](int index, std::size_t count) { return index < static_cast<int>(count); };
    for (const auto& [part, corners] : mesh.parts) {
      const bool sound = std::all_of(corners.begin(), corners.end(), [&](const MeshCorner& c) {
        return within(c.position, mesh.positions.size()) && within(c.uv, mesh.uvs.size()) &&
               within(c.normal, mesh.normals.size());
      });
      if (!sound) return fail(Code::file_damaged, file_, "face", "a face names a vertex that is none");
    }
    return {};
  }

  tl::unexpected<Error> beyond(std::uint64_t item) const {
    return tl::unexpected(beyond_memory(file_, fmt::format("item {}", item), "its faces", account_.limit()));
  }

  const PlyHeader& header_;
  PlyBody body_;
  const std::string& file_;
  MemoryAccount& account_;
  std::vector<int> slots_;
  std::array<double, 8> numbers_{};
  std::vector<double> corners_, uvs_;  ///< of a face
  bool has_normals_ = false;
  bool has_uvs_ = false;
  std::size_t first_uv_ = 0;  ///< of the vertices; faces may have brought their own before
  bool too_large_ = false;
};

/// The picture that a comment names, as MeshLab writes it; the garment goes without one that is not there.
Result<void> add_picture(const PlyHeader& header, GltfDocument& document, Json& material) {
  constexpr std::string_view key = " TextureFile ";
  for (const std::string& comment : header.comments) {
    if (!comment.starts_with(key) || document.other_files == OtherFiles::none) continue;
    std::string name = comment.substr(key.size());
    std::replace(name.begin(), name.end(), '\\', '/');
    if (name.starts_with('/') || name.find(':') != std::string::npos) name = name.substr(name.rfind('/') + 1);
    if (name.empty()) continue;
    const std::string uri =
        relative_uri((std::filesystem::path(document.folder) / name).string(), document.folder);
    const Result<std::string> path = resolve_uri(document, uri, "TextureFile");
    if (!path) return tl::unexpected(path.error());
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(*path, ignored)) continue;
    document.json["images"].push_back({{"uri", uri}});
    document.json["textures"].push_back(Json::object({{"source", 0}}));
    material["pbrMetallicRoughness"]["baseColorTexture"] = Json::object({{"index", 0}});
    return {};
  }
  return {};
}

}  // namespace

bool is_ply(std::string_view bytes) { return bytes.starts_with("ply\n") || bytes.starts_with("ply\r\n"); }

Result<GltfDocument> load_ply(std::string_view bytes, const std::string& path, const GltfLimits& limits) {
  MemoryAccount account(limits.memory);
  const Result<PlyHeader> header = read_ply_header(bytes, path);
  if (!header) return tl::unexpected(header.error());
  if (!account.take(bytes.size(), 1) || !account.take(header->size, header_price))
    return tl::unexpected(beyond_memory(path, "", "its text", limits.memory));
  PlyGarment garment(*header, bytes, path, account);
  if (auto ok = garment.read(); !ok) return tl::unexpected(ok.error());
  GltfDocument document = document_of_mesh(path, limits);
  Json material = {
      {"name", "cloth"}, {"doubleSided", true}, {"pbrMetallicRoughness", {{"metallicFactor", 0}}}};
  if (auto ok = add_picture(*header, document, material); !ok) {
    Error error = ok.error();
    error.file = path;
    return tl::unexpected(error);
  }
  document.json["materials"].push_back(std::move(material));
  append_parts(document, garment.mesh, [](const std::string&) { return 0; });
  document.taken = limits.memory - account.left();
  return document;
}

}  // namespace selvedge
