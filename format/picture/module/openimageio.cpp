#include "format/picture/openimageio.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <OpenImageIO/strutil.h>
#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <exception>
#include <map>
#include <memory>
#include <span>
#include <string_view>
#include <tuple>
#include <vector>

#include "format/base/memory.h"
#include "format/picture/chromaticities.h"
#include "format/picture/module/stored_pixels.h"

namespace selvedge {
namespace {

/// Channels of a file for R, G, B, A; -1 without alpha.
using Channels = std::array<int, 4>;

Channels first_channels(const OIIO::ImageSpec& spec) {
  const bool colour = spec.nchannels >= 3;
  return {0, colour ? 1 : 0, colour ? 2 : 0, spec.alpha_channel};
}

/// A layer of an OpenEXR file that may be its picture.
struct Layer {
  int part = 0;
  Channels channels{};
  std::string name;
  /// The picture's layers have the least: whether it has a name that is not a picture's, whether it is grey,
  /// whether it is a right view, and the number of words in its name.
  std::tuple<bool, bool, bool, std::size_t> rank;
};

/// Adds the layers of a part with R, G and B, or Y; `prefix` is the part's name if there are several. Names
/// of a layer's channels differ after their last full stop.
void add_layers(const OIIO::ImageSpec& spec, int part, const std::string& prefix,
                std::vector<Layer>& layers) {
  std::map<std::string, int> channels;
  for (int i = 0; i < spec.nchannels; ++i) channels.emplace(OIIO::Strutil::lower(spec.channelnames[i]), i);
  for (const auto& [first, index] : channels) {
    const std::string layer = first.substr(0, first.rfind('.') + 1);
    const auto find = [&](char letter) {
      const auto found = channels.find(layer + letter);
      return found == channels.end() ? -1 : found->second;
    };
    const bool grey = first == layer + 'y' && find('x') < 0 && find('r') < 0;
    const Channels named{index, grey ? index : find('g'), grey ? index : find('b'), find('a')};
    if (spec.deep || (!grey && first != layer + 'r') || std::min(named[1], named[2]) < 0) continue;
    const std::string name = prefix + spec.channelnames[index].substr(0, layer.size());
    std::string letters = OIIO::Strutil::lower(name);
    for (char& c : letters) c = std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : ' ';
    const std::vector<std::string> words = OIIO::Strutil::splits(letters);
    const auto has = [&](std::initializer_list<std::string_view> some) {
      return std::ranges::find_first_of(words, some) != words.end();
    };
    layers.push_back({part,
                      named,
                      name.substr(0, name.find_last_not_of('.') + 1),
                      {!words.empty() && !has({"combined", "beauty", "rgba", "rgb", "image"}), grey,
                       has({"right"}), words.size()}});
  }
}

/// The layers of a file, the most likely picture first; of files of other kinds the whole file.
std::vector<Layer> layers_of(OIIO::ImageInput& input) {
  std::vector<Layer> layers;
  const bool is_exr = input.format_name() == std::string_view("openexr");
  const bool many = is_exr && input.seek_subimage(1, 0);
  for (int part = 0; is_exr && input.seek_subimage(part, 0); ++part) {
    const std::string prefix =
        many ? std::string(input.spec().get_string_attribute("oiio:subimagename")) + "." : "";
    add_layers(input.spec(), part, prefix, layers);
  }
  if (is_exr) input.seek_subimage(0, 0);
  std::ranges::stable_sort(layers, {}, &Layer::rank);
  if (layers.empty())
    layers.push_back({0, first_channels(input.spec()), input.spec().channelnames[0], {is_exr, {}, {}, {}}});
  return layers;
}

/// Some readers fail without a word, others with one for each channel.
std::string exception_message(const OIIO::ImageInput& input) {
  const std::string text = input.geterror();
  if (text.starts_with("Subsampled")) return "has channels of fewer pixels (RY, BY): save it with R, G and B";
  return text.empty() ? "cannot be decoded" : text.substr(0, text.find('\n'));
}

/// Reads strips of rows, and sums the pixels of each of the pictures that are returned.
Result<std::vector<Image>> read_pixels(OIIO::ImageInput& input, std::size_t file_bytes,
                                       const std::string& name, Transfer transfer, const ImageLimits& limits,
                                       std::span<const int> halvings, const Channels& order) {
  const OIIO::ImageSpec& spec = input.spec();
  if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1 || spec.depth > 1 || spec.deep)
    return fail(Code::image_unreadable, name, "", "not a flat two-dimensional picture");
  const std::int64_t pixels = std::int64_t{spec.width} * spec.height;
  const std::string size =
      fmt::format("{} x {} pixels of {} channels", spec.width, spec.height, spec.nchannels);
  if (spec.width > limits.side || spec.height > limits.side || pixels * spec.nchannels > limits.pixels * 4)
    return fail(Code::file_too_large, name, "", size);
  // Rows take memory as they come: a header may declare what the file does not have.
  std::vector<Image> images;
  std::uint64_t values = 0;
  for (const int times : halvings) {
    const Image& image =
        images.emplace_back(Image{level_size(spec.width, times), level_size(spec.height, times), 4, {}});
    values += std::uint64_t{4} * image.width * image.height;
  }
  // Tiles come in rows of their own height, and may be larger than the picture.
  constexpr int rows_at_once = 64;
  const int part = input.current_subimage();
  const bool tiled = spec.tile_width > 0;
  const int strip = tiled ? spec.height : std::min(spec.height, rows_at_once);
  const std::int64_t most =
      tiled ? std::max(pixels, std::int64_t{spec.tile_width} * spec.tile_height) : pixels;
  const std::uint64_t channels = spec.nchannels;
  // A reader may hold its file once more, and all pixels as they are stored: interlaced ones, progressive
  // ones, the pixels of one strip or tile.
  MemoryBudget budget(limits.memory);
  if (!budget.try_spend(file_bytes, 2) || !budget.try_spend(most, spec.pixel_bytes(true)) ||
      !budget.try_spend(tiled ? most : std::int64_t{strip} * spec.width, channels * sizeof(float)) ||
      !budget.try_spend(values, sizeof(float)))
    return tl::unexpected<Error>(memory_limit_error(name, "", size, limits.memory));
  for (Image& image : images) image.pixels.reserve(std::size_t{4} * image.width * image.height);
  const bool decode = transfer == Transfer::srgb && !spec.format.is_floating_point();
  // WebP's reader multiplies colours by alpha, whatever it is asked for.
  const bool multiplied = input.format_name() == std::string_view("webp");
  Decoder decoder(spec.format == OIIO::TypeDesc::UINT8 ? 8 : spec.format == OIIO::TypeDesc::UINT16 ? 16 : 32);
  const StoredSize whole{spec.width, spec.height};
  std::vector<float> stored(strip * spec.width * channels);
  std::vector<float> line(std::size_t{4} * spec.width);  // a row as it is in memory
  for (int first = 0; first < spec.height; first += strip) {
    const int end = std::min(first + strip, spec.height);
    const OIIO::TypeDesc floats = OIIO::TypeDesc::FLOAT;
    const bool read = tiled ? input.read_image(part, 0, 0, spec.nchannels, floats, stored.data())
                            : input.read_scanlines(part, 0, spec.y + first, spec.y + end, 0, 0,
                                                   spec.nchannels, floats, stored.data());
    if (!read) return fail(Code::image_unreadable, name, "", exception_message(input));
    for (std::int64_t y = first; y < end; ++y) {
      const float* from = &stored[(y - first) * spec.width * channels];
      for (std::int64_t x = 0; x < spec.width; ++x) {
        const float alpha = order[3] < 0 ? 1.0F : from[order[3]];
        for (int c = 0; c < 4; ++c) {
          float value = order[c] < 0 ? 1.0F : from[order[c]];
          if (multiplied && c < 3 && alpha > 0) value = std::min(value / alpha, 1.0F);
          line[4 * x + c] = decode && c < 3 ? decoder.linear(value) : value;
        }
        from += channels;
      }
      for (Image& image : images) add_row(line, y, whole, image);
    }
  }
  const auto* chromaticities =
      spec.find_attribute("chromaticities", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 8));
  const auto is_small = [&](int value) { return value >= -limits.side && value <= limits.side; };
  const bool has_display =
      input.format_name() == std::string_view("openexr") &&
      std::ranges::all_of(
          std::array{spec.x, spec.y, spec.full_x, spec.full_y, spec.full_width, spec.full_height}, is_small);
  for (Image& image : images) {
    if (image.width < spec.width || image.height < spec.height) divide_by_counts(image, whole);
    if (chromaticities != nullptr && order[0] != order[1]) {
      Chromaticities given;
      std::copy_n(static_cast<const float*>(chromaticities->data()), given.size(), given.begin());
      convert_to_rec709(given, image.pixels);
    }
    const V2i corner(spec.full_x - spec.x, spec.full_y - spec.y);
    if (has_display) image.display_window = {corner, corner + V2i(spec.full_width - 1, spec.full_height - 1)};
  }
  return images;
}

bool is_black(const Image& image) {
  for (std::size_t i = 0; i < image.pixels.size(); ++i)
    if (i % 4 < 3 && image.pixels[i] != 0) return false;
  return true;
}

/// Whether much more than the pixels is packed in a PNG: libpng unpacks all of it, a thousand times its
/// bytes. Precondition: without_texts() made it.
bool holds_more_than_pixels(std::span<const std::uint8_t> png) {
  constexpr std::size_t header = 33;  // signature and IHDR
  constexpr std::size_t tolerated = std::size_t{1} << 22;
  constexpr std::size_t quickly_unpacked = 100000;
  if (png.size() < std::max(header, quickly_unpacked)) return false;
  const auto word = [&](std::size_t at) {
    return std::size_t{png[at]} << 24U | png[at + 1] << 16U | png[at + 2] << 8U | png[at + 3];
  };
  constexpr std::array<std::size_t, 7> samples{1, 0, 3, 1, 2, 0, 4};
  const std::size_t bits = png[24] * samples[std::min<std::size_t>(png[25], 6)];
  std::size_t left = word(20) * (word(16) * bits / 8 + 2) + tolerated;
  z_stream stream{};
  if (inflateInit(&stream) != Z_OK) return false;
  const std::unique_ptr<z_stream, decltype(&inflateEnd)> ended(&stream, &inflateEnd);
  std::vector<std::uint8_t> unpacked(std::size_t{1} << 16);
  for (std::size_t at = header; at + 12 <= png.size(); at += word(at) + 12) {
    if (png[at + 4] != 'I' || png[at + 5] != 'D') continue;
    stream.next_in = const_cast<std::uint8_t*>(&png[at + 8]);
    stream.avail_in = static_cast<unsigned>(std::min(word(at), png.size() - at - 8));
    while (stream.avail_in > 0) {
      stream.next_out = unpacked.data();
      stream.avail_out = static_cast<unsigned>(unpacked.size());
      if (inflate(&stream, Z_NO_FLUSH) != Z_OK) return false;
      const std::size_t made = unpacked.size() - stream.avail_out;
      if (made > left) return true;
      left -= made;
    }
  }
  return false;
}

Result<std::vector<Image>> read(const char* format, std::span<const std::uint8_t> bytes,
                                const std::string& name, Transfer transfer, const ImageLimits& limits,
                                std::span<const int> halvings) {
  const auto refuse = [&](std::string why) { return fail(Code::image_unreadable, name, "", std::move(why)); };
  try {
    OIIO::ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1);  // else PNG's alpha would be multiplied into the colours
    std::vector<std::uint8_t> kept;
    if (format == std::string_view("png")) {
      bytes = kept = without_texts(bytes);
      if (holds_more_than_pixels(bytes)) return refuse("holds more than its pixels");
    }
    OIIO::Filesystem::IOMemReader source(bytes.data(), bytes.size());
    const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::create(format);
    if (!input) return refuse(OIIO::geterror());
    // In the configuration instead of set_ioproxy(), which readers forget when they reopen the file.
    OIIO::Filesystem::IOProxy* proxy = &source;
    config.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
    OIIO::ImageSpec spec;
    if (!input->open(name, spec, config)) return refuse(exception_message(*input));
    constexpr std::size_t max_tried = 4;
    Result<std::vector<Image>> images;
    const std::vector<Layer> layers = layers_of(*input);
    for (const Layer& layer : std::span(layers).first(std::min(max_tried, layers.size()))) {
      if (layer.part != input->current_subimage()) input->seek_subimage(layer.part, 0);
      images = read_pixels(*input, bytes.size(), name, transfer, limits, halvings, layer.channels);
      const bool is_guessed = std::get<0>(layer.rank);
      if (images && is_guessed)
        images->front().remarks = {fmt::format("its layer \"{}\" is read", layer.name)};
      if (!images || !is_guessed || !is_black(images->front())) break;
    }
    return images;
  } catch (const std::exception& error) {
    return refuse(error.what());
  }
}

}  // namespace

extern "C" __attribute__((visibility("default"))) const OpenImageIo selvedge_openimageio;
const OpenImageIo selvedge_openimageio{read};

}  // namespace selvedge
