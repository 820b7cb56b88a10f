#include "format/base/ply.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <map>
#include <sstream>

#include "format/base/words.h"

namespace selvedge {
namespace {

std::optional<PlyType> type_named(const std::string& name) {
  static const std::map<std::string, PlyType> types{
      {"char", {1, 'i'}},  {"int8", {1, 'i'}},    {"uchar", {1, 'u'}},  {"uint8", {1, 'u'}},
      {"short", {2, 'i'}}, {"int16", {2, 'i'}},   {"ushort", {2, 'u'}}, {"uint16", {2, 'u'}},
      {"int", {4, 'i'}},   {"int32", {4, 'i'}},   {"uint", {4, 'u'}},   {"uint32", {4, 'u'}},
      {"float", {4, 'f'}}, {"float32", {4, 'f'}}, {"double", {8, 'f'}}, {"float64", {8, 'f'}}};
  const auto found = types.find(name);
  return found == types.end() ? std::nullopt : std::optional(found->second);
}

/// Reads one line of the header; returns the fault, or nothing.
std::string read_header_line(const std::string& line, PlyHeader& header, bool& has_format) {
  std::istringstream words(line);
  std::string keyword;
  words >> keyword;
  if (keyword == "comment") header.comments.push_back(line.substr(line.find(keyword) + keyword.size()));
  if (keyword.empty() || keyword == "comment" || keyword == "obj_info") return "";
  if (keyword == "format") {
    std::string form;
    words >> form;
    has_format = true;
    header.form =
        form == "ascii" ? PlyForm::ascii : (form == "binary_big_endian" ? PlyForm::big : PlyForm::little);
    const bool known = header.form != PlyForm::little || form == "binary_little_endian";
    return known ? "" : "unknown format";
  }
  if (keyword == "element") {
    PlyElement element;
    words >> element.name >> element.count;
    if (words.fail()) return "an element needs a name and a count";
    header.elements.push_back(element);
    return "";
  }
  if (keyword != "property") return "unknown keyword";
  if (header.elements.empty()) return "a property before any element";
  PlyProperty property;
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

}  // namespace

Result<PlyHeader> read_ply_header(std::string_view bytes, const std::string& file) {
  PlyHeader header;
  bool has_format = false;
  for (int number = 1;; ++number) {
    const auto refuse = [&](std::string why) {
      return fail(Code::file_damaged, file, fmt::format("line {}", number), std::move(why));
    };
    const std::size_t end = bytes.find('\n', header.size);
    if (end == std::string_view::npos) return refuse("the header has no end");
    std::string line(bytes.substr(header.size, end - header.size));
    if (line.ends_with('\r')) line.pop_back();
    header.size = end + 1;
    if (number == 1) {
      if (line != "ply") return refuse("is not a PLY file");
      continue;
    }
    if (line == "end_header") break;
    if (std::string why = read_header_line(line, header, has_format); !why.empty())
      return refuse(std::move(why));
  }
  if (!has_format) return fail(Code::file_damaged, file, "", "the header names no format");
  return header;
}

bool PlyBody::read_text(double& value) {
  constexpr std::string_view blanks = " \t\r\n";
  bytes_.remove_prefix(std::min(bytes_.find_first_not_of(blanks), bytes_.size()));
  const std::string_view word = bytes_.substr(0, bytes_.find_first_of(blanks));
  bytes_.remove_prefix(word.size());
  return to_number(word, value);
}

bool PlyBody::read_binary(PlyType type, double& value) {
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

}  // namespace selvedge
