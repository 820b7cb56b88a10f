#include "converter/light/station_fit.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/SparseCholesky>

namespace selvedge {
namespace {

constexpr double step_of_moments = 1.0 / 32;
/// Light of covered places over the mean of open ones: beside them lie contacts' shadows. By 0.3 dB of near
/// pictures.
constexpr double covered_light = 0.3;
/// Regularises the functions beyond the mean against noise, and the stations against their neighbours, by the
/// mean weight of a place.
constexpr std::array<double, angle_function_count> smoothing{1e-9, 1e-3, 1e-3, 4e-3, 4e-3};
constexpr double smoothness_weight = 1e-3;
/// Where all places lie half-way between stations, as in large cells: those could alternate at will, and few
/// lines reach each. Less or more is farther from the light of very many lines.
constexpr double smoothness_of_middles = 1;

using Block = Eigen::Matrix<double, angle_function_count, angle_function_count>;
using Coefficients = Eigen::Matrix<double, Eigen::Dynamic, LightColumns::ColsAtCompileTime>;

struct Between {
  int station, next;
  double fraction;  ///< of the next
};
Between between(const LitPoint& place, int stations) {
  const double whole = std::floor(place.station);
  const int station = static_cast<int>(whole) % stations;
  return {station, (station + 1) % stations, place.station - whole};
}

/// Gives covered places a fraction of the mean of their station's open ones, or of the nearest stations' that
/// have any.
void fill_covered(std::vector<LitPoint>& places, int stations) {
  std::vector<LightColumns> means(stations, LightColumns::Zero());
  std::vector<double> open(stations, 0);
  for (const LitPoint& place : places) {
    if (!place.is_visible) continue;
    const int s = between(place, stations).station;
    means[s] += place.light * place.weight;
    open[s] += place.weight;
  }
  for (LitPoint& place : places) {
    if (place.is_visible || place.weight == 0) continue;
    const int s = between(place, stations).station;
    place.light.setZero();
    double weight = 0;
    for (int away = 0; away <= stations / 2 && weight == 0; ++away) {
      for (const int other : {(s + away) % stations, (s - away + stations) % stations}) {
        place.light += means[other];
        weight += open[other];
      }
    }
    if (weight > 0) place.light *= covered_light / weight;
  }
}

/// The coefficients that fit the places best, [station * angle_function_count + function].
Coefficients solved_for(const std::vector<LitPoint>& places, int stations) {
  std::vector<Block> here(stations, Block::Zero());
  std::vector<Block> to_next(stations, Block::Zero());
  Coefficients right = Coefficients::Zero(stations * angle_function_count, LightColumns::ColsAtCompileTime);
  double weight = 0;
  bool middles = true;
  for (const LitPoint& place : places) {
    const Between at = between(place, stations);
    const double rest = 1 - at.fraction;
    middles = middles && at.fraction == 0.5;
    const Block square = place.weight * place.angle_values.transpose() * place.angle_values;
    here[at.station] += rest * rest * square;
    here[at.next] += at.fraction * at.fraction * square;
    to_next[at.station] += rest * at.fraction * square;
    const auto product = (place.weight * place.angle_values.transpose() * place.light).eval();
    right.middleRows<angle_function_count>(at.station * angle_function_count) += rest * product;
    right.middleRows<angle_function_count>(at.next * angle_function_count) += at.fraction * product;
    weight += place.weight / static_cast<double>(places.size());
  }
  const double smoothness = middles ? smoothness_of_middles : smoothness_weight;
  std::vector<Eigen::Triplet<double>> entries;
  for (int s = 0; s < stations; ++s) {
    const int next = (s + 1) % stations;
    for (int i = 0; i < angle_function_count; ++i) {
      const int row = s * angle_function_count + i;
      const int neighbour = next * angle_function_count + i;
      entries.emplace_back(row, row, weight * (smoothing[i] + smoothness));
      entries.emplace_back(neighbour, neighbour, weight * smoothness);
      entries.emplace_back(row, neighbour, -weight * smoothness);
      entries.emplace_back(neighbour, row, -weight * smoothness);
      for (int j = 0; j < angle_function_count; ++j) {
        entries.emplace_back(row, s * angle_function_count + j, here[s](i, j));
        entries.emplace_back(row, next * angle_function_count + j, to_next[s](i, j));
        entries.emplace_back(next * angle_function_count + j, row, to_next[s](i, j));
      }
    }
  }
  Eigen::SparseMatrix<double> normal(stations * angle_function_count, stations * angle_function_count);
  normal.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(normal);
  return solver.solve(right);
}

/// Writes one side's coefficients, rounded to steps that differ by colour.
void write_rounded(const Coefficients& solved, int side, bool exact, float* out) {
  const auto light = solved.middleCols<light_columns>(side * light_columns);
  std::array<double, 3> largest{};
  for (int k = 0; k < light_columns; ++k)
    largest[k % 3] = std::max(largest[k % 3], light.col(k).cwiseAbs().maxCoeff());
  const double brightest = *std::ranges::max_element(largest);
  // The brightest colour has 8 bits, and of light that comes through each has: a red that is a hundred
  // times as bright as the blue would leave it nothing.
  std::array<double, 3> step{1, 1, 1};
  for (int colour = 0; colour < 3; ++colour) {
    const bool fine = largest[colour] > 0 && (side == 1 || exact);
    const double wanted = (fine ? largest[colour] : brightest) / 127;
    if (wanted > 0) step[colour] = std::exp2(std::ceil(std::log2(wanted)));
  }
  for (int first = 0; first < solved.rows(); first += angle_function_count) {
    for (int i = 0; i < angle_function_count; ++i)
      for (int k = 0; k < light_columns; ++k)
        *out++ = static_cast<float>(std::round(light(first + i, k) / step[k % 3]) * step[k % 3]);
    for (int n = 0; n < light_moment_count; ++n) {
      for (int i = 0; i < angle_function_count; ++i) {
        const double moment = side == 0 ? solved(first + i, 2 * light_columns + n) : 0;
        *out++ = static_cast<float>(std::round(moment / step_of_moments) * step_of_moments);
      }
    }
  }
}

}  // namespace

void fit_stations(std::vector<LitPoint>& places, int curve, int first, bool exact, YarnData& data) {
  const int stations = data.curves[curve].stations;
  fill_covered(places, stations);
  const Coefficients solved = solved_for(places, stations);
  const std::size_t begin = static_cast<std::size_t>(first) * light_values_per_station;
  write_rounded(solved, 0, exact, &data.station_light[begin]);
  if (!data.light_through.empty()) write_rounded(solved, 1, exact, &data.light_through[begin]);
}

}  // namespace selvedge
