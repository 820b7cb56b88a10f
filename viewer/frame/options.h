// What a frame is drawn with, and what is known of it afterwards.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "format/fabric/level_options.h"
#include "format/scene/lights.h"

namespace selvedge {

/// Who finds texels and turns them into light: the processor (hybrid) or OpenGL (shader); paper: OpenGL finds
/// them, in colours of 8 bits, and the processor lights them (docs/view.md).
enum class RenderPath { hybrid, shader, paper };
inline constexpr std::array<std::string_view, 3> path_names{"hybrid", "shader", "paper"};

/// By which powers lobes are computed: Lanes::power, about a float's own accuracy, or Lanes::fast_power
/// (format/simd/powers.h).
enum class PowerKind { exact, fast };
inline constexpr std::array<std::string_view, 2> power_names{"exact", "fast"};

/// What memory is reserved for.
struct FrameSize {
  int width = 800;
  int height = 600;
  int supersample = 1;  ///< the frame is drawn this many times larger per side, and averaged
  int layers = 8;       ///< surfaces behind each other that a pixel can show
};

/// What may change from frame to frame.
struct DrawOptions {
  LevelOptions levels;
  /// Of the lobes of fabrics, which the processor lights; the shader path has OpenGL's own.
  PowerKind power = PowerKind::exact;
  std::vector<Light> lights;
  /// Light from all sides on surfaces without fabric, which metals would be black without: white ones show
  /// ambient / pi more. Fabrics know no such light.
  float ambient = 0.1F;
  /// Texels per side of a shadow map for each light that can cast shadows (shadows.h); 0: no shadows.
  int shadows = 0;
};

/// Nanoseconds on the graphics processor, where it has a clock for them, else 0.
struct ShaderTimes {
  std::uint64_t geometry = 0;
  std::uint64_t shading = 0;
};

/// What a rendering did, and how long each stage took, in seconds. Drawing and evaluation go on at the same
/// time, of one part of the frame after another: their times add up to more than the frame's.
struct RenderStats {
  double prepare = 0;   ///< context, vertices, fabrics; once for all frames
  double project = 0;   ///< vertices and triangles to the frame
  double shadows = 0;   ///< drawing shadow maps, and reading them back where the processor needs them
  double geometry = 0;  ///< drawing with OpenGL; of the shader path: until its pixels are there
  double read_back = 0;
  double evaluation = 0;  ///< texels, frames and light on the processor
  double filter = 0;
  std::int64_t triangles = 0;
  std::int64_t covered_pixels = 0;    ///< of the nearest layer, in the supersampled frame
  std::int64_t evaluated_pixels = 0;  ///< over all layers
  int layers = 0;                     ///< the most that a pixel shows
  ShaderTimes shader;                 ///< of the shader path
  std::vector<std::string> remarks;   ///< what could not be honoured, one line each
};

}  // namespace selvedge
