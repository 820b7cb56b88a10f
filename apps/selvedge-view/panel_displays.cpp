#include "apps/selvedge-view/panel_widgets.h"

namespace selvedge {
namespace {

std::string columns_of(const V3f& v) { return fmt::format("{: .3f} {: .3f} {: .3f}", v.x, v.y, v.z); }

}  // namespace

void show_messages(const PanelInfo& info, float width) {
  if (info.message.empty()) return;
  const float left = scaled(90);  // beside the lights
  ImGui::SetNextWindowPos(ImVec2(left, ImGui::GetIO().DisplaySize.y - scaled(10)), 0, ImVec2(0, 1));
  ImGui::SetNextWindowBgAlpha(0.6F);
  ImGui::Begin("messages", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoInputs |
                   ImGuiWindowFlags_NoFocusOnAppearing);
  ImGui::PushTextWrapPos(std::max(width - 2 * left, left));
  ImGui::TextUnformatted(info.message.c_str());
  ImGui::PopTextWrapPos();
  ImGui::End();
}

void show_probe(const PanelInfo& info) {
  if (!info.probe) {
    ImGui::TextDisabled("Nothing under the mouse.");
    return;
  }
  const PixelProbe& p = *info.probe;
  row("pixel", "{}, {}{}", p.pixel.x, p.pixel.y, p.is_back ? "  (back of the cloth)" : "");
  if (p.fabric >= 0) {
    row("fabric", "{}", info.picture.fabric_names[p.fabric]);
    row("u, v", "{:.5f}, {:.5f}", p.uv.x, p.uv.y);
    constexpr std::size_t max_rows = 4;
    for (std::size_t i = 0; i < std::min(max_rows, p.texels.size()); ++i) {
      const ProbedTexel& t = p.texels[i];
      row(i == 0 ? "texel" : "", "{}, {}  of level {}  x {:.3f}", t.texel.x, t.texel.y, t.level, t.weight);
    }
    row("pixel spans", "{:.2f} x {:.2f} texels", p.texels_per_pixel.x, p.texels_per_pixel.y);
  } else {
    row("fabric", "none");
  }
  row("view", "{}", columns_of(p.to_viewer));
  for (std::size_t i = 0; i < p.to_lights.size(); ++i)
    row(fmt::format("light {}", i + 1).c_str(), "{}", columns_of(p.to_lights[i]));
  row("radiance", "{}", columns_of(p.radiance));
  row("alpha", "{:.4f}", p.alpha);
}

void show_times(const PanelInfo& info) {
  const RenderStats& s = info.picture.stats;
  const double frame = info.picture.draw_seconds;
  row("frame", "{:.1f} ms, {} x {}{}", 1e3 * frame, info.picture.width, info.picture.height,
      info.picture.size_divisor > 1 ? " (first)" : "");
  if (info.picture.accuracy_db > 0) row("before samples", "{:.1f} dB", info.picture.accuracy_db);
  for (const auto& [name, member] : render_seconds) {
    const double seconds = s.*member;
    if (seconds <= 0 || member == &RenderStats::prepare_seconds) continue;  // of all frames so far
    ImGui::TextDisabled("%s", name);
    ImGui::SameLine(label_width());
    ImGui::ProgressBar(static_cast<float>(seconds / std::max(frame, 1e-9)),
                       ImVec2(-1, ImGui::GetTextLineHeight()),
                       fmt::format("{:.1f} ms", 1e3 * seconds).c_str());
  }
  row("triangles", "{}", s.triangles);
  row("pixels", "{} seen, {} evaluated", s.covered_pixels, s.evaluated_pixels);
  row("layers", "{}", s.layers);
  for (const std::string& remark : s.remarks) ImGui::TextWrapped("%s", remark.c_str());
}

void draw_lights(const PanelInfo& info, const ShowState& state, const ImVec2& centre, float radius) {
  ImDrawList& draw = *ImGui::GetForegroundDrawList();
  draw.AddCircleFilled(centre, radius, IM_COL32(0, 0, 0, 90));
  draw.AddCircle(centre, radius, IM_COL32(255, 255, 255, 110));
  const Camera& camera = info.picture.camera;
  const std::vector<Light>& lights = info.picture.lights;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    // A point or spot light, seen from the centre of the orbit.
    const V3d towards = lights[i].kind == LightKind::directional
                            ? lights[i].direction
                            : lights[i].position - state.camera.look_at.value_or(V3d(0, 0, 0));
    const V3d d = towards / std::max(towards.length(), 1e-12);
    const ImVec2 at(centre.x + radius * static_cast<float>(d.dot(camera.right)),
                    centre.y - radius * static_cast<float>(d.dot(camera.up)));
    const ImU32 colour =
        i == state.dragged_light ? IM_COL32(255, 214, 90, 255) : IM_COL32(230, 230, 230, 200);
    constexpr float size = 4;
    d.dot(camera.image_normal()) >= 0 ? draw.AddCircleFilled(at, size, colour)
                                      : draw.AddCircle(at, size, colour);
  }
}

void show_help() {
  row("left drag", "turn around the garment");
  row("middle drag", "move it (or Shift + left)");
  row("right drag", "turn the light or environment (Ctrl + left)");
  row("wheel", "nearer, further");
  row("P", "probe");
  row("C", "without fabrics, as other viewers see it");
  row("B", "compare the present fabric with later ones, by a bar");
  row("S  D", "save the picture, the dressed garment");
  row("F", "next fabric on everything");
  row("R  H", "first view, hide this panel");
  row("Escape", "close");
}

}  // namespace selvedge
