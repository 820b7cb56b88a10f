#include "format/base/foreign.h"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "format/base/option_text.h"

namespace selvedge {

std::string_view foreign_file_message(std::string_view bytes) {
  using Kind = std::pair<std::string_view, std::string_view>;
  constexpr std::string_view unpack = "is a compressed archive: unpack it first";
  constexpr std::string_view fbx = "is FBX: import it in Blender, and export it as glTF";
  constexpr std::string_view usd = "is USD: import it in Blender, and export it as glTF";
  constexpr std::string_view object = "is a compiler's object file or a program, no mesh";
  constexpr std::string_view page = "is a web page: download the file that it shows";
  constexpr std::string_view base64 = "is base64 text: decode it first (base64 -d)";
  constexpr std::string_view utf_16 = "is text in UTF-16: save it as UTF-8";
  using namespace std::string_view_literals;  // for bytes of 0
  constexpr std::array kinds{
      Kind{"\x1f\x8b", "is compressed by gzip: unpack it first (gunzip)"},
      Kind{"PK\3\4", "is a ZIP archive: unpack it first (USDZ: import it in Blender, and export it as glTF)"},
      Kind{"Rar!", unpack},
      Kind{"7z\xbc\xaf", unpack},
      Kind{"BZh", unpack},
      Kind{"\xfd"
           "7zXZ",
           unpack},
      Kind{"\x28\xb5\x2f\xfd", unpack},
      Kind{"\xff\xfe", utf_16},
      Kind{"\xfe\xff", utf_16},
      Kind{"kaydara fbx", fbx},
      Kind{"; fbx", fbx},
      Kind{"pxr-usdc", usd},
      Kind{"#usda", usd},
      Kind{"blender", "is a file of Blender: export it as glTF"},
      Kind{"solid ", "is STL: import it in Blender, and export it as glTF"},
      Kind{"\x7f"
           "elf",
           object},
      Kind{"L\1"sv, object},
      Kind{"d\x86"sv, object},
      Kind{"d\xaa"sv, object},
      Kind{"\0\0\xff\xff"sv, object},
      Kind{"\xcf\xfa\xed\xfe", object},
      Kind{"version https://git-lfs", "is a pointer of Git LFS, not the file: \"git lfs pull\" fetches that"},
      Kind{"<!doctype html", page},
      Kind{"<html", page},
      Kind{"<?xml", "is XML (COLLADA, X3D): import it in Blender, and export it as glTF"},
      Kind{"data:", base64}};
  std::string_view text = bytes.substr(bytes.starts_with("\xef\xbb\xbf") ? 3 : 0);
  text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
  const std::string head = lower_case(std::string(text.substr(0, 32)));
  for (const auto& [start, kind] : kinds)
    if (bytes.starts_with(start) || head.starts_with(start)) return kind;
  constexpr std::size_t longest_word = 60;  // of text that is not encoded
  const std::size_t end =
      text.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/=");
  return std::min(end, text.size()) >= longest_word ? base64 : "";
}

std::string_view foreign_file_message(const InputFile& file) {
  std::array<std::uint8_t, 256> head{};
  const std::size_t size = std::min<std::size_t>(head.size(), file.size());
  if (!file.read(0, std::span(head).first(size))) return "";
  return foreign_file_message({reinterpret_cast<const char*>(head.data()), size});
}

}  // namespace selvedge
