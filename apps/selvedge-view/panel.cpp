#include "apps/selvedge-view/panel.h"

#include <fmt/format.h>
#include <imgui/backends/imgui_impl_glfw.h>
#include <imgui/backends/imgui_impl_opengl3.h>
#include <imgui/imgui.h>
#include <imgui/imgui_stdlib.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

namespace selvedge {
namespace {

constexpr float panel_width = 330;
constexpr float label_width = 92;

/// One line of a list: a grey label on the left, its value beside it.
template <class... Arguments>
void row(const char* name, fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  ImGui::TextDisabled("%s", name);
  ImGui::SameLine(label_width);
  ImGui::TextUnformatted(fmt::format(format, std::forward<Arguments>(arguments)...).c_str());
}

/// A label; the widget that follows takes the rest of the line.
void label(const char* name) {
  ImGui::AlignTextToFramePadding();
  ImGui::TextDisabled("%s", name);
  ImGui::SameLine(label_width);
  ImGui::SetNextItemWidth(-1);
}

void raise(Change& change, bool changed, Change to) {
  if (changed) change = std::max(change, to);
}

/// Lines of the panel that edit values of the frame.
void slider(Change& change, const char* name, int& value, int min, int max, const char* format = "%d") {
  label(name);
  raise(change, ImGui::SliderInt(fmt::format("##{}", name).c_str(), &value, min, max, format), Change::frame);
}

bool box(Change& change, const char* name, bool& value) {
  label("");
  const bool changed = ImGui::Checkbox(name, &value);
  raise(change, changed, Change::frame);
  return changed;
}

V3f each(const V3f& v, float (*function)(float)) { return {function(v.x), function(v.y), function(v.z)}; }

std::string triple(const V3f& v) { return fmt::format("{: .3f} {: .3f} {: .3f}", v.x, v.y, v.z); }

void set_style() {
  ImGui::StyleColorsDark();
  ImGuiStyle& style = ImGui::GetStyle();
  style.WindowRounding = 0;
  style.FrameRounding = 3;
  style.GrabRounding = 3;
  style.WindowBorderSize = 0;
  style.WindowPadding = ImVec2(12, 10);
  style.ItemSpacing = ImVec2(8, 4);
  style.FramePadding = ImVec2(6, 2);
  style.Colors[ImGuiCol_WindowBg] = ImVec4(0.10F, 0.10F, 0.11F, 0.94F);
  style.Colors[ImGuiCol_Header] = ImVec4(0.20F, 0.22F, 0.25F, 1);
  style.Colors[ImGuiCol_HeaderHovered] = ImVec4(0.26F, 0.29F, 0.33F, 1);
  style.Colors[ImGuiCol_FrameBg] = ImVec4(0.19F, 0.20F, 0.22F, 1);
  style.Colors[ImGuiCol_TextDisabled] = ImVec4(0.62F, 0.64F, 0.67F, 1);
  // Easier to read than the built-in font, if installed.
  constexpr const char* font = "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf";
  constexpr float font_size = 14;
  std::error_code missing;
  if (std::filesystem::exists(font, missing)) ImGui::GetIO().Fonts->AddFontFromFileTTF(font, font_size);
}

/// A drop-down list. Returns whether the choice changed.
template <class Names>
bool choose(const char* id, const Names& names, int& chosen, bool with_none) {
  const std::string none = "(core material)";
  const auto name_of = [&](int i) { return i < 0 ? none : std::string(names[i]); };
  bool changed = false;
  if (!ImGui::BeginCombo(id, name_of(chosen).c_str())) return false;
  for (int i = with_none ? -1 : 0; i < static_cast<int>(names.size()); ++i) {
    ImGui::PushID(i);
    if (ImGui::Selectable(name_of(i).c_str(), i == chosen)) {
      changed = i != chosen;
      chosen = i;
    }
    ImGui::PopID();
  }
  ImGui::EndCombo();
  return changed;
}

void show_probe(const PanelInfo& info) {
  if (!info.probe) {
    ImGui::TextDisabled("Nothing under the mouse.");
    return;
  }
  const PixelProbe& p = *info.probe;
  row("pixel", "{}, {}{}", p.pixel.x, p.pixel.y, p.back ? "  (back of the cloth)" : "");
  if (p.fabric >= 0) {
    row("fabric", "{}", info.picture.fabric_names()[p.fabric]);
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
  row("view", "{}", triple(p.view));
  for (std::size_t i = 0; i < p.lights.size(); ++i)
    row(fmt::format("light {}", i + 1).c_str(), "{}", triple(p.lights[i]));
  row("radiance", "{}", triple(p.radiance));
  row("alpha", "{:.4f}", p.alpha);
}

void show_times(const PanelInfo& info) {
  const RenderStats& s = info.picture.stats();
  const double frame = info.picture.draw_seconds();
  row("frame", "{:.1f} ms, {} x {}{}", 1e3 * frame, info.picture.frame().width, info.picture.frame().height,
      info.divisor > 1 ? " (moving)" : "");
  const std::initializer_list<std::pair<const char*, double>> parts{
      {"project", s.project},          {"shadows", s.shadows},
      {"geometry", s.geometry},        {"read back", s.read_back},
      {"evaluation", s.evaluation},    {"texel edges", info.picture.overlay_seconds()},
      {"window", info.window_seconds}, {"display", info.picture.display_seconds()}};
  const double all =
      frame + info.picture.overlay_seconds() + info.picture.display_seconds() + info.window_seconds;
  for (const auto& [name, seconds] : parts) {
    if (seconds <= 0) continue;
    ImGui::TextDisabled("%s", name);
    ImGui::SameLine(label_width);
    ImGui::ProgressBar(static_cast<float>(seconds / std::max(all, 1e-9)),
                       ImVec2(-1, ImGui::GetTextLineHeight()),
                       fmt::format("{:.1f} ms", 1e3 * seconds).c_str());
  }
  row("triangles", "{}", s.triangles);
  row("pixels", "{} seen, {} evaluated", s.covered_pixels, s.evaluated_pixels);
  row("layers", "{}", s.layers);
}

/// Draws the lights' directions seen from the camera: a hemisphere from the front, lights behind it hollow.
void draw_lights(const PanelInfo& info, const ShowState& state, const ImVec2& centre, float radius) {
  ImDrawList& draw = *ImGui::GetForegroundDrawList();
  draw.AddCircleFilled(centre, radius, IM_COL32(0, 0, 0, 90));
  draw.AddCircle(centre, radius, IM_COL32(255, 255, 255, 110));
  const Camera& camera = info.picture.camera();
  const std::vector<Light>& lights = info.picture.lights();
  for (std::size_t i = 0; i < lights.size(); ++i) {
    // A point or spot light, seen from the centre of the orbit.
    const V3d towards = lights[i].kind == LightKind::directional
                            ? lights[i].direction
                            : lights[i].position - state.camera.look_at.value_or(V3d(0, 0, 0));
    const V3d d = towards / std::max(towards.length(), 1e-12);
    const ImVec2 at(centre.x + radius * static_cast<float>(d.dot(camera.right)),
                    centre.y - radius * static_cast<float>(d.dot(camera.up)));
    const ImU32 colour = i == state.held_light ? IM_COL32(255, 214, 90, 255) : IM_COL32(230, 230, 230, 200);
    constexpr float size = 4;
    d.dot(camera.back()) >= 0 ? draw.AddCircleFilled(at, size, colour) : draw.AddCircle(at, size, colour);
  }
}

void show_help() {
  row("left drag", "turn around the garment");
  row("middle drag", "move it (or Shift + left)");
  row("right drag", "turn the light (or Ctrl + left)");
  row("wheel", "nearer, further");
  row("E  P", "texel edges, probe");
  row("F", "next fabric on everything");
  row("R  H", "first view, hide this panel");
  row("Escape", "close");
}

}  // namespace

Panel::Panel(const Window& window) {
  IMGUI_CHECKVERSION();
  ImGui::CreateContext();
  // ImGui's settings file would appear beside the garment.
  ImGui::GetIO().IniFilename = nullptr;
  set_style();
  ImGui_ImplGlfw_InitForOpenGL(window.handle(), true);
  ImGui_ImplOpenGL3_Init("#version 450 core");
}

Panel::~Panel() {
  ImGui_ImplOpenGL3_Shutdown();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext();
}

void Panel::begin() {
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
}

float Panel::width() const {
  return shown_ && ImGui::GetIO().DisplaySize.x > 2 * panel_width ? panel_width : 0;
}

V2i Panel::picture_size(const V2i& window) const {
  const float all = ImGui::GetIO().DisplaySize.x;
  const float share = all > 0 ? 1 - width() / all : 1.0F;
  return {static_cast<int>(std::lround(static_cast<float>(window.x) * share)), window.y};
}

bool Panel::holds() const {
  const ImGuiIO& io = ImGui::GetIO();
  return !io.WantCaptureMouse && (io.MouseDown[0] || io.MouseDown[1] || io.MouseDown[2]);
}

ShowInput Panel::input(const WindowDrags& drags) const {
  const ImGuiIO& io = ImGui::GetIO();
  ShowInput input;
  if (io.WantCaptureMouse || io.DisplaySize.y <= 0) return input;
  const auto& [left, right, middle] = drags;
  if (right != V2d(0, 0) || io.KeyCtrl) {
    input.grip = ShowInput::Grip::light;
  } else {
    input.grip = middle != V2d(0, 0) || io.KeyShift ? ShowInput::Grip::pan : ShowInput::Grip::turn;
  }
  const V2d drag = (left + right + middle) / static_cast<double>(io.DisplaySize.y);
  input.drag = V2d(drag.x, -drag.y);
  input.wheel = static_cast<double>(io.MouseWheel);
  if (const std::optional<V2d> at = cursor()) input.cursor = V2d(2 * at->x - 1, 1 - 2 * at->y);
  return input;
}

std::optional<V2d> Panel::cursor() const {
  const ImGuiIO& io = ImGui::GetIO();
  if (io.WantCaptureMouse || !ImGui::IsMousePosValid()) return std::nullopt;
  // The centre of the pixel under the mouse.
  const V2d size(static_cast<double>(io.DisplaySize.x - width()), static_cast<double>(io.DisplaySize.y));
  const V2d mouse(std::floor(static_cast<double>(io.MousePos.x)),
                  std::floor(static_cast<double>(io.MousePos.y)));
  const V2d point = (mouse + V2d(0.5)) / size;
  if (!(point.x >= 0 && point.x < 1 && point.y >= 0 && point.y < 1)) return std::nullopt;
  return point;
}

void Panel::handle_keys(const PanelInfo& info, ShowState& state, PanelRequest& request) {
  const auto pressed = [&](char key) { return info.keys.find(key) != std::string::npos; };
  if (pressed(escape_key)) request.close = true;
  if (ImGui::GetIO().WantTextInput) return;
  if (pressed('H')) shown_ = !shown_;
  if (pressed('R')) request.resets_camera = true;
  if (pressed('P')) state.probes = !state.probes;
  const auto fabrics = static_cast<int>(info.picture.fabrics().size());
  if (pressed('F')) raise(request.change, next_fabrics(fabrics, state), Change::scene);
  if (pressed('E')) {
    state.texel_edges = !state.texel_edges;
    raise(request.change, true, Change::frame);
  }
}

void Panel::edit_view(const PanelInfo& info, ShowState& state, PanelRequest& request) {
  label("path");
  raise(request.change, choose("##path", path_names, state.path, false), Change::scene);
  std::size_t levels = 1;
  for (const Fabric& fabric : info.picture.fabrics())
    levels = std::max(levels, static_cast<std::size_t>(fabric.first_level()) + fabric.levels.size());
  const std::string shown = state.levels.forced < 0 ? "by footprint" : fmt::format("{}", state.levels.forced);
  slider(request.change, "level", state.levels.forced, -1, static_cast<int>(levels) - 1, shown.c_str());
  box(request.change, "blend two levels", state.levels.blend);
  slider(request.change, "layers", state.layers, 1, max_layers);
  box(request.change, "texel edges (E)", state.texel_edges);
  ImGui::SameLine();
  if (ImGui::Button("first view (R)")) request.resets_camera = true;
}

void Panel::edit_light(const PanelInfo& info, ShowState& state, PanelRequest& request) {
  auto stops = static_cast<float>(std::log2(state.display.exposure / std::numbers::pi_v<float>));
  label("exposure");
  if (ImGui::SliderFloat("##exposure", &stops, -8, 8, "%+.2f stops")) {
    state.display.exposure = std::numbers::pi_v<float> * std::exp2(stops);
    raise(request.change, true, Change::display);
  }
  auto tone = static_cast<int>(state.display.tone);
  label("tone curve");
  raise(request.change, choose("##tone", tone_curve_names, tone, false), Change::display);
  state.display.tone = static_cast<ToneCurve>(tone);
  label("background");
  V3f background = each(state.display.background.value_or(V3f(0, 0, 0)), linear_to_srgb);
  if (ImGui::ColorEdit3("##background", &background.x,
                        ImGuiColorEditFlags_Float | ImGuiColorEditFlags_NoInputs)) {
    state.display.background = each(background, srgb_to_linear);
    raise(request.change, true, Change::display);
  }
  for (std::size_t i = 0; i < state.lights.size(); ++i) {
    Light& light = state.lights[i];
    ImGui::PushID(static_cast<int>(i));
    ImGui::AlignTextToFramePadding();
    if (ImGui::RadioButton(fmt::format("light {}", i + 1).c_str(), state.held_light == i))
      state.held_light = i;
    if (ImGui::IsItemHovered())
      ImGui::SetTooltip("%s", light.kind == LightKind::directional
                                  ? "the light that drags turn"
                                  : "stands in the scene: drags do not turn it");
    ImGui::SameLine(label_width);
    ImGui::SetNextItemWidth(-1);
    float strength = std::max({light.irradiance.x, light.irradiance.y, light.irradiance.z});
    const V3f colour = strength > 0 ? light.irradiance / strength : V3f(1, 1, 1);
    if (ImGui::SliderFloat("##strength", &strength, 0, 10, "%.2f", ImGuiSliderFlags_Logarithmic)) {
      light.irradiance = colour * std::max(strength, 0.0F);
      raise(request.change, true, Change::frame);
    }
    ImGui::PopID();
  }
  const auto is_plain = [](const SceneMaterial& material) { return !material.fabric; };
  const std::vector<SceneMaterial>& materials = info.picture.scene().materials;
  if (std::any_of(materials.begin(), materials.end(), is_plain)) {
    label("all around");
    raise(request.change, ImGui::SliderFloat("##ambient", &state.ambient, 0, 1, "%.2f"), Change::frame);
  }
  bool casts = state.shadows > 0;
  if (box(request.change, "shadows", casts)) state.shadows = casts ? default_shadow_size : 0;
  label("");
  bool follows = state.lights_in_camera_frame;
  if (ImGui::Checkbox("lights follow the camera", &follows)) switch_light_frame(info.picture.camera(), state);
}

void Panel::edit_fabrics(const PanelInfo& info, ShowState& state, PanelRequest& request) {
  const std::vector<SceneMaterial>& materials = info.picture.scene().materials;
  for (std::size_t i = 0; i < materials.size(); ++i) {
    if (!materials[i].fabric) continue;
    ImGui::PushID(static_cast<int>(i));
    label(materials[i].name.empty() ? "material" : materials[i].name.c_str());
    raise(request.change, choose("##fabric", info.picture.fabric_names(), state.fabrics[i], true),
          Change::scene);
    ImGui::PopID();
  }
  label("another");
  if (ImGui::InputTextWithHint("##path", "fabric file, Enter", &path_,
                               ImGuiInputTextFlags_EnterReturnsTrue) &&
      !path_.empty()) {
    request.add_fabric = path_;
    path_.clear();
  }
}

PanelRequest Panel::edit(const PanelInfo& info, ShowState& state) {
  PanelRequest request;
  handle_keys(info, state, request);
  if (!shown_) return request;
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  constexpr float ball = 30;
  draw_lights(info, state, ImVec2(ball + 14, size.y - ball - 14), ball);
  ImGui::SetNextWindowPos(ImVec2(size.x - panel_width, 0));
  ImGui::SetNextWindowSize(ImVec2(panel_width, size.y));
  ImGui::Begin("panel", nullptr,
               ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse |
                   ImGuiWindowFlags_NoMove);
  ImGui::PushStyleColor(ImGuiCol_Text, ImVec4(1, 0.55F, 0.4F, 1));
  if (!info.message.empty()) ImGui::TextWrapped("%s", info.message.c_str());
  for (const Error& warning : info.picture.warnings()) ImGui::TextWrapped("%s", to_line(warning).c_str());
  ImGui::PopStyleColor();
  const auto opens = [](const char* title, bool open) {
    return ImGui::CollapsingHeader(title, open ? ImGuiTreeNodeFlags_DefaultOpen : 0);
  };
  if (opens("Picture", true)) edit_view(info, state, request);
  if (opens("Light", true)) edit_light(info, state, request);
  if (opens("Fabric", true)) edit_fabrics(info, state, request);
  if (opens("Probe", true)) {
    ImGui::Checkbox("follow the mouse (P)", &state.probes);
    show_probe(info);
  }
  if (opens("Time", true)) show_times(info);
  if (opens("Mouse and keys", false)) show_help();
  ImGui::End();
  return request;
}

void Panel::end(unsigned picture, unsigned overlay) {
  const ImGuiIO& io = ImGui::GetIO();
  const ImVec2 size(io.DisplaySize.x - width(), io.DisplaySize.y);
  ImDrawList& behind = *ImGui::GetBackgroundDrawList();
  const auto image = [&](unsigned texture) {
    behind.AddImage(reinterpret_cast<ImTextureID>(static_cast<std::uintptr_t>(texture)), ImVec2(0, 0), size);
  };
  image(picture);
  if (overlay != 0) image(overlay);
  ImGui::Render();
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

}  // namespace selvedge
