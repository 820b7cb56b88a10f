// Widgets that the parts of the panel of `show` share, and those that only display (Dear ImGui).
#pragma once

#include <fmt/format.h>
#include <imgui/imgui.h>

#include <algorithm>
#include <string>

#include "apps/selvedge-view/panel.h"

namespace selvedge {

/// Lengths of the panel on a screen of 1 x, and on this one.
inline constexpr float font_size = 14;
inline float scaled(float length) { return length * ImGui::GetFontSize() / font_size; }

inline float label_width() { return scaled(92); }

/// One line of a list: a grey label on the left, its value beside it.
template <class... Arguments>
void row(const char* name, fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  ImGui::TextDisabled("%s", name);
  ImGui::SameLine(label_width());
  ImGui::TextUnformatted(fmt::format(format, std::forward<Arguments>(arguments)...).c_str());
}

/// A label; the widget that follows takes the rest of the line.
inline void label(const char* name) {
  ImGui::AlignTextToFramePadding();
  ImGui::TextDisabled("%s", name);
  ImGui::SameLine(label_width());
  ImGui::SetNextItemWidth(-1);
}

inline void widen_redraw(Redraw& change, bool changed, Redraw to) {
  if (changed) change = std::max(change, to);
}

/// Lines of the panel that edit values of the frame.
inline void slider(Redraw& change, const char* name, int& value, int min, int max,
                   const char* format = "%d") {
  label(name);
  widen_redraw(change, ImGui::SliderInt(fmt::format("##{}", name).c_str(), &value, min, max, format),
               Redraw::frame);
}

inline void slider(Redraw& change, const char* name, float& value, float min, float max, const char* format,
                   ImGuiSliderFlags flags = 0) {
  label(name);
  widen_redraw(change, ImGui::SliderFloat(fmt::format("##{}", name).c_str(), &value, min, max, format, flags),
               Redraw::frame);
}

inline bool check_box(Redraw& change, const char* name, bool& value) {
  label("");
  const bool changed = ImGui::Checkbox(name, &value);
  widen_redraw(change, changed, Redraw::frame);
  return changed;
}

/// A drop-down list. `none`, unless empty, is the name of -1. Returns whether the
/// choice changed.
template <class Names>
bool choose(const char* id, const Names& names, int& chosen, const std::string& none = {}) {
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
  return changed;
}

/// Drawn over the picture, of this width: in the panel the text would move the widgets under the cursor.
void show_messages(const PanelInfo& info, float width);
void show_probe(const PanelInfo& info);
void show_times(const PanelInfo& info);
void show_help();
/// Draws the lights' directions seen from the camera: a hemisphere from the front, lights behind it hollow.
void draw_lights(const PanelInfo& info, const ShowState& state, const ImVec2& centre, float radius);

}  // namespace selvedge
