#include "format/picture/environment.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "format/picture/image.h"

namespace selvedge {
namespace {

constexpr std::size_t max_lamps = 4;
/// Lamps and smooth light are made of a picture of at most this width: its pixels are 0.7 degrees wide.
constexpr int divided_width = 512;
/// A lamp is what lies so close to its brightest point; fabrics blur light more than that.
const double lamp_cosine = std::cos(20 * std::numbers::pi / 180);
/// ... and is this many times as bright as the mean.
constexpr float lamp_brightness = 4;
/// A lamp whose light is a smaller fraction of all is left in the rest.
constexpr double min_lamp = 0.01;

double brightness(const V3f& c) {
  return (static_cast<double>(c.x) + static_cast<double>(c.y) + static_cast<double>(c.z)) / 3;
}

/// A direction's place in the picture, in pixels; the middle of the first pixel is 0.5.
V2d place_of(const Environment& e, const V3d& d) {
  const double azimuth = std::atan2(d.x, -d.z) / (2 * std::numbers::pi) + e.options.turn_degrees / 360;
  return {(azimuth + 0.5 - std::floor(azimuth + 0.5)) * e.width,
          std::acos(std::clamp(d.y, -1.0, 1.0)) / std::numbers::pi * e.height};
}

/// Calls body(radiance, direction, solid angle) for every pixel; the body may change the radiance.
template <class Body>
void for_pixels(Environment& e, const Body& body) {
  for (int y = 0; y < e.height; ++y) {
    const double solid_angle = e.solid_angle(y);
    for (int x = 0; x < e.width; ++x)
      body(e.radiance[static_cast<std::size_t>(y) * e.width + x], e.direction(x, y), solid_angle);
  }
}

/// The middle of the lamp that sends most, of what is brighter than `least`.
std::optional<V3d> strongest_part(const Environment& environment, double least) {
  Environment coarse = downsample(environment, 128);
  struct Bright {
    V3d direction;
    double power;
  };
  std::vector<Bright> bright;
  for_pixels(coarse, [&](const V3f& c, const V3d& direction, double solid_angle) {
    if (brightness(c) > least) bright.push_back({direction, (brightness(c) - least) * solid_angle});
  });
  std::optional<V3d> strongest;
  double most = 0;
  for (const Bright& middle : bright) {
    double power = 0;
    for (const Bright& part : bright)
      power += part.direction.dot(middle.direction) > lamp_cosine ? part.power : 0;
    if (power <= most) continue;
    most = power;
    strongest = middle.direction;
  }
  return strongest;
}

/// The radiance of a picture, 0 between it and its display window if that is 2 : 1 and is not as large; as it
/// is with other display windows. Stretched to 2 : 1.
Environment environment_of(const Image& image, const EnvironmentOptions& options) {
  constexpr double tolerance = 0.1;
  const auto is_panorama = [](const V2i& size) {
    return std::abs(size.x - 2.0 * size.y) < tolerance * 2.0 * size.y;
  };
  Imath::Box2i window(V2i(0, 0), V2i(image.width - 1, image.height - 1));
  Environment result{0, 0, {}, options, image.remarks};
  const V2i shown = image.display_window.isEmpty() ? V2i(0) : image.display_window.size() + V2i(1);
  if (shown != V2i(image.width, image.height) && is_panorama(shown) &&
      window.intersects(image.display_window)) {
    window = image.display_window;
    result.remarks.push_back(fmt::format("{} x {} pixels of a panorama of {} x {}: the rest is black",
                                         image.width, image.height, shown.x, shown.y));
  }
  const V2i size = window.size() + V2i(1, 1);
  if (!is_panorama(size)) return result;
  if (size.x != 2 * size.y)
    result.remarks.push_back(fmt::format("{} x {} pixels are stretched to 2 : 1", size.x, size.y));
  result.height = size.y;
  result.width = 2 * size.y;
  const auto at = [&](int x, int y) {
    const V2i place = window.min + V2i((x + size.x) % size.x, y);
    if (place.x < 0 || place.y < 0 || place.x >= image.width || place.y >= image.height) return V3f(0, 0, 0);
    const float* pixel = &image.pixels[4 * (static_cast<std::size_t>(place.y) * image.width + place.x)];
    return V3f(pixel[0], pixel[1], pixel[2]);
  };
  for (int y = 0; y < result.height; ++y) {
    for (int x = 0; x < result.width; ++x) {
      const double place = (x + 0.5) * size.x / result.width - 0.5;
      const int left = static_cast<int>(std::floor(place));
      result.radiance.push_back(mix(at(left, y), at(left + 1, y), static_cast<float>(place - left)));
    }
  }
  return result;
}

/// Values that light can have.
void make_radiance(Image& image, std::vector<std::string>& remarks) {
  constexpr float max_radiance = 1e12F;  // the sun has 2e9 cd/m2
  constexpr float max_half = 65504;
  float brightest = max_half;
  for (std::size_t i = 0; i < image.pixels.size(); ++i)
    if (i % 4 < 3 && image.pixels[i] <= max_radiance) brightest = std::max(brightest, image.pixels[i]);
  std::array<std::size_t, 3> counts{};
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    float& value = image.pixels[i];
    if (i % 4 == 3 || (value >= 0 && value <= max_radiance)) continue;
    counts[std::isnan(value) ? 0 : value < 0 ? 1 : 2] += 1;
    value = value > 0 ? brightest : 0;
  }
  if (counts[0] > 0) remarks.push_back(fmt::format("{} values that are no numbers become 0", counts[0]));
  if (counts[1] > 0) remarks.push_back(fmt::format("{} negative values become 0", counts[1]));
  if (counts[2] > 0) remarks.push_back(fmt::format("{} infinite values become {:.6g}", counts[2], brightest));
}

/// Takes bright parts out of an environment: at most four lamps, the strongest first.
std::vector<Light> extract_lamps(Environment& environment) {
  V3d whole(0, 0, 0);
  for_pixels(environment,
             [&](const V3f& c, const V3d&, double solid_angle) { whole += V3d(c) * solid_angle; });
  std::vector<Light> lamps;
  V3d left = whole;
  while (lamps.size() < max_lamps) {
    const V3f mean(left / (4 * std::numbers::pi));
    const double least = lamp_brightness * brightness(mean);
    const std::optional<V3d> towards = strongest_part(environment, least);
    if (!towards) break;
    V3d sum(0, 0, 0);
    V3d middle(0, 0, 0);
    const auto is_of_lamp = [&](const V3f& c, const V3d& d) {
      return d.dot(*towards) > lamp_cosine && brightness(c) > least;
    };
    for_pixels(environment, [&](const V3f& c, const V3d& d, double solid_angle) {
      if (!is_of_lamp(c, d)) return;
      const V3d excess = V3d(c - mean) * solid_angle;
      sum += excess;
      middle += d * brightness(V3f(excess));
    });
    if (brightness(V3f(sum)) < min_lamp * brightness(V3f(whole))) break;
    for_pixels(environment, [&](V3f& c, const V3d& d, double) {
      if (is_of_lamp(c, d)) c = mean;
    });
    left -= sum;
    lamps.push_back({middle.normalized(), V3f(sum * environment.options.strength)});
  }
  return lamps;
}

}  // namespace

V3d Environment::direction(int x, int y) const {
  const double azimuth = ((x + 0.5) / width - 0.5 - options.turn_degrees / 360) * 2 * std::numbers::pi;
  const double polar = (y + 0.5) / height * std::numbers::pi;
  return {std::sin(azimuth) * std::sin(polar), std::cos(polar), -std::cos(azimuth) * std::sin(polar)};
}

double Environment::solid_angle(int y) const {
  const auto edge = [&](int row) { return std::cos(row * std::numbers::pi / height); };
  return 2 * std::numbers::pi / width * (edge(y) - edge(y + 1));
}

V3f Environment::radiance_at(const V3d& direction) const {
  const V2d place = place_of(*this, direction) - V2d(0.5, 0.5);
  const double left = std::floor(place.x);
  const double top = std::floor(place.y);
  V3f sum(0, 0, 0);
  for (int k = 0; k < 4; ++k) {
    const int x = (static_cast<int>(left) + k % 2 + width) % width;
    const int y = std::clamp(static_cast<int>(top) + k / 2, 0, height - 1);
    const double of_x = k % 2 == 0 ? left + 1 - place.x : place.x - left;
    const double of_y = k / 2 == 0 ? top + 1 - place.y : place.y - top;
    sum += radiance[static_cast<std::size_t>(y) * width + x] * static_cast<float>(of_x * of_y);
  }
  return sum * static_cast<float>(options.strength);
}

Result<Environment> read_environment(const std::string& path, const EnvironmentOptions& options,
                                     std::uint64_t memory) {
  Result<Image> image = read_image(path, Transfer::keep, memory);
  if (!image) return tl::unexpected(image.error());
  const std::string size = fmt::format("{} x {} pixels", image->width, image->height);
  make_radiance(*image, image->remarks);
  const int shown = image->display_window.isEmpty() ? 0 : image->display_window.size().y + 1;
  const auto rows = static_cast<std::uint64_t>(std::max(image->height, shown));
  if (!MemoryBudget(memory).try_spend(2 * rows * rows, environment_bytes_per_pixel))
    return tl::unexpected<Error>(memory_limit_error(path, "", size, memory));
  Environment result = environment_of(*image, options);
  if (result.width == 0)
    return fail(Code::image_unreadable, path, "",
                size +
                    ": environments are equirectangular, 2 : 1; convert other layouts to that first, "
                    "or fill a part of a panorama up");
  if (std::ranges::all_of(result.radiance, [](const V3f& c) { return c == V3f(0); }))
    result.remarks.emplace_back("is black all over");
  return result;
}

Environment downsample(const Environment& environment, int width) {
  if (environment.width <= width) return environment;
  const int height = width / 2;
  Environment result{width, height, std::vector<V3f>(static_cast<std::size_t>(width) * height, V3f(0, 0, 0)),
                     environment.options, environment.remarks};
  std::vector<double> weights(result.radiance.size());
  for (int y = 0; y < environment.height; ++y) {
    const double weight = environment.solid_angle(y);
    for (int x = 0; x < environment.width; ++x) {
      const std::size_t to = static_cast<std::size_t>(y) * height / environment.height * width +
                             static_cast<std::size_t>(x) * width / environment.width;
      result.radiance[to] += environment.radiance[static_cast<std::size_t>(y) * environment.width + x] *
                             static_cast<float>(weight);
      weights[to] += weight;
    }
  }
  for (std::size_t i = 0; i < weights.size(); ++i) result.radiance[i] /= static_cast<float>(weights[i]);
  return result;
}

EnvironmentLight with_options(const EnvironmentLight& light, const EnvironmentOptions& options) {
  const double angle = options.turn_degrees / 180 * std::numbers::pi;
  const auto strength = static_cast<float>(options.strength);
  // The turned x and z axes, and by the transposed matrix where light of those axes came from.
  const V3d x(std::cos(angle), 0, -std::sin(angle));
  const V3d z(std::sin(angle), 0, std::cos(angle));
  EnvironmentLight result = light;
  for (Light& lamp : result.lamps) {
    const V3d d = lamp.direction;
    lamp.direction = x * d.x + V3d(0, d.y, 0) + z * d.z;
    lamp.irradiance *= strength;
  }
  for (int c = 0; c < 3; ++c) {
    std::array<float, smooth_function_count> coefficients;
    for (int k = 0; k < smooth_function_count; ++k) coefficients[k] = light.smooth_light.coefficients[k][c];
    coefficients =
        turned<float, V3f>(coefficients, V3f(V3d(x.x, 0, z.x)), V3f(0, 1, 0), V3f(V3d(x.z, 0, z.z)));
    for (int k = 0; k < smooth_function_count; ++k)
      result.smooth_light.coefficients[k][c] = coefficients[k] * strength;
  }
  return result;
}

EnvironmentLight split_light(const Environment& environment) {
  // In smaller pixels, if they are so large that their middles do not stand for them.
  const Environment small = downsample(environment, divided_width);
  const int factor = std::max(1, 256 / small.width);
  Environment rest{small.width * factor, small.height * factor, {}, small.options};
  for (int y = 0; y < rest.height; ++y)
    for (int x = 0; x < rest.width; ++x)
      rest.radiance.push_back(
          small.radiance[static_cast<std::size_t>(y / factor) * small.width + x / factor]);
  EnvironmentLight result;
  result.lamps = extract_lamps(rest);
  for (Light& lamp : result.lamps) lamp.is_environment_part = true;
  std::array<V3d, smooth_function_count> coefficients;
  coefficients.fill(V3d(0, 0, 0));
  for_pixels(rest, [&](const V3f& c, const V3d& d, double solid_angle) {
    const auto basis = smooth_basis(d.x, d.y, d.z);
    for (int k = 0; k < smooth_function_count; ++k)
      coefficients[k] += V3d(c) * (basis[k] * solid_angle / smooth_norms[k]);
  });
  for (int k = 0; k < smooth_function_count; ++k)
    result.smooth_light.coefficients[k] = V3f(coefficients[k] * environment.options.strength);
  return result;
}

}  // namespace selvedge
