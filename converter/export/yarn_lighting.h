// The light that the surface of yarn reflects, as a normal and a colour of a mesh.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <vector>

#include "format/fabric/directions.h"
#include "format/fabric/yarns.h"

namespace selvedge {

/// The light that points of the yarn reflect, for each light above the cloth.
class Lighting {
 public:
  explicit Lighting(const Yarns& yarns) : yarns_(yarns), lights_(cell_directions(DirectionGrid{10, 10})) {}

  /// The normal whose cosines come nearest to what places about a vertex reflect, each as far as it is seen
  /// from above: what lies at other yarn is not.
  V3f normal_at(std::span<const YarnHit> hits) const {
    std::vector<V3f> reflected(lights_.size(), V3f(0, 0, 0));
    V3f normal(0, 0, 0);
    for (const YarnHit& hit : hits) {
      const Reflection one = reflection_of({&hit, 1});
      for (std::size_t i = 0; i < lights_.size(); ++i) reflected[i] += one.light[i] * one.seen;
      normal += one.point.normal * one.seen;
    }
    normal.normalize();
    constexpr float from_behind = -0.5F;  // there it has the normal of the yarn
    return normal.z < from_behind ? normal : normal_for(reflected, normal);
  }

  struct Shown {
    V3f color{0, 0, 0};  ///< of the picture
    float fraction = 0;  ///< in [0, 1]: 0 where other yarn hides it from above
    float seen = 0;      ///< weight in the mean of what is seen
  };
  /// The mean of some places on a surface with such a normal.
  Shown shown_at(std::span<const YarnHit> hits, const V3f& normal) const {
    constexpr float mostly_seen = 0.02F, min_squares = 0.02F;
    const Reflection one = reflection_of(hits);
    V3f sum(0, 0, 0);
    float squares = 0;
    for (std::size_t i = 0; i < lights_.size(); ++i) {
      const float cosine = std::max(0.0F, normal.dot(lights_[i]));
      sum += one.light[i] * (cosine * lights_[i].z);
      squares += cosine * cosine * lights_[i].z;
    }
    if (!(squares > min_squares * static_cast<float>(lights_.size()))) return {};
    return {sum * (std::numbers::pi_v<float> / squares), std::min(1.0F, one.seen / mostly_seen), one.seen};
  }

 private:
  static constexpr float min_seen = 1e-3F;

  struct Reflection {
    YarnPoint point;
    std::vector<V3f> light;  ///< 1/sr
    float seen = min_seen;   ///< by views about the cloth's normal, as most of a garment is seen
  };

  /// Mean over some places, which other yarn hides as it hides the first; as seen from above.
  Reflection reflection_of(std::span<const YarnHit> hits) const {
    Reflection result{yarns_.point_at(hits.front()), std::vector<V3f>(lights_.size(), V3f(0, 0, 0))};
    const V3f normal = result.point.normal, view(0, 0, 1);
    std::vector<bool> lit;
    for (const V3f& l : lights_) {
      lit.push_back(normal.dot(l) > 0 && !yarns_.is_occluded(hits.front(), result.point, l));
      if (lit.back()) result.seen += normal.dot(l) * std::pow(l.z, 4.0F) / static_cast<float>(lights_.size());
    }
    const float fraction = 1 / static_cast<float>(hits.size());
    for (const YarnHit& hit : hits) {
      YarnPoint point = yarns_.point_at(hit);
      yarns_.perturb_by_strands(point, view);
      const LightTransfer transfer = yarns_.transfer_at(point);
      const float factor = point.brightness * yarns_.lustre_view_factor(point, view) * fraction;
      for (std::size_t i = 0; i < lights_.size(); ++i) {
        result.light[i] += indirect_light(transfer, lights_[i]) * factor;
        if (lit[i]) result.light[i] += yarns_.direct_reflectance(point, lights_[i], view) * fraction;
      }
    }
    return result;
  }

  /// The unit vector whose cosines are nearest to the brightness, by least squares over the lights that it
  /// faces.
  V3f normal_for(const std::vector<V3f>& reflected, V3f normal) const {
    for (int round = 0; round < 4; ++round) {
      Eigen::Matrix3f squares = Eigen::Matrix3f::Identity() * 1e-3F;
      Eigen::Vector3f sum(0, 0, 0);
      for (std::size_t i = 0; i < lights_.size(); ++i) {
        if (round > 0 && !(normal.dot(lights_[i]) > 0)) continue;
        const Eigen::Vector3f l(lights_[i].x, lights_[i].y, lights_[i].z);
        squares += l * l.transpose() * l.z();
        sum += l * (l.z() * (reflected[i].x + reflected[i].y + reflected[i].z));
      }
      const Eigen::Vector3f best = squares.ldlt().solve(sum);
      if (!(best.squaredNorm() > 0)) break;
      normal = V3f(best.x(), best.y(), best.z()).normalized();
    }
    return normal;
  }

  const Yarns& yarns_;
  std::vector<V3f> lights_;
};

}  // namespace selvedge
