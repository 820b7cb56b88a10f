#include "samples/subdivide.h"

#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Subdivider/Uniform/CatmullClarkT.hh>
#include <algorithm>

namespace selvedge::samples {
namespace {

struct Traits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
};
using Mesh = OpenMesh::PolyMesh_ArrayKernelT<Traits>;

/// One level. OpenMesh appends one vertex per edge and then one per face, in the order of the faces;
/// every new quad holds exactly one of the latter, which names its parent.
QuadSurface subdivide_once(const QuadSurface& surface) {
  Mesh mesh;
  for (const V3d& p : surface.positions) mesh.add_vertex(OpenMesh::Vec3d(p.x, p.y, p.z));
  for (const Quad& quad : surface.quads) {
    mesh.add_face(std::vector<Mesh::VertexHandle>(quad.begin(), quad.end()));
  }

  OpenMesh::Subdivider::Uniform::CatmullClarkT<Mesh, double> subdivider;
  subdivider.attach(mesh);
  subdivider(1);
  subdivider.detach();

  QuadSurface fine;
  fine.positions.reserve(mesh.n_vertices());
  for (const auto vertex : mesh.vertices()) {
    const auto& p = mesh.point(vertex);
    fine.positions.emplace_back(p[0], p[1], p[2]);
  }
  const int first_center = static_cast<int>(mesh.n_vertices()) - static_cast<int>(surface.quads.size());
  fine.quads.reserve(mesh.n_faces());
  fine.labels.reserve(mesh.n_faces());
  for (const auto face : mesh.faces()) {
    Quad quad{};
    std::size_t corner = 0;
    for (const auto vertex : mesh.fv_range(face)) quad[corner++] = vertex.idx();
    const int center = *std::ranges::max_element(quad);
    fine.quads.push_back(quad);
    fine.labels.push_back(surface.labels[center - first_center]);
  }
  return fine;
}

}  // namespace

QuadSurface subdivide(const QuadSurface& cage, int levels) {
  QuadSurface surface = cage;
  for (int level = 0; level < levels; ++level) surface = subdivide_once(surface);
  return surface;
}

}  // namespace selvedge::samples
