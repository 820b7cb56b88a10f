#include "format/mesh/ply.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <map>
#include <sstream>

#include "format/base/guard.h"
#include "format/mesh/mesh_file.h"

namespace selvedge {
namespace {

enum class PlyForm { ascii, little, big };

constexpr std::size_t max_elements = 256;

struct PlyHeader {
  PlyForm form = PlyForm::ascii;
  std::size_t size = 0;  ///< bytes up to the body
};

std::optional<PlyType> type_named(const std::string& name) {
  static const std::map<std::string, PlyType> types{
      {"char", {1, 'i'}},  {"int8", {1, 'i'}},    {"uchar", {1, 'u'}},  {"uint8", {1, 'u'}},
      {"short", {2, 'i'}}, {"int16", {2, 'i'}},   {"ushort", {2, 'u'}}, {"uint16", {2, 'u'}},
      {"int", {4, 'i'}},   {"int32", {4, 'i'}},   {"uint", {4, 'u'}},   {"uint32", {4, 'u'}},
      {"float", {4, 'f'}}, {"float32", {4, 'f'}}, {"double", {8, 'f'}}, {"float64", {8, 'f'}}};
  const auto found = types.find(name);
  return found == types.end() ? std::nullopt : std::optional(found->second);
}

/// Reads one line of the header; `refuse` throws.
template <class Refuse>
void read_header_line(const std::string& line, const Refuse& refuse, PlyFile& ply,
                      std::optional<PlyForm>& form) {
  std::istringstream words(line);
  std::string keyword;
  words >> keyword;
  if (keyword == "comment") ply.comments.push_back(line.substr(line.find(keyword) + keyword.size()));
  if (keyword.empty() || keyword == "comment" || keyword == "obj_info") return;
  if (keyword == "format") {
    std::string name;
    words >> name;
    if (name == "ascii") form = PlyForm::ascii;
    if (name == "binary_little_endian") form = PlyForm::little;
    if (name == "binary_big_endian") form = PlyForm::big;
    if (!form) refuse("unknown format");
  } else if (keyword == "element") {
    PlyElement element;
    words >> element.name >> element.count;
    if (words.fail()) refuse("an element needs a name and a count");
    if (ply.find(element.name) != nullptr) refuse("duplicate element");
    if (ply.elements.size() == max_elements) refuse("too many elements");
    ply.elements.push_back(element);
  } else if (keyword == "property") {
    if (ply.elements.empty()) refuse("a property before any element");
    PlyProperty property;
    std::string type;
    words >> type;
    if (type == "list") {
      std::string length;
      words >> length >> type;
      property.length_type = type_named(length);
      if (!property.length_type || property.length_type->kind == 'f')
        refuse("unknown type of a list's length");
    }
    words >> property.name;
    const auto known = type_named(type);
    if (!known || property.name.empty()) refuse("a property needs a known type and a name");
    property.type = *known;
    ply.elements.back().properties.push_back(property);
  } else {
    refuse("unknown keyword");
  }
}

PlyHeader read_header(std::string_view bytes, const std::string& file, PlyFile& ply) {
  std::size_t size = 0;
  std::optional<PlyForm> form;
  for (int number = 1;; ++number) {
    const auto refuse = [&](const char* why) {
      throw Failure{{Code::file_damaged, file, fmt::format("line {}", number), why}};
    };
    const std::size_t end = bytes.find('\n', size);
    if (end == std::string_view::npos) refuse("the header has no end");
    std::string line(bytes.substr(size, end - size));
    if (line.ends_with('\r')) line.pop_back();
    size = end + 1;
    if (number == 1 && line != "ply") refuse("is not a PLY file");
    if (line == "end_header") break;
    if (number > 1) read_header_line(line, refuse, ply, form);
  }
  if (!form) throw Failure{{Code::file_damaged, file, "", "the header names no format"}};
  return {*form, size};
}

/// Reads the numbers of the body in order.
class PlyBody {
 public:
  PlyBody(std::string_view bytes, PlyForm form) : bytes_(bytes), form_(form) {}

  /// Whether `count` items of `values` values may follow, `size` bytes each in binary. In text a value needs
  /// a digit and a blank.
  bool has(double count, std::size_t values, std::size_t size) const {
    const std::size_t each = form_ == PlyForm::ascii ? 2 * values : size;
    const std::size_t most = (bytes_.size() + 1) / each;
    return count >= 0 && count <= static_cast<double>(most);
  }

  /// False at the end of the file, and if the next word is not a number.
  bool read(PlyType type, double& value) {
    return form_ == PlyForm::ascii ? read_text(value) : read_binary(type, value);
  }

 private:
  bool read_text(double& value) {
    constexpr std::string_view blanks = " \t\r\n";
    bytes_.remove_prefix(std::min(bytes_.find_first_not_of(blanks), bytes_.size()));
    const std::string_view word = bytes_.substr(0, bytes_.find_first_of(blanks));
    bytes_.remove_prefix(word.size());
    return parse_number(word, value);
  }

  bool read_binary(PlyType type, double& value) {
    if (bytes_.size() < type.size) return false;
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < type.size; ++i) {
      const std::size_t byte = form_ == PlyForm::little ? type.size - 1 - i : i;
      bits = bits << 8 | static_cast<std::uint8_t>(bytes_[byte]);
    }
    bytes_.remove_prefix(type.size);
    if (type.kind == 'u') {
      value = static_cast<double>(bits);
    } else if (type.kind == 'i') {
      const auto unused = 64 - 8 * type.size;  // sign extension
      value = static_cast<double>(static_cast<std::int64_t>(bits << unused) >> unused);
    } else {
      value = type.size == 8 ? std::bit_cast<double>(bits)
                             : static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
    }
    return true;
  }

  std::string_view bytes_;
  PlyForm form_;
};

/// Reads one item's value or list.
bool read_property(PlyBody& body, PlyProperty& property) {
  double count = 1;
  if (property.length_type && !body.read(*property.length_type, count)) return false;
  if (!body.has(count, 1, property.type.size)) return false;
  for (auto left = static_cast<std::size_t>(count); left > 0; --left)
    if (!body.read(property.type, property.values.emplace_back())) return false;
  if (property.length_type) property.list_ends.push_back(property.values.size());
  return true;
}

}  // namespace

double PlyType::full_scale() const {
  if (kind == 'f') return 1;
  const auto bits = static_cast<int>(8 * size) - (kind == 'i' ? 1 : 0);
  return static_cast<double>((std::uint64_t{1} << bits) - 1);
}

std::vector<const PlyProperty*> PlyElement::find_all(std::initializer_list<std::string_view> names) const {
  std::vector<const PlyProperty*> found;
  for (const std::string_view wanted : names) {
    const auto property = std::ranges::find_if(
        properties, [&](const PlyProperty& one) { return one.name == wanted && !one.length_type; });
    if (property == properties.end()) return {};
    found.push_back(&*property);
  }
  return found;
}

const PlyProperty* PlyElement::find_list(std::initializer_list<std::string_view> names) const {
  for (const PlyProperty& property : properties)
    if (property.length_type && std::ranges::find(names, property.name) != names.end()) return &property;
  return nullptr;
}

const PlyElement* PlyFile::find(std::string_view name) const {
  const auto found = std::ranges::find(elements, name, &PlyElement::name);
  return found == elements.end() ? nullptr : &*found;
}

Result<PlyFile> read_ply(std::string_view bytes, const std::string& file) {
  PlyFile ply;
  const auto header = catch_failure([&] { return read_header(bytes, file, ply); });
  if (!header) return tl::unexpected(header.error());
  PlyBody body(bytes.substr(header->size), header->form);
  for (PlyElement& element : ply.elements) {
    if (element.properties.empty()) continue;
    const auto damaged = [&](std::uint64_t item) {
      return fail(Code::file_damaged, file, fmt::format("{} {}", element.name, item), "cannot be read");
    };
    const auto size_of = [](const PlyProperty& p) {
      return p.length_type ? p.length_type->size : p.type.size;
    };
    std::size_t size = 0;  // of an item without the contents of its lists
    for (const PlyProperty& property : element.properties) size += size_of(property);
    if (!body.has(static_cast<double>(element.count), element.properties.size(), size)) return damaged(0);
    for (PlyProperty& property : element.properties)
      if (property.length_type)
        property.list_ends.reserve(element.count);
      else
        property.values.reserve(element.count);
    for (std::uint64_t i = 0; i < element.count; ++i)
      for (PlyProperty& property : element.properties)
        if (!read_property(body, property)) return damaged(i);
  }
  return ply;
}

}  // namespace selvedge
