#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <tuple>

#include "converter/mesh/raw_mesh.h"
#include "format/base/words.h"

namespace selvedge {
namespace {

constexpr std::size_t header_size = 84;
constexpr std::size_t triangle_size = 50;

template <class T>
T value_at(const std::string& bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

std::size_t triangles_said(const std::string& bytes) {
  return bytes.size() < header_size ? 0 : value_at<std::uint32_t>(bytes, header_size - 4);
}

/// A binary STL states its size; "solid" begins texts, but also the headers of some binary files.
bool is_binary(const std::string& bytes) {
  return !bytes.starts_with("solid") ||
         (bytes.size() >= header_size && bytes.size() == header_size + triangle_size * triangles_said(bytes));
}

/// Merges equal positions into one vertex.
class Welder {
 public:
  explicit Welder(std::vector<V3d>& positions) : positions_(positions) {}
  int index(const V3d& p) {
    const auto [entry, added] = index_.try_emplace({p.x, p.y, p.z}, static_cast<int>(positions_.size()));
    if (added) positions_.push_back(p);
    return entry->second;
  }

 private:
  std::vector<V3d>& positions_;
  std::map<std::tuple<double, double, double>, int> index_;
};

Result<RawMesh> read_text(const std::string& bytes, const std::string& file) {
  RawMesh mesh;
  Welder welder(mesh.positions);
  bool ended = false;
  auto sound = for_each_line(bytes, [&](const Words& words, int number) -> Result<void> {
    std::string keyword(words[0]);
    for (char& c : keyword) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    ended = ended || keyword == "endsolid";
    if (keyword == "facet") mesh.faces.emplace_back();
    if (keyword != "vertex") return {};
    const auto point = position_at(words, 1, file, number);
    if (!point) return tl::unexpected(point.error());
    if (mesh.faces.empty()) mesh.faces.emplace_back();
    mesh.faces.back().push_back(welder.index(*point));
    return {};
  });
  if (!sound) return tl::unexpected(sound.error());
  if (!ended) return fail(Code::file_damaged, file, "", "the text is cut short: no endsolid");
  return mesh;
}

Result<RawMesh> read_binary(const std::string& bytes, const std::string& file) {
  const std::size_t count = triangles_said(bytes);
  if (bytes.size() < header_size + triangle_size * count) {
    return fail(Code::file_damaged, file, "",
                fmt::format("{} bytes are too few for its triangles", bytes.size()));
  }
  const bool magics = std::string_view(bytes).substr(0, 80).find("COLOR=") != std::string_view::npos;
  RawMesh mesh;
  Welder welder(mesh.positions);
  bool any_colour = false;
  for (std::size_t t = 0; t < count; ++t) {
    const std::size_t offset = header_size + t * triangle_size;
    std::vector<int> face;
    for (const auto& [x, y, z] : value_at<std::array<std::array<float, 3>, 3>>(bytes, offset + 12)) {
      const V3f corner(x, y, z);
      if (!std::isfinite(corner.x + corner.y + corner.z)) {
        return fail(Code::mesh_not_finite, file, fmt::format("triangle {}", t),
                    "a vertex is NaN or infinite");
      }
      face.push_back(welder.index(V3d(corner) + V3d(0)));  // -0 and 0 become the same bits
    }
    mesh.faces.push_back(std::move(face));
    const auto bits = value_at<std::uint16_t>(bytes, offset + 48);
    const V3f low_first(static_cast<float>(bits & 31), static_cast<float>(bits >> 5 & 31),
                        static_cast<float>(bits >> 10 & 31));
    const bool coloured = (bits >> 15 == 1) != magics;
    any_colour = any_colour || coloured;
    const V3f colour = magics ? low_first : V3f(low_first.z, low_first.y, low_first.x);
    mesh.face_colours.push_back(coloured ? colour / 31.0F : V3f(-1));
  }
  if (!any_colour) mesh.face_colours.clear();
  mesh.face_colours_8bit = true;
  return mesh;
}

}  // namespace

Result<RawMesh> read_stl(const std::string& bytes, const std::string& file) {
  return is_binary(bytes) ? read_binary(bytes, file) : read_text(bytes, file);
}

}  // namespace selvedge
