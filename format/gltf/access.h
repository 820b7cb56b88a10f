// Reading a glTF document's JSON and binary data, with every index, offset and length checked.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "format/gltf/document.h"

namespace selvedge {

/// A member of an object; JSON null if it is absent or `object` is not an object.
const Json& member(const Json& object, const char* key);

/// An array member; an empty array if it is absent or something else.
const Json& array_member(const Json& object, const char* key);

/// A string, or "".
std::string string_of(const Json& value);

/// A non-negative integer that fits into an int, or -1.
int index_of(const Json& value);

/// A whole number from 0 to 2^40 (24.0 is one too), or nothing.
std::optional<std::size_t> whole_number(const Json& value);

/// A finite number, or `otherwise`.
double number_or(const Json& value, double otherwise);

/// The entry `index` of the root array `array` ("nodes", "meshes", ...), or JSON null if it is not an object.
const Json& root_entry(const GltfDocument& document, const char* array, int index);

/// Numbers per element of an accessor: SCALAR 1, VEC2 2 ... MAT4 16; 0 for an unknown type.
int component_count(const Json& accessor);

/// Size in bytes of one component; 0 for an unknown type.
std::size_t component_size(int component_type);

struct AccessorShape {
  std::size_t count = 0;
  int components = 1;
  int component_type = 5126;  ///< as in glTF: 5120 byte ... 5126 float
  bool normalized = false;

  std::size_t element_size() const {
    return component_size(component_type) * static_cast<std::size_t>(components);
  }
};

/// The number of vertices or elements that a document may describe without bytes of its own for each (shared
/// views, accessors without one): a million, and 32 for every byte of its buffers.
std::size_t max_unbacked_elements(const GltfDocument& document);

/// Gapless elements as floats, one per component.
std::vector<float> to_floats(std::span<const std::uint8_t> elements, int component_type, bool normalized);

/// Follows the references of a document. A fault is thrown as a Failure (format/base/guard.h); `place` is the
/// JSON pointer of the reference, for the fault.
class GltfReader {
 public:
  explicit GltfReader(const GltfDocument& read) : document(read) {}

  const GltfDocument& document;

  [[noreturn]] void fail(Code code, std::string place, std::string message) const;

  /// root_entry; GLTF_ACCESSOR for a missing entry.
  const Json& entry(const char* array, int index, const std::string& place);

  /// A buffer view; GLTF_ACCESSOR if it reaches beyond the declared size of its buffer.
  const Json& buffer_view(int index, const std::string& place);

  /// The bytes of a buffer view; GLTF_ACCESSOR if the buffer does not have them.
  std::span<const std::uint8_t> view_bytes(int view, const std::string& place);

  /// GLTF_MALFORMED for a wrong count, type or componentType.
  AccessorShape accessor_shape(int accessor, const std::string& place);

  /// Elements without gaps, in the component type of the accessor, sparse values applied: the form in which
  /// vertices are copied. Nothing is allocated before elements and replacements are known to lie within their
  /// views (else GLTF_ACCESSOR); an accessor without a view has at most `max_unbacked_elements`
  /// (FILE_TOO_LARGE).
  Bytes elements(int accessor, const std::string& place);

  /// All elements as numbers, accessor_shape().components each: sparse values applied, normalised integers
  /// mapped as glTF 2.0 section 3.11 says, plain integers unchanged. Vectors, and 4 x 4 matrices of floats;
  /// GLTF_MALFORMED for other matrices.
  std::vector<double> numbers(int accessor, const std::string& place);

  /// All elements of an unsigned integer SCALAR accessor; GLTF_MALFORMED for other types.
  std::vector<std::uint32_t> indices(int accessor, const std::string& place);

  /// The elements of the accessor that the member `semantic` of `attributes` names, as vectors; empty without
  /// that member. `count`: how many elements are needed, 0: any number. GLTF_MALFORMED for another number of
  /// elements or components, MESH_NOT_FINITE for NaN and infinities. `place` is the pointer of `attributes`.
  template <class V>
  std::vector<V> attribute(const Json& attributes, const char* semantic, std::size_t count,
                           const std::string& place) {
    const Json& accessor = member(attributes, semantic);
    if (accessor.is_null()) return {};
    const std::string where = place + "/" + semantic;
    constexpr std::size_t components = V::dimensions();
    const std::vector<double> values = vector_numbers(index_of(accessor), components, count, where);
    std::vector<V> vectors(values.size() / components);
    for (std::size_t i = 0; i < values.size(); ++i)
      vectors[i / components][static_cast<int>(i % components)] =
          static_cast<typename V::BaseType>(values[i]);
    return vectors;
  }

 private:
  std::vector<double> vector_numbers(int accessor, std::size_t components, std::size_t count,
                                     const std::string& place);
  Bytes gather(const Json& object, std::size_t count, std::size_t size, const std::string& place);
  void apply_sparse(const Json& sparse, const AccessorShape& shape, const std::string& place,
                    Bytes& elements);
};

}  // namespace selvedge
