// PNG and JPEG by stb_image, in place of the module with OpenImageIO. Colours of JPEG may differ by a step or
// two.
#include <dlfcn.h>
#include <fmt/format.h>

#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_NO_STDIO
#define STBI_ONLY_PNG
#define STBI_ONLY_JPEG
#include <stb/stb_image.h>

#include <memory>

#include "format/picture/module/stored_pixels.h"
#include "format/picture/openimageio.h"

namespace selvedge {
namespace {

Result<std::vector<Image>> read(const char* format, std::span<const std::uint8_t> bytes,
                                const std::string& name, Transfer transfer, const ImageLimits& limits,
                                std::span<const int> halvings) {
  const auto refuse = [&](std::string why) { return fail(Code::image_unreadable, name, "", std::move(why)); };
  const bool is_png = format == std::string_view("png");
  if (!is_png && format != std::string_view("jpeg"))
    return refuse("the native program alone reads such pictures");
  std::vector<std::uint8_t> kept;
  if (is_png) bytes = kept = without_texts(bytes);
  const int count = static_cast<int>(bytes.size());
  StoredSize size{};
  int channels = 0;
  // As libpng says it, and the module.
  const auto refuse_damage = [&] {
    const bool ends =
        std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()).find("IEND") !=
        std::string_view::npos;
    const bool fills_memory = stbi_failure_reason() == std::string_view("outofmem");
    return refuse(is_png && !ends          ? "Read error: hit end of file"
                  : is_png && fills_memory ? "holds more than its pixels"
                                           : "cannot be decoded");
  };
  if (stbi_info_from_memory(bytes.data(), count, &size.width, &size.height, &channels) == 0)
    return refuse_damage();
  const std::string text = fmt::format("{} x {} pixels of {} channels", size.width, size.height, channels);
  const std::int64_t pixels = std::int64_t{size.width} * size.height;
  if (size.width > limits.side || size.height > limits.side || pixels * channels > limits.pixels * 4)
    return fail(Code::file_too_large, name, "", text);
  const bool is_wide = stbi_is_16_bit_from_memory(bytes.data(), count) != 0;
  std::vector<Image> images;
  std::uint64_t values = 0;
  for (const int times : halvings) {
    const Image& image =
        images.emplace_back(Image{level_size(size.width, times), level_size(size.height, times), 4, {}});
    values += std::uint64_t{4} * image.width * image.height;
  }
  MemoryBudget budget(limits.memory);
  if (!budget.try_spend(bytes.size(), 2) || !budget.try_spend(pixels, channels * (is_wide ? 2 : 1)) ||
      !budget.try_spend(values, sizeof(float)))
    return tl::unexpected<Error>(memory_limit_error(name, "", text, limits.memory));
  const auto load = [&](auto* decode) {
    return std::unique_ptr<void, void (*)(void*)>(
        decode(bytes.data(), count, &size.width, &size.height, &channels, 0), stbi_image_free);
  };
  const auto stored = is_wide ? load(stbi_load_16_from_memory) : load(stbi_load_from_memory);
  if (!stored) return refuse_damage();
  const float step = 1.0F / (is_wide ? 65535.0F : 255.0F);
  Decoder decoder(is_wide ? 16 : 8);
  std::vector<float> line(std::size_t{4} * size.width);
  for (std::int64_t y = 0; y < size.height; ++y) {
    for (std::int64_t x = 0; x < size.width; ++x) {
      const std::int64_t first = (y * size.width + x) * channels;
      for (int c = 0; c < 4; ++c) {
        const int from = c == 3 ? channels - 1 : channels < 3 ? 0 : c;
        const bool is_given = c < 3 || channels % 2 == 0;
        float value = 1;
        if (is_given)
          value = step * (is_wide ? static_cast<const std::uint16_t*>(stored.get())[first + from]
                                  : static_cast<const std::uint8_t*>(stored.get())[first + from]);
        line[4 * x + c] = transfer == Transfer::srgb && c < 3 ? decoder.linear(value) : value;
      }
    }
    for (Image& image : images) add_row(line, y, size, image);
  }
  for (Image& image : images)
    if (image.width < size.width || image.height < size.height) divide_by_counts(image, size);
  return images;
}

OpenImageIo table{read};

}  // namespace
}  // namespace selvedge

void* dlopen(const char*, int) { return &selvedge::table; }
void* dlsym(void* module, const char*) { return module; }
const char* dlerror() { return ""; }
