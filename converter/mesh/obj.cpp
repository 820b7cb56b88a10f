#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "converter/mesh/raw_mesh.h"
#include "format/base/words.h"

namespace selvedge {
namespace {

constexpr int absent = -1;

class ObjReader {
 public:
  ObjReader(const std::string& file, const MaterialColours& materials) : file_(file), materials_(materials) {}

  Result<void> read_line(const Words& words, int number) {
    if (words[0] == "v") return read_vertex(words, number);
    if (words[0] == "f") return read_face(words, number);
    if (words[0] == "vn") {
      V3d normal;
      bool sound = words.size() >= 4;
      for (int i = 0; i < 3 && sound; ++i) sound = to_number(words[i + 1], normal[i]);
      if (sound) normals_.emplace_back(normal);
    }
    if (words[0] == "usemtl") {
      const auto found = materials_.find(std::string(rest_of(words)));
      material_ = found == materials_.end() ? V3f(-1) : found->second;
      any_material_ = any_material_ || found != materials_.end();
    }
    return {};
  }

  RawMesh finish() {
    if (!any_material_) mesh_.face_colours.clear();
    if (!mesh_.colours.empty()) mesh_.colours.resize(mesh_.positions.size(), V3f(-1));
    normal_of_.resize(mesh_.positions.size(), absent);
    if (!split_normals_ && std::find(normal_of_.begin(), normal_of_.end(), absent) == normal_of_.end()) {
      for (const int n : normal_of_) mesh_.normals.push_back(normals_[n]);
    }
    return std::move(mesh_);
  }

 private:
  Result<void> read_vertex(const Words& words, int number) {
    // x y z, with a weight, a colour or both: any other count means a damaged line.
    if (words.size() == 6) return damaged(number, "a vertex with 5 numbers");
    const auto point = position_at(words, 1, file_, number);
    if (!point) return tl::unexpected(point.error());
    mesh_.positions.push_back(*point);
    V3d colour;
    bool coloured = words.size() > 6;
    for (int i = 0; i < 3 && coloured; ++i) coloured = to_number(words[i + 4], colour[i]);
    if (coloured) {
      mesh_.colours.resize(mesh_.positions.size(), V3f(-1));
      mesh_.colours.back() = V3f(colour);
    }
    return {};
  }

  Result<void> read_face(const Words& words, int number) {
    if (words.size() < 4) return damaged(number, "a face needs three corners");
    std::vector<int> face;
    for (const std::string_view word : std::span(words).subspan(1)) {
      // vertex, vertex/texture, vertex//normal or vertex/texture/normal
      const std::size_t slash = std::min(word.find('/'), word.size());
      const std::size_t second = std::min(word.find('/', slash + 1), word.size());
      int vertex = absent;
      int normal = absent;
      if (!to_obj_index(word.substr(0, slash), mesh_.positions.size(), vertex)) {
        return damaged(number, fmt::format("\"{}\" is not a corner of a face", word));
      }
      if (second < word.size()) to_obj_index(word.substr(second + 1), normals_.size(), normal);
      face.push_back(vertex);
      set_normal(vertex, normal);
    }
    mesh_.faces.push_back(std::move(face));
    mesh_.face_colours.push_back(material_);
    return {};
  }

  void set_normal(int vertex, int normal) {
    if (vertex < 0 || vertex >= static_cast<int>(mesh_.positions.size())) return;
    if (normal < 0 || normal >= static_cast<int>(normals_.size())) return;
    normal_of_.resize(mesh_.positions.size(), absent);
    int& previous = normal_of_[vertex];
    split_normals_ = split_normals_ || (previous != absent && normals_[previous] != normals_[normal]);
    previous = normal;
  }

  tl::unexpected<Error> damaged(int number, std::string why) const {
    return fail(Code::file_damaged, file_, fmt::format("line {}", number), std::move(why));
  }

  const std::string& file_;
  const MaterialColours& materials_;
  RawMesh mesh_;
  std::vector<V3f> normals_;
  std::vector<int> normal_of_;  ///< of each vertex so far
  bool split_normals_ = false;  ///< some vertex has two
  V3f material_{-1};
  bool any_material_ = false;
};

}  // namespace

std::vector<std::string> material_files(const std::string& bytes) {
  std::vector<std::string> files;
  (void)for_each_line(obj_text(bytes), [&](const Words& words, int) -> Result<void> {
    if (words[0] == "mtllib") files.emplace_back(rest_of(words));
    return {};
  });
  return files;
}

void read_materials(const std::string& text, MaterialColours& colours) {
  std::string name;
  (void)for_each_line(obj_text(text), [&](const Words& words, int) -> Result<void> {
    if (words[0] == "newmtl") name = rest_of(words);
    if (words[0] != "Kd" || words.size() < 4) return {};
    V3d colour;
    for (int i = 0; i < 3; ++i) {
      if (!to_number(words[i + 1], colour[i]) || !(colour[i] >= 0)) return {};
    }
    colours[name] = V3f(colour);
    return {};
  });
}

Result<RawMesh> read_obj(const std::string& bytes, const std::string& file,
                         const MaterialColours& materials) {
  ObjReader reader(file, materials);
  const auto read_line = [&](const Words& words, int number) { return reader.read_line(words, number); };
  if (auto ok = for_each_line(obj_text(bytes), read_line); !ok) return tl::unexpected(ok.error());
  return reader.finish();
}

}  // namespace selvedge
