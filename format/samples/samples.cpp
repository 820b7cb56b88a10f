#include "format/samples/samples.h"

#include <Imath/half.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "format/fabric/names.h"

namespace selvedge {
namespace {

ExrPart scanline_part(const char* name, int width, int height, std::vector<ExrChannel> channels) {
  ExrPart part;
  part.name = name;
  part.width = width;
  part.height = height;
  part.compression = "zips";  // chunks of one row: a reader decodes only the rows that it needs
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

/// Index of the part that follows those of the first `kinds` sets of pairs.
int part_after(const SamplesHeader& header, std::size_t kinds) {
  int part = 2;
  for (std::size_t k = 0; k < kinds; ++k) part += header.pairs[k].empty() ? 0 : 1;
  return part;
}

ExrPixels blank(int width, int height, int channels) {
  const std::size_t count = std::size_t{1} * width * height;
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
  // One picture of the cell per view (downwards) and light (to the right), for image viewers.
  parts.push_back(scanline_part(names::part_radiance, header.width * header.light_count(),
                                header.height * header.view_count(), {{"R"}, {"G"}, {"B"}}));
  parts.push_back(scanline_part(names::part_surface, header.width, header.height * header.view_count(),
                                surface_channels()));
  for (const PairKind kind : all_pair_kinds) {
    const auto count = static_cast<int>(header.pairs[index_of(kind)].size());
    if (count == 0) continue;
    const char* name = name_of(kind);
    parts.push_back(scanline_part(name, header.width, header.height * count, pair_channels(name)));
  }
  if (header.yarns.curves > 0) {
    parts.push_back(
        scanline_part(names::part_yarns, curve_value_count(header.yarns), 1, {{names::part_yarns, false}}));
    for (const char* part : {names::part_indirect, names::part_light_through}) {
      if (part == names::part_light_through && !header.both_sides) continue;
      parts.push_back(scanline_part(part, header.yarns.stations, light_values_per_station, {{part, false}}));
    }
  }
  parts.front().attributes[names::attribute_samples] = samples_header_to_json(header);
  auto writer = ExrWriter::create(path, parts);
  if (!writer) return tl::unexpected(writer.error());
  return SamplesWriter(std::move(*writer), header);
}

void SamplesWriter::update_precision(std::span<const V3f> radiance) {
  for (const V3f& r : radiance) {
    for (int c = 0; c < 3; ++c) {
      max_radiance_ = std::max(max_radiance_, r[c]);
      max_rounding_ = std::max(max_rounding_, std::abs(r[c] - static_cast<float>(Imath::half(r[c]))));
    }
  }
}

Issues SamplesWriter::warnings() const {
  constexpr float max_share = 0.05F;
  if (!(max_rounding_ > max_share * max_radiance_)) return {};
  return {{Code::fabric_precision,
           {},
           "radiance",
           fmt::format("half precision changes radiance by up to {:.3g} % of the largest sample, {:.3g} 1/sr",
                       100 * max_rounding_ / max_radiance_, max_radiance_)}};
}

Result<void> SamplesWriter::write_view(const ViewSamples& samples) {
  update_precision(samples.radiance);
  const int width = header_.width;
  const int texels = header_.texels();
  ExrPixels radiance = blank(width * header_.light_count(), header_.height, 3);
  for (std::size_t i = 0; i < samples.radiance.size(); ++i) {
    const auto texel = static_cast<int>(i % texels);
    const std::size_t light = i / texels;
    const std::size_t pixel =
        std::size_t{1} * (texel / width) * radiance.width + light * width + texel % width;
    for (int c = 0; c < 3; ++c) radiance.planes[c][pixel] = samples.radiance[i][c];
  }
  if (auto ok = writer_.write_rows(0, radiance); !ok) return ok;
  ExrPixels surface = blank(width, header_.height, 4);
  surface.planes[0] = samples.alpha;
  for (int texel = 0; texel < texels; ++texel) {
    for (int c = 0; c < 3; ++c) surface.planes[1 + c][texel] = samples.normal[texel][c];
  }
  return writer_.write_rows(1, surface);
}

Result<void> SamplesWriter::write_pairs(PairKind kind, const PairSamples& samples) {
  const auto count = static_cast<int>(samples.pairs.size());
  if (count == 0) return {};
  update_precision(samples.radiance);
  ExrPixels pixels = blank(header_.width, header_.height * count, 8);
  for (std::size_t i = 0; i < samples.alpha.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      pixels.planes[c][i] = samples.radiance[i][c];
      pixels.planes[4 + c][i] = samples.noise[i][c];
    }
  }
  pixels.planes[3] = samples.alpha;
  pixels.planes[7] = samples.alpha_noise;
  return writer_.write_rows(part_after(header_, index_of(kind)), pixels);
}

Result<void> SamplesWriter::write_yarns(const YarnData& yarns) {
  const int part = part_after(header_, all_pair_kinds.size());
  std::vector<float> curves = curve_values(yarns);
  const ExrPixels pixels{static_cast<int>(curves.size()), 1, {std::move(curves)}};
  if (auto ok = writer_.write_rows(part, pixels); !ok) return ok;
  for (int through = 0; through < header_.sides(); ++through) {
    const ExrPixels light{
        header_.yarns.stations, light_values_per_station, {indirect_values(yarns, through == 1)}};
    if (auto ok = writer_.write_rows(part + 1 + through, light); !ok) return ok;
  }
  return {};
}

SamplesReader::SamplesReader(ExrReader reader, SamplesHeader header)
    : reader_(std::move(reader)), file_header_(std::move(header)), header_(file_header_) {
  select(Side::front);
}

void SamplesReader::select(Side side) {
  header_.side = side;
  for (const PairKind kind : all_pair_kinds) {
    auto& pairs = header_.pairs[index_of(kind)];
    pairs.clear();
    for (DirectionPair pair : file_header_.pairs[index_of(kind)]) {
      if (side_of(pair) != side) continue;
      if (pair.view.z < 0) pair.view = mirrored(pair.view);
      if (pair.light.z < 0) pair.light = mirrored(pair.light);
      pairs.push_back(pair);
    }
  }
}

namespace {

/// The index of a scanline part of `width` x `height` pixels.
Result<int> part_of(const ExrReader& reader, const char* name, int width, int height) {
  const int index = reader.find_part(name);
  if (index < 0) return malformed(reader.name(), name, "the part is missing");
  const ExrPart& part = reader.parts()[index];
  if (part.tiled || part.width != width || part.height != height) {
    return malformed(reader.name(), name,
                     fmt::format("is not a scanline part of {}x{} pixels", width, height));
  }
  return index;
}

/// Reads rows [first, first + count) of a scanline part of `width` x `height` pixels; planes are in the order
/// of the wanted channels, not in the file's alphabetical one.
Result<std::vector<std::vector<float>>> read_planes(ExrReader& reader, const char* name, int width,
                                                    int height, const std::vector<ExrChannel>& wanted,
                                                    int first, int count) {
  const Result<int> index = part_of(reader, name, width, height);
  if (!index) return tl::unexpected(index.error());
  const ExrPart& part = reader.parts()[*index];
  if (part.channels.size() != wanted.size()) return malformed(reader.name(), name, "has other channels");
  auto pixels = reader.read_rows(*index, first, count);
  if (!pixels) return tl::unexpected(pixels.error());
  std::vector<std::vector<float>> planes;
  for (const ExrChannel& channel : wanted) {
    std::size_t found = 0;
    while (found < part.channels.size() && part.channels[found].name != channel.name) ++found;
    if (found == part.channels.size()) {
      return malformed(reader.name(), part.name + "/" + channel.name, "is missing");
    }
    planes.push_back(std::move(pixels->planes[found]));
  }
  return planes;
}

tl::unexpected<Error> bad_sample(const std::string& file, const char* part, std::size_t x, std::size_t y,
                                 float value) {
  return fail(Code::samples_not_finite, file, fmt::format("{}/pixel {},{}", part, x, y),
              fmt::format("sample is {}", value));
}

}  // namespace

int max_rows(const SamplesHeader& header, std::size_t bytes) {
  // Rows of the file hold the lights of both sides.
  const std::size_t row = sizeof(V3f) * header.width * header.views.count() * header.light_count();
  return static_cast<int>(std::clamp<std::size_t>(bytes / row, 1, header.height));
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
  auto header = samples_header_from_json(*text, path);
  if (!header) return tl::unexpected(header.error());
  // Now, as all that is read gets its room by the header.
  const int rows = header->height * header->view_count();
  for (const auto& [name, width] : {std::pair(names::part_radiance, header->width * header->light_count()),
                                    std::pair(names::part_surface, header->width)}) {
    if (const auto part = part_of(*reader, name, width, rows); !part) return tl::unexpected(part.error());
  }
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
  const std::size_t texels = level.texels();
  const std::size_t width = h.width;
  const std::size_t views = level.views;
  const std::size_t lights = level.lights;
  level.alpha.resize(texels * views);
  level.normal.assign(texels, V3f(0, 0, 0));
  level.radiance.resize(texels * views * lights);
  const bool behind = view_behind(h.side);
  const std::size_t all_lights = h.light_count();
  // Lights on the side of the view come first for views in front, and last for those behind.
  const std::size_t first_light = behind != lets_through(h.side) ? lights : 0;
  for (std::size_t view = 0; view < views; ++view) {
    const int first = (static_cast<int>(view) + (behind ? level.views : 0)) * h.height + first_row;
    const int height = h.height * h.view_count();
    const auto colour = read_planes(reader_, names::part_radiance, h.width * h.light_count(), height,
                                    {{"R"}, {"G"}, {"B"}}, first, count);
    if (!colour) return tl::unexpected(colour.error());
    const auto surface =
        read_planes(reader_, names::part_surface, h.width, height, surface_channels(), first, count);
    if (!surface) return tl::unexpected(surface.error());
    const auto& seen = *surface;
    for (std::size_t texel = 0; texel < texels; ++texel) {
      const std::size_t y = first + texel / width;
      const float alpha = seen[0][texel];
      const V3f normal(seen[1][texel], seen[2][texel], seen[3][texel]);
      if (!is_opacity(alpha)) return bad_sample(file, names::part_surface, texel % width, y, alpha);
      if (!std::isfinite(normal.length2())) {
        return bad_sample(file, names::part_surface, texel % width, y, normal.length2());
      }
      level.alpha[texel * views + view] = alpha;
      level.normal[texel] += normal;
      V3f* out = &level.radiance[(texel * views + view) * lights];
      for (std::size_t light = 0; light < lights; ++light) {
        const std::size_t x = (first_light + light) * width + texel % width;
        const std::size_t pixel = (texel / width) * width * all_lights + x;
        for (int c = 0; c < 3; ++c) {
          const float value = (*colour)[c][pixel];
          if (!is_radiance(value)) return bad_sample(file, names::part_radiance, x, y, value);
          out[light][c] = value;
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
  const auto& all = file_header_.pairs[index_of(kind)];
  const int rows = header_.height * static_cast<int>(all.size());
  auto planes = read_planes(reader_, name, header_.width, rows, pair_channels(name), 0, rows);
  if (!planes) return tl::unexpected(planes.error());
  const auto& p = *planes;
  for (std::size_t i = 0; i < p[0].size(); ++i) {
    if (side_of(all[i / header_.texels()]) != header_.side) continue;
    for (int c = 0; c < 4; ++c) {
      const bool good = c < 3 ? is_radiance(p[c][i]) : is_opacity(p[c][i]);
      if (good && std::isfinite(p[c + 4][i])) continue;
      return bad_sample(reader_.name(), name, i % header_.width, i / header_.width, p[good ? c + 4 : c][i]);
    }
    samples.radiance.emplace_back(p[0][i], p[1][i], p[2][i]);
    samples.noise.emplace_back(p[4][i], p[5][i], p[6][i]);
    samples.alpha.push_back(p[3][i]);
    samples.alpha_noise.push_back(p[7][i]);
  }
  return samples;
}

Result<YarnData> SamplesReader::read_yarns() {
  const YarnCounts& counts = header_.yarns;
  const auto curves =
      read_planes(reader_, names::part_yarns, curve_value_count(counts), 1, {{names::part_yarns}}, 0, 1);
  if (!curves) return tl::unexpected(curves.error());
  const auto light = read_planes(reader_, names::part_indirect, counts.stations, light_values_per_station,
                                 {{names::part_indirect}}, 0, light_values_per_station);
  if (!light) return tl::unexpected(light.error());
  auto yarns = yarns_from_values(curves->front(), light->front(), counts, header_.period_mm);
  if (yarns && header_.both_sides) {
    const auto through =
        read_planes(reader_, names::part_light_through, counts.stations, light_values_per_station,
                    {{names::part_light_through}}, 0, light_values_per_station);
    if (!through) return tl::unexpected(through.error());
    yarns->through = light_from_values(through->front(), counts.stations);
    if (auto ok = validate(*yarns, header_.period_mm); !ok) yarns = tl::unexpected(ok.error());
  }
  if (!yarns)
    return malformed(reader_.name(), std::string(names::part_yarns) + "/" + yarns.error().place,
                     yarns.error().message);
  return yarns;
}

}  // namespace selvedge
