#include "apps/selvedge/list_page.h"

#include <fmt/format.h>

#include <filesystem>

#include "apps/common/html.h"
#include "format/base/atomic_file.h"
#include "format/base/digest.h"
#include "format/fabric/file.h"
#include "format/picture/display.h"
#include "format/picture/image.h"
#include "format/picture/swatch_picture.h"

namespace selvedge {
namespace {

constexpr V2i picture_size(240, 160);

constexpr const char* head = R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>{0}</title>
<style>
body {{ font: 14px/1.45 "DejaVu Sans", Verdana, sans-serif; color: #1b1f24; margin: 24px; }}
main {{ display: grid; grid-template-columns: repeat(auto-fill, minmax(240px, 1fr)); gap: 20px; }}
img {{ width: 240px; height: 160px; background: #d0d5dc; }}
figure {{ margin: 0; }} figcaption, code {{ font-size: 12px; overflow-wrap: anywhere; }}
code {{ color: #626b76; }} .failed {{ color: #b3261e; }}
</style></head><body><h1>{0}</h1><p>{1}</p><main>
)";

/// Draws the fabric unless its picture is there; returns the picture's name, which is that of its contents.
Result<std::string> picture_of(const std::string& fabric_path, const std::string& folder) {
  auto reader = FabricReader::open(fabric_path);
  if (!reader) return tl::unexpected(reader.error());
  const std::string name = fmt::format("pictures/{}.png", digest_of(reader->digest()));
  std::error_code none;
  if (std::filesystem::exists(folder + "/" + name, none)) return name;
  const auto fabric = reader->read();
  if (!fabric) return tl::unexpected(fabric.error());
  const SwatchShot shot = swatch_shot(SwatchView::near, fabric->period_mm, picture_size.x, picture_size.y);
  const Image image = to_display_image(draw_swatch(*fabric, shot), default_display());
  if (auto written = write_png(folder + "/" + name, image); !written) return tl::unexpected(written.error());
  return name;
}

}  // namespace

Result<void> write_list_page(const std::string& folder, const std::string& list, const Json& rows) {
  const std::string file_name = std::filesystem::path(list).filename().string();
  std::string text =
      fmt::format(fmt::runtime(head), escaped(file_name), fmt::format("{} fabrics", rows.size()));
  for (const Json& row : rows) {
    const std::string output = row.at("output");
    const bool good = row.at("state") != "failed";
    const auto picture = good ? picture_of(output, folder) : fail(Code::file_missing, output, "", "");
    std::string caption = fmt::format("<b>{}</b><br>", escaped(output));
    if (row.contains("bytes")) caption += fmt::format("{} bytes", row["bytes"].get<std::uint64_t>());
    if (row.contains("psnr") && row["psnr"].is_number())
      caption += fmt::format(", {:.1f} dB", row["psnr"].get<double>());
    if (row.contains("error"))
      caption +=
          fmt::format("<br><span class=\"failed\">{}</span>", escaped(row["error"].value("message", "")));
    text += fmt::format(
        "<figure>{}<figcaption>{}<br><code>{}</code></figcaption></figure>\n",
        picture ? fmt::format("<img loading=\"lazy\" alt=\"{}\" src=\"{}\">", escaped(output), *picture)
                : "<img alt=\"no fabric\">",
        caption, escaped(row.at("command")));
  }
  return write_file(folder + "/index.html", text + "</main></body></html>\n");
}

}  // namespace selvedge
