#include <fmt/format.h>

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "format/check/gltf_parts.h"
#include "format/gltf/access.h"

namespace selvedge {
namespace {

/// Larger ones are not opened at all: the largest picture that fits the limits of the viewer, stored raw.
constexpr std::uint64_t largest_file = std::uint64_t{1} << 30;

std::string_view text_of(std::span<const std::uint8_t> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// What a picture's first bytes say that it is; empty if they say nothing.
std::string_view format_of(std::string_view bytes) {
  if (bytes.starts_with("\x89PNG\r\n\x1a\n")) return "image/png";
  if (bytes.starts_with("\xFF\xD8\xFF")) return "image/jpeg";
  if (bytes.starts_with("\xABKTX 20\xBB\r\n\x1a\n")) return "image/ktx2";
  if (bytes.substr(0, 4) == "RIFF" && bytes.substr(8, 4) == "WEBP") return "image/webp";
  return {};
}

/// Why the header of a PNG or JPEG cannot be read; empty if it can.
std::string fault_of_png(std::string_view bytes) {
  constexpr std::size_t header = 8 + 8 + 13 + 4;
  if (bytes.size() < header) return "is cut short";
  if (bytes.substr(12, 4) != "IHDR") return "has no header";
  return {};
}

std::string fault_of_jpeg(std::string_view bytes) {
  const auto byte = [&](std::size_t at) { return static_cast<unsigned char>(bytes[at]); };
  for (std::size_t at = 2; at + 4 <= bytes.size();) {
    if (byte(at) != 0xFF) return "has a broken marker";
    const unsigned marker = byte(at + 1);
    if (marker == 0xFF) {  // fill bytes
      ++at;
      continue;
    }
    const std::size_t length = byte(at + 2) * 256U + byte(at + 3);
    if (length < 2) return "has a segment of impossible length";
    const bool frame = marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
    if (frame) return length < 8 || at + 2 + length > bytes.size() ? "is cut short" : "";
    at += 2 + length;
  }
  return "is cut short";
}

class ImageCheck {
 public:
  ImageCheck(const GltfDocument& document, IssueSink& issues) : document_(document), issues_(issues) {}

  void check(const Json& image, int index) {
    const std::string place = fmt::format("/images/{}", index);
    const Json& uri = member(image, "uri");
    const Json& view = member(image, "bufferView");
    if (uri.is_null() == view.is_null()) {
      if (!uri.is_null() || member(image, "extensions").is_null()) {
        issues_.add(Code::gltf_malformed, place, "needs either a uri or a bufferView");
      }
      return;
    }
    if (uri.is_string()) {
      const auto bytes = read_uri(document_, uri.get<std::string>(), place, largest_file);
      if (bytes) {
        check_bytes(text_of(*bytes), image, place);
      } else {
        issues_.add(Code::image_unreadable, place, bytes.error().message);
      }
    } else if (const auto bytes = bytes_of_view(document_, index_of(view), place)) {
      check_bytes(text_of(*bytes), image, place);
    }
  }

 private:
  void check_bytes(std::string_view bytes, const Json& image, const std::string& place) {
    const std::string_view format = format_of(bytes);
    if (format.empty()) {
      issues_.add(Code::gltf_advice, place, "is in no known picture format");
      return;
    }
    std::string declared =
        member(image, "mimeType").is_string() ? member(image, "mimeType").get<std::string>() : "";
    const Json& uri = member(image, "uri");
    if (uri.is_string() && uri.get_ref<const std::string&>().starts_with("data:")) {
      const std::string& address = uri.get_ref<const std::string&>();
      const std::string type = address.substr(5, address.find_first_of(";,") - 5);
      if (type != format) {
        issues_.add(Code::gltf_malformed, place + "/uri", fmt::format("\"{}\" is in truth {}", type, format));
      }
    }
    if (!declared.empty() && declared != format) {
      issues_.add(Code::gltf_malformed, place + "/mimeType",
                  fmt::format("\"{}\" is in truth {}", declared, format));
    }
    std::string fault;
    if (format == "image/png") fault = fault_of_png(bytes);
    if (format == "image/jpeg") fault = fault_of_jpeg(bytes);
    if (!fault.empty()) issues_.add(Code::image_unreadable, place, fmt::format("the {} {}", format, fault));
  }

  const GltfDocument& document_;
  IssueSink& issues_;
};

}  // namespace

void check_images(const GltfDocument& document, IssueSink& issues) {
  ImageCheck images(document, issues);
  for_each_object(document.json, "images", [&](const Json& image, int index) { images.check(image, index); });
}

}  // namespace selvedge
