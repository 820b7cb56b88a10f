#include "fitter/slabs/shared_basis.h"

#include <Imath/half.h>

#include <algorithm>
#include <cmath>

#include "fitter/solve/principal.h"
#include "format/base/parallel.h"

namespace selvedge {
namespace {

constexpr double light_step = 1.0 / 1024;
constexpr double view_step = 1.0 / 256;

/// Adds weight * x x^T to the lower triangle.
void add_outer(const float* x, std::size_t size, double weight, std::vector<double>& matrix) {
  for (std::size_t i = 0; i < size; ++i) {
    const double scaled = weight * static_cast<double>(x[i]);
    if (scaled == 0) continue;
    double* row = &matrix[i * size];
    for (std::size_t j = 0; j <= i; ++j) row[j] += scaled * static_cast<double>(x[j]);
  }
}

float dot(const float* a, const std::vector<float>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < b.size(); ++i) sum += static_cast<double>(a[i] * b[i]);
  return static_cast<float>(sum);
}

/// Functions as the file will hold them: multiples of a step, a power of two, that half precision has exactly
/// for values up to 2048 steps. So what is judged is what is read, and the file is smaller.
std::vector<std::vector<float>> stored(const std::vector<std::vector<double>>& vectors, double scale,
                                       double step) {
  std::vector<std::vector<float>> result;
  for (const auto& vector : vectors) {
    std::vector<float> out;
    for (const double value : vector)
      out.push_back(static_cast<float>(step * std::round(scale * value / step)));
    result.push_back(std::move(out));
  }
  return result;
}

/// The nearest number that the file can hold.
float in_half(float value) {
  constexpr float most = 65504;
  return Imath::half(std::clamp(value, -most, most));
}

/// A matrix that is a sum over many items, by blocks that are added in their order whatever the threads do.
template <class AddItem>
std::vector<double> summed(std::size_t items, std::size_t size, const AddItem& add) {
  const std::size_t blocks = std::clamp<std::size_t>(items / 64, 1, 16);
  std::vector<std::vector<double>> parts(blocks);
  parallel_for(0, static_cast<int>(blocks), [&](int block) {
    std::vector<double>& part = parts[block];
    part.assign(size * size, 0);
    const std::size_t begin = items * static_cast<std::size_t>(block) / blocks;
    const std::size_t end = items * (static_cast<std::size_t>(block) + 1) / blocks;
    for (std::size_t item = begin; item < end; ++item) add(item, part);
  });
  std::vector<double> sum(size * size, 0);
  for (const auto& part : parts) {
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += part[i];
  }
  return sum;
}

/// alpha f of a texel: [view][3 * light + channel].
std::vector<float> premultiplied(const SampleLevel& level, std::size_t texel) {
  const auto views = static_cast<std::size_t>(level.views);
  const auto lights = static_cast<std::size_t>(level.lights);
  std::vector<float> result;
  result.reserve(views * lights * 3);
  for (std::size_t view = 0; view < views; ++view) {
    const float alpha = level.alpha[texel * views + view];
    const V3f* radiance = &level.radiance[(texel * views + view) * lights];
    for (std::size_t l = 0; l < lights; ++l) {
      for (int c = 0; c < 3; ++c) result.push_back(alpha * radiance[l][c]);
    }
  }
  return result;
}

/// The coefficients of one texel, [a * light functions + b].
std::vector<double> fit_texel(const SampleLevel& level, std::size_t texel,
                              const std::vector<std::vector<float>>& phi,
                              const std::vector<std::vector<float>>& psi) {
  const auto views = static_cast<std::size_t>(level.views);
  const std::vector<float> seen = premultiplied(level, texel);
  std::vector<double> normal(phi.size() * phi.size(), 0);
  std::vector<double> right(phi.size() * psi.size(), 0);
  for (std::size_t view = 0; view < views; ++view) {
    const auto alpha = static_cast<double>(level.alpha[texel * views + view]);
    if (alpha == 0) continue;
    const float* row = &seen[view * psi.front().size()];
    std::vector<double> in_psi;
    for (const auto& function : psi) in_psi.push_back(static_cast<double>(dot(row, function)));
    for (std::size_t a = 0; a < phi.size(); ++a) {
      const double factor = alpha * static_cast<double>(phi[a][view]);
      for (std::size_t b = 0; b < psi.size(); ++b) right[a * psi.size() + b] += factor * in_psi[b];
      for (std::size_t other = 0; other < phi.size(); ++other) {
        normal[a * phi.size() + other] += factor * alpha * static_cast<double>(phi[other][view]);
      }
    }
  }
  double trace = 0;
  for (std::size_t a = 0; a < phi.size(); ++a) trace += normal[a * phi.size() + a];
  if (!(trace > 0)) return std::vector<double>(right.size(), 0);  // a hole from everywhere
  solve_symmetric(normal, phi.size(), 1e-3 * trace / static_cast<double>(phi.size()), right, psi.size());
  return right;
}

}  // namespace

std::vector<Products> slab_products(const std::vector<SlabTables>& levels,
                                    const std::vector<std::vector<float>>& view_functions, std::size_t most,
                                    const std::vector<float>* unit) {
  const std::size_t functions = view_functions.size();
  const std::size_t values = levels.front().values;
  Products shared;
  shared.view = view_functions;
  for (std::size_t a = 0; a < functions; ++a) {
    std::vector<double> covariance(values * values, 0);
    for (const SlabTables& level : levels) {
      const std::vector<double> of_level = summed(level.seen.size(), values, [&](std::size_t e, auto& sum) {
        if (level.seen[e] > 0)
          add_outer(&level.value[(e * functions + a) * values], values, level.seen[e], sum);
      });
      for (std::size_t i = 0; i < covariance.size(); ++i) covariance[i] += of_level[i];
    }
    const Principal components = principal_components(covariance, values, a == 0 ? most : most / 4);
    for (auto& function : stored(components.vectors, 1, light_step)) {
      shared.pairs.emplace_back(static_cast<int>(a), static_cast<int>(shared.light.size()));
      shared.light.push_back(std::move(function));
    }
  }
  std::vector<Products> result;
  for (const SlabTables& level : levels) {
    Products products = shared;
    const std::size_t count = shared.pairs.size();
    products.coefficient.assign(level.seen.size() * count, 0);
    parallel_for(0, static_cast<int>(level.seen.size()), [&](int entry) {
      const auto e = static_cast<std::size_t>(entry);
      if (!(level.seen[e] > 0)) return;
      for (std::size_t m = 0; m < count; ++m) {
        const V2i& pair = shared.pairs[m];
        products.coefficient[e * count + m] = dot(
            &level.value[(e * functions + static_cast<std::size_t>(pair.x)) * values], shared.light[pair.y]);
      }
    });
    result.push_back(std::move(products));
  }
  if (unit == nullptr) return result;
  for (Products& products : result) {
    for (std::vector<float>& function : products.light) {
      for (std::size_t i = 0; i < function.size(); ++i) function[i] = in_half(function[i] / (*unit)[i]);
    }
  }
  return result;
}

std::vector<Products> level_products(const std::vector<SampleLevel>& levels, std::size_t max_view,
                                     std::size_t max_light) {
  const auto views = static_cast<std::size_t>(levels.front().views);
  const std::size_t values = 3 * static_cast<std::size_t>(levels.front().lights);
  std::vector<double> of_views(views * views, 0);
  std::vector<double> of_lights(values * values, 0);
  for (const SampleLevel& level : levels) {
    const double weight = 1 / std::sqrt(static_cast<double>(level.texels()));
    const auto texels = static_cast<std::size_t>(level.texels());
    const std::vector<double> lights = summed(texels, values, [&](std::size_t texel, auto& sum) {
      const std::vector<float> seen = premultiplied(level, texel);
      for (std::size_t view = 0; view < views; ++view) add_outer(&seen[view * values], values, weight, sum);
    });
    const std::vector<double> across = summed(texels, views, [&](std::size_t texel, auto& sum) {
      const std::vector<float> seen = premultiplied(level, texel);
      std::vector<float> column(views);
      for (std::size_t i = 0; i < values; ++i) {
        for (std::size_t view = 0; view < views; ++view) column[view] = seen[view * values + i];
        add_outer(column.data(), views, weight, sum);
      }
    });
    for (std::size_t i = 0; i < of_lights.size(); ++i) of_lights[i] += lights[i];
    for (std::size_t i = 0; i < of_views.size(); ++i) of_views[i] += across[i];
  }
  Products shared;
  shared.view = stored(principal_components(of_views, views, max_view).vectors,
                       std::sqrt(static_cast<double>(views)), view_step);
  shared.light = stored(principal_components(of_lights, values, max_light).vectors, 1, light_step);
  for (std::size_t a = 0; a < shared.view.size(); ++a) {
    for (std::size_t b = 0; b < shared.light.size(); ++b) {
      shared.pairs.emplace_back(static_cast<int>(a), static_cast<int>(b));
    }
  }
  std::vector<Products> result;
  for (const SampleLevel& level : levels) {
    Products products = shared;
    const std::size_t count = shared.pairs.size();
    products.coefficient.resize(static_cast<std::size_t>(level.texels()) * count);
    parallel_for(0, level.texels(), [&](int texel) {
      const auto t = static_cast<std::size_t>(texel);
      const std::vector<double> fitted = fit_texel(level, t, shared.view, shared.light);
      for (std::size_t m = 0; m < count; ++m) {
        products.coefficient[t * count + m] = static_cast<float>(fitted[m]);
      }
    });
    result.push_back(std::move(products));
  }
  return result;
}

float scale_of(const Products& products) {
  const std::size_t count = products.pairs.size();
  double largest = 0;
  for (std::size_t m = 0; m < count; ++m) {
    double power = 0;
    double used = 0;
    for (std::size_t o = 0; o < products.owners(); ++o) {
      const auto c = static_cast<double>(products.coefficient[o * count + m]);
      power += c * c;
      used += c != 0 ? 1 : 0;
    }
    if (used > 0) largest = std::max(largest, std::sqrt(power / used));
  }
  return static_cast<float>(largest);
}

}  // namespace selvedge
