#include "format/gltf/draco_stream.h"

#include <draco/compression/decode.h>
#include <draco/compression/expert_encode.h>

#include <array>
#include <cstring>
#include <exception>

namespace selvedge {
namespace {

using Attribute = draco::PointAttribute;

template <class T>
bool copy_values(const draco::Mesh& mesh, const Attribute& attribute, std::uint8_t* out) {
  const std::size_t components = static_cast<std::size_t>(attribute.num_components());
  std::vector<T> value(components);
  for (std::uint32_t p = 0; p < mesh.num_points(); ++p) {
    if (!attribute.ConvertValue<T>(attribute.mapped_index(draco::PointIndex(p)),
                                   static_cast<std::int8_t>(components), value.data()))
      return false;
    std::memcpy(out + p * components * sizeof(T), value.data(), components * sizeof(T));
  }
  return true;
}

draco::GeometryAttribute::Type type_of(const std::string& semantic) {
  if (semantic == "POSITION") return draco::GeometryAttribute::POSITION;
  if (semantic == "NORMAL") return draco::GeometryAttribute::NORMAL;
  if (semantic.starts_with("COLOR_")) return draco::GeometryAttribute::COLOR;
  if (semantic.starts_with("TEXCOORD_")) return draco::GeometryAttribute::TEX_COORD;
  return draco::GeometryAttribute::GENERIC;
}

int add(draco::Mesh& mesh, const DracoAttribute& attribute) {
  constexpr std::array<draco::DataType, 7> types{draco::DT_INT8,   draco::DT_UINT8,   draco::DT_INT16,
                                                 draco::DT_UINT16, draco::DT_INVALID, draco::DT_UINT32,
                                                 draco::DT_FLOAT32};
  const AccessorShape& shape = attribute.shape;
  const std::size_t size = shape.element_size();
  draco::GeometryAttribute description;
  description.Init(type_of(attribute.semantic), nullptr, static_cast<std::int8_t>(shape.components),
                   types.at(shape.component_type - 5120), shape.normalized, static_cast<std::int64_t>(size),
                   0);
  const int id = mesh.AddAttribute(description, true, static_cast<std::uint32_t>(shape.count));
  for (std::size_t i = 0; i < shape.count; ++i)
    mesh.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(static_cast<std::uint32_t>(i)),
                                          attribute.elements.data() + i * size);
  return id;
}

}  // namespace

struct DracoMesh::Decoded {
  std::unique_ptr<draco::Mesh> mesh;
  const Attribute* attribute(int id) const {
    return id < 0 ? nullptr : mesh->GetAttributeByUniqueId(static_cast<std::uint32_t>(id));
  }
};

Result<DracoMesh> DracoMesh::decode(std::span<const std::uint8_t> bytes) {
  try {
    draco::DecoderBuffer buffer;
    buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    auto mesh = draco::Decoder().DecodeMeshFromBuffer(&buffer);
    if (!mesh.ok()) return fail(Code::file_damaged, "", "", mesh.status().error_msg_string());
    DracoMesh decoded;
    decoded.points_ = mesh.value()->num_points();
    decoded.indices_.reserve(std::size_t{mesh.value()->num_faces()} * 3);
    for (std::uint32_t f = 0; f < mesh.value()->num_faces(); ++f)
      for (const draco::PointIndex& point : mesh.value()->face(draco::FaceIndex(f)))
        decoded.indices_.push_back(point.value());
    decoded.decoded_ = std::make_shared<Decoded>(Decoded{std::move(mesh).value()});
    return decoded;
  } catch (const std::exception& error) {
    return fail(Code::file_damaged, "", "", error.what());
  }
}

int DracoMesh::components(int id) const {
  const Attribute* const attribute = decoded_->attribute(id);
  return attribute == nullptr || attribute->data_type() == draco::DT_BOOL ? 0 : attribute->num_components();
}

std::optional<Bytes> DracoMesh::values(int id, int component_type) const {
  constexpr std::array<bool (*)(const draco::Mesh&, const Attribute&, std::uint8_t*), 7> copies{
      copy_values<std::int8_t>,   copy_values<std::uint8_t>, copy_values<std::int16_t>,
      copy_values<std::uint16_t>, copy_values<float>,        copy_values<std::uint32_t>,
      copy_values<float>};
  const Attribute& attribute = *decoded_->attribute(id);
  Bytes elements(points_ * static_cast<std::size_t>(attribute.num_components()) *
                 component_size(component_type));
  if (!copies.at(component_type - 5120)(*decoded_->mesh, attribute, elements.data())) return std::nullopt;
  return elements;
}

std::optional<Bytes> encode_draco(const std::vector<DracoAttribute>& attributes,
                                  const std::vector<std::uint32_t>& triangles, bool is_ordered) {
  draco::Mesh mesh;
  mesh.set_num_points(static_cast<std::uint32_t>(attributes.front().shape.count));
  for (const DracoAttribute& attribute : attributes) add(mesh, attribute);
  for (std::size_t t = 0; t + 2 < triangles.size(); t += 3)
    mesh.AddFace({draco::PointIndex(triangles[t]), draco::PointIndex(triangles[t + 1]),
                  draco::PointIndex(triangles[t + 2])});
  if (!is_ordered) {
    mesh.DeduplicateAttributeValues();
    mesh.DeduplicatePointIds();
  }
  draco::ExpertEncoder encoder(mesh);
  encoder.SetEncodingMethod(is_ordered ? draco::MESH_SEQUENTIAL_ENCODING : draco::MESH_EDGEBREAKER_ENCODING);
  for (std::size_t i = 0; i < attributes.size(); ++i)
    if (attributes[i].bits > 0) encoder.SetAttributeQuantization(static_cast<int>(i), attributes[i].bits);
  draco::EncoderBuffer buffer;
  if (!encoder.EncodeToBuffer(&buffer).ok()) return std::nullopt;
  return Bytes(buffer.data(), buffer.data() + buffer.size());
}

}  // namespace selvedge
