#include "fitter/lobes/lobe_step.h"

#include <algorithm>

#include "format/simd/powers.h"

namespace selvedge {
namespace {

/// Number of lights that are summed in single precision: 16 additions lose at most 4 bits of 24.
constexpr std::size_t block = 16;

struct Job {
  const TexelSamples& samples;
  const float* radiance;
  std::span<const float> cosine;  ///< [light]
  std::span<const LobeShape> shapes;
  std::size_t stride;
  std::size_t columns;
  float* scratch;  ///< [lobe * block + light][column of 4][lane]
  double* sums;    ///< [pair][view], zero

  std::size_t index(std::size_t a, std::size_t b) const { return a * (2 * columns + 3 - a) / 2 + b - a; }
};

// GCC 12 cannot convert vectors of dependent types: hence an overload for each width.
#define SELVEDGE_ADD(count)                                                \
  typedef float Floats##count __attribute__((vector_size(4 * (count))));   \
  typedef double Doubles##count __attribute__((vector_size(8 * (count)))); \
  SELVEDGE_INLINE void add(const Floats##count& sum, double* to) {         \
    Doubles##count total;                                                  \
    std::memcpy(&total, to, sizeof total);                                 \
    total += __builtin_convertvector(sum, Doubles##count);                 \
    std::memcpy(to, &total, sizeof total);                                 \
  }
SELVEDGE_ADD(4)
SELVEDGE_ADD(8)
SELVEDGE_ADD(16)
#undef SELVEDGE_ADD

template <class L>
struct Body {
  using Floats = typename L::Floats;

  /// The four columns of one lobe for the lights [first, first + count), views from `view` on.
  static SELVEDGE_INLINE void fill(const Job& job, const LobeShape& shape, std::size_t view,
                                   std::size_t first, std::size_t count, float* to) {
    std::array<Floats, 3> d;
    for (std::size_t k = 0; k < 3; ++k) {
      L::load(job.samples.view_xyz[k].data() + view, d[k]);
      d[k] *= static_cast<float>(shape.direction[k]);
    }
    const auto less = static_cast<float>(shape.exponent - 1);
    for (std::size_t i = 0; i < count; ++i, to += 4 * L::count) {
      const V3f& light = job.samples.lights[first + i];
      const Floats base = (d[0] * light.x + d[1] * light.y) + d[2] * light.z;
      Floats log;
      Floats power;
      L::log_and_power(base, less, log, power);
      power *= job.cosine[first + i];
      L::store(power * light.x, to);
      L::store(power * light.y, to + L::count);
      L::store(power * light.z, to + 2 * L::count);
      L::store(power * base * log, to + 3 * L::count);
    }
  }

  /// Adds products of a lobe's columns with the cosine and the radiance.
  static SELVEDGE_INLINE void with_data(const Job& job, std::size_t j, std::size_t view, std::size_t first,
                                        std::size_t count, const float* a) {
    std::array<Floats, 4> cosine{};
    std::array<Floats, 4> radiance{};
    for (std::size_t i = 0; i < count; ++i, a += 4 * L::count) {
      const std::size_t light = first + i;
      Floats r;
      L::load(job.radiance + light * job.stride + view, r);
      for (std::size_t k = 0; k < 4; ++k) {
        Floats column;
        L::load(a + k * L::count, column);
        radiance[k] += column * r;
        cosine[k] += column * job.cosine[light];
      }
    }
    for (std::size_t k = 0; k < 4; ++k) {
      add(cosine[k], job.sums + job.index(0, 1 + 4 * j + k) * job.stride + view);
      add(radiance[k], job.sums + job.index(1 + 4 * j + k, job.columns) * job.stride + view);
    }
  }

  /// Adds products of a lobe's columns with each other.
  static SELVEDGE_INLINE void with_itself(const Job& job, std::size_t j, std::size_t view, std::size_t count,
                                          const float* a) {
    std::array<Floats, 10> sum{};
    for (std::size_t i = 0; i < count; ++i, a += 4 * L::count) {
      std::array<Floats, 4> column;
      for (std::size_t k = 0; k < 4; ++k) L::load(a + k * L::count, column[k]);
      std::size_t at = 0;
      for (std::size_t p = 0; p < 4; ++p)
        for (std::size_t q = p; q < 4; ++q) sum[at++] += column[p] * column[q];
    }
    std::size_t at = 0;
    for (std::size_t p = 0; p < 4; ++p)
      for (std::size_t q = p; q < 4; ++q)
        add(sum[at++], job.sums + job.index(1 + 4 * j + p, 1 + 4 * j + q) * job.stride + view);
  }

  /// Adds products of columns `p` and `p` + 1 of a lobe with another lobe's columns.
  static SELVEDGE_INLINE void with_other(const Job& job, std::size_t i, std::size_t p, std::size_t j,
                                         std::size_t view, std::size_t count, const float* a,
                                         const float* b) {
    std::array<Floats, 8> sum{};
    for (std::size_t row = 0; row < count; ++row, a += 4 * L::count, b += 4 * L::count) {
      Floats left;
      Floats right;
      L::load(a + p * L::count, left);
      L::load(a + (p + 1) * L::count, right);
      for (std::size_t q = 0; q < 4; ++q) {
        Floats column;
        L::load(b + q * L::count, column);
        sum[q] += left * column;
        sum[4 + q] += right * column;
      }
    }
    for (std::size_t q = 0; q < 8; ++q)
      add(sum[q], job.sums + job.index(1 + 4 * i + p + q / 4, 1 + 4 * j + q % 4) * job.stride + view);
  }

  static SELVEDGE_INLINE void run(const Job& job) {
    constexpr std::size_t lobe_size = block * 4 * L::count;
    for (std::size_t view = 0; view < job.stride; view += L::count) {
      for (std::size_t first = 0; first < job.samples.lights.size(); first += block) {
        const std::size_t count = std::min(block, job.samples.lights.size() - first);
        for (std::size_t j = 0; j < job.shapes.size(); ++j) {
          float* columns = job.scratch + j * lobe_size;
          fill(job, job.shapes[j], view, first, count, columns);
          with_data(job, j, view, first, count, columns);
          with_itself(job, j, view, count, columns);
          for (std::size_t i = 0; i < j; ++i) {
            with_other(job, i, 0, j, view, count, job.scratch + i * lobe_size, columns);
            with_other(job, i, 2, j, view, count, job.scratch + i * lobe_size, columns);
          }
        }
      }
    }
  }
};

template <std::size_t Count>
SELVEDGE_INLINE void sum_columns(const Job& job) {
  Body<Lanes<Count>>::run(job);
}

SELVEDGE_THREE_BODIES(sum_columns, (const Job& job), (job))

}  // namespace

SELVEDGE_WIDE
double dot(const double* a, const double* b, std::size_t count) {
  std::array<double, 8> sum{};
  for (std::size_t i = 0; i < count; i += 8)
    for (std::size_t k = 0; k < 8; ++k) sum[k] += a[i + k] * b[i + k];
  return ((sum[0] + sum[4]) + (sum[1] + sum[5])) + ((sum[2] + sum[6]) + (sum[3] + sum[7]));
}

SELVEDGE_WIDE
void add_product(double* to, double c, const double* a, const double* b, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) to[i] += c * a[i] * b[i];
}

SELVEDGE_WIDE
void add_scaled(double* to, double c, const double* a, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) to[i] += c * a[i];
}

void LobeMoments::compute(const TexelSamples& samples, int channel, std::span<const float> cosine,
                          std::span<const LobeShape> shapes) {
  columns_ = 1 + 4 * shapes.size();
  stride_ = samples.stride();
  sums_.assign((columns_ + 1) * (columns_ + 2) / 2 * stride_, 0);
  scratch_.resize(shapes.size() * block * 4 * TexelSamples::lanes);
  const float* radiance = samples.radiance[channel].data();
  const Job job{samples, radiance, cosine, shapes, stride_, columns_, scratch_.data(), sums_.data()};
  double* cross = sums_.data() + index(0, columns_) * stride_;
  sum_columns_for_this_processor(job);
  // The product of the cosine with itself is the same for all views.
  double cosines = 0;
  for (std::size_t light = 0; light < cosine.size(); ++light) {
    const auto c = static_cast<double>(cosine[light]);
    cosines += c * c;
    for (std::size_t v = 0; v < stride_; ++v)
      cross[v] += c * static_cast<double>(radiance[light * stride_ + v]);
  }
  std::fill_n(sums_.data(), stride_, cosines);
}

}  // namespace selvedge
