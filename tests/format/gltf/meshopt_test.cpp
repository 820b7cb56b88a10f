#include "format/gltf/meshopt.h"

#include <doctest/doctest.h>
#include <meshoptimizer.h>

#include <cmath>
#include <string>
#include <vector>

#include "format/gltf/access.h"
#include "format/gltf/read_scene.h"
#include "tests/format/gltf_fixtures.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::test;

namespace {

std::string attributes(const std::string& plain, std::size_t stride) {
  const std::size_t count = plain.size() / stride;
  std::string bytes(meshopt_encodeVertexBufferBound(count, stride), '\0');
  bytes.resize(meshopt_encodeVertexBuffer(reinterpret_cast<unsigned char*>(bytes.data()), bytes.size(),
                                          plain.data(), count, stride));
  return bytes;
}

std::string triangles(const std::vector<unsigned>& indices) {
  std::string bytes(meshopt_encodeIndexBufferBound(indices.size(), indices.size()), '\0');
  bytes.resize(meshopt_encodeIndexBuffer(reinterpret_cast<unsigned char*>(bytes.data()), bytes.size(),
                                         indices.data(), indices.size()));
  return bytes;
}

std::string sequence(const std::vector<unsigned>& indices) {
  std::string bytes(meshopt_encodeIndexSequenceBound(indices.size(), 1000), '\0');
  bytes.resize(meshopt_encodeIndexSequence(reinterpret_cast<unsigned char*>(bytes.data()), bytes.size(),
                                           indices.data(), indices.size()));
  return bytes;
}

/// A document of compressed views over one binary chunk, and a placeholder for their decoded bytes.
struct Compressed {
  Json json = Json::parse(R"({"asset":{"version":"2.0"},"extensionsUsed":["EXT_meshopt_compression"],
    "extensionsRequired":["EXT_meshopt_compression"],"bufferViews":[],
    "buffers":[{"byteLength":0},
               {"byteLength":0,"extensions":{"EXT_meshopt_compression":{"fallback":true}}}]})");
  std::string bytes;

  Json& add(const std::string& stream, const char* mode, std::size_t count, std::size_t stride) {
    Json& fallback = json["buffers"][1]["byteLength"];
    Json view{{"buffer", 1}, {"byteOffset", fallback}, {"byteLength", count * stride}};
    fallback = fallback.get<std::size_t>() + count * stride;
    view["extensions"]["EXT_meshopt_compression"] = {
        {"buffer", 0},    {"byteOffset", bytes.size()}, {"byteLength", stream.size()}, {"mode", mode},
        {"count", count}, {"byteStride", stride}};
    bytes += stream;
    json["buffers"][0]["byteLength"] = bytes.size();
    json["bufferViews"].push_back(std::move(view));
    return json["bufferViews"].back()["extensions"]["EXT_meshopt_compression"];
  }

  std::string file() const { return glb(json.dump(), bytes); }

  Result<GltfDocument> load() const {
    const std::string all = file();
    return load_gltf({reinterpret_cast<const std::uint8_t*>(all.data()), all.size()}, "case.glb");
  }
};

template <class T>
std::vector<T> values_of(const GltfDocument& document, int view) {
  GltfReader reader(document);
  const auto bytes = reader.view_bytes(view, "");
  std::vector<T> values(bytes.size() / sizeof(T));
  std::memcpy(values.data(), bytes.data(), bytes.size());
  return values;
}

/// A square whose positions and indices are compressed.
Compressed square() {
  Compressed file;
  file.add(attributes(bytes_of<float>({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}), 12), "ATTRIBUTES", 4, 12);
  file.add(triangles({0, 1, 2, 0, 2, 3}), "TRIANGLES", 6, 2);
  file.json["accessors"] = Json::parse(R"([
    {"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
    {"bufferView":1,"componentType":5123,"count":6,"type":"SCALAR"}])");
  file.json["meshes"] = Json::parse(R"([{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}])");
  file.json["nodes"] = Json::parse(R"([{"mesh":0}])");
  file.json["scenes"] = Json::parse(R"([{"nodes":[0]}])");
  return file;
}

}  // namespace

TEST_CASE("meshopt: a compressed square is the square, and nothing of the compression is left") {
  const GltfDocument document = test::need(square().load());
  CHECK(document.json.dump().find("meshopt") == std::string::npos);
  const Scene scene = test::need(read_scene(document));
  REQUIRE(scene.primitives.size() == 1);
  const ScenePrimitive& flat = scene.primitives[0];  // without normals: each corner a vertex of its own
  CHECK(flat.positions ==
        std::vector<V3f>{V3f(0, 0, 0), V3f(1, 0, 0), V3f(1, 1, 0), V3f(0, 0, 0), V3f(1, 1, 0), V3f(0, 1, 0)});
}

TEST_CASE("meshopt: index sequences of 16 and 32 bits come back in their order") {
  const std::vector<unsigned> indices{5, 4, 3, 70, 2, 1, 0, 4, 4};
  for (const std::size_t stride : {2, 4}) {
    Compressed file;
    file.add(sequence(indices), "INDICES", indices.size(), stride);
    const GltfDocument document = test::need(file.load());
    std::vector<unsigned> read;
    if (stride == 4) read = values_of<unsigned>(document, 0);
    if (stride == 2) {
      const auto shorts = values_of<std::uint16_t>(document, 0);
      read.assign(shorts.begin(), shorts.end());
    }
    CHECK(read == indices);
  }
}

TEST_CASE("meshopt: octahedral vectors and quaternions come back within their bits") {
  const float third = std::sqrt(1 / 3.0F);
  const std::vector<V4f> vectors{{0, 0, 1, -1}, {1, 0, 0, -1}, {0, 0, -1, -1}, {-third, third, -third, -1}};
  const std::vector<V4f> turns{{0, 0, 0, 1}, {0.5F, 0.5F, 0.5F, 0.5F}, {-0.6F, 0, 0.8F, 0}};
  std::string octahedral(4 * vectors.size(), '\0');
  meshopt_encodeFilterOct(octahedral.data(), vectors.size(), 4, 8, &vectors[0].x);
  std::string quaternions(8 * turns.size(), '\0');
  meshopt_encodeFilterQuat(quaternions.data(), turns.size(), 8, 12, &turns[0].x);
  Compressed file;
  file.add(attributes(octahedral, 4), "ATTRIBUTES", vectors.size(), 4)["filter"] = "OCTAHEDRAL";
  file.add(attributes(quaternions, 8), "ATTRIBUTES", turns.size(), 8)["filter"] = "QUATERNION";
  const GltfDocument document = test::need(file.load());
  const auto first = values_of<std::int8_t>(document, 0);
  REQUIRE(first.size() == 4 * vectors.size());
  for (std::size_t i = 0; i < first.size(); ++i)
    CHECK(std::abs(first[i] / 127.0F - vectors[i / 4][static_cast<int>(i % 4)]) < 0.02F);
  const auto second = values_of<std::int16_t>(document, 1);
  for (std::size_t i = 0; i < turns.size(); ++i) {
    double same = 0;  // cosine of half the angle between the two turns
    for (int c = 0; c < 4; ++c) same += turns[i][c] * second[4 * i + static_cast<std::size_t>(c)] / 32767.0;
    CHECK(std::abs(same) == doctest::Approx(1).epsilon(1e-3));
  }
}

TEST_CASE("meshopt: exponents and mantissas come back as floats") {
  // 8 bits of exponent above 24 bits of mantissa, both signed: mantissa * 2^exponent.
  const auto code = [](int exponent, int mantissa) {
    return static_cast<std::int32_t>((static_cast<std::uint32_t>(exponent) << 24U) |
                                     (static_cast<std::uint32_t>(mantissa) & 0xffffffU));
  };
  const std::string plain =
      bytes_of<std::int32_t>({code(0, 1), code(-1, 3), code(4, -5), code(-20, 1 << 20)});
  Compressed file;
  file.add(attributes(plain, 4), "ATTRIBUTES", 4, 4)["filter"] = "EXPONENTIAL";
  const GltfDocument document = test::need(file.load());
  CHECK(values_of<float>(document, 0) == std::vector<float>{1, 1.5F, -80, 1});
}

TEST_CASE("meshopt: broken rules are named at the view") {
  struct Case {
    const char* what;
    int view;
    const char* key;
    Json value;
    Code code;
  };
  const std::vector<Case> cases{
      {"an unknown mode", 0, "mode", "POINTS", Code::gltf_malformed},
      {"an unknown filter", 0, "filter", "COLOR", Code::gltf_unsupported},
      {"a filter on indices", 1, "filter", "OCTAHEDRAL", Code::gltf_malformed},
      {"a filter whose stride is another", 0, "filter", "QUATERNION", Code::gltf_malformed},
      {"no elements", 0, "count", 0, Code::gltf_malformed},
      {"a count that is not the view's", 0, "count", 5, Code::gltf_malformed},
      {"triangles of two corners", 1, "count", 5, Code::gltf_malformed},
      {"a stride that is no multiple of 4", 0, "byteStride", 6, Code::gltf_malformed},
      {"indices of three bytes", 1, "byteStride", 3, Code::gltf_malformed},
      {"a buffer that is not there", 0, "buffer", 7, Code::gltf_accessor},
      {"bytes beyond the buffer", 0, "byteLength", 100000, Code::gltf_accessor},
      {"a stream cut short", 1, "byteLength", 10, Code::file_damaged},
  };
  for (const Case& one : cases) {
    CAPTURE(one.what);
    Compressed file = square();
    file.json["bufferViews"][one.view]["extensions"]["EXT_meshopt_compression"][one.key] = one.value;
    const Error error = test::error_of(file.load());
    CHECK(error.code == one.code);
    CHECK(error.place == "/bufferViews/" + std::to_string(one.view) + "/extensions/EXT_meshopt_compression");
  }
}

TEST_CASE("meshopt: a stream cannot ask for more than it could hold") {
  Compressed file;
  file.add(attributes(std::string(64, '\1'), 4), "ATTRIBUTES", 1 << 20, 4);
  CHECK(test::error_of(file.load()).code == Code::file_damaged);

  Compressed shared;  // many views of the same bytes
  const std::string zeros(1 << 16, '\0');
  const std::string stream = attributes(zeros, 4);
  for (int i = 0; i < 100; ++i) shared.add(stream, "ATTRIBUTES", zeros.size() / 4, 4);
  shared.bytes = stream;
  shared.json["buffers"][0]["byteLength"] = stream.size();
  for (Json& view : shared.json["bufferViews"])
    view["extensions"]["EXT_meshopt_compression"]["byteOffset"] = 0;
  CHECK(test::error_of(shared.load()).code == Code::file_too_large);
}

TEST_CASE("meshopt: a newer bitstream is named, unless the plain bytes are there") {
  Compressed file = square();
  file.bytes[0] = '\xa1';
  const Error error = test::error_of(file.load());
  CHECK(error.code == Code::gltf_unsupported);
  CHECK(error.place == "/bufferViews/0/extensions/EXT_meshopt_compression");

  file.json["buffers"][1]["uri"] = "data:application/octet-stream;base64," + std::string(80, 'A');
  const GltfDocument plain = test::need(file.load());
  CHECK(values_of<float>(plain, 0) == std::vector<float>(12, 0.0F));
}
