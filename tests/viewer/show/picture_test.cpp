#include "viewer/show/picture.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <numbers>

#include "format/fabric/evaluate.h"
#include "format/fabric/file.h"
#include "format/picture/environment.h"
#include "tests/format/files.h"
#include "tests/require.h"
#include "tests/viewer/paths.h"
#include "tests/viewer/shapes.h"
#include "viewer/scene/change_fabrics.h"

namespace selvedge {
namespace {

Scene two_squares() {
  Scene scene;
  test::add(scene, test::square(3), test::material(0));
  test::add(scene, test::square(2, -0.5F), test::material(1), M44d().setTranslation(V3d(0.7, 0.3, 0)));
  scene.fabrics.resize(2);
  return scene;
}

std::vector<Fabric> two_fabrics() { return {test::random_fabric(16, 16, 1), test::random_fabric(8, 8, 2)}; }

std::unique_ptr<ShowPicture> picture_of(const Scene& scene, const std::vector<Fabric>& fabrics) {
  return test::need(ShowPicture::create(scene, fabrics));
}

ShowState state_of(const ShowPicture& picture) {
  ShowState result = test::need(picture.first_state({}, 1.25));
  result.lights = default_lights(Camera{});
  return result;
}

bool same(const Frame& a, const Frame& b) {
  return a.width == b.width && a.height == b.height &&
         std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(V4f)) == 0;
}

TEST_CASE("a picture that was resized is the one of that size from the start") {
  const auto picture = picture_of(two_squares(), two_fabrics());
  const ShowState state = state_of(*picture);
  test::need(picture->update(state, Redraw::scene, V2i(100, 80), 1));
  CHECK(picture->frame().width == 100);
  const Frame first = picture->frame();
  test::need(picture->update(state, Redraw::frame, V2i(133, 61), 1));
  test::need(picture->update(state, Redraw::frame, V2i(200, 160), 2));
  CHECK(same(picture->frame(), first));
  const auto fresh = picture_of(two_squares(), two_fabrics());
  test::need(fresh->update(state, Redraw::scene, V2i(133, 61), 1));
  test::need(picture->update(state, Redraw::frame, V2i(133, 61), 1));
  CHECK(same(picture->frame(), fresh->frame()));
}

TEST_CASE("the first view is from a garment's broad side, unless it is asked for another") {
  Scene scene = two_squares();
  for (SceneInstance& part : scene.instances) part.world.rotate(V3d(0, 0.5 * std::numbers::pi, 0));
  const auto picture = picture_of(scene, two_fabrics());
  CHECK(std::abs(test::need(picture->first_state({}, 1.25)).camera.azimuth) == doctest::Approx(90));
  CameraOptions asked;
  asked.azimuth = 20;
  CHECK(test::need(picture->first_state(asked, 1.25)).camera.azimuth == 20);
}

TEST_CASE("a picture at rest gets nine samples a pixel, and a change begins anew") {
  const std::vector<Fabric> fabrics = two_fabrics();
  const auto picture = picture_of(two_squares(), fabrics);
  ShowState state = state_of(*picture);
  state.camera.azimuth = 30;
  test::need(picture->update(state, Redraw::scene, V2i(100, 80), 1));
  const Frame first = picture->frame();
  constexpr int n = ShowPicture::rest_samples_per_side;
  for (int i = 0; i < n * n; ++i) CHECK(test::need(picture->refine(state)));
  CHECK_FALSE(test::need(picture->refine(state)));
  RenderOptions options;
  options.width = 100;
  options.height = 80;
  options.supersample = n;
  options.levels = state.levels;
  options.lights = picture->drawn().lights;
  const Frame expected = test::need(render(two_squares(), fabrics, picture->drawn().camera, options));
  CHECK_FALSE(same(picture->frame(), first));
  const Frame rested = picture->frame();
  // Patches are chosen for each sample, or once for all.
  CHECK(test::decibels(picture->frame(), expected, 1) > 40);
  test::need(picture->update(state, Redraw::frame, V2i(100, 80), 1));
  CHECK(same(picture->frame(), first));
  // Nothing remains of where it came from.
  for (const double azimuth : {10.0, 50.0, 30.0}) {
    state.camera.azimuth = azimuth;
    test::need(picture->update(state, Redraw::frame, V2i(100, 80), 1));
  }
  while (test::need(picture->refine(state))) {
  }
  CHECK(same(picture->frame(), rested));
  test::need(picture->update(state, Redraw::frame, V2i(100, 80), 1));
  CHECK(test::need(picture->refine(state)));
  state.path = static_cast<int>(RenderPath::paper);
  test::need(picture->update(state, Redraw::scene, V2i(100, 80), 1));
  CHECK_FALSE(test::need(picture->refine(state)));
}

TEST_CASE("two choices of fabrics show side by side what each shows alone, at rest, wherever the bar is") {
  const V2i size(100, 80);
  const auto at_rest = [&](const ShowState& state) {
    auto picture = picture_of(two_squares(), two_fabrics());
    test::need(picture->update(state, Redraw::scene, size, 1));
    while (test::need(picture->refine(state))) {
    }
    return picture;
  };
  ShowState one = state_of(*picture_of(two_squares(), two_fabrics()));
  ShowState other = one;
  other.worn_fabrics.fabrics = {1, -1};
  other.worn_fabrics.fits[0].stitch_scale = 1.5;
  ShowState both = one;
  CHECK(toggle_comparison(both) == Redraw::scene);
  both.worn_fabrics = other.worn_fabrics;
  const auto left = at_rest(one);
  const auto right = at_rest(other);
  const auto divided = at_rest(both);
  for (const float bar : {0.5F, 0.0F, 0.31F, 1.0F}) {
    CAPTURE(bar);
    both.comparison_bar = bar;
    test::need(divided->update(both, Redraw::display, size, 1));
    for (int i = 0; i < size.x * size.y; ++i) {
      const bool on_left = i % size.x < std::lround(bar * static_cast<float>(size.x));
      const ShowPicture& expected = on_left ? *left : *right;
      REQUIRE(divided->frame().pixels[i] == expected.frame().pixels[i]);
      REQUIRE(divided->drawn().bytes[4 * i] == expected.drawn().bytes[4 * i]);
    }
    for (const double x : {0.3, 0.32}) {
      const auto seen = test::need(divided->probe_surface(V2d(x, 0.5)));
      const auto alone =
          test::need((x < static_cast<double>(bar) ? left : right)->probe_surface(V2d(x, 0.5)));
      REQUIRE(seen.has_value());
      CHECK(seen->radiance == alone->radiance);
    }
  }
  CHECK(toggle_comparison(both) == Redraw::scene);
  CHECK(same(at_rest(both)->frame(), right->frame()));
}

TEST_CASE("shadows and light from all sides come and go between frames") {
  Scene scene = two_squares();
  scene.materials[1] = test::material(-1, V4f(0.5F, 0.5F, 0.5F, 1));
  scene.materials[1].metallic = 0;
  const auto picture = picture_of(scene, two_fabrics());
  ShowState state = state_of(*picture);
  state.camera.azimuth = 20;
  test::need(picture->update(state, Redraw::scene, V2i(100, 80), 1));
  const Frame plain = picture->frame();
  state.shadow_map_size = 256;
  test::need(picture->update(state, Redraw::frame, V2i(100, 80), 1));
  CHECK_FALSE(same(picture->frame(), plain));
  CHECK(picture->drawn().stats.shadow_seconds > 0);
  state.shadow_map_size = 0;
  test::need(picture->update(state, Redraw::frame, V2i(100, 80), 1));
  CHECK(test::decibels(picture->frame(), plain, 1) > 60);
  CHECK(picture->drawn().stats.shadow_seconds == 0);
  state.ambient_irradiance = 0.5F;
  test::need(picture->update(state, Redraw::frame, V2i(100, 80), 1));
  CHECK_FALSE(same(picture->frame(), plain));
}

TEST_CASE("every path of the window draws what render draws by it, and what a path cannot draw is an error") {
  const std::vector<Fabric> fabrics = two_fabrics();
  const auto picture = picture_of(two_squares(), fabrics);
  ShowState state = state_of(*picture);
  for (std::size_t path = 0; path < path_names.size(); ++path) {
    CAPTURE(path_names[path]);
    state.path = static_cast<int>(path);
    test::need(picture->update(state, Redraw::scene, V2i(100, 80), 1));
    RenderOptions options;
    options.path = static_cast<RenderPath>(path);
    options.width = 100;
    options.height = 80;
    options.levels = state.levels;
    options.cells = moving_cell_images;
    options.lights = picture->drawn().lights;
    const Frame expected = test::need(render(two_squares(), fabrics, picture->drawn().camera, options));
    CHECK(same(picture->frame(), expected));
  }
  state.shadow_map_size = 3;
  CHECK(test::error_of(picture->update(state, Redraw::frame, V2i(100, 80), 1)).code ==
        Code::option_out_of_range);
  state.shadow_map_size = 0;
  test::need(picture->update(state, Redraw::scene, V2i(100, 80), 1));
}

TEST_CASE("the window's environment is render's, turned, scaled and behind the scene") {
  const std::vector<Fabric> fabrics = two_fabrics();
  const auto picture = picture_of(two_squares(), fabrics);
  ShowState state = state_of(*picture);
  state.lights.clear();
  state.environments = {std::make_shared<const Surroundings>(
      Surroundings{"", studio_environment(), split_light(studio_environment())})};
  state.environment = 0;
  state.environment_strength = 1.5F;
  state.has_backdrop = true;
  // To the right by a quarter of the picture's height.
  ShowInput input;
  input.grip = ShowInput::Grip::light;
  input.drag = V2d(0.25, 0);
  CHECK(apply(input, 1.25, picture->drawn().scene_diagonal, state) == Redraw::frame);
  CHECK(state.environment_turn == 45);
  test::need(picture->update(state, Redraw::scene, V2i(100, 80), 1));
  const Environment turned_studio = studio_environment({45, 1.5});
  const EnvironmentLight light = split_light(turned_studio);
  RenderOptions options;
  options.width = 100;
  options.height = 80;
  options.levels = state.levels;
  options.cells = moving_cell_images;
  options.lights = light.lamps;
  options.smooth_light = light.smooth_light;
  options.environment = std::make_shared<const Environment>(turned_studio);
  options.backdrop_roughness = 0;
  const Frame expected = test::need(render(two_squares(), fabrics, picture->drawn().camera, options));
  for (std::size_t i = 0; i < expected.pixels.size(); ++i)
    REQUIRE((picture->frame().pixels[i] - expected.pixels[i]).length() <= 1e-4 * expected.pixels[i].length());
  // Without it, two lamps.
  state.environment = -1;
  test::need(picture->update(state, Redraw::frame, V2i(100, 80), 1));
  CHECK(picture->drawn().lights.size() == 2);
}

TEST_CASE("the probe tells the texel of a forced level and the light of the reference") {
  const Scene scene = two_squares();
  std::vector<Fabric> fabrics = two_fabrics();
  for (Fabric& fabric : fabrics) {
    // One view stands for all pixels of a repeat.
    for (const LayerKind kind : {LayerKind::table, LayerKind::opacity}) fabric.levels[0].remove_layer(kind);
  }
  const auto picture = picture_of(scene, fabrics);
  ShowState state = state_of(*picture);
  state.camera.azimuth = 25;
  state.camera.elevation = 10;
  state.levels.forced_level = 0;
  state.camera.projection = Projection::parallel;
  const V2i size(100, 80);
  test::need(picture->update(state, Redraw::scene, size, 1));
  int probed = 0;
  for (int i = 0; i < size.x * size.y; i += 41) {
    const V2i pixel(i % size.x, i / size.x);
    const auto probe = test::need(picture->probe_surface((V2d(pixel) + V2d(0.5)) / V2d(size)));
    if (!probe) continue;
    ++probed;
    const PixelProbe& p = *probe;
    REQUIRE(p.pixel == pixel);
    REQUIRE(p.texels.size() == 1);
    const V2i& texel = p.texels[0].texel;
    const Fabric& fabric = fabrics[p.fabric];
    CHECK(V2d(texel) == V2d(std::floor(p.uv.x * fabric.texels().x), std::floor(p.uv.y * fabric.texels().y)));
    V3f sum(0, 0, 0);
    float alpha = 0;
    float brightest = 0;
    for (std::size_t k = 0; k < p.to_lights.size(); ++k) {
      const Shading s = evaluate(fabric, 0, texel.x, texel.y, p.to_lights[k], p.to_viewer);
      sum += s.radiance * picture->drawn().lights[k].irradiance;
      alpha = s.alpha;
      brightest = std::max({brightest, sum.x, sum.y, sum.z});
    }
    CHECK(p.alpha == doctest::Approx(alpha).epsilon(1e-3));
    CHECK((p.radiance - sum).length() < 1e-3F * (1 + brightest));
  }
  CHECK(probed > 50);
}

}  // namespace
}  // namespace selvedge
