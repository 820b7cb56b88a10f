// PLY files, ASCII and binary of both byte orders, as tables of numbers.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "format/base/error.h"

namespace selvedge {

struct PlyType {
  std::size_t size;
  char kind;  ///< 'i' signed, 'u' unsigned, 'f' floating

  /// The largest integer of this type; 1 for floating types.
  double full_scale() const;
};

struct PlyProperty {
  std::string name;
  PlyType type{};
  std::optional<PlyType> length_type;  ///< of a list
  std::vector<double> values;  ///< one per item of the element; the lists of all items behind each other
  std::vector<std::size_t> list_ends;  ///< per item, where its list ends in `values`
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;

  /// The scalar properties of these names, or nothing unless there are all.
  std::vector<const PlyProperty*> find_all(std::initializer_list<std::string_view> names) const;
  /// The first list of one of these names, or null.
  const PlyProperty* find_list(std::initializer_list<std::string_view> names) const;
};

struct PlyFile {
  std::vector<std::string> comments;
  std::vector<PlyElement> elements;

  const PlyElement* find(std::string_view name) const;
};

/// The most bytes of memory that a byte of a file takes.
inline constexpr std::uint64_t ply_memory_factor = 24;

/// Reads all numbers. FILE_DAMAGED, with the line or the item as the place, for a malformed header, an
/// element that is there twice, and a file that ends early.
Result<PlyFile> read_ply(std::string_view bytes, const std::string& file);

}  // namespace selvedge
