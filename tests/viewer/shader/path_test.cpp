// The path that evaluates fabrics with OpenGL, on Mesa's software rasteriser.
#include "viewer/shader/path.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "format/base/random.h"
#include "format/fabric/evaluate.h"
#include "format/fabric/gpu_words.h"
#include "tests/format/fabrics.h"
#include "tests/require.h"
#include "tests/viewer/shapes.h"
#include "viewer/gl/context.h"
#include "viewer/gl/glsl.h"
#include "viewer/gl/objects.h"

namespace selvedge {
using test::random_fabric;
using test::random_product_fabric;

namespace {

/// A context with its functions, current.
struct Graphics {
  std::unique_ptr<GraphicsContext> context;
  GlFunctions gl;
};
std::unique_ptr<Graphics> graphics(std::unique_ptr<GraphicsContext> context) {
  auto result = std::make_unique<Graphics>();
  result->context = std::move(context);
  REQUIRE(result->context->make_current());
  const auto gl = test::need(load_gl_functions(*result->context));
  result->gl = gl;
  return result;
}

std::unique_ptr<GraphicsContext> osmesa() { return test::need(make_osmesa_context()); }

/// What a pixel of the test's program evaluates, as the shader has it.
struct Query {
  std::array<std::uint32_t, 4> place{};  ///< fabric, level, texel
  V4f view;
  V4f light;
};

/// Every query by a shader of its own pixel.
std::vector<V4f> evaluated(const Graphics& graphics, std::span<const Fabric> fabrics,
                           const std::vector<Query>& queries) {
  const GlFunctions& gl = graphics.gl;
  const std::string fragment = shader_text("", {R"(
struct Query { uvec4 place; vec4 view; vec4 light; };
layout(std430, binding = 1) readonly buffer Queries { Query queries[]; };
layout(location = 0) out vec4 result;
uint light_count() { return 1u; }
void light_at(uint i, out vec3 direction, out vec3 irradiance) {
  direction = queries[uint(gl_FragCoord.x)].light.xyz;
  irradiance = vec3(1.0);
}
)",
                                                glsl::word_layout, glsl::fabric_words, glsl::evaluate, R"(
void main() {
  Query q = queries[uint(gl_FragCoord.x)];
  result = vec4(0.0);
  shade_texel(q.place.x, q.place.y, q.place.z, q.view.xyz, mat3(1.0), 1.0, result);
}
)"});
  const Result<GLuint> program = make_program(gl, shader_text("", {glsl::frame_vertex}), fragment);
  REQUIRE_MESSAGE(program, (program ? "" : to_line(program.error())));
  const auto width = static_cast<int>(queries.size());
  const GLuint target = make_plain_texture(gl, GL_RGBA32F, width, 1);
  GLuint framebuffer = 0;
  gl.CreateFramebuffers(1, &framebuffer);
  gl.NamedFramebufferTexture(framebuffer, GL_COLOR_ATTACHMENT0, target, 0);
  const std::vector<std::uint32_t> words = gpu_words(fabrics);
  std::array<GLuint, 2> buffers{};
  gl.CreateBuffers(2, buffers.data());
  gl.NamedBufferStorage(buffers[0], static_cast<GLsizeiptr>(words.size() * 4), words.data(), 0);
  gl.NamedBufferStorage(buffers[1], static_cast<GLsizeiptr>(queries.size() * sizeof(Query)), queries.data(),
                        0);
  for (GLuint i = 0; i < 2; ++i) gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, i, buffers[i]);
  GLuint array = 0;
  gl.CreateVertexArrays(1, &array);
  gl.BindVertexArray(array);
  gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  gl.Viewport(0, 0, width, 1);
  gl.UseProgram(*program);
  gl.DrawArrays(GL_TRIANGLES, 0, 3);
  std::vector<V4f> result(queries.size());
  gl.ReadPixels(0, 0, width, 1, GL_RGBA, GL_FLOAT, result.data());
  REQUIRE(check_errors(gl, "test"));
  gl.DeleteVertexArrays(1, &array);
  gl.DeleteBuffers(2, buffers.data());
  gl.DeleteFramebuffers(1, &framebuffer);
  gl.DeleteTextures(1, &target);
  gl.DeleteProgram(*program);
  return result;
}

/// The share of random queries that differ by more than `bound`, relative to 1 + what they should be.
double share_beyond(const std::vector<Fabric>& fabrics, double bound, std::uint64_t seed,
                    std::unique_ptr<GraphicsContext> context) {
  const auto with = graphics(std::move(context));
  Random random(seed);
  std::vector<Query> queries;
  std::vector<std::array<double, 4>> truths;
  for (int i = 0; i < 4000; ++i) {
    Query q;
    const auto fabric = static_cast<std::size_t>(random.uniform() * static_cast<double>(fabrics.size()));
    const auto level =
        static_cast<std::size_t>(random.uniform() * static_cast<double>(fabrics[fabric].levels.size()));
    const FabricLevel& of = fabrics[fabric].levels[level];
    const auto texel = static_cast<int>(random.uniform() * of.texels());
    const V3f view = test::any_direction(random);
    const V3f light = test::any_direction(random);
    q.place = {static_cast<std::uint32_t>(fabric), static_cast<std::uint32_t>(level),
               static_cast<std::uint32_t>(texel), 0};
    q.view = V4f(view.x, view.y, view.z, 0);
    q.light = V4f(light.x, light.y, light.z, 0);
    const Shading s =
        evaluate(fabrics[fabric], static_cast<int>(level), texel % of.width, texel / of.width, light, view);
    queries.push_back(q);
    const V3d colour = V3d(s.radiance) * static_cast<double>(s.alpha);
    truths.push_back({colour.x, colour.y, colour.z, static_cast<double>(s.alpha)});
  }
  const std::vector<V4f> results = evaluated(*with, fabrics, queries);
  int beyond = 0;
  double brightest = 0;
  for (std::size_t i = 0; i < results.size(); ++i) {
    double worst = 0;
    for (int c = 0; c < 4; ++c) {
      const double truth = truths[i][c];
      const double difference = std::abs(static_cast<double>(results[i][c]) - truth);
      worst = std::max(worst, difference / (1 + truth));
      brightest = std::max(brightest, truth);
    }
    if (!(worst <= bound)) ++beyond;
  }
  CHECK(brightest > 0.1);
  return beyond / static_cast<double>(results.size());
}

}  // namespace

TEST_CASE("the shader evaluates lobes, frames, table and opacity as the reference does") {
  std::vector<Fabric> fabrics{random_fabric(5, 3, {8, 8}, 2, 1), random_fabric(4, 4, {3, 5}, 0, 2),
                              random_fabric(1, 1, {1, 1}, 4, 3)};
  fabrics[1].radiance_scale = 0.25F;
  for (FabricLevel& level : fabrics[0].levels) {
    if (level.width == 2) level.remove(LayerKind::lobes);
    if (level.width == 1) level.remove(LayerKind::table);
  }
  CHECK(share_beyond(fabrics, 1e-3, 5, osmesa()) == 0);
}

TEST_CASE("the shader evaluates light tables and products as the reference does") {
  const std::vector<Fabric> fabrics{random_product_fabric(6, 4, {4, 4}, 1, 4),
                                    random_product_fabric(8, 8, {8, 8}, 0, 6)};
  CHECK(share_beyond(fabrics, 1e-3, 7, osmesa()) == 0);
}

TEST_CASE("EGL without a surface gives a context whose shader agrees as well") {
  auto context = make_egl_context();
  if (!context) {
    CHECK(context.error().code == Code::graphics_unavailable);
    test::skip(to_line(context.error()));
    return;
  }
  const std::vector<Fabric> fabrics{random_fabric(5, 3, {8, 8}, 2, 1),
                                    random_product_fabric(6, 4, {4, 4}, 1, 4)};
  CHECK(share_beyond(fabrics, 1e-3, 9, std::move(*context)) < 0.001);
}

}  // namespace selvedge
