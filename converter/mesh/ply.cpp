#include "converter/mesh/ply.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <sstream>
#include <string_view>

namespace selvedge {
namespace {

struct Type {
  std::size_t size;
  char kind;  ///< 'i' signed, 'u' unsigned, 'f' floating
};

std::optional<Type> type_named(const std::string& name) {
  struct Row {
    const char* name;
    const char* other;
    Type type;
  };
  static constexpr std::array<Row, 8> rows{{{"char", "int8", {1, 'i'}},
                                            {"uchar", "uint8", {1, 'u'}},
                                            {"short", "int16", {2, 'i'}},
                                            {"ushort", "uint16", {2, 'u'}},
                                            {"int", "int32", {4, 'i'}},
                                            {"uint", "uint32", {4, 'u'}},
                                            {"float", "float32", {4, 'f'}},
                                            {"double", "float64", {8, 'f'}}}};
  for (const Row& row : rows) {
    if (name == row.name || name == row.other) return row.type;
  }
  return std::nullopt;
}

struct Property {
  std::string name;
  Type type{};
  std::optional<Type> length;  ///< of a list
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

enum class Form { ascii, little, big };

struct Header {
  Form form = Form::ascii;
  std::vector<Element> elements;
  std::size_t size = 0;  ///< bytes up to the body
};

/// One line of the header; what is wrong with it, or nothing.
std::string take_line(const std::string& line, Header& header, bool& has_format) {
  std::istringstream words(line);
  std::string keyword;
  words >> keyword;
  if (keyword.empty() || keyword == "comment" || keyword == "obj_info") return "";
  if (keyword == "format") {
    std::string form;
    words >> form;
    has_format = true;
    if (form == "ascii")
      header.form = Form::ascii;
    else if (form == "binary_little_endian")
      header.form = Form::little;
    else if (form == "binary_big_endian")
      header.form = Form::big;
    else
      return "unknown format";
    return "";
  }
  if (keyword == "element") {
    Element element;
    words >> element.name >> element.count;
    if (words.fail()) return "an element needs a name and a count";
    header.elements.push_back(element);
    return "";
  }
  if (keyword != "property") return "unknown keyword";
  if (header.elements.empty()) return "a property before any element";
  Property property;
  std::string type;
  words >> type;
  if (type == "list") {
    std::string length;
    words >> length >> type;
    property.length = type_named(length);
    if (!property.length || property.length->kind == 'f') return "unknown type of a list's length";
  }
  words >> property.name;
  const auto known = type_named(type);
  if (!known || property.name.empty()) return "a property needs a known type and a name";
  property.type = *known;
  header.elements.back().properties.push_back(property);
  return "";
}

Result<Header> header_of(const std::string& bytes, const std::string& file) {
  Header header;
  bool has_format = false;
  for (int number = 1;; ++number) {
    const auto refuse = [&](std::string why) {
      return fail(Code::file_damaged, file, fmt::format("line {}", number), std::move(why));
    };
    const std::size_t end = bytes.find('\n', header.size);
    if (end == std::string::npos) return refuse("the header has no end");
    std::string line = bytes.substr(header.size, end - header.size);
    if (line.ends_with('\r')) line.pop_back();
    header.size = end + 1;
    if (number == 1) {
      if (line != "ply") return refuse("is not a PLY file");
      continue;
    }
    if (line == "end_header") break;
    if (std::string why = take_line(line, header, has_format); !why.empty()) return refuse(std::move(why));
  }
  if (!has_format) return fail(Code::file_damaged, file, "", "the header names no format");
  return header;
}

/// The numbers of the body, one after the other.
class Body {
 public:
  Body(std::string_view bytes, Form form) : bytes_(bytes), form_(form) {}

  std::size_t bytes_left() const { return bytes_.size(); }

  /// False at the end of the file, and where there is no number.
  bool read(Type type, double& value) {
    return form_ == Form::ascii ? read_text(value) : read_binary(type, value);
  }

 private:
  bool read_text(double& value) {
    bytes_.remove_prefix(std::min(bytes_.find_first_not_of(" \t\r\n"), bytes_.size()));
    const char* end = bytes_.data() + bytes_.size();
    const auto result = std::from_chars(bytes_.data(), end, value);
    if (result.ec == std::errc::result_out_of_range)
      value = std::numeric_limits<double>::infinity();
    else if (result.ec != std::errc())
      return false;
    bytes_.remove_prefix(static_cast<std::size_t>(result.ptr - bytes_.data()));
    return true;
  }

  bool read_binary(Type type, double& value) {
    if (bytes_.size() < type.size) return false;
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < type.size; ++i) {
      const std::size_t at = form_ == Form::little ? type.size - 1 - i : i;
      bits = bits << 8 | static_cast<std::uint8_t>(bytes_[at]);
    }
    bytes_.remove_prefix(type.size);
    if (type.kind == 'u') {
      value = static_cast<double>(bits);
    } else if (type.kind == 'i') {
      const auto unused = 64 - 8 * type.size;  // shifted out and back in as copies of the sign
      value = static_cast<double>(static_cast<std::int64_t>(bits << unused) >> unused);
    } else {
      value = type.size == 8 ? std::bit_cast<double>(bits)
                             : static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
    }
    return true;
  }

  std::string_view bytes_;
  Form form_;
};

/// Where a property goes: 0 to 2 position, 3 to 5 normal, 6 to 8 colour; -1 nowhere.
int slot_of(const std::string& name) {
  static constexpr std::array<std::array<const char*, 3>, 9> names{{{"x", "", ""},
                                                                    {"y", "", ""},
                                                                    {"z", "", ""},
                                                                    {"nx", "", ""},
                                                                    {"ny", "", ""},
                                                                    {"nz", "", ""},
                                                                    {"red", "r", "diffuse_red"},
                                                                    {"green", "g", "diffuse_green"},
                                                                    {"blue", "b", "diffuse_blue"}}};
  for (std::size_t slot = 0; slot < names.size(); ++slot) {
    if (std::find(names[slot].begin(), names[slot].end(), name) != names[slot].end())
      return static_cast<int>(slot);
  }
  return -1;
}

constexpr int first_of_colour = 6;

/// What a colour's numbers are divided by.
double full_scale(Type type) {
  if (type.kind == 'f') return 1;
  const auto bits = static_cast<int>(8 * type.size) - (type.kind == 'i' ? 1 : 0);
  return static_cast<double>((std::uint64_t{1} << bits) - 1);
}

int index_of(double value) {
  return value >= 0 && value <= std::numeric_limits<int>::max() ? static_cast<int>(value) : -1;
}

V3f vector_at(const std::array<double, 9>& values, std::size_t first) {
  return V3f(V3d(values[first], values[first + 1], values[first + 2]));
}

bool read_element(const Element& element, Body& body, RawMesh& mesh) {
  const bool vertices = element.name == "vertex";
  const bool faces = element.name == "face";
  unsigned seen = 0;
  std::vector<int> slots;
  for (const Property& property : element.properties) {
    int slot = (vertices || faces) && !property.length ? slot_of(property.name) : -1;
    if (faces && slot < first_of_colour) slot = -1;
    slots.push_back(slot);
    if (slot < 0) continue;
    seen |= 1U << slot;
    if (slot >= first_of_colour) {
      (vertices ? mesh.colours_8bit : mesh.face_colours_8bit) = property.type.kind != 'f';
    }
  }
  if (vertices && (seen & 7U) != 7U) return false;
  const bool normals = (seen >> 3 & 7U) == 7U;
  const bool colours = (seen >> 6 & 7U) == 7U;
  for (std::uint64_t i = 0; i < element.count; ++i) {
    std::array<double, 9> values{};
    for (std::size_t p = 0; p < element.properties.size(); ++p) {
      const Property& property = element.properties[p];
      double number = 0;
      if (!property.length) {
        if (!body.read(property.type, number)) return false;
        if (slots[p] >= first_of_colour) number /= full_scale(property.type);
        if (slots[p] >= 0) values[slots[p]] = number;
        continue;
      }
      if (!body.read(*property.length, number)) return false;
      if (!(number >= 0) || number > static_cast<double>(body.bytes_left())) return false;
      const bool wanted = faces && (property.name == "vertex_indices" || property.name == "vertex_index");
      std::vector<int> indices;
      for (auto left = static_cast<std::size_t>(number); left > 0; --left) {
        if (!body.read(property.type, number)) return false;
        if (wanted) indices.push_back(index_of(number));
      }
      if (wanted) mesh.faces.push_back(std::move(indices));
    }
    if (faces && colours) mesh.face_colours.push_back(vector_at(values, 6));
    if (!vertices) continue;
    mesh.positions.emplace_back(values[0], values[1], values[2]);
    if (normals) mesh.normals.push_back(vector_at(values, 3));
    if (colours) mesh.colours.push_back(vector_at(values, 6));
  }
  return true;
}

}  // namespace

Result<RawMesh> import_ply(const std::string& bytes, const std::string& file) {
  const auto header = header_of(bytes, file);
  if (!header) return tl::unexpected(header.error());
  Body body(std::string_view(bytes).substr(header->size), header->form);
  RawMesh mesh;
  for (const Element& element : header->elements) {
    if (element.properties.empty()) continue;
    // Each takes a byte at least: more than that can only be a damaged count.
    if (element.count > body.bytes_left() || !read_element(element, body, mesh)) {
      return fail(Code::file_damaged, file, "element " + element.name,
                  fmt::format("there are not {} of them to be read, with all they need", element.count));
    }
  }
  // A second element "vertex" may have brought more of the one than of the other.
  if (mesh.normals.size() != mesh.positions.size()) mesh.normals.clear();
  if (mesh.colours.size() != mesh.positions.size()) mesh.colours.clear();
  if (mesh.face_colours.size() != mesh.faces.size()) mesh.face_colours.clear();
  return mesh;
}

}  // namespace selvedge
