// Fabric files taken apart, changed and put together again: what breaks one rule and keeps the others.
#pragma once

#include <doctest/doctest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "format/exr/exr.h"
#include "format/fabric/file.h"
#include "format/fabric/rules.h"
#include "tests/require.h"

namespace selvedge::test {

/// All that is in a fabric file. Channels are in the file's order, by name.
struct OpenedFabric {
  std::vector<ExrPart> parts;
  std::vector<std::vector<ExrPixels>> pixels;  ///< [part][level]
  nlohmann::json text;

  std::size_t index_of(const std::string& name) const {
    for (std::size_t i = 0; i < parts.size(); ++i) {
      if (parts[i].name == name) return i;
    }
    FAIL("no part ", name);
    return 0;
  }
  ExrPart& part(const std::string& name) { return parts[index_of(name)]; }
  std::vector<float>& plane(const std::string& name, int level, const std::string& channel) {
    const std::size_t p = index_of(name);
    for (std::size_t c = 0; c < parts[p].channels.size(); ++c) {
      if (parts[p].channels[c].name == channel) return pixels[p][level].planes[c];
    }
    FAIL("no channel ", channel);
    return pixels[0][0].planes[0];
  }
  /// Leaves a part out, or a channel of one.
  void drop(const std::string& name) {
    const auto p = static_cast<std::ptrdiff_t>(index_of(name));
    parts.erase(parts.begin() + p);
    pixels.erase(pixels.begin() + p);
  }
  void drop_channel(const std::string& name, std::size_t channel) {
    const std::size_t p = index_of(name);
    const auto c = static_cast<std::ptrdiff_t>(channel);
    parts[p].channels.erase(parts[p].channels.begin() + c);
    for (ExrPixels& level : pixels[p]) level.planes.erase(level.planes.begin() + c);
  }
  /// Another channel, of zeros.
  void add_channel(const std::string& name, const ExrChannel& channel) {
    const std::size_t p = index_of(name);
    parts[p].channels.push_back(channel);
    for (ExrPixels& level : pixels[p]) {
      level.planes.emplace_back(static_cast<std::size_t>(level.width * level.height));
    }
  }
  /// A copy of a part under another name, its channels likewise.
  void copy_part(const std::string& from, const std::string& to) {
    const std::size_t p = index_of(from);
    parts.push_back(parts[p]);
    pixels.push_back(pixels[p]);
    parts.back().name = to;
    for (ExrChannel& channel : parts.back().channels) channel.name = to + "." + channel.name;
  }
  /// The pixel digests of the listed levels of a layer, to be made anew after its pixels were changed.
  void digest(const std::string& name) {
    const std::size_t p = index_of(name);
    nlohmann::json digests = nlohmann::json::array();
    for (const nlohmann::json& level : text["layers"][name]["levels"]) {
      digests.push_back(digest_of(parts[p], pixels[p][level.get<std::size_t>()]));
    }
    text["digests"][name] = digests;
  }
};

inline OpenedFabric open_fabric(const std::string& path) {
  OpenedFabric fabric;
  auto reader = need(ExrReader::open(path));
  fabric.parts = reader.parts();
  for (ExrPart& part : fabric.parts) {
    for (const char* written : {"name", "type", "chunkCount"}) part.attributes.erase(written);
  }
  for (std::size_t p = 0; p < fabric.parts.size(); ++p) {
    auto& levels = fabric.pixels.emplace_back();
    for (int k = 0; k < fabric.parts[p].levels; ++k) {
      auto pixels = need(reader.read_level(static_cast<int>(p), k));
      levels.push_back(std::move(pixels));
    }
  }
  fabric.text = nlohmann::json::parse(std::get<std::string>(fabric.parts[0].attributes["selvedge.fabric"]));
  return fabric;
}

/// Writes it with the attribute text `text` and the header digest that follows.
inline void save_fabric(const std::string& path, OpenedFabric fabric, const std::string& text) {
  fabric.parts[0].attributes["selvedge.fabric"] = text;
  fabric.parts[0].attributes["selvedge.digest"] = header_digest(text, fabric.parts);
  auto writer = need(ExrWriter::create(path, fabric.parts));
  for (std::size_t p = 0; p < fabric.parts.size(); ++p) {
    for (std::size_t k = 0; k < fabric.pixels[p].size(); ++k) {
      REQUIRE(writer.write_level(static_cast<int>(p), static_cast<int>(k), fabric.pixels[p][k]));
    }
  }
  REQUIRE(writer.commit());
}

inline void save_fabric(const std::string& path, const OpenedFabric& fabric) {
  save_fabric(path, fabric, fabric.text.dump());
}

}  // namespace selvedge::test
