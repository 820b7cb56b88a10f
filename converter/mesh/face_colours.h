// The colours of faces, which OpenMesh does not give: those of OBJ, OFF and binary STL files. PLY:
// mesh_ply.h.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "converter/mesh/openmesh.h"

namespace selvedge {

/// Plain lines: no byte order mark, no comments, continued lines joined (the line numbers stay: joined lines
/// leave empty ones behind), every kind of line end as \n.
std::string plain_obj(std::string_view text);

/// The names of the material files that an OBJ text refers to.
std::vector<std::string> material_files(const std::string& bytes);

/// Adds the diffuse colours (Kd) of a material file's text, as they stand.
void read_materials(const std::string& text, MaterialColours& colours);

/// The colour of each face of a plain OBJ text by the material in use, (-1, -1, -1) where it has none; empty
/// where no face has one.
std::vector<V3f> obj_face_colours(const std::string& plain, const MaterialColours& materials);

/// An OFF text whose faces have no colours, which OpenMesh takes for more faces; the colours apart. The text
/// as it was where its faces have none or do not stand on lines of their own.
std::string off_without_face_colours(const std::string& text, RawMesh& colours);

/// The colours of a binary STL's triangles in their two spare bytes: 5 bits each. In Magics' files ("COLOR="
/// in the header) red comes first and the top bit says that there is none; in others (VisCAM, SolidView) blue
/// comes first and the bit says that there is one. Without those of triangles that OpenMesh leaves out; empty
/// where no triangle has one. Precondition: the file holds its header.
std::vector<V3f> stl_face_colours(const std::string& bytes);

}  // namespace selvedge
