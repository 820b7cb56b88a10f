// Draws a lit, tiled quad of a fabric with OpenGL 4.5: the library packs the fabric into words, and the
// shader is the installed text of selvedge-view's own. Without a window, into a PPM file. What an engine
// needs of it is marked: (1) the words in a buffer, (2) the texts in their order, (3) a main() that knows
// light, coordinates and frame.
#include <EGL/egl.h>
#include <EGL/eglext.h>
#define GL_GLEXT_PROTOTYPES
#include <GL/glcorearb.h>
#include <selvedge/selvedge.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <numbers>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

namespace {

constexpr int repeats = 4;
constexpr int pixels_per_texel = 8;
constexpr int most_pixels = 4096;  // along a side
constexpr GLint view_uniform = 20;
constexpr GLint lights_uniform = 21;

// Corners of the quad, whose texture coordinates run over `repeats`; v falls along y.
constexpr const char* vertex_text = R"glsl(#version 450 core
out vec2 uv;
void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  uv = REPEATS * vec2(corner.x, 1.0 - corner.y);
  gl_Position = vec4(2.0 * corner - 1.0, 0.0, 1.0);
}
)glsl";

// (3) Before the texts: the lights, in world space, as many as there are.
constexpr const char* lights_text = R"glsl(
in vec2 uv;
layout(location = 0) out vec4 colour;
layout(location = 20) uniform vec3 to_viewer;
layout(location = 21) uniform vec4 lights[2];  // towards the light, and its irradiance
uint light_count() { return 2u; }
void light_at(uint i, out vec3 direction, out vec3 irradiance) {
  direction = normalize(lights[i].xyz);
  irradiance = vec3(lights[i].w);
}
)glsl";

// (3) After them: the frame of the cloth from normal and dP/du, and the fabric under the pixel. Coordinates
// lose their whole repeats, whose places single precision has not.
constexpr const char* main_text = R"glsl(
void main() {
  vec3 normal = facing_normal(vec3(0.0, 0.0, 1.0), to_viewer);
  vec3 tangent = tangent_across(normal, vec3(1.0, 0.0, 0.0));
  mat3 frame = mat3(tangent, cross(normal, tangent), normal);
  colour = shade_fabric(0u, uv - floor(uv), dFdx(uv), dFdy(uv), mat2x3(0.0), 1.0, to_viewer * frame, frame);
}
)glsl";

int complain(const std::string& what) {
  std::fprintf(stderr, "fabric-picture: %s\n", what.c_str());
  return 1;
}

bool make_context() {
  const auto display_of =
      reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(eglGetProcAddress("eglGetPlatformDisplayEXT"));
  if (display_of == nullptr) return false;
  EGLDisplay display = display_of(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
  if (eglInitialize(display, nullptr, nullptr) != EGL_TRUE || eglBindAPI(EGL_OPENGL_API) != EGL_TRUE)
    return false;
  constexpr std::array<EGLint, 7> wanted{EGL_CONTEXT_MAJOR_VERSION,
                                         4,
                                         EGL_CONTEXT_MINOR_VERSION,
                                         5,
                                         EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                         EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                         EGL_NONE};
  EGLContext context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, wanted.data());
  return context != EGL_NO_CONTEXT &&
         eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context) == EGL_TRUE;
}

/// (2) The texts in the order that their opening comments ask for.
std::optional<std::string> fragment_text(bool has_yarn) {
  std::ostringstream text;
  text << "#version 450 core\n" << (has_yarn ? "#define YARN\n" : "") << lights_text;
  std::vector<std::string> names{"word_layout", "fabric_words", "evaluate"};
  if (has_yarn) names.emplace_back("yarn");
  names.insert(names.end(), {"footprint", "level_options", "fabric_surface"});
  for (const std::string& name : names) {
    std::ifstream file(SHADER_FOLDER "/" + name + ".glsl");
    if (!file) return std::nullopt;
    text << file.rdbuf();
  }
  text << main_text;
  return text.str();
}

/// 0 and a printed log if the text is not good.
GLuint program_of(const std::string& vertex, const std::string& fragment) {
  const GLuint program = glCreateProgram();
  for (const auto& [stage, text] : {std::pair{GL_VERTEX_SHADER, &vertex}, {GL_FRAGMENT_SHADER, &fragment}}) {
    const GLuint shader = glCreateShader(static_cast<GLenum>(stage));
    const char* characters = text->c_str();
    glShaderSource(shader, 1, &characters, nullptr);
    glCompileShader(shader);
    glAttachShader(program, shader);
    std::array<char, 2048> log{};
    glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), nullptr, log.data());
    std::fputs(log.data(), stderr);
  }
  glLinkProgram(program);
  GLint good = 0;
  glGetProgramiv(program, GL_LINK_STATUS, &good);
  return good != 0 ? program : 0;
}

/// (1) The fabric's words, once for all that is drawn with it.
bool upload(const selvedge::FabricFile& fabric) {
  const std::vector<std::uint32_t> words = fabric.gpu_words();
  GLint64 most = 0;
  glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &most);
  if (words.empty() || 4 * words.size() > static_cast<std::uint64_t>(most)) return false;
  GLuint buffer = 0;
  glCreateBuffers(1, &buffer);
  glNamedBufferStorage(buffer, static_cast<GLsizeiptr>(4 * words.size()), words.data(), 0);
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, buffer);
  return true;
}

/// alpha * (radiance, 1), from the bottom row up.
std::vector<float> draw(GLuint program, int width, int height) {
  GLuint texture = 0;
  GLuint framebuffer = 0;
  GLuint array = 0;
  glCreateTextures(GL_TEXTURE_2D, 1, &texture);
  glTextureStorage2D(texture, 1, GL_RGBA32F, width, height);
  glCreateFramebuffers(1, &framebuffer);
  glNamedFramebufferTexture(framebuffer, GL_COLOR_ATTACHMENT0, texture, 0);
  glCreateVertexArrays(1, &array);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  glBindVertexArray(array);
  glViewport(0, 0, width, height);
  glUseProgram(program);
  // level_options.glsl: the defaults of selvedge-view.
  glUniform1i(glGetUniformLocation(program, "forced_level"), -1);
  glUniform1i(glGetUniformLocation(program, "points"), 2);
  constexpr std::array<GLfloat, 8> lights{0.3F, 0.5F, 1.0F, 1.0F, 1.0F, 0.2F, 0.4F, 0.3F};
  glUniform3f(view_uniform, 0, 0, 1);
  glUniform4fv(lights_uniform, 2, lights.data());
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  std::vector<float> pixels(4 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  glReadPixels(0, 0, width, height, GL_RGBA, GL_FLOAT, pixels.data());
  return pixels;
}

/// As selvedge-view shows it over black: radiance times pi, sRGB.
bool write_ppm(const char* path, const std::vector<float>& pixels, int width, int height) {
  std::ofstream file(path, std::ios::binary);
  file << "P6\n" << width << ' ' << height << "\n255\n";
  for (int y = height - 1; y >= 0; --y) {
    for (int x = 0; x < 3 * width; ++x) {
      const std::size_t at = 4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                  static_cast<std::size_t>(x / 3)) +
                             static_cast<std::size_t>(x % 3);
      const float linear = std::clamp(pixels[at] * std::numbers::pi_v<float>, 0.0F, 1.0F);
      const float shown =
          linear <= 0.0031308F ? 12.92F * linear : 1.055F * std::pow(linear, 1 / 2.4F) - 0.055F;
      file.put(static_cast<char>(std::lround(255 * static_cast<double>(shown))));
    }
  }
  return static_cast<bool>(file.flush());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: fabric-picture FABRIC.exr PICTURE.ppm\n");
    return 2;
  }
  selvedge::FabricProblem problem;
  const auto fabric = selvedge::FabricFile::open(argv[1], &problem);
  if (!fabric) return complain(problem.file + ": " + problem.message + " [" + problem.code + "]");
  const selvedge::FabricLevelData finest = fabric->level(0);
  const int width = std::min(most_pixels, finest.width * repeats * pixels_per_texel);
  const int height = std::min(most_pixels, finest.height * repeats * pixels_per_texel);
  if (!make_context()) return complain("EGL gives no OpenGL 4.5 core context without a window");
  const auto fragment = fragment_text(!fabric->yarns().curves.empty());
  if (!fragment) return complain("the texts of the shader are not in " SHADER_FOLDER);
  std::string vertex = vertex_text;
  vertex.replace(vertex.find("REPEATS"), 7, std::to_string(repeats) + ".0");
  const GLuint program = program_of(vertex, *fragment);
  if (program == 0) return complain("the shader does not link");
  if (!upload(*fabric)) return complain("the fabric exceeds the largest buffer");
  const std::vector<float> pixels = draw(program, width, height);
  if (glGetError() != GL_NO_ERROR) return complain("OpenGL reports an error");
  return write_ppm(argv[2], pixels, width, height) ? 0 : complain("the picture cannot be written");
}
