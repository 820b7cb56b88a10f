// The header of PLY files and the numbers of their body, for the readers of meshes and of garments.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "format/base/error.h"

namespace selvedge {

struct PlyType {
  std::size_t size;
  char kind;  ///< 'i' signed, 'u' unsigned, 'f' floating
};

struct PlyProperty {
  std::string name;
  PlyType type{};
  std::optional<PlyType> length;  ///< of a list
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;
};

enum class PlyForm { ascii, little, big };

struct PlyHeader {
  PlyForm form = PlyForm::ascii;
  std::vector<PlyElement> elements;
  std::vector<std::string> comments;
  std::size_t size = 0;  ///< bytes up to the body
};

/// FILE_DAMAGED, with the line, for a header that is none.
Result<PlyHeader> read_ply_header(std::string_view bytes, const std::string& file);

/// Reads the numbers of the body in order.
class PlyBody {
 public:
  PlyBody(std::string_view bytes, PlyForm form) : bytes_(bytes), form_(form) {}

  std::size_t bytes_left() const { return bytes_.size(); }

  /// False at the end of the file, and if the next word is not a number.
  bool read(PlyType type, double& value) {
    return form_ == PlyForm::ascii ? read_text(value) : read_binary(type, value);
  }

 private:
  bool read_text(double& value);
  bool read_binary(PlyType type, double& value);

  std::string_view bytes_;
  PlyForm form_;
};

}  // namespace selvedge
