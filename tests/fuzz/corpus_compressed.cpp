#include <draco/compression/expert_encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <meshoptimizer.h>

#include <array>
#include <memory>

#include "tests/fuzz/corpus_gltf.h"
#include "tests/fuzz/gltf_builder.h"

namespace selvedge::fuzz {

std::string compressed(bool edgebreaker, int bits, bool company) {
  draco::TriangleSoupMeshBuilder soup;
  soup.Start(2);
  const int position = soup.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  const int normal = soup.AddAttribute(draco::GeometryAttribute::NORMAL, 3, draco::DT_FLOAT32);
  const int uv = soup.AddAttribute(draco::GeometryAttribute::TEX_COORD, 2, draco::DT_FLOAT32);
  int joints = 0;
  int colour = 0;
  if (company) {
    joints = soup.AddAttribute(draco::GeometryAttribute::GENERIC, 4, draco::DT_UINT16);
    colour = soup.AddAttribute(draco::GeometryAttribute::COLOR, 4, draco::DT_UINT8);
  }
  for (std::uint32_t f = 0; f < 2; ++f) {
    const auto corner = [&](const std::vector<float>& values, std::size_t k, std::size_t components) {
      return values.data() + corners[3 * f + k] * components;
    };
    const draco::FaceIndex face(f);
    soup.SetAttributeValuesForFace(position, face, corner(positions, 0, 3), corner(positions, 1, 3),
                                   corner(positions, 2, 3));
    soup.SetAttributeValuesForFace(normal, face, corner(normals, 0, 3), corner(normals, 1, 3),
                                   corner(normals, 2, 3));
    soup.SetAttributeValuesForFace(uv, face, corner(coordinates, 0, 2), corner(coordinates, 1, 2),
                                   corner(coordinates, 2, 2));
    if (company) {
      const std::array<std::uint16_t, 4> joint{0, static_cast<std::uint16_t>(f), 2, 300};
      const std::array<std::uint8_t, 4> red{255, 0, static_cast<std::uint8_t>(f), 255};
      soup.SetAttributeValuesForFace(joints, face, joint.data(), joint.data(), joint.data());
      soup.SetAttributeValuesForFace(colour, face, red.data(), red.data(), red.data());
    }
  }
  const auto mesh = soup.Finalize();
  if (company) {
    auto metadata = std::make_unique<draco::GeometryMetadata>();
    metadata->AddEntryString("made by", "us");
    mesh->AddMetadata(std::move(metadata));
    auto of_joints = std::make_unique<draco::AttributeMetadata>();
    of_joints->AddEntryInt("joints", 4);
    mesh->AddAttributeMetadata(joints, std::move(of_joints));
  }
  draco::ExpertEncoder encoder(*mesh);
  encoder.SetEncodingMethod(edgebreaker ? draco::MESH_EDGEBREAKER_ENCODING : draco::MESH_SEQUENTIAL_ENCODING);
  encoder.SetSpeedOptions(edgebreaker ? 0 : 5, 5);
  for (const int id : {position, normal, uv}) {
    if (bits > 0) encoder.SetAttributeQuantization(id, bits);
  }
  draco::EncoderBuffer buffer;
  if (!encoder.EncodeToBuffer(&buffer).ok()) return {};

  Builder b;
  const int view = b.view({buffer.data(), buffer.size()});
  const int a = b.position(-1, mesh->num_points());
  const int n = b.accessor(-1, 5126, mesh->num_points(), "VEC3");
  const int t = b.accessor(-1, 5126, mesh->num_points(), "VEC2");
  const int i = b.accessor(-1, 5123, 6, "SCALAR");
  const auto id_of = [&](int attribute) { return mesh->attribute(attribute)->unique_id(); };
  b.json["meshes"] = {{{"primitives",
                        {{{"attributes", {{"POSITION", a}, {"NORMAL", n}, {"TEXCOORD_0", t}}},
                          {"indices", i},
                          {"extensions",
                           {{"KHR_draco_mesh_compression",
                             {{"bufferView", view},
                              {"attributes",
                               {{"POSITION", id_of(position)},
                                {"NORMAL", id_of(normal)},
                                {"TEXCOORD_0", id_of(uv)}}}}}}}}}}}};
  if (company) {
    Json& ids = primitive_of(b)["extensions"]["KHR_draco_mesh_compression"]["attributes"];
    ids["JOINTS_0"] = id_of(joints);
    ids["COLOR_0"] = id_of(colour);
    primitive_of(b)["attributes"]["JOINTS_0"] = b.accessor(-1, 5123, mesh->num_points(), "VEC4");
    primitive_of(b)["attributes"]["COLOR_0"] = b.accessor(-1, 5121, mesh->num_points(), "VEC4");
    b.json["accessors"].back()["normalized"] = true;
    const std::vector<float> weights{1, 0, 0, 0};
    std::vector<float> all;
    for (std::uint32_t p = 0; p < mesh->num_points(); ++p)
      all.insert(all.end(), weights.begin(), weights.end());
    primitive_of(b)["attributes"]["WEIGHTS_0"] =
        b.accessor(b.view(bytes_of(all)), 5126, mesh->num_points(), "VEC4");
  }
  b.json["extensionsUsed"] = {"KHR_draco_mesh_compression"};
  b.json["extensionsRequired"] = {"KHR_draco_mesh_compression"};
  return b.as_glb();
}

std::string meshopt() {
  Builder b;
  std::size_t plain = 0;
  const auto view = [&](const std::vector<unsigned char>& stream, const char* mode, std::size_t count,
                        std::size_t stride, const char* filter = "NONE") {
    const int number = b.view({stream.begin(), stream.end()});
    Json& json = b.json["bufferViews"].back();
    Json extension{{"buffer", 0},
                   {"byteOffset", json["byteOffset"]},
                   {"byteLength", stream.size()},
                   {"byteStride", stride},
                   {"mode", mode},
                   {"count", count},
                   {"filter", filter}};
    json = {{"buffer", 1}, {"byteOffset", plain}, {"byteLength", count * stride}};
    json["extensions"]["EXT_meshopt_compression"] = std::move(extension);
    plain += count * stride;
    return number;
  };
  const auto attributes = [](const void* values, std::size_t count, std::size_t stride) {
    std::vector<unsigned char> stream(meshopt_encodeVertexBufferBound(count, stride));
    stream.resize(meshopt_encodeVertexBuffer(stream.data(), stream.size(), values, count, stride));
    return stream;
  };
  const std::vector<unsigned> indices(corners.begin(), corners.end());
  std::vector<unsigned char> list(meshopt_encodeIndexBufferBound(6, 4));
  list.resize(meshopt_encodeIndexBuffer(list.data(), list.size(), indices.data(), 6));
  std::vector<unsigned char> sequence(meshopt_encodeIndexSequenceBound(6, 4));
  sequence.resize(meshopt_encodeIndexSequence(sequence.data(), sequence.size(), indices.data(), 6));
  const std::vector<std::int8_t> octahedra{0, 0, 127, 0, 0, 0, 127, 0, 0, 0, 127, 0, 0, 0, 127, 0};
  const std::vector<std::int32_t> powers{0, 1 << 24 | 1, 0, 0, 3, 3, 0, 5};
  const std::vector<std::int16_t> turns{0, 0, 0, 2047, 0, 0, 0, 2047, 0, 0, 0, 2047, 0, 0, 0, 2047};

  const int position = b.position(view(attributes(positions.data(), 4, 12), "ATTRIBUTES", 4, 12), 4);
  const int normal =
      b.accessor(view(attributes(octahedra.data(), 4, 4), "ATTRIBUTES", 4, 4, "OCTAHEDRAL"), 5120, 4, "VEC3");
  b.json["accessors"].back()["normalized"] = true;
  b.json["bufferViews"].back()["byteStride"] = 4;
  const int uv =
      b.accessor(view(attributes(powers.data(), 4, 8), "ATTRIBUTES", 4, 8, "EXPONENTIAL"), 5126, 4, "VEC2");
  view(attributes(turns.data(), 4, 8), "ATTRIBUTES", 4, 8, "QUATERNION");
  const int triangles = b.accessor(view(list, "TRIANGLES", 6, 2), 5123, 6, "SCALAR");
  const int plain_order = b.accessor(view(sequence, "INDICES", 6, 4), 5125, 6, "SCALAR");
  const Json vertices{{"POSITION", position}, {"NORMAL", normal}, {"TEXCOORD_0", uv}};
  b.json["meshes"] = {{{"primitives",
                        {{{"attributes", vertices}, {"indices", triangles}},
                         {{"attributes", vertices}, {"indices", plain_order}}}}}};
  b.json["extensionsUsed"] = {"EXT_meshopt_compression", "KHR_mesh_quantization"};
  b.json["extensionsRequired"] = {"EXT_meshopt_compression", "KHR_mesh_quantization"};
  b.json["buffers"] = {
      {{"byteLength", b.binary.size()}},
      {{"byteLength", plain}, {"extensions", {{"EXT_meshopt_compression", {{"fallback", true}}}}}}};
  return glb(b.json.dump(), b.binary);
}

}  // namespace selvedge::fuzz
