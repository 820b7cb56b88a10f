#include "fitter/gloss/form.h"

#include <algorithm>
#include <numeric>

#include "format/base/parallel.h"

namespace selvedge {

GlossForm::GlossForm(const SampleLevel& samples, const SlabRays& rays, const SlabTables& tables,
                     const SlabGloss& gloss) {
  const std::size_t kinds = gloss.kinds.size();
  const std::size_t views = samples.views;
  const std::size_t lights = samples.lights;
  const std::size_t per_row = rays.rays;
  const std::size_t entries = tables.visibility.size() / gloss.kind_of.size();
  const std::size_t count = views * tables.values;
  cross_.assign(kinds, std::vector<double>(count, 0));
  square_.resize(kinds * (kinds + 1) / 2);
  for (std::size_t a = 0; a < kinds; ++a) square_[pair(a, a)].assign(count, 0);
  std::vector<std::uint16_t> kind(rays.entries.size(), 0);
  for (std::size_t i = 0; i < rays.entries.size(); ++i) {
    if (rays.entries[i] == SlabRays::no_entry) continue;
    kind[i] = gloss.kind_of[rays.entries[i] / entries];
    for (std::size_t j = i / per_row * per_row; j < i; ++j) {
      if (rays.entries[j] == SlabRays::no_entry) continue;
      std::vector<double>& both = square_[pair(kind[i], kind[j])];
      if (both.empty()) both.assign(count, 0);
    }
  }
  const float share = 1.0F / static_cast<float>(per_row);
  std::vector<double> energy(lights, 0);
  parallel_for(0, samples.lights, [&](std::size_t l) {
    std::vector<std::uint16_t> seen;
    std::vector<V3f> sum(kinds, V3f(0, 0, 0));
    for (std::size_t row = 0; row < samples.alpha.size(); ++row) {
      seen.clear();
      for (std::size_t i = row * per_row; i < (row + 1) * per_row; ++i) {
        if (rays.entries[i] == SlabRays::no_entry) continue;
        if (std::find(seen.begin(), seen.end(), kind[i]) == seen.end()) {
          seen.push_back(kind[i]);
          sum[kind[i]] = V3f(0, 0, 0);
        }
        const float* x = &tables.value[rays.entries[i] * tables.functions * tables.values + 3 * l];
        sum[kind[i]] += share * V3f(x[0], x[1], x[2]);
      }
      const V3f shown = samples.alpha[row] * samples.radiance[row * lights + l];
      energy[l] += static_cast<double>(shown.length2());
      const std::size_t at = row % views * tables.values + 3 * l;
      for (std::size_t p = 0; p < seen.size(); ++p) {
        const V3f& a = sum[seen[p]];
        double* cross = &cross_[seen[p]][at];
        for (int c = 0; c < 3; ++c) cross[c] += static_cast<double>(a[c] * shown[c]);
        for (std::size_t q = 0; q <= p; ++q) {
          const V3f& b = sum[seen[q]];
          double* square = &square_[pair(seen[p], seen[q])][at];
          for (int c = 0; c < 3; ++c) square[c] += static_cast<double>(a[c] * b[c]);
        }
      }
    }
  });
  energy_ = std::accumulate(energy.begin(), energy.end(), 0.0);
}

double GlossForm::error(const std::vector<std::vector<double>>& g) const {
  double sum = energy_;
  for (std::size_t a = 0; a < g.size(); ++a) {
    for (std::size_t i = 0; i < g[a].size(); ++i) sum -= 2 * g[a][i] * cross_[a][i];
    for (std::size_t b = 0; b <= a; ++b) {
      const std::vector<double>& both = square_[pair(a, b)];
      const double times = a == b ? 1 : 2;
      for (std::size_t i = 0; i < both.size(); ++i) sum += times * g[a][i] * g[b][i] * both[i];
    }
  }
  return sum;
}

std::vector<double> GlossForm::linear(std::size_t a, const std::vector<std::vector<double>>& g) const {
  std::vector<double> rest = cross_[a];
  for (std::size_t b = 0; b < g.size(); ++b) {
    if (b == a) continue;
    const std::vector<double>& both = square_[pair(a, b)];
    for (std::size_t i = 0; i < both.size(); ++i) rest[i] -= both[i] * g[b][i];
  }
  return rest;
}

TexelForms::TexelForms(const SampleLevel& samples, const SlabRays& rays, const SlabTables& tables,
                       const SlabFactors& factors)
    : samples_(samples),
      rays_(rays),
      tables_(tables),
      factors_(factors),
      entries_(tables.visibility.size() / factors.kind.size()),
      rows_(factors.kind.size()) {
  const std::size_t per_row = rays.rays;
  for (std::size_t i = 0; i < rays.entries.size(); ++i) {
    if (rays.entries[i] == SlabRays::no_entry) continue;
    std::vector<std::size_t>& rows = rows_[rays.entries[i] / entries_];
    if (rows.empty() || rows.back() != i / per_row) rows.push_back(i / per_row);
  }
}

TexelForm TexelForms::operator()(std::size_t texel) const {
  const std::size_t views = samples_.views;
  const std::size_t lights = samples_.lights;
  const std::size_t per_row = rays_.rays;
  const std::size_t values = tables_.values;
  const float share = 1.0F / static_cast<float>(per_row);
  TexelForm form;
  form.square.assign(views * values, 0);
  form.linear.assign(views * values, 0);
  std::vector<float> own(values);
  std::vector<float> rest(values);
  for (const std::size_t row : rows_[texel]) {
    const std::size_t view = row % views;
    for (std::size_t l = 0; l < lights; ++l) {
      const V3f shown = samples_.alpha[row] * samples_.radiance[row * lights + l];
      for (std::size_t c = 0; c < 3; ++c) rest[3 * l + c] = shown[static_cast<int>(c)];
    }
    std::fill(own.begin(), own.end(), 0.0F);
    for (std::size_t i = row * per_row; i < (row + 1) * per_row; ++i) {
      if (rays_.entries[i] == SlabRays::no_entry) continue;
      const std::size_t hit_texel = rays_.entries[i] / entries_;
      const float* x = &tables_.value[rays_.entries[i] * tables_.functions * values];
      if (hit_texel == texel) {
        for (std::size_t k = 0; k < values; ++k) own[k] += share * x[k];
      } else {
        const float* g = &factors_.value[(factors_.kind[hit_texel] * views + view) * values];
        for (std::size_t k = 0; k < values; ++k) rest[k] -= share * g[k] * x[k];
      }
    }
    double* square = &form.square[view * values];
    double* into = &form.linear[view * values];
    for (std::size_t k = 0; k < values; ++k) {
      square[k] += static_cast<double>(own[k] * own[k]);
      into[k] += static_cast<double>(own[k] * rest[k]);
    }
  }
  return form;
}

}  // namespace selvedge
