#include "converter/mesh/openmesh.h"

#include <fmt/format.h>

#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/System/omstream.hh>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <mutex>
#include <sstream>
#include <string_view>

#include "converter/mesh/exact_points.h"
#include "converter/mesh/face_colours.h"

namespace selvedge {
namespace {

namespace om = OpenMesh;

/// Thrown through OpenMesh's readers to stop them; never leaves this file.
struct Stop {
  std::string message;
};

V3f vector_of(const om::Vec3f& v) { return {v[0], v[1], v[2]}; }

/// Takes down what a reader of OpenMesh finds.
class Collector final : public om::IO::BaseImporter {
 public:
  explicit Collector(std::size_t file_size) : file_size_(file_size) {}

  om::VertexHandle add_vertex(const om::Vec3f& point) override {
    // A vertex or a face takes at least a byte each: more than that can only be a damaged count.
    if (mesh.positions.size() >= file_size_) throw Stop{"has fewer vertices than it says"};
    mesh.positions.push_back(V3d(vector_of(point)));
    return om::VertexHandle(static_cast<int>(mesh.positions.size()) - 1);
  }
  om::VertexHandle add_vertex() override { return add_vertex(om::Vec3f(0, 0, 0)); }
  om::FaceHandle add_face(const VHandles& handles) override {
    std::vector<int> face;
    for (const om::VertexHandle& handle : handles) face.push_back(handle.idx());
    mesh.faces.push_back(std::move(face));
    return om::FaceHandle(static_cast<int>(mesh.faces.size()) - 1);
  }
  void set_point(om::VertexHandle v, const om::Vec3f& point) override {
    if (known(v)) mesh.positions[index(v)] = V3d(vector_of(point));
  }
  void set_normal(om::VertexHandle v, const om::Vec3f& normal) override {
    if (!known(v)) return;
    normals_.resize(mesh.positions.size());
    has_normal_.resize(mesh.positions.size(), false);
    if (has_normal_[index(v)] && normals_[index(v)] != vector_of(normal)) split_normals_ = true;
    normals_[index(v)] = vector_of(normal);
    has_normal_[index(v)] = true;
  }
  void set_normal(om::VertexHandle v, const om::Vec3d& normal) override { set_normal(v, om::Vec3f(normal)); }
  void set_color(om::VertexHandle v, const om::Vec3uc& c) override {
    mesh.colours_8bit = true;
    set_colour(v, V3f(c[0], c[1], c[2]) / 255.0F);
  }
  void set_color(om::VertexHandle v, const om::Vec4uc& c) override {
    mesh.colours_8bit = true;
    set_colour(v, V3f(c[0], c[1], c[2]) / 255.0F);
  }
  void set_color(om::VertexHandle v, const om::Vec3f& c) override { set_colour(v, vector_of(c)); }
  void set_color(om::VertexHandle v, const om::Vec4f& c) override { set_colour(v, V3f(c[0], c[1], c[2])); }
  void reserve(unsigned vertices, unsigned, unsigned faces) override {
    if (vertices > file_size_ || faces > file_size_) throw Stop{"has fewer vertices or faces than it says"};
    said_vertices_ = vertices;
    said_faces_ = faces;
  }
  std::size_t n_vertices() const override { return mesh.positions.size(); }
  std::size_t n_faces() const override { return mesh.faces.size(); }
  std::size_t n_edges() const override { return 0; }

  // What a cell's mesh has no use for.
  om::HalfedgeHandle add_edge(om::VertexHandle, om::VertexHandle) override { return om::HalfedgeHandle(); }
  om::FaceHandle add_face(om::HalfedgeHandle) override { return om::FaceHandle(); }
  void add_face_texcoords(om::FaceHandle, om::VertexHandle, const std::vector<om::Vec2f>&) override {}
  void add_face_texcoords(om::FaceHandle, om::VertexHandle, const std::vector<om::Vec3f>&) override {}
  void set_face_texindex(om::FaceHandle, int) override {}
  void set_halfedge(om::VertexHandle, om::HalfedgeHandle) override {}
  void set_texcoord(om::VertexHandle, const om::Vec2f&) override {}
  void set_status(om::VertexHandle, const om::Attributes::StatusInfo&) override {}
  void set_next(om::HalfedgeHandle, om::HalfedgeHandle) override {}
  void set_face(om::HalfedgeHandle, om::FaceHandle) override {}
  void request_face_texcoords2D() override {}
  void set_texcoord(om::HalfedgeHandle, const om::Vec2f&) override {}
  void set_texcoord(om::VertexHandle, const om::Vec3f&) override {}
  void set_texcoord(om::HalfedgeHandle, const om::Vec3f&) override {}
  void set_status(om::HalfedgeHandle, const om::Attributes::StatusInfo&) override {}
  void set_color(om::EdgeHandle, const om::Vec3uc&) override {}
  void set_color(om::FaceHandle, const om::Vec3uc&) override {}
  void set_color(om::FaceHandle, const om::Vec4uc&) override {}
  void set_color(om::FaceHandle, const om::Vec3f&) override {}
  void set_color(om::FaceHandle, const om::Vec4f&) override {}
  void set_color(om::EdgeHandle, const om::Vec4uc&) override {}
  void set_color(om::EdgeHandle, const om::Vec3f&) override {}
  void set_color(om::EdgeHandle, const om::Vec4f&) override {}
  void set_status(om::EdgeHandle, const om::Attributes::StatusInfo&) override {}
  void set_normal(om::FaceHandle, const om::Vec3f&) override {}
  void set_normal(om::FaceHandle, const om::Vec3d&) override {}
  void set_status(om::FaceHandle, const om::Attributes::StatusInfo&) override {}
  void add_texture_information(int, std::string) override {}

  RawMesh take() {
    if (mesh.positions.size() < said_vertices_ || mesh.faces.size() < said_faces_) {
      throw Stop{fmt::format("has {} vertices and {} faces, but says {} and {}", mesh.positions.size(),
                             mesh.faces.size(), said_vertices_, said_faces_)};
    }
    const bool all = normals_.size() == mesh.positions.size() &&
                     std::find(has_normal_.begin(), has_normal_.end(), false) == has_normal_.end();
    if (all && !split_normals_) mesh.normals = std::move(normals_);
    if (!mesh.colours.empty()) mesh.colours.resize(mesh.positions.size(), V3f(-1));
    return std::move(mesh);
  }

  RawMesh mesh;

 private:
  bool known(om::VertexHandle v) const { return v.idx() >= 0 && index(v) < mesh.positions.size(); }
  static std::size_t index(om::VertexHandle v) { return static_cast<std::size_t>(v.idx()); }
  void set_colour(om::VertexHandle v, const V3f& colour) {
    if (!known(v)) return;
    mesh.colours.resize(mesh.positions.size(), V3f(-1));
    mesh.colours[index(v)] = colour;
  }

  std::size_t file_size_;
  std::size_t said_vertices_ = 0;
  std::size_t said_faces_ = 0;
  std::vector<V3f> normals_;
  std::vector<bool> has_normal_;
  bool split_normals_ = false;
};

/// OpenMesh passes over lines of text that it cannot read; these checks stand before it.
using LineCheck = Result<void> (*)(std::string_view keyword, std::string_view rest, const std::string& file,
                                   const std::string& place);

Result<void> check_point(std::string_view rest, const std::string& file, const std::string& place) {
  const std::string text(rest);
  const char* at = text.c_str();
  for (int i = 0; i < 3; ++i) {
    char* end = nullptr;
    const double value = std::strtod(at, &end);
    if (end == at) return fail(Code::file_damaged, file, place, "a vertex needs three numbers");
    if (!std::isfinite(static_cast<float>(value))) {
      return fail(Code::mesh_not_finite, file, place, "a vertex is NaN, infinite or beyond a float");
    }
    at = end;
  }
  return {};
}

Result<void> check_obj_line(std::string_view keyword, std::string_view rest, const std::string& file,
                            const std::string& place) {
  if (keyword == "v") {
    std::istringstream numbers{std::string(rest)};
    const auto count = std::distance(std::istream_iterator<std::string>(numbers), {});
    // x y z, with a weight, with a colour, or with both: anything else was cut.
    if (count == 5) return fail(Code::file_damaged, file, place, "a vertex with 5 numbers");
    return check_point(rest, file, place);
  }
  if (keyword != "f") return {};
  int corners = 0;
  std::istringstream words{std::string(rest)};
  for (std::string word; words >> word; ++corners) {
    if (word.find_first_not_of("0123456789-/") != std::string::npos || word.front() == '/') {
      return fail(Code::file_damaged, file, place, fmt::format("\"{}\" is not a corner of a face", word));
    }
  }
  if (corners < 3) return fail(Code::file_damaged, file, place, "a face needs three corners");
  return {};
}

Result<void> check_stl_line(std::string_view keyword, std::string_view rest, const std::string& file,
                            const std::string& place) {
  return keyword == "vertex" ? check_point(rest, file, place) : Result<void>{};
}

/// What separates words for OpenMesh's streams, line ends apart.
constexpr std::string_view blanks = " \t\r\v\f";

Result<void> check_lines(std::string_view text, const std::string& file, LineCheck check) {
  int number = 0;
  while (!text.empty()) {
    ++number;
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    line.remove_prefix(std::min(line.find_first_not_of(blanks), line.size()));
    const std::size_t space = std::min(line.find_first_of(blanks), line.size());
    auto sound = check(line.substr(0, space), line.substr(space), file, fmt::format("line {}", number));
    if (!sound) return sound;
  }
  return {};
}

/// The lines of an OBJ file that count: without materials, whose files OpenMesh would look for.
std::string geometry_of(std::string_view text) {
  std::string kept;
  std::istringstream lines{std::string(text)};
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string keyword;
    words >> keyword;
    if (keyword == "v" || keyword == "vn" || keyword == "f") kept += line + "\n";
  }
  return kept;
}

constexpr std::size_t stl_header = 84;
constexpr std::size_t stl_triangle = 50;

/// A binary STL says its size; texts begin with "solid", but so do the headers of some binary ones.
bool is_binary_stl(const std::string& bytes) {
  if (bytes.size() < stl_header) return bytes.rfind("solid", 0) != 0;
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + 80, 4);
  return bytes.size() == stl_header + stl_triangle * count || bytes.rfind("solid", 0) != 0;
}

Result<void> check_binary_stl(const std::string& bytes, const std::string& file) {
  std::uint32_t count = 0;
  if (bytes.size() >= stl_header) std::memcpy(&count, bytes.data() + 80, 4);
  if (bytes.size() < stl_header + stl_triangle * count) {
    return fail(Code::file_damaged, file, "",
                fmt::format("{} bytes are too few for its triangles", bytes.size()));
  }
  for (std::size_t t = 0; t < count; ++t) {
    std::array<float, 9> corner{};
    std::memcpy(corner.data(), bytes.data() + stl_header + t * stl_triangle + 12, sizeof corner);
    for (const float value : corner) {
      if (!std::isfinite(value)) {
        return fail(Code::mesh_not_finite, file, fmt::format("triangle {}", t),
                    "a vertex is NaN or infinite");
      }
    }
  }
  return {};
}

}  // namespace

Result<RawMesh> import_mesh(const std::string& bytes, const std::string& format, const std::string& file,
                            const MaterialColours& materials) {
  om::IO::Options options = om::IO::Options::VertexNormal | om::IO::Options::VertexColor;
  RawMesh painted;  // the colours of faces, which OpenMesh does not give
  Result<void> sound;
  std::vector<V3d> points;  // those of texts, in double
  V3d origin(0, 0, 0);
  std::istringstream in;
  if (format == "obj") {
    const std::string plain = plain_obj(bytes);
    sound = check_lines(plain, file, check_obj_line);
    in.str(geometry_of(plain));
    points = obj_points(plain);
    painted.face_colours = obj_face_colours(plain, materials);
  } else if (format == "stl" && is_binary_stl(bytes)) {
    sound = check_binary_stl(bytes, file);
    if (sound) painted.face_colours = stl_face_colours(bytes);
    painted.face_colours_8bit = true;
    in.str(bytes);
    options += om::IO::Options::Binary;
  } else if (format == "stl") {
    sound = check_lines(bytes, file, check_stl_line);
    if (sound && bytes.find("endsolid") == std::string::npos) {
      sound = fail(Code::file_damaged, file, "", "the text is cut short: no endsolid");
    }
    in.str(stl_near_origin(bytes, origin));
  } else {
    in.str(off_without_face_colours(bytes, painted));
    points = off_points(bytes);
    // Readers of counted formats take what a failed read leaves behind for data: stop at the first one.
    in.exceptions(std::ios::failbit | std::ios::badbit);
  }
  if (!sound) return tl::unexpected(sound.error());

  static std::mutex one_at_a_time;
  const std::lock_guard lock(one_at_a_time);
  omerr().disable();
  omlog().disable();
  omout().disable();
  const auto damaged = [&](const std::string& why) { return fail(Code::file_damaged, file, "", why); };
  try {
    Collector collector(bytes.size());
    if (!om::IO::IOManager().read(in, format, collector, options)) {
      return damaged(fmt::format("is not a readable {} file", format));
    }
    RawMesh mesh = collector.take();
    sharpen(mesh.positions, points);
    for (V3d& p : mesh.positions) p += origin;
    if (options.check(om::IO::Options::ColorFloat)) mesh.colours_8bit = false;
    if (!painted.face_colours.empty() && painted.face_colours.size() == mesh.faces.size()) {
      mesh.face_colours = std::move(painted.face_colours);
      mesh.face_colours_8bit = painted.face_colours_8bit;
    }
    return mesh;
  } catch (const Stop& stop) {
    return damaged(stop.message);
  } catch (const std::ios::failure&) {
    return damaged("is cut short, or a number of it cannot be read");
  } catch (const std::exception& error) {
    return damaged(error.what());
  }
}

}  // namespace selvedge
