#include "converter/mesh_import.h"

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
    mesh.positions.push_back(vector_of(point));
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
    if (known(v)) mesh.positions[index(v)] = vector_of(point);
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

/// Plain lines: no byte order mark, no comments, continued lines joined (the line numbers stay: joined lines
/// leave empty ones behind), every kind of line end as \n.
std::string plain_obj(std::string_view text) {
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  std::string plain;
  std::string owed;  // line ends of continued lines
  bool comment = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    char c = text[i];
    const bool pair = c == '\r' && i + 1 < text.size() && text[i + 1] == '\n';
    if (pair) continue;
    if (c == '\r') c = '\n';
    if (c == '\n' && plain.ends_with('\\') && !comment) {
      plain.back() = ' ';
      owed += '\n';
      continue;
    }
    if (c == '#') comment = true;
    if (c == '\n') {
      comment = false;
      plain += owed;
      owed.clear();
    }
    if (!comment) plain += c;
  }
  return plain + owed;
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

/// The first word of a line and the rest without blanks around it.
std::pair<std::string, std::string> words_of(const std::string& line) {
  std::istringstream in(line);
  std::string keyword;
  std::string rest;
  in >> keyword;
  std::getline(in >> std::ws, rest);
  rest.erase(rest.find_last_not_of(" \t\r") + 1);
  return {keyword, rest};
}

/// The colour of each face of a plain OBJ text by the material in use; empty where none is known.
std::vector<V3f> face_colours_of(const std::string& plain, const MaterialColours& materials) {
  std::vector<V3f> colours;
  V3f current(-1);
  bool any = false;
  std::istringstream lines(plain);
  for (std::string line; std::getline(lines, line);) {
    const auto [keyword, rest] = words_of(line);
    if (keyword == "usemtl") {
      const auto found = materials.find(rest);
      current = found == materials.end() ? V3f(-1) : found->second;
      any = any || found != materials.end();
    }
    if (keyword == "f") colours.push_back(current);
  }
  return any ? colours : std::vector<V3f>();
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

/// Whether a line of an OFF file says nothing.
bool is_blank(const std::string& line) {
  const std::size_t first = line.find_first_not_of(" \t\r");
  return first == std::string::npos || line[first] == '#';
}

/// An OFF text whose faces have no colours, which OpenMesh takes for more faces; the colours apart. The text
/// as it was where its faces do not stand on lines of their own.
std::string without_face_colours(const std::string& text, RawMesh& colours) {
  std::istringstream lines(text);
  std::string plain;
  std::string line;
  while (std::getline(lines, line) && is_blank(line)) plain += line + "\n";
  std::istringstream header(line);
  std::string keyword;
  std::size_t vertices = 0;
  std::size_t faces = 0;
  header >> keyword;
  if (!keyword.ends_with("OFF") || line.find("BINARY") != std::string::npos) return text;
  plain += line + "\n";
  while (!(header >> vertices >> faces)) {
    if (!std::getline(lines, line)) return text;
    plain += line + "\n";
    if (!is_blank(line)) header = std::istringstream(line);
  }
  for (std::size_t left = vertices; left > 0;) {
    if (!std::getline(lines, line)) return text;
    plain += line + "\n";
    if (!is_blank(line)) --left;
  }
  bool any = false;
  while (colours.face_colours.size() < faces) {
    if (!std::getline(lines, line)) return text;
    if (is_blank(line)) continue;
    std::istringstream words(line);
    std::size_t corners = 0;
    std::string word;
    if (!(words >> corners)) return text;
    plain += std::to_string(corners);
    for (; corners > 0; --corners) {
      if (!(words >> word)) return text;
      plain += " " + word;
    }
    plain += "\n";
    std::vector<std::string> rest;
    while (words >> word && word.front() != '#') rest.push_back(word);
    V3f colour(-1);
    if (rest.size() >= 3) {  // a single number is an index into a table that only some programs have
      colours.face_colours_8bit = rest[0].find_first_of(".eE") == std::string::npos;
      for (unsigned i = 0; i < 3; ++i) {
        colour[i] = std::strtof(rest[i].c_str(), nullptr) / (colours.face_colours_8bit ? 255.0F : 1.0F);
      }
      any = true;
    }
    colours.face_colours.push_back(colour);
  }
  return any ? plain : text;
}

/// The colours of a binary STL's triangles in their two spare bytes: 5 bits each. In Magics' files ("COLOR="
/// in the header) red comes first and the top bit says that there is none; in others (VisCAM, SolidView) blue
/// comes first and the bit says that there is one.
std::vector<V3f> stl_colours(const std::string& bytes, std::size_t triangles) {
  const bool magics = std::string_view(bytes).substr(0, 80).find("COLOR=") != std::string_view::npos;
  std::vector<V3f> colours;
  bool any = false;
  for (std::size_t t = 0; t < triangles; ++t) {
    std::array<std::array<float, 3>, 3> corner{};
    std::memcpy(&corner, bytes.data() + stl_header + t * stl_triangle + 12, sizeof corner);
    // OpenMesh leaves these out.
    if (corner[0] == corner[1] || corner[1] == corner[2] || corner[2] == corner[0]) continue;
    std::uint16_t bits = 0;
    std::memcpy(&bits, bytes.data() + stl_header + t * stl_triangle + 48, 2);
    const V3f first_to_last(static_cast<float>(bits & 31), static_cast<float>(bits >> 5 & 31),
                            static_cast<float>(bits >> 10 & 31));
    const bool coloured = (bits >> 15 == 1) != magics;
    any = any || coloured;
    const V3f& c = first_to_last;
    colours.push_back(coloured ? (magics ? c : V3f(c.z, c.y, c.x)) / 31.0F : V3f(-1));
  }
  return any ? colours : std::vector<V3f>();
}

}  // namespace

std::vector<std::string> material_files(const std::string& bytes) {
  std::vector<std::string> files;
  std::istringstream lines(plain_obj(bytes));
  for (std::string line; std::getline(lines, line);) {
    const auto [keyword, rest] = words_of(line);
    if (keyword == "mtllib") files.push_back(rest);
  }
  return files;
}

void read_materials(const std::string& text, MaterialColours& colours) {
  std::istringstream lines(plain_obj(text));
  std::string name;
  for (std::string line; std::getline(lines, line);) {
    const auto [keyword, rest] = words_of(line);
    if (keyword == "newmtl") name = rest;
    V3f colour;
    if (keyword != "Kd" || !(std::istringstream(rest) >> colour.x >> colour.y >> colour.z)) continue;
    if (colour.x >= 0 && colour.y >= 0 && colour.z >= 0) colours[name] = colour;
  }
}

Result<RawMesh> import_mesh(const std::string& bytes, const std::string& format, const std::string& file,
                            const MaterialColours& materials) {
  om::IO::Options options = om::IO::Options::VertexNormal | om::IO::Options::VertexColor;
  RawMesh painted;  // the colours of faces, which OpenMesh does not give
  Result<void> sound;
  std::istringstream in;
  if (format == "obj") {
    const std::string plain = plain_obj(bytes);
    sound = check_lines(plain, file, check_obj_line);
    in.str(geometry_of(plain));
    painted.face_colours = face_colours_of(plain, materials);
  } else if (format == "stl" && is_binary_stl(bytes)) {
    sound = check_binary_stl(bytes, file);
    if (sound) painted.face_colours = stl_colours(bytes, (bytes.size() - stl_header) / stl_triangle);
    painted.face_colours_8bit = true;
    in.str(bytes);
    options += om::IO::Options::Binary;
  } else if (format == "stl") {
    sound = check_lines(bytes, file, check_stl_line);
    if (sound && bytes.find("endsolid") == std::string::npos) {
      sound = fail(Code::file_damaged, file, "", "the text is cut short: no endsolid");
    }
    in.str(bytes);
  } else {
    in.str(without_face_colours(bytes, painted));
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
