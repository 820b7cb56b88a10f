#include "apps/selvedge-view/panel.h"

#include <fmt/format.h>
#include <imgui/backends/imgui_impl_glfw.h>
#include <imgui/backends/imgui_impl_opengl3.h>
#include <imgui/imgui.h>
#include <imgui/imgui_stdlib.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>

#include "viewer/hybrid/layers.h"

namespace selvedge {
namespace {

/// Lengths of the panel on a screen of 1 x, and on this one.
constexpr float font_size = 14;
float scaled(float length) { return length * ImGui::GetFontSize() / font_size; }

float label_width() { return scaled(92); }

/// One line of a list: a grey label on the left, its value beside it.
template <class... Arguments>
void row(const char* name, fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  ImGui::TextDisabled("%s", name);
  ImGui::SameLine(label_width());
  ImGui::TextUnformatted(fmt::format(format, std::forward<Arguments>(arguments)...).c_str());
}

/// A label; the widget that follows takes the rest of the line.
void label(const char* name) {
  ImGui::AlignTextToFramePadding();
  ImGui::TextDisabled("%s", name);
  ImGui::SameLine(label_width());
  ImGui::SetNextItemWidth(-1);
}

void widen_redraw(Redraw& change, bool changed, Redraw to) {
  if (changed) change = std::max(change, to);
}

/// Lines of the panel that edit values of the frame.
template <class Number>
bool slider(Redraw& change, const char* name, Number& value, std::type_identity_t<Number> min,
            std::type_identity_t<Number> max, const char* format = "%d", ImGuiSliderFlags flags = 0) {
  constexpr int type = std::is_integral_v<Number> ? ImGuiDataType_S32 : ImGuiDataType_Float;
  label(name);
  const bool changed =
      ImGui::SliderScalar(fmt::format("##{}", name).c_str(), type, &value, &min, &max, format, flags);
  widen_redraw(change, changed, Redraw::frame);
  return changed;
}

bool check_box(Redraw& change, const char* name, bool& value) {
  label("");
  const bool changed = ImGui::Checkbox(name, &value);
  widen_redraw(change, changed, Redraw::frame);
  return changed;
}

/// A drop-down list, of which a choice needs the redraw `to`. `none`, unless empty, is the name of -1.
/// Returns whether the choice changed.
template <class Names>
bool choose(Redraw& change, const char* id, const Names& names, int& chosen, Redraw to,
            const std::string& none = {}) {
  const auto name_of = [&](int i) { return i < 0 ? none : std::string(names[i]); };
  bool changed = false;
  if (!ImGui::BeginCombo(id, name_of(chosen).c_str())) return false;
  for (int i = none.empty() ? 0 : -1; i < static_cast<int>(names.size()); ++i) {
    ImGui::PushID(i);
    if (ImGui::Selectable(name_of(i).c_str(), i == chosen)) {
      changed = i != chosen;
      chosen = i;
    }
    ImGui::PopID();
  }
  ImGui::EndCombo();
  widen_redraw(change, changed, to);
  return changed;
}

std::string columns_of(const V3f& v) { return fmt::format("{: .3f} {: .3f} {: .3f}", v.x, v.y, v.z); }

/// Drawn over the picture, of this width: in the panel the text would move the widgets under the cursor.
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

/// Draws the lights' directions seen from the camera: a hemisphere from the front, lights behind it hollow.
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

constexpr float panel_width = 330;

constexpr std::array<std::string_view, 4> quarter_turns{"0 deg", "90 deg", "180 deg", "270 deg"};

/// The name of the first fabric that is worn.
std::string choice_name(const FabricChoice& choice, const std::vector<std::string>& fabrics) {
  for (const int fabric : choice.fabrics)
    if (fabric >= 0 && fabric < static_cast<int>(fabrics.size())) return fabrics[fabric];
  return "core material";
}

V3f each(const V3f& v, float (*function)(float)) { return {function(v.x), function(v.y), function(v.z)}; }

void set_style(float scale) {
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
  style.ScaleAllSizes(scale);
  // Easier to read than the built-in font, if installed.
  constexpr const char* font = "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf";
  std::error_code missing;
  if (std::filesystem::exists(font, missing))
    ImGui::GetIO().Fonts->AddFontFromFileTTF(font, font_size * scale);
  else
    ImGui::GetIO().FontGlobalScale = scale;
}

}  // namespace

V2i picture_size(const Window& window) {
  const V2i size = window.size();
  const auto panel = static_cast<int>(panel_width * window.scale());
  return {size.x > 2 * panel ? size.x - panel : std::max(size.x, 1), std::max(size.y, 1)};
}

Panel::Panel(const Window& window) {
  IMGUI_CHECKVERSION();
  ImGui::CreateContext();
  // ImGui's settings file would appear beside the garment.
  ImGui::GetIO().IniFilename = nullptr;
  set_style(window.scale());
  ImGui_ImplGlfw_InitForOpenGL(window.handle(), true);
  ImGui_ImplOpenGL3_Init("#version 450 core");
}

Panel::~Panel() {
  ImGui_ImplOpenGL3_Shutdown();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext();
}

void Panel::copy(const std::string& text) { ImGui::SetClipboardText(text.c_str()); }

void Panel::begin() {
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
}

float Panel::width() const {
  const float wanted = scaled(panel_width);
  return shown_ && ImGui::GetIO().DisplaySize.x > 2 * wanted ? wanted : 0;
}

V2i Panel::picture_size(const V2i& window) const {
  const float all = ImGui::GetIO().DisplaySize.x;
  const float fraction = all > 0 ? 1 - width() / all : 1.0F;
  return {static_cast<int>(std::lround(static_cast<float>(window.x) * fraction)), window.y};
}

bool Panel::is_mouse_pressed() const {
  const ImGuiIO& io = ImGui::GetIO();
  return !io.WantCaptureMouse && (io.MouseDown[0] || io.MouseDown[1] || io.MouseDown[2]);
}

ShowInput Panel::input(const WindowDrags& drags) const {
  const ImGuiIO& io = ImGui::GetIO();
  ShowInput input;
  if (io.WantCaptureMouse || io.DisplaySize.y <= 0) return input;
  const auto& [left, right, middle] = drags;
  if (right != V2d(0, 0) || io.KeyCtrl)
    input.grip = ShowInput::Grip::light;
  else
    input.grip = middle != V2d(0, 0) || io.KeyShift ? ShowInput::Grip::pan : ShowInput::Grip::turn;
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
  if (pressed('P')) state.shows_probe = !state.shows_probe;
  const auto fabrics = static_cast<int>(info.picture.fabric_names.size());
  if (pressed('F')) widen_redraw(request.redraw, wear_next_fabric(fabrics, state), Redraw::scene);
  if (pressed('C')) widen_redraw(request.redraw, toggle_core_materials(state), Redraw::scene);
  if (pressed('B')) widen_redraw(request.redraw, true, toggle_comparison(state));
  if (state.clip >= 0 && pressed(' ')) state.plays_clip = !state.plays_clip;
  for (const char key : {'<', '>'}) {
    if (state.clip < 0 || !pressed(key)) continue;
    state.plays_clip = false;
    state.clip_time = std::max(state.clip_time + (key == '<' ? -1.0 : 1.0) / 30, 0.0);
    widen_redraw(request.redraw, true, Redraw::frame);
  }
  request.saves_picture = pressed('S');
  request.saves_garment = pressed('D');
}

void Panel::edit_view(const PanelInfo& info, ShowState& state, PanelRequest& request) {
  label("path");
  choose(request.redraw, "##path", path_names, state.path, Redraw::scene);
  const std::string shown =
      state.levels.forced_level < 0 ? "by footprint" : fmt::format("{}", state.levels.forced_level);
  slider(request.redraw, "level", state.levels.forced_level, -1, info.picture.levels - 1, shown.c_str());
  slider(request.redraw, "layers", state.layers, 1, max_layers);
  if (ImGui::Button("first view (R)")) request.resets_camera = true;
  ImGui::SameLine();
  if (ImGui::Button("save (S)")) request.saves_picture = true;
  ImGui::SameLine();
  if (ImGui::Button("copy command")) request.copies_command = true;
}

void Panel::edit_clip(const PanelInfo& info, ShowState& state, PanelRequest& request) {
  label("clip");
  if (choose(request.redraw, "##clip", info.picture.clips, state.clip, Redraw::frame)) state.clip_time = 0;
  ImGui::Checkbox("play (space)", &state.plays_clip);
  auto time = static_cast<float>(state.clip_time);
  if (slider(request.redraw, "time", time, 0, static_cast<float>(info.picture.clip_seconds), "%.2f s")) {
    state.plays_clip = false;
    state.clip_time = static_cast<double>(time);
  }
  slider(request.redraw, "speed", state.clip_speed, 0.1F, 4, "%.2f", ImGuiSliderFlags_Logarithmic);
}

void Panel::edit_light(ShowState& state, PanelRequest& request) {
  const float usual = default_exposure(state);
  float stops = std::log2(state.display.exposure / usual);
  label("exposure");
  if (ImGui::SliderFloat("##exposure", &stops, -8, 8, "%+.2f stops")) {
    state.display.exposure = usual * std::exp2(stops);
    widen_redraw(request.redraw, true, Redraw::display);
  }
  auto tone_curve = static_cast<int>(state.display.tone_curve);
  label("tone curve");
  choose(request.redraw, "##tone", tone_curve_names, tone_curve, Redraw::display);
  state.display.tone_curve = static_cast<ToneCurve>(tone_curve);
  label("background");
  V3f background = each(state.display.background.value_or(V3f(0, 0, 0)), linear_to_srgb);
  if (ImGui::ColorEdit3("##background", &background.x,
                        ImGuiColorEditFlags_Float | ImGuiColorEditFlags_NoInputs)) {
    state.display.background = each(background, srgb_to_linear);
    widen_redraw(request.redraw, true, Redraw::display);
  }
  for (std::size_t i = 0; i < state.lights.size(); ++i) {
    Light& light = state.lights[i];
    ImGui::PushID(static_cast<int>(i));
    ImGui::AlignTextToFramePadding();
    if (ImGui::RadioButton(fmt::format("light {}", i + 1).c_str(), state.dragged_light == i))
      state.dragged_light = i;
    if (ImGui::IsItemHovered())
      ImGui::SetTooltip("%s", light.kind == LightKind::directional
                                  ? "the light that drags turn"
                                  : "stands in the scene: drags do not turn it");
    ImGui::SameLine(label_width());
    ImGui::SetNextItemWidth(-1);
    float strength = std::max({light.irradiance.x, light.irradiance.y, light.irradiance.z});
    const V3f colour = strength > 0 ? light.irradiance / strength : V3f(1, 1, 1);
    if (ImGui::SliderFloat("##strength", &strength, 0, 10, "%.2f", ImGuiSliderFlags_Logarithmic)) {
      light.irradiance = colour * std::max(strength, 0.0F);
      widen_redraw(request.redraw, true, Redraw::frame);
    }
    ImGui::PopID();
  }
  std::vector<std::string> names;
  for (const auto& environment : state.environments)
    names.push_back(environment->name.substr(environment->name.find_last_of('/') + 1));
  label("environment");
  if (choose(request.redraw, "##environment", names, state.environment, Redraw::frame, "none"))
    state.display.exposure *= default_exposure(state) / usual;
  if (state.environment >= 0) {
    slider(request.redraw, "turned", state.environment_turn, -180, 180, "%.0f degrees");
    slider(request.redraw, "strength", state.environment_strength, 0, 10, "%.2f",
           ImGuiSliderFlags_Logarithmic);
    check_box(request.redraw, "backdrop", state.has_backdrop);
    slider(request.redraw, "blurred", state.backdrop_roughness, 0, 1, "%.2f");
  }
  slider(request.redraw, "all around", state.ambient_irradiance, 0, 1, "%.2f");
  bool casts = state.shadow_map_size > 0;
  if (check_box(request.redraw, "shadows", casts)) state.shadow_map_size = casts ? default_shadow_size : 0;
  label("");
  bool follows = state.lights_in_camera_frame;
  if (ImGui::Checkbox("lights follow the camera", &follows)) switch_light_frame(state);
}

/// Pictures of the fabrics of a folder, as many in a row as have room.
void Panel::edit_offers(const PanelInfo& info, PanelRequest& request) {
  constexpr float side = 66;
  const float end = ImGui::GetCursorScreenPos().x + ImGui::GetContentRegionAvail().x;
  const ImGuiStyle& style = ImGui::GetStyle();
  for (std::size_t i = 0; i < info.offers.size(); ++i) {
    const OfferThumbnail& offer = *info.offers[i];
    const auto texture = reinterpret_cast<ImTextureID>(static_cast<std::uintptr_t>(offer.picture.name()));
    ImGui::PushID(static_cast<int>(i));
    if (ImGui::ImageButton(texture, ImVec2(scaled(side), scaled(side)))) request.wear_path = offer.path;
    ImGui::PopID();
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", offer.path.c_str());
    const float next = ImGui::GetItemRectMax().x + style.ItemSpacing.x + ImGui::GetItemRectSize().x;
    if (next <= end && i + 1 < info.offers.size()) ImGui::SameLine();
  }
}

/// The bar between what is worn and what was, over the picture.
void Panel::edit_bar(const PanelInfo& info, ShowState& state, PanelRequest& request) const {
  if (!state.compared_fabrics) return;
  const float grip = scaled(8);
  const float height = ImGui::GetIO().DisplaySize.y;
  const float all = ImGui::GetIO().DisplaySize.x - width();
  float x = state.comparison_bar * all;
  ImGui::SetNextWindowPos(ImVec2(x - grip, 0));
  ImGui::SetNextWindowSize(ImVec2(2 * grip, height));
  ImGui::PushStyleVar(ImGuiStyleVar_WindowMinSize, ImVec2(1, 1));
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(0, 0));
  ImGui::Begin("bar", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoBackground | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_NoSavedSettings);
  ImGui::InvisibleButton("grip", ImVec2(2 * grip, height));
  const bool held = ImGui::IsItemActive();
  if (held || ImGui::IsItemHovered()) ImGui::SetMouseCursor(ImGuiMouseCursor_ResizeEW);
  if (held && ImGui::GetIO().MouseDelta.x != 0) {
    x = std::clamp(ImGui::GetIO().MousePos.x, 0.0F, std::max(all, 1.0F));
    state.comparison_bar = x / std::max(all, 1.0F);
    widen_redraw(request.redraw, true, Redraw::display);
  }
  ImGui::End();
  ImGui::PopStyleVar(2);
  ImDrawList& draw = *ImGui::GetForegroundDrawList();
  constexpr ImU32 white = IM_COL32(255, 255, 255, 220);
  draw.AddLine(ImVec2(x, 0), ImVec2(x, height), white, scaled(1.5F));
  draw.AddCircleFilled(ImVec2(x, height / 2), scaled(6), white);
  const auto tell = [&](const FabricChoice& choice, bool on_left) {
    const std::string name = choice_name(choice, info.picture.fabric_names);
    const ImVec2 size = ImGui::CalcTextSize(name.c_str());
    const ImVec2 at(on_left ? x - size.x - grip : x + grip, scaled(10));
    draw.AddRectFilled(ImVec2(at.x - 4, at.y - 2), ImVec2(at.x + size.x + 4, at.y + size.y + 2),
                       IM_COL32(0, 0, 0, 140), 3);
    draw.AddText(at, white, name.c_str());
  };
  tell(*state.compared_fabrics, true);
  tell(state.worn_fabrics, false);
}

void Panel::edit_fabrics(const PanelInfo& info, ShowState& state, PanelRequest& request) {
  const std::vector<std::string>& materials = info.picture.materials;
  // For a moment the picture may be of another scene than the state.
  for (std::size_t i = 0; i < std::min(materials.size(), state.worn_fabrics.fabrics.size()); ++i) {
    if (materials[i].empty()) continue;
    ImGui::PushID(static_cast<int>(i));
    label(materials[i].c_str());
    choose(request.redraw, "##fabric", info.picture.fabric_names, state.worn_fabrics.fabrics[i],
           Redraw::scene, "(core material)");
    FabricFit& fit = state.worn_fabrics.fits[i];
    label("size, turn");
    auto size = static_cast<float>(fit.stitch_scale);
    ImGui::SetNextItemWidth(-scaled(80));
    widen_redraw(request.redraw,
                 ImGui::SliderFloat("##size", &size, 0.1F, 10, "%.2f x", ImGuiSliderFlags_Logarithmic),
                 Redraw::scene);
    fit.stitch_scale = std::max(static_cast<double>(size), 1e-3);
    ImGui::SameLine();
    ImGui::SetNextItemWidth(-1);
    choose(request.redraw, "##turn", quarter_turns, fit.quarter_turns, Redraw::scene);
    label("tint");
    V3f tint = each(fit.tint, linear_to_srgb);
    if (ImGui::ColorEdit3("##tint", &tint.x, ImGuiColorEditFlags_DisplayHex)) {
      fit.tint = each(tint, srgb_to_linear);
      widen_redraw(request.redraw, true, Redraw::scene);
    }
    ImGui::PopID();
  }
  edit_offers(info, request);
  if (ImGui::Button(state.compared_fabrics ? "end comparison (B)" : "compare with this (B)"))
    widen_redraw(request.redraw, true, toggle_comparison(state));
  ImGui::SameLine();
  if (ImGui::Button("save garment (D)")) request.saves_garment = true;
  label("another");
  if (ImGui::InputTextWithHint("##path", "fabric, folder, garment, environment", &path_,
                               ImGuiInputTextFlags_EnterReturnsTrue) &&
      !path_.empty()) {
    request.add_file = path_;
    path_.clear();
  }
}

PanelRequest Panel::edit(const PanelInfo& info, ShowState& state) {
  PanelRequest request;
  handle_keys(info, state, request);
  edit_bar(info, state, request);
  show_messages(info, ImGui::GetIO().DisplaySize.x - width());
  if (!shown_) return request;
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  const float ball = scaled(30);
  draw_lights(info, state, ImVec2(ball + 14, size.y - ball - 14), ball);
  ImGui::SetNextWindowPos(ImVec2(size.x - scaled(panel_width), 0));
  ImGui::SetNextWindowSize(ImVec2(scaled(panel_width), size.y));
  ImGui::Begin("panel", nullptr,
               ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse |
                   ImGuiWindowFlags_NoMove);
  const auto opens = [](const char* title, bool open) {
    return ImGui::CollapsingHeader(title, open ? ImGuiTreeNodeFlags_DefaultOpen : 0);
  };
  if (opens("Picture", true)) edit_view(info, state, request);
  if (state.clip >= 0 && !info.picture.clips.empty() && opens("Clip", true)) edit_clip(info, state, request);
  if (opens("Light", true)) edit_light(state, request);
  if (opens("Fabric", true)) edit_fabrics(info, state, request);
  if (opens("Probe", true)) {
    ImGui::Checkbox("follow the mouse (P)", &state.shows_probe);
    show_probe(info);
  }
  if (opens("Time", true)) show_times(info);
  if (opens("Mouse and keys", false)) show_help();
  ImGui::End();
  return request;
}

void Panel::end(unsigned picture) {
  const ImGuiIO& io = ImGui::GetIO();
  const ImVec2 size(io.DisplaySize.x - width(), io.DisplaySize.y);
  const auto texture = reinterpret_cast<ImTextureID>(static_cast<std::uintptr_t>(picture));
  ImGui::GetBackgroundDrawList()->AddImage(texture, ImVec2(0, 0), size);
  ImGui::Render();
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

}  // namespace selvedge
