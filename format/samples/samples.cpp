#include "format/samples/samples.h"

#include <Imath/half.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "format/fabric/fabric.h"
#include "format/fabric/names.h"

namespace selvedge {
namespace {

ExrPart scanline_part(const char* name, int width, int height, std::vector<ExrChannel> channels) {
  ExrPart part;
  part.name = name;
  part.width = width;
  part.height = height;
  part.compression = "zips";  // no more rows are decoded than asked for
  part.channels = std::move(channels);
  return part;
}

std::vector<ExrChannel> surface_channels() {
  return {{"surface.opacity"}, {"surface.nx"}, {"surface.ny"}, {"surface.nz"}};
}

std::vector<ExrChannel> pair_channels(const std::string& part) {
  std::vector<ExrChannel> channels;
  for (const char* name :
       {"red", "green", "blue", "opacity", "noise.red", "noise.green", "noise.blue", "noise.opacity"}) {
    channels.push_back({part + "." + name});
  }
  return channels;
}

/// A slab's picture has a pixel per cell.
std::vector<ExrChannel> slab_channels(const SlabShape& shape) {
  std::vector<ExrChannel> channels;
  for (int slab = 0; slab < shape.slabs; ++slab) {
    for (const char* end : names::height_ends) {
      channels.push_back({fmt::format("{}.{}.{}", names::part_slabs, slab, end)});
    }
  }
  return channels;
}

/// Index of an entry of a texel, by the pixel of the slabs' pictures.
std::size_t height_index(const SlabShape& shape, int width, int slab, int x, int y) {
  const int texel = y / shape.rows * width + x / shape.columns;
  const int entry = (slab * shape.rows + y % shape.rows) * shape.columns + x % shape.columns;
  return static_cast<std::size_t>(texel) * static_cast<std::size_t>(shape.entries()) +
         static_cast<std::size_t>(entry);
}

ExrPixels blank(int width, int height, std::size_t channels) {
  const std::size_t count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  return {width, height, std::vector<std::vector<float>>(channels, std::vector<float>(count))};
}

tl::unexpected<Error> malformed(const std::string& file, std::string place, std::string message) {
  return fail(Code::samples_malformed, file, std::move(place), std::move(message));
}

}  // namespace

SamplesWriter::SamplesWriter(ExrWriter writer, SamplesHeader header)
    : writer_(std::move(writer)), header_(std::move(header)) {}

Result<SamplesWriter> SamplesWriter::create(const std::string& path, const SamplesHeader& header) {
  std::vector<ExrPart> parts;
  // One picture of the cell per view (downwards) and light (to the right): any image viewer shows it.
  parts.push_back(scanline_part(names::part_radiance, header.width * header.lights.count(),
                                header.height * header.views.count(), {{"R"}, {"G"}, {"B"}}));
  parts.push_back(scanline_part(names::part_surface, header.width, header.height * header.views.count(),
                                surface_channels()));
  for (const PairKind kind : all_pair_kinds) {
    const auto count = static_cast<int>(header.pairs[index_of(kind)].size());
    if (count == 0) continue;
    const char* name = name_of(kind);
    parts.push_back(scanline_part(name, header.width, header.height * count, pair_channels(name)));
  }
  if (header.slabs) {
    parts.push_back(scanline_part(names::part_slabs, header.width * header.slabs->columns,
                                  header.height * header.slabs->rows, slab_channels(*header.slabs)));
  }
  parts.front().attributes[names::attribute_samples] = text_of(header);
  auto writer = ExrWriter::create(path, parts);
  if (!writer) return tl::unexpected(writer.error());
  return SamplesWriter(std::move(*writer), header);
}

void SamplesWriter::take_note(std::span<const V3f> radiance) {
  for (const V3f& r : radiance) {
    for (int c = 0; c < 3; ++c) {
      largest_ = std::max(largest_, r[c]);
      change_ = std::max(change_, std::abs(r[c] - static_cast<float>(Imath::half(r[c]))));
    }
  }
}

Issues SamplesWriter::warnings() const {
  constexpr float most = 0.05F;
  if (!(change_ > most * largest_)) return {};
  return {{Code::fabric_precision,
           {},
           "radiance",
           fmt::format("half precision changes radiance by up to {:.3g} % of the largest sample, {:.3g} 1/sr",
                       100 * change_ / largest_, largest_)}};
}

Result<void> SamplesWriter::write_view(const ViewSamples& samples) {
  take_note(samples.radiance);
  const int lights = header_.lights.count();
  const auto texels = static_cast<std::size_t>(header_.texels());
  const auto width = static_cast<std::size_t>(header_.width);
  ExrPixels radiance = blank(header_.width * lights, header_.height, 3);
  for (std::size_t light = 0; light < static_cast<std::size_t>(lights); ++light) {
    for (std::size_t texel = 0; texel < texels; ++texel) {
      const std::size_t x = light * width + texel % width;
      const std::size_t pixel = (texel / width) * static_cast<std::size_t>(radiance.width) + x;
      const V3f& value = samples.radiance[light * texels + texel];
      radiance.planes[0][pixel] = value.x;
      radiance.planes[1][pixel] = value.y;
      radiance.planes[2][pixel] = value.z;
    }
  }
  if (auto ok = writer_.write_rows(0, radiance); !ok) return ok;
  ExrPixels surface = blank(header_.width, header_.height, 4);
  surface.planes[0] = samples.alpha;
  for (std::size_t texel = 0; texel < texels; ++texel) {
    surface.planes[1][texel] = samples.normal[texel].x;
    surface.planes[2][texel] = samples.normal[texel].y;
    surface.planes[3][texel] = samples.normal[texel].z;
  }
  return writer_.write_rows(1, surface);
}

Result<void> SamplesWriter::write_pairs(PairKind kind, const PairSamples& samples) {
  int part = 2;
  for (std::size_t k = 0; k < index_of(kind); ++k) part += header_.pairs[k].empty() ? 0 : 1;
  const auto count = static_cast<int>(samples.pairs.size());
  if (count == 0) return {};
  take_note(samples.radiance);
  ExrPixels pixels = blank(header_.width, header_.height * count, 8);
  for (std::size_t i = 0; i < samples.alpha.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      pixels.planes[c][i] = samples.radiance[i][c];
      pixels.planes[static_cast<std::size_t>(c) + 4][i] = samples.noise[i][c];
    }
    pixels.planes[3][i] = samples.alpha[i];
    pixels.planes[7][i] = samples.alpha_noise[i];
  }
  return writer_.write_rows(part, pixels);
}

Result<void> SamplesWriter::write_heights(const HeightLayer& heights) {
  const SlabShape& shape = *header_.slabs;
  int part = 2;
  for (const auto& pairs : header_.pairs) part += pairs.empty() ? 0 : 1;
  ExrPixels pixels = blank(header_.width * shape.columns, header_.height * shape.rows,
                           2 * static_cast<std::size_t>(shape.slabs));
  std::size_t pixel = 0;
  for (int y = 0; y < pixels.height; ++y) {
    for (int x = 0; x < pixels.width; ++x, ++pixel) {
      for (int slab = 0; slab < shape.slabs; ++slab) {
        const std::size_t index = height_index(shape, header_.width, slab, x, y);
        pixels.planes[2 * static_cast<std::size_t>(slab)][pixel] = heights.top()[index];
        pixels.planes[2 * static_cast<std::size_t>(slab) + 1][pixel] = heights.bottom()[index];
      }
    }
  }
  return writer_.write_rows(part, pixels);
}

SamplesReader::SamplesReader(ExrReader reader, SamplesHeader header)
    : reader_(std::move(reader)), header_(std::move(header)) {}

namespace {

Result<int> part_index(const ExrReader& reader, const char* name, int width, int height,
                       const std::vector<ExrChannel>& channels) {
  const int index = reader.find_part(name);
  if (index < 0) return malformed(reader.name(), name, "the part is missing");
  const ExrPart& part = reader.parts()[index];
  if (part.tiled || part.width != width || part.height != height) {
    return malformed(reader.name(), name,
                     fmt::format("is not a scanline part of {}x{} pixels", width, height));
  }
  if (part.channels.size() != channels.size()) return malformed(reader.name(), name, "has other channels");
  return index;
}

/// Planes by the wanted channel order instead of the file's alphabetical one.
Result<std::vector<std::vector<float>>> ordered(const ExrPart& part, ExrPixels pixels,
                                                const std::vector<ExrChannel>& wanted,
                                                const std::string& file) {
  std::vector<std::vector<float>> planes;
  for (const ExrChannel& channel : wanted) {
    std::size_t found = 0;
    while (found < part.channels.size() && part.channels[found].name != channel.name) ++found;
    if (found == part.channels.size()) return malformed(file, part.name + "/" + channel.name, "is missing");
    planes.push_back(std::move(pixels.planes[found]));
  }
  return planes;
}

tl::unexpected<Error> bad_sample(const std::string& file, const char* part, std::size_t x, std::size_t y,
                                 float value) {
  return fail(Code::samples_not_finite, file, fmt::format("{}/pixel {},{}", part, x, y),
              fmt::format("sample is {}", value));
}

bool is_sample(float value) { return std::isfinite(value) && value >= 0; }

}  // namespace

int rows_within(const SamplesHeader& header, std::size_t bytes) {
  const std::size_t row = static_cast<std::size_t>(header.width) *
                          static_cast<std::size_t>(header.views.count()) *
                          static_cast<std::size_t>(header.lights.count()) * sizeof(V3f);
  return static_cast<int>(std::clamp<std::size_t>(bytes / row, 1, static_cast<std::size_t>(header.height)));
}

Result<SamplesReader> SamplesReader::open(const std::string& path) { return open(ExrReader::open(path)); }

Result<SamplesReader> SamplesReader::open(std::span<const std::uint8_t> bytes, const std::string& name,
                                          const ExrLimits& limits) {
  return open(ExrReader::open(bytes, name, limits));
}

Result<SamplesReader> SamplesReader::open(Result<ExrReader> reader) {
  if (!reader) return tl::unexpected(reader.error());
  const std::string path = reader->name();
  const auto& attributes = reader->parts().front().attributes;
  const auto found = attributes.find(names::attribute_samples);
  const auto* text = found == attributes.end() ? nullptr : std::get_if<std::string>(&found->second);
  if (text == nullptr) {
    return malformed(path, names::attribute_samples, "attribute is missing: not a samples file");
  }
  auto header = samples_header_of(*text, path);
  if (!header) return tl::unexpected(header.error());
  return SamplesReader(std::move(*reader), std::move(*header));
}

Result<SampleLevel> SamplesReader::read_rows(int first_row, int count) {
  const SamplesHeader& h = header_;
  const std::string& file = reader_.name();
  SampleLevel level;
  level.width = h.width;
  level.height = count;
  level.views = h.views.count();
  level.lights = h.lights.count();
  const std::vector<ExrChannel> colours{{"R"}, {"G"}, {"B"}};
  const auto radiance =
      part_index(reader_, names::part_radiance, h.width * level.lights, h.height * level.views, colours);
  if (!radiance) return tl::unexpected(radiance.error());
  const auto surface =
      part_index(reader_, names::part_surface, h.width, h.height * level.views, surface_channels());
  if (!surface) return tl::unexpected(surface.error());

  const auto texels = static_cast<std::size_t>(level.texels());
  const auto width = static_cast<std::size_t>(h.width);
  const auto views = static_cast<std::size_t>(level.views);
  const auto lights = static_cast<std::size_t>(level.lights);
  level.alpha.resize(texels * views);
  level.normal.assign(texels, V3f(0, 0, 0));
  level.radiance.resize(texels * views * lights);
  const auto part_at = [&](int i) -> const ExrPart& { return reader_.parts()[i]; };
  for (std::size_t view = 0; view < views; ++view) {
    const int first = static_cast<int>(view) * h.height + first_row;
    auto rows = reader_.read_rows(*radiance, first, count);
    if (!rows) return tl::unexpected(rows.error());
    auto colour = ordered(part_at(*radiance), std::move(*rows), colours, file);
    if (!colour) return tl::unexpected(colour.error());
    auto seen = reader_.read_rows(*surface, first, count);
    if (!seen) return tl::unexpected(seen.error());
    const auto planes = ordered(part_at(*surface), std::move(*seen), surface_channels(), file);
    if (!planes) return tl::unexpected(planes.error());
    for (std::size_t texel = 0; texel < texels; ++texel) {
      const std::size_t y = static_cast<std::size_t>(first) + texel / width;
      const float alpha = (*planes)[0][texel];
      const V3f normal((*planes)[1][texel], (*planes)[2][texel], (*planes)[3][texel]);
      if (!(alpha >= 0 && alpha <= 1)) return bad_sample(file, names::part_surface, texel % width, y, alpha);
      if (!std::isfinite(normal.length2())) {
        return bad_sample(file, names::part_surface, texel % width, y, normal.length2());
      }
      level.alpha[texel * views + view] = alpha;
      level.normal[texel] += normal;
      V3f* out = &level.radiance[(texel * views + view) * lights];
      for (std::size_t light = 0; light < lights; ++light) {
        const std::size_t x = light * width + texel % width;
        const std::size_t pixel = (texel / width) * width * lights + x;
        for (std::size_t c = 0; c < 3; ++c) {
          const float value = (*colour)[c][pixel];
          if (!is_sample(value)) return bad_sample(file, names::part_radiance, x, y, value);
          out[light][static_cast<int>(c)] = value;
        }
      }
    }
  }
  return level;
}

Result<PairSamples> SamplesReader::read_pairs(PairKind kind) {
  PairSamples samples;
  samples.width = header_.width;
  samples.height = header_.height;
  samples.pairs = header_.pairs[index_of(kind)];
  if (samples.pairs.empty()) return samples;
  const char* name = name_of(kind);
  const std::vector<ExrChannel> channels = pair_channels(name);
  const auto index = part_index(reader_, name, header_.width,
                                header_.height * static_cast<int>(samples.pairs.size()), channels);
  if (!index) return tl::unexpected(index.error());
  auto pixels = reader_.read_level(*index);
  if (!pixels) return tl::unexpected(pixels.error());
  auto planes = ordered(reader_.parts()[*index], std::move(*pixels), channels, reader_.name());
  if (!planes) return tl::unexpected(planes.error());
  const auto& p = *planes;
  const auto width = static_cast<std::size_t>(header_.width);
  for (std::size_t i = 0; i < p[0].size(); ++i) {
    for (std::size_t c = 0; c < 4; ++c) {
      if (!is_sample(p[c][i]) || (c == 3 && p[c][i] > 1))
        return bad_sample(reader_.name(), name, i % width, i / width, p[c][i]);
      if (!std::isfinite(p[c + 4][i]))
        return bad_sample(reader_.name(), name, i % width, i / width, p[c + 4][i]);
    }
    samples.radiance.emplace_back(p[0][i], p[1][i], p[2][i]);
    samples.noise.emplace_back(p[4][i], p[5][i], p[6][i]);
  }
  samples.alpha = std::move((*planes)[3]);
  samples.alpha_noise = std::move((*planes)[7]);
  return samples;
}

Result<HeightLayer> SamplesReader::read_heights() {
  const SlabShape& shape = *header_.slabs;
  const std::vector<ExrChannel> channels = slab_channels(shape);
  const int width = header_.width * shape.columns;
  const int height = header_.height * shape.rows;
  const auto index = part_index(reader_, names::part_slabs, width, height, channels);
  if (!index) return tl::unexpected(index.error());
  auto pixels = reader_.read_level(*index);
  if (!pixels) return tl::unexpected(pixels.error());
  const auto planes = ordered(reader_.parts()[*index], std::move(*pixels), channels, reader_.name());
  if (!planes) return tl::unexpected(planes.error());
  const std::size_t values = planes->front().size() * static_cast<std::size_t>(shape.slabs);
  std::array<std::vector<float>, 2> ends{std::vector<float>(values), std::vector<float>(values)};
  std::size_t pixel = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x, ++pixel) {
      for (std::size_t plane = 0; plane < planes->size(); ++plane) {
        const float value = (*planes)[plane][pixel];
        if (!std::isfinite(value)) {
          return bad_sample(reader_.name(), names::part_slabs, static_cast<std::size_t>(x),
                            static_cast<std::size_t>(y), value);
        }
        ends[plane % 2][height_index(shape, header_.width, static_cast<int>(plane / 2), x, y)] = value;
      }
    }
  }
  return HeightLayer(shape, std::move(ends[0]), std::move(ends[1]));
}

}  // namespace selvedge
