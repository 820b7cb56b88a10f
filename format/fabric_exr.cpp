#include "format/fabric_exr.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "format/evaluate.h"
#include "format/exr.h"
#include "format/fabric_names.h"

namespace selvedge {
namespace {

using nlohmann::json;

/// One layer on its way to a part: the part, its pixels per level, and the levels that hold it.
struct PartData {
  ExrPart part;
  std::vector<ExrPixels> levels;
  std::vector<int> present;
};

ExrPixels blank(const FabricLevel& level, std::size_t channels) {
  return {level.width, level.height,
          std::vector<std::vector<float>>(channels,
                                          std::vector<float>(static_cast<std::size_t>(level.texels())))};
}

ExrPart data_part(const Fabric& fabric, const char* name) {
  ExrPart part;
  part.name = name;
  part.width = fabric.levels.front().width;
  part.height = fabric.levels.front().height;
  part.mipmapped = true;
  part.levels = level_count(part.width, part.height);
  part.attributes[names::attribute_wrap] = std::string(names::wrap_periodic);
  return part;
}

std::vector<ExrChannel> lobe_channels(int lobes, bool half) {
  // In the order of LobeLayer: channel by channel, rho first, then the lobes' parameters.
  std::vector<ExrChannel> channels;
  for (const char* colour : names::colour_suffix) {
    channels.push_back({fmt::format("lobes.diffuse.{}", colour), half});
    for (int j = 0; j < lobes; ++j) {
      for (const char* parameter : names::lobe_parameters) {
        channels.push_back({fmt::format("lobes.{}.{}.{}", j, parameter, colour), half});
      }
    }
  }
  return channels;
}

std::vector<ExrChannel> table_channels(int views, bool half) {
  std::vector<ExrChannel> channels;
  for (int v = 0; v < views; ++v) {
    for (const char* colour : names::colour_suffix) {
      channels.push_back({fmt::format("table.{:04}.{}", v, colour), half});
    }
  }
  return channels;
}

std::vector<ExrChannel> opacity_channels(int views, bool half) {
  std::vector<ExrChannel> channels;
  for (int v = 0; v < views; ++v) channels.push_back({fmt::format("opacity.{:04}", v), half});
  return channels;
}

std::vector<ExrChannel> frame_channels(bool half) {
  std::vector<ExrChannel> channels;
  for (const char* name : names::frame_channels) channels.push_back({name, half});
  return channels;
}

/// Fills a part level by level. `values(level)` gives the layer's values of one level texel by texel
/// (texel-major, channels in the part's order), or nothing where the level has no such layer.
template <class Values>
PartData collect(const Fabric& fabric, const char* name, std::vector<ExrChannel> channels,
                 const Values& values) {
  PartData data;
  data.part = data_part(fabric, name);
  data.part.channels = std::move(channels);
  const std::size_t count = data.part.channels.size();
  for (int k = 0; k < data.part.levels; ++k) {
    FabricLevel size;
    size.width = level_size(data.part.width, k);
    size.height = level_size(data.part.height, k);
    ExrPixels pixels = blank(size, count);
    const bool exists = k < static_cast<int>(fabric.levels.size());
    const std::vector<float> flat =
        exists ? values(fabric.levels[static_cast<std::size_t>(k)]) : std::vector<float>();
    if (!flat.empty()) {
      data.present.push_back(k);
      for (std::size_t texel = 0; texel * count < flat.size(); ++texel) {
        for (std::size_t c = 0; c < count; ++c) pixels.planes[c][texel] = flat[texel * count + c];
      }
    }
    data.levels.push_back(std::move(pixels));
  }
  return data;
}

std::vector<float> flatten(const std::vector<V3f>& a) {
  std::vector<float> flat;
  flat.reserve(a.size() * 3);
  for (const V3f& v : a) flat.insert(flat.end(), {v.x, v.y, v.z});
  return flat;
}

std::vector<float> flatten(const FrameLayer& frame) {
  std::vector<float> flat;
  for (std::size_t i = 0; i < frame.normal.size(); ++i) {
    const V3f& n = frame.normal[i];
    const V3f& t = frame.tangent[i];
    flat.insert(flat.end(), {n.x, n.y, n.z, t.x, t.y, t.z});
  }
  return flat;
}

Result<int> common_lobe_count(const Fabric& fabric) {
  int lobes = -1;
  for (const FabricLevel& level : fabric.levels) {
    if (!level.lobes) continue;
    if (lobes >= 0 && level.lobes->lobes != lobes) {
      return fail(Code::fabric_malformed, {}, "lobes", "levels differ in their number of lobes");
    }
    lobes = level.lobes->lobes;
  }
  return lobes;
}

Result<std::vector<PartData>> data_parts(const Fabric& fabric, const FabricWriteOptions& options) {
  const auto lobes = common_lobe_count(fabric);
  if (!lobes) return tl::unexpected(lobes.error());
  const int views = fabric.views.count();
  const bool half = !options.float_tables;
  std::vector<PartData> parts;
  if (*lobes >= 0) {
    parts.push_back(collect(fabric, names::part_lobes, lobe_channels(*lobes, options.half_lobes),
                            [](const FabricLevel& level) {
                              return level.lobes ? level.lobes->parameters : std::vector<float>();
                            }));
  }
  parts.push_back(collect(fabric, names::part_frame, frame_channels(half), [](const FabricLevel& level) {
    return level.frame ? flatten(*level.frame) : std::vector<float>();
  }));
  parts.push_back(
      collect(fabric, names::part_table, table_channels(views, half), [](const FabricLevel& level) {
        return level.view_table ? flatten(level.view_table->colour) : std::vector<float>();
      }));
  parts.push_back(
      collect(fabric, names::part_opacity, opacity_channels(views, half), [](const FabricLevel& level) {
        return level.opacity ? level.opacity->opacity : std::vector<float>();
      }));
  std::erase_if(parts, [](const PartData& data) { return data.present.empty(); });
  return parts;
}

/// What every EXR viewer shows: level 0 seen along the normal under a white light from the upper left,
/// premultiplied, at the exposure under which a white Lambert cloth facing the light is 1.
PartData preview_of(const Fabric& fabric) {
  const FabricLevel& level = fabric.levels.front();
  PartData data;
  data.part.name = names::part_preview;
  data.part.width = level.width;
  data.part.height = level.height;
  data.part.channels = {{"R"}, {"G"}, {"B"}, {"A"}};
  data.part.attributes[names::attribute_wrap] = std::string(names::wrap_periodic);
  ExrPixels pixels = blank(level, 4);
  const V3f light = V3f(-0.4F, 0.5F, 0.8F).normalized();
  for (int y = 0; y < level.height; ++y) {
    for (int x = 0; x < level.width; ++x) {
      const Shading s = evaluate(fabric, 0, x, y, light, {0, 0, 1});
      const V3f colour = s.radiance * (s.alpha * std::numbers::pi_v<float>);
      const auto i = static_cast<std::size_t>(y * level.width + x);
      for (std::size_t c = 0; c < 3; ++c)
        pixels.planes[c][i] = std::min(colour[static_cast<int>(c)], 1000.0F);
      pixels.planes[3][i] = s.alpha;
    }
  }
  data.levels.push_back(std::move(pixels));
  return data;
}

std::string model_of(const Fabric& fabric) {
  const FabricLevel& base = fabric.levels.front();
  std::string model = base.lobes ? "lafortune" : "constant";
  if (base.view_table) model += "-view-table";
  return model;
}

/// Digest over the attribute text and all part and channel names, so that none can be exchanged unseen.
std::string header_digest(const std::string& text, const std::vector<ExrPart>& parts) {
  std::string all = text;
  for (const ExrPart& part : parts) {
    all += '\n' + part.name;
    std::vector<std::string> channels;
    for (const ExrChannel& c : part.channels) channels.push_back(c.name + (c.half ? " half" : " float"));
    std::sort(channels.begin(), channels.end());
    for (const std::string& c : channels) all += '\n' + c;
  }
  return digest_of(all);
}

json provenance_of(const Fabric& fabric) {
  json parsed = json::parse(fabric.provenance.empty() ? "{}" : fabric.provenance, nullptr, false);
  return parsed.is_object() ? parsed : json::object();
}

std::string attribute_text(const Fabric& fabric, const std::vector<PartData>& parts) {
  json layers = json::object();
  json digests = json::object();
  for (const PartData& data : parts) {
    json layer = {{"levels", data.present},
                  {"precision", data.part.channels.front().half ? "half" : "float"}};
    if (data.part.name == names::part_lobes) layer["lobes"] = (data.part.channels.size() / 3 - 1) / 4;
    layers[data.part.name] = layer;
    for (const int k : data.present) {
      digests[data.part.name].push_back(digest_of(data.part, data.levels[static_cast<std::size_t>(k)]));
    }
  }
  const FabricLevel& base = fabric.levels.front();
  const json text = {
      {"version", {names::fabric_version_major, names::fabric_version_minor}},
      {"model", model_of(fabric)},
      {"texels", {base.width, base.height}},
      {"levels", fabric.levels.size()},
      {"mmPerRepeat", {fabric.period_mm.x, fabric.period_mm.y}},
      {"referenceHeight", fabric.reference_height},
      {"thickness", fabric.thickness_mm},
      {"views",
       {{"layout", names::layout_equal_area},
        {"columns", fabric.views.columns},
        {"rows", fabric.views.rows}}},
      {"layers", layers},
      {"digests", digests},
      {"provenance", provenance_of(fabric)},
  };
  return text.dump();
}

}  // namespace

Result<void> write_fabric(const std::string& path, const Fabric& fabric, const FabricWriteOptions& options) {
  const auto named = [&](Error error) {
    error.file = path;
    return tl::unexpected(std::move(error));
  };
  if (auto ok = validate(fabric); !ok) return named(ok.error());
  auto data = data_parts(fabric, options);
  if (!data) return named(data.error());
  const std::string text = attribute_text(fabric, *data);
  data->insert(data->begin(), preview_of(fabric));

  std::vector<ExrPart> parts;
  for (const PartData& d : *data) parts.push_back(d.part);
  auto& attributes = parts.front().attributes;
  attributes[names::attribute_fabric] = text;
  attributes[names::attribute_digest] = header_digest(text, parts);
  attributes[names::attribute_version] =
      fmt::format("{}.{}", names::fabric_version_major, names::fabric_version_minor);
  attributes[names::attribute_model] = model_of(fabric);
  attributes[names::attribute_period] = fabric.period_mm;
  attributes[names::attribute_reference_height] = fabric.reference_height;

  auto writer = ExrWriter::create(path, parts);
  if (!writer) return tl::unexpected(writer.error());
  for (std::size_t p = 0; p < data->size(); ++p) {
    for (std::size_t k = 0; k < (*data)[p].levels.size(); ++k) {
      auto ok = writer->write_level(static_cast<int>(p), static_cast<int>(k), (*data)[p].levels[k]);
      if (!ok) return ok;
    }
  }
  return writer->commit();
}

namespace {

tl::unexpected<Error> malformed(const std::string& file, std::string place, std::string message) {
  return fail(Code::fabric_malformed, file, std::move(place), std::move(message));
}

Result<json> fabric_json(const ExrReader& reader) {
  const std::string& file = reader.name();
  if (reader.parts().empty()) return malformed(file, {}, "no parts");
  const auto& attributes = reader.parts().front().attributes;
  const auto found = attributes.find(names::attribute_fabric);
  const auto* text = found == attributes.end() ? nullptr : std::get_if<std::string>(&found->second);
  if (text == nullptr) {
    return malformed(file, names::attribute_fabric, "attribute is missing: not a fabric file");
  }
  json parsed = json::parse(*text, nullptr, false);
  if (!parsed.is_object()) return malformed(file, names::attribute_fabric, "is not a JSON object");
  const json version = parsed.value("version", json::array());
  const auto is_whole = [](const json& number) { return number.is_number_integer(); };
  if (!version.is_array() || version.size() != 2 || !std::all_of(version.begin(), version.end(), is_whole)) {
    return malformed(file, "/version", "is not a pair of whole numbers");
  }
  if (version[0].get<std::int64_t>() != names::fabric_version_major) {
    return fail(Code::fabric_version, file, "/version",
                fmt::format("version {} is not understood; this program reads version {}", version.dump(),
                            names::fabric_version_major));
  }
  const auto stored = attributes.find(names::attribute_digest);
  const auto* digest = stored == attributes.end() ? nullptr : std::get_if<std::string>(&stored->second);
  if (digest == nullptr || *digest != header_digest(*text, reader.parts())) {
    return fail(Code::fabric_digest, file, names::attribute_digest,
                "does not match the attributes, part and channel names");
  }
  return parsed;
}

Result<int> whole_number(const json& object, const char* pointer, int least, int most,
                         const std::string& file) {
  const json::json_pointer where(pointer);
  if (!object.contains(where) || !object[where].is_number_integer()) {
    return malformed(file, pointer, "is not a whole number");
  }
  const auto value = object[where].get<std::int64_t>();
  if (value < least || value > most) {
    return malformed(file, pointer, fmt::format("{} is outside of {} to {}", value, least, most));
  }
  return static_cast<int>(value);
}

Result<float> number(const json& object, const char* pointer, const std::string& file) {
  const json::json_pointer where(pointer);
  if (!object.contains(where) || !object[where].is_number())
    return malformed(file, pointer, "is not a number");
  return object[where].get<float>();
}

/// Reads one layer of one level, texel-major in the order of `expected`; checks channels and digest.
Result<std::vector<float>> read_layer(ExrReader& reader, const json& header, int part_index, int level,
                                      std::size_t digest_index, const std::vector<ExrChannel>& expected) {
  const ExrPart& part = reader.parts()[static_cast<std::size_t>(part_index)];
  const std::string place = fmt::format("{}/level {}", part.name, level);
  if (level >= part.levels) return malformed(reader.name(), place, "the part has no such level");
  auto pixels = reader.read_level(part_index, level);
  if (!pixels) return tl::unexpected(pixels.error());
  const json digests = header.value("digests", json::object()).value(part.name, json::array());
  if (digest_index >= digests.size() || digests[digest_index] != digest_of(part, *pixels)) {
    return fail(Code::fabric_digest, reader.name(), place, "the pixels do not match the stored digest");
  }
  const std::size_t texels = pixels->planes.empty() ? 0 : pixels->planes.front().size();
  std::vector<float> flat(texels * expected.size());
  for (std::size_t c = 0; c < expected.size(); ++c) {
    const auto found =
        std::find_if(part.channels.begin(), part.channels.end(),
                     [&](const ExrChannel& channel) { return channel.name == expected[c].name; });
    if (found == part.channels.end()) {
      return malformed(reader.name(), fmt::format("{}/{}", part.name, expected[c].name),
                       "channel is missing");
    }
    const std::vector<float>& plane = pixels->planes[static_cast<std::size_t>(found - part.channels.begin())];
    for (std::size_t texel = 0; texel < texels; ++texel) flat[texel * expected.size() + c] = plane[texel];
  }
  return flat;
}

std::vector<V3f> vectors(const std::vector<float>& flat, std::size_t stride, std::size_t offset) {
  std::vector<V3f> result;
  for (std::size_t i = offset; i + 2 < flat.size(); i += stride) {
    result.emplace_back(flat[i], flat[i + 1], flat[i + 2]);
  }
  return result;
}

void place_layer(FabricLevel& level, const std::string& part, int lobes, std::vector<float> flat) {
  if (part == names::part_lobes) {
    level.lobes = LobeLayer{lobes, std::move(flat)};
  } else if (part == names::part_frame) {
    level.frame = FrameLayer{vectors(flat, 6, 0), vectors(flat, 6, 3)};
  } else if (part == names::part_table) {
    level.view_table = ViewTableLayer{vectors(flat, 3, 0)};
  } else {
    level.opacity = OpacityLayer{std::move(flat)};
  }
}

Result<void> read_levels(ExrReader& reader, const json& header, int lobe_limit, Fabric& fabric) {
  const std::string& file = reader.name();
  const int views = fabric.views.count();
  for (const char* name : {names::part_lobes, names::part_frame, names::part_table, names::part_opacity}) {
    const json layer = header.value("layers", json::object()).value(name, json());
    if (layer.is_null()) continue;
    const std::string place = fmt::format("/layers/{}", name);
    const int part_index = reader.find_part(name);
    if (part_index < 0) return malformed(file, place, "the part is missing");
    const ExrPart& part = reader.parts()[static_cast<std::size_t>(part_index)];
    if (part.width != fabric.levels.front().width || part.height != fabric.levels.front().height) {
      return malformed(file, name, "the part's size differs from the fabric's texels");
    }
    int lobes = 0;
    std::vector<ExrChannel> channels = frame_channels(true);
    if (part.name == names::part_lobes) {
      auto count = whole_number(layer, "/lobes", 0, lobe_limit, file);
      if (!count) return tl::unexpected(count.error());
      lobes = *count;
      channels = lobe_channels(lobes, false);
    } else if (part.name == names::part_table) {
      channels = table_channels(views, true);
    } else if (part.name == names::part_opacity) {
      channels = opacity_channels(views, true);
    }
    const json present = layer.value("levels", json::array());
    if (!present.is_array()) return malformed(file, place + "/levels", "is not an array");
    for (std::size_t i = 0; i < present.size(); ++i) {
      if (!present[i].is_number_integer() || present[i] < 0 || present[i] >= fabric.levels.size()) {
        return malformed(file, place + "/levels", "names a level that the fabric does not have");
      }
      const int k = present[i].get<int>();
      auto flat = read_layer(reader, header, part_index, k, i, channels);
      if (!flat) return tl::unexpected(flat.error());
      place_layer(fabric.levels[static_cast<std::size_t>(k)], part.name, lobes, std::move(*flat));
    }
  }
  return {};
}

/// May throw json::exception where a member of the JSON text is of the wrong type.
Result<Fabric> read_checked(ExrReader& reader, const FabricLimits& limits) {
  const std::string& file = reader.name();
  const auto header = fabric_json(reader);
  if (!header) return tl::unexpected(header.error());

  const auto width = whole_number(*header, "/texels/0", 1, limits.texels_per_side, file);
  const auto height = whole_number(*header, "/texels/1", 1, limits.texels_per_side, file);
  const auto columns = whole_number(*header, "/views/columns", 1, limits.directions, file);
  const auto rows = whole_number(*header, "/views/rows", 1, limits.directions, file);
  const auto period_x = number(*header, "/mmPerRepeat/0", file);
  const auto period_y = number(*header, "/mmPerRepeat/1", file);
  const auto reference_height = number(*header, "/referenceHeight", file);
  const auto thickness = number(*header, "/thickness", file);
  for (const auto* whole : {&width, &height, &columns, &rows}) {
    if (!*whole) return tl::unexpected(whole->error());
  }
  for (const auto* real : {&period_x, &period_y, &reference_height, &thickness}) {
    if (!*real) return tl::unexpected(real->error());
  }
  const auto levels = whole_number(*header, "/levels", 1, level_count(*width, *height), file);
  if (!levels) return tl::unexpected(levels.error());
  if (*columns > limits.directions / *rows) return malformed(file, "/views", "too many directions");
  if (header->value("/views/layout"_json_pointer, std::string()) != names::layout_equal_area) {
    return malformed(file, "/views/layout", "is not a known layout");
  }

  Fabric fabric;
  fabric.period_mm = {*period_x, *period_y};
  fabric.reference_height = *reference_height;
  fabric.thickness_mm = *thickness;
  fabric.views = {*columns, *rows};
  fabric.provenance = header->value("provenance", json::object()).dump();
  for (int k = 0; k < *levels; ++k) {
    FabricLevel& level = fabric.levels.emplace_back();
    level.width = level_size(*width, k);
    level.height = level_size(*height, k);
  }
  if (auto ok = read_levels(reader, *header, limits.lobes, fabric); !ok) return tl::unexpected(ok.error());
  if (auto ok = validate(fabric, limits); !ok) {
    Error error = ok.error();
    error.file = file;
    return tl::unexpected(error);
  }
  return fabric;
}

Result<Fabric> read_fabric(Result<ExrReader> reader, const FabricLimits& limits) {
  if (!reader) return tl::unexpected(reader.error());
  try {
    return read_checked(*reader, limits);
  } catch (const json::exception& error) {
    return malformed(reader->name(), names::attribute_fabric, error.what());
  }
}

}  // namespace

Result<Fabric> read_fabric(const std::string& path, const FabricLimits& limits) {
  return read_fabric(ExrReader::open(path), limits);
}

Result<Fabric> read_fabric(std::span<const std::uint8_t> bytes, const std::string& name,
                           const FabricLimits& limits) {
  return read_fabric(ExrReader::open(bytes, name), limits);
}

Result<std::string> read_fabric_header(const std::string& path) {
  const auto reader = ExrReader::open(path);
  if (!reader) return tl::unexpected(reader.error());
  const auto header = fabric_json(*reader);
  if (!header) return tl::unexpected(header.error());
  return header->dump(2);
}

}  // namespace selvedge
