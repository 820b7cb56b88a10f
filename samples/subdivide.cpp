#include "samples/subdivide.h"

#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Subdivider/Uniform/CatmullClarkT.hh>
#include <algorithm>
#include <exception>

namespace selvedge::samples {
namespace {

struct Traits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
};
using Mesh = OpenMesh::PolyMesh_ArrayKernelT<Traits>;

Result<Mesh> to_mesh(const QuadSurface& surface) {
  Mesh mesh;
  for (const V3d& p : surface.positions) mesh.add_vertex(OpenMesh::Vec3d(p.x, p.y, p.z));
  for (const Quad& quad : surface.quads) {
    std::vector<Mesh::VertexHandle> corners;
    for (const int v : quad) {
      if (v < 0 || v >= static_cast<int>(surface.positions.size())) {
        return fail(Code::mesh_invalid, "", "cage", "a quad names a vertex that does not exist");
      }
      corners.emplace_back(v);
    }
    if (!mesh.add_face(corners).is_valid()) {
      return fail(Code::mesh_invalid, "", "cage", "the quads do not form a two-manifold");
    }
  }
  return mesh;
}

/// One level. OpenMesh appends one vertex per edge and then one per face, in the order of the faces;
/// every new quad holds exactly one of the latter, which names its parent.
Result<QuadSurface> subdivide_once(const QuadSurface& surface) {
  Result<Mesh> mesh = to_mesh(surface);
  if (!mesh) return tl::unexpected(mesh.error());

  OpenMesh::Subdivider::Uniform::CatmullClarkT<Mesh, double> subdivider;
  subdivider.attach(*mesh);
  subdivider(1);
  subdivider.detach();

  QuadSurface fine;
  fine.positions.reserve(mesh->n_vertices());
  for (const auto vertex : mesh->vertices()) {
    const auto& p = mesh->point(vertex);
    fine.positions.emplace_back(p[0], p[1], p[2]);
  }
  const int first_center = static_cast<int>(mesh->n_vertices()) - static_cast<int>(surface.quads.size());
  fine.quads.reserve(mesh->n_faces());
  fine.labels.reserve(mesh->n_faces());
  for (const auto face : mesh->faces()) {
    Quad quad{};
    std::size_t corner = 0;
    for (const auto vertex : mesh->fv_range(face)) quad[corner++] = vertex.idx();
    const int center = *std::max_element(quad.begin(), quad.end());
    fine.quads.push_back(quad);
    fine.labels.push_back(surface.labels[center - first_center]);
  }
  return fine;
}

}  // namespace

Result<QuadSurface> subdivide(const QuadSurface& cage, int levels) {
  try {
    QuadSurface surface = cage;
    for (int level = 0; level < levels; ++level) {
      Result<QuadSurface> fine = subdivide_once(surface);
      if (!fine) return fine;
      surface = std::move(*fine);
    }
    return surface;
  } catch (const std::exception& e) {
    return fail(Code::mesh_invalid, "", "cage", e.what());
  }
}

}  // namespace selvedge::samples
