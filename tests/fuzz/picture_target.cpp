// Bytes -> what kind of picture they are, and decode_image. Only bytes of a known kind are decoded.
#include "format/picture/image.h"
#include "format/picture/picture_type.h"
#include "tests/fuzz/target.h"

using namespace selvedge;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::uint8_t> bytes(data, size);
  const bool known = !picture_type(bytes).empty();
  const ImageLimits limits{.side = 256, .pixels = 1 << 14};
  const Result<Image> image = decode_image(bytes, "input", Transfer::srgb, limits);
  if (!image) return 0;
  fuzz::require(known, "what is decoded is a picture");
  const std::size_t pixels = static_cast<std::size_t>(image->width) * static_cast<std::size_t>(image->height);
  fuzz::require(image->width <= limits.side && image->height <= limits.side, "a side is within its limit");
  fuzz::require(image->pixels.size() == 4 * pixels, "four values for every pixel");
  return 0;
}
