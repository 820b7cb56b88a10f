#include "format/samples/samples.h"

#include <Imath/half.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "format/base/guard.h"
#include "format/base/json_text.h"
#include "format/fabric/json_io.h"
#include "format/fabric/names.h"

namespace selvedge {
namespace {

using nlohmann::json;

constexpr ByPairKind<const char*> pair_parts{names::part_validation, names::part_held_out,
                                             names::part_measured};

json list_of(const V3f& v) { return {v.x, v.y, v.z}; }

/// A unit vector, of the upper hemisphere unless both sides are known.
V3f direction(const JsonIo& pair, const char* name, bool both_sides) {
  V3f v(0, 0, 1);
  pair.numbers(name, {&v.x, 3});
  if (!(std::abs(v.length() - 1) < 1e-3F) || !(v.z >= 0 || both_sides))
    pair.add_issue(name, "is not a unit direction above the cloth");
  return v;
}

/// A grid with its directions, which are informative.
void grid_io(const JsonIo& text, const char* name, DirectionGrid& grid) {
  const JsonIo object = text.grid(name, grid, FabricLimits{}.directions);
  if (text.is_reading()) return;
  json directions = json::array();
  for (const V3f& d : cell_directions(grid)) directions.push_back(list_of(d));
  object.set_member("directions", std::move(directions));
}

void pairs_io(const JsonIo& sets, SamplesHeader& h) {
  for (const PairKind kind : all_pair_kinds) {
    auto& pairs = h.pairs[index_of(kind)];
    if (!sets || (kind == PairKind::measured && !sets.has_optional(name_of(kind), !pairs.empty()))) continue;
    if (sets.is_reading()) {
      for (const JsonIo& pair : sets.items(name_of(kind)))
        pairs.push_back({direction(pair, "light", h.both_sides), direction(pair, "view", h.both_sides)});
      continue;
    }
    json list = json::array();
    for (const DirectionPair& pair : pairs)
      list.push_back({{"light", list_of(pair.light)}, {"view", list_of(pair.view)}});
    sets.set_member(name_of(kind), std::move(list));
  }
}

/// Reads or writes the attribute text but for its version.
void header_io(const JsonIo& text, SamplesHeader& h) {
  const FabricLimits limits;
  constexpr int max_samples = std::numeric_limits<int>::max();
  text.integer_pair("texels", h.width, h.height, 1, limits.texels_per_side);
  text.numbers("mmPerRepeat", {&h.period_mm.x, 2}, RealRule::positive);
  text.number("referenceHeight", h.reference_height);
  text.number("thickness", h.thickness_mm, RealRule::not_negative);
  grid_io(text, "views", h.views);
  grid_io(text, "lights", h.lights);
  text.integer("samplesPerTexel", h.samples_per_texel, 0, max_samples);
  text.integer("truthSamples", h.truth_samples, 0, max_samples);
  if (text.has_optional("sides", h.both_sides)) {
    if (!text.is_reading())
      text.set_member("sides", "both");
    else if (text.value()["sides"] != "both")
      text.add_issue("sides", "is not \"both\"");
    h.both_sides = true;
  }
  pairs_io(text.object("pairs"), h);
  if (text.has_optional(names::part_yarns, h.yarns.curves > 0))
    text.object(names::part_yarns).yarn_counts(h.yarns, limits);
  if (text.is_reading() && h.yarns.light_functions > 0) text.add_issue(names::part_yarns, "are packed");
  if (!text.is_reading())
    text.set_member("provenance", provenance_json(h.provenance));
  else if (const JsonIo provenance = text.member("provenance"))
    h.provenance = provenance.value().dump();
}

using Planes = std::vector<std::vector<float>>;

ExrPart new_part(const char* name, int width, int height, std::vector<ExrChannel> channels = {}) {
  return {.name = name, .width = width, .height = height, .channels = std::move(channels)};
}

/// One picture of the cell per view (downwards) and light (to the right), for image viewers.
ExrPart radiance_part(const SamplesHeader& h) {
  return new_part(names::part_radiance, h.width * h.light_count(), h.height * h.view_count(),
                  {{"R"}, {"G"}, {"B"}});
}

ExrPart surface_part(const SamplesHeader& h) {
  return new_part(names::part_surface, h.width, h.height * h.view_count(),
                  {{"surface.opacity"}, {"surface.nx"}, {"surface.ny"}, {"surface.nz"}});
}

ExrPart pair_part(const SamplesHeader& h, PairKind kind) {
  ExrPart part =
      new_part(name_of(kind), h.width, h.height * static_cast<int>(h.pairs[index_of(kind)].size()));
  for (const char* channel :
       {"red", "green", "blue", "opacity", "noise.red", "noise.green", "noise.blue", "noise.opacity"})
    part.channels.push_back({fmt::format("{}.{}", part.name, channel)});
  return part;
}

ExrPart curve_part(const SamplesHeader& h) {
  return new_part(names::part_yarns, curve_value_count(h.yarns), 1, {{names::part_yarns, false}});
}

ExrPart yarn_light_part(const SamplesHeader& h, const char* name) {
  return new_part(name, h.yarns.stations, h.yarns.values_per_station, {{name, false}});
}

tl::unexpected<Error> malformed(const std::string& file, std::string place, std::string message) {
  return fail(Code::samples_malformed, file, std::move(place), std::move(message));
}

Planes blank(const ExrPart& part) {
  return Planes(part.channels.size(), std::vector<float>(std::size_t{1} * part.width * part.height));
}

/// Index in a plane of the part `radiance` of texel `t` under light `l`, seen from view `v`.
std::size_t radiance_pixel(const SamplesHeader& h, std::size_t v, std::size_t l, std::size_t t) {
  const std::size_t width = h.width;
  return ((v * h.height + t / width) * h.light_count() + l) * width + t % width;
}

/// The planes of a scanline part in the order of the wanted channels, not in the file's alphabetical one.
Result<Planes> read_part(ExrReader& reader, const ExrPart& wanted) {
  const int index = reader.find_part(wanted.name);
  if (index < 0) return malformed(reader.path(), wanted.name, "the part is missing");
  const ExrPart& part = reader.parts()[index];
  if (part.has_mipmaps || part.width != wanted.width || part.height != wanted.height)
    return malformed(reader.path(), wanted.name,
                     fmt::format("is not a scanline part of {}x{} pixels", wanted.width, wanted.height));
  if (part.channels.size() != wanted.channels.size())
    return malformed(reader.path(), wanted.name, "has other channels");
  auto pixels = value_or_throw(reader.read_level(index));
  Planes planes;
  for (const ExrChannel& channel : wanted.channels) {
    const auto found = std::ranges::find(part.channels, channel.name, &ExrChannel::name);
    if (found == part.channels.end())
      return malformed(reader.path(), part.name + "/" + channel.name, "is missing");
    planes.push_back(std::move(pixels.planes[found - part.channels.begin()]));
  }
  return planes;
}

/// Refuses samples that are not finite, negative radiance, and opacity outside of [0, 1].
Result<void> check(const Samples& samples, const std::string& file) {
  const SamplesHeader& h = samples.header;
  const std::size_t width = h.width;
  const std::size_t texels = h.texels();
  const auto refuse = [&](const char* part, std::size_t x, std::size_t y, float value) {
    return fail(Code::samples_not_finite, file, fmt::format("{}/pixel {},{}", part, x, y),
                fmt::format("sample is {}", value));
  };
  const auto is_opacity = [](float value) { return value >= 0 && value <= 1; };
  const auto bad_channel = [](const V3f& r) {
    for (int c = 0; c < 3; ++c)
      if (!(r[c] >= 0) || std::isinf(r[c])) return c;
    return -1;
  };
  for (std::size_t v = 0; v < samples.views.size(); ++v) {
    const ViewSamples& view = samples.views[v];
    for (std::size_t t = 0; t < texels; ++t) {
      const float normal = view.normal[t].length2();
      if (is_opacity(view.alpha[t]) && std::isfinite(normal)) continue;
      return refuse(names::part_surface, t % width, v * h.height + t / width,
                    is_opacity(view.alpha[t]) ? normal : view.alpha[t]);
    }
    for (std::size_t i = 0; i < view.radiance.size(); ++i)
      if (const int c = bad_channel(view.radiance[i]); c >= 0)
        return refuse(names::part_radiance, i / texels * width + i % width, v * h.height + i % texels / width,
                      view.radiance[i][c]);
  }
  for (const PairKind kind : all_pair_kinds) {
    const PairSamples& pairs = samples.pairs[index_of(kind)];
    for (std::size_t i = 0; i < pairs.alpha.size(); ++i) {
      const auto refuse_pair = [&](float value) {
        return refuse(name_of(kind), i % width, i / width, value);
      };
      if (const int c = bad_channel(pairs.radiance[i]); c >= 0) return refuse_pair(pairs.radiance[i][c]);
      if (!is_opacity(pairs.alpha[i])) return refuse_pair(pairs.alpha[i]);
      if (!std::isfinite(pairs.alpha_noise[i])) return refuse_pair(pairs.alpha_noise[i]);
      if (!std::isfinite(pairs.noise[i].length2())) return refuse_pair(pairs.noise[i].length2());
    }
  }
  return {};
}

Result<YarnData> read_yarns(ExrReader& reader, const SamplesHeader& h) {
  const auto curves = value_or_throw(read_part(reader, curve_part(h)));
  const auto light = value_or_throw(read_part(reader, yarn_light_part(h, names::part_indirect)));
  auto yarns = yarns_from_values(curves.front(), light.front(), h.yarns, h.period_mm);
  if (yarns && h.both_sides) {
    const auto through = value_or_throw(read_part(reader, yarn_light_part(h, names::part_light_through)));
    yarns->light_through = light_from_values(through.front(), h.yarns.stations);
    if (auto ok = validate(*yarns, h.period_mm); !ok) yarns = tl::unexpected(ok.error());
  }
  if (!yarns)
    return malformed(reader.path(), std::string(names::part_yarns) + "/" + yarns.error().place,
                     yarns.error().message);
  return yarns;
}

Result<SamplesHeader> read_samples_header(const ExrReader& reader) {
  const auto& attributes = reader.parts().front().attributes;
  const auto found = attributes.find(names::attribute_samples);
  const auto* text = found == attributes.end() ? nullptr : &found->second;
  if (text == nullptr)
    return malformed(reader.path(), names::attribute_samples, "attribute is missing: not a samples file");
  return samples_header_from_json(*text, reader.path());
}

void read_views(ExrReader& reader, Samples& samples) {
  const SamplesHeader& h = samples.header;
  const auto colour = value_or_throw(read_part(reader, radiance_part(h)));
  const auto surface = value_or_throw(read_part(reader, surface_part(h)));
  const std::size_t texels = h.texels();
  const std::size_t lights = h.light_count();
  samples.views.resize(h.view_count());
  for (std::size_t v = 0; v < samples.views.size(); ++v) {
    ViewSamples& view = samples.views[v];
    for (std::size_t i = v * texels; i < (v + 1) * texels; ++i) {
      view.alpha.push_back(surface[0][i]);
      view.normal.emplace_back(surface[1][i], surface[2][i], surface[3][i]);
    }
    view.radiance.reserve(lights * texels);
    for (std::size_t i = 0; i < lights * texels; ++i) {
      const std::size_t pixel = radiance_pixel(h, v, i / texels, i % texels);
      view.radiance.emplace_back(colour[0][pixel], colour[1][pixel], colour[2][pixel]);
    }
  }
}

PairSamples read_pairs(ExrReader& reader, const SamplesHeader& h, PairKind kind) {
  PairSamples pairs{.width = h.width, .height = h.height};
  pairs.pairs = h.pairs[index_of(kind)];
  if (pairs.pairs.empty()) return pairs;
  const Planes p = value_or_throw(read_part(reader, pair_part(h, kind)));
  pairs.alpha = p[3];
  pairs.alpha_noise = p[7];
  for (std::size_t i = 0; i < p[0].size(); ++i) {
    pairs.radiance.emplace_back(p[0][i], p[1][i], p[2][i]);
    pairs.noise.emplace_back(p[4][i], p[5][i], p[6][i]);
  }
  return pairs;
}

Result<Samples> read(ExrReader reader, std::uint64_t memory) {
  // Values are decoded, laid out by view and by pair, and copied for one side.
  constexpr std::uint64_t value_price = 3 * sizeof(float);
  MemoryBudget budget(memory);
  for (const ExrPart& part : reader.parts()) {
    const std::uint64_t pixels = std::uint64_t{1} * part.width * part.height;
    if (!budget.try_spend(pixels * part.channels.size(), value_price))
      return tl::unexpected<Error>(memory_limit_error(reader.path(), part.name, "its values", memory));
  }
  Samples samples;
  samples.header = value_or_throw(read_samples_header(reader));
  read_views(reader, samples);
  for (const PairKind kind : all_pair_kinds)
    samples.pairs[index_of(kind)] = read_pairs(reader, samples.header, kind);
  if (samples.header.yarns.curves > 0) samples.yarns = value_or_throw(read_yarns(reader, samples.header));
  value_or_throw(check(samples, reader.path()));
  return samples;
}

/// `done(v)`: view v is no longer needed.
template <class Done>
SideSamples side_samples(const Samples& samples, Side side, const Done& done) {
  const SamplesHeader& h = samples.header;
  SideSamples result{h, {}, {}};
  result.header.side = side;
  for (const PairKind kind : all_pair_kinds) {
    result.pairs[index_of(kind)] = side_pairs(samples.pairs[index_of(kind)], side);
    result.header.pairs[index_of(kind)] = result.pairs[index_of(kind)].pairs;
  }
  SampleLevel& level = result.level;
  level.width = h.width;
  level.height = h.height;
  level.views = h.views.count();
  level.lights = h.lights.count();
  const std::size_t texels = h.texels();
  const std::size_t views = level.views;
  const std::size_t lights = level.lights;
  const bool behind = is_view_behind(side);
  // Lights on the side of the view come first for views in front, and last for those behind.
  const std::size_t first_light = behind != is_transmission(side) ? lights : 0;
  level.alpha.resize(texels * views);
  level.normal_sum.assign(texels, V3f(0, 0, 0));
  level.radiance.resize(texels * views * lights);
  for (std::size_t v = 0; v < views; ++v) {
    const ViewSamples& view = samples.views[v + (behind ? views : 0)];
    for (std::size_t t = 0; t < texels; ++t) {
      level.alpha[t * views + v] = view.alpha[t];
      level.normal_sum[t] += view.normal[t];
      V3f* out = &level.radiance[(t * views + v) * lights];
      for (std::size_t l = 0; l < lights; ++l) out[l] = view.radiance[(first_light + l) * texels + t];
    }
    done(v + (behind ? views : 0));
  }
  return result;
}

}  // namespace

std::vector<V3f> cell_directions(const DirectionGrid& grid, bool both_sides) {
  std::vector<V3f> directions = cell_directions(grid);
  for (int i = 0; both_sides && i < grid.count(); ++i) directions.push_back(mirrored(directions[i]));
  return directions;
}

const char* name_of(PairKind kind) { return pair_parts[index_of(kind)]; }

std::string samples_header_to_json(const SamplesHeader& header) {
  json text{{"version", names::samples_version}};
  SamplesHeader written = header;
  header_io(JsonIo::writer(text), written);
  return text.dump();
}

Result<SamplesHeader> samples_header_from_json(const std::string& text, const std::string& file) {
  const json members = parse_json(text);
  if (!members.is_object()) return malformed(file, names::attribute_samples, "is not a JSON object");
  IssueSink sink(file);
  const JsonIo reader = JsonIo::reader(members, Code::samples_malformed, sink);
  SamplesHeader header;
  if (const JsonIo version = reader.member("version"); version && version.value() != names::samples_version)
    version.add_issue(fmt::format("{} is not understood: this program reads version {}",
                                  version.value().dump(), names::samples_version));
  if (!sink.has_error()) header_io(reader, header);
  if (!sink.has_error()) return header;
  Error error = sink.first_error();
  error.place = names::attribute_samples + error.place;
  return tl::unexpected(std::move(error));
}

PairSamples side_pairs(const PairSamples& all, Side side) {
  PairSamples result{.width = all.width, .height = all.height};
  const auto texels = static_cast<std::ptrdiff_t>(all.width) * all.height;
  for (std::size_t p = 0; p < all.pairs.size(); ++p) {
    DirectionPair pair = all.pairs[p];
    const bool behind = pair.view.z < 0;
    if (behind != is_view_behind(side) || (behind != (pair.light.z < 0)) != is_transmission(side)) continue;
    if (behind) pair.view = mirrored(pair.view);
    if (pair.light.z < 0) pair.light = mirrored(pair.light);
    result.pairs.push_back(pair);
    const auto append = [&](const auto& from, auto& to) {
      const auto begin = from.begin() + static_cast<std::ptrdiff_t>(p) * texels;
      to.insert(to.end(), begin, begin + texels);
    };
    append(all.alpha, result.alpha);
    append(all.radiance, result.radiance);
    append(all.noise, result.noise);
    append(all.alpha_noise, result.alpha_noise);
  }
  return result;
}

SideSamples side_samples(const Samples& samples, Side side) {
  return side_samples(samples, side, [](std::size_t) {});
}

SideSamples take_side_samples(Samples& samples, Side side) {
  return side_samples(samples, side, [&](std::size_t v) { samples.views[v] = {}; });
}

Result<void> round_to_half(Samples& samples) {
  const auto round = [](float& value) { value = Imath::half(value); };
  const auto round_vectors = [&](std::vector<V3f>& vectors) {
    for (V3f& v : vectors)
      for (int c = 0; c < 3; ++c) round(v[c]);
  };
  for (ViewSamples& view : samples.views) {
    std::ranges::for_each(view.alpha, round);
    round_vectors(view.normal);
    round_vectors(view.radiance);
  }
  for (PairSamples& pairs : samples.pairs) {
    std::ranges::for_each(pairs.alpha, round);
    std::ranges::for_each(pairs.alpha_noise, round);
    round_vectors(pairs.noise);
    round_vectors(pairs.radiance);
  }
  return check(samples, {});
}

Result<void> write_samples(const std::string& path, const Samples& samples) {
  const SamplesHeader& h = samples.header;
  const std::size_t texels = h.texels();
  Planes colour = blank(radiance_part(h));
  Planes surface = blank(surface_part(h));
  for (std::size_t v = 0; v < samples.views.size(); ++v) {
    const ViewSamples& view = samples.views[v];
    for (std::size_t i = 0; i < view.radiance.size(); ++i) {
      const std::size_t pixel = radiance_pixel(h, v, i / texels, i % texels);
      for (int c = 0; c < 3; ++c) colour[c][pixel] = view.radiance[i][c];
    }
    std::ranges::copy(view.alpha, surface[0].begin() + static_cast<std::ptrdiff_t>(v * texels));
    for (std::size_t t = 0; t < texels; ++t)
      for (int c = 0; c < 3; ++c) surface[1 + c][v * texels + t] = view.normal[t][c];
  }
  std::vector<ExrPart> parts;
  std::vector<Planes> planes_of;
  const auto add = [&](ExrPart part, Planes planes) {
    parts.push_back(std::move(part));
    planes_of.push_back(std::move(planes));
  };
  add(radiance_part(h), std::move(colour));
  add(surface_part(h), std::move(surface));
  for (const PairKind kind : all_pair_kinds) {
    const PairSamples& pairs = samples.pairs[index_of(kind)];
    if (pairs.pairs.empty()) continue;
    Planes planes = blank(pair_part(h, kind));
    for (std::size_t i = 0; i < pairs.alpha.size(); ++i) {
      for (int c = 0; c < 3; ++c) {
        planes[c][i] = pairs.radiance[i][c];
        planes[4 + c][i] = pairs.noise[i][c];
      }
    }
    planes[3] = pairs.alpha;
    planes[7] = pairs.alpha_noise;
    add(pair_part(h, kind), std::move(planes));
  }
  if (h.yarns.curves > 0) {
    add(curve_part(h), {curve_values(samples.yarns)});
    add(yarn_light_part(h, names::part_indirect), {indirect_values(samples.yarns)});
    if (h.both_sides)
      add(yarn_light_part(h, names::part_light_through), {indirect_values(samples.yarns, true)});
  }
  parts.front().attributes[names::attribute_samples] = samples_header_to_json(h);
  return write_exr_file(path, parts, [&](int part, int) {
    return ExrPixels{parts[part].width, parts[part].height, std::move(planes_of[part])};
  });
}

Result<Samples> read_samples(const std::string& path, std::uint64_t memory) {
  return catch_failure([&] { return read(value_or_throw(ExrReader::open(path)), memory); });
}

Result<Samples> read_samples(std::span<const std::uint8_t> bytes, const std::string& name,
                             const ExrLimits& limits) {
  return catch_failure(
      [&] { return read(value_or_throw(ExrReader::open(bytes, name, limits)), default_memory_limit); });
}

Result<SamplesHeader> read_samples_header(const std::string& path) {
  return ExrReader::open(path).and_then([](const ExrReader& file) { return read_samples_header(file); });
}

}  // namespace selvedge
