#include <algorithm>
#include <cmath>
#include <limits>

#include "converter/mesh/raw_mesh.h"
#include "format/base/words.h"

namespace selvedge {
namespace {

/// The words of a text without comments.
class OffWords {
 public:
  explicit OffWords(std::string_view text) : text_(text) {}

  /// The next word, on whichever line; empty at the end.
  std::string_view next() {
    while (next_ >= words_.size()) {
      if (text_.empty()) return {};
      const std::size_t end = std::min(text_.find('\n'), text_.size());
      const std::string_view line = text_.substr(0, end);
      split_words(line.substr(0, line.find('#')), words_);
      text_.remove_prefix(std::min(end + 1, text_.size()));
      next_ = 0;
    }
    return words_[next_++];
  }

  template <class Number>
  bool read(Number& number) {
    double value = 0;
    if (!to_number(next(), value) ||
        !(std::abs(value) <= static_cast<double>(std::numeric_limits<Number>::max())))
      return false;
    number = static_cast<Number>(value);
    return true;
  }

  bool read(V3d& vector) { return read(vector.x) && read(vector.y) && read(vector.z); }

  /// The rest of the line as a colour; (-1, -1, -1) if it is not one: a single number is an index into a
  /// table that only some programs have.
  V3f read_colour(bool& in_bytes) {
    const Words rest(words_.begin() + static_cast<std::ptrdiff_t>(next_), words_.end());
    next_ = words_.size();
    V3d colour;
    if (rest.size() < 3) return V3f(-1);
    for (int i = 0; i < 3; ++i) {
      if (!to_number(rest[i], colour[i])) return V3f(-1);
    }
    in_bytes = rest[0].find_first_of(".eE") == std::string_view::npos;
    return V3f(colour) / (in_bytes ? 255.0F : 1.0F);
  }

 private:
  std::string_view text_;
  Words words_;  ///< of the current line
  std::size_t next_ = 0;
};

bool any_colour(const std::vector<V3f>& colours) {
  return std::any_of(colours.begin(), colours.end(), [](const V3f& c) { return c.x >= 0; });
}

}  // namespace

Result<RawMesh> read_off(const std::string& bytes, const std::string& file) {
  const auto damaged = [&](const char* why) { return fail(Code::file_damaged, file, "", why); };
  OffWords words(bytes);
  const std::string_view keyword = words.next();  // [ST][C][N]OFF
  if (!keyword.ends_with("OFF")) return damaged("is not a readable off file");
  const bool coloured = keyword.find('C') != std::string_view::npos;
  const bool has_normals = keyword.find('N') != std::string_view::npos;
  constexpr const char* cut = "is cut short, or a number of it cannot be read";
  int vertices = 0;
  int faces = 0;
  int edges = 0;
  if (!words.read(vertices) || !words.read(faces) || !words.read(edges)) return damaged(cut);
  RawMesh mesh;
  for (; vertices > 0; --vertices) {
    V3d position;
    V3d normal;
    if (!words.read(position) || (has_normals && !words.read(normal))) return damaged(cut);
    mesh.positions.push_back(position + V3d(0));  // -0 and 0 become the same bits
    const V3f colour = words.read_colour(mesh.colours_8bit);
    mesh.colours.push_back(coloured ? colour : V3f(-1));
  }
  for (; faces > 0; --faces) {
    std::vector<int> face;
    int corners = 0;
    if (!words.read(corners)) return damaged(cut);
    for (; corners > 0; --corners) {
      int vertex = 0;
      if (!words.read(vertex)) return damaged(cut);
      face.push_back(vertex);
    }
    mesh.faces.push_back(std::move(face));
    mesh.face_colours.push_back(words.read_colour(mesh.face_colours_8bit));
  }
  if (!any_colour(mesh.colours)) mesh.colours.clear();
  if (!any_colour(mesh.face_colours)) mesh.face_colours.clear();
  return mesh;
}

}  // namespace selvedge
