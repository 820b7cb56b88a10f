#include "fitter/budget/level_error.h"

#include <algorithm>

#include "format/base/parallel.h"
#include "format/fabric/evaluate.h"
#include "format/samples/pool.h"

namespace selvedge {
namespace {

/// phi_a(v) psi_b(l) of every product for one pair of directions.
std::vector<V3f> function_values(const Products& products, const DirectionPair& pair, const Fabric& of) {
  const DirectionTaps views = interpolate(of.views, pair.view);
  const DirectionTaps lights = interpolate(of.lights, pair.light);
  std::vector<V3f> result;
  for (const V2i& functions : products.pairs) {
    const std::vector<float>& phi = products.view[functions.x];
    const std::vector<float>& psi = products.light[functions.y];
    float factor = 0;
    V3f colour(0, 0, 0);
    for (std::size_t tap = 0; tap < 4; ++tap) {
      factor += views.weight[tap] * phi[views.cell[tap]];
      const float* of_light = &psi[3 * static_cast<std::size_t>(lights.cell[tap])];
      colour += lights.weight[tap] * V3f(of_light[0], of_light[1], of_light[2]);
    }
    result.push_back(factor * colour);
  }
  return result;
}

/// f of one owner of coefficients.
V3f radiance_of(const Products& products, std::size_t owner, const std::vector<V3f>& values) {
  const float* coefficient = &products.coefficient[owner * values.size()];
  V3f sum(0, 0, 0);
  for (std::size_t m = 0; m < values.size(); ++m) sum += coefficient[m] * values[m];
  for (int c = 0; c < 3; ++c) sum[c] = std::max(sum[c], 0.0F);
  return sum;
}

double mean_of(const std::vector<double>& sums, std::size_t texels) {
  double sum = 0;
  for (const double s : sums) sum += s;
  return sums.empty() ? 0 : sum / (3 * static_cast<double>(texels) * static_cast<double>(sums.size()));
}

}  // namespace

std::vector<LevelTruth> level_truths(const PairSamples& truth) {
  std::vector<LevelTruth> levels(1);
  levels[0].width = truth.width;
  levels[0].height = truth.height;
  const auto texels = static_cast<std::size_t>(truth.width * truth.height);
  for (std::size_t p = 0; p < truth.pairs.size(); ++p) {
    std::vector<V3d> image;
    for (std::size_t i = p * texels; i < (p + 1) * texels; ++i) {
      image.push_back(V3d(truth.radiance[i]) * static_cast<double>(truth.alpha[i]));
    }
    levels[0].pairs.push_back(std::move(image));
  }
  while (levels.back().width > 1 || levels.back().height > 1) {
    LevelTruth coarse;
    coarse.width = level_size(levels.back().width, 1);
    coarse.height = level_size(levels.back().height, 1);
    for (const auto& image : levels.back().pairs) {
      coarse.pairs.push_back(pool_image(image, levels.back().width, levels.back().height));
    }
    levels.push_back(std::move(coarse));
  }
  return levels;
}

template <class Factor, class Seen>
double LevelError::error_of(const Products& products, const Factor& factor, const Seen& seen) const {
  std::vector<double> sums(pairs_.size(), 0);
  parallel_for(0, static_cast<int>(pairs_.size()), [&](int index) {
    const auto p = static_cast<std::size_t>(index);
    const std::vector<V3f> values = function_values(products, pairs_[p], of_);
    std::vector<V3f> radiance;
    for (std::size_t owner = 0; owner < products.owners(); ++owner) {
      radiance.push_back(factor(p, owner) * radiance_of(products, owner, values));
    }
    const std::vector<V3d>& truth = truth_.pairs[p];
    for (std::size_t texel = 0; texel < truth.size(); ++texel) {
      sums[p] += (V3d(seen(radiance, p, texel)) - truth[texel]).length2();
    }
  });
  return mean_of(sums, static_cast<std::size_t>(truth_.width * truth_.height));
}

namespace {

V3f one(std::size_t /*pair*/, std::size_t /*owner*/) { return {1, 1, 1}; }

}  // namespace

template <class Factor>
double LevelError::error_of_slabs(const Products& slabs, const SlabRays& rays, const Factor& factor) const {
  const auto per_texel = static_cast<std::size_t>(rays.rays);
  const float share = 1.0F / static_cast<float>(rays.rays);
  const auto seen = [&](const std::vector<V3f>& radiance, std::size_t pair, std::size_t texel) {
    const std::uint32_t* met = &rays.met[(texel * pairs_.size() + pair) * per_texel];
    V3f sum(0, 0, 0);
    for (std::size_t ray = 0; ray < per_texel; ++ray) {
      if (met[ray] != SlabRays::nothing) sum += share * radiance[met[ray]];
    }
    return sum;
  };
  return error_of(slabs, factor, seen);
}

double LevelError::error(const Products& slabs, const SlabRays& rays) const {
  return error_of_slabs(slabs, rays, one);
}

double LevelError::error(const Products& slabs, const SlabRays& rays, const FabricLevel& gloss) const {
  const auto texels = static_cast<std::size_t>(gloss.texels());
  std::vector<V3f> factors;  // [pair][texel]
  for (const DirectionPair& pair : pairs_) {
    for (int y = 0; y < gloss.height; ++y) {
      for (int x = 0; x < gloss.width; ++x) {
        factors.push_back(evaluate(gloss, of_, x, y, pair.light, pair.view).radiance / of_.radiance_scale);
      }
    }
  }
  const std::size_t entries = slabs.owners() / texels;
  return error_of_slabs(slabs, rays, [&](std::size_t pair, std::size_t owner) {
    return factors[pair * texels + owner / entries];
  });
}

double LevelError::error(const Products& texels, const OpacityLayer& opacity) const {
  const auto views = static_cast<std::size_t>(of_.views.count());
  return error_of(texels, one, [&](const std::vector<V3f>& radiance, std::size_t pair, std::size_t texel) {
    const DirectionTaps taps = interpolate(of_.views, pairs_[pair].view);
    float alpha = 0;
    for (std::size_t tap = 0; tap < 4; ++tap) {
      alpha += taps.weight[tap] * opacity.opacity[texel * views + static_cast<std::size_t>(taps.cell[tap])];
    }
    return alpha * radiance[texel];
  });
}

double LevelError::error(const FabricLevel& level) const {
  std::vector<double> sums(pairs_.size(), 0);
  parallel_for(0, static_cast<int>(pairs_.size()), [&](int index) {
    const auto p = static_cast<std::size_t>(index);
    for (int y = 0; y < level.height; ++y) {
      for (int x = 0; x < level.width; ++x) {
        const Shading s = evaluate(level, of_, x, y, pairs_[p].light, pairs_[p].view);
        const V3d& truth = truth_.pairs[p][y * level.width + x];
        sums[p] += (V3d(s.radiance * s.alpha) - truth).length2();
      }
    }
  });
  return mean_of(sums, static_cast<std::size_t>(level.texels()));
}

}  // namespace selvedge
