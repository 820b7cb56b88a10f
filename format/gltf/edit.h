// Adding data to a glTF document: buffer views, accessors, names of extensions.
#pragma once

#include <span>

#include "format/gltf/access.h"

namespace selvedge {

/// Appends an entry, such as a texture, and returns its index.
int append(Json& array, Json entry);

/// Appends bytes to the document's last buffer (a new one if it has no buffers), 4-aligned, and returns the
/// index of the new view.
/// `target`: 34962 vertices, 34963 indices, 0 neither; `stride`: 0 without one.
int append_view(GltfDocument& document, std::span<const std::uint8_t> bytes, int target = 0, int stride = 0);

/// Appends a vertex attribute from gapless elements; rows are padded to 4 bytes where glTF asks for it.
/// Returns the index of the view; the caller makes the accessor.
int append_attribute_view(GltfDocument& document, const AccessorShape& shape,
                          std::span<const std::uint8_t> elements);

/// Appends a new accessor over new data. `bounds` writes min and max, which POSITION needs; floats only.
int append_float_accessor(GltfDocument& document, std::span<const float> values, int components, bool bounds);
int append_index_accessor(GltfDocument& document, std::span<const std::uint32_t> indices);

/// Removes an attribute from a primitive and its morph targets; the accessors stay.
void drop_attribute(Json& primitive, const char* semantic);

/// Sets "min" and "max" of an accessor by its values.
void set_bounds(Json& accessor, std::span<const float> values, int components);

/// Adds to (or removes from) extensionsUsed; requiring and removing also change extensionsRequired.
void list_extension(Json& root, const char* name);
void require_extension(Json& root, const char* name);
void unlist_extension(Json& root, const char* name);

/// The same for an encoding of geometry that is expanded, and that is in the document again: it remembers
/// whether it was required.
void unlist_encoding(GltfDocument& document, const char* name);
void relist_encoding(GltfDocument& document, const char* name);

/// Where the bytes of a view lie.
BufferPosition view_position(const Json& view);

/// Removes the extension from an object that has it, and "extensions" if it is then empty.
void erase_extension(Json& object, const char* name);

}  // namespace selvedge
