#include "converter/light/yarn_brdf.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "converter/light/path_tracer.h"
#include "converter/mesh/wall_albedo.h"
#include "format/fabric/directions.h"
#include "format/fabric/light_sampler.h"
#include "format/fabric/yarn_strands.h"

namespace selvedge {
namespace {

/// Place of a point, from the corners that lie on the same yarn as the nearest corner.
YarnPlace place_at(const CellMesh& mesh, const SurfacePoint& point) {
  const V3i& corner = mesh.triangles[point.triangle];
  const std::array<float, 3> weight{1 - point.u - point.v, point.u, point.v};
  const auto nearest = std::ranges::max_element(weight) - weight.begin();
  YarnPlace place = mesh.yarn_places[corner[static_cast<int>(nearest)]];
  if (place.curve < 0) return place;
  const YarnPlies& plies = mesh.yarns.curves[place.curve].plies;
  const auto ply_after = [&](int chains) {
    const int ply = (place.ply + chains * plies.shift) % plies.count;
    return ply < 0 ? ply + plies.count : ply;
  };
  const YarnPlace origin = place;
  float sum = 0;
  float along = 0;
  float around = 0;
  for (int i = 0; i < 3; ++i) {
    const YarnPlace& other = mesh.yarn_places[corner[i]];
    // Corners may lie on either side of where the yarn, or a turn about it, begins again.
    const float ahead = other.chain_fraction - origin.chain_fraction;
    if (other.curve != origin.curve || other.ply != ply_after(static_cast<int>(-std::round(ahead)))) continue;
    const float turned = other.angle_turns - origin.angle_turns;
    sum += weight[i];
    along += weight[i] * (ahead - std::round(ahead));
    around += weight[i] * (turned - std::round(turned));
  }
  place.chain_fraction += along / sum;
  place.angle_turns += around / sum;
  place.ply = ply_after(static_cast<int>(std::floor(place.chain_fraction)));
  return place;
}

using std::numbers::pi;

double width_of(const Gloss& gloss) {
  return std::max(min_gloss_width, static_cast<double>(gloss.roughness));
}

/// A direction in the frame (fibre, across, normal).
V3d local(const YarnBrdf& s, const V3d& d) {
  return {d.dot(s.fibre_direction), d.dot(s.normal.cross(s.fibre_direction)), d.dot(s.normal)};
}

/// A sampled light for a view in the local frame, and the fraction of it that is neither masked nor shadowed.
double reflect_at_facet(const V3d& v, double r, const V2d& random, V3d& l) {
  const V3d h = sample_visible_normal(v, r, random);
  l = h * (2 * v.dot(h)) - v;
  if (l.z <= 0) return 0;
  const double seen = smith_lambda(v, r);
  return (1 + seen) / (1 + seen + smith_lambda(l, r));
}

double body_of(const YarnBrdf& surface, const V3d& light, const V3d& view) {
  return body_reflectance(light.dot(surface.fibre_direction), view.dot(surface.fibre_direction),
                          static_cast<double>(surface.gloss.lustre));
}

/// A direction, and the body's reflectance times pi over the density of a cosine there. The body is the sine
/// of the angle to the fibre times a difference of two Poisson kernels of it; their sum is drawn (wrapped
/// Cauchy).
BsdfSample sample_body(const YarnBrdf& surface, const V3d& view, const V2d& random) {
  const auto s = static_cast<double>(surface.gloss.lustre);
  if (s < 0.05) {
    const V3d direction = cosine_direction(surface.normal, random);
    return {direction, V3d(body_of(surface, direction, view) * pi)};
  }
  const double mirror = std::acos(std::clamp(-view.dot(surface.fibre_direction), -1.0, 1.0));
  const double drawn = mirror + 2 * std::atan((1 - s) / (1 + s) * std::tan(pi * (random.x - 0.5)));
  const double x = std::cos(drawn);
  const double across = std::sqrt(1 - x * x);
  const double sine = 2 * random.y - 1;
  const V3d direction =
      (surface.fibre_direction * x + surface.normal.cross(surface.fibre_direction) * (across * sine) +
       surface.normal * (across * std::sqrt(std::max(0.0, 1 - sine * sine))))
          .normalized();
  const auto kernel = [&](double angle) {
    return (1 - s * s) / (2 * pi * (1 - 2 * s * std::cos(angle) + s * s));
  };
  const double density = kernel(drawn - mirror) + kernel(drawn + mirror);
  return {direction, V3d(body_of(surface, direction, view) * 2 * across * across / density)};
}

/// Turns the normal and the fibre (in its plane, or `fibre`) of a surface to the met strand, and changes its
/// albedo or brightness. The normal stays on the ray's side. Of a hair only the albedo changes. Surfaces
/// beside yarns, and points that no ray met, stay.
void add_strand(const CellMesh& mesh, const SurfacePoint& point, const V3d& fibre, YarnBrdf& surface) {
  if (mesh.yarn_places.empty() || point.view == V3f(0, 0, 0)) return;
  const YarnPlace place = place_at(mesh, point);
  if (place.curve < 0) return;
  const YarnCurve& curve = mesh.yarns.curves[place.curve];
  YarnStrands strands = curve.strands;
  if (point.hair_point >= 0) strands.count = 0;
  const auto change =
      strand_perturbation(strands, static_cast<double>(place.angle_turns),
                          static_cast<double>(place.chain_fraction), ply_strand_rows(curve, place.ply));
  // Strands lie on the outside of a translucent wall; its colour belongs to both sides.
  const bool inside = point.is_back && !mesh.transmission.empty();
  if (strands.count > 0 && !inside) {
    // Faces are flat, and fibres are known at their corners: the normal gives way.
    const V3d upright = surface.normal - fibre * fibre.dot(surface.normal);
    if (fibre.length2() > 0.5 && upright.length2() > 0.01) {
      surface.normal = upright.normalized();
      surface.fibre_direction = fibre;
    }
    perturb_by_strand(change, V3d(point.view), surface.normal, surface.fibre_direction);
  }
  if (surface.transmission > 0) {
    surface.diffuse_factor = change.brightness;
    return;
  }
  for (int c = 0; c < 3; ++c) surface.albedo[c] = std::clamp(surface.albedo[c] * change.brightness, 0.0, 1.0);
}

/// Whether light from there reaches a viewer through the wall.
bool is_transmitted(const YarnBrdf& surface, const V3d& light) {
  return surface.transmission > 0 && light.dot(surface.inward) > 0;
}

}  // namespace

V3d cosine_direction(const V3d& normal, const V2d& square) {
  const V2d disc = square_to_disc_polar(square);  // and lifted
  const double r = disc.x;
  const double phi = disc.y;
  const V3d side = std::abs(normal.z) < 0.9 ? V3d(0, 0, 1) : V3d(1, 0, 0);
  const V3d t = normal.cross(side).normalized();
  return (t * (r * std::cos(phi)) + normal.cross(t) * (r * std::sin(phi)) +
          normal * std::sqrt(std::max(0.0, 1 - r * r)))
      .normalized();
}

double diffuse_weight(const YarnBrdf& s) {
  const auto w = static_cast<double>(s.gloss.weight);
  return 1 -
         (s.transmission > 0 && w > 0 ? w * mean_gloss_albedo(static_cast<double>(s.gloss.roughness)) : w);
}

YarnBrdf brdf_at(const RayScene& scene, const SurfacePoint& point) {
  YarnBrdf s;
  s.normal = V3d(point.face_normal);
  s.albedo = V3d(scene.albedo(point));
  s.inward = -s.normal;
  const CellMesh& mesh = scene.mesh();
  if (scene.is_translucent() && point.hair_point < 0)
    s.transmission = static_cast<double>(scene.interpolate(mesh.transmission, point));
  const double transmission = s.transmission;
  if (mesh.gloss.empty()) {
    add_strand(mesh, point, s.fibre_direction, s);
    s.albedo = ply_wall_albedo(s.albedo, transmission);
    return s;
  }
  const V3i& corner = mesh.triangles[point.triangle];
  const std::array<float, 3> weight{1 - point.u - point.v, point.u, point.v};
  V3f fibre(0, 0, 0);
  s.gloss = {0, 0};
  for (int i = 0; i < 3; ++i) {
    s.gloss.weight += weight[i] * mesh.gloss[corner[i]].weight;
    s.gloss.roughness += weight[i] * mesh.gloss[corner[i]].roughness;
    s.gloss.lustre += weight[i] * mesh.gloss[corner[i]].lustre;
    // The sign of a fibre has no meaning: corners are flipped to agree.
    const V3f& direction = mesh.fibre_directions[corner[i]];
    fibre += direction * (direction.dot(mesh.fibre_directions[corner.x]) < 0 ? -weight[i] : weight[i]);
  }
  if (point.hair_point >= 0)
    fibre = mesh.hairs.points[point.hair_point + 1] - mesh.hairs.points[point.hair_point];
  V3d in_plane = V3d(fibre) - s.normal * V3d(fibre).dot(s.normal);
  if (in_plane.length2() < 1e-12)
    in_plane = s.normal.cross(std::abs(s.normal.x) < 0.9 ? V3d(1, 0, 0) : V3d(0, 1, 0));
  s.fibre_direction = in_plane.normalized();
  if (s.transmission > 0 && point.is_back) {
    // Inside a ply there is no highlight, and as much goes through as from outside.
    s.transmission *= diffuse_weight(s);
    s.gloss.weight = s.gloss.lustre = 0;
  }
  add_strand(mesh, point, V3d(fibre).normalized(), s);
  s.albedo = ply_wall_albedo(s.albedo, transmission);
  return s;
}

double incidence_cosine(const YarnBrdf& surface, const V3d& light) {
  return std::max(0.0, light.dot(is_transmitted(surface, light) ? surface.inward : surface.normal));
}

V3d reflectance(const YarnBrdf& surface, const V3d& light, const V3d& view) {
  if (is_transmitted(surface, light))
    return surface.albedo * (surface.diffuse_factor * diffuse_weight(surface) * surface.transmission / pi);
  if (light.dot(surface.normal) <= 0 || view.dot(surface.normal) <= 0) return V3d(0, 0, 0);
  const auto& gloss = surface.gloss;
  const V3d body =
      surface.albedo * (surface.diffuse_factor * diffuse_weight(surface) * (1 - surface.transmission));
  const double shine = gloss.weight > 0 ? gloss_reflectance(local(surface, light), local(surface, view),
                                                            static_cast<double>(gloss.roughness))
                                        : 0;
  return body * body_of(surface, light, view) + V3d(static_cast<double>(gloss.weight) * shine);
}

std::optional<BsdfSample> sample_bsdf(const YarnBrdf& surface, const V3d& view, const V2d& random) {
  const double w = static_cast<double>(surface.gloss.weight);
  if (w == 0 || random.x >= w) {
    const double t = surface.transmission;
    const double x = (random.x - w) / (1 - w);
    const V3d weight = t > 0 ? surface.albedo * (surface.diffuse_factor * diffuse_weight(surface) / (1 - w))
                             : surface.albedo;
    if (x < t) return BsdfSample{cosine_direction(surface.inward, {x / t, random.y}), weight};
    BsdfSample sample = sample_body(surface, view, {(x - t) / (1 - t), random.y});
    sample.weight *= weight;
    return sample;
  }
  const V3d v = local(surface, view);
  if (v.z <= 0) return std::nullopt;
  V3d l;
  const double weight = reflect_at_facet(v, width_of(surface.gloss), {random.x / w, random.y}, l);
  if (weight == 0) return std::nullopt;
  const V3d direction = surface.fibre_direction * l.x + surface.normal.cross(surface.fibre_direction) * l.y +
                        surface.normal * l.z;
  return BsdfSample{direction.normalized(), V3d(weight)};
}

V3d direct_light(const RayScene& scene, const SurfacePoint& point, const YarnBrdf& surface, const V3f& light,
                 const V3d& view) {
  const V3d towards(light);
  const bool through = is_transmitted(surface, towards);
  // Closed yarn is lit from outside alone.
  if (surface.transmission > 0 && through != point.is_back) return V3d(0, 0, 0);
  const double cosine = incidence_cosine(surface, towards);
  if (!(cosine > 0)) return V3d(0, 0, 0);
  if (scene.is_occluded(through ? other_side(point) : point, light)) return V3d(0, 0, 0);
  return reflectance(surface, towards, view) * cosine;
}

}  // namespace selvedge
