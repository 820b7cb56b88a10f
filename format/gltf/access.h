// Reading a glTF document's JSON and binary data, with every index, offset and length checked.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "format/gltf/document.h"

namespace selvedge {

/// A member of an object, or JSON null where there is none (also where `object` is not an object).
const Json& member(const Json& object, const char* key);

/// An array member; an empty array where there is none, or something else.
const Json& array_of(const Json& object, const char* key);

/// A string, or "".
std::string string_of(const Json& value);

/// A non-negative integer that fits into an int, or -1.
int index_of(const Json& value);

/// A whole number from 0 to 2^40 (24.0 is one too), or nothing.
std::optional<std::size_t> size_of(const Json& value);

/// A finite number, or `otherwise`.
double number_of(const Json& value, double otherwise);

/// The entry `index` of the root array `array` ("nodes", "meshes", ...), which has to be an object.
Result<const Json*> entry_of(const GltfDocument& document, const char* array, int index,
                             const std::string& place);

/// Checks a buffer view against the declared size of its buffer, and gives back its entry.
Result<const Json*> view_of(const GltfDocument& document, int view, const std::string& place);

/// Bytes of a buffer view.
Result<std::span<const std::uint8_t>> bytes_of_view(const GltfDocument& document, int view,
                                                    const std::string& place);

/// Size in bytes of one component; 0 for an unknown type.
std::size_t component_size(int component_type);

struct AccessorShape {
  std::size_t count = 0;
  int components = 1;         ///< SCALAR 1, VEC2 2 ... MAT4 16
  int component_type = 5126;  ///< as in glTF: 5120 byte ... 5126 float
  bool normalized = false;

  std::size_t element_size() const {
    return component_size(component_type) * static_cast<std::size_t>(components);
  }
};

Result<AccessorShape> shape_of(const GltfDocument& document, int accessor, const std::string& place);

/// How many vertices or elements a document may make up that no bytes of its own stand behind (shared views,
/// accessors without one): a million, and 32 for every byte of its buffers.
std::size_t unbacked_elements(const GltfDocument& document);

/// Elements without gaps, in the component type of the accessor, sparse values applied: what has to be copied
/// when vertices are duplicated. Nothing is allocated before elements and replacements are known to lie
/// within their views; an accessor without a view has at most `unbacked_elements`.
Result<std::vector<std::uint8_t>> read_elements(const GltfDocument& document, int accessor,
                                                const std::string& place);

/// All elements as numbers, `shape_of().components` each: sparse values applied, normalised integers mapped
/// as glTF 2.0 section 3.11 says, plain integers as they are. Vectors, and 4 x 4 matrices of floats.
Result<std::vector<double>> read_numbers(const GltfDocument& document, int accessor,
                                         const std::string& place);

/// The elements of an attribute as vectors, as many numbers each as V has; MESH_NOT_FINITE for NaN and
/// infinities. `count`: how many there have to be, 0: any number.
template <class V>
Result<std::vector<V>> read_vectors(const GltfDocument& document, int accessor, std::size_t count,
                                    const std::string& place) {
  const Result<AccessorShape> shape = shape_of(document, accessor, place);
  if (!shape) return tl::unexpected<Error>(shape.error());
  constexpr std::size_t components = V::dimensions();
  if (static_cast<std::size_t>(shape->components) != components || (count > 0 && shape->count != count)) {
    return fail(Code::gltf_malformed, document.file, place,
                std::to_string(shape->count) + " elements of " + std::to_string(shape->components) +
                    " numbers do not belong here");
  }
  const Result<std::vector<double>> numbers = read_numbers(document, accessor, place);
  if (!numbers) return tl::unexpected<Error>(numbers.error());
  std::vector<V> vectors(shape->count);
  for (std::size_t i = 0; i < vectors.size(); ++i) {
    for (std::size_t c = 0; c < components; ++c) {
      const double value = (*numbers)[i * components + c];
      if (!std::isfinite(value)) {
        return fail(Code::mesh_not_finite, document.file, place,
                    "element " + std::to_string(i) + " is not finite");
      }
      vectors[i][static_cast<int>(c)] = static_cast<typename V::BaseType>(value);
    }
  }
  return vectors;
}

/// All elements of an unsigned integer SCALAR accessor.
Result<std::vector<std::uint32_t>> read_indices(const GltfDocument& document, int accessor,
                                                const std::string& place);

/// Gapless elements as floats, one per component.
std::vector<float> to_floats(std::span<const std::uint8_t> elements, int component_type, bool normalized);

}  // namespace selvedge
